"""Exact projections of slave points onto the master, and how areas of competence fall on it.

All arithmetic is in integers and rationals on the stored floats, so lengths appear as their squares. A tie is reported.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface
from contactverif.oracle.nearest import Point, Reach, integers, nearest_of, reach


def subtract(a: Point, b: Point) -> Point:
    """Return the vector from a to b."""
    return b[0] - a[0], b[1] - a[1]


def dot(a: Point, b: Point) -> int:
    """Return a · b."""
    return a[0] * b[0] + a[1] * b[1]


def cross(a: Point, b: Point) -> int:
    """Return a × b, positive if b points to the left of a."""
    return a[0] * b[1] - a[1] * b[0]


def squared_overshoot(near: Reach) -> Fraction:
    """Return the square of the length by which the foot lies past the segment's end; 0 if it lies inside."""
    return Fraction(near.past * near.past, near.squared)


@dataclass(frozen=True, slots=True)
class Projection:
    """The exact projection of a point of a slave segment onto the master."""

    segment: int  # The nearest master segment.
    xi: Fraction  # The foot on that segment: 0 at its first node, 1 at its second, unclipped.
    squared_distance: Fraction  # The square of the distance to the closed segment, a length squared.
    # The square of the distance to the segment's line, a length squared, negative in penetration.
    signed_squared_gap: Fraction
    tied: tuple[int, ...]  # All segments at the same distance.
    undecided: tuple[int, ...]  # Those of the tied segments that have the same overshoot too; more than one is a kink.

    @property
    def gap_sign(self) -> int:
        """The sign of the gap: −1 in penetration, 0 in touch, +1 open."""
        return (self.signed_squared_gap > 0) - (self.signed_squared_gap < 0)


def project_point(interface: Interface, z: FloatArray, slave_segment: int, c: float | Fraction) -> Projection:
    """Project the point at c ∈ [−1, 1] of a slave segment onto the master, in exact arithmetic.

    The nearest closed segment is taken; where the foot lies at or past an end, the distance is that to the end node. A
    tie is decided by the smallest overshoot, the length of the unclipped foot past the segment's end, then by the lower
    number.
    """
    exact = _Exact(interface, z, [Fraction(c)])
    return exact.nearest(exact.point(slave_segment, Fraction(c)))


class _Exact:
    """A state on an integer lattice that is fine enough for its nodes and for the points at certain places c."""

    def __init__(self, interface: Interface, z: FloatArray, places: Iterable[Fraction]) -> None:
        values, scale = integers(np.asarray(z, dtype=np.float64)[: interface.n_unknowns])
        self.fineness = 2 * lcm(*(place.denominator for place in places))
        self.scale = scale * self.fineness
        self.nodes = [(x * self.fineness, y * self.fineness) for x, y in zip(values[::2], values[1::2], strict=True)]
        self.slave = interface.slave.segments.tolist()
        self.master = interface.master.segments.tolist()
        self.neighbours = interface.master.neighbours.tolist()

    def point(self, segment: int, c: Fraction) -> Point:
        """Return the point at c of a slave segment."""
        (ax, ay), (bx, by) = (self.nodes[node] for node in self.slave[segment])
        towards = int((1 + c) / 2 * self.fineness)
        away = self.fineness - towards
        return (away * ax + towards * bx) // self.fineness, (away * ay + towards * by) // self.fineness

    def ends(self, segment: int) -> tuple[Point, Point]:
        """Return the end points of a master segment."""
        return self.nodes[self.master[segment][0]], self.nodes[self.master[segment][1]]

    def direction(self, segment: int) -> Point:
        """Return the vector from the first to the second node of a master segment."""
        return subtract(*self.ends(segment))

    def nearest(self, point: Point) -> Projection:
        """Return the projection of a point."""
        near = nearest_of(reach(segment, *self.ends(segment), point) for segment in range(len(self.master)))
        best, area = near[0], self.scale**2
        overshoot = squared_overshoot(best)
        return Projection(
            segment=best.segment,
            xi=Fraction(best.along, best.squared),
            squared_distance=Fraction(best.above, best.squared * area),
            signed_squared_gap=Fraction(best.across * abs(best.across), best.squared * area),
            tied=tuple(sorted(other.segment for other in near)),
            undecided=tuple(other.segment for other in near if squared_overshoot(other) == overshoot),
        )


def projection_cases(interface: Interface, z: FloatArray, n: int = 2) -> Counter[str]:
    """Count how the areas of competence of n virtual slave nodes a segment fall on the master; for small meshes.

    The virtual slave nodes lie at c = −1 + (2k+1)/n. Counted are "one segment"; the roles "first", "intermediate" and
    "last" of segments where there are several; "node exactly hit" by a foot or an end; "beyond an end"; "convex vertex"
    and "concave vertex" inside an area; "edge-on", before a segment seen edge-on or from behind, where the walk stops;
    "turned away", where nothing is covered.
    """
    counts: Counter[str] = Counter()
    half = Fraction(1, n)
    centres = [-1 + (2 * k + 1) * half for k in range(n)]
    exact = _Exact(interface, z, [*centres, *(c - half for c in centres), *(c + half for c in centres)])
    for slave_segment in range(len(exact.slave)):
        for c in centres:
            counts.update(_cases_at(exact, slave_segment, c, half))
    return counts


def _cases_at(exact: _Exact, slave_segment: int, c: Fraction, half: Fraction) -> Iterator[str]:
    """Yield the cases of one area of competence, from c − half to c + half."""
    home = exact.nearest(exact.point(slave_segment, c))
    along = exact.direction(home.segment)
    low = dot(exact.point(slave_segment, c + half), along)  # P, nearer the slave segment's second node.
    high = dot(exact.point(slave_segment, c - half), along)  # Q
    if low >= high:
        yield "turned away"
        return
    if home.xi in (0, 1):
        yield "node exactly hit"
    elif not 0 < home.xi < 1 and exact.neighbours[home.segment][int(home.xi > 1)] < 0:
        yield "beyond an end"
    covered = [home.segment]
    for side, sign, end in ((0, -1, low), (1, 1, high)):
        yield from _walk(exact, home.segment, side, sign * end, covered)
    if len(covered) == 1:
        yield "one segment"
    else:
        yield from ("first", "last", *["intermediate"] * (len(covered) - 2))


def _walk(exact: _Exact, home: int, side: int, end: int, covered: list[int]) -> Iterator[str]:
    """Walk along the master from a segment to the end of an area, append what is covered, and yield what is met.

    The end is measured along the home segment, in the direction of the walk: side 0 walks back, side 1 forward.
    """
    sign, along, segment = 2 * side - 1, exact.direction(home), home
    while True:
        node = sign * dot(exact.nodes[exact.master[segment][side]], along)
        if end == node:
            yield "node exactly hit"
        if end <= node:
            return
        following = exact.neighbours[segment][side]
        if following < 0 or following in covered:
            yield "beyond an end"
            return
        if dot(exact.direction(following), along) <= 0:
            yield "edge-on"
            return
        turn = sign * cross(exact.direction(segment), exact.direction(following))
        if turn:
            yield "convex vertex" if turn > 0 else "concave vertex"
        covered.append(following)
        segment = following
