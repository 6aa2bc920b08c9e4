"""Cases in lockstep: one message asks for all, and whatever goes wrong there is asked again alone."""

from functools import cached_property
from time import perf_counter

import pytest
from isolation import hostile_few

from contactverif import Verdict, load_formulation, load_properties
from contactverif.isolation.limits import Limits
from contactverif.isolation.lockstep import in_lockstep, wait_in_lockstep
from contactverif.isolation.remote import RemoteSubject, count_ends, load_remote
from contactverif.run.run import run

LIMITS = Limits(seconds=20.0, memory=2000)


def test_cases_share_messages_and_their_outcomes_are_those_of_each_alone(messages: list[list[object]]) -> None:
    questions, start = load_properties(["balance.moment", "tangent.directional"]), perf_counter()
    shared, alone = (
        run([subject], questions, examples=20, seed=4, shrink="none").rows
        for subject in (load_formulation("nts-ar", LIMITS), load_formulation("nts-ar"))
    )
    seconds = perf_counter() - start
    for row, other in zip(shared, alone, strict=True):
        assert row.verdict is other.verdict
        assert [(each.verdict, each.reason, repr(each.measurement)) for each in row.outcomes] == [
            (each.verdict, each.reason, repr(each.measurement)) for each in other.outcomes
        ]
    assert max(map(len, messages)) > 10
    # Each case has its own share of the time in which all of them waited.
    assert sum(row.seconds for row in shared) < seconds


def test_a_process_that_ends_lets_each_case_be_judged_alone() -> None:
    subject = load_remote(hostile_few.PROGRAM, "KillsAtTimes", LIMITS)
    assert isinstance(subject, RemoteSubject)
    (row,) = run([subject], load_properties(["balance.force"]), examples=20, seed=1, shrink="none").rows
    crashed = [outcome for outcome in row.outcomes if outcome.verdict is Verdict.CRASHED]
    assert 0 < len(crashed) < 20
    assert {outcome.reason for outcome in crashed} == {"signal: residual: SIGSEGV ended its process"}
    assert count_ends(subject) == len(crashed)


def test_one_wish_of_several_calls_is_granted_once_and_an_error_comes_through() -> None:
    grants = []

    def wish() -> bool:
        grants.append(1)
        return True

    def call(number: int) -> int:
        for _ in range(number):
            assert wait_in_lockstep(wish)
        if number == 4:
            raise ValueError("an error of the caller")
        return number

    assert [result for result, _ in in_lockstep([lambda n=n: call(n) for n in (1, 3, 2)]) or ()] == [1, 3, 2]
    assert len(grants) == 3
    with pytest.raises(ValueError, match="an error of the caller"):
        in_lockstep([lambda: call(4), lambda: call(1)])
    assert not wait_in_lockstep(wish)  # Here is no call in lockstep.


def test_a_wish_that_fails_and_an_interrupt_end_all_calls() -> None:
    ends: list[str] = []

    def call(wish: object) -> None:
        try:
            wait_in_lockstep(wish)  # type: ignore[arg-type]
        finally:
            ends.append("end")

    def interrupt() -> bool:
        raise KeyboardInterrupt

    assert in_lockstep([lambda: call(lambda: False)] * 3) is None
    with pytest.raises(KeyboardInterrupt):
        in_lockstep([lambda: call(interrupt)] * 3)
    assert ends == 6 * ["end"]


def test_a_value_that_is_made_once_may_ask_while_it_is_made() -> None:
    """In Python 3.11 `cached_property` holds a lock of its thread meanwhile, and all calls have the same thread."""

    class Scene:
        @cached_property
        def stiffness(self) -> float:
            return 2.0 if wait_in_lockstep(lambda: True) else 1.0

    scene = Scene()
    assert [result for result, _ in in_lockstep([lambda: scene.stiffness] * 3) or ()] == [2.0] * 3
