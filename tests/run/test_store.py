"""The store of a run: what is read again is what was written, and nothing that is damaged is believed."""

import fcntl
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from same_facts import facts

from contactverif import MisuseError, Outcome, Run, Subject, Verdict, load_formulation, load_properties, named_case
from contactverif.contract.property import Finding, Measurement, PropertyInfo, Quantity, judge_stored
from contactverif.plugins.provenance import machine
from contactverif.run import run as driver
from contactverif.run.journal import hold_journal, journal_folder, new_journal, read_messages, remove_journal
from contactverif.run.rows import find_missing
from contactverif.run.run import RunStopped, run
from contactverif.run.run_options import RunOptions
from contactverif.run.scheduler import Progress
from contactverif.run.store import Plan, Store, Writer, check_versions, read_plan
from contactverif.sampling.draw import Sampling

NAMES = ("nts", "vts-ppt")
PROPERTY_IDS = ("hard.deep", "patch.flat.resultant", "patch.flat.transmission")  # A list, and one strategy for two.
EXAMPLES = 30
OPTIONS = RunOptions(names=NAMES, properties=PROPERTY_IDS, examples=EXAMPLES, seed=3)
PLAN = Plan(options=OPTIONS, versions={"numpy_version": "2"}, machine=machine())


def judge(store: Store | None, progress: Any = None) -> Run:
    subjects = [load_formulation(name) for name in NAMES]
    return run(subjects, load_properties(PROPERTY_IDS), examples=EXAMPLES, seed=3, store=store, progress=progress)


def journal_of(folder: Path, plan: Plan = PLAN) -> Path:
    """Return the folder of a new journal."""
    with new_journal(folder / "r.journal", plan):
        return folder / "r.journal"


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    """Return a run, and the folder of its journal."""
    folder = journal_of(tmp_path_factory.mktemp("journal"))
    return judge(Store(PLAN, folder)), folder


ERROR, OTHER = Quantity("error", "ξ", "a reason"), Quantity("other", "", "", sense="at least", unit="N")
INFO = PropertyInfo("of.one", "of", "One.", (ERROR, OTHER))
SMALL_PLAN = Plan(options=RunOptions(names=("mine", "other"), properties=(INFO.id,), examples=20))


def outcome(number: float) -> Outcome:
    """Return an outcome with everything that one can have."""
    measured = Measurement(
        [ERROR.check(number, 1e-9), OTHER.check(np.nan, -0.0)],
        broken="ξ",
        finding=Finding("row 3", (number,), (np.nan,), remark="ξ"),
        details={"steps": 3.0},
        series={"residual": np.array([1.0, np.inf, number])},
        idle=True,
    )
    return judge_stored(INFO, Outcome(named_case("c"), Verdict.PASS, "", measured, 0.25))


def describe(item: Outcome) -> str:
    return repr(replace(item, case_or_summary=item.summary))


def write(folder: Path, outcomes: dict[tuple[int, int], Outcome], session: str = "a") -> Path:
    """Write {(row, number): outcome} into a new journal, and return its file."""
    journal = journal_of(folder, SMALL_PLAN)
    for (row, number), item in outcomes.items():
        Writer(str(journal), session, row, number).add(0, item)
    Writer(str(journal), session, 0, 0).file.close()
    (path,) = journal.glob("*.outcomes")
    return path


def read(path: Path, count: int = 20, formulation: str = "mine") -> dict[int, str]:
    """Return {number: outcome} of those of a row, the witness included."""
    outcomes = Store(SMALL_PLAN, None, [path.parent]).outcomes(formulation, INFO, -1, count + 1)
    return {place - 1: repr(item) for place, item in outcomes.items()}


def test_what_is_read_is_what_was_written(tmp_path: Path) -> None:
    path = write(tmp_path, {(0, number): outcome(number / 3) for number in range(-1, 4)})
    assert read(path) == {number: describe(outcome(number / 3)) for number in range(-1, 4)}
    assert read(path, formulation="other") == {}
    store = Store(SMALL_PLAN, None, [path.parent])
    assert store.numbers("mine", INFO.id) == [-1, 0, 1, 2, 3]
    assert (store.n_outcomes, store.n_records) == (5, 5)


