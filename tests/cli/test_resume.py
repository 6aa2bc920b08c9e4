"""A run of `verify` that is killed, stopped, or has no room to write: what is judged is kept, and the run goes on."""

import resource
import subprocess
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import psutil
import pytest
from asking import Ask, check_mistake, run_inline, without_rows
from forged_records import forge_header
from fresh_process import MAIN, PYTHON

from contactverif.cli.verify import versions_of
from contactverif.run.journal import journal_folder, new_journal
from contactverif.run.rows import RowOutcomes
from contactverif.run.run_options import RunOptions
from contactverif.run.store import Plan, Store
from contactverif_reports.netcdf.differences import same_data

IDS = ("patch.flat.resultant", "patch.flat.transmission", "hard.deep")
FEW = "--examples 60 --seed 1"
RUN = f"verify nts vts-ppt -p {' -p '.join(IDS)} {FEW}"


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory) -> Path:
    report = tmp_path_factory.mktemp("unbroken") / "r.nc"
    assert run_inline(f"{RUN} --out", report).status == 0
    return report


def size_of(journal: Path) -> int:
    return sum(path.stat().st_size for path in journal.glob("*.outcomes"))


def kill_at(size: int, line: str, journal: Path) -> None:
    """Run a command, kill it with SIGKILL when the journal has a size, and wait until its workers have ended."""
    with subprocess.Popen([*MAIN, *line.split()], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        watched = psutil.Process(process.pid)
        deadline = time.monotonic() + 120
        while size_of(journal) < size:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.001)
        children = watched.children(recursive=True)
        process.kill()
    _, alive = psutil.wait_procs(children, timeout=60)
    assert alive == []


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_run_that_is_killed_again_and_again_ends_with_the_report_of_an_unbroken_one(
    ask: Ask, unbroken: Path, tmp_path: Path, jobs: str
) -> None:
    report, journal = tmp_path / "r.nc", tmp_path / "r.nc.journal"
    kill_at(1, f"{RUN} --jobs {jobs} --out {report}", journal)
    kill_at(size_of(journal) + 8_000, f"verify --resume {report}", journal)
    assert not report.exists()
    store = Store(Plan(options=RunOptions(names=("nts", "vts-ppt"), properties=IDS)), None, [journal])
    assert store.n_outcomes == store.n_records > 0
    answer = ask("verify --jobs 1 --resume", report)
    assert (answer.status, answer.err) == (0, "")
    assert f"report: {report}" in answer.out
    assert same_data(unbroken, report) == []
    assert list(tmp_path.iterdir()) == [report]


def test_a_comparison_that_is_killed_goes_on(ask: Ask, tmp_path: Path) -> None:
    words = f"compare nts --against vts-ppt -p patch.flat.transmission {FEW} --out"
    report, journal, whole = tmp_path / "r.nc", tmp_path / "r.nc.journal", tmp_path / "whole.nc"
    kill_at(1, f"{words} {report} --out {tmp_path / 'r.html'}", journal)
    assert not report.exists()
    assert "a journal of compare; needed one of verify" in ask("verify", "--resume", report).err
    answer = ask("compare", "--resume", report)
    assert (answer.status, answer.err) == (0, "")
    assert f"report: {report}" in answer.out
    assert ask(words, whole).status == 0
    assert same_data(whole, report) == []
    assert {path.name for path in tmp_path.iterdir()} == {"r.nc", "r.html", "whole.nc"}


@pytest.mark.parametrize("option", ["--out", "--resume"])
def test_a_link_that_leads_to_itself_is_one_line(ask: Ask, option: str, tmp_path: Path) -> None:
    (tmp_path / "loop.nc").symlink_to("loop.nc")
    answer = ask(f"verify {'nts' if option == '--out' else ''} {option}", tmp_path / "loop.nc")
    check_mistake(answer, f"{option}: found loop.nc, a link that leads to itself; needed another name")


def test_a_run_goes_on_only_alone_and_only_once(ask: Ask, unbroken: Path, tmp_path: Path) -> None:
    check_mistake(ask("verify --resume", unbroken), "--resume: .*which is complete.*")
    with new_journal(journal_folder(tmp_path / "r.nc"), Plan()):
        pass
    answer = ask("verify nts --resume", tmp_path / "r.nc")
    check_mistake(answer, "--resume: found names beside it; needed --jobs and --keep-going at most.*")


