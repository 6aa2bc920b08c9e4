"""The progress of a whole run, on standard error where it is no terminal; and Ctrl-C."""

import signal
import subprocess

import pytest
from fresh_process import PYTHON
from subjects import load_property

from contactverif.cli import progress
from contactverif.cli.progress import Bar
from contactverif.contract.property import Verdict
from contactverif.contract.result import Row
from contactverif.isolation.process import stop_signals
from contactverif.run.scheduler import Progress, RunProgress


@pytest.fixture
def bar(monkeypatch: pytest.MonkeyPatch) -> Bar:
    """Return a bar on a clock that goes on by three seconds whenever it is read."""
    times = iter(range(0, 1000, 3))
    monkeypatch.setattr(progress, "monotonic", lambda: float(next(times)))
    return Bar()


def step(count: int, seconds_left: float | None) -> Progress:
    of_run = RunProgress(1000 + count, 4255, seconds_left)
    return Progress("mine", "purity", "judging", count, 100, of_run=of_run)


def test_a_line_every_few_seconds_says_how_far_the_run_is(bar: Bar, capsys: pytest.CaptureFixture[str]) -> None:
    for count in range(6):
        bar.show_progress(step(count, 100.0 - count))
    assert capsys.readouterr().err.splitlines() == [
        "mine purity: judging 1/100; 1,001 of some 4,255 in all, about 99 s left",
        "mine purity: judging 3/100; 1,003 of some 4,255 in all, about 97 s left",
        "mine purity: judging 5/100; 1,005 of some 4,255 in all, about 95 s left",
    ]


@pytest.mark.parametrize(
    ("seconds", "words"),
    [(None, "in all"), (119.0, "about 119 s left"), (121.0, "about 2 min left"), (9000.0, "about 2 h left")],
)
def test_the_time_left_has_a_unit_that_suits_it(
    bar: Bar, capsys: pytest.CaptureFixture[str], seconds: float | None, words: str
) -> None:
    bar.show_progress(step(0, seconds))
    bar.show_progress(step(1, seconds))
    assert capsys.readouterr().err.endswith(f"{words}\n")


def test_a_case_that_takes_long_is_told(bar: Bar, capsys: pytest.CaptureFixture[str]) -> None:
    for _ in range(7):
        bar.show_progress(step(4, 81.0))
    assert [line.rpartition(", ")[2] for line in capsys.readouterr().err.splitlines()] == [
        *("about 81 s left", "about 81 s left", "no news for 15 s"),
    ]


def test_a_remark_is_a_line_of_its_own(bar: Bar, capsys: pytest.CaptureFixture[str]) -> None:
    bar.show_progress(Progress("", "", "first round", 1, 1, remark="first round: 3 wrong"))
    assert capsys.readouterr().err == "first round: 3 wrong\n"


def test_a_row_that_the_first_round_has_told_in_full_is_told_once(bar: Bar, capsys: pytest.CaptureFixture[str]) -> None:
    row = Row("mine", load_property("swap").info, Verdict.FAIL, True, reason="wrong", planned=5)
    for phase in ("first round", "judging"):
        bar.show_progress(Progress("mine", "swap", phase, 5, 5, row=row, remark="said"))
    assert capsys.readouterr().err == "mine swap: BROKEN PROMISE, 0/5 judged: wrong\nsaid\nsaid\n"


def test_work_without_rows_has_such_lines_too(bar: Bar, capsys: pytest.CaptureFixture[str]) -> None:
    """Such as a bench, which takes hours."""
    for count in range(4):
        bar.update("wavy, mesh 8, instance 0", 1000 + count, 1125)
    assert capsys.readouterr().err.splitlines() == [
        "wavy, mesh 8, instance 0; 1,001 of some 1,125 in all",
        "wavy, mesh 8, instance 0; 1,003 of some 1,125 in all",
    ]


def test_an_interrupt_that_python_drops_ends_the_run_at_the_next_case() -> None:
    """A callback of the garbage collector drops the exception of the first Ctrl-C."""
    before = signal.getsignal(signal.SIGINT)
    with Bar() as bar:
        bar.update("one", 0, 3)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            bar.update("two", 1, 3)
    assert signal.getsignal(signal.SIGINT) is before
    assert not stop_signals  # The screen of the stopped run may ask a plugin.


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_second_signal_ends_the_process_at_once_and_says_nothing(number: signal.Signals) -> None:
    code = f"from contactverif.cli import progress as p; p.leave_at_next_signal(); p.signal.raise_signal({number:d})"
    answer = subprocess.run([*PYTHON, "-c", f"{code}; print('on')"], capture_output=True, text=True, check=False)
    assert (answer.returncode, answer.stdout, answer.stderr) == (128 + number, "", "")
