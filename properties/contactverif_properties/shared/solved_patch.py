"""The patch test solved: two elastic bodies under a uniform pressure, judged against the exact solution.

The patch test asks about the residual alone, so Newton's method differentiates the residual by itself. The
formulation's own tangent serves only where a difference confirms it. The question is whether the exact solution is a
solution of the formulation.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.engine_subject import EngineSubject
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import PLANE, Surface
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.mechanics.newton import NEAR_CONVERGENCE, solve
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.mechanics.trace import Trace
from contactverif.problems.blocks import exact_unknowns, overhangs, pressure_of
from contactverif.problems.uniform_stress import PRESSURE_TOLERANCE, STRESS_TOLERANCE, stress_error, uniform_tolerances
from contactverif_properties.shared.engine_patch import REPORTED_FORCES, REPORTED_PRESSURES, measure_engine
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.newton_solution import end_details
from contactverif_properties.shared.roundoff import COORDINATE_ROUNDING
from contactverif_properties.shared.uniform_pressure import (
    consistent_forces,
    exact_solution,
    gap_error,
    nearest_multipliers,
)

ITERATIONS = 25  # A method that transmits a uniform pressure needs one iteration. The others need a few more.
SAME_SOLUTION = 2.0**-10  # A solution this close to the exact one, over the penetration, counts as the same one.

REASON = (
    "κ, the greater of ε̂h and the stiffer body's E over the softer body's E, measures the condition of the matrix. "
    "r is the shortest segment over the longest. "
    "A gap p/ε̂ is a difference of positions X, and a node balances about 8 springs to 8 roundoffs. "
    "Displacements U are rounded, which makes stresses M U/ℓ on the shortest segment."
)
STRESS = Quantity("stress error", STRESS_TOLERANCE, REASON)
SLAVE_FORCES = Quantity("slave force error", STRESS_TOLERANCE, REASON)
MASTER_FORCES = Quantity("master force error", STRESS_TOLERANCE, REASON)
GAP = Quantity(
    "gap error",
    f"({STRESS_TOLERANCE}) (1 + ε̂ ΣH/M)",
    f"{REASON} Where no spring measures a height, the bodies hold it, and they give way by ΣH/M under a unit pressure.",
)
PRESSURE = Quantity(
    "pressure error",
    PRESSURE_TOLERANCE,
    f"{REASON} The shortest segment carries what the force of the longest one lacks.",
)
MULTIPLIERS = Quantity(
    "multiplier error",
    f"({STRESS_TOLERANCE})/s",
    f"{REASON} s is the smallest singular value of the loads of unit multipliers on the bodies over the largest one.",
)
QUANTITIES = (STRESS, SLAVE_FORCES, MASTER_FORCES, GAP, PRESSURE, REPORTED_FORCES, REPORTED_PRESSURES)


def measure_once(case: Case, subject: Subject) -> Measurement:
    """Solve the scene of the case at its own penalty, or with multipliers, and return the errors."""
    if subject.traits.rules.enforcement == "multiplier" and not isinstance(subject, EngineSubject):
        return measure_with_multipliers(case, subject)
    return measure_at_penalty(case, subject, case.penalty)


def measure_at_penalty(case: Case, subject: Subject, penalty: float) -> Measurement:
    """Solve the scene of the case with a penalty method at a distributed penalty ε̂, and return its errors.

    Stress error: the largest entry of σ − σ_exact at the Gauss points over p. Slave and master force errors: the
    largest error of a nodal force over p L (`force_errors`). Gap error: the largest error of a node's height, or of a
    reported gap, over p/ε̂. Pressure error: the largest error of a reported pressure over p; it is missing where the
    formulation reports none, or is nodal and so knows forces only.
    """
    if isinstance(subject, EngineSubject):
        return measure_engine(case, subject, penalty, (STRESS, SLAVE_FORCES, MASTER_FORCES, GAP))
    scene, pressure = scene_of(case), pressure_of(case, penalty)
    formulation = subject.for_interface(case.interface, penalty)
    exact = exact_unknowns(scene, pressure, penalty)
    trace, q = solve_patch(scene, formulation, exact, pressure / penalty)
    state = replace(case, z=scene.positions(q), penalty=penalty)
    contact = contact_at(state, trace, formulation)
    values = _errors(contact, scene, q, pressure)
    values[GAP] = gap_error(state, pressure / penalty, pressure / penalty)
    if contact.has_points:
        gap, reported = point_errors(contact, penalty, pressure)
        values[GAP] = max(values[GAP], gap)
        if subject.traits.rules.penalty != "nodal":
            values[PRESSURE] = reported
    roundoff = uniform_tolerances(state, scene, pressure)
    tolerances = _tolerances(case, penalty, roundoff.stress) | {PRESSURE: roundoff.pressure}
    return Measurement(check_all(values, tolerances), details=end_details(trace))


def _errors(state: FrozenState, scene: Scene, q: FloatArray, pressure: float) -> dict[Quantity, float]:
    """Return the errors of stresses and forces in the state at the unknowns q (n_free,)."""
    slave, master = force_errors(state, scene, q, pressure)
    stress = stress_error(scene, scene.stresses(q), pressure)
    return {STRESS: stress, SLAVE_FORCES: slave, MASTER_FORCES: master}


def _tolerances(case: Case, penalty: float, tolerance: float) -> dict[Quantity, float]:
    """Return one tolerance for stresses and forces; that of gaps is 1 + ε̂ ΣH/M times as large."""
    factor = 1 + penalty * float(case.parameters["compliance"].sum())
    return dict.fromkeys((STRESS, SLAVE_FORCES, MASTER_FORCES), tolerance) | {GAP: tolerance * factor}


def measure_with_multipliers(case: Case, subject: Subject) -> Measurement:
    """Solve the scene of the case as a saddle point and return its errors against the solution without penetration.

    Where the exact solution is a solution of the formulation, to roundoff, it counts in place of one that Newton's
    method found less exactly: a saddle point that is nearly singular spoils what Newton's method finds, and not the
    fact that the exact solution is one. The penalty ε̂ serves as the scale c, and as the measure of gaps. Multipliers
    are compared with p where they are pressures; where they are not unique, those nearest to the exact ones count.
    """
    scene, pressure, penalty = scene_of(case), pressure_of(case, np.inf), case.penalty
    formulation = subject.for_case(case)
    exact = exact_solution(scene, case, subject, formulation)
    multipliers = exact[scene.n_free :]

    def measure_errors(u: FloatArray) -> Measurement:
        """Return the errors of the unknowns u (n_free + n_multipliers,), with their tolerances."""
        q = u[: scene.n_free]
        state = replace(case, z=scene.positions(q)).with_multipliers(u[scene.n_free :])
        nearest, sharpness = nearest_multipliers(state, scene, formulation, multipliers)
        state = state.with_multipliers(nearest)
        values = _errors(FrozenState.at(formulation, state), scene, q, pressure)
        values[GAP] = gap_error(state, 0.0, pressure / penalty)
        tolerance = uniform_tolerances(state, scene, pressure).stress
        tolerances = _tolerances(case, penalty, tolerance)
        if subject.traits.rules.penalty == "distributed":
            loaded = multipliers != 0  # The multiplier of a node that faces nothing is 0.
            values[MULTIPLIERS] = float(np.abs(nearest[loaded] / pressure - 1).max(initial=0.0))
            tolerances[MULTIPLIERS] = tolerance / sharpness
        return Measurement(check_all(values, tolerances))

    trace, u = solve_patch(scene, formulation, exact, pressure / penalty)
    measurement = measure_errors(u)
    fails = any(number.value > number.tolerance for number in measurement.numbers)
    if fails and trace.roundings[0] <= NEAR_CONVERGENCE:
        measurement = measure_errors(exact)
    return replace(measurement, details=end_details(trace))


def solve_patch(
    scene: Scene, formulation: CheckedFormulation, exact: FloatArray, penetration: float
) -> tuple[Trace, FloatArray]:
    """Solve a scene from its exact solution; return Newton's trace and the unknowns (n_free + n_multipliers,) to judge.

    A formulation that passes is in balance there and does not move. Large motions have other solutions too, which
    nobody asks for. A formulation that is not in balance there is judged where it comes nearest to balance afterwards.
    """
    trace = solve(scene, formulation, start=exact, iterations=ITERATIONS, use_tangent=False, solution_only=True)
    return trace, trace.u[-1] if is_solved(trace, exact, penetration) else nearest_to_balance(trace)


def is_solved(trace: Trace, exact: FloatArray, penetration: float) -> bool:
    """Return whether Newton's method converged to the exact solution (n_free + n_multipliers,)."""
    distance = np.abs(trace.solution - exact[: trace.scene.n_free]).max(initial=0.0)
    return trace.converged and bool(distance <= SAME_SOLUTION * penetration)


