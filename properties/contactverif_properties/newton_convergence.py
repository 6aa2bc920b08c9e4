"""Properties about the way in which Newton's method comes to a solution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import ceil, inf, log, log2
from typing import Any

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.cases import Cases
from contactverif.contract.errors import ContractError
from contactverif.contract.measurement import Measurement, Quantity
from contactverif.contract.pairing import Pairing
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.mechanics.linear import scale_factors
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import scene_of
from contactverif.mechanics.system import System
from contactverif.mechanics.trace import End, Trace
from contactverif.strategies.solids import solid_cases
from contactverif_properties.shared import newton_solution
from contactverif_properties.shared.any_state import random_directions
from contactverif_properties.shared.applicability import promise_exact_tangent, refuse_dependent_multipliers
from contactverif_properties.shared.frozen_state import FrozenState
from contactverif_properties.shared.kinks import find_kink

NEAR = 1e-4  # The order shows once the residual is below this share of the first one.
NOISE = 32.0  # Roundoffs of a residual that count as converged where nothing lower is reached.
SHORT = 3  # A whole solution of so few iterations needs no explanation.
LONG = 10  # With an exact tangent and one pairing, Newton's method ends within so many iterations or never does.
SPARE = 3  # Iterations allowed beyond those that double the digits.
SERIES = {"residual": "N", "energy norm": "N m", "changes of the pairing": "1", "reciprocal condition": "1"}
FINAL_ITERATIONS = Quantity(
    "final iterations",
    "⌈log2(log ρ_end / log ρ)⌉ + 3",
    "Once the pairing has settled and the residual is at ρ ≤ 1e-4 of the first, each step doubles the digits. "
    "Three iterations are to spare.",
)
DISTANCES = tuple(3.0 * 10.0 ** (-k / 2) for k in range(4, 12))  # From 3e-2 to 1e-5, over the shortest segment.
N_DIRECTIONS = 2
N_FITTED = 3  # The number of distances, the nearest ones, that a slope is fitted to.
RISING = 0.02  # A slope that grows by more than this between neighbours has not settled yet.
EXACT = 1e-2  # A floor up to this share of the shortest distance cannot hide linear convergence.
LINEAR, QUADRATIC = 1.1, 1.9  # A slope up to the first is linear, one from the second on is quadratic.
ORDER = Quantity(
    "order of one Newton step",
    "1.9",
    "From states of the same pairing, |u1 − u*| falls like |u0 − u*|², less what is left of the third power.",
    sense="at least",
)


def history(trace: Trace) -> dict[str, FloatArray]:
    """Return the series of a solution by iterate, under the names of SERIES."""
    columns = (trace.residuals, trace.energies, trace.changes.astype(np.float64), trace.conditions)
    return dict(zip(SERIES, columns, strict=True))


_define = partial(
    Property.define,
    family="newton",
    cases=Cases.random(solid_cases),
    promise=promise_exact_tangent,
    needs=frozenset({"tangent"}),
    applicable=refuse_dependent_multipliers,
    bodies=True,
    usual_undecided=0.004,
)


@_define(id="newton.history", rank=560, quantities=(FINAL_ITERATIONS,), series=SERIES)
def newton_history(case: Case, subject: Subject) -> Measurement:
    """Once the pairing has settled, Newton's method falls to roundoff in a few iterations.

    **Question.** A whole scene is solved. From the first iterate that has the final pairing and a residual of at most
    1e-4 of the first, how many iterations lead down to roundoff?

    **Why it matters.** This is what a user sees: the last lines of a solver's log. With an exact tangent each step
    doubles the correct digits.

    **How it is judged.** The number of iterations must be at most ⌈log2(log ρ_end / log ρ)⌉ + 3, for a residual that
    begins at ρ and ends at ρ_end, both over the first residual: each step doubles the digits, and 3 are to spare. The
    whole history is kept: residuals, energy norms, changes of the pairing, conditions. A scene whose pairing does not
    settle is solved again in 4 load steps, and in 16.

    **Undecided.** Where the pairing changes to the last iterate, which is normal on kinked surfaces, where there is no
    pairing to tell whether a kink is in the way, and where the residual has a noise that roundoff does not explain.
    """
    system = System(scene_of(case), subject.for_case(case))
    trace = solve(system.scene, system.formulation)
    undecided = _find_excuse(system, trace)
    for load_steps in newton_solution.LOAD_STEPS:  # Smaller load steps overshoot less, so that the pairing may settle.
        if not undecided:
            break
        trace = solve(system.scene, system.formulation, load_steps=load_steps)
        undecided = _find_excuse(system, trace)
    details, series = newton_solution.solution_details(trace), history(trace)
    if undecided:
        return Measurement(details=details, series=series, undecided=undecided)
    begin = _first_final_iterate(system, trace)
    arrived = np.flatnonzero(trace.roundings <= (1.0 if trace.converged else NOISE))
    iterations = float(max(arrived[0] - begin, 0)) if _is_solved(trace) else inf
    details["finite"] = float(iterations <= 1)
    return Measurement(
        [FINAL_ITERATIONS.check(iterations, float(_allowed_iterations(trace, begin)))],
        details=details,
        series=series,
        idle=newton_solution.is_untouched(trace),
    )


def _settling_iterate(system: System, trace: Trace) -> int:
    """Return the last iterate at which the pairing changed in more than entries that no force depends on, or 0."""
    for number in np.flatnonzero(trace.changes > 0)[::-1].tolist():
        if not _gives_same_forces(system, trace.u[number], trace.pairings[number], trace.pairings[number - 1]):
            return int(number)
    return 0


def _gives_same_forces(system: System, u: FloatArray, pairing: Pairing | None, other: Pairing | None) -> bool:
    """Return whether two pairings give the same forces at u bit by bit: roundoff may decide what else they hold.

    Far from its own state a pairing may give no forces at all.
    """
    try:
        return pairing == other or bool((system.forces(u, pairing) == system.forces(u, other)).all())
    except ContractError:
        return False


def _is_solved(trace: Trace) -> bool:
    return trace.converged or (trace.end is End.STAGNATED and bool(trace.roundings.min() <= NOISE))


def _find_excuse(system: System, trace: Trace) -> str:
    """Return why the solution decides nothing about the tangent, or an empty string."""
    last, settled = len(trace.residuals) - 1, _settling_iterate(system, trace)
    if _is_solved(trace):
        return f"the pairing does not settle: {trace.end.label}" if settled == last > SHORT else ""
    if last - settled < LONG:
        return f"the pairing does not settle: {trace.end.label}"
    if trace.changes.max() < 0:
        return f"there is no pairing that could tell whether a kink is in the way: {trace.end.label}"
    if trace.end is End.STAGNATED:
        return "the residual has a noise that roundoff does not explain"
    return ""


def _first_final_iterate(system: System, trace: Trace) -> int:
    """Return the first iterate with the final pairing and a residual of at most NEAR of the first one."""
    settled = _settling_iterate(system, trace)
    near = np.flatnonzero(trace.residuals <= NEAR * trace.residuals[0])
    near = near[near >= settled]
    return int(near[0]) if len(near) else settled


def _allowed_iterations(trace: Trace, begin: int) -> int:
    """Return ⌈log2(log ρ_end / log ρ)⌉ + 3, with residuals over the first one."""
    rho, rho_end = (
        max(residual / trace.residuals[0], np.finfo(float).tiny)
        for residual in (trace.residuals[begin], trace.floors[-1])
    )
    return ceil(log2(max(log(rho_end) / log(min(rho, NEAR)), 1.0))) + SPARE


@_define(id="newton.order", rank=460, quantities=(ORDER,))
def newton_order(case: Case, subject: Subject) -> Measurement:
    """One Newton step from near a solution ends at a distance of second order.

    **Question.** A Newton step starts at a small distance from the solution of a random scene, with the pairing of the
    solution. How fast does the distance after the step fall with the distance before it?

    **Why it matters.** A tangent with a forgotten term may still converge, but slowly: an analysis then takes more
    iterations and smaller load steps. One step near the solution shows the order; the residuals of a whole solution
    often hide it.

    **How it is judged.** Steps start at distances of 3e-2 to 1e-5 ℓ in two random directions. The measured number is
    the slope of log |u1 − u*| over log |u0 − u*| at the three nearest distances where |u1 − u*| is above 1e3 u cond;
    the lower direction counts. It must be at least 1.9, since Newton's method has 2 less what is left of the third
    power. There is no number where the step meets the solution exactly. If the slope is near 1, the rate and the
    spectral radius of I − K⁻¹ ∂R/∂u are kept beside it.

    **Undecided.** Where Newton's method finds no solution, where the matrix has no inverse, where too few states near
    the solution pair like it, and where the derivative by differences gives no better order.

    **Source.** Zavarise & De Lorenzis (2009), Fig. 30, where the spectral radius is the rate of the basic version.
    """
    scene = scene_of(case)
    system = System(scene, subject.for_case(case))
    trace = newton_solution.find_solution(system)
    details = newton_solution.solution_details(trace)
    if not trace.converged:
        return Measurement(details=details, undecided=f"Newton found no solution: {trace.end.label}")
    solution = trace.u[-1]
    matrix, _ = system.matrix(solution, trace.pairing)
    condition = system.step(matrix, np.zeros(system.size)).condition
    if condition <= system.size * UNIT_ROUNDOFF:
        return Measurement(details=details, undecided="the matrix has no inverse at the solution")
    steps = fit_steps(system, case, trace, matrix, condition)
    details["rate"], details["steps"] = steps.rate, float(steps.count)
    if np.isnan(steps.order):
        return Measurement(details=details, undecided="a kink: too few states near the solution pair like it")
    undecided = ""
    if steps.order < QUADRATIC:
        by_differences = replace(system, use_tangent=False)
        exact, _ = by_differences.matrix(solution, trace.pairing)
        details["spectral radius"] = spectral_radius(matrix, exact)
        if not fit_steps(by_differences, case, trace, exact, condition, [steps.worst]).order >= QUADRATIC:
            undecided = "a kink: with the derivative by differences, Newton's order is no better"
    linear = steps.order == inf  # One step solves a linear problem, which has no order.
    return Measurement(
        [] if linear else [ORDER.check(steps.order, QUADRATIC)],
        details=details,
        undecided=undecided,
        idle=newton_solution.is_untouched(trace),
    )


@dataclass(frozen=True, slots=True)
class Steps:
    """The order and rate of single Newton steps from around a solution."""

    order: float  # The lower order of the directions; NaN if none decides.
    rate: float  # The higher rate of the directions.
    count: int  # The number of steps that started with the pairing of the solution.
    worst: int  # The direction with the lowest order.


def fit_steps(
    system: System,
    case: Case,
    trace: Trace,
    matrix: Any,
    condition: float,
    directions: Sequence[int] = range(N_DIRECTIONS),
) -> Steps:
    """Take one Newton step from each of some states around the last iterate, the solution, and fit their order.

    The matrix is the one at the solution, and the condition its reciprocal condition. Directions have numbers.
    """
    solution, pairing, length = trace.u[-1], trace.pairing, case.shortest_segment
    units = scale_factors(matrix, system.scene.n_free)[1]
    floor = newton_solution.solution_floor(system.scene, solution, units, condition)
    fits, count = [], 0
    for direction in random_directions(case.seed, N_DIRECTIONS, system.size)[list(directions)]:
        before, after = [], []
        distances = [distance * length for distance in DISTANCES]
        states = [solution + distance * direction * units for distance in distances]
        alike = _pair_alike(system, case, pairing, states, distances)
        near = [place for place, is_alike in zip(zip(distances, states, strict=True), alike, strict=True) if is_alike]
        both = system.forces_and_tangents([u for _, u in near], pairing)
        for (distance, u), (forces, tangent) in zip(near, both, strict=True):
            matrix = system.stiffness + system.contact_stiffness(u, pairing, tangent)
            step = system.step(matrix, -system.balance(u, forces)).change
            count += 1
            before.append(distance)
            after.append(inf if step is None else float(np.abs((u + step - solution) / units).max()))
        fits.append(fit_order(np.array(before), np.array(after), floor))
    numbered = [(*fit, number) for number, fit in zip(directions, fits, strict=True)]
    decisive = [fit for fit in numbered if not np.isnan(fit[0])] or [(np.nan, np.nan, 0)]
    order, _, worst = min(decisive)
    return Steps(order, max(rate for _, rate, _ in decisive), count, worst)


def fit_order(before: FloatArray, after: FloatArray, floor: float) -> tuple[float, float]:
    """Fit the slope of log after over log before at the nearest distances above the floor, where roundoff decides.

    Distances (n_steps,) from the solution before a step descend; those after it are infinite where the matrix had no
    inverse. The slope is infinite where even the longest distance ends at the floor: one step is exact. It is NaN where
    there are too few distances, or where it is below 2 and still rises towards 2 as they fall. Behind it comes the
    ratio after/before at the nearest distance.
    """
    if not len(before):
        return np.nan, np.nan
    above = after > floor
    if not above.any():  # The step is exact, unless roundoff would hide as much as a linear rate.
        return (inf, 0.0) if floor <= EXACT * before.min() else (np.nan, np.nan)
    # Once at the floor, always at the floor: an error that rises again at a shorter distance is noise.
    last = int(np.argmin(above)) if not above.all() else len(above)
    before, after = before[:last][-N_FITTED:], after[:last][-N_FITTED:]
    if len(before) < N_FITTED:
        return np.nan, np.nan
    if not np.isfinite(after).all():
        return 0.0, inf
    slopes = np.diff(np.log(after)) / np.diff(np.log(before))
    if LINEAR < slopes[-1] < QUADRATIC and slopes[-1] > slopes[0] + RISING:
        return np.nan, np.nan
    return float(slopes.mean() if slopes[-1] < QUADRATIC else slopes[-1]), float(after[-1] / before[-1])


def spectral_radius(matrix: Any, exact: Any) -> float:
    """Return the spectral radius of I − K⁻¹ ∂R/∂u, the rate of Newton's method with K (Fig. 30 of the paper)."""
    rest = np.eye(matrix.shape[0]) - linalg.solve(dense(matrix), dense(exact))
    return float(np.abs(linalg.eigvals(rest)).max())


def _pair_alike(
    system: System, case: Case, pairing: Pairing | None, states: Sequence[FloatArray], reaches: Sequence[float]
) -> list[bool]:
    """Return which states have the forces of the solution's pairing, or without one, around which there is no kink."""
    if pairing is not None:
        pairings = [system.pair(u) for u in states]  # All are asked for before one is looked at.
        return [_gives_same_forces(system, u, pairing, other) for u, other in zip(states, pairings, strict=True)]
    around = (replace(case, z=system.state(u), n_multipliers=system.n_multipliers) for u in states)
    return [
        not find_kink(FrozenState(system.formulation, state, None), reach)
        for state, reach in zip(around, reaches, strict=True)
    ]