def test_of_two_outcomes_of_a_case_the_last_counts(tmp_path: Path) -> None:
    writer = Writer(str(journal_of(tmp_path, SMALL_PLAN)), "b", 0, 3)
    for number in (1.0, 2.0):
        writer.add(0, outcome(number))
    writer.file.close()
    store = Store(SMALL_PLAN, None, [tmp_path / "r.journal"])
    assert (store.n_outcomes, store.n_records) == (1, 2)
    assert repr(store.outcomes("mine", INFO, 3, 1)[0]) == describe(outcome(2.0))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"breach": np.True_, "verdict": Verdict.FAIL}, {}),
        ({"reason": "\ud800", "measurement": None}, {"reason": "\\ud800", "measurement": None}),
    ],
)
def test_words_of_a_plugin_are_taken_for_what_they_are(
    tmp_path: Path, change: dict[str, Any], expected: dict[str, Any]
) -> None:
    path = write(tmp_path, {(0, 0): replace(outcome(1.0), **change)})
    assert read(path) == {0: describe(replace(outcome(1.0), **expected))}


def test_verdicts_follow_from_numbers_and_a_pass_without_numbers_is_none(tmp_path: Path) -> None:
    wrong = replace(outcome(1.0), verdict=Verdict.PASS, reason="")
    nothing = Outcome(named_case("c"), Verdict.PASS)
    crash = replace(nothing, verdict=Verdict.CRASHED, reason="signal 9")
    path = write(tmp_path, {(0, 0): wrong, (0, 1): nothing, (0, 2): crash})
    assert read(path) == {0: describe(outcome(1.0)), 2: describe(crash)}


def test_a_damaged_file_is_read_up_to_the_damage(tmp_path: Path) -> None:
    path = write(tmp_path, {(0, number): outcome(float(number)) for number in range(20)})
    data = path.read_bytes()
    places = [place for place, _ in read_messages(path)]
    chance = random.Random(1)
    for _ in range(200):
        byte = chance.randrange(len(data))
        damaged = bytearray(data[: chance.choice([byte, len(data)])])
        if byte < len(damaged):
            damaged[byte] ^= 1 << chance.randrange(8)
        path.write_bytes(damaged)
        whole = sum(end <= byte for end in [*places[1:], len(data)])
        assert [place for place, _ in read_messages(path)] == places[:whole]
        right = {number: describe(outcome(float(number))) for number in range(max(whole - 1, 0))}
        assert read(path) == right  # The first record is a form.


def test_a_record_of_no_row_or_case_is_not_believed_and_takes_no_memory(tmp_path: Path) -> None:
    places = ((0, 0), (5, 0), (-1, 0), (0, 10**9), (0, -7), (0, 10**12))
    path = write(tmp_path, {place: outcome(1.0) for place in places})
    assert Store(SMALL_PLAN, None, [path.parent]).n_outcomes == 1
    large = Plan(options=replace(SMALL_PLAN.options, examples=10**12))
    assert Store(large, None, [path.parent]).numbers("mine", INFO.id) == [0, 10**9, 10**12]


@pytest.mark.parametrize("share", [0.0, 0.02, 0.4, 0.8, 1.0])
def test_a_run_that_goes_on_keeps_what_is_judged_and_gives_the_same(
    unbroken: tuple[Run, Path], tmp_path: Path, share: float
) -> None:
    """The journal ends anywhere, as if the process had been killed there."""
    result, folder = unbroken
    (path,) = folder.glob("*.outcomes")
    data = path.read_bytes()
    journal = tmp_path / "r.journal"
    shutil.copytree(folder, journal)
    (journal / path.name).write_bytes(data[: int(share * len(data))])
    again = judge(Store(PLAN, journal, [journal]))
    assert facts(again) == facts(result)
    complete = Store(PLAN, None, [journal])
    n_cases = sum(len(row.outcomes) + (row.witness is not None) for row in result.rows)
    assert (complete.n_outcomes, complete.n_records) == (n_cases, n_cases)
    if share == 1.0:
        assert [row.seconds for row in again.rows] == [row.seconds for row in result.rows]


