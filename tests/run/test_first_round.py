"""The first round of a run: a few cases of cheap properties, shown at once, of the planned ones; and `-x`."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from subjects import ResidualAlone
from test_run import ZERO, a_case, measure_residual, sizes, subject

from contactverif import Case, Property, Subject
from contactverif.cli.run_screen import run_screen
from contactverif.contract.case import Cases
from contactverif.contract.counterexample import counterexample_of
from contactverif.contract.property import Measurement
from contactverif.contract.result import OPPOSITE_SIGN, Result
from contactverif.run.judge import ACTS_APART
from contactverif.run.run import RunStopped, Stop, run
from contactverif.run.scheduler import Progress
from contactverif.run.store import Store
from contactverif_nts import nts_ar

FIRST = replace(ZERO, id="patch.first", cases=Cases.random(lambda _: sizes()), turn=0, promise=lambda traits: True)
SECOND = replace(FIRST, id="patch.second", turn=1)
AGAIN = replace(FIRST, id="patch.again", turn=2, restarts=True)
LATE = replace(FIRST, id="patch.late", turn=99)


class Pulls(ResidualAlone):
    def residual(self, *question: Any) -> Any:
        return -super().residual(*question)


def wrong_if_large(size: int) -> float:
    return float(size > 50)


def count_calls(question: Property, calls: Counter[str]) -> Property:
    def measure(case: Case, subject: Subject) -> Measurement:
        calls[question.id] += 1
        return measure_residual(case, subject)

    return replace(question, measure=measure)


def steps_of(questions: list[Property], answer: Callable[[int], Any], **options: Any) -> list[Progress]:
    log: list[Progress] = []
    run([subject(answer)], questions, examples=20, seed=1, progress=log.append, **options)
    return log


class ActsApart(ResidualAlone):
    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return super().residual(interface, pairing, 2 * interface.nodes.reshape(-1) - z)


@pytest.mark.parametrize(("make", "words"), [(Pulls, OPPOSITE_SIGN), (ActsApart, ACTS_APART)])
def test_a_sign_or_a_gap_turned_round_is_told_at_once(make: Any, words: str) -> None:
    steps: list[Progress] = []
    wrong = Subject("wrong", lambda *, penalty: make(nts_ar(penalty=penalty)))
    result = run([wrong], [FIRST], examples=1, seed=1, progress=steps.append, shrink="none", stop="foundation")
    assert next(step.remark for step in steps if step.remark) == f"wrong: {words}"
    assert (result.rows[0].result, result.promises_kept) == (Result.OMITTED, False)


def test_a_crash_in_each_case_of_a_property_ends_the_first_round_and_then_the_run() -> None:
    def crash(size: int) -> float:
        raise IndexError

    steps = steps_of([LATE, SECOND, FIRST], crash, stop="foundation", shrink="none")
    rows = [(step.phase, step.row.property_id, step.row.judged) for step in steps if step.row is not None]
    assert rows == [("first round", "patch.first", 5), ("judging", "patch.first", 20)]


def test_what_is_wrong_is_shown_before_any_row_is_whole() -> None:
    steps = steps_of([LATE, SECOND, FIRST], lambda size: 1.0)
    rows = [(step.phase, step.row.property_id, step.row.judged) for step in steps if step.row is not None]
    assert rows[:2] == [("first round", "patch.first", 5), ("first round", "patch.second", 5)]
    assert [judged for *_, judged in rows[2:]] == [20, 20, 20]
    (remark,) = [step.remark for step in steps if step.phase == "first round" and step.remark]
    assert remark == "first round: 2 of 3 properties, 5 cases each; 2 wrong"


def test_what_it_found_stays_in_the_rows_of_a_run_that_is_stopped() -> None:
    def press(step: Progress) -> None:
        if step.phase == "judging":
            raise KeyboardInterrupt

    questions = [FIRST, replace(AGAIN, measure=lambda case, subject: Measurement()), LATE]
    with pytest.raises(RunStopped) as stopped:
        run([subject(lambda size: 1.0)], questions, examples=20, seed=1, progress=press)
    first, again, late = stopped.value.run.rows
    assert (first.result, first.judged, first.planned) == (Result.BROKEN_PROMISE, 5, 20)
    assert counterexample_of(first) is not None
    assert (again.result, again.reason) == (Result.NOT_JUDGED, "stopped: 5 of 20 cases judged")
    assert (late.result, late.reason) == (Result.NOT_JUDGED, "stopped: 0 of 20 cases judged")
    screen = "\n".join(map(str, run_screen(stopped.value.run, 80)))
    assert "shrunk; 5 of 20 cases judged\n" in screen


def test_its_cases_are_the_first_planned_ones_and_are_judged_once() -> None:
    """The second process of a property waits for its whole row, so these few are asked twice."""
    calls = Counter[str]()
    questions = [count_calls(question, calls) for question in (FIRST, AGAIN, LATE)]
    watched = run([subject(wrong_if_large)], questions, examples=20, seed=1, progress=lambda step: None, shrink="none")
    assert calls == {"patch.first": 20, "patch.again": 25, "patch.late": 20}
    alone = run([subject(wrong_if_large)], questions, examples=20, seed=1, shrink="none")

    def numbers(result: Any) -> Any:
        return [[(each.summary, each.verdict, each.measurement) for each in row.outcomes] for row in result.rows]

    assert numbers(watched) == numbers(alone)


@pytest.mark.parametrize(("known", "wrong"), [({}, "1 wrong"), ({"patch.first": "known"}, "none wrong")])
def test_a_stated_failure_is_none(known: dict[str, str], wrong: str) -> None:
    steps = steps_of([FIRST, LATE], lambda size: 1.0, known=known)
    assert next(step.remark for step in steps if step.phase == "first round" and step.remark).endswith(wrong)


@pytest.mark.parametrize(
    ("answer", "failing", "judged"),
    [
        (lambda size: 1.0, "patch.second", {"patch.second": 20, "patch.late": 0, "patch.other": 0}),
        (wrong_if_large, "patch.late", {"patch.second": 20, "patch.late": 20, "patch.other": 0}),
        (lambda size: 0.0, "", {"patch.second": 20, "patch.late": 20, "patch.other": 20}),
    ],
    ids=["first round", "later", "never"],
)
def test_a_run_can_stop_at_the_first_row_that_is_wrong(
    answer: Callable[[int], float], failing: str, judged: dict[str, int]
) -> None:
    """The row is judged whole, so that its numbers are those of the whole run."""
    second = replace(SECOND, cases=Cases.random(lambda _: sizes(50)))
    other = replace(LATE, id="patch.other", bodies=True)
    stop: Stop = "failure"
    result = run([subject(answer)], [other, LATE, second], examples=20, seed=1, stop=stop, shrink="none")
    assert {row.property_id: row.judged for row in result.rows} == judged
    assert [row.property_id for row in result.rows if row.result is Result.BROKEN_PROMISE] == [failing][: bool(failing)]
    reasons = {row.reason for row in result.rows if row.omitted}
    assert reasons == ({f"not asked: mine {failing} is wrong (-x)"} if failing else set())


def test_what_fails_again_is_the_first_row_that_is_wrong() -> None:
    store = Store()
    store.failures = {("mine", "patch.late"): a_case(55)}
    right = replace(FIRST, cases=Cases.random(lambda _: sizes(50)))
    stop: Stop = "failure"
    result = run([subject(wrong_if_large)], [right, LATE], examples=20, seed=1, stop=stop, shrink="none", store=store)
    assert [(row.judged, row.result) for row in result.rows] == [(0, Result.OMITTED), (20, Result.BROKEN_PROMISE)]
