"""The journal of a run: what is read again is what was noted, and nothing that is damaged is believed."""

import fcntl
import random
import shutil
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from forged_records import BOX
from same_facts import facts

from contactverif import MisuseError, Outcome, Run, Subject, Verdict, load_formulation, load_properties, named_case
from contactverif.contract.measurement import Finding, Measurement, Quantity
from contactverif.journals.journal import (
    JournalKey,
    begin_journal,
    hold_journal,
    journal_folder,
    read_messages,
    remove_journal,
)
from contactverif.journals.known_outcomes import KnownOutcomes
from contactverif.journals.outcome_records import BlockRecord, OutcomeFile
from contactverif.journals.run_journal import Journal
from contactverif.journals.run_plan import Plan, check_versions, read_plan
from contactverif.plugins.provenance import machine
from contactverif.run import run_jobs
from contactverif.run.rows import find_gap
from contactverif.run.run import RunStopped, run
from contactverif.run.scheduler import Progress
from contactverif.sampling.draw import Sampling

NAMES = ("nts", "vts-ppt")
PROPERTY_IDS = ("hard.deep", "patch.flat.resultant", "patch.flat.transmission")  # A list, and one strategy for two.
EXAMPLES = 30
PLAN = Plan(
    formulations=NAMES,
    properties=PROPERTY_IDS,
    examples=EXAMPLES,
    seed=3,
    versions={"numpy_version": "2"},
    machine=machine(),
    options=BOX,
)


def judge(journal: Journal | None) -> Run:
    subjects = [load_formulation(name) for name in NAMES]
    return run(subjects, load_properties(PROPERTY_IDS), examples=EXAMPLES, seed=3, journal=journal)


def new_journal(folder: Path, plan: Plan = PLAN) -> Path:
    """Return the folder of a new journal."""
    begin_journal(folder / "r.journal", plan, [])
    return folder / "r.journal"


def new_file(folder: Path) -> OutcomeFile:
    """Return a file of records of a new journal."""
    journal = new_journal(folder)
    return OutcomeFile(journal, JournalKey.read(journal))


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    """Return a run, and the folder of its journal."""
    folder = new_journal(tmp_path_factory.mktemp("journal"))
    return judge(Journal(PLAN, folder)), folder


def n_cases(result: Run) -> int:
    return sum(len(row.outcomes) + (row.witness is not None) for row in result.rows)


ERROR, OTHER = Quantity("error", "ξ", "a reason"), Quantity("other", "", "", sense="at least", unit="N")


def outcome(number: float) -> Outcome:
    """Return an outcome with everything that one can have."""
    measured = Measurement(
        [ERROR.check(number, 1e-9), OTHER.check(np.nan, -0.0)],
        undecided="a kink",
        finding=Finding("row 3", (number,), (np.nan,), remark="ξ"),
        details={"steps": 3.0},
        series={"residual": np.array([1.0, np.inf, number])},
        idle=True,
    )
    summary = Outcome(named_case("c"), Verdict.PASS).summary
    return Outcome(summary, Verdict.FAIL, "error 3 \N{GREEK SMALL LETTER XI}", measured, 0.25, True)


def test_what_is_read_is_what_was_noted(tmp_path: Path) -> None:
    writer = new_file(tmp_path)
    for number in range(5):
        writer.add_outcome(1, number - 1, outcome(number / 3))
    block = BlockRecord("7/cases", 2, 500, False, True)
    writer.add_block(block)
    writer.file.close()
    known = KnownOutcomes([tmp_path / "r.journal"], 2, 1000)
    assert [repr(known.outcome(1, number - 1)) for number in range(5)] == [repr(outcome(n / 3)) for n in range(5)]
    assert known.outcome(0, 0) is None
    assert known.outcome(1, 4) is None
    assert known.blocks == {("7/cases", 2): block}
    assert (known.n_outcomes, known.n_twice) == (5, 0)
    known.close()


def test_a_number_of_numpy_among_the_words_is_taken_for_what_it_is(tmp_path: Path) -> None:
    writer = new_file(tmp_path)
    whole = outcome(1.0)
    assert whole.measurement is not None
    assert whole.measurement.finding is not None
    measured = replace(
        whole.measurement, idle=np.True_, finding=replace(whole.measurement.finding, place=np.str_("row 3"))
    )
    writer.add_outcome(0, 0, replace(whole, measurement=measured, breach=np.True_))
    writer.file.close()
    known = KnownOutcomes([tmp_path / "r.journal"], 1, 100)
    assert repr(known.outcome(0, 0)) == repr(whole)
    known.close()


def test_half_a_character_in_the_words_of_a_plugin_is_spelled_out(tmp_path: Path) -> None:
    writer = new_file(tmp_path)
    writer.add_outcome(0, 0, replace(outcome(1.0), reason="\ud800"))
    writer.file.close()
    known = KnownOutcomes([tmp_path / "r.journal"], 1, 100)
    stored = known.outcome(0, 0)
    known.close()
    assert stored is not None
    assert stored.reason == "\\ud800"


