"""Forces on both sides that are in balance, have a potential, and change without a jump when the slave slides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case, Cases
from contactverif.contract.interface import PLANE
from contactverif.contract.property import WITH_BARRIER, Finding, Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Call, Subject
from contactverif.contract.traits import Traits
from contactverif.strategies import smooth_cases
from contactverif.strategies.surfaces import sliding_surface_cases, smooth_surface_cases, surface_cases
from contactverif.strategies.translations import sliding_cases
from contactverif_properties import roundoff
from contactverif_properties.applicability import refuse_unstated, tangent_error
from contactverif_properties.exact_forces import COMPONENTS
from contactverif_properties.kinks import excuse_barrier, find_kink, measure_jump
from contactverif_properties.roundoff import ratio, segment_tolerance, sum_larger_forces
from contactverif_properties.states import FrozenState, any_cases, freeze_state, random_directions

FORCE_IMBALANCE = roundoff.stated_gap_quantity("force imbalance")
MOMENT_IMBALANCE = roundoff.stated_gap_quantity("moment imbalance")
N_LOOPS = 3
N_POINTS = 16  # Points on a loop: the error of the trapezoidal rule falls like (r/ℓ)^16.
# The radius of a loop over the shortest segment. The smaller ones are for a kink within a larger loop.
RADII = (2.0**-10, 2.0**-15, 2.0**-20)
ASYMMETRY = Quantity("asymmetry of the tangent", "u(8Z/min(g, ℓ) + 4N)", roundoff.SEGMENT_REASON)
WORK = Quantity(
    "work in a closed loop",
    "64 u X/r",
    "Moved positions are rounded to uX, and forces change with them over the radius r.",
)


_define = partial(
    Property.define, cases=Cases.random(any_cases), cases_in_space=Cases.random(surface_cases), asks=WITH_BARRIER
)


@_define(
    id="balance.force",
    rank=295,
    role="exact",
    turn=0,
    quantities=(FORCE_IMBALANCE,),
    promise=lambda traits: traits.promises.conserves_force,
)
def force_balance(case: Case, subject: Subject) -> Measurement:
    """The forces on slave and master add up to zero on tilts, kinks and curves.

    **Question.** In a random state with tilts, kinks and curves, is the sum of all nodal forces zero?

    **Why it matters.** Contact is internal to the pair of bodies: action equals reaction. A formulation that loses a
    part of a force accelerates a free body, and the reactions at the supports do not add up to the load.

    **How it is judged.** The measured number is |ΣR| over Σ|R| of the slave. The tolerance is u(8Z/|g| + 4N + 128): a
    gap is a difference of positions, each rounded to uZ, N forces are summed, and the weights of two sides may come
    from two rules of integration, known to 1e-14. Z is the diameter D of the state for a formulation that promises
    `translation_stable`, and the largest coordinate X for any other: it may form points first, and measure the gap of
    each side anew. The printed VTS-PPT fails by 1 − cos θ of the slave's force on a tilt θ.

    **Undecided.** Never: a change of partner moves forces between nodes and leaves their sum as it is.
    """
    state = freeze_state(case, subject)
    total = state.forces.sum(axis=0)
    measurement = _judge(FORCE_IMBALANCE, float(np.linalg.norm(total)), 1.0, state, subject.traits)
    if measurement.numbers[0].ratio <= 1:
        return measurement
    slave = -state.forces[: state.case.interface.n_slave_nodes].sum(axis=0)
    names = ("force on the master", "minus that on the slave")
    place = f"all nodes of a side together, {COMPONENTS[case.interface.dim]}"
    return replace(measurement, finding=Finding(place, tuple(-total - slave), tuple(-slave), "N", *names))


@_define(
    id="balance.moment",
    rank=245,
    role="exact",
    turn=1,
    quantities=(MOMENT_IMBALANCE,),
    promise=lambda traits: traits.promises.conserves_moment,
)
def moment_balance(case: Case, subject: Subject) -> Measurement:
    """The moments of the forces on slave and master add up to zero on tilts, kinks and curves.

    **Question.** In a random state with tilts, kinks and curves, is the sum of the moments of all nodal forces zero?

    **Why it matters.** Two forces that balance but do not lie on one line turn a free body without any cause.

    **How it is judged.** Moments are taken about the centroid of the nodes. The measured number is |Σ x×R| over D Σ|R|
    of the slave, with the diameter D of the state. The tolerance is u(8Z/|g| + 4N + 128), with the distance Z of
    `balance.force`, and for its reasons.

    **Undecided.** Never: on either side of a kink a formulation that balances moments does so.
    """
    state = freeze_state(case, subject)
    arms, forces = state.case.positions - state.case.positions.mean(axis=0), state.forces
    if case.interface.dim == PLANE:
        moment = abs(float((arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum()))
    else:
        moment = float(np.linalg.norm(np.cross(arms, forces).sum(axis=0)))
    return _judge(MOMENT_IMBALANCE, moment, case.diameter, state, subject.traits)


def _judge(quantity: Quantity, remainder: float, arm: float, state: FrozenState, traits: Traits) -> Measurement:
    """Judge what remains of the forces, or of their moment, over Σ|R| of the slave times the arm."""
    case, forces = state.case, state.forces
    tolerance = roundoff.gap_tolerance(
        case, roundoff.mean_penetration(case, forces), roundoff.rounding_distance(case, traits)
    )
    imbalance = roundoff.ratio(remainder, arm * roundoff.sum_slave_forces(case, forces))
    return Measurement([quantity.check(imbalance, tolerance)], idle=not forces.any())


@Property.define(
    id="symmetric",
    rank=300,
    role="trait",
    family="invariants",
    quantities=(ASYMMETRY, WORK),
    cases=Cases.random(smooth_cases),
    cases_in_space=Cases.random(smooth_surface_cases),
    promise=lambda traits: traits.promises.symmetric,
    asks=WITH_BARRIER,
)
def symmetric(case: Case, subject: Subject) -> Measurement:
    """The tangent is symmetric, and the forces do no work in a closed loop inside one pairing.

    **Question.** Is K = Kᵀ in a random state? And do the forces do no work when the nodes run through a small closed
    loop, with the pairing frozen?

    **Why it matters.** With a symmetric tangent the linear solver needs half of the memory and of the time. Forces
    without a potential do work in a closed loop: a vibrating part gains energy from contact. A formulation that makes
    its tangent symmetric by leaving out the other half loses the quadratic convergence.

    **How it is judged.** The first number is max|K − Kᵀ| over max|K|, rows and columns of multipliers included. The
    tolerance is u(8Z/min(g, ℓ) + 4N), and 2 δ max(X/ℓ, 1) more of a stated error δ. The second is the work in a closed
    loop over the sum of the works on its parts. The loops are three circles with a radius of r = 2^-10 ℓ in random
    planes of all unknowns, and the trapezoidal rule with 16 points is exact to roundoff there. The tolerance is 64 u
    X/r: the harness rounds the moved positions to uX, and forces change over r. A formulation that says that its
    tangent is approximate is asked for the matrix alone.

    Without a pairing, a loop in which work is left and that may cross a kink is followed by one with r = 2^-15 ℓ, then
    by one with 2^-20 ℓ; those of a barrier are too, since its forces bend where they begin. Kinks are looked for at √2
    r along the two directions that span a circle: the square between these four points holds the circle.

    **Undecided.** A loop in which work is left is undecided where the formulation has no pairing, and a kink is nearer
    than the smallest r. Otherwise never: on a frozen pairing there are no kinks.
    """
    state = freeze_state(case, subject)
    case = state.case
    values, tolerances, undecided = {}, {}, ""
    if "tangent" in subject.provides:
        tangent = state.tangent
        values[ASYMMETRY] = roundoff.ratio(float(np.abs(tangent - tangent.T).max()), float(np.abs(tangent).max()))
        stated = 2 * tangent_error(subject.traits) * max(case.largest_coordinate / case.resolution, 1.0)
        distance = roundoff.rounding_distance(case, subject.traits)
        tolerances[ASYMMETRY] = roundoff.segment_tolerance(case, state.residual, distance) + stated
    if subject.traits.promises.tangent != "approximate":
        values[WORK], tolerances[WORK], undecided = _find_work(state, subject)
    measurement = Measurement(check_all(values, tolerances), undecided, idle=not state.forces.any())
    return measurement.after(f"moved round circles of radius {RADII[0] * case.resolution:.2g} or less", WORK)


def _find_work(state: FrozenState, subject: Subject) -> tuple[float, float, str]:
    """Return the work in closed loops, its tolerance, and why work that is left decides nothing."""
    # A barrier begins with a jump in the curvature of its forces, which a loop may cross on a frozen pairing, too.
    is_barrier = subject.traits.rules.enforcement == "barrier"
    steady = state.pairing is not None and not is_barrier
    work, tolerance, undecided = 0.0, 0.0, ""
    for share in RADII[:1] if steady else RADII:
        radius = share * state.case.resolution
        work, undecided = _largest_work(state, radius), ""
        tolerance = 64 * UNIT_ROUNDOFF * state.case.largest_coordinate / radius
        if work <= tolerance or steady:
            break
        directions = random_directions(state.case.seed, 2 * N_LOOPS, state.case.z.size)
        if is_barrier:
            slope = measure_jump(state, radius, directions) / radius
            undecided = excuse_barrier(state, radius, radius, work * slope)
            continue
        # The four points at ±√2 r along the two directions of a plane are the corners of a square around the circle.
        kinks = (find_kink(state, np.sqrt(2) * radius, direction) for direction in directions)
        undecided = next(filter(None, kinks), "")
        if not undecided:
            break
    return work, tolerance, undecided


def _largest_work(state: FrozenState, radius: float) -> float:
    """Return the largest work in a circle on a frozen pairing over the sum of the works on its parts."""
    case = state.case
    planes = random_directions(case.seed, 2 * N_LOOPS, case.z.size).reshape(N_LOOPS, 2, 1, -1)
    angles = 2 * np.pi * np.arange(N_POINTS)[:, None] / N_POINTS
    moves = radius * (np.cos(angles) * planes[:, 0] + np.sin(angles) * planes[:, 1])  # (N_LOOPS, N_POINTS, n)
    steps = radius * (np.cos(angles) * planes[:, 1] - np.sin(angles) * planes[:, 0]) * (2 * np.pi / N_POINTS)
    forces = state.residual_at(case.z + moves)
    forces = forces - forces.mean(axis=1, keepdims=True)  # A constant force does no work in a loop.
    works = forces * steps
    work, throughput = np.abs(works.sum(axis=(1, 2))), np.abs(works).sum(axis=(1, 2))
    return max(map(roundoff.ratio, work.tolist(), throughput.tolist()))


N_STEPS = 12  # The steps of the way that are looked at first.
PLACES = np.linspace(0.0, 1.0, N_STEPS + 1)
MOST_JUMPS = 3  # So many jumps are looked for, from the largest on.
HALVINGS, HALVINGS_OF_SLOPE = 20, 16
FIRST_HALVINGS = 3  # Those of each of the largest steps, before one is chosen.
ALLOWED, ALLOWED_OF_SLOPE = 2.0**-12, 2.0**-10  # Shares of the largest change over a step: 2^8 and 2^6 times 2^-n.
DIFFERENCE = 2.0**-26  # The step of the central difference along the way.
FORCE = Quantity(
    "jump of a force",
    "2^-12 Δ + u(8X/min(g, ℓ) + 4N)",
    "After 20 halvings, a continuous force changes by 2^-20 of its change Δ over a step, and by roundoff.",
)
SLOPE = Quantity(
    "jump of a slope",
    "2^-10 Δ + 2^26 u(8X/min(g, ℓ) + 4N)",
    "After 16 halvings, a continuous slope changes by 2^-16 of its change Δ over a step; differences raise roundoff.",
)
Function = Callable[[FloatArray], FloatArray]


@Property.define(
    id="continuity",
    rank=270,
    family="invariants",
    quantities=(FORCE, SLOPE),
    cases=Cases.random(sliding_cases),
    cases_in_space=Cases.random(sliding_surface_cases),
    promise=lambda traits: None if traits.promises.continuity is None else traits.promises.continuity != "jumps",
    applicable=lambda traits: (
        "multipliers would change on the way, and here nothing is solved"
        if traits.rules.enforcement == "multiplier"
        else refuse_unstated(traits, "continuity", group="promises")
    ),
)
def continuity(case: Case, subject: Subject) -> Measurement:
    """Forces, or their slopes too, are continuous while a slave slides over the vertices of the master.

    **Question.** A slave slides along a bent master by the length of one of its segments, so that each of its points
    passes about one vertex. Do the forces change continuously, or with a continuous slope, as the trait `continuity`
    says? In space a tilted slave slides over the edges of a flat master.

    **Why it matters.** Where a force jumps, a load between both values has no equilibrium: Newton's method runs in
    circles between two pairings. Friction and dynamics make a noise there.

    **How it is judged.** The forces are computed after each of 12 steps of the way. The step that differs most from its
    neighbours is halved 20 times, always towards the larger change. A continuous force then changes by about 2^-20 of
    the step's change, and a jump is left as it is. The first number is the largest change of a force that is left, over
    Σ|R| of the slave. The tolerance is 2^-12 of the largest change over a step, plus u(8X/min(g, ℓ) + 4N). A
    formulation that promises C1 is asked the same about the derivative along the way, a central difference on the
    frozen pairing: the step is halved 16 times, the tolerance is 2^-10 of the largest change plus 2^26 times that
    roundoff, and the unit is the largest derivative. The details say where the largest jump is (0 to 1), and how many
    were found, at most 3.

    Where a length of the slave lies parallel to the master and leaves it in one moment, the force of every law that
    does not pull has a bend; on such a way the slope is not asked.

    **Undecided.** Never. The slave stays off the free ends of the master.
    """
    formulation, interface, way = subject.for_case(case), case.interface, case.parameters["path"]

    def forces(places: FloatArray) -> FloatArray:  # (k, n_unknowns) at k places on the way.
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
        return np.asarray((both[:, 1] - both[:, 0]) / (2 * DIFFERENCE))

    samples = forces(PLACES)
    size = max(sum_larger_forces(case, sample) for sample in samples)
    largest = samples[int(np.abs(samples).sum(axis=1).argmax())]
    rounding = segment_tolerance(case, largest, case.largest_coordinate)  # Places on the way are rounded there.
    jumps = find_jumps(forces, samples, HALVINGS, ALLOWED)
    values = {FORCE: ratio(jumps[0][1], size)}
    tolerances = {FORCE: ALLOWED * ratio(_largest_step(samples), size) + rounding}
    if subject.traits.promises.continuity == "C1" and not case.parameters.get("opens", 0.0):
        samples = slope(PLACES)
        steepest = float(np.abs(samples).max())
        values[SLOPE] = ratio(find_jumps(slope, samples, HALVINGS_OF_SLOPE, ALLOWED_OF_SLOPE)[0][1], steepest)
        tolerances[SLOPE] = ALLOWED_OF_SLOPE * ratio(_largest_step(samples), steepest) + rounding / DIFFERENCE
    places = [place for place, jump in jumps if ratio(jump, size) > tolerances[FORCE]]
    details = {"jumps": float(len(places))} | ({"place of the largest jump": places[0]} if places else {})
    measurement = Measurement(check_all(values, tolerances), details=details, idle=size == 0)
    slid = float(np.linalg.norm(way[: interface.dim]))
    return measurement.after(f"slid by {slid:.4g} along the master, {jumps[0][0]:.2g} of the way")


def find_jumps(function: Function, samples: FloatArray, halvings: int, allowed: float) -> list[tuple[float, float]]:
    """Return the places and sizes of the jumps of a function on the way from 0 to 1, the largest first.

    The function takes places (k,) to values (k, n). Its samples (N_STEPS + 1, n) are at equal distances. A step is
    halved `halvings` times; less than the share `allowed` of its change counts as no jump, and ends the search.
    """
    changes = np.diff(samples, axis=0)
    padded = np.vstack([changes[1], changes, changes[-2]])
    trends = (padded[:-2] + padded[2:]) / 2  # The change of each step if it were like its neighbours.
    steps = [
        _Bracket(step / N_STEPS, (step + 1) / N_STEPS, samples[step], samples[step + 1], trends[step])
        for step in range(N_STEPS)
    ]
    selected: list[int] = []  # The neighbours of a step with a large excess have a part of it, and are left out.
    for number in sorted(range(N_STEPS), key=lambda number: -steps[number].excess):
        if all(abs(number - other) > 1 for other in selected):
            selected.append(number)
    # A few halvings tell a jump from a bend of the way, which differs from its neighbours too.
    few = _halve([steps[number] for number in selected[:MOST_JUMPS]], function, FIRST_HALVINGS)
    jumps: list[tuple[float, float]] = []
    for bracket in sorted(few, key=lambda bracket: -bracket.excess):
        (last,) = _halve([bracket], function, halvings - FIRST_HALVINGS)
        jumps.append((last.left, last.change))
        if last.change <= allowed * float(np.abs(changes).max()):
            break
    return sorted(jumps, key=lambda jump: -jump[1])


class _Bracket(NamedTuple):
    """A part of the way."""

    left: float  # Its ends, from 0 to 1.
    right: float
    before: FloatArray  # (n,) The values of the function there.
    behind: FloatArray
    trend: FloatArray  # (n,) The change that the neighbours suggest.

    @property
    def change(self) -> float:
        return float(np.abs(self.behind - self.before).max())

    @property
    def excess(self) -> float:
        """The largest change that the trend does not explain."""
        return float(np.abs(self.behind - self.before - self.trend).max())

    @property
    def middle(self) -> float:
        return (self.left + self.right) / 2

    def half(self, value: FloatArray) -> _Bracket:
        """Return the half with the larger excess, where the function has a value (n,) half-way."""
        trend = self.trend / 2
        first = _Bracket(self.left, self.middle, self.before, value, trend)
        second = _Bracket(self.middle, self.right, value, self.behind, trend)
        return first if first.excess >= second.excess else second


def _halve(brackets: list[_Bracket], function: Function, times: int) -> list[_Bracket]:
    """Return the parts to which halving leads, always towards the larger excess."""
    # Three places of each bracket are asked for at once, so that two halvings take one question.
    while times > 0:
        middles = [bracket.middle for bracket in brackets]
        if times == 1:
            return [bracket.half(value) for bracket, value in zip(brackets, function(np.array(middles)), strict=True)]
        beside = [(bracket.left + bracket.middle) / 2 for bracket in brackets]
        behind = [(bracket.middle + bracket.right) / 2 for bracket in brackets]
        values = function(np.array([middles, beside, behind]).reshape(-1)).reshape(3, len(brackets), -1)
        halves = [bracket.half(value) for bracket, value in zip(brackets, values[0], strict=True)]
        sides = [int(half.left != bracket.left) for half, bracket in zip(halves, brackets, strict=True)]
        brackets = [
            half.half(values[1 + side, number]) for number, (half, side) in enumerate(zip(halves, sides, strict=True))
        ]
        times -= 2
    return brackets


def _largest_step(samples: FloatArray) -> float:
    return float(np.abs(np.diff(samples, axis=0)).max())
