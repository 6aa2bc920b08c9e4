"""The exact error of a choice of master segment, for each rule of choice.

A choice is judged by a length: how much farther the chosen segment is than the nearest. So a tie needs no rule, and a
choice that roundoff decides is as good as its roundoff. Floats only sort out segments that cannot be the nearest.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.oracle.exact_distance import Reach, nearest_of, reach
from contactverif.oracle.exact_points import ExactPoints, Integers, Lattice, Ratios, View, positions, slave_normal_view

_SAFE = 2.0**-20  # Floats err by less than this share of a distance, wherever a state makes sense.
DEEP = 2.0  # Segments that penetrate by more than this many lengths of both need not be in contact.


def closest_excess(lattice: Lattice, points: ExactPoints, segments: IntArray) -> tuple[FloatArray, IntArray]:
    """Return how much farther than the nearest closed segment the chosen ones are, and how many are nearest.

    Both are (n_points,): a length ≥ 0, and the exact number of segments at the least distance. `segments` (n_points,)
    are the master segments that were chosen.
    """
    point, candidate = _near_pairs(lattice, points, segments)
    nodes, master = [tuple(node) for node in lattice.nodes.tolist()], lattice.master.tolist()
    places, weights = [tuple(place) for place in points.place.tolist()], points.weight.tolist()
    reaches: list[dict[int, Reach]] = [{} for _ in places]
    for number, segment in zip(point.tolist(), candidate.tolist(), strict=True):
        first, second = master[segment]
        reaches[number][segment] = reach(segment, nodes[first], nodes[second], places[number], weights[number])
    excess, ties = np.empty(len(segments)), np.empty(len(segments), dtype=np.int64)
    for number, (choice, others) in enumerate(zip(segments.tolist(), reaches, strict=True)):
        near = nearest_of(others.values())
        excess[number] = _farther(others[choice], near[0], weights[number] * lattice.scale)
        ties[number] = len(near)
    return excess, ties


def _farther(choice: Reach, nearest: Reach, unit: int) -> float:
    """Return how much farther one segment is than another, a length ≥ 0; squared distances still carry unit²."""
    a, b, c, d = choice.above, choice.squared, nearest.above, nearest.squared
    if a * d <= c * b:
        return 0.0
    total = np.sqrt(a / (b * unit**2)) + np.sqrt(c / (d * unit**2))
    return float((a * d - c * b) / (b * d * unit**2) / total)


def _near_pairs(lattice: Lattice, points: ExactPoints, choice: IntArray) -> tuple[IntArray, IntArray]:
    """Return points and master segments, sorted by point: all that may be the nearest, and the choice."""
    nodes = Ratios(lattice.nodes, np.array(lattice.scale, dtype=object)).floats()
    place = positions(lattice, points).floats()
    first, second = nodes[lattice.master[:, 0]], nodes[lattice.master[:, 1]]
    along = second - first
    share = ((place[:, None] - first) * along).sum(axis=-1) / (along**2).sum(axis=-1)
    foot = first + np.clip(share, 0, 1)[..., None] * along
    distance = np.hypot(*np.moveaxis(place[:, None] - foot, -1, 0))
    doubt = 64 * UNIT_ROUNDOFF * np.abs(nodes).max()
    near = distance <= distance.min(axis=1, keepdims=True) * (1 + _SAFE) + doubt
    near[np.arange(len(choice)), choice] = True
    point, candidate = np.nonzero(near)
    return point, candidate


def seen_excess(
    lattice: Lattice, points: ExactPoints, slave_segment: IntArray, segments: IntArray, cells: bool
) -> FloatArray:
    """Return how far the chosen segments are from being the nearest that the slave sees along its normal.

    That is a length ≥ 0 (n_points,): how much farther the chosen segment is than the nearest, or how far the foot lies
    past its end; infinite where it does not face the slave. With `cells` the choice may also be made in the middle of
    the overlap of the two segments, once for all points of a cell.
    """
    view = slave_normal_view(lattice, points, segments)
    past = np.maximum(np.maximum(-view.xi.floats(), view.xi.floats() - 1), 0.0) * view.master_length
    farther = _farther_than_nearest(lattice, points, segments, view)
    if cells and farther.any():
        middle = _middles(lattice, slave_segment, segments)
        in_middle = slave_normal_view(lattice, middle, segments)
        farther = np.minimum(farther, _farther_than_nearest(lattice, middle, segments, in_middle))
    return np.where(view.cosine > 0, np.maximum(past, farther), np.inf)


def _farther_than_nearest(lattice: Lattice, points: ExactPoints, choice: IntArray, view: View) -> FloatArray:
    """Return how much larger |gap| is on the chosen segments than on the nearest ones that are seen, a length ≥ 0.

    Segments deeper or farther than two lengths of both need not count as contact, and so are no rivals.
    """
    n_master = len(lattice.master)
    point, candidate = np.divmod(np.arange(len(choice) * n_master), n_master)
    other = slave_normal_view(lattice, points.select(point), candidate)
    xi, gap = other.xi.floats(), np.abs(other.gap.floats())
    near = gap <= DEEP * (other.slave_length + other.master_length)
    rival = (other.cosine > 0) & (xi > 0) & (xi < 1) & near
    gaps = np.where(rival, gap, np.inf).reshape(len(choice), n_master).min(axis=1, initial=np.inf)
    farther: FloatArray = np.maximum(np.abs(view.gap.floats()) - gaps, 0.0)
    return farther


def _middles(lattice: Lattice, slave_segment: IntArray, segments: IntArray) -> ExactPoints:
    """Return the points in the middle of the overlaps of slave and master segments, seen along the slave's normal."""
    low, high, squared = overlaps(lattice, slave_segment, segments)
    return ExactPoints.at_ratios(lattice, slave_segment, low + high, 2 * squared)


def overlaps(lattice: Lattice, slave_segment: IntArray, segments: IntArray) -> tuple[Integers, Integers, Integers]:
    """Return the overlaps of slave segments with master segments that face them, seen along the slave's normal.

    They are low, high and `squared` (n_pairs,): the ends c on the slave segment times `squared`, cut to the segment,
    with high ≤ low where there is none; and the square of the slave segment's length on the lattice.
    """
    x_a, x_b = (lattice.nodes[lattice.slave[slave_segment, end]] for end in (0, 1))
    x_1, x_2 = (lattice.nodes[lattice.master[segments, end]] for end in (0, 1))
    along = x_b - x_a
    squared = (along**2).sum(axis=1)
    low, high = (((2 * end - x_a - x_b) * along).sum(axis=1) for end in (x_2, x_1))
    return np.maximum(low, -squared), np.minimum(high, squared), squared
