"""Newton's method: its order and history, other units of length and force, and the accuracy that it attains.

Distances from a solution are lengths: a multiplier counts as the length that changes the forces by as much.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import ceil, frexp, inf, ldexp, log, log2
from operator import itemgetter
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case, Cases
from contactverif.contract.errors import ContractError
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Call, Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.changed_scenes import change_units, move, snap
from contactverif.mechanics.linear import scale_factors
from contactverif.mechanics.newton import MAX_ITERATIONS, End, Trace, solve
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.mechanics.system import ROUNDOFF_FACTOR, System
from contactverif.strategies.solids import closed_cases, solid_cases
from contactverif.strategies.space_solids import space_closed_cases, space_smooth_cases, space_solid_cases
from contactverif_properties import applicability, roundoff
from contactverif_properties.kinks import find_kink
from contactverif_properties.roundoff import COORDINATE_ROUNDING
from contactverif_properties.states import FrozenState, random_directions

# With a right tangent most solutions take fewer iterations. What takes more is found with differences as well, which
# make use of a tangent that they confirm.
FEW_ITERATIONS = 12
LOAD_STEPS = (4, 16)  # The numbers of load steps that are tried where a solution in one step is not found.


def find_solution(system: System) -> Trace:
    """Solve the scene with the formulation's own tangent, else with differences, else with differences in load steps.

    A wrong tangent may never get there, and is judged at the solution all the same. Full steps may miss a solution
    that is there, because they overshoot into another pairing.
    """
    for use_tangent, load_steps in ((True, 1), *((False, number) for number in (1, *LOAD_STEPS))):
        trace = solve(
            system.scene,
            system.formulation,
            use_tangent=use_tangent,
            load_steps=load_steps,
            iterations=FEW_ITERATIONS if use_tangent else MAX_ITERATIONS,
            solution_only=not use_tangent,
        )
        if trace.converged:
            break
    return trace


def solution_floor(scene: Scene, solution: FloatArray, units: FloatArray, condition: float) -> float:
    """Return the distance from a solution, a length, below which roundoff decides: max(1e3 u/cond, 30 u X).

    The solution is (n_free + n_multipliers,), as are the units of its unknowns that correspond to a unit of length
    (`scale_factors`). The reciprocal condition of the matrix there is above 0.
    """
    size = float(np.abs(solution / units).max() + np.abs(scene.imposed_displacements).max())
    solved_to = 1e3 * UNIT_ROUNDOFF / condition * size
    rounded_to = 30 * UNIT_ROUNDOFF * float(np.abs(scene.positions(solution[: scene.n_free])).max())
    return max(solved_to, rounded_to)


def is_untouched(trace: Trace) -> bool:
    """Return whether the formulation gives no force at the last iterate, so that only the bodies were solved."""
    return not trace.forces[: trace.scene.interface.n_unknowns].any()


def end_details(trace: Trace) -> dict[str, float]:
    """Return how a solution ended, its iterations, and how many multipliers were redundant, if there are any."""
    details = {"end": float(trace.end), "iterations": float(trace.n_iterations)}
    if len(trace.multipliers):
        details["redundant multipliers"] = float(trace.deficiency)
    return details


def solution_details(trace: Trace) -> dict[str, float]:
    """Return the details of `end_details`, the number of changes of the pairing, and the last residual."""
    return end_details(trace) | {
        "changes of pairing": float((trace.changes > 0).sum()),
        "last residual in roundoffs": float(trace.roundings[-1]),
    }


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


_define = partial(
    Property.define,
    cases=Cases.random(solid_cases),
    cases_in_space=Cases.random(space_solid_cases),
    promise=applicability.promise_exact_tangent,
    needs=frozenset({"tangent"}),
    applicable=applicability.refuse_dependent_multipliers,
    bodies=True,
    usual_undecided=0.004,
)


def _promise_few_iterations(traits: Traits) -> bool | None:
    """Return what the traits promise of the tangent; None where it may have an error, or the law may not be linear."""
    is_known = applicability.law_is_linear(traits) and not applicability.tangent_error(traits)
    return applicability.promise_exact_tangent(traits) if is_known else None


@_define(
    id="newton.history",
    rank=560,
    quantities=(FINAL_ITERATIONS,),
    series=SERIES,
    promise=_promise_few_iterations,
    linear=applicability.LINEAR_STEPS,
)
def newton_history(case: Case, subject: Subject) -> Measurement:
    """Once the pairing has settled, Newton's method falls to roundoff in a few iterations.

    **Question.** A whole scene is solved. From the first iterate that has the final pairing and a residual of at most
    1e-4 of the first, how many iterations lead down to roundoff?

    **Why it matters.** This is what a user sees: the last lines of a solver's log. With an exact tangent each step
    doubles the correct digits.

    **How it is judged.** The number of iterations must be at most ⌈log2(log ρ_end / log ρ)⌉ + 3, for a residual that
    begins at ρ and ends at ρ_end, both over the first residual: each step doubles the digits, and 3 are to spare. A
    tangent with a stated error δ may take log ρ_end / log δ more. The whole history is kept: residuals, energy norms,
    changes of the pairing, conditions. A scene whose pairing does not settle is solved again in 4 load steps, and in
    16.

    **Undecided.** Where the pairing changes to the last iterate, which is normal on kinked surfaces, where there is no
    pairing to tell whether a kink is in the way, and where the residual has a noise that roundoff does not explain.
    """
    system = System(scene_of(case), subject.for_case(case))
    for load_steps in (1, *LOAD_STEPS):  # Smaller load steps overshoot less, so that the pairing may settle.
        trace = solve(system.scene, system.formulation, load_steps=load_steps)
        if not (undecided := _find_excuse(system, trace)):
            break
    details = solution_details(trace)
    columns = (trace.residuals, trace.energies, trace.changes.astype(np.float64), trace.conditions)
    series = dict(zip(SERIES, columns, strict=True))
    if undecided:
        return Measurement(details=details, series=series, undecided=undecided)
    settled = _settling_iterate(system, trace)
    near = np.flatnonzero(trace.residuals <= NEAR * trace.residuals[0])
    begin = int(next(iter(near[near >= settled]), settled))  # The pairing is the final one, and the residual is near.
    arrived = np.flatnonzero(trace.roundings <= (1.0 if trace.converged else NOISE))
    iterations = float(max(arrived[0] - begin, 0)) if _is_solved(trace) else inf
    details["finite"] = float(iterations <= 1)
    ends = trace.residuals[begin], trace.floors[-1]
    tiny = float(np.finfo(float).tiny)  # Where nothing touches, and nothing loads a body, the first residual is 0.
    rho, rho_end = (max(residual / max(trace.residuals[0], tiny), tiny) for residual in ends)
    allowed = ceil(log2(max(log(rho_end) / log(min(rho, NEAR)), 1.0))) + SPARE
    if error := applicability.tangent_error(subject.traits):
        allowed += ceil(log(rho_end) / log(error))
    number = FINAL_ITERATIONS.check(iterations, float(allowed))
    return Measurement([number], details=details, series=series, idle=is_untouched(trace))


def _settling_iterate(system: System, trace: Trace) -> int:
    """Return the last iterate at which the pairing changed in more than entries that no force depends on, or 0."""
    for number in np.flatnonzero(trace.changes > 0)[::-1].tolist():
        if not _gives_same_forces(system, trace.u[number], trace.pairings[number], trace.pairings[number - 1]):
            return int(number)
    return 0


def _gives_same_forces(system: System, u: FloatArray, pairing: Pairing | None, other: Pairing | None) -> bool:
    """Return whether two pairings give the same forces at u bit by bit: roundoff may decide what else they hold."""
    try:
        return pairing == other or bool((system.forces(u, pairing) == system.forces(u, other)).all())
    except ContractError:
        return False


def _is_solved(trace: Trace) -> bool:
    return trace.converged or (trace.end is End.STAGNATED and bool(trace.roundings.min() <= NOISE))


def _find_excuse(system: System, trace: Trace) -> str:
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


@_define(id="newton.order", rank=460, quantities=(ORDER,), cases_in_space=Cases.random(space_smooth_cases))
def newton_order(case: Case, subject: Subject) -> Measurement:
    """One Newton step from near a solution ends at a distance of second order.

    **Question.** A Newton step starts at a small distance from the solution of a random scene, with the pairing of the
    solution. How fast does the distance after the step fall with the distance before it?

    **Why it matters.** A tangent with a forgotten term may still converge, but slowly: an analysis then takes more
    iterations and smaller load steps. One step near the solution shows the order; the residuals of a whole solution
    often hide it.

    **How it is judged.** Steps start at distances of 3e-2 to 1e-5 ℓ in two random directions. The measured number is
    the slope of log |u1 − u*| over log |u0 − u*| at the three nearest distances where |u1 − u*| is above 1e3 u cond,
    and of a tangent with a stated error δ above δ cond |u0 − u*|; the lower direction counts. It must be at least 1.9,
    since Newton's method has 2 less what is left of the third power. There is no number where the step meets the
    solution exactly. If the slope is near 1, the rate and the spectral radius of I − K⁻¹ ∂R/∂u are kept beside it.

    **Undecided.** Where Newton's method finds no solution, where the matrix has no inverse, where too few states near
    the solution pair like it, and where the derivative by differences gives no better order.

    **Source.** Zavarise & De Lorenzis (2009), Fig. 30, where the spectral radius is the rate of the basic version.
    """
    scene = scene_of(case)
    system = System(scene, subject.for_case(case))
    trace = find_solution(system)
    details = solution_details(trace)
    if not trace.converged:
        return Measurement(details=details, undecided=f"Newton found no solution: {trace.end.label}")
    solution = trace.u[-1]
    matrix, _ = system.matrix(solution, trace.pairing)
    condition = system.step(matrix, np.zeros(system.size)).condition
    if condition <= system.size * UNIT_ROUNDOFF:
        return Measurement(details=details, undecided="the matrix has no inverse at the solution")
    largest = max(float(np.abs(system.state(solution)).max()) / case.shortest_segment, 1.0)
    rate = applicability.tangent_error(subject.traits) * largest / condition
    steps = _fit_steps(system, case, trace, matrix, condition, rate)
    details["rate"], details["steps"] = steps.rate, float(steps.n_steps)
    if np.isnan(steps.order):
        reason = "the stated error of the tangent hides it, or a kink" if rate else "a kink"
        return Measurement(details=details, undecided=f"{reason}: too few states near the solution pair like it")
    undecided = ""
    if steps.order < QUADRATIC:
        by_differences = replace(system, use_tangent=False)
        exact, _ = by_differences.matrix(solution, trace.pairing)
        details["spectral radius"] = spectral_radius(matrix, exact)
        if not _fit_steps(by_differences, case, trace, exact, condition, directions=[steps.worst]).order >= QUADRATIC:
            undecided = "a kink: with the derivative by differences, Newton's order is no better"
    # One step solves a linear problem, which has no order.
    numbers = [] if steps.order == inf else [ORDER.check(steps.order, QUADRATIC)]
    measurement = Measurement(numbers, undecided, details=details, idle=is_untouched(trace))
    return measurement.after(f"solved, then begun anew {DISTANCES[0]:.1g} to {DISTANCES[-1]:.1g} segments beside it")


class _Steps(NamedTuple):
    """The order and rate of single Newton steps from around a solution."""

    order: float  # The lower order of the directions; NaN if none decides.
    rate: float  # The higher rate of the directions.
    n_steps: int  # The number of steps that started with the pairing of the solution.
    worst: int  # The direction with the lowest order.


def _fit_steps(
    system: System,
    case: Case,
    trace: Trace,
    matrix: Any,
    condition: float,
    rate: float = 0.0,
    directions: Sequence[int] = range(N_DIRECTIONS),
) -> _Steps:
    """Fit the order of single Newton steps around the solution; a tangent by differences leaves a linear `rate`."""
    solution, pairing = trace.u[-1], trace.pairing
    units = scale_factors(matrix, system.scene.n_free)[1]
    floor = solution_floor(system.scene, solution, units, condition)
    distances = [distance * case.shortest_segment for distance in DISTANCES]
    fits, count = [], 0
    for number in directions:
        direction = random_directions(case.seed, N_DIRECTIONS, system.size)[number]
        states = [solution + distance * direction * units for distance in distances]
        alike = _pair_alike(system, case, pairing, states, distances)
        near = [place for place, is_alike in zip(zip(distances, states, strict=True), alike, strict=True) if is_alike]
        both = system.forces_and_tangents([u for _, u in near], pairing)
        before, after = np.array([distance for distance, _ in near]), []
        for (_, u), (forces, tangent) in zip(near, both, strict=True):
            stiffness = system.stiffness + system.contact_stiffness(u, pairing, tangent)
            step = system.step(stiffness, -system.balance(u, forces)).change
            after.append(inf if step is None else float(np.abs((u + step - solution) / units).max()))
        count += len(near)
        fits.append((*fit_order(before, np.array(after), np.maximum(floor, rate * before)), number))
    decisive = [fit for fit in fits if not np.isnan(fit[0])] or [(np.nan, np.nan, 0)]
    order, _, worst = min(decisive)
    return _Steps(order, max(rate for _, rate, _ in decisive), count, worst)


def fit_order(before: FloatArray, after: FloatArray, floors: FloatArray) -> tuple[float, float]:
    """Fit the slope of log after over log before at the nearest distances above their floors, where roundoff decides.

    All are (n_steps,). Distances from the solution before a step descend; those after it are infinite where the matrix
    had no inverse. The slope is infinite where even the longest distance ends at the floor: one step is exact. It is
    NaN where there are too few distances, or where it is below 2 and still rises towards 2 as they fall. Behind it
    comes the ratio after/before at the nearest distance.
    """
    if not len(before):
        return np.nan, np.nan
    above = after > floors
    if not above.any():  # The step is exact, unless roundoff would hide as much as a linear rate.
        return (inf, 0.0) if (floors <= EXACT * before).all() else (np.nan, np.nan)
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


LARGEST_LENGTH, LARGEST_MODULUS = 60, 30  # The largest exponents of 2 and of 4.
STEP_ROUNDINGS = 1e3  # A linear system is solved to so many roundoffs over its reciprocal condition.
ITERATIONS = 20  # A method that wanders longer takes steps like those before.
POSITION_ROUNDINGS = 30.0  # A position, and a difference quotient, are rounded to so many roundoffs.
STEPS = Quantity(
    "difference of a step in other units",
    "1 (times what roundoff does)",
    "Powers of two scale the four operations and square roots exactly. A power or an angle is rounded anew, and the "
    "matrix passes that on by its condition.",
)


@Property.define(
    id="newton.units",
    rank=570,
    quantities=(STEPS,),
    cases=Cases.random(solid_cases),
    cases_in_space=Cases.random(space_solid_cases),
    linear=applicability.LINEAR_FORCES,
    applicable=applicability.refuse_unknown_pressure,
    bodies=True,
)
def newton_units(case: Case, subject: Subject) -> Measurement:
    """Newton's method takes the same steps in other units of length and force.

    **Question.** A scene is solved. At each iterate the same step is taken with all lengths multiplied by 2^k and all
    moduli by 4^j, penalty and loads with them. Are pairing and next iterate the same?

    **Why it matters.** A problem in millimetres and megapascals is the one in metres and pascals. A small number that a
    tangent or a decision on contact adds, to be safe from zero, has a unit: it is small in one system of units and
    decides in another. It shows only in solving, as slow convergence or as another active set.

    **How it is judged.** k and j are random, up to ±60 and ±30. Powers of two scale the four operations and square
    roots exactly, so a formulation that uses nothing else gives the next iterate to the last bit. A power or an angle
    is rounded anew. Then the difference of the two next iterates counts over what roundoff does to a step Δu, max(1e3 u
    (|u| + |Δu|)/cond, 30 uX), with 30 (uX/ℓ)^(2/3) |Δu|/cond more where the tangent is a difference quotient. The
    tolerance is 1. A pairing that differs, and a matrix that has an inverse in other units alone, fail in words.

    **Undecided.** Where the state of the first pairing that differs lies at a kink.
    """
    # Strategies repeat seeds from case to case, so the units hang on the state too.
    scene, random = scene_of(case), np.random.default_rng([case.seed, crc32(case.z.tobytes())])
    k = int(random.integers(-LARGEST_LENGTH, LARGEST_LENGTH + 1))
    j = int(random.integers(-LARGEST_MODULUS, LARGEST_MODULUS + 1))
    length, modulus, penalty = 2.0**k, 4.0**j, subject.penalty(case)
    area = 1.0 if subject.traits.rules.penalty == "distributed" else length ** (scene.dim - 1)
    system = System(scene, subject.with_penalty(penalty))
    rescaled = subject.with_penalty(penalty * modulus / length * area)
    other = System(change_units(scene, length, modulus), rescaled)
    factors = np.full(system.size, length)
    factors[scene.n_free :] = modulus * area

    trace = solve(scene, system.formulation, iterations=ITERATIONS)
    differences, broken, undecided = [], "", ""
    inverted = STEP_ROUNDINGS * UNIT_ROUNDOFF * system.size  # A matrix with a larger condition has an inverse.
    for number, u in enumerate(trace.u):
        there, pairing, is_last = u * factors, trace.pairings[number], number + 1 == len(trace.u)
        if pairing != other.pair(there):
            broken = f"at iterate {number} the pairing is another one in other units"
        elif not is_last or trace.end is End.SINGULAR:
            # Asked as `solve` asks: forces of one call with the tangent may be rounded otherwise than forces alone.
            forces, tangent = other.forces_and_tangent(there, pairing)
            matrix, floor = other.assemble(there, pairing, forces, tangent)
            step = other.step(matrix, -other.balance(there, forces), floor)
            if not is_last:
                differences.append(_compare_step(system, case, trace, number, step.change, factors))
            elif step.change is not None and step.condition > inverted:
                broken = f"at iterate {number} the matrix has an inverse in other units alone"
        if broken:
            state = replace(case, z=system.state(u), n_multipliers=system.n_multipliers)
            reach = COORDINATE_ROUNDING * state.largest_coordinate
            undecided = find_kink(FrozenState(system.formulation, state, system.pair(u)), reach)
            break
    details = solution_details(trace) | {"exponent of lengths": float(k), "exponent of moduli": 2.0 * j}
    return Measurement(
        [STEPS.check(max(differences, default=0.0), 1.0)],
        undecided=undecided,
        broken=broken,
        details=details | {"steps that agree to the last bit": float(differences.count(0.0))},
        idle=is_untouched(trace),
    ).after(f"solved with all lengths times 2^{k} and all moduli times 2^{2 * j}")


def _compare_step(
    system: System, case: Case, trace: Trace, number: int, change: FloatArray | None, factors: FloatArray
) -> float:
    """Return the difference of the steps from an iterate in both systems of units over what roundoff does to it."""
    u, after, condition = trace.u[number], trace.u[number + 1], float(trace.conditions[number])
    if change is None:
        return np.inf if condition > STEP_ROUNDINGS * UNIT_ROUNDOFF * system.size else 0.0
    difference = (u * factors + change) / factors - after
    if not difference.any():
        return 0.0
    units = np.ones(system.size)
    if system.n_multipliers:
        units = scale_factors(system.matrix(u, trace.pairings[number])[0], system.scene.n_free)[1]
    step = float(np.abs((after - u) / units).max())
    size = float(np.abs(u / units).max() + np.abs(system.scene.imposed_displacements).max()) + step
    largest = float(np.abs(system.state(u)[: system.scene.interface.n_unknowns]).max())
    quotient = 0.0
    if "tangent" not in system.formulation.provides:
        quotient = POSITION_ROUNDINGS * (UNIT_ROUNDOFF * largest / case.shortest_segment) ** (2 / 3) * step
    solved_to = STEP_ROUNDINGS * UNIT_ROUNDOFF * size
    rounding = max(roundoff.ratio(solved_to, condition), POSITION_ROUNDINGS * UNIT_ROUNDOFF * largest)
    return roundoff.ratio(float(np.abs(difference / units).max()), rounding + roundoff.ratio(quotient, condition))


DIGITS = 32  # Coordinates are multiples of 2^-32 segments, so that the longest way rounds none.
OFFSETS = (0, 5, 10, 15, 20)  # The ways: 2 to these powers, in segments.
LOAD_SHARES = (1.0, 0.875, 0.75)  # If a jump of the forces leaves no solution under one load, another load has one.
N_STEPS = 3  # From the solution near the origin, with the matrix there, a step leaves what roundoff does.
ADDED = roundoff.forces_quantity("roundings that the formulation adds")
RESIDUAL = Quantity(
    "attained residual",
    "1 (times its roundoff)",
    "A stored position is rounded to uX twice, and the bodies' forces to u(|S| |q| + |g|); 8 roundings allow for it.",
)
ERROR = Quantity(
    "attained error of the solution",
    "1 (times what that residual makes of it)",
    "A residual r moves the solution by J⁻¹ r.",
)


class Solution(NamedTuple):
    """The solution of the scene near the origin, and what roundoff may do to it."""

    system: System  # The scene with its formulation.
    u: FloatArray  # (n_free + n_multipliers,) The unknowns.
    pairing: Pairing | None  # The pairing.
    # (n_free + n_multipliers, n_free + n_multipliers) The derivative J of the residual there, by differences.
    matrix: FloatArray
    units: FloatArray  # (n_free + n_multipliers,) The unit of each unknown that corresponds to a unit of length.
    inverse: FloatArray  # (n_free + n_multipliers, n_free + n_multipliers) |J⁻¹|, entry by entry.
    # (n_free + n_multipliers,) The change of the residual by a move of all nodes by a unit of length, Σ |K|.
    contact: FloatArray
    # (n_free + n_multipliers,) The sizes of the other terms of the residual, |S| |q| + |g| + |R| and those of
    # multipliers.
    terms: FloatArray
    # What roundings of the positions relative to one another may change in the contact forces.
    conditioning: roundoff.Conditioning

    def roundoff(self, largest: float) -> FloatArray:
        """Return the roundoff (n_free + n_multipliers,) of the residual where the largest coordinate is `largest`."""
        return ROUNDOFF_FACTOR * UNIT_ROUNDOFF * (self.contact * largest + self.terms)


class _Attained(NamedTuple):
    """The residual and the accuracy that Newton's method attains in one place."""

    added: float  # ω, the roundings that the formulation adds.
    residual: float  # The attained residual over its roundoff.
    error: float  # The distance from the solution over what that roundoff makes of it.
    length: float  # That distance, a length.
    undecided: str  # The reason why residual and error decide nothing; empty if they do.


