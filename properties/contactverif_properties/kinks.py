"""Decide whether a state is so near a kink that a failure there means nothing.

A kink is where a contact point changes its master segment, its gap changes sign, or an end of its area of competence
passes a master node. The harness decides, and not the plugin's pairing, or a plugin whose pairing changes at every call
would never fail. Where the plugin says where its contact points are, the harness computes the distance to the nearest
kink from the positions. Where the plugin does not, one-sided differences of its residual must agree. The plugin's
tangent is never asked: one that jumps everywhere would excuse all of its own errors.

A kink excuses a choice between the answers on its sides, and no other answer: a force that is missing exactly where a
slave node stands over a master node, and there only, is no choice.
`docs/concepts/tolerances.md` explains kinks and the verdict `undecided`.
"""

from dataclasses import replace

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.case import ACTIVATION, Case
from contactverif.contract.interface import PLANE
from contactverif.oracle.kink_distance import kink_margin
from contactverif.problems.open_states import activation_margin
from contactverif_properties.roundoff import COORDINATE_ROUNDING
from contactverif_properties.states import FrozenState, random_directions

N_DIRECTIONS = 4  # The number of random directions in which a state is moved to look for a jump.
N_AROUND = 16  # The number of those, forth and back, in which the answers around a kink are looked for.
# Truncation and roundoff of the best central difference, over (uX/ℓ)^(2/3), as in `tangent.directional`.
DIFFERENCE_ERROR = 30.0
FAR = 8.0  # A jump so many times too small, in the columns of the largest error, is none of the whole tangent.
N_RARE = 4  # Answers that are larger, or smaller, than all but so many of those around are no side of the kink.


def explain_by_kink(state: FrozenState, reach: float, errors: dict[str, float], columns: IntArray | None = None) -> str:
    """Return why a failure may be the fault of a kink, or an empty string.

    The coordinates are rounded by `reach`, a length. `errors` are the largest of an entry of the "forces" or the
    "tangent", for each of the two that failed. `columns` are those in which the tangent's error is the largest. Where
    it hardly jumps in these, the others are not asked: all of them are many calls, and a wrong tangent fails often.
    """
    reason = find_kink(state, reach)
    if not reason:
        directions = random_directions(state.case.seed, N_DIRECTIONS, state.case.z.size)
        # Differences of all columns are many calls, which a failure of the forces alone does not need.
        jumps = "forces" not in errors or 4 * measure_jump(state, reach, directions) >= errors["forces"]
        if jumps and "tangent" in errors:
            size = errors["tangent"] / 4
            in_columns = columns is None or FAR * measure_jump_of_slope(state, reach, directions, columns) >= size
            jumps = in_columns and measure_jump_of_slope(state, reach, directions) >= size
        reason = "a kink: moving the nodes by roundoff changes the answer as much" if jumps else ""
    if reason and "forces" in errors and state.case.interface.dim != PLANE:
        reason = "a kink: the forces change at a rounding; if that is often so, do faces overlap in your search?"
    return reason if reason and is_like_its_surroundings(state, reach) else ""


def is_like_its_surroundings(state: FrozenState, reach: float) -> bool:
    """Return whether the forces of a state are among those of the states around it, as a choice at a kink is.

    The nodes are moved by `reach` forth and back, so that every kink is crossed both ways, and half of the moves or
    more stay on the side of the state. So the rarest answers are left out. A force counts as one of the others if it
    is between the least and the largest of them, or outside by no more than their difference: where several decisions
    meet in one node, not all of their combinations are drawn. Of eight faces around a node that are equally near, each
    is the answer on an eighth of the moves, and seems rare: a state that is not like the others is asked with more.
    """
    case = state.case
    here = _forces(state, case.z)
    for count, rare in ((N_AROUND, N_RARE), (4 * N_AROUND, 2 * N_RARE)):
        moves = reach * random_directions(case.seed, count, case.z.size)
        around = np.array([_forces(state, case.z + move) for move in (*moves, *-moves)])
        low, high = np.sort(around, axis=0)[[rare, -1 - rare]]
        rounding = 8 * UNIT_ROUNDOFF * case.n_segments * max(np.abs(low).max(), np.abs(high).max())
        if (np.maximum(low - here, here - high) <= high - low + rounding).all():
            return True
    return False


def measure_jump(state: FrozenState, reach: float, directions: FloatArray) -> float:
    """Return how much a force changes when the nodes move by `reach`, forth or back.

    Each state has a new pairing. The directions (n, n_unknowns) have the largest entry ±1.
    """
    force, *others = (_forces(state, place) for place in _places(state, reach, directions))
    return max(float(np.abs(other - force).max()) for other in others)


def measure_jump_of_slope(
    state: FrozenState, reach: float, directions: FloatArray, columns: IntArray | None = None
) -> float:
    """Return how much an entry of the derivative changes when the nodes move, as in `measure_jump`.

    It is the change less what differences may be wrong by; or that of a smooth answer, if that is larger. Only some
    columns are looked at if they are given.
    """
    places = _places(state, reach, directions)
    slope, *others = (_differentiate(_pair_at(state, place), place, columns) for place in places)
    change = max(float(np.abs(other - slope).max()) for other in others)
    noise = DIFFERENCE_ERROR * _rounding_share(state.case) ** (2 / 3) * float(np.abs(slope).max())
    return float(max(change - noise, reach * _measure_curvature(state, directions, columns)))


