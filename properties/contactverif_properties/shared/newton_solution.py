"""Newton's method on a random scene: the solution, how it ended, and the units in which distances are measured.

Positions and multipliers have different units. Distances from a solution are lengths: a multiplier counts as the length
that changes the forces by as much.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.formulation import Pairing
from contactverif.mechanics.linear import scale_factors
from contactverif.mechanics.newton import solve
from contactverif.mechanics.system import System
from contactverif.mechanics.trace import Trace

LOAD_STEPS = (4, 16)  # The numbers of load steps that are tried where a solution in one step is not found.


def find_solution(system: System) -> Trace:
    """Solve the scene with the formulation's own tangent, else with differences, else with differences in load steps.

    A wrong tangent may never get there, and is judged at the solution all the same. Full steps may miss a solution
    that is there, because they overshoot into another pairing.
    """
    for use_tangent, load_steps in ((True, 1), *((False, number) for number in (1, *LOAD_STEPS))):
        trace = solve(system.scene, system.formulation, use_tangent=use_tangent, load_steps=load_steps)
        if trace.converged:
            break
    return trace


def length_units(system: System, u: FloatArray, pairing: Pairing | None) -> FloatArray:
    """Return the unit of each unknown (n_free + n_multipliers,) that corresponds to a unit of length.

    It is 1 for a position, and for a multiplier the change that does as much to the forces.
    """
    if not system.n_multipliers:
        return np.ones(system.size)
    return scale_factors(system.matrix(u, pairing)[0], system.scene.n_free)[1]


def solution_floor(system: System, solution: FloatArray, pairing: Pairing | None, condition: float) -> float:
    """Return the distance from a solution, a length, below which roundoff decides: max(1e3 u/cond, 30 u X).

    Parameters
    ----------
    system : System
        The scene with its formulation.
    solution : FloatArray, shape (n_free + n_multipliers,)
        The unknowns of the solution.
    pairing : Pairing | None
        The pairing of the solution.
    condition : float
        The reciprocal condition of the matrix there, above 0.
    """
    scene, units = system.scene, length_units(system, solution, pairing)
    size = float(np.abs(solution / units).max() + np.abs(scene.imposed_displacements).max())
    solved_to = 1e3 * UNIT_ROUNDOFF / condition * size
    rounded_to = 30 * UNIT_ROUNDOFF * float(np.abs(scene.positions(solution[: scene.n_free])).max())
    return max(solved_to, rounded_to)


def is_untouched(system: System, trace: Trace) -> bool:
    """Return whether the formulation gives no force at the last iterate, so that only the bodies were solved."""
    interface, z = system.scene.interface, trace.z
    pairing = system.formulation.pair(interface, z)
    return not system.formulation.residual(interface, pairing, z)[: interface.n_unknowns].any()


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