@Property.define(
    id="newton.attainable",
    rank=550,
    quantities=(ADDED, RESIDUAL, ERROR),
    cases=Cases.random(closed_cases),
    cases_in_space=Cases.random(space_closed_cases),
    promise=lambda traits: traits.promises.translation_stable,
    applicable=applicability.refuse_dependent_multipliers,
    bodies=True,
    usual_undecided=0.002,
)
def newton_attainable(case: Case, subject: Subject) -> Measurement:
    """Far from the origin, residual and accuracy are limited by the stored positions alone.

    **Question.** A scene is solved, moved by an exact way of 2^0 to 2^20 segments, and solved again from its own
    solution. At which residual does Newton's method come to rest, how far from the solution, and how much of that is
    the fault of the formulation?

    **Why it matters.** The unknowns are displacements, but a formulation gets positions, and these are stored to u
    times the distance X from the origin. So a residual cannot fall below roundoff of the stored positions, and no
    tolerance tighter than that ever ends the iterations. A formulation that rounds points at the same distance adds its
    own errors to that.

    **How it is judged.** First, the residual of the moved scene is compared with that of the same stored positions
    moved back, which rounds nothing unless the way is shorter than the scene. A formulation that is stable under
    translations differs by at most 16 roundings of the positions relative to one another (ω). Secondly, the residual at
    which three more steps come to rest counts over its roundoff, 8u (|K| X + |S| |q| + |g| + |R|). K is a difference
    quotient of the contact forces, S the stiffness and g the load of the bodies. Thirdly, the distance from the
    solution counts over what a residual of that size makes of it, max |J⁻¹| 8u (…), with J = S + K. The largest number
    of all ways is judged, and those of each way are kept as details.

    **Undecided.** Where Newton's method finds no solution, under 7/8 and 3/4 of the load neither, where the matrix has
    no inverse there, and where the solution is so near a kink that roundoff of the stored positions decides the
    pairing.
    """
    segment = ldexp(0.5, frexp(case.shortest_segment)[1])  # The power of two below the shortest segment.
    scene = snap(scene_of(case), segment * 2.0**-DIGITS)
    for share in LOAD_SHARES:
        less = (replace(body, imposed=share * body.imposed, load=share * body.load) for body in scene.bodies)
        loaded = scene if share == 1 else replace(scene, bodies=tuple(less))
        system = System(loaded, subject.for_case(case))
        trace = find_solution(system)
        if trace.converged:
            break
    details = solution_details(trace) | {"share of the load": share}
    if not trace.converged:
        return Measurement(details=details, undecided=f"Newton found no solution: {trace.end.label}")
    solution = examine(system, case, trace.u[-1])
    if solution is None:
        return Measurement(details=details, undecided="the matrix has no inverse at the solution")
    places = settle(solution, case, [segment * 2.0**power for power in OFFSETS])
    for power, place in zip(OFFSETS, places, strict=True):
        for quantity, value in zip((ADDED, RESIDUAL, ERROR), place[:3], strict=True):
            details[f"{quantity.name} at 2^{power}"] = value
        details[f"error over the shortest segment at 2^{power}"] = place.length / case.shortest_segment
    values = {ADDED: max(place.added for place in places)}
    if decided := [place for place in places if not place.undecided]:
        values |= {RESIDUAL: max(place.residual for place in decided), ERROR: max(place.error for place in decided)}
    tolerances = {ADDED: roundoff.MOST_ROUNDINGS, RESIDUAL: 1.0, ERROR: 1.0}
    measurement = Measurement(check_all(values, tolerances), details=details, idle=is_untouched(trace))
    return measurement.after(f"solved, then moved by up to {segment * 2.0 ** OFFSETS[-1]:.4g}")


