"""Newton's method on a random scene: the solution, how it ended, and the units in which distances are measured.

Positions and multipliers have different units. Distances from a solution are lengths: a multiplier counts as the length
that changes the forces by as much.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.mechanics.newton import MAX_ITERATIONS, solve
from contactverif.mechanics.scene import Scene
from contactverif.mechanics.system import System
from contactverif.mechanics.trace import Trace

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
