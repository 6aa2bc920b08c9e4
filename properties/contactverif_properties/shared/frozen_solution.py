"""Newton's method on a frozen pairing, for states in which nothing opens or closes.

The pairing of the first state stays. So a node that faces a vertex does not change its segment and back again, and the
answer to a small load is linear.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.formulation import Pairing
from contactverif.mechanics.system import System

MOST_STEPS = 12


def solve_frozen(system: System, start: FloatArray, pairing: Pairing | None) -> FloatArray | None:
    """Solve a scene on one pairing, with the formulation's tangent or, where that does not converge, by differences.

    Parameters
    ----------
    system : System
        The scene with its formulation.
    start : FloatArray, shape (n_free + n_multipliers,)
        The first guess.
    pairing : Pairing | None
        The pairing; None if the formulation has none, which then decides anew at each iterate.

    Returns
    -------
    FloatArray | None, shape (n_free + n_multipliers,)
        The unknowns once the residual is down to its own roundoff; None if it does not get there.
    """
    for use_tangent in (True, False):
        system.use_tangent = use_tangent
        if (solution := _iterate(system, start, pairing)) is not None:
            return solution
    return None


def _iterate(system: System, start: FloatArray, pairing: Pairing | None) -> FloatArray | None:
    u = start
    for _ in range(MOST_STEPS):
        residual = system.residual(u, pairing)
        matrix, floor = system.matrix(u, pairing)
        if (np.abs(residual) <= floor).all():
            return u
        change = system.step(matrix, -residual, floor).change
        if change is None or not np.isfinite(change).all():
            return None
        u = u + change
    return None
