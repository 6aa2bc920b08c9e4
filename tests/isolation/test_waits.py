"""The wait for an answer: how long it is, how often the judge waits, and what is left of an interrupted question."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from isolation import bombs, hostile_few

from contactverif import Subject, Verdict, load_properties, named_case, verify
from contactverif.contract.errors import PluginError
from contactverif.contract.result import NotLoaded
from contactverif.isolation import host, process
from contactverif.isolation.child import Channel, TooLateError
from contactverif.isolation.limits import Limits
from contactverif.isolation.process import ActiveClock
from contactverif.isolation.remote import RemoteSubject, count_ends, load_remote

CASE = named_case("c")
QUICK = Limits(seconds=20.0, memory=2000)


def load(program: tuple[str, ...], name: str, bounds: Limits = QUICK) -> RemoteSubject:
    subject = load_remote(program, name, bounds)
    assert isinstance(subject, RemoteSubject), subject
    return subject


def ask(subject: Subject) -> np.ndarray:
    formulation = subject.for_case(CASE)
    return formulation.residual(CASE.interface, formulation.pair(CASE.interface, CASE.z), CASE.z)


@pytest.mark.parametrize(
    ("looks", "seconds"),
    [
        ([(False, 0.0)], 8.0),  # It sleeps.
        ([(True, 8.0)], 8.0),  # It has the processor for itself.
        ([(True, 1.0)], 1.0),  # It shares it with seven others.
        ([(True, 0.0)], 0.5),  # It waits for the processor all the time.
        ([(True, 16.0)], 8.0),  # Two threads of it run.
        ([(True, 2.0), (False, 2.0), (True, 5.0)], 13.0),
    ],
)
def test_time_is_used_up_asleep_by_the_clock_and_awake_by_the_processor(
    looks: list[tuple[bool, float]], seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    replies = iter([(True, 0.0), *looks])
    monkeypatch.setattr(ActiveClock, "_look", lambda self: next(replies))
    times = iter(8.0 * number for number in range(len(looks) + 1))
    monkeypatch.setattr(process, "perf_counter", lambda: next(times))
    clock = ActiveClock(0)
    for _ in looks:
        clock.look()
    assert clock.seconds == seconds


@pytest.mark.parametrize(("code", "runs"), [("while True: pass", True), ("import time; time.sleep(1000)", False)])
@pytest.mark.parametrize("start", ["{0}", "import os; os.fork() and os.wait(); {0}"], ids=["itself", "its child"])
def test_whether_a_process_runs_is_seen_from_outside(start: str, code: str, runs: bool) -> None:
    if ":" in code:
        code = f"exec({code!r})"
    with subprocess.Popen([sys.executable, "-c", start.format(code)], start_new_session=True) as child:
        try:
            clock = ActiveClock(child.pid)
            while clock._look()[0] is not runs:  # It runs while it starts.
                pass
            before = clock._look()[1]
            while runs and clock._look()[1] == before:
                pass
        finally:
            os.killpg(child.pid, signal.SIGKILL)
    assert clock._look() == (False, 0.0)


class Late:
    """A line on which nothing comes, of a process that counts its progress up."""

    def __init__(self) -> None:
        self.waited: list[float] = []

    def receive(self, seconds: float, largest: int) -> bytes:
        self.waited.append(seconds)
        os.pwrite(self.progress, bytes([len(self.waited)]), 0)
        raise TooLateError

    progress = 0


def test_no_progress_and_no_number_of_questions_buys_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock goes on by the wall, as with a process that sleeps."""
    subject = load(hostile_few.PROGRAM, "Springs")
    plugin, line = subject.host._process, Late()
    assert plugin is not None
    line.progress = plugin._progress.fileno()
    plugin._child.channel.close()
    monkeypatch.setattr(
        plugin._child, "channel", SimpleNamespace(receive=line.receive, send=lambda *_: None, close=lambda: None)
    )
    clock = SimpleNamespace(seconds=0.0)

    def look() -> None:
        clock.seconds += line.waited[-1]

    clock.look = look
    monkeypatch.setattr(process, "ActiveClock", lambda pid: clock)
    questions = [process.Question(number, "residual") for number in range(16)]
    with pytest.raises(PluginError, match="residual: no answer within 3 s"):
        plugin.ask(b"", questions, 3.0)
    assert 3.0 <= sum(line.waited) <= 3.5


def test_an_answer_that_comes_byte_by_byte_is_late() -> None:
    subject = load(bombs.PROGRAM, "Dribbles")
    subject.host._limits = Limits(seconds=0.1)
    with pytest.raises(PluginError, match=r"residual: no answer within 0\.5 s") as caught:
        ask(subject)
    assert caught.value.cause == "hang"


def let_it_hang(monkeypatch: pytest.MonkeyPatch, when: Callable[[str], bool]) -> list[str]:
    """Let each question of some methods be one without an answer; return the list of those."""
    verbs: list[str] = []
    real = process.PluginProcess.ask

    def fake(self: process.PluginProcess, frame: bytes, questions: Sequence[process.Question], *seconds: Any) -> None:
        if late := [question.verb for question in questions if when(question.verb)]:
            verbs.append(late[0])
            self.end()
            raise PluginError(f"{late[0]}: no answer within 60 s", "hang", ended=True)
        real(self, frame, questions, *seconds)

    monkeypatch.setattr(process.PluginProcess, "ask", fake)
    return verbs