def test_a_block_that_is_judged_is_not_drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Only a block of which cases stay whole is drawn again, and what stays whole stays so."""
    for name, number in {"sampling.draw.BLOCK": 10, "run.run.BLOCK": 10, "run.rows.WHOLE": 10}.items():
        monkeypatch.setattr(f"contactverif.{name}", number)
    plan = Plan(options=replace(OPTIONS, names=("vts-ppt",), properties=("patch.flat.resultant",)), machine=machine())
    subjects, questions = [load_formulation("vts-ppt")], load_properties(["patch.flat.resultant"])
    folder = journal_of(tmp_path, plan)
    first = run(subjects, questions, examples=EXAMPLES, seed=3, store=Store(plan, folder))
    numbers: list[int] = []
    draw = driver.draw_chunks

    def draw_chunks(sampling: Sampling, question: Any, number: int, count: object = None) -> object:
        numbers.append(number)
        return draw(sampling, question, number)

    monkeypatch.setattr(driver, "draw_chunks", draw_chunks)
    second = run(subjects, questions, examples=EXAMPLES, seed=3, store=Store(plan, None, [folder]))
    assert numbers == [0]
    assert facts(first) == facts(second)


def test_a_run_that_is_stopped_says_how_far_each_row_is() -> None:
    def interrupt(step: Progress) -> None:
        if (step.formulation, step.property_id, step.count) == ("vts-ppt", "patch.flat.resultant", 28):
            raise KeyboardInterrupt

    with pytest.raises(RunStopped) as stopped:
        judge(None, interrupt)
    *_, second, first = stopped.value.run.rows
    assert (first.verdict, len(first.outcomes)) == (Verdict.PASS, 30)
    assert (second.verdict, second.judged, second.planned) == (Verdict.NOT_JUDGED, 25, 30)
    assert second.reason == "stopped: 25 of 30 cases judged"
    assert not stopped.value.run.promises_kept


# ---------------------------------------------------------------------------------------------------------------------
# The folder


def test_a_new_journal_keeps_the_earlier_file_apart_and_the_stopped_run_aside(tmp_path: Path) -> None:
    report = tmp_path / "r.nc"
    report.write_text("yesterday")
    folder = journal_folder(report)
    with new_journal(folder, PLAN, [report]) as aside:
        assert aside == ""
        assert not report.exists()
    assert read_plan(folder, "--resume") == PLAN
    with new_journal(folder, Plan(options=replace(OPTIONS, seed=4)), [report]) as aside:
        assert aside == "r.nc.journal.earlier"
    assert (folder / "earlier.nc").read_text() == "yesterday"
    assert read_plan(folder, "--resume").options.seed == 4
    assert read_plan(tmp_path / "r.nc.journal.earlier", "--resume").options.seed == 3
    remove_journal(folder)
    assert list(tmp_path.iterdir()) == []


def test_a_mistake_before_anything_is_judged_takes_the_new_journal_back(tmp_path: Path) -> None:
    report, folder = tmp_path / "r.nc", tmp_path / "r.nc.journal"
    report.write_text("yesterday")
    for plan in (PLAN, SMALL_PLAN):
        with suppress(MisuseError), new_journal(folder, plan, [report]):
            assert not report.exists()
            raise MisuseError("NAME", "nothing", "something")
        assert report.read_text() == "yesterday"
        assert [path.name for path in tmp_path.iterdir()] == ["r.nc"]


def test_a_run_that_was_killed_as_it_made_its_journal_leaves_nothing_for_long(tmp_path: Path) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    unfinished, of_another = (tmp_path / f".r.journal.{pid}.part" for pid in (ended.pid, os.getppid()))
    for part in (unfinished, of_another):
        part.mkdir()
    journal_of(tmp_path)  # A process that is alive may be about to finish its own.
    assert sorted(path.name for path in tmp_path.iterdir()) == [of_another.name, "r.journal"]


def test_the_journal_of_a_link_stands_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    (tmp_path / "r.nc").symlink_to(tmp_path / "far" / "real.nc")
    assert journal_folder(tmp_path / "r.nc") == tmp_path / "far" / "real.nc.journal"


def test_two_runs_do_not_share_a_journal_from_its_begin_to_its_end(tmp_path: Path) -> None:
    folder = tmp_path / "r.nc.journal"
    words = "of a run that is going on"
    with new_journal(folder, PLAN):
        with pytest.raises(MisuseError, match=words), new_journal(folder, PLAN):
            pass
        with pytest.raises(MisuseError, match=words), hold_journal(folder, "--resume"):
            pass
    with hold_journal(folder, "--resume"), pytest.raises(MisuseError, match=words), new_journal(folder, PLAN):
        pass
    assert read_plan(folder, "--resume") == PLAN


@pytest.mark.parametrize("moment", ["opens", "locks"])
def test_a_journal_that_another_process_completes_meanwhile_is_gone(
    moment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = journal_of(tmp_path)
    if moment == "opens":
        remove_journal(folder)
    else:
        monkeypatch.setattr(fcntl, "flock", lambda *_: remove_journal(folder))
    words = r"--resume: found no journal r\.journal any more, since another process has completed the run"
    with pytest.raises(MisuseError, match=words), hold_journal(folder, "--resume"):
        pass


def test_a_folder_of_another_kind_is_left_alone(tmp_path: Path) -> None:
    folder = tmp_path / "r.nc.journal"
    folder.mkdir()
    with pytest.raises(MisuseError, match=r"r\.nc\.journal, which is no journal of a run"), new_journal(folder, PLAN):
        pass
    assert folder.exists()


def damages(data: bytes) -> Sequence[bytes]:
    return [b"", data[:-1], data[:4], data[:20] + bytes([data[20] ^ 1]) + data[21:], b"\xff" * len(data)]


@pytest.mark.parametrize("number", range(5))
def test_a_damaged_header_is_one_line(tmp_path: Path, number: int) -> None:
    header = journal_of(tmp_path) / "header"
    header.write_bytes(damages(header.read_bytes())[number])
    with pytest.raises(MisuseError, match=r"--resume: found r\.journal with a damaged header"):
        read_plan(tmp_path / "r.journal", "--resume")


def test_another_version_is_refused_by_its_name() -> None:
    check_versions({"a_version": "1"}, {"a_version": "1"}, "--resume")
    with pytest.raises(MisuseError, match="--resume: found b version: 1 in the journal and 2 here"):
        check_versions({"a_version": "1", "b_version": "1"}, {"a_version": "1", "b_version": "2"}, "--resume")


# ---------------------------------------------------------------------------------------------------------------------
# Fail closed


def test_what_a_run_lacks_is_found(unbroken: tuple[Run, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    result, _ = unbroken
    subjects = [item for name in NAMES if isinstance(item := load_formulation(name), Subject)]

    def missing(*rows: Any) -> str:
        return find_missing(replace(result, rows=rows), subjects, load_properties(PROPERTY_IDS), Sampling(EXAMPLES, 3))

    assert missing(*result.rows) == ""
    *others, row = result.rows
    name = "vts-ppt patch.flat.transmission"
    for block in (500, 10):  # Too many were once accepted if they filled a block.
        monkeypatch.setattr("contactverif.sampling.draw.BLOCK", block)
        for count in (29, 15, 40, 500):
            outcomes = (row.outcomes[:] * 20)[:count]
            words = f"{name}: outcomes of {count} of 30 cases"
            assert missing(*others, replace(row, outcomes=outcomes, planned=count)) == words
    none = replace(row, outcomes=(), planned=0, verdict=Verdict.NOT_APPLICABLE)
    assert missing(*others, none) == f"{name}: outcomes of 0 of 30 cases"
    assert "nts hard.deep: outcomes of 0 of" in missing(replace(result.rows[0], outcomes=()), *result.rows[1:])
    assert "0 rows instead of 1" in missing(*result.rows[1:])
    assert "2 rows instead of 1" in missing(*result.rows * 2)
    assert "no outcome of its witness" in missing(*(replace(row, witness=None) for row in result.rows))
