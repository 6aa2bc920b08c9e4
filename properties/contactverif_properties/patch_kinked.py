"""The patch test where the interface is a broken line: blocks on a kink, under the same pressure from all sides."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.measurement import Measurement, Quantity, check_all
from contactverif.contract.property import Property
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.solving import solve_for_accuracy
from contactverif.mechanics.trace import End, Trace
from contactverif.problems.kinked_patch import KinkedPatch, exact_unknowns, kinked_patch, patch_of
from contactverif.problems.uniform_stress import uniform_forces
from contactverif_properties.patch_flat import refuse_unknown_total
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.newton_solution import end_details
from contactverif_properties.shared.solved_patch import ITERATIONS, is_solved, nearest_to_balance

LINES = {
    "roof of 41°": ((0.0, 0.0), (4.0, 1.5), (8.0, 0.0)),
    # At 90° the slave's normal sees the other facet edge-on, and the tolerance has no bound.
    "roof of 80°": ((0.0, -1.68), (4.0, 1.68), (8.0, -1.68)),
    "edge of 53°": ((0.0, 0.0), (4.0, 0.0), (7.0, -4.0)),
}
MODERATE = 10.0  # ε̂ ℓ/E with two normals.
STIFF = (3e3, 3e4, 3e5)  # ε̂ ℓ/E with three normals.
# p/E with two and three normals: roundoff is over the penetration, which stiff springs make small.
STRAINS = (1e-6, 1e-4)
SHARE = 4.0  # Bound of the stress error with three normals over E/(ε̂ ℓ); 0.01 to 2.4 is measured.
SLOPE = 0.95  # Decades by which the error falls over a decade of the penalty; 0.99 to 1.00 is measured.

_TOLERANCE = "(g/ℓ) tan(φ/2) (4 + tan(φ/2) tan(φ)/2) + u (8X/g + 4N)"
_REASON = (
    "The kink moves along a facet by w = g tan(φ/2). Springs along the slave's normal see the other facet from a strip "
    "of width w, where the gap grows by s tan(φ). Gaps are differences of positions, and N forces are summed."
)
STRESS = Quantity("stress error", _TOLERANCE, _REASON)
_LENGTHS = f"{_TOLERANCE} + p (1 + ν)(1 − 2ν)/E"
_CONTRACTION = f"{_REASON} Lengths of the reference are longer than current ones by the contraction of the blocks."
SLAVE = Quantity("slave force error", _LENGTHS, _CONTRACTION)
MASTER = Quantity("master force error", _LENGTHS, _CONTRACTION)
PRESSURE = Quantity("reported pressure error", _LENGTHS, _CONTRACTION)
APPROACH = Quantity(
    "error of the approach",
    "((1 + ε̂ h/E) T + p (1 + ν)(1 − 2ν)/E)/sin(φ/2)",
    "Balance gives the mean pressure of each facet, up to the tolerance T of forces and the contraction of lengths. "
    "Two gaps on normals at the angle φ give a translation. Errors of forces that balance one another bend a body as "
    "deep as the longest segment h.",
)
CUT = Quantity(
    "stress error, three normals",
    f"max({SHARE:g} E/(ε̂ ℓ), {_TOLERANCE})",
    "Springs give way unequally, by 1/ε̂ over ℓ/E.",
)
FALL = Quantity(
    "fall of the stress error over a decade of ε̂",
    f"{SLOPE}",
    "The error is of first order in 1/ε̂; its part of second order is left.",
    sense="at least",
)


@cache
def kinked_cases() -> tuple[Case, ...]:
    """Return blocks on three broken lines, either block as the slave."""
    return tuple(
        replace(
            kinked_patch(KinkedPatch(line, pressure=STRAINS[0]), upper_slave=upper, penalty=MODERATE),
            name=f"{name}, {'upper' if upper else 'lower'} slave",
        ).case()
        for (name, line), upper in product(LINES.items(), (True, False))
    )


def forces_to_draw(case: Case) -> FloatArray:
    """Return the exact forces (n_nodes, 2), for pictures."""
    problem, _ = patch_of(case)
    return uniform_forces(case.interface, problem.pressure)


@Property.define(
    id="patch.kinked",
    rank=500,
    family="patch",
    quantities=(STRESS, SLAVE, MASTER, PRESSURE, APPROACH, CUT, FALL),
    cases=Cases.from_list(kinked_cases),
    promise=lambda traits: traits.promises.patch.kinked,
    bodies=True,
    exact=forces_to_draw,
)
def patch_kinked(case: Case, subject: Subject) -> Measurement:
    """A uniform pressure stays exact on an interface with a kink.

    **Question.** The interface of two blocks of one material is a broken line, and the same pressure acts on all sides.
    Are the stress, the forces on both sides and the reported pressure the exact ones, on both sides of the kink?

    **Why it matters.** Corners, chamfers and the facets of any curved mesh are kinks. A normal that is averaged over a
    kink, or a slave node at a kink that is pushed along one facet alone, gives wrong forces there, whatever the mesh.

    **How it is judged.** The stress is hydrostatic. Nodes of both meshes lie at the kink and nowhere else on one
    another.

    - *Two normals.* Springs of ε̂ = 10 E/ℓ give way by g = p/ε̂, which is a translation of one block, so that the
      uniform state is exact. The stress at Gauss points over p, the nodal forces over the largest exact one, and the
      mean absolute error of the reported pressures, with the plugin's weights, over p are at most T = (g/ℓ) tan(φ/2) (4
      + tan(φ/2) tan(φ)/2) + u (8X/g + 4N) at p = 1e-6 E: penetration moves the slave's kink along the facet by g
      tan(φ/2), beyond which the gap along the slave's normal grows by tan(φ), and gaps are differences of positions.
      Forces and reported pressures may count current or reference lengths, which differ by the contraction of the
      blocks. As in `patch.flat.solve` the residual alone is asked, by differences. Newton's method starts at the first
      guess, and where it ends elsewhere, again at the exact solution.
    - *The approach.* Where the traits say how stiff the springs are, and for multipliers, the mean motion of the
      slave's nodes past those of the master is the exact one, g along each normal. Right formulations are within 1.1e-6
      g; springs that are 1 % too stiff are off by 1e-2 g, and no stress shows it.
    - *Three normals.* The ridge is cut off. Springs cannot give way uniformly along three normals, so that the stress
      error falls like 1/ε̂. At ε̂ = 3e4 E/ℓ it is at most 4 E/(ε̂ ℓ). From 3e3 to 3e4 E/ℓ, or from there to 3e5 E/ℓ, it
      falls by at least 0.95 decades: earlier the part of second order counts, later roundoff may. Where the error is
      below T, as that of multipliers, nothing need fall.

    The trait `patch.kinked` promises it.

    **Undecided.** A case whose uniform state is exact, but whose solution with three normals Newton's method does not
    find. A failing case in which the matrix at the exact state is singular, although there are forces: then that state
    was judged, and nobody knows whether a solution is near.
    """
    problem, upper_slave = patch_of(case)
    measurement = _measure_two_normals(problem, upper_slave, case.penalty, subject)
    fails = any(number.value > number.tolerance for number in measurement.numbers)
    return _add_three_normals(measurement, fails, problem, upper_slave, subject)


def _measure_two_normals(problem: KinkedPatch, upper_slave: bool, penalty: float, subject: Subject) -> Measurement:
    """Return the errors of the uniform state, which is exact."""
    scene = kinked_patch(problem, upper_slave=upper_slave, penalty=penalty)
    traits, pressure, gap = subject.traits, problem.pressure, problem.pressure / penalty
    start = Case(scene.interface, scene.positions(scene.start), penalty)
    formulation, multiplier = subject.for_case(start), traits.rules.enforcement == "multiplier"
    uniform = exact_unknowns(problem, scene, 0.0 if multiplier else gap)
    trace, u, singular = _solve(scene, formulation, uniform, gap)
    q, multipliers = u[: scene.n_free], u[scene.n_free :]
    end = replace(start, z=scene.positions(q)).with_multipliers(multipliers)
    contact = FrozenState.at(formulation, end)
    by_contact = -contact.forces
    exact, n_slave = uniform_forces(scene.interface, pressure), scene.interface.n_slave_nodes
    by_bodies = scene.nodal_forces(q)
    errors = np.maximum(*(np.linalg.norm(forces - exact, axis=1) for forces in (by_bodies, by_contact)))
    errors /= np.linalg.norm(exact, axis=1).max()
    values = {
        STRESS: kink_stress_error(problem, scene, q),
        SLAVE: float(errors[:n_slave].max()),
        MASTER: float(errors[n_slave:].max()),
    }
    if _knows_its_pressure(contact, traits):
        values[PRESSURE] = _pressure_error(contact.points, pressure)
    floor = kink_floor(problem, start, gap)
    tolerances = dict.fromkeys(values, floor + problem.contraction) | {STRESS: floor}
    if multiplier or not refuse_unknown_total(traits):
        values[APPROACH] = _approach_error(scene, q, uniform[: scene.n_free], gap)
        tolerances[APPROACH] = _approach_tolerance(problem, start, floor)
    idle = not by_contact.any()
    undecided = "Newton's method: the matrix at the exact state is singular" if singular and not idle else ""
    return Measurement(check_all(values, tolerances), undecided, details=end_details(trace), idle=idle)


def _knows_its_pressure(contact: FrozenState, traits: Traits) -> bool:
    """Return whether contact points report the pressure; nobody says how two passes share it."""
    unique = traits.rules.enforcement != "multiplier" or traits.promises.independent_multipliers is True
    distributed = traits.rules.penalty == "distributed"
    return unique and distributed and contact.has_points and not contact.points.on_master.any()


def _solve(
    scene: Scene, formulation: CheckedFormulation, exact: FloatArray, penetration: float
) -> tuple[Trace, FloatArray, bool]:
    """Return Newton's trace, the solution (n_free + n_multipliers,) that is judged, and whether no step led to it.

    Newton's method may end elsewhere than at the exact solution, since large motions have other solutions too. Then it
    starts again at the exact solution, where a formulation that passes is in balance and does not move. A formulation
    that is not in balance there is judged where it comes nearest to balance afterwards. Distances from the exact
    solution are measured by its penetration p/ε̂.
    """
    trace = solve(scene, formulation, iterations=ITERATIONS, use_tangent=False, solution_only=True)
    if is_solved(trace, exact, penetration):
        return trace, trace.u[-1], False
    again = solve(scene, formulation, start=exact, iterations=ITERATIONS, use_tangent=False, solution_only=True)
    return trace, nearest_to_balance(again), again.end is End.SINGULAR and len(again.u) == 1


def _add_three_normals(
    measurement: Measurement, fails: bool, problem: KinkedPatch, upper_slave: bool, subject: Subject
) -> Measurement:
    """Return the measurement with what the cut ridge adds; a failure of the uniform state decides without it."""
    stiff = replace(problem.cut(), pressure=STRAINS[1] * problem.young)
    errors, floors = [], []
    for stiffness in STIFF:
        penalty = stiffness * problem.young
        scene = kinked_patch(stiff, upper_slave=upper_slave, penalty=penalty)
        solution = solve_for_accuracy(scene, subject)
        if solution.trace is None or not solution.balanced:
            break
        errors.append(kink_stress_error(stiff, scene, solution.trace.solution))
        floors.append(kink_floor(stiff, solution.state, stiff.pressure / penalty))
    if len(errors) < 2:
        reason = f"Newton's method with three normals: {solution.end}"
        return measurement if fails else Measurement(undecided=reason, details=measurement.details)
    numbers = [*measurement.numbers, CUT.check(errors[1], max(SHARE / STIFF[1], floors[1]))]
    if errors[1] > floors[1]:
        numbers.append(FALL.check(float(-np.diff(np.log10(errors)).min()), SLOPE))
    names = [f"stress error, three normals, ε̂ = {stiffness:g} E/ℓ" for stiffness in STIFF]
    details = {**measurement.details, **dict(zip(names, errors, strict=False))}
    return replace(measurement, numbers=numbers, details=details)


def kink_floor(problem: KinkedPatch, state: Case, gap: float) -> float:
    """Return T = (g/ℓ) tan(φ/2) (4 + tan(φ/2) tan(φ)/2) + u (8X/g + 4N)."""
    half = problem.sharpest  # With t = tan(φ/2), tan(φ) = 2t/(1 − t²).
    moved = gap / state.shortest_segment * half * (4 + half**2 / (1 - half**2))
    return moved + UNIT_ROUNDOFF * (8 * state.largest_coordinate / gap + 4 * state.n_segments)


def _approach_error(scene: Scene, q: FloatArray, uniform: FloatArray, gap: float) -> float:
    """Return the mean motion of the slave's nodes past those of the master, less that of the uniform state, over g."""
    errors = (scene.positions(q) - scene.positions(uniform)).reshape(-1, 2) / gap
    slave, master = np.split(errors, [scene.interface.n_slave_nodes])
    return float(np.linalg.norm(slave.mean(axis=0) - master.mean(axis=0)))