def test_two_calls_without_an_answer_are_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    subject = load(hostile_few.PROGRAM, "Springs")
    ask(subject)
    verbs = let_it_hang(monkeypatch, lambda verb: verb == "residual")
    rows = verify([subject], load_properties(["balance.force", "purity"]), examples=10, seed=1).rows
    assert verbs == ["residual", "residual"]
    assert rows[0].verdict is Verdict.CRASHED
    assert rows[0].reason == "hang: residual: no answer within 60 s"
    assert rows[1].verdict is Verdict.NOT_JUDGED
    assert "not asked: no answer came twice" in rows[1].reason


def test_both_processes_of_a_formulation_count_together(monkeypatch: pytest.MonkeyPatch) -> None:
    first = load(hostile_few.PROGRAM, "Springs")
    second = first.restart()
    for subject in (first, second):
        ask(subject)
    let_it_hang(monkeypatch, lambda verb: verb == "residual")
    causes = []
    for subject in (first, second, first, second):
        with pytest.raises(PluginError) as caught:
            ask(subject)
        causes.append(caught.value.cause)
    assert causes == ["hang", "hang", "not asked", "not asked"]


def test_a_first_call_without_an_answer_is_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    """It waits five times as long as a later one, and a second such wait would tell nothing new."""
    subject = load(hostile_few.PROGRAM, "Springs")
    verbs = let_it_hang(monkeypatch, lambda verb: verb == "residual")
    causes = []
    for copy in (subject, subject.restart()):
        with pytest.raises(PluginError) as caught:
            ask(copy)
        causes.append(caught.value.cause)
    assert causes == ["hang", "not asked"]
    assert str(caught.value).endswith("no answer came to the first call of a method")
    assert verbs == ["residual"]


def test_one_import_without_an_answer_is_the_last(monkeypatch: pytest.MonkeyPatch) -> None:
    subject = load(hostile_few.PROGRAM, "Springs")
    let_it_hang(monkeypatch, lambda verb: verb == "import")
    with pytest.raises(PluginError, match="import: no answer within 60 s"):
        ask(subject.restart())
    subject.host.end()
    with pytest.raises(PluginError, match="no answer came while it was imported") as caught:
        ask(subject)
    assert caught.value.cause == "not asked"
    host.end_all()
    refused = load_remote(hostile_few.PROGRAM, "Springs", QUICK)
    assert isinstance(refused, NotLoaded)
    assert refused.reason == "hang: import: no answer within 60 s"


def test_a_first_call_takes_less_time_once_it_is_known(messages: list[list[tuple[str, float]]]) -> None:
    """Five times the limit only where nobody knows how long it takes to compile."""
    subject = load(hostile_few.PROGRAM, "Springs")
    for _ in range(2):
        ask(subject)
        ask(subject)
        subject.host.end()
    times = [question for message in messages for question in message]
    first, again = times[:5], times[5:]
    assert first == [("import", 100.0), ("pair", 100.0), ("residual", 100.0), ("pair", 20.0), ("residual", 20.0)]
    assert [verb for verb, _ in again] == [verb for verb, _ in first]
    assert [seconds > 20.0 for _, seconds in again] == [True, True, True, False, False]
    assert max(seconds for _, seconds in again) < 100.0


@pytest.mark.parametrize(("error", "raised"), [(KeyboardInterrupt, KeyboardInterrupt), (MemoryError, PluginError)])
def test_a_question_that_was_interrupted_is_asked_again(
    error: type[BaseException], raised: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    subject = load(hostile_few.PROGRAM, "Springs")
    forces = ask(subject)
    formulation = subject.for_case(CASE)
    pairing = formulation.pair(CASE.interface, CASE.z)
    with monkeypatch.context() as patch:

        def interrupt(self: Channel, *arguments: Any) -> bytes:
            raise error

        patch.setattr(Channel, "receive", interrupt)
        with pytest.raises(raised):
            formulation.residual(CASE.interface, pairing, CASE.z)
    assert not subject.host.has_process
    assert np.array_equal(ask(subject), forces)
    assert np.array_equal(
        formulation.residual(CASE.interface, formulation.pair(CASE.interface, CASE.z), CASE.z), forces
    )
    with pytest.raises(PluginError, match="the question was interrupted") as caught:
        formulation.residual(CASE.interface, pairing, CASE.z)
    assert caught.value.cause == "not asked"
    assert count_ends(subject) == 0


def test_a_wait_ends_where_python_has_dropped_an_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    subject = load(hostile_few.PROGRAM, "Hangs")
    monkeypatch.setattr(process, "stop_signals", [signal.SIGTERM])
    with pytest.raises(KeyboardInterrupt) as caught:
        ask(subject)
    assert caught.value.args == (signal.SIGTERM,)
    assert not subject.host.has_process


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system holds no process on a core")
def test_a_judge_is_held_after_some_questions_and_let_go_again(monkeypatch: pytest.MonkeyPatch) -> None:
    cores = os.sched_getaffinity(0)
    monkeypatch.setattr(process, "_QUESTIONS_FIRST", 2)
    monkeypatch.setattr(process, "_SECONDS_ON_A_CORE", 0.0)
    judge = process.CpuPinning()
    states = []
    for _ in range(5):
        judge.ask()
        states.append((judge.core >= 0, os.sched_getaffinity(0) == ({judge.core} if judge.core >= 0 else cores)))
    judge.let_go()
    assert states == [(False, True), (False, True), (True, True), (False, True), (True, True)]
    assert os.sched_getaffinity(0) == cores