def test_a_damaged_file_is_read_up_to_the_damage(tmp_path: Path) -> None:
    writer = new_file(tmp_path)
    for number in range(20):
        writer.add_outcome(0, number, outcome(float(number)))
    writer.file.close()
    (path,) = tmp_path.glob("r.journal/*.outcomes")
    data = path.read_bytes()
    places = [place for place, _, _ in read_messages(path, JournalKey())]
    chance = random.Random(1)
    for _ in range(200):
        byte = chance.randrange(len(data))
        damaged = bytearray(data[: chance.choice([byte, len(data)])])
        if byte < len(damaged):
            damaged[byte] ^= 1 << chance.randrange(8)
        path.write_bytes(damaged)
        whole = sum(end <= byte for end in [*places[1:], len(data)])
        assert [place for place, _, _ in read_messages(path, JournalKey())] == places[:whole]
        known = KnownOutcomes([tmp_path / "r.journal"], 1, 100)
        stored = [known.outcome(0, number) for number in range(20)]
        known.close()
        assert all(repr(item) == repr(outcome(float(number))) for number, item in enumerate(stored) if item is not None)
        assert sum(item is not None for item in stored) == max(whole - 1, 0)  # The first record is a form.


def test_a_record_that_lies_is_not_believed(tmp_path: Path) -> None:
    writer = new_file(tmp_path)
    for row, number in ((0, 0), (5, 0), (-1, 0), (0, 10**9), (0, -7)):
        writer.add_outcome(row, number, outcome(1.0))
    writer.file.close()
    known = KnownOutcomes([tmp_path / "r.journal"], 2, 100)
    known.close()
    assert known.n_outcomes == 1


@pytest.mark.parametrize("share", [0.0, 0.02, 0.4, 0.8, 1.0])
def test_a_run_that_goes_on_judges_no_case_twice_and_gives_the_same(
    unbroken: tuple[Run, Path], tmp_path: Path, share: float
) -> None:
    """The journal ends anywhere, as if the process had been killed there."""
    result, folder = unbroken
    (path,) = folder.glob("*.outcomes")
    data = path.read_bytes()
    journal = tmp_path / "r.journal"
    shutil.copytree(folder, journal)
    (journal / path.name).write_bytes(data[: int(share * len(data))])
    again = judge(Journal(PLAN, journal, [journal]))
    assert facts(again) == facts(result)
    complete = KnownOutcomes([tmp_path / "r.journal"], 6, 100)
    complete.close()
    assert (complete.n_outcomes, complete.n_twice) == (n_cases(result), 0)
    if share == 1.0:
        assert [row.seconds for row in again.rows] == [row.seconds for row in result.rows]