def _approach_tolerance(problem: KinkedPatch, state: Case, forces: float) -> float:
    """Return ((1 + ε̂ h/E) T + p (1 + ν)(1 − 2ν)/E)/sin(φ/2), from the tolerance T of forces."""
    sides = state.interface.slave, state.interface.master
    longest = max(side.lengths(state.positions).max() for side in sides)
    bent = state.penalty * longest / problem.young
    sine = problem.sharpest / np.hypot(1, problem.sharpest)
    return float(((1 + bent) * forces + problem.contraction) / sine)


def kink_stress_error(problem: KinkedPatch, scene: Scene, q: FloatArray) -> float:
    """Return the largest entry of σ + p I at the Gauss points over p."""
    exact = np.array([-problem.pressure, -problem.pressure, 0.0])
    return max(float(np.abs(stresses - exact).max()) for stresses in scene.stresses(q)) / problem.pressure


def _pressure_error(points: ContactPoints, pressure: float) -> float:
    """Return the mean of |p − p_exact|/p over the weights; infinite if no point has any."""
    counted = points.weight > 0
    if not counted.any():
        return np.inf
    errors = np.abs(np.where(points.active, points.pressure, 0.0)[counted] / pressure - 1)
    return float(np.average(errors, weights=points.weight[counted]))
