"""Properties about the balance of the forces on both sides, and about their potential."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.interface import PLANE
from contactverif.contract.measurement import Finding, Measurement, Quantity, check_all
from contactverif.contract.property import WITH_BARRIER, Property
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.strategies import smooth_cases
from contactverif.strategies.surfaces import smooth_surface_cases, surface_cases
from contactverif_properties.shared import roundoff
from contactverif_properties.shared.any_state import any_cases, freeze_state, random_directions
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.kinks import excuse_barrier, find_kink, measure_jump
from contactverif_properties.shared.worst_force import COMPONENTS

FORCE_IMBALANCE = roundoff.stated_gap_quantity("force imbalance")
MOMENT_IMBALANCE = roundoff.stated_gap_quantity("moment imbalance")
N_LOOPS = 3
N_POINTS = 16  # Points on a loop: the error of the trapezoidal rule falls like (r/ℓ)^16.
# The radius of a loop over the shortest segment. The smaller ones are for a kink within a larger loop.
RADII = (2.0**-10, 2.0**-15, 2.0**-20)
ASYMMETRY = Quantity("asymmetry of the tangent", "u(8Z/min(g, ℓ) + 4N)", roundoff.SEGMENT_REASON)
WORK = Quantity(
    "work in a closed loop", "64 u Z/r", "Positions are rounded to uZ, and forces change with them over the radius r."
)


_define = partial(
    Property.define,
    family="balance",
    cases=Cases.random(any_cases),
    cases_in_space=Cases.random(surface_cases),
    asks=WITH_BARRIER,
)


@_define(
    id="balance.force",
    rank=280,
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
    rank=230,
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
    """Return what remains of the forces, or of their moment, over Σ|R| of the slave times the arm."""
    case, forces = state.case, state.forces
    tolerance = roundoff.gap_tolerance(
        case, roundoff.mean_penetration(case, forces), roundoff.rounding_distance(case, traits)
    )
    imbalance = roundoff.ratio(remainder, arm * roundoff.sum_slave_forces(case, forces))
    return Measurement([quantity.check(imbalance, tolerance)], idle=not forces.any())


@Property.define(
    id="symmetric",
    rank=300,
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
    without a potential do work in a closed loop: a vibrating part gains energy from contact. Who says that a tangent is
    symmetric, and makes it so by leaving out its other half, loses the quadratic convergence.

    **How it is judged.** The first number is max|K − Kᵀ| over max|K|, rows and columns of multipliers included. The
    tolerance is u(8Z/min(g, ℓ) + 4N). The second is the work in a closed loop over the sum of the works on its parts.
    The loops are three circles with a radius of r = 2^-10 ℓ in random planes of all unknowns, and the trapezoidal rule
    with 16 points is exact to roundoff there. The tolerance is 64 u Z/r: positions are rounded to uZ, and forces change
    over r. A formulation that says that its tangent is approximate is asked for the matrix alone.

    Without a pairing, a loop in which work is left and that may cross a kink is followed by one with r = 2^-15 ℓ, then
    by one with 2^-20 ℓ; those of a barrier are too, since its forces bend where they begin. Kinks are looked for at √2
    r along the two directions that span a circle, which none within the circle escapes.

    **Undecided.** A loop in which work is left is undecided where the formulation has no pairing, and a kink is nearer
    than the smallest r. Otherwise never: on a frozen pairing there are no kinks.
    """
    state = freeze_state(case, subject)
    case, distance = state.case, roundoff.rounding_distance(state.case, subject.traits)
    values, tolerances, undecided = {}, {}, ""
    if "tangent" in subject.provides:
        tangent = state.tangent
        values[ASYMMETRY] = roundoff.ratio(float(np.abs(tangent - tangent.T).max()), float(np.abs(tangent).max()))
        tolerances[ASYMMETRY] = roundoff.segment_tolerance(case, state.residual, distance)
    if subject.traits.promises.tangent != "approximate":
        values[WORK], tolerances[WORK], undecided = _find_work(state, subject, distance)
    return Measurement(check_all(values, tolerances), undecided, idle=not state.forces.any())


def _find_work(state: FrozenState, subject: Subject, distance: float) -> tuple[float, float, str]:
    """Return the work in closed loops, its tolerance, and why work that is left decides nothing.

    The distance Z, a length, is that at which positions are rounded. Loops become smaller until none is left.
    """
    # A barrier begins with a jump in the curvature of its forces, which a loop may cross on a frozen pairing, too.
    is_barrier = subject.traits.rules.enforcement == "barrier"
    steady = state.pairing is not None and not is_barrier
    work, tolerance, undecided = 0.0, 0.0, ""
    for share in RADII[:1] if steady else RADII:
        radius = share * state.case.resolution
        work, tolerance, undecided = largest_work(state, radius), 64 * UNIT_ROUNDOFF * distance / radius, ""
        if work <= tolerance or steady:
            break
        directions = random_directions(state.case.seed, 2 * N_LOOPS, state.case.z.size)
        if is_barrier:
            slope = measure_jump(state, radius, directions) / radius
            undecided = excuse_barrier(state, radius, radius, work * slope)
            continue
        # Two directions of a plane that reach √2 as far enclose the circle.
        kinks = (find_kink(state, np.sqrt(2) * radius, direction) for direction in directions)
        undecided = next(filter(None, kinks), "")
        if not undecided:
            break
    return work, tolerance, undecided


def largest_work(state: FrozenState, radius: float) -> float:
    """Return the largest work in a closed loop around a state, over the sum of the works on its parts.

    The loops are circles (`radius` is a length) on a frozen pairing.
    """
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
