"""Ask whether Newton's method falls to roundoff in a few iterations once the pairing has settled.

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

from __future__ import annotations

from math import ceil, inf, log, log2

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity
from contactverif.contract.subject import Subject
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import scene_of
from contactverif.mechanics.system import System
from contactverif.mechanics.trace import End, Trace
from contactverif.strategies.solids import solid_cases
from contactverif_properties.shared.applicability import refuse_dependent_multipliers
from contactverif_properties.shared.newton_solution import LOAD_STEPS, is_untouched, solution_details

NEAR = 1e-4  # The order shows once the residual is below this share of the first one.
NOISE = 32.0  # Roundoffs of a residual that count as converged where nothing lower is reached.
SHORT = 3  # A whole solution of so few iterations needs no explanation.
LONG = 10  # With an exact tangent and one pairing, Newton's method ends within so many iterations or never does.
SPARE = 3  # Iterations allowed beyond those that double the digits.
SERIES = {"residual": "N", "energy norm": "N m", "changes of the pairing": "1", "reciprocal condition": "1"}

FINAL_ITERATIONS = Quantity(
    "final iterations",
    "1",
    "⌈log2(log ρ_end / log ρ)⌉ + 3",
    "Once the pairing has settled and the residual is at ρ ≤ 1e-4 of the first, each step doubles the digits. "
    "Three iterations are to spare.",
)


def measure_history(case: Case, subject: Subject) -> Measurement:
    """Solve a scene and count the iterations from a small residual down to roundoff.

    Parameters
    ----------
    case : Case
        A random scene.
    subject : Subject
        A formulation with a tangent.

    Returns
    -------
    Measurement
        The final iterations; infinite where they never reach roundoff. Details: how the solution ended, and whether it
        was finite (one final iteration). Series: the whole history.
    """
    system = System(scene_of(case), subject.for_case(case))
    trace = solve(system.scene, system.formulation)
    undecided = _find_excuse(trace)
    for load_steps in LOAD_STEPS:  # Smaller load steps overshoot less, so that the pairing may settle.
        if not undecided:
            break
        trace = solve(system.scene, system.formulation, load_steps=load_steps)
        undecided = _find_excuse(trace)
    details, series = solution_details(trace), history(trace)
    if undecided:
        return Measurement(details=details, series=series, undecided=undecided)
    begin = _first_final_iterate(trace)
    arrived = np.flatnonzero(trace.roundings <= (1.0 if trace.converged else NOISE))
    iterations = float(max(arrived[0] - begin, 0)) if _is_solved(trace) else inf
    details["finite"] = float(iterations <= 1)
    return Measurement(
        [FINAL_ITERATIONS.check(iterations, float(_allowed_iterations(trace, begin)))],
        details=details,
        series=series,
        idle=is_untouched(system, trace),
    )


def history(trace: Trace) -> dict[str, FloatArray]:
    """Return the series of a solution by iterate, under the names of SERIES."""
    columns = (trace.residuals, trace.energies, trace.changes.astype(np.float64), trace.conditions)
    return dict(zip(SERIES, columns, strict=True))


def _settling_iterate(trace: Trace) -> int:
    """Return the last iterate at which the pairing changed, or 0."""
    return int(np.flatnonzero(trace.changes > 0)[-1]) if (trace.changes > 0).any() else 0


def _is_solved(trace: Trace) -> bool:
    return trace.converged or (trace.end is End.STAGNATED and bool(trace.roundings.min() <= NOISE))


def _find_excuse(trace: Trace) -> str:
    """Return why the solution decides nothing about the tangent, or an empty string."""
    last, settled = len(trace.residuals) - 1, _settling_iterate(trace)
    if _is_solved(trace):
        return f"the pairing does not settle: {trace.end.label}" if settled == last > SHORT else ""
    if last - settled < LONG:
        return f"the pairing does not settle: {trace.end.label}"
    if trace.changes.max() < 0:
        return f"there is no pairing that could tell whether a kink is in the way: {trace.end.label}"
    if trace.end is End.STAGNATED:
        return "the residual has a noise that roundoff does not explain"
    return ""


def _first_final_iterate(trace: Trace) -> int:
    """Return the first iterate with the final pairing and a residual of at most NEAR of the first one."""
    settled = _settling_iterate(trace)
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


NEWTON_HISTORY = Property(
    id="newton.history",
    family="newton",
    summary="Once the pairing has settled, Newton's method falls to roundoff in a few iterations.",
    quantities=(FINAL_ITERATIONS,),
    cases=solid_cases,
    measure=measure_history,
    series=SERIES,
    promise=lambda traits: None if traits.tangent is None else traits.tangent == "exact",
    needs=frozenset({"tangent"}),
    applicable=refuse_dependent_multipliers,
    bodies=True,
    usual_undecided=0.004,  # One of 1332 cases: below this share with a probability of 95 %.
)