def _places(state: FrozenState, reach: float, directions: FloatArray) -> list[FloatArray]:
    z = state.case.z
    return [z, *(z + sign * reach * direction for direction in directions for sign in (1, -1))]


def _measure_curvature(state: FrozenState, directions: FloatArray, columns: IntArray | None) -> float:
    """Return by how much an entry of the derivative changes a length of the way, on the pairing of the state.

    A segment that is seen nearly edge-on turns the tangent by many times uX/ℓ, and no jump shows it: so small a change
    is lost in the error of differences. A longer way shows it, as long as the answer is smooth.
    """
    z, share = state.case.z, _rounding_share(state.case)
    frozen, way = _pair_at(state, z), state.case.resolution * share ** (1 / 6)
    curvature = 0.0
    for direction in directions:
        back, forth = (_differentiate(frozen, z + sign * way * direction, columns) for sign in (-1, 1))
        noise = DIFFERENCE_ERROR * share ** (2 / 3) * float(np.abs(forth).max() + np.abs(back).max())
        curvature = max(curvature, (float(np.abs(forth - back).max()) - noise) / (2 * way))
    return curvature


def _pair_at(state: FrozenState, z: FloatArray) -> FrozenState:
    return replace(state, pairing=state.formulation.pair(state.case.interface, z))


def _forces(state: FrozenState, z: FloatArray) -> FloatArray:
    return _pair_at(state, z).residual_at(z)


def _differentiate(state: FrozenState, z: FloatArray, columns: IntArray | None = None) -> FloatArray:
    """Return the derivative of the forces at z, or columns of it, on the pairing of a state, by central differences."""
    step = state.case.resolution * _rounding_share(state.case) ** (1 / 3)
    moves = step * np.eye(z.size)
    moves = moves if columns is None else moves[columns]
    forces = state.residual_at(np.concatenate([z + moves, z - moves]))
    return np.asarray((forces[: len(moves)] - forces[len(moves) :]).T / (2 * step))


def _rounding_share(case: Case) -> float:
    return UNIT_ROUNDOFF * case.largest_coordinate / case.resolution


def explain_by_rounded_decision(state: FrozenState) -> str:
    """Return why rounding the positions relative to one another may turn a decision around, or an empty string.

    Each coordinate may move by 64 u D, whatever its distance from the origin. How much the forces change is not asked:
    where errors are counted in roundings, that would excuse a hundred of them.
    """
    return find_kink(state, COORDINATE_ROUNDING * state.case.diameter)


def excuse_barrier(state: FrozenState, longest: float, step: float, error: float) -> str:
    """Return why differences of a barrier mean nothing, or an empty string.

    Its forces may begin within the longest step, where their slope has a kink. Or they are noise, as where a library
    multiplies whole coordinates: forces change by more than a derivative's `error` makes of a step, a length, where
    nodes move by roundoff.
    """
    case = state.case
    if ACTIVATION not in case.parameters:
        return ""
    if activation_margin(case) <= np.sqrt(2) * longest:
        return f"a kink: a node is within {longest:.2g} of the activation distance"
    rounding = UNIT_ROUNDOFF * case.largest_coordinate
    directions = random_directions(case.seed, N_AROUND, case.z.size)
    forces = np.array([_forces(state, case.z + rounding * direction) for direction in directions])
    noise = float(np.ptp(forces, axis=0).max())
    if 4 * noise >= error * step:
        return f"roundoff: forces change by {noise:.2g} where nodes move by {rounding:.2g}"
    return ""


def find_kink(state: FrozenState, reach: float, direction: FloatArray | None = None) -> str:
    """Return why a decision may change if each coordinate moves by `reach` at most, a length, or an empty string.

    Where the formulation has no contact points, or in space, one-sided differences along a direction (n_unknowns,) are
    looked at. It is random by the seed of the case, unless it is given.
    """
    case = state.case
    if state.has_points and case.interface.dim == PLANE:
        margin = min(
            kink_margin(each.interface, each.z, at.slave_segment, at.c, at.area_from, at.area_to)
            for each, at in ((each, each.points) for each in state.passes)
        )
        if margin <= np.sqrt(2) * reach:  # The reach is of a coordinate, the margin of a node.
            return f"a kink: a decision hangs on {margin:.2g}, no more than nodes may move"
        return ""
    if direction is None:
        (direction,) = random_directions(case.seed, 1, case.z.size)
    move = reach * direction
    here, ahead, behind = (_forces(state, z) for z in (case.z, case.z + move, case.z - move))
    bend = np.abs(ahead - 2 * here + behind).max()
    slope = np.abs(ahead - behind).max() / 2
    # A smooth function bends by slope × reach/ℓ and by what roundoff does; a kink bends by as much as the slope itself.
    rounding = 32 * UNIT_ROUNDOFF * case.largest_coordinate / reach
    if bend > slope * max(np.sqrt(reach / case.resolution), rounding):
        return f"a kink: one-sided differences over {reach:.2g} disagree by {bend / max(slope, bend):.2g}"
    return ""