def examine(system: System, case: Case, u: FloatArray) -> Solution | None:
    """Return the solution u (n_unknowns,) with what roundoff may do to it; None if the matrix has no inverse there.

    The scene of the system lies near the origin.
    """
    scene, n_free, z = system.scene, system.scene.n_free, system.state(u)
    case = replace(case, interface=scene.interface, z=z, n_multipliers=system.n_multipliers)
    state = FrozenState(system.formulation, case, system.pair(u))
    forces = state.residual
    to_unknowns = dense(system.transformation).T  # (n_free + n_multipliers, n_unknowns + n_multipliers)
    derivative = roundoff.difference_quotient(state)
    rows = to_unknowns @ derivative
    matrix = dense(system.stiffness) + rows @ to_unknowns.T
    condition = system.step(matrix, np.zeros(system.size)).condition
    if condition <= system.size * UNIT_ROUNDOFF:
        return None
    # Supported nodes count too: where an axis is inclined, rounding moves a node off its support.
    contact = np.abs(rows[:, : scene.interface.n_unknowns]).sum(axis=1)
    terms = np.abs(rows[:, scene.interface.n_unknowns :]) @ np.abs(case.multipliers) + np.abs(to_unknowns) @ abs(forces)
    terms[:n_free] += abs(scene.stiffness) @ np.abs(u[:n_free]) + np.abs(scene.load)
    return Solution(
        system=system,
        u=u,
        pairing=state.pairing,
        matrix=matrix,
        units=scale_factors(matrix, n_free)[1],
        inverse=np.abs(linalg.inv(matrix)),
        contact=contact,
        terms=terms,
        conditioning=roundoff.conditioning_of(case, derivative, forces),
    )


