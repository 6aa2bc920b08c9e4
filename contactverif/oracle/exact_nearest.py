"""The exact nearest segments to a point: every one of them, with the rationals that decide between them.

`exact_projection` answers for a point of a slave segment and looks at every master segment. Here the point is free, and
floats with a safe bound leave only the few segments that can be nearest, so that a long chain costs little.

Rule for the next editor: floats only leave out what cannot be nearest. Everything that is returned is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.oracle.rationals import integers

_Point = tuple[int, int]
# The distance below has an error of at most 16 u (L + |P − A|); this leaves room for whoever writes it otherwise.
_DOUBT = 64 * UNIT_ROUNDOFF


@dataclass(frozen=True, slots=True)
class NearSegment:
    """A segment at the smallest distance from a point.

    Attributes
    ----------
    segment : int
        Its number.
    xi : Fraction
        The foot of the point on the segment's line: 0 at its first node, 1 at its second, unclipped.
    squared_overshoot : Fraction
        The square of the length by which the foot lies past the segment's end; 0 if it lies inside.
    signed_squared_gap : Fraction
        The square of the distance to the segment's line, negative on its left, where its body is.
    foot : tuple[str, int]
        The place of the nearest point: ("node", its number) or ("segment", its number). Two segments that meet at the
        nearest node have the same foot.
    """

    segment: int
    xi: Fraction
    squared_overshoot: Fraction
    signed_squared_gap: Fraction
    foot: tuple[str, int]


@dataclass(frozen=True, slots=True)
class Nearest:
    """The exact distance of a point from a surface, and where it is taken.

    Attributes
    ----------
    squared_distance : Fraction
        The square of the distance to the nearest closed segment.
    segments : tuple[NearSegment, ...]
        All segments at this distance: the one with the smallest overshoot first, then by number.
    """

    squared_distance: Fraction
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

    Parameters
    ----------
    nodes : FloatArray, shape (n_nodes, 2)
        The positions.
    segments : IntArray, shape (n_segments, 2)
        The numbers of the first and the second node of each segment; the body is on its left.
    point : tuple[float, float]
        The point.

    Returns
    -------
    Nearest
        The squared distance, and the segments at this distance.
    """
    candidates = _candidates(nodes, segments, np.array(point))
    values, scale = integers(np.concatenate([point, nodes[segments[candidates]].reshape(-1)]))
    p, ends = (values[0], values[1]), values[2:]
    measured = []
    for place, number in enumerate(candidates.tolist()):
        ax, ay, bx, by = ends[4 * place : 4 * place + 4]
        measured.append(_measure(number, segments[number].tolist(), p, ((ax, ay), (bx, by)), scale))
    best = min(distance for distance, _ in measured)
    near = [segment for distance, segment in measured if distance == best]
    return Nearest(best, tuple(sorted(near, key=lambda item: (item.squared_overshoot, item.segment))))


def _candidates(nodes: FloatArray, segments: IntArray, point: FloatArray) -> IntArray:
    """Return the segments that may be nearest (n_candidates,): no other can, whatever floats round."""
    first, second = nodes[segments[:, 0]], nodes[segments[:, 1]]
    along, towards = second - first, point - first
    squared = (along * along).sum(axis=1)
    share = np.clip((towards * along).sum(axis=1) / squared, 0, 1)
    off = towards - share[:, None] * along
    distance = np.hypot(off[:, 0], off[:, 1])
    doubt = _DOUBT * (np.hypot(towards[:, 0], towards[:, 1]) + np.sqrt(squared))
    candidates: IntArray = np.flatnonzero(distance - doubt <= (distance + doubt).min())
    return candidates


def _measure(
    number: int, nodes: list[int], p: _Point, ends: tuple[_Point, _Point], scale: int
) -> tuple[Fraction, NearSegment]:
    """Return the squared distance of a point from a segment, and the rest of what is said of the segment."""
    (ax, ay), (bx, by) = ends
    dx, dy, rx, ry = bx - ax, by - ay, p[0] - ax, p[1] - ay
    squared, along, across = dx * dx + dy * dy, rx * dx + ry * dy, rx * dy - ry * dx
    area = scale * scale
    if 0 < along < squared:
        distance, past, foot = Fraction(across * across, squared * area), 0, ("segment", number)
    elif along <= 0:
        distance, past, foot = Fraction(rx * rx + ry * ry, area), -along, ("node", nodes[0])
    else:
        far = (p[0] - bx, p[1] - by)
        distance, past, foot = Fraction(far[0] ** 2 + far[1] ** 2, area), along - squared, ("node", nodes[1])
    return distance, NearSegment(
        segment=number,
        xi=Fraction(along, squared),
        squared_overshoot=Fraction(past * past, squared * area),
        signed_squared_gap=Fraction(across * abs(across), squared * area),
        foot=foot,
    )
