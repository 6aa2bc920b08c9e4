"""The progress of a whole run: its cases, and the seconds that are left by what cases of the same kind have cost."""

from dataclasses import replace
from typing import Any

import pytest
from test_run import ZERO, a_case, sizes, subject

from contactverif import Outcome, Property, Verdict
from contactverif.contract.case import Cases
from contactverif.run import run as driver
from contactverif.run.run import RunMeter, run
from contactverif.run.scheduler import Progress
from contactverif.sampling.draw import Sampling

SOLVED = replace(ZERO, id="patch.solved", bodies=True)
LISTED = replace(ZERO, id="patch.listed", cases=Cases.from_list(lambda: tuple(a_case(1, f"{n}") for n in range(3))))


class Clock:
    """A clock that a test sets."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(driver, "perf_counter", clock)
    return clock


def meter_of(*questions: Property) -> RunMeter:
    return RunMeter({("mine", question.id): question for question in questions}, [subject()], Sampling(100, 1))


def outcomes(count: int, seconds: float) -> list[Outcome]:
    return [Outcome(a_case(1), Verdict.PASS, seconds=seconds)] * count


def rows_judged(count: int) -> dict[tuple[str, str], Any]:
    """Return the rows of a run in which some cases of the first property are judged."""

    class Opened:
        n_finished, planned = count, 100

    return {("mine", ZERO.id): Opened()}


def test_what_is_left_takes_as_long_as_what_was_before(clock: Clock) -> None:
    meter = meter_of(ZERO)
    clock.now = 10.0
    for _ in range(2):  # Two processes.
        meter.measure(ZERO.id, outcomes(10, 1.0))
    progress = meter.read(rows_judged(20))
    assert (progress.finished, progress.planned, progress.seconds_left) == (20, 100, pytest.approx(40.0))


def test_cases_that_solve_bodies_count_for_more_until_they_are_measured(clock: Clock) -> None:
    meter = meter_of(ZERO, SOLVED)
    clock.now = 100.0
    meter.measure(ZERO.id, outcomes(100, 1.0))
    guess = meter.read(rows_judged(100)).seconds_left
    assert guess == pytest.approx(100 * driver._COSTS[True, False])
    clock.now = 107.0
    meter.measure(SOLVED.id, outcomes(1, 7.0))
    assert meter.read(rows_judged(100)).seconds_left == pytest.approx(700.0)


def test_a_property_costs_what_its_own_cases_have_cost(clock: Clock) -> None:
    meter = meter_of(ZERO, replace(ZERO, id="dear"))
    assert meter.read({}).seconds_left is None
    clock.now = 50.0
    meter.measure("dear", outcomes(5, 10.0))
    clock.now = 55.0
    meter.measure(ZERO.id, outcomes(5, 1.0))
    assert meter.read({}).seconds_left == pytest.approx(1100.0)
    price = meter.price({"mine": 0.4})
    assert price == ". An evaluation of mine takes 0.4 s: the whole takes about 18 min, with --examples 10 about 110 s"
    assert meter.price({"mine": 0.001}) == ""


def test_at_the_end_of_a_run_all_cases_are_judged_and_nothing_is_left() -> None:
    log: list[Progress] = []
    fewer = replace(ZERO, id="patch.fewer", cases=lambda _: sizes(7))
    lacking = replace(ZERO, id="patch.lacking", needs=frozenset({"tangent"}))
    run([subject()], [ZERO, LISTED, fewer, lacking], examples=40, seed=1, progress=log.append)
    steps = [step.of_run for step in log if step.of_run is not None]
    assert [step.finished for step in steps] == sorted(step.finished for step in steps)
    assert (steps[-1].finished, steps[-1].planned, steps[-1].seconds_left) == (50, 50, 0.0)
