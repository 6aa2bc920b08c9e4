"""The exact distance of a point from segments, and all nearest ones, with the rationals that decide between them.

Nodes and points are integers on a lattice, so no root is taken. Floats with a safe bound only leave out segments that
cannot be nearest. A tie is a tie: every segment at the least distance is returned, the one with the smallest overshoot
first, then by number.
"""

from collections.abc import Iterable
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray

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


# The distance below has an error of at most 16 u (L + |P − A|); this leaves room for whoever writes it otherwise.
_DOUBT = 64 * UNIT_ROUNDOFF


class NearSegment(NamedTuple):
    """A segment at the smallest distance from a point."""

    segment: int  # Its number.
    xi: Fraction  # The foot of the point on the segment's line: 0 at its first node, 1 at its second, unclipped.
    # The square of the length by which the foot lies past the segment's end; 0 if it lies inside.
    squared_overshoot: Fraction
    # The square of the distance to the segment's line, negative on its left, where its body is.
    signed_squared_gap: Fraction
    # The place of the nearest point: ("node", its number) or ("segment", its number). Two segments that meet at the
    # nearest node have the same foot.
    foot: tuple[str, int]


class Nearest(NamedTuple):
    """The exact distance of a point from a surface, and where it is taken."""

    squared_distance: Fraction  # The square of the distance to the nearest closed segment.
    # All segments at this distance: the one with the smallest overshoot first, then by number.
    segments: tuple[NearSegment, ...]

    @property
    def n_undecided(self) -> int:
        """The number of segments that have the smallest overshoot too; more than one is a tie by any rule."""
        smallest = self.segments[0].squared_overshoot
        return sum(near.squared_overshoot == smallest for near in self.segments)

    def signed_squared_gap_at(self, near: NearSegment) -> Fraction:
        """Return the gap at the foot of one of the segments, squared and with its sign.

        At a node where two of them meet it is the gap of the segment with the smaller overshoot. Its sign says whether
        the point is outside the body (+) or inside (−), also at a corner below 90°, where the other segment's line has
        the point on its wrong side.
        """
        return next(other.signed_squared_gap for other in self.segments if other.foot == near.foot)


def nearest_segments(nodes: FloatArray, segments: IntArray, point: tuple[float, float]) -> Nearest:
    """Return all nearest segments to a point, in exact arithmetic on the stored floats.

    Positions are (n_nodes, 2); segments (n_segments, 2) have the body on their left.
    """
    candidates = _candidates(nodes, segments, np.array(point))
    ends = segments[candidates]
    (x, y, *values), scale = integers(np.concatenate([point, nodes[ends].reshape(-1)]))
    numbers = iter(values)
    corners = zip(numbers, numbers, numbers, numbers, strict=True)  # The coordinates of both nodes of each candidate.
    near = nearest_of(
        reach(segment, (ax, ay), (bx, by), (x, y))
        for segment, (ax, ay, bx, by) in zip(candidates.tolist(), corners, strict=True)
    )
    area = scale * scale
    answers = (
        NearSegment(
            segment=each.segment,
            xi=Fraction(each.along, each.squared),
            squared_overshoot=Fraction(each.past * each.past, each.squared * area),
            signed_squared_gap=Fraction(each.across * abs(each.across), each.squared * area),
            foot=("segment", each.segment) if each.end < 0 else ("node", int(segments[each.segment, each.end])),
        )
        for each in near
    )
    return Nearest(Fraction(near[0].above, near[0].squared * area), tuple(answers))


def _candidates(nodes: FloatArray, segments: IntArray, point: FloatArray) -> IntArray:
    """Return the segments that may be nearest (n_candidates,): no other can, whatever floats round."""
    first, second = nodes[segments[:, 0]], nodes[segments[:, 1]]
    along, towards = second - first, point - first
    squared = np.vecdot(along, along)
    share = np.minimum(np.maximum(np.vecdot(towards, along) / squared, 0), 1)
    off = towards - share[:, None] * along
    distance = np.hypot(off[:, 0], off[:, 1])
    doubt = _DOUBT * (np.hypot(towards[:, 0], towards[:, 1]) + np.sqrt(squared))
    return np.flatnonzero(distance - doubt <= (distance + doubt).min())