@dataclass(slots=True, eq=False)
class _Place:
    """The scene in another place, and how far Newton's method has come there."""

    interface: Interface  # The moved interface.
    way: float  # The move along both axes, a length.
    u: FloatArray  # (n_free + n_multipliers,) The unknowns.
    z: FloatArray = field(default_factory=lambda: np.zeros(0))  # The stored positions, multipliers behind them.
    pairing: Pairing | None = None  # The pairing and the forces there.
    forces: FloatArray = field(init=False)
    residual: FloatArray = field(init=False)  # (n_free + n_multipliers,) The residual there.
    added: float = 0.0  # The largest ω of all steps.
    # After each step: the residual over its roundoff, the unknowns, the largest coordinate, the pairing.
    rests: list[tuple[float, FloatArray, float, Pairing | None]] = field(default_factory=list)


def settle(solution: Solution, case: Case, ways: Sequence[float]) -> list[_Attained]:
    """Let Newton's method come to rest in other places, from the solution near the origin."""
    near = solution.system
    places = [_Place(move(near.scene.interface, way), way, solution.u) for way in ways]
    _take_forces(solution, places)
    for _ in range(N_STEPS):
        for place in places:
            change = near.step(solution.matrix, -place.residual).change
            assert change is not None  # The matrix has an inverse.
            place.u = place.u + change
        _take_forces(solution, places)
    return [_attain(solution, case, place) for place in places]


