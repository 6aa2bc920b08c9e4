"""Ask whether two blocks find a uniform pressure on an interface with a kink.

**Question.** The interface of two blocks of one material is a broken line, and the same pressure acts on all sides. Are
the stress, the forces on both sides and the reported pressure the exact ones, on both sides of the kink?

**Why it matters.** Corners, chamfers and the facets of any curved mesh are kinks. A normal that is averaged over a
kink, or a slave node at a kink that is pushed along one facet alone, gives wrong forces there, whatever the mesh.

**How it is judged.** The stress is hydrostatic. Nodes of both meshes lie at the kink and nowhere else on one another.

- *Two normals.* Springs of ε̂ = 10 E/ℓ give way by g = p/ε̂, which is a translation of one block, so that the uniform
  state is exact. The stress at Gauss points over p, the nodal forces over the largest exact one, and the mean absolute
  error of the reported pressures, with the plugin's weights, over p are at most 4 (g/ℓ) tan(φ/2) + u (8X/g + 4N) at p =
  1e-6 E: penetration moves the slave's kink along the facet by g tan(φ/2), and gaps are differences of positions. The
  reported pressure may count current or reference lengths, which differ by the contraction of the blocks. As in
  `patch.flat.solve` the residual alone is asked, by differences. Newton's method starts at the first guess, and where
  it ends elsewhere, again at the exact solution.
- *Three normals.* The ridge is cut off. Springs cannot give way uniformly along three normals, so that the stress error
  falls like 1/ε̂. At ε̂ = 3e4 E/ℓ it is at most 4 E/(ε̂ ℓ). From 3e3 to 3e4 E/ℓ, or from there to 3e5 E/ℓ, it falls by at
  least 0.95 decades: earlier the part of second order counts, later roundoff may. Where the error is below
  4 (g/ℓ) tan(φ/2) + u (8X/g + 4N) at p = 1e-3 E, as that of multipliers, nothing need fall.

The trait `passes_kinked_patch` promises it.

**Undecided.** A case whose uniform state is exact, but whose solution with three normals Newton's method does not find.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.mechanics.accuracy import solve_for_accuracy
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.trace import Trace
from contactverif.problems.kinked_patch import KinkedPatch, exact_unknowns, kinked_patch, patch_of
from contactverif.problems.uniform_stress import uniform_forces
from contactverif_properties.shared.applicability import refuse_barrier
from contactverif_properties.shared.finite_lists import unless_given
from contactverif_properties.shared.newton_solution import end_details
from contactverif_properties.shared.solved_patch import ITERATIONS, is_solved, nearest_to_balance

LINES = {
    "roof of 41°": ((0.0, 0.0), (4.0, 1.5), (8.0, 0.0)),
    "roof of 90°": ((0.0, -2.0), (4.0, 2.0), (8.0, -2.0)),
    "edge of 53°": ((0.0, 0.0), (4.0, 0.0), (7.0, -4.0)),
}
MODERATE = 10.0  # ε̂ ℓ/E with two normals.
STIFF = (3e3, 3e4, 3e5)  # ε̂ ℓ/E with three normals.
STRAINS = (
    1e-6,
    1e-4,
)  # p/E with two and three normals: roundoff is over the penetration, which stiff springs make small.
SHARE = 4.0  # Bound of the stress error with three normals over E/(ε̂ ℓ); 0.01 to 2.4 is measured.
SLOPE = 0.95  # Decades by which the error falls over a decade of the penalty; 0.99 to 1.00 is measured.

_TOLERANCE = "4 (g/ℓ) tan(φ/2) + u (8X/g + 4N)"
_REASON = "The kink moves along a facet by g tan(φ/2), gaps are differences of positions, and N forces are summed."
STRESS = Quantity("stress error", "1", _TOLERANCE, _REASON)
SLAVE = Quantity("slave force error", "1", _TOLERANCE, _REASON)
MASTER = Quantity("master force error", "1", _TOLERANCE, _REASON)
PRESSURE = Quantity(
    "reported pressure error",
    "1",
    f"{_TOLERANCE} + p (1 + ν)(1 − 2ν)/E",
    f"{_REASON} Lengths of the reference are longer than current ones by the contraction of the blocks.",
)
CUT = Quantity(
    "stress error, three normals",
    "1",
    f"max({SHARE:g} E/(ε̂ ℓ), {_TOLERANCE})",
    "Springs give way unequally, by 1/ε̂ over ℓ/E.",
)
FALL = Quantity(
    "fall of the stress error over a decade of ε̂",
    "1",
    f"{SLOPE}",
    "The error is of first order in 1/ε̂; its part of second order is left.",
    sense="at least",
)


def measure_kink(case: Case, subject: Subject) -> Measurement:
    """Solve a kink with two normals, and with its ridge cut off.

    Returns
    -------
    Measurement
        All dimensionless; see the module. Details: how each solution ended, and the error at the softer of the stiff
        penalties.
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
    formulation, multiplier = subject.for_case(start), traits.enforcement == "multiplier"
    trace, u = _solve(scene, formulation, exact_unknowns(problem, scene, 0.0 if multiplier else gap), gap)
    q, multipliers = u[: scene.n_free], u[scene.n_free :]
    z = np.concatenate([scene.positions(q), multipliers])
    pairing = formulation.pair(scene.interface, z)
    by_contact = -formulation.residual(scene.interface, pairing, z)[: scene.interface.n_unknowns].reshape(-1, 2)
    exact, n_slave = uniform_forces(scene.interface, pressure), scene.interface.n_slave_nodes
    by_bodies = scene.nodal_forces(q)
    errors = np.maximum(*(np.linalg.norm(forces - exact, axis=1) for forces in (by_bodies, by_contact)))
    errors /= np.linalg.norm(exact, axis=1).max()
    values = {
        STRESS: _stress_error(problem, scene, q),
        SLAVE: float(errors[:n_slave].max()),
        MASTER: float(errors[n_slave:].max()),
    }
    tolerances = dict.fromkeys(values, _floor(problem, start, gap))
    unique = not multiplier or traits.independent_multipliers is True
    if "contact_points" in formulation.provides and traits.penalty == "distributed" and unique:
        points = formulation.contact_points(scene.interface, pairing, z)
        if not points.on_master.any():  # Nobody says how two passes share a pressure.
            values[PRESSURE] = _pressure_error(points, pressure)
            tolerances[PRESSURE] = tolerances[STRESS] + problem.contraction
    idle = not by_contact.any()
    return Measurement(check_all(values, tolerances), details=end_details(trace), idle=idle)


