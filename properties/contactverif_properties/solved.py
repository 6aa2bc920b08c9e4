"""The patch test solved: elastic bodies under a uniform pressure that is known exactly, at moderate and high penalty.

Both are asked because they say different things. At a moderate penalty a wrong distribution of forces bends the bodies;
as the penalty grows, methods that only interpolate the gap well lock into the right pressure and seem to pass. The
slope of the error over the penalty, a detail of every measurement, tells the two apart: 0 fails, −1 passes because it
locks.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.mechanics.newton import NEAR_CONVERGENCE, Trace, solve
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.scenes.blocks import exact_unknowns, overhangs, pressure_of
from contactverif.scenes.uniform_stress import (
    PRESSURE_TOLERANCE,
    STRESS_TOLERANCE,
    stress_error,
    uniform_tolerances,
)
from contactverif.strategies.solids import block_cases, variant_cases
from contactverif_properties.anywhere import no_barrier
from contactverif_properties.multipliers import nearest_solution, right_multipliers
from contactverif_properties.patch import consistent_forces

HIGH = 1e3  # × the moderate penalty of a case
ITERATIONS = 25  # a method that transmits a uniform pressure needs one; one that does not a few more, or none is enough
SLOPE = "slope over penalties (−1 if it locks)"
NEAR = 2.0**-10  # × the penetration: less far from the exact solution, it is the same one

REASON = (
    "κ, the greater of ε̂h and the stiffer body's E over the softer one's, is the matrix's condition; r is the ratio of "
    "the shortest segment to the longest; a gap p/ε̂ is a difference of positions X, and a nodal force is in balance to "
    "8 roundoffs of its 8 springs × X; displacements U are rounded, and make stresses M U/ℓ on the shortest segment"
)
PRESSURE_REASON = f"{REASON}; the shortest segment carries what the force of the longest one lacks"
GAP_TOLERANCE = f"({STRESS_TOLERANCE}) (1 + ε̂ ΣH/M)"
GAP_REASON = (
    f"{REASON}; where no spring sees a height, the bodies hold it, which give way by ΣH/M under a unit pressure"
)
QUANTITIES = (
    Quantity("stress", "1", STRESS_TOLERANCE, REASON),
    Quantity("slave forces", "1", STRESS_TOLERANCE, REASON),
    Quantity("master forces", "1", STRESS_TOLERANCE, REASON),
    Quantity("gap", "1", GAP_TOLERANCE, GAP_REASON),
    Quantity("pressure", "1", PRESSURE_TOLERANCE, PRESSURE_REASON),
)
HIGH_QUANTITIES = tuple(replace(quantity, name=f"{quantity.name}, high penalty") for quantity in QUANTITIES)
MULTIPLIERS = Quantity(
    "multipliers",
    "1",
    f"({STRESS_TOLERANCE})/s",
    f"{REASON}; s is the smallest singular value of what the bodies feel of the multipliers over the largest",
)


def solved(case: Case, subject: Subject) -> Measurement:
    """Stress, forces on both sides, gap and reported pressure against the exact ones, at two penalties.

    Returns
    -------
    Measurement
        As `at_penalty`, for the penalty of the case and for one that is HIGH times larger. Details: how each solution
        ended, and the slope of the stress error over the penalties. Multipliers have no penalty and are asked once.
    """
    if subject.traits.enforcement == "multiplier":
        return solved_once(case, subject)
    moderate = at_penalty(case, subject, case.penalty)
    high = at_penalty(case, subject, HIGH * case.penalty)
    errors = moderate.values["stress"], high.values["stress"]
    slope = float(np.log(errors[1] / errors[0]) / np.log(HIGH)) if min(errors) > 0 else 0.0

    def named(numbers: object) -> dict[str, float]:
        assert isinstance(numbers, dict)
        return {f"{name}, high penalty": number for name, number in numbers.items()}

    return Measurement(
        {**moderate.values, **named(high.values)},
        {**moderate.tolerances, **named(high.tolerances)},
        undecided=moderate.undecided or high.undecided,
        details={**moderate.details, **named(high.details), SLOPE: slope},
    )


def solved_once(case: Case, subject: Subject) -> Measurement:
    """The same at the penalty of the case alone, or by multipliers."""
    return (by_multipliers if subject.traits.enforcement == "multiplier" else at_penalty)(case, subject, case.penalty)


def by_multipliers(case: Case, subject: Subject, penalty: float) -> Measurement:
    """The scene solved as a saddle point against the exact solution without penetration, as numbers without dimension.

    Returns
    -------
    Measurement
        stress and forces as `at_penalty`; gap over p/ε̂, with the penalty that is not there as a measure. multipliers:
        largest error of one over p, where they are pressures. Where they are not unique, those of the solutions count
        that are nearest to the right ones. Where the exact solution is one of the formulation's, to roundoff, it counts
        for one that Newton found less exactly. Details: how it ended, and how many were not unique.
    """
    scene, pressure = scene_of(case), pressure_of(case, np.inf)
    formulation = subject.for_case(replace(case, penalty=penalty))
    exact = exact_unknowns(scene, pressure, np.inf)
    right = right_multipliers(replace(case, z=scene.positions(exact)), subject, formulation, pressure)
    exact_u = np.append(exact, right)

    def errors(u: FloatArray) -> Measurement:
        q = u[: scene.n_free]
        here = replace(case, z=np.append(scene.positions(q), u[scene.n_free :]), n_multipliers=len(right))
        multipliers, sharpness = nearest_solution(here, scene, formulation, right)
        here = replace(here, z=np.append(scene.positions(q), multipliers))
        slave, master = force_errors(here, scene, formulation, q, pressure)
        values = {
            "stress": stress_error(scene, scene.stresses(q), pressure),
            "slave forces": slave,
            "master forces": master,
            "gap": gap_error(here, 0.0, pressure / penalty),
        }
        roundoff = uniform_tolerances(here, scene, pressure)
        tolerances = dict.fromkeys(values, roundoff.stress)
        tolerances["gap"] *= 1 + penalty * float(case.parameters["compliance"].sum())
        if subject.traits.penalty == "distributed":
            carry = right != 0  # one that faces nothing has none
            values[MULTIPLIERS.name] = float(np.abs(multipliers[carry] / pressure - 1).max(initial=0.0))
            tolerances[MULTIPLIERS.name] = roundoff.stress / sharpness
        return Measurement(values, tolerances)

    trace, u = solution(scene, formulation, exact_u, pressure / penalty)
    found = errors(u)
    if any(value > found.tolerances[name] for name, value in found.values.items()):
        # a saddle point that is nearly singular spoils what Newton finds, and not that the exact solution is one
        at_exact = solve(scene, formulation, start=exact_u, iterations=1, use_tangent=False)
        if at_exact.roundings[0] <= NEAR_CONVERGENCE:
            found = errors(exact_u)
    return replace(found, details=_ended(trace))


def at_penalty(case: Case, subject: Subject, penalty: float) -> Measurement:
    """The solved scene against the exact solution, as numbers without dimension.

    Returns
    -------
    Measurement
        stress: largest entry of σ − σ_exact at the Gauss points, over p. Slave and master forces: largest of a node, of
        what the bodies need to be in balance and of what the formulation gives, over p L. gap: largest error of a
        node's height over the other surface, or of what the formulation says of its contact points, over p/ε̂.
        pressure: largest error of what it says they carry, over p; missing where it says nothing, or is nodal and so
        knows forces only. Of idle points those of no weight, without a master segment or beside the master do
        not count.
    """
    scene, pressure = scene_of(case), pressure_of(case, penalty)
    formulation = subject.for_case(replace(case, penalty=penalty))
    exact = exact_unknowns(scene, pressure, penalty)
    trace, q = solution(scene, formulation, exact, pressure / penalty)
    z = scene.positions(q)
    here = replace(case, z=z, penalty=penalty)
    slave, master = force_errors(here, scene, formulation, q, pressure)
    values = {
        "stress": stress_error(scene, scene.stresses(q), pressure),
        "slave forces": slave,
        "master forces": master,
        "gap": gap_error(here, pressure / penalty, pressure / penalty),
    }
    if "contact_points" in formulation.provides:
        points = formulation.contact_points(case.interface, formulation.pair(case.interface, z), z)
        carry = (points.weight != 0) & (points.active | (points.master_segment >= 0) & ~beside(case, points))
        said = np.where(carry, points.gap, -pressure / penalty)  # NaN where meaningless
        values["gap"] = max(values["gap"], float(np.nanmax(np.abs(said * penalty / pressure + 1), initial=0.0)))
        if subject.traits.penalty != "nodal":
            found = np.where(points.active, points.pressure, 0.0)[carry]
            values["pressure"] = float(np.abs(found - pressure).max(initial=0.0) / pressure) if len(found) else np.inf
    roundoff = uniform_tolerances(here, scene, pressure)
    tolerances = dict.fromkeys(values, roundoff.stress)
    tolerances["gap"] *= 1 + penalty * float(case.parameters["compliance"].sum())
    if "pressure" in values:
        tolerances["pressure"] = roundoff.pressure
    return Measurement(values, tolerances, details=_ended(trace))


def beside(case: Case, points: ContactPoints) -> BoolArray:
    """Which points (n_points,) of a slave that overhangs its master lie beside it, or as near its end as roundoff is.

    A point that names no place on the slave does not.
    """
    if not overhangs(case):
        return np.zeros(len(points.c), bool)
    slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    ends = slave[case.interface.slave.segments[points.slave_segment]]  # of segment −1 too, where nothing is asked
    place = (1 - points.c) / 2 * ends[:, 0] + (1 + points.c) / 2 * ends[:, 1]
    rounding = 64 * UNIT_ROUNDOFF * case.largest_coordinate
    found: BoolArray = (place < master.min() + rounding) | (place > master.max() - rounding)
    return found & (points.slave_segment >= 0)


def solution(
    scene: Scene, formulation: CheckedFormulation, exact: FloatArray, penetration: float
) -> tuple[Trace, FloatArray]:
    """Newton's trace from the first guess of the scene, and the unknowns (n,) of the solution that is judged.

    The patch test asks about the residual alone, so Newton's method differentiates it, and the formulation's own
    tangent has no part in this. It asks whether the exact solution is one of the formulation's: where Newton ends
    elsewhere, as it may since large motions have other solutions too, it begins again at the exact one, where a
    formulation that passes is in balance and does not move. One that is not is judged where it comes nearest to balance
    afterwards.
    """
    trace = solve(scene, formulation, iterations=ITERATIONS, use_tangent=False)
    if trace.converged and np.abs(trace.solution - exact[: scene.n_free]).max(initial=0.0) <= NEAR * penetration:
        return trace, trace.u[-1]
    again = solve(scene, formulation, start=exact, iterations=ITERATIONS, use_tangent=False)
    balanced = again.roundings[0] <= NEAR_CONVERGENCE or len(again.u) == 1
    return trace, again.u[0] if balanced else again.u[1 + np.argmin(again.roundings[1:])]


def force_errors(
    case: Case, scene: Scene, formulation: CheckedFormulation, q: FloatArray, pressure: float
) -> tuple[float, float]:
    """Largest error of a nodal force on the slave and on the master, over p L.

    Of what the bodies need, and of what the formulation gives: they are not the same where it found no balance, and at
    rollers, which take what the bodies do not need.
    """
    needed = scene.nodal_forces(q)
    pairing = formulation.pair(case.interface, case.z)
    given = -formulation.residual(case.interface, pairing, case.z)[: case.interface.n_unknowns].reshape(-1, 2)
    first = 0
    for index in scene.bodies_in_reach:
        last = first + len(scene.bodies[index].contact_nodes)
        if scene.bodies[index].rigid:
            needed[first:last] = given[first:last]
        first = last
    exact = consistent_forces(case, pressure)
    errors = np.maximum(*(np.linalg.norm(forces - exact, axis=1) for forces in (needed, given)))
    errors /= pressure * case.slave_length
    n_slave = case.interface.n_slave_nodes
    return float(errors[:n_slave].max()), float(errors[n_slave:].max())


def gap_error(case: Case, penetration: float, size: float) -> float:
    """Largest departure of a node's height from a plane slave at `penetration` below a plane master, over `size`.

    A slave node beside the master stands for the place that is opposite the master's end: what overhangs may bend.
    """
    along = case.parameters["direction"]
    heights = case.positions @ [-along[1], along[0]]
    n_slave = case.interface.n_slave_nodes
    slave, master = np.split(case.parameters["along"], [n_slave])
    order = np.argsort(slave)
    heights[:n_slave] = np.interp(np.clip(slave, master.min(), master.max()), slave[order], heights[:n_slave][order])
    level = heights[n_slave:].mean()
    errors = np.abs(heights - level + np.where(np.arange(len(heights)) < n_slave, penetration, 0.0))
    return float(errors.max() / size)


def exact_picture(case: Case) -> FloatArray:
    """For pictures: the exact forces (n_nodes, 2) at the penalty of the case."""
    return consistent_forces(case, pressure_of(case, case.penalty))


def _ended(trace: Trace) -> dict[str, float]:
    details = {"end": float(trace.end), "iterations": float(trace.n_iterations)}
    if len(trace.multipliers):
        details["multipliers too many"] = float(trace.deficiency)
    return details


FLAT_SOLVE = Property(
    id="patch.flat.solve",
    family="patch",
    summary="two elastic blocks under a uniform pressure: exact stress, forces on both sides, gap, at two penalties",
    quantities=(*QUANTITIES, *HIGH_QUANTITIES, MULTIPLIERS),
    cases=block_cases,
    measure=solved,
    promise=lambda traits: traits.passes_flat_patch,
    applicable=no_barrier,
    bodies=True,
    exact=exact_picture,
)
VARIANTS = Property(
    id="patch.variants",
    family="patch",
    summary="a uniform pressure on a rigid master, with unequal materials, inclined, slid along, and under a punch",
    quantities=(*QUANTITIES, MULTIPLIERS),
    cases=variant_cases,
    measure=solved_once,
    promise=lambda traits: traits.passes_flat_patch,
    applicable=no_barrier,
    bodies=True,
    exact=exact_picture,
)