def nearest_to_balance(trace: Trace) -> FloatArray:
    """Return the start (n_free + n_multipliers,) if it is nearly in balance, else the later iterate nearest to it."""
    balanced = trace.roundings[0] <= NEAR_CONVERGENCE or len(trace.u) == 1
    iterate: FloatArray = trace.u[0 if balanced else 1 + np.argmin(trace.roundings[1:])]
    return iterate


def contact_at(state: Case, trace: Trace, formulation: CheckedFormulation) -> FrozenState:
    """Return the formulation in a state, on the pairing of Newton's last iterate if it is that one."""
    if np.array_equal(state.z, trace.z):
        return FrozenState(formulation, state, trace.pairing)
    return FrozenState.at(formulation, state)


def forces_to_draw(case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, 2) at the penalty of the case, for pictures."""
    return consistent_forces(case, pressure_of(case, case.penalty))


def force_errors(state: FrozenState, scene: Scene, q: FloatArray, pressure: float) -> tuple[float, float]:
    """Return the largest error of a nodal force on the slave and on the master, over p L.

    Forces are judged twice: those that the bodies need to be in balance with the unknowns q (n_free,), and those that
    the formulation gives. They differ where the formulation found no balance, and at
    rollers, which take what the bodies do not need.
    """
    by_bodies = scene.nodal_forces(q)
    by_contact, case = -state.forces, state.case
    first = 0
    for index in scene.bodies_in_reach:
        last = first + len(scene.bodies[index].contact_nodes)
        if scene.bodies[index].rigid:
            by_bodies[first:last] = by_contact[first:last]
        first = last
    exact = consistent_forces(case, pressure)
    errors = np.maximum(*(np.linalg.norm(forces - exact, axis=1) for forces in (by_bodies, by_contact)))
    errors /= pressure * case.slave_length
    n_slave = case.interface.n_slave_nodes
    return float(errors[:n_slave].max()), float(errors[n_slave:].max())


def point_errors(state: FrozenState, penalty: float, pressure: float) -> tuple[float, float]:
    """Return the largest error of a reported gap over p/ε̂, and of a reported pressure over p.

    Idle points do not count if they have no weight, no master segment, or lie beside the master. The error of the
    pressure is infinite if no point counts.
    """
    points = state.points
    in_contact = points.active | (points.master_segment >= 0) & ~beside_master(state.case, points)
    counted = (points.weight != 0) & in_contact
    gaps = np.where(counted, points.gap, -pressure / penalty)  # A gap is NaN where it is meaningless.
    gap = float(np.nanmax(np.abs(gaps * penalty / pressure + 1), initial=0.0))
    pressures = np.where(points.active, points.pressure, 0.0)[counted]
    if not len(pressures):
        return gap, np.inf
    return gap, float(np.abs(pressures - pressure).max(initial=0.0) / pressure)


def beside_master(case: Case, points: ContactPoints) -> BoolArray:
    """Return which points (n_points,) lie beside the other surface, or within roundoff of its end; in space none does.

    A point that names no place on its surface does not lie beside the other. Where the master covers the slave, no
    point of the slave does. A point of a second pass lies on the master, and the other surface is the slave.
    """
    beside = np.zeros(len(points.c), bool)
    if case.interface.dim != PLANE:
        return beside
    covered = not overhangs(case)
    rounding = COORDINATE_ROUNDING * case.largest_coordinate
    interface, along = case.interface, case.parameters["along"]
    for surface, other, second in (
        (interface.slave, interface.master, False),
        (interface.master, interface.slave, True),
    ):
        here = (points.on_master == second) & (points.slave_segment >= 0)
        if here.any() and (second or not covered):
            ends, c = along[surface.segments[points.slave_segment[here]]], points.c[here]
            place = (1 - c) / 2 * ends[:, 0] + (1 + c) / 2 * ends[:, 1]
            beside[here] = ~_faces(place, other, along, rounding)
    return beside


def _faces(place: FloatArray, surface: Surface, along: FloatArray, rounding: float) -> BoolArray:
    """Return which places (n,) along the interface a surface covers, up to `rounding` from its free ends."""
    ends = along[surface.segments]  # (n_segments, 2)
    inwards = np.sign(ends[:, ::-1] - ends)
    ends = ends + np.where(surface.neighbours < 0, rounding, -rounding) * inwards
    low, high = ends.min(axis=1), ends.max(axis=1)
    covered: BoolArray = ((place[:, None] >= low) & (place[:, None] <= high)).any(axis=1)
    return covered
