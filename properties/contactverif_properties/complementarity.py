"""Ask whether all multipliers of a solution press, and whether the solution ignores the scale of the contact decision.

**Question.** A tilted block is pressed on another, in many cases so that contact ends inside the interface. In the
solution, is every multiplier λ ≥ 0? Does the same solution follow with another scale c of the decision λ − c g ≥ 0?

**Why it matters.** A multiplier that pulls is adhesion, which frictionless contact does not have. A solution that
depends on c depends on a number that the user sets for the solver's sake.

**How it is judged.** The first number is the most negative multiplier, the second is how far positions and
multipliers move if contact is decided with c/8. Both are lengths over ℓ; a multiplier counts as the length that
changes the forces by as much. The tolerance is max(1e3 u/cond, 30 u X)/ℓ: what the linear system is solved to, and
what positions are rounded to.

**Undecided.** Where Newton's method finds no solution, or the matrix has no inverse at the solution.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Measurement, Property, Quantity, check_all
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.newton import solve
from contactverif.mechanics.scene import scene_of
from contactverif.mechanics.system import System
from contactverif.strategies.solids import solid_cases
from contactverif_properties.shared.applicability import refuse_dependent_multipliers, refuse_without_multipliers
from contactverif_properties.shared.newton_solution import (
    find_solution,
    is_untouched,
    length_units,
    solution_details,
    solution_floor,
)

SCALE_RATIO = 8.0  # The first scale c over the second one.
TOLERANCE = "max(1e3 u/cond, 30 u X)/ℓ"
TENSION = Quantity(
    "largest tension of a multiplier",
    "1",
    TOLERANCE,
    "A negative multiplier is released. It is measured as the length that changes the forces by as much. "
    "The linear system is solved to 1e3 u/cond, and positions are rounded to 30 u X.",
)
CHANGE = Quantity(
    "change with another scale c",
    "1",
    TOLERANCE,
    "The scale of the decision λ − c g ≥ 0 does not change a solution. "
    "The linear system is solved to 1e3 u/cond, and positions are rounded to 30 u X.",
)


def measure_complementarity(case: Case, subject: Subject) -> Measurement:
    """Solve a scene with multipliers, and solve it again with another scale c of the contact decision.

    Parameters
    ----------
    case : Case
        A scene of a tilted block on another.
    subject : Subject
        A formulation with multipliers.

    Returns
    -------
    Measurement
        The largest tension and the change of the solution, both lengths over ℓ. Details: how the solution ended, and
        whether the second solution converged.
    """
    scene = scene_of(case)
    system = System(scene, subject.for_case(case))
    trace = find_solution(system)
    details = solution_details(trace)
    if not trace.converged:
        return Measurement(details=details, undecided=f"Newton found no solution: {trace.end.label}")
    solution, n_free = trace.u[-1], scene.n_free
    pairing = system.pair(solution)
    condition = system.step(system.matrix(solution, pairing)[0], np.zeros(system.size)).condition
    if condition <= 0:
        return Measurement(details=details, undecided="the matrix has no inverse at the solution")
    units, length = length_units(system, solution, pairing), case.shortest_segment
    floor = solution_floor(system, solution, pairing, condition) / length
    lengths: FloatArray = solution / units / length
    values = {TENSION: float(np.maximum(-lengths[n_free:], 0.0).max(initial=0.0))}
    rescaled = subject.with_penalty(subject.penalty(case) / SCALE_RATIO)
    again = solve(scene, rescaled, start=solution)
    if again.converged:
        values[CHANGE] = float((np.abs(again.u[-1] - solution) / units).max()) / length
    details |= {"converged with another scale": float(again.converged)}
    return Measurement(check_all(values, floor), details=details, idle=is_untouched(system, trace))


def refuse_undefined_solution(traits: Traits) -> str:
    """Return why there are no multipliers or no unique solution to look at, or an empty string."""
    return refuse_without_multipliers(traits) or refuse_dependent_multipliers(traits)


COMPLEMENTARITY = Property(
    id="complementarity",
    family="multipliers",
    summary="All multipliers of a solution press, and the scale of the contact decision does not change the solution.",
    quantities=(TENSION, CHANGE),
    cases=solid_cases,
    measure=measure_complementarity,
    promise=lambda traits: None if refuse_undefined_solution(traits) else True,
    applicable=refuse_undefined_solution,
    bodies=True,
)