def test_a_block_that_is_judged_is_not_drawn(
    unbroken: tuple[Run, Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Only a block of which cases stay whole is drawn again, and what stays whole stays so."""
    monkeypatch.setattr("contactverif.sampling.draw.BLOCK", 10)
    monkeypatch.setattr("contactverif.run.run_jobs.BLOCK", 10)
    monkeypatch.setattr("contactverif.run.rows.WHOLE", 10)
    plan = msgspec.structs.replace(PLAN, formulations=("vts-ppt",), properties=("patch.flat.resultant",))
    subjects, questions = [load_formulation("vts-ppt")], load_properties(["patch.flat.resultant"])
    folder = new_journal(tmp_path, plan)
    first = run(subjects, questions, examples=EXAMPLES, seed=3, journal=Journal(plan, folder))
    numbers: list[int] = []
    draw = run_jobs.draw_chunks

    def draw_chunks(sampling: Sampling, question: object, number: int, count: object = None) -> object:
        numbers.append(number)
        return draw(sampling, question, number)  # type: ignore[arg-type]

    monkeypatch.setattr("contactverif.run.run_jobs.draw_chunks", draw_chunks)
    second = run(subjects, questions, examples=EXAMPLES, seed=3, journal=Journal(plan, None, [folder]))
    assert numbers == [0]
    assert facts(first) == facts(second)


def test_a_run_that_is_stopped_says_how_far_each_row_is() -> None:
    def interrupt(step: Progress) -> None:
        if (step.formulation, step.property_id, step.count) == ("vts-ppt", "patch.flat.transmission", 28):
            raise KeyboardInterrupt

    subjects, questions = [load_formulation("vts-ppt")], load_properties(PROPERTY_IDS[1:])
    with pytest.raises(RunStopped) as stopped:
        run(subjects, questions, examples=EXAMPLES, seed=3, progress=interrupt)
    first, second = stopped.value.run.rows
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
    assert begin_journal(folder, PLAN, [report]) == ""
    assert not report.exists()
    assert msgspec.structs.replace(read_plan(folder, "--resume"), nonce="") == PLAN
    later = msgspec.structs.replace(PLAN, seed=4)
    assert begin_journal(folder, later, [report]) == "r.nc.journal.earlier"
    assert (folder / "earlier.nc").read_text() == "yesterday"
    assert read_plan(folder, "--resume").seed == 4
    assert read_plan(tmp_path / "r.nc.journal.earlier", "--resume").seed == 3
    remove_journal(folder)
    assert list(tmp_path.iterdir()) == []


def test_the_journal_of_a_link_stands_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "far").mkdir()
    (tmp_path / "r.nc").symlink_to(tmp_path / "far" / "real.nc")
    assert journal_folder(tmp_path / "r.nc") == tmp_path / "far" / "real.nc.journal"


def test_two_runs_do_not_share_a_journal(tmp_path: Path) -> None:
    folder = tmp_path / "r.nc.journal"
    begin_journal(folder, PLAN, [])
    with hold_journal(folder, "--out"), pytest.raises(MisuseError, match="of a run that is going on"):
        begin_journal(folder, PLAN, [])


@pytest.mark.parametrize("moment", ["opens", "locks"])
def test_a_journal_that_another_process_completes_meanwhile_is_gone(
    moment: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "r.nc.journal"
    begin_journal(folder, PLAN, [])
    if moment == "opens":
        remove_journal(folder)
    else:
        monkeypatch.setattr(fcntl, "flock", lambda *_: remove_journal(folder))
    words = r"--resume: found no journal r\.nc\.journal any more, since another process has completed the run"
    with pytest.raises(MisuseError, match=words), hold_journal(folder, "--resume"):
        pass


def test_a_folder_of_another_kind_is_left_alone(tmp_path: Path) -> None:
    folder = tmp_path / "r.nc.journal"
    folder.mkdir()
    with pytest.raises(MisuseError, match=r"r\.nc\.journal, which is no journal of a run"):
        begin_journal(folder, PLAN, [])
    assert folder.exists()


def damages(data: bytes) -> Sequence[bytes]:
    return [b"", data[:-1], data[:4], data[:20] + bytes([data[20] ^ 1]) + data[21:], b"\xff" * len(data)]


@pytest.mark.parametrize("number", range(5))
def test_a_damaged_header_is_one_line(tmp_path: Path, number: int) -> None:
    folder = tmp_path / "r.nc.journal"
    begin_journal(folder, PLAN, [])
    header = folder / "header"
    header.write_bytes(damages(header.read_bytes())[number])
    with pytest.raises(MisuseError, match=r"--resume: found r\.nc\.journal with a damaged header"):
        read_plan(folder, "--resume")


def test_another_version_is_refused_by_its_name() -> None:
    check_versions({"a_version": "1"}, {"a_version": "1"}, "--resume")
    with pytest.raises(MisuseError, match="--resume: found b version: 1 in the journal and 2 here"):
        check_versions({"a_version": "1", "b_version": "1"}, {"a_version": "1", "b_version": "2"}, "--resume")


# ---------------------------------------------------------------------------------------------------------------------
# Fail closed


def test_a_run_that_lacks_an_outcome_a_row_or_a_witness_has_a_gap() -> None:
    subjects = [item for name in NAMES if isinstance(item := load_formulation(name), Subject)]
    questions = load_properties(PROPERTY_IDS)
    result = run(subjects, questions, examples=4, seed=3)
    sampling = Sampling(4, 3)
    assert find_gap(result, subjects, questions, sampling) == ""
    *others, row = result.rows
    shorter = replace(row, outcomes=row.outcomes[:-1], planned=3)
    worse = replace(result, rows=(*others, shorter))
    assert find_gap(worse, subjects, questions, sampling) == "vts-ppt patch.flat.transmission: outcomes of 3 of 4 cases"
    idle = replace(row, outcomes=(), planned=0, verdict=Verdict.NOT_APPLICABLE)
    worse = replace(result, rows=(*others, idle))
    assert find_gap(worse, subjects, questions, sampling) == "vts-ppt patch.flat.transmission: outcomes of 0 of 4 cases"
    worse = replace(result, rows=(replace(result.rows[0], outcomes=()), *result.rows[1:]))
    assert "nts hard.deep: outcomes of 0 of" in find_gap(worse, subjects, questions, sampling)
    assert "0 rows instead of 1" in find_gap(replace(result, rows=result.rows[1:]), subjects, questions, sampling)
    assert "2 rows instead of 1" in find_gap(replace(result, rows=result.rows * 2), subjects, questions, sampling)
    rows = tuple(replace(row, witness=None) for row in result.rows)
    assert "no outcome of its witness" in find_gap(replace(result, rows=rows), subjects, questions, sampling)
