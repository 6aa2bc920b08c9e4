"""The exact distance of a point from segments, and the nearest of them: the one search of this room.

A point is (X, Y)/W on a lattice of integers, and the nodes are integers. So all that is compared are integers, and no
root is taken. `exact_nearest` and `exact_choices` say in their own words what is found here.

Rule for the next editor: a tie is a tie. The search returns every segment at the least distance; which of them counts
is decided by the smallest overshoot and then by the number, and whoever asks may decide otherwise.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import NamedTuple

from contactverif.contract.arrays import FloatArray

Point = tuple[int, int]


class Reach(NamedTuple):
    """The relation of a point (X, Y)/W to a segment, in integers of the lattice."""

    segment: int
    above: int  # The square of the distance to the closed segment, times W² and `squared`.
    squared: int  # The square of the segment's length.
    along: int  # The place of the foot on the segment's line: ξ = along / (W × squared), unclipped.
    across: int  # The gap × length of the segment × W: positive on the right of the segment, negative on its left.
    past: int  # The length by which the foot lies at or past an end, times the segment's length and W; 0 inside.
    end: int  # The end that is nearest: 0 or 1, or −1 where the foot lies inside.


def integers(values: FloatArray) -> tuple[list[int], int]:
    """Return integers and one power of two, the scale, such that value = integer / scale exactly."""
    ratios = [value.as_integer_ratio() for value in values.reshape(-1).tolist()]
    scale = max((denominator for _, denominator in ratios), default=1)
    return [numerator * (scale // denominator) for numerator, denominator in ratios], scale


def reach(segment: int, first: Point, second: Point, point: Point, weight: int = 1) -> Reach:
    """Return the relation of the point (X, Y)/W to a closed segment.

    Where the foot lies at or past an end, the distance is that to the end node.
    """
    (ax, ay), (bx, by), (px, py) = first, second, point
    dx, dy, rx, ry = bx - ax, by - ay, px - weight * ax, py - weight * ay
    squared, along, across = dx * dx + dy * dy, rx * dx + ry * dy, rx * dy - ry * dx
    length = weight * squared
    if 0 < along < length:
        return Reach(segment, across * across, squared, along, across, 0, -1)
    if along <= 0:
        return Reach(segment, (rx * rx + ry * ry) * squared, squared, along, across, -along, 0)
    rx, ry = px - weight * bx, py - weight * by
    return Reach(segment, (rx * rx + ry * ry) * squared, squared, along, across, along - length, 1)


def nearest_of(reaches: Iterable[Reach]) -> list[Reach]:
    """Return all segments at the least distance: the one with the smallest overshoot first, then by number."""
    nearest: list[Reach] = []
    for other in reaches:
        excess = other.above * nearest[0].squared - nearest[0].above * other.squared if nearest else -1
        if excess < 0:
            nearest = [other]
        elif excess == 0:
            nearest.append(other)
    if len(nearest) < 2:
        return nearest
    return sorted(nearest, key=lambda near: (Fraction(near.past * near.past, near.squared), near.segment))