def test_a_journal_of_somebody_else_reaches_only_what_is_typed(ask: Ask, tmp_path: Path) -> None:
    """The options of a run need not be typed again, unless its header is not signed by this user."""
    report, folder, outside = tmp_path / "r.nc", tmp_path / "r.nc.journal", tmp_path / "x.json"
    run = RunOptions(names=("nts",), out=(report, outside), time_limit=7.0).with_settings()
    options = replace(run, properties=("hard.deep",), examples=4).settle(1)
    for forged in (False, True):
        versions = versions_of(options)
        with new_journal(folder, Plan(command="verify", versions=versions, options=options, folder=str(tmp_path))):
            pass
        if forged:
            forge_header(folder, seed=2)
        outside.unlink(missing_ok=True)
        answer = ask(f"verify --resume {report}")
        words = "--resume asks for --time-limit 7.0, and does not get it; type it to allow it"
        assert (answer.status, answer.err) == (0, f"contactverif: {words}\n" if forged else "")
        assert outside.exists() is not forged
        report.unlink()
    with new_journal(folder, Plan(command="verify", options=replace(options, scene_file="/x.py:f"))):
        pass
    forge_header(folder, seed=2)
    check_mistake(ask(f"verify --resume {report} --scene c"), "--resume: found a journal with --scene-file /x.py:f, .*")


@pytest.mark.parametrize(
    "words",
    [
        "verify nts nts -p hard.deep",
        "compare nts --against nts -p hard.deep",
        "verify nts -p hard.deep --known 'patch.flat.solve=an old one'",
    ],
)
def test_a_mistake_leaves_the_report_of_an_earlier_run_where_it_was(ask: Ask, tmp_path: Path, words: str) -> None:
    report = tmp_path / "r.nc"
    report.write_text("an earlier one")
    for _ in range(2):
        assert ask(f"{words} --out", report).status == 2
        assert [path.name for path in tmp_path.iterdir()] == ["r.nc"]
    assert report.read_text() == "an earlier one"


def test_a_run_does_not_go_on_with_other_code(ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    report = tmp_path / "r.nc"
    kill_at(1, f"{RUN} --out {report}", tmp_path / "r.nc.journal")
    monkeypatch.setattr("contactverif.plugins.provenance.digest_files", lambda files: "another")
    answer = ask("verify", "--resume", report)
    assert answer.status == 2
    assert answer.err.startswith("contactverif: --resume: found code of contactverif")
    assert answer.err.endswith("here; needed the same, or a new run\n")


def test_a_file_that_may_not_grow_is_a_line_and_the_run_goes_on(ask: Ask, unbroken: Path, tmp_path: Path) -> None:
    """The limit stops the journal, the report and the page."""
    report = tmp_path / "r.nc"
    # Python would cut the modules, too, that it compiles and stores at such a limit.
    limit = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (16384, 16384)); "
    line = f"{RUN} --out {report} --out {tmp_path / 'r.html'}"
    command = [*PYTHON, "-B", "-c", limit + MAIN[-1], *line.split()]
    answer = subprocess.run(command, capture_output=True, text=True, check=False)
    assert answer.returncode == 2
    assert "patch.flat.transmission" in answer.stdout
    lines = without_rows(answer.stderr).splitlines()
    assert lines == [
        f"contactverif: {report} is not written: File too large",
        f"contactverif: {tmp_path / 'r.html'} is not written: File too large",
        "contactverif: the journal could not be written to its end: File too large",
    ]
    assert [path.name for path in tmp_path.iterdir()] == ["r.nc.journal"]
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] != 16384
    assert ask("verify", "--resume", report).status == 0
    assert same_data(unbroken, report) == []
    assert (tmp_path / "r.html").exists()


def test_a_run_that_lost_an_outcome_is_not_green(ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    append, losses = RowOutcomes.append, []

    def lose_one(outcomes: RowOutcomes, *outcome: Any) -> None:
        if len(outcomes) == 10 and not losses:  # Behind the first round, which counts by itself.
            losses.append(outcome)
        else:
            append(outcomes, *outcome)

    monkeypatch.setattr(RowOutcomes, "append", lose_one)
    answer = ask("verify vts-ppt -p patch.flat.resultant --examples 20 --out", tmp_path / "r.nc")
    assert answer.status == 1
    assert "Not complete: vts-ppt patch.flat.resultant: outcomes of 19 of 20 cases." in answer.out
