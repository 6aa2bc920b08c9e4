"""Whether a state is so near a kink that a failure there means nothing. The harness decides, not the plugin's pairing.

A kink is where a contact point changes its master segment, its gap changes sign, or an end of its area of competence
passes a master node. Where the plugin says where its contact points are, the distance to the nearest kink is computed
from the positions; where it does not, one-sided differences of its residual must agree.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, dense
from contactverif.contract.case import Case
from contactverif.contract.formulation import Pairing
from contactverif.contract.subject import CheckedFormulation
from contactverif.oracle import kink_margin


def excuse(
    case: Case, formulation: CheckedFormulation, pairing: Pairing | None, reach: float, errors: dict[str, float]
) -> str:
    """Empty, or why what failed may be the fault of rounding the positions by `reach`, at a kink.

    Parameters
    ----------
    errors : dict[str, float]
        {"forces" or "tangent": largest error of an entry}, of what failed.
    """
    directions = np.random.default_rng(case.seed).uniform(-1, 1, (4, case.z.size))
    directions /= np.abs(directions).max(axis=1, keepdims=True)
    near = kink_within(case, formulation, pairing, reach, directions[0])
    if near:
        return near
    jumps = dict(zip(("forces", "tangent"), jump(case, formulation, reach, directions), strict=True))
    if all(4 * jumps[what] >= error for what, error in errors.items()):
        return "a kink: moving the nodes by roundoff changes the answer as much"
    return ""


def jump(case: Case, formulation: CheckedFormulation, reach: float, directions: FloatArray) -> tuple[float, float]:
    """How much the largest entries of forces and tangent change when the nodes move by `reach`, either way.

    Parameters
    ----------
    directions : FloatArray, shape (n, n_unknowns)
        The largest entry of each 1.

    Returns
    -------
    The largest change of a force and of an entry of the tangent (0 where there is none).
    """
    force, tangent = _answers(case, formulation, case.z)
    there = [_answers(case, formulation, case.z + way * reach * d) for d in directions for way in (1, -1)]
    return (
        max(float(np.abs(other - force).max()) for other, _ in there),
        max(float(np.abs(other - tangent).max()) for _, other in there),
    )


def _answers(case: Case, formulation: CheckedFormulation, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    pairing = formulation.pair(case.interface, z)
    forces = formulation.residual(case.interface, pairing, z)
    if "tangent" not in formulation.provides:
        return forces, np.zeros(1)
    return forces, dense(formulation.tangent(case.interface, pairing, z))


def kink_within(
    case: Case, formulation: CheckedFormulation, pairing: Pairing | None, reach: float, direction: FloatArray
) -> str:
    """Empty, or why moving each coordinate by `reach` (a length) at most may change a decision.

    Parameters
    ----------
    direction : FloatArray, shape (n_unknowns,)
        Largest entry 1, along which one-sided differences are taken if need be.
    """
    if "contact_points" in formulation.provides:
        points = formulation.contact_points(case.interface, pairing, case.z)
        margin = kink_margin(case.interface, case.z, points.slave_segment, points.c, points.area_from, points.area_to)
        if margin <= np.sqrt(2) * reach:  # `reach` is of a coordinate, the margin of a node
            return f"a kink: a decision hangs on {margin:.2g}, no more than nodes may move"
        return ""
    here, ahead, behind = (
        formulation.residual(case.interface, formulation.pair(case.interface, z), z)
        for z in (case.z, case.z + reach * direction, case.z - reach * direction)
    )
    bend = np.abs(ahead - 2 * here + behind).max()
    slope = np.abs(ahead - behind).max() / 2
    # A smooth function bends by slope × reach/ℓ and by what roundoff does; a kink by as much as the slope itself.
    rounding = 32 * UNIT_ROUNDOFF * case.largest_coordinate / reach
    if bend > slope * max(np.sqrt(reach / case.shortest_segment), rounding):
        return f"a kink: one-sided differences over {reach:.2g} disagree by {bend / max(slope, bend):.2g}"
    return ""
