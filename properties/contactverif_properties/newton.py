"""Does Newton's method converge at the order that the tangent promises? In one step, and over a whole solution."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, inf, log, log2

import numpy as np
from scipy import linalg

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.formulation import Pairing, Traits
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.mechanics.linear import scale_factors
from contactverif.mechanics.newton import End, System, Trace, solve
from contactverif.mechanics.scene import scene_of
from contactverif.strategies.solids import solid_cases
from contactverif_properties.anywhere import no_barrier
from contactverif_properties.kinks import kink_within

DISTANCES = tuple(3.0 * 10.0 ** (-k / 2) for k in range(4, 12))  # 3e-2 … 1e-5, × the shortest segment
DIRECTIONS = 2
AT_LEAST = 3  # distances that a slope is taken from, the nearest ones
RISING = 0.02  # of the slope between neighbours: it has not settled yet
EXACT = 1e-2  # of the shortest distance: with a floor no higher, an error below it is no linear convergence
LINEAR, QUADRATIC = 1.1, 1.9
NEAR = 1e-4  # of the first residual: from there on the order shows
NOISE = 32.0  # roundoffs above convergence that count as converged where nothing lower is reached
SHORT = 3  # iterations of a whole solution that nobody need explain
WANDERS = 10  # iterations of one pairing in which Newton's method with an exact tangent ends, or never will
SERIES = {"residual": "N", "energy norm": "N m", "changes of the pairing": "1", "reciprocal condition": "1"}

ORDER = Quantity(
    "order of one step",
    "1",
    "1.9",
    "|u1 − u*| falls like |u0 − u*|² from states of the same pairing; 2 less what is left of the third power",
    "at least",
)
TAIL = Quantity(
    "iterations at the end",
    "1",
    "⌈log2(log ρ_end / log ρ)⌉ + 3",
    "once the pairing has settled and the residual is at ρ ≤ 1e-4 of the first, each step doubles digits; 3 to spare",
)


def one_step(case: Case, subject: Subject) -> Measurement:
    """One Newton step from states at a known distance of a solution, whose pairing is that of the solution.

    Returns
    -------
    Measurement
        Slope of log |u1 − u*| over log |u0 − u*|, at the nearest distances at which |u1 − u*| is not yet roundoff, the
        lower one of two random directions; missing where the step meets the solution exactly. Details: the rate where
        the slope is 1 (and beside it the spectral radius of I − K⁻¹ ∂R/∂u, with the derivative taken by differences),
        and how many steps were looked at.

    Source: verification 16. Triples of residuals, which this replaces, are wrong in up to one of five scenes.
    """
    scene = scene_of(case)
    system = System(scene, subject.for_case(case))
    trace = solve(scene, system.formulation)
    if not trace.converged:  # a wrong tangent may never get there
        trace = solve(scene, system.formulation, use_tangent=False)
    if not trace.converged:
        return Measurement({}, {}, details=ended(trace), undecided=f"Newton found no solution: {trace.end.label}")
    solution = trace.u[-1]
    pairing = system.pair(solution)
    matrix, _ = system.matrix(solution, pairing)
    condition = system.step(matrix, np.zeros(system.size)).condition
    details = ended(trace)
    if condition <= system.size * UNIT_ROUNDOFF:
        return Measurement({}, {}, details=details, undecided="the matrix has no inverse at the solution")
    least, details["rate"], details["steps"] = _steps(system, case, solution, pairing, condition)
    if np.isnan(least):
        return Measurement({}, {}, details=details, undecided="a kink: too few states near the solution pair like it")
    undecided, values, tolerances = "", {}, {}
    if least < QUADRATIC:
        details["spectral radius"] = spectral_radius(system, solution, pairing)
        smooth, _, _ = _steps(replace(system, use_tangent=False), case, solution, pairing, condition)
        if not smooth >= QUADRATIC:
            undecided = "a kink: with the derivative by differences, Newton's order is no better"
    idle = untouched(system, trace)
    if least < inf:  # else it is a linear problem
        values[ORDER.name], tolerances[ORDER.name] = least, QUADRATIC
    return Measurement(values, tolerances, details=details, undecided=undecided, idle=idle)


def _steps(
    system: System, case: Case, solution: FloatArray, pairing: Pairing | None, condition: float
) -> tuple[float, float, float]:
    """The lower order of the directions (NaN if none decides), the higher rate, and how many steps were looked at."""
    length, units = case.shortest_segment, units_of(system, solution, pairing)
    floor = floor_of(system, solution, pairing, condition)
    found, looked = [], 0
    for direction in _directions(case.seed, system.size):
        before, after = [], []
        for distance in DISTANCES:
            u = solution + distance * length * direction * units
            if not _same(system, case, pairing, u, distance * length):
                continue
            matrix, _ = system.matrix(u, pairing)
            step = system.step(matrix, -system.residual(u, pairing)).change
            looked += 1
            before.append(distance * length)
            after.append(inf if step is None else float(np.abs((u + step - solution) / units).max()))
        found.append(order(np.array(before), np.array(after), floor))
    told = [(slope, rate) for slope, rate in found if not np.isnan(slope)] or [(np.nan, np.nan)]
    return min(slope for slope, _ in told), max(rate for _, rate in told), float(looked)


def floor_of(system: System, solution: FloatArray, pairing: Pairing | None, condition: float) -> float:
    """A length: what a linear system at the solution is solved to, and positions are rounded to."""
    scene, units = system.scene, units_of(system, solution, pairing)
    floor = (
        1e3
        * UNIT_ROUNDOFF
        / condition
        * float(np.abs(solution / units).max() + np.abs(scene.imposed_displacements).max())
    )
    return max(floor, 30 * UNIT_ROUNDOFF * float(np.abs(scene.positions(solution[: scene.n_free])).max()))


def units_of(system: System, u: FloatArray, pairing: Pairing | None) -> FloatArray:
    """(n,) what a unit of distance is: 1 of a position, of a multiplier what does as much to the forces."""
    return scale_factors(system.matrix(u, pairing)[0], system.scene.n_free)[1]


def order(before: FloatArray, after: FloatArray, floor: float) -> tuple[float, float]:
    """Slope of log after over log before at the nearest distances above the floor, and the rate after/before there.

    Distances descend. Infinite where even the longest one ends at the floor: one step is exact. NaN where too little
    was seen, or where the slope is below 2 and still rising towards it as the distances fall.
    """
    if not len(before):
        return np.nan, np.nan
    told = after > floor
    if not told.any():  # exact, unless roundoff would hide as much as a linear rate
        return (inf, 0.0) if floor <= EXACT * before.min() else (np.nan, np.nan)
    # once at the floor, always: what rises again at a shorter distance is noise
    last = int(np.argmin(told)) if not told.all() else len(told)
    before, after = before[:last][-AT_LEAST:], after[:last][-AT_LEAST:]
    if len(before) < AT_LEAST:
        return np.nan, np.nan
    if not np.isfinite(after).all():
        return 0.0, inf
    slopes = np.diff(np.log(after)) / np.diff(np.log(before))
    if LINEAR < slopes[-1] < QUADRATIC and slopes[-1] > slopes[0] + RISING:
        return np.nan, np.nan
    return float(slopes.mean() if slopes[-1] < QUADRATIC else slopes[-1]), float(after[-1] / before[-1])


def spectral_radius(system: System, u: FloatArray, pairing: Pairing | None) -> float:
    """Of I − K⁻¹ K_true, the rate of Newton's method with the matrix K; K_true by central differences of the residual.

    Source: Zavarise & De Lorenzis (2009), Fig. 30, where it is the rate of the basic version.
    """
    matrix, _ = system.matrix(u, pairing)
    exact, _ = replace(system, use_tangent=False).matrix(u, pairing)
    return float(np.abs(linalg.eigvals(np.eye(len(u)) - linalg.solve(dense(matrix), dense(exact)))).max())


def trajectory(case: Case, subject: Subject) -> Measurement:
    """The end of a whole solution: how many iterations from a small residual down to roundoff.

    Returns
    -------
    Measurement
        Iterations from the first iterate that has the final pairing and a residual of at most 1e-4 of the first, to the
        end. Undecided where the pairing changes to the last, which is normal on kinked surfaces and no verdict against
        anybody. Details: how it ended, iterations, iterates at which the pairing changed.
    """
    system = System(scene_of(case), subject.for_case(case))
    trace = solve(system.scene, system.formulation)
    details, series = ended(trace), history(trace)
    last = len(trace.residuals) - 1
    settled = int(np.flatnonzero(trace.changes > 0)[-1]) if (trace.changes > 0).any() else 0
    solved = trace.converged or (trace.end is End.STAGNATED and trace.roundings.min() <= NOISE)
    why = ""
    if (solved and settled == last > SHORT) or (not solved and last - settled < WANDERS):
        why = f"the pairing does not settle: {trace.end.label}"
    elif not solved and trace.changes.max() < 0:
        why = f"there is no pairing that could tell whether a kink is in the way: {trace.end.label}"
    elif not solved and trace.end is End.STAGNATED:
        why = "the residual has a noise that roundoff does not explain"
    if why:
        return Measurement({}, {}, details=details, series=series, undecided=why)
    near = np.flatnonzero(trace.residuals <= NEAR * trace.residuals[0])
    near = near[near >= settled]
    begin = int(near[0]) if len(near) else settled
    begins, ends = (
        max(r / trace.residuals[0], np.finfo(float).tiny) for r in (trace.residuals[begin], trace.floors[-1])
    )
    allowed = ceil(log2(max(log(ends) / log(min(begins, NEAR)), 1.0))) + 3
    arrived = np.flatnonzero(trace.roundings <= (1.0 if trace.converged else NOISE))
    taken = float(max(arrived[0] - begin, 0)) if solved else inf
    details["finite"] = float(taken <= 1)
    idle = untouched(system, trace)
    return Measurement({TAIL.name: taken}, {TAIL.name: float(allowed)}, details=details, series=series, idle=idle)


def history(trace: Trace) -> dict[str, FloatArray]:
    """The whole trajectory, by iterate."""
    columns = (trace.residuals, trace.energies, trace.changes.astype(np.float64), trace.conditions)
    return dict(zip(SERIES, columns, strict=True))


def untouched(system: System, trace: Trace) -> bool:
    """Whether the formulation gives no force at the last iterate, so that Newton solved the bodies alone."""
    interface, z = system.scene.interface, trace.z
    pairing = system.formulation.pair(interface, z)
    return not system.formulation.residual(interface, pairing, z)[: interface.n_unknowns].any()


def ended(trace: Trace) -> dict[str, float]:
    """How a solution ended, for the details of a measurement."""
    details = {
        "end": float(trace.end),
        "iterations": float(trace.n_iterations),
        "changes of pairing": float((trace.changes > 0).sum()),
        "last residual in roundoffs": float(trace.roundings[-1]),
    }
    if len(trace.multipliers):
        details["multipliers too many"] = float(trace.deficiency)
    return details


def _directions(seed: int, size: int) -> FloatArray:
    directions = np.random.default_rng(seed).uniform(-1, 1, (DIRECTIONS, size))
    scaled: FloatArray = directions / np.abs(directions).max(axis=1, keepdims=True)
    return scaled


def _same(system: System, case: Case, pairing: Pairing | None, u: FloatArray, reach: float) -> bool:
    """Whether the state pairs as the solution does; where no pairing says so, whether differences see no kink there."""
    if pairing is not None:
        return system.pair(u) == pairing
    z = system.state(u)
    direction = np.random.default_rng(case.seed).uniform(-1, 1, z.size)
    direction /= np.abs(direction).max()
    here = replace(case, z=z, n_multipliers=system.n_multipliers)
    return not kink_within(here, system.formulation, None, reach, direction)


def solutions_are_unique(traits: Traits) -> str:
    """Empty, or why there is nothing to converge to: constraints that depend on one another contradict when bent."""
    if traits.independent_multipliers is False:
        return "the multipliers are not independent, so there need be no solution, nor one alone"
    return no_barrier(traits)


NEWTON_ORDER = Property(
    id="newton.order",
    family="newton",
    summary="one Newton step from near a solution ends at a distance of second order",
    quantities=(ORDER,),
    cases=solid_cases,
    measure=one_step,
    promise=lambda traits: None if traits.tangent is None else traits.tangent == "exact",
    needs=frozenset({"tangent"}),
    applicable=solutions_are_unique,
    bodies=True,
)
NEWTON_HISTORY = Property(
    id="newton.history",
    family="newton",
    summary="a whole solution: once the pairing has settled, the residual falls to roundoff in a few iterations",
    quantities=(TAIL,),
    cases=solid_cases,
    measure=trajectory,
    series=SERIES,
    promise=lambda traits: None if traits.tangent is None else traits.tangent == "exact",
    needs=frozenset({"tangent"}),
    applicable=solutions_are_unique,
    bodies=True,
)