def _take_forces(solution: Solution, places: Sequence[_Place]) -> None:
    """Ask for the forces where stored positions have changed, and for those of the same positions moved back."""
    near, scene, n = solution.system, solution.system.scene, solution.system.scene.interface.n_unknowns
    changed, calls = [], list[Call]()
    for place in places:
        q, multipliers = np.split(place.u, [scene.n_free])
        positions = place.interface.nodes.reshape(-1) + scene.imposed_displacements + scene.transformation @ q
        before, place.z = place.z, np.concatenate([positions, multipliers])
        if not np.array_equal(place.z, before):
            changed.append(place)
    for place in changed:
        place.pairing = near.formulation.pair(place.interface, place.z)
        back = np.concatenate([place.z[:n] - place.way, place.z[n:]])
        calls.append(("residual", place.interface, place.pairing, place.z))
        calls.append(("residual", scene.interface, place.pairing, back))
    answers = near.formulation.answers(calls)
    for place, forces, same in zip(changed, answers[::2], answers[1::2], strict=True):
        place.added = max(place.added, solution.conditioning.count_roundings(forces - same))
        place.forces = forces
    for place in places:
        place.residual = near.balance(place.u, place.forces)
        largest = float(np.abs(place.z[:n]).max())
        sizes, floors = np.abs(place.residual).tolist(), solution.roundoff(largest).tolist()
        place.rests.append((max(map(roundoff.ratio, sizes, floors), default=0.0), place.u, largest, place.pairing))


def _attain(solution: Solution, case: Case, place: _Place) -> _Attained:
    """Return what the best of the states after the first step has attained."""
    near, undecided = solution.system, ""
    residual, u, largest, pairing = min(place.rests[1:], key=itemgetter(0))
    allowed = float((solution.inverse @ solution.roundoff(largest) / solution.units).max())
    length = float(np.abs((u - solution.u) / solution.units).max())
    if pairing != solution.pairing or pairing is None:
        state = replace(case, interface=near.scene.interface, z=near.state(u), n_multipliers=near.n_multipliers)
        undecided = find_kink(FrozenState(near.formulation, state, near.pair(u)), COORDINATE_ROUNDING * largest)
    return _Attained(place.added, residual, roundoff.ratio(length, allowed), length, undecided)
