"""Ask whether the forces change without a jump when the slave slides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.property import Property
from contactverif.contract.subject import Call, CheckedFormulation, Subject
from contactverif.contract.traits import Traits
from contactverif.strategies.sliding import sliding_cases
from contactverif_properties.shared.roundoff import ratio, rounding_distance, segment_tolerance, sum_larger_forces

N_STEPS = 12  # The steps of the way that are looked at first.
MOST_JUMPS = 3  # So many jumps are looked for, from the largest on.
HALVINGS, HALVINGS_OF_SLOPE = 20, 16
FIRST = 3  # So many halvings of each of the largest steps, before one is chosen.
ALLOWED, ALLOWED_OF_SLOPE = 2.0**-12, 2.0**-10  # Shares of the largest change over a step: 2^8 and 2^6 times 2^-n.
DIFFERENCE = 2.0**-26  # The step of the central difference along the way.
FORCE = Quantity(
    "jump of a force",
    "2^-12 Δ + u(8Z/min(g, ℓ) + 4N)",
    "After 20 halvings, a continuous force changes by 2^-20 of its change Δ over a step, and by roundoff.",
)
SLOPE = Quantity(
    "jump of a slope",
    "2^-10 Δ + 2^26 u(8Z/min(g, ℓ) + 4N)",
    "After 16 halvings, a continuous slope changes by 2^-16 of its change Δ over a step; differences raise roundoff.",
)
Function = Callable[[FloatArray], FloatArray]


def refuse_unstated_continuity(traits: Traits) -> str:
    """Return why the question makes no sense for a formulation, or an empty string if it does."""
    if traits.rules.enforcement == "multiplier":
        return "multipliers would change on the way, and here nothing is solved"
    return "the trait `continuity` is not stated" if traits.promises.continuity is None else ""


@Property.define(
    id="continuity",
    rank=270,
    family="invariants",
    quantities=(FORCE, SLOPE),
    cases=Cases.random(sliding_cases),
    promise=lambda traits: None if traits.promises.continuity is None else traits.promises.continuity != "jumps",
    applicable=refuse_unstated_continuity,
)
def continuity(case: Case, subject: Subject) -> Measurement:
    """Forces, or their slopes too, are continuous while a slave slides over the vertices of the master.

    **Question.** A slave slides along a bent master by the length of one of its segments, so that each of its points
    passes about one vertex. Do the forces change continuously, or with a continuous slope, as the trait `continuity`
    says?

    **Why it matters.** Where a force jumps, a load between both values has no equilibrium: Newton's method runs in
    circles between two pairings. Friction and dynamics make a noise there.

    **How it is judged.** The forces are computed after each of 12 steps of the way. The step that differs most from its
    neighbours is halved 20 times, always towards the larger change. A continuous force then changes by about 2^-20 of
    the step's change, and a jump is left as it is. The first number is the largest change of a force that is left, over
    Σ|R| of the slave. The tolerance is 2^-12 of the largest change over a step, plus u(8Z/min(g, ℓ) + 4N). A
    formulation that promises C1 is asked the same about the derivative along the way, a central difference on the
    frozen pairing: the step is halved 16 times, the tolerance is 2^-10 of the largest change plus 2^26 times that
    roundoff, and the unit is the largest derivative. The details say where the largest jump is (0 to 1), and how many
    were found, at most 3.

    Where a length of the slave lies parallel to the master and leaves it in one moment, the force of every law that
    does not pull has a bend; on such a way the slope is not asked.

    **Undecided.** Never. The slave stays far from the free ends of the master.
    """
    forces, slope = _functions(subject.for_case(case), case)
    samples = forces(_places())
    size = max(sum_larger_forces(case, sample) for sample in samples)
    rounding = segment_tolerance(
        case, samples[int(np.abs(samples).sum(axis=1).argmax())], rounding_distance(case, subject.traits)
    )
    jumps = find_jumps(forces, samples, HALVINGS, ALLOWED)
    values = {FORCE: ratio(jumps[0][1], size)}
    tolerances = {FORCE: ALLOWED * ratio(_largest_step(samples), size) + rounding}
    if subject.traits.promises.continuity == "C1" and not case.parameters.get("opens", 0.0):
        samples = slope(_places())
        steepest = float(np.abs(samples).max())
        values[SLOPE] = ratio(find_jumps(slope, samples, HALVINGS_OF_SLOPE, ALLOWED_OF_SLOPE)[0][1], steepest)
        tolerances[SLOPE] = ALLOWED_OF_SLOPE * ratio(_largest_step(samples), steepest) + rounding / DIFFERENCE
    places = [place for place, jump in jumps if ratio(jump, size) > tolerances[FORCE]]
    details = {"jumps": float(len(places))} | ({"place of the largest jump": places[0]} if places else {})
    return Measurement(check_all(values, tolerances), details=details, idle=size == 0)


def find_jumps(function: Function, samples: FloatArray, halvings: int, allowed: float) -> list[tuple[float, float]]:
    """Return the places and sizes of the jumps of a function on the way from 0 to 1, the largest first.

    The function takes places (k,) to values (k, n). Its samples (N_STEPS + 1, n) are at equal distances. A step is
    halved `halvings` times; less than the share `allowed` of its change counts as no jump, and ends the search.
    """
    changes = np.diff(samples, axis=0)
    padded = np.vstack([changes[1], changes, changes[-2]])
    trends = (padded[:-2] + padded[2:]) / 2  # The change of each step if it were like its neighbours.
    steps = [
        Bracket(step / N_STEPS, (step + 1) / N_STEPS, samples[step], samples[step + 1], trends[step])
        for step in range(N_STEPS)
    ]
    # A few halvings tell a jump from a bend of the way, which differs from its neighbours too.
    worst = sorted(halve(_select_worst(steps), function, FIRST), key=lambda bracket: -bracket.excess)
    jumps: list[tuple[float, float]] = []
    for bracket in worst:
        (last,) = halve([bracket], function, halvings - FIRST)
        jumps.append((last.left, last.change))
        if last.change <= allowed * float(np.abs(changes).max()):
            break
    return sorted(jumps, key=lambda jump: -jump[1])


def _select_worst(steps: list[Bracket]) -> list[Bracket]:
    """Return the steps with the largest excess; the neighbours of one have a part of its excess, and are left out."""
    selected: list[int] = []
    for number in sorted(range(len(steps)), key=lambda number: -steps[number].excess):
        if all(abs(number - other) > 1 for other in selected):
            selected.append(number)
    return [steps[number] for number in selected[:MOST_JUMPS]]


@dataclass(frozen=True, slots=True)
class Bracket:
    """A part of the way."""

    left: float  # Its ends, from 0 to 1.
    right: float
    before: FloatArray  # (n,) The values of the function there.
    behind: FloatArray
    trend: FloatArray  # (n,) The change that the neighbours suggest.

    @property
    def change(self) -> float:
        """The largest change of a value."""
        return float(np.abs(self.behind - self.before).max())

    @property
    def excess(self) -> float:
        """The largest change that the trend does not explain."""
        return float(np.abs(self.behind - self.before - self.trend).max())

    @property
    def middle(self) -> float:
        """The place half-way."""
        return (self.left + self.right) / 2

    def half(self, value: FloatArray) -> Bracket:
        """Return the half with the larger excess, where the function has a value (n,) half-way."""
        trend = self.trend / 2
        first = Bracket(self.left, self.middle, self.before, value, trend)
        second = Bracket(self.middle, self.right, value, self.behind, trend)
        return first if first.excess >= second.excess else second


def halve(brackets: Sequence[Bracket], function: Function, times: int) -> list[Bracket]:
    """Return the parts to which halving leads, always towards the larger excess.

    The function is asked for three places of each bracket at once, so that two halvings take one question.
    """
    while times > 1:
        middles = [bracket.middle for bracket in brackets]
        beside = [(bracket.left + bracket.middle) / 2 for bracket in brackets]
        behind = [(bracket.middle + bracket.right) / 2 for bracket in brackets]
        values = function(np.array([middles, beside, behind]).reshape(-1)).reshape(3, len(brackets), -1)
        brackets = [_quarter(bracket, *values[:, number]) for number, bracket in enumerate(brackets)]
        times -= 2
    if times:
        values = function(np.array([bracket.middle for bracket in brackets]))
        brackets = [bracket.half(value) for bracket, value in zip(brackets, values, strict=True)]
    return list(brackets)


def _quarter(bracket: Bracket, middle: FloatArray, first: FloatArray, second: FloatArray) -> Bracket:
    """Return what two halvings leave of a bracket, with the values (n,) in the middle and in those of its halves."""
    half = bracket.half(middle)
    return half.half(first if half.left == bracket.left else second)


def _functions(formulation: CheckedFormulation, case: Case) -> tuple[Function, Function]:
    """Return the forces (k, n_unknowns) as a function of k places on the way, and their slope."""
    interface, way = case.interface, case.parameters["path"]

    def forces(places: FloatArray) -> FloatArray:
        # Without a pairing the formulation takes one of each state, all in one question.
        return formulation.residual(interface, None, case.z + np.multiply.outer(places, way))

    def slope(places: FloatArray) -> FloatArray:
        states = [case.z + place * way for place in places]
        pairings = [formulation.pair(interface, z) for z in states]
        around = [np.array([z - DIFFERENCE * way, z + DIFFERENCE * way]) for z in states]
        calls: list[Call] = [
            ("residual", interface, pairing, pair) for pairing, pair in zip(pairings, around, strict=True)
        ]
        both = np.array(formulation.answers(calls))  # (k, 2, n_unknowns)
        slope: FloatArray = (both[:, 1] - both[:, 0]) / (2 * DIFFERENCE)
        return slope

    return forces, slope


def _places() -> FloatArray:
    return np.linspace(0.0, 1.0, N_STEPS + 1)


def _largest_step(samples: FloatArray) -> float:
    return float(np.abs(np.diff(samples, axis=0)).max())