def _solve(
    scene: Scene, formulation: CheckedFormulation, exact: FloatArray, penetration: float
) -> tuple[Trace, FloatArray]:
    """Solve a scene and return Newton's trace and the solution that is judged.

    Newton's method may end elsewhere than at the exact solution, since large motions have other solutions too. Then it
    starts again at the exact solution, where a formulation that passes is in balance and does not move. A formulation
    that is not in balance there is judged where it comes nearest to balance afterwards.

    Parameters
    ----------
    scene : Scene
        The scene to solve.
    formulation : CheckedFormulation
        The formulation, with its penalty.
    exact : FloatArray, shape (n_free + n_multipliers,)
        The exact solution.
    penetration : float
        The exact penetration p/ε̂, a length; distances from the exact solution are measured by it.

    Returns
    -------
    trace : Trace
        The first solution.
    u : FloatArray, shape (n_free + n_multipliers,)
        The unknowns that are judged.
    """
    trace = solve(scene, formulation, iterations=ITERATIONS, use_tangent=False, keep_matrix=True)
    if is_solved(trace, exact, penetration):
        return trace, trace.u[-1]
    again = solve(scene, formulation, start=exact, iterations=ITERATIONS, use_tangent=False, keep_matrix=True)
    return trace, nearest_to_balance(again)


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
        if not solution.balanced or solution.trace is None:
            break
        errors.append(_stress_error(stiff, scene, solution.trace.solution))
        floors.append(_floor(stiff, solution.state, stiff.pressure / penalty))
    if len(errors) < 2:
        reason = f"Newton's method with three normals: {solution.end}"
        return measurement if fails else Measurement(undecided=reason, details=measurement.details)
    numbers = [*measurement.numbers, CUT.check(errors[1], max(SHARE / STIFF[1], floors[1]))]
    if errors[1] > floors[1]:
        numbers.append(FALL.check(float(-np.diff(np.log10(errors)).min()), SLOPE))
    names = [f"stress error, three normals, ε̂ = {stiffness:g} E/ℓ" for stiffness in STIFF]
    details = {**measurement.details, **dict(zip(names, errors, strict=False))}
    return replace(measurement, numbers=numbers, details=details)


def _floor(problem: KinkedPatch, state: Case, gap: float) -> float:
    """Return 4 (g/ℓ) tan(φ/2) + u (8X/g + 4N)."""
    moved = 4 * gap / state.shortest_segment * problem.sharpest
    return moved + UNIT_ROUNDOFF * (8 * state.largest_coordinate / gap + 4 * state.n_segments)


def _stress_error(problem: KinkedPatch, scene: Scene, q: FloatArray) -> float:
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


PATCH_KINKED = Property(
    id="patch.kinked",
    family="patch",
    summary="A uniform pressure stays exact on an interface with a kink.",
    quantities=(STRESS, SLAVE, MASTER, PRESSURE, CUT, FALL),
    cases=unless_given(kinked_cases),
    measure=measure_kink,
    promise=lambda traits: traits.passes_kinked_patch,
    applicable=refuse_barrier,
    bodies=True,
    exact=forces_to_draw,
)
