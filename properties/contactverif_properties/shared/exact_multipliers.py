"""The multipliers of a uniform pressure: which ones are right, and which solution is nearest where many are."""

from __future__ import annotations

import numpy as np
from scipy import linalg, optimize

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.case import Case
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.mechanics.linear import RANK_ROUNDOFF
from contactverif.mechanics.scene import Scene
from contactverif_properties.shared.uniform_pressure import consistent_forces, unit_forces


def exact_multipliers(case: Case, subject: Subject, formulation: CheckedFormulation, pressure: float) -> FloatArray:
    """Return the multipliers that stand for a uniform pressure in the exact state of the case.

    Parameters
    ----------
    case : Case
        The exact state: positions without multipliers.
    subject : Subject
        The formulation as loaded; its trait `penalty` says whether multipliers are pressures or nodal forces.
    formulation : CheckedFormulation
        The same formulation, which is asked for forces.
    pressure : float
        The exact pressure p.

    Returns
    -------
    FloatArray, shape (n_multipliers,)
        The pressure itself where it gives the exact forces. Else the multipliers ≥ 0 that come nearest to them. A
        multiplier that transmits nothing, as that of a node that faces nothing, is 0.
    """
    uniform = np.full(formulation.n_multipliers(case.interface), pressure)
    state = case.with_multipliers(uniform)
    transfer = -unit_forces(state, formulation, formulation.pair(case.interface, state.z))
    exact = consistent_forces(case, pressure).reshape(-1)
    nearest: FloatArray = optimize.nnls(transfer, exact)[0]  # The formulation would release one below 0.
    if subject.traits.penalty != "nodal":
        uniform[~transfer.any(axis=0)] = 0.0
        errors = [float(np.abs(transfer @ candidate - exact).max()) for candidate in (uniform, nearest)]
        if errors[0] <= max(2 * errors[1], 1e-12 * float(np.abs(exact).max())):
            return uniform
    return nearest


def nearest_multipliers(
    case: Case, scene: Scene, formulation: CheckedFormulation, exact: FloatArray
) -> tuple[FloatArray, float]:
    """Return, of all multipliers that load the bodies as those of a solved case do, the nearest to the exact ones.

    A combination of multipliers that loads no body may be added to a solution. Such combinations exist where
    multipliers are not unique, and on a rigid master, where only the sum of the nodal forces counts.

    Parameters
    ----------
    case : Case
        The solved state, with its multipliers.
    scene : Scene
        The scene that was solved.
    formulation : CheckedFormulation
        The formulation that has the multipliers.
    exact : FloatArray, shape (n_multipliers,)
        The exact multipliers.

    Returns
    -------
    nearest : FloatArray, shape (n_multipliers,)
        The multipliers to judge.
    sharpness : float
        The number s: the smallest singular value of the loads of unit multipliers on the bodies over the largest one.
        Forces that are wrong by roundoff leave the multipliers uncertain by roundoff over s.
    """
    solution = case.multipliers
    pairing = formulation.pair(case.interface, case.z)
    loads = scene.transformation.T @ unit_forces(case, formulation, pairing)
    _, sizes, directions = linalg.svd(loads)
    rank = int((sizes > RANK_ROUNDOFF * max(loads.shape) * UNIT_ROUNDOFF * sizes.max(initial=0.0)).sum())
    free = directions[rank:]
    nearest: FloatArray = solution + free.T @ (free @ (exact - solution))
    return nearest, float(sizes[rank - 1] / sizes[0]) if rank else 1.0
