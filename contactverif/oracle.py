"""Exact answers to judge by. The judge shares no code with the judged: nothing here is used by a plugin.

Exact consistent nodal lengths of a flat interface, exact projections (rationals on the stored floats; lengths are
compared by their squares), and a bound in floats on how far a state is from a kink.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

import numpy as np
from numpy.typing import ArrayLike

from contactverif.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray, IntArray
from contactverif.interface import Interface, Surface

_PAIRS_AT_ONCE = 2**18  # of points and master segments, so that memory stays small
_SNAP = 1e-2  # past a free end by this share of the segment, formulations may still see contact
_Point = tuple[int, int]


def uniform_pressure_weights_exact(interface: Interface, along: ArrayLike) -> list[Fraction]:
    """Lengths (n_nodes,) that a uniform pressure is multiplied by to give the consistent nodal forces.

    ∫ N over the part of the node's surface that faces chains of the other surface: where both are, whichever is wider.
    `along` (n_nodes,) is the coordinate of each node along the straight interface, a length; floats count as the
    rationals that they are. Chains are open, and those of one surface do not overlap.
    """
    places, scale = _integers(np.asarray(along, dtype=np.float64))
    weights = [Fraction(0)] * len(places)
    for surface, other in ((interface.slave, interface.master), (interface.master, interface.slave)):
        ordered = sorted(sorted(ends, key=places.__getitem__) for ends in surface.segments.tolist())
        ordered.sort(key=lambda ends: places[ends[0]])
        starts = [places[low] for low, _ in ordered]
        for low, high in _covered(other, places):
            for first, second in ordered[max(bisect_right(starts, low) - 1, 0) : bisect_right(starts, high)]:
                begin, length = places[first], places[second] - places[first]
                a, b = max(low, begin) - begin, min(high, places[second]) - begin  # the covered part, from first node
                if a < b:
                    towards_second = Fraction(b * b - a * a, 2 * length)
                    weights[second] += towards_second
                    weights[first] += b - a - towards_second
    return [weight / scale for weight in weights]


def uniform_pressure_weights(interface: Interface, along: ArrayLike) -> FloatArray:
    """As `uniform_pressure_weights_exact`, each length (n_nodes,) rounded once."""
    return np.array([float(weight) for weight in uniform_pressure_weights_exact(interface, along)])


def _covered(surface: Surface, places: list[int]) -> list[tuple[int, int]]:
    """The stretch that each chain covers."""
    firsts, lasts = surface.segments[:, 0].tolist(), surface.segments[:, 1].tolist()
    stretches: list[tuple[int, int]] = []
    for segment in surface.chain_order.tolist():
        if surface.neighbours[segment, 0] < 0:
            begin = places[firsts[segment]]
        if surface.neighbours[segment, 1] < 0:
            end = places[lasts[segment]]
            stretches.append((min(begin, end), max(begin, end)))
    return stretches


def _integers(values: FloatArray) -> tuple[list[int], int]:
    """Integers and one power of two: value = integer / scale, exactly."""
    ratios = [value.as_integer_ratio() for value in values.reshape(-1).tolist()]
    scale = max(denominator for _, denominator in ratios)
    return [numerator * (scale // denominator) for numerator, denominator in ratios], scale


@dataclass(frozen=True, slots=True)
class Projection:
    """The exact projection of a point of a slave segment onto the master.

    Attributes
    ----------
    segment : the master segment that is nearest.
    xi : foot on it, 0 at its first node, 1 at its second, unclipped.
    squared_distance : to the closed segment, a length squared.
    signed_squared_gap : square of the distance to the segment's line, a length squared, negative in penetration.
    tied : all segments at that distance.
    undecided : those of them that the least overshoot does not tell apart either; more than one is a kink.
    """

    segment: int
    xi: Fraction
    squared_distance: Fraction
    signed_squared_gap: Fraction
    tied: tuple[int, ...]
    undecided: tuple[int, ...]

    @property
    def gap_sign(self) -> int:
        """−1 in penetration, 0 in touch, +1 open."""
        return (self.signed_squared_gap > 0) - (self.signed_squared_gap < 0)


def nearest(interface: Interface, z: FloatArray, slave_segment: int, c: float | Fraction) -> Projection:
    """The master segment nearest to the point at c ∈ [−1, 1] of a slave segment, in exact arithmetic.

    The nearest closed segment; where the foot lies at or past an end the distance is taken to the end node itself.
    Ties: the least length of the unclipped foot past the segment's end, then the lower index.
    """
    exact = _Exact(interface, z, [Fraction(c)])
    return exact.nearest(exact.point(slave_segment, Fraction(c)))


class _Exact:
    """The state on an integer lattice fine enough to hold the nodes and the points at the given c's."""

    def __init__(self, interface: Interface, z: FloatArray, places: Iterable[Fraction]) -> None:
        values, scale = _integers(np.asarray(z, dtype=np.float64)[: interface.n_unknowns])
        self.fineness = 2 * lcm(*(place.denominator for place in places))
        self.scale = scale * self.fineness
        self.nodes = [(x * self.fineness, y * self.fineness) for x, y in zip(values[::2], values[1::2], strict=True)]
        self.slave = interface.slave.segments.tolist()
        self.master = interface.master.segments.tolist()
        self.neighbours = interface.master.neighbours.tolist()

    def point(self, segment: int, c: Fraction) -> _Point:
        (ax, ay), (bx, by) = (self.nodes[node] for node in self.slave[segment])
        towards = int((1 + c) / 2 * self.fineness)
        away = self.fineness - towards
        return (away * ax + towards * bx) // self.fineness, (away * ay + towards * by) // self.fineness

    def ends(self, segment: int) -> tuple[_Point, _Point]:
        return self.nodes[self.master[segment][0]], self.nodes[self.master[segment][1]]

    def direction(self, segment: int) -> _Point:
        return _from(*self.ends(segment))

    def nearest(self, point: _Point) -> Projection:
        ranked = []
        for segment in range(len(self.master)):
            first, second = self.ends(segment)
            along = self.direction(segment)
            squared = _dot(along, along)
            foot = _dot(_from(first, point), along)
            if 0 < foot < squared:
                distance = Fraction(_cross(along, _from(first, point)) ** 2, squared)
                ranked.append((distance, Fraction(0), segment))
            else:
                past, end = (-foot, first) if foot <= 0 else (foot - squared, second)
                distance = Fraction(_dot(_from(end, point), _from(end, point)))
                ranked.append((distance, Fraction(past * past, squared), segment))
        best, overshoot, segment = min(ranked)
        along, from_first = self.direction(segment), _from(self.ends(segment)[0], point)
        gap = -_cross(along, from_first)  # times the segment's length
        return Projection(
            segment=segment,
            xi=Fraction(_dot(from_first, along), _dot(along, along)),
            squared_distance=best / self.scale**2,
            signed_squared_gap=Fraction(gap * abs(gap), _dot(along, along)) / self.scale**2,
            tied=tuple(index for distance, _, index in ranked if distance == best),
            undecided=tuple(index for distance, past, index in ranked if (distance, past) == (best, overshoot)),
        )


def _from(a: _Point, b: _Point) -> _Point:
    return b[0] - a[0], b[1] - a[1]


def _dot(a: _Point, b: _Point) -> int:
    return a[0] * b[0] + a[1] * b[1]


def _cross(a: _Point, b: _Point) -> int:
    return a[0] * b[1] - a[1] * b[0]


def projection_cases(interface: Interface, z: FloatArray, n: int = 2) -> Counter[str]:
    """How the areas of competence of the virtual slave nodes c = −1 + (2k+1)/n fall on the master; small meshes only.

    Keys: "one segment"; the roles "first", "intermediate", "last" of segments where there are several;
    "node exactly hit" by a foot; "beyond an end"; "convex vertex" and "concave vertex" inside an area; "edge-on",
    before a segment seen edge-on or from behind, where the walk stops; "turned away", where nothing is covered.
    """
    found: Counter[str] = Counter()
    half = Fraction(1, n)
    centres = [-1 + (2 * k + 1) * half for k in range(n)]
    exact = _Exact(interface, z, [*centres, *(c - half for c in centres), *(c + half for c in centres)])
    for slave_segment in range(len(exact.slave)):
        for c in centres:
            found.update(_cases_at(exact, slave_segment, c, half))
    return found


def _cases_at(exact: _Exact, slave_segment: int, c: Fraction, half: Fraction) -> Iterator[str]:
    home = exact.nearest(exact.point(slave_segment, c))
    along = exact.direction(home.segment)
    low = _dot(exact.point(slave_segment, c + half), along)  # P, nearer the slave segment's second node
    high = _dot(exact.point(slave_segment, c - half), along)  # Q
    if low >= high:
        yield "turned away"
        return
    if home.xi in (0, 1):
        yield "node exactly hit"
    elif not 0 < home.xi < 1 and exact.neighbours[home.segment][int(home.xi > 1)] < 0:
        yield "beyond an end"
    covered = [home.segment]
    for side, sign, end in ((0, -1, low), (1, 1, high)):
        segment = home.segment
        while True:
            node = sign * _dot(exact.nodes[exact.master[segment][side]], along)
            if sign * end == node:
                yield "node exactly hit"
            if sign * end <= node:
                break
            following = exact.neighbours[segment][side]
            if following < 0 or following in covered:
                yield "beyond an end"
                break
            if _dot(exact.direction(following), along) <= 0:
                yield "edge-on"
                break
            turn = sign * _cross(exact.direction(segment), exact.direction(following))
            if turn:
                yield "convex vertex" if turn > 0 else "concave vertex"
            covered.append(following)
            segment = following
    if len(covered) == 1:
        yield "one segment"
    else:
        yield from ("first", "last", *["intermediate"] * (len(covered) - 2))


def usual_places(interface: Interface) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """Contact points to ask about where a plugin names none: nodes, quarter points, middles of the slave segments.

    Returns (slave_segment, c, area_from, area_to), each (5 n_segments,): quarter points with the half of the segment
    around them as area of competence, the others with none (NaN).
    """
    places = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    count = len(interface.slave)
    area = np.where(np.abs(places) == 0.5, 0.5, np.nan)
    slave_segment = np.repeat(np.arange(count), len(places))
    return slave_segment, np.tile(places, count), np.tile(places - area, count), np.tile(places + area, count)


def kink_margin(
    interface: Interface,
    z: FloatArray,
    slave_segment: ArrayLike,
    c: ArrayLike,
    area_from: ArrayLike | None = None,
    area_to: ArrayLike | None = None,
) -> float:
    """How far every node may move, at least, before a method of the node-to-segment kind decides anything else.

    Parameters
    ----------
    z : (n_unknowns,) current positions, flat.
    slave_segment, c : (n_points,) the contact points; −1 or NaN is no point.
    area_from, area_to : (n_points,) ends of their areas of competence, as `c`; NaN or None where there is none. One
        exactly at the node where the walk must stop was cut there by the formulation, which is no decision.

    Returns
    -------
    A length r ≥ 0. As long as no node moves by more than r: the same master segment is nearest to each point, its gap
    keeps its sign, its foot stays on its side of a free end (and of 1e-2 segments past it), and the walk from that
    segment to the ends of the area crosses the same nodes. Never more than ℓ/8, ℓ the shortest master segment.

    How: points are convex combinations of nodes, so a difference d of two places changes by 2r, and the tangent of a
    segment of length l turns by at most 1.05 (2r/l) while r ≤ l/8. Thus d·t changes by less than 3r (1 + |d|/l), and
    each decision of that form gets the margin |d·t| / 3(1 + |d|/l). The same with the bisector at a vertex v, whose
    direction is the mean of two, so that 1/l is the mean of both; gaps with |d| replaced by the overshoot of the foot,
    since a line moves by r (1 + 2 overshoot/l) there. For other pairs of segments a quarter of the difference of the
    distances, which changes by 4r. The bound is conservative, by a factor of 2 or so; it is computed in floats and
    means nothing below roundoff, some u X.
    """
    nodes = np.asarray(z, dtype=np.float64)[: interface.n_unknowns].reshape(-1, 2)
    there = (np.asarray(slave_segment) >= 0) & np.isfinite(c)
    carriers = nodes[interface.slave.segments[np.asarray(slave_segment)[there]]]  # (n_points, 2 ends, dim)
    line = _Line.of(interface.master, nodes)
    margin = float(line.length.min()) / 8
    points = _at(carriers, np.asarray(c, dtype=np.float64)[there])
    rows = max(1, _PAIRS_AT_ONCE // len(interface.master))
    home = np.empty(len(points), dtype=np.int64)
    for start in range(0, len(points), rows):
        part = slice(start, start + rows)
        home[part], least = _nearest_margin(line, points[part])
        margin = min(margin, least)
    if area_from is not None and area_to is not None:
        high, low = (_at(carriers, np.asarray(end, dtype=np.float64)[there]) for end in (area_from, area_to))
        ours = np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1)
        margin = min(margin, _area_margin(line, home[ours], low[ours], high[ours]))
    return max(margin, 0.0)


@dataclass(frozen=True, slots=True)
class _Line:
    """The master in floats; axes are those of a surface's segments."""

    first: FloatArray  # (n_segments, dim), as the second ends and the tangents
    second: FloatArray
    length: FloatArray  # (n_segments,)
    tangent: FloatArray
    neighbours: IntArray

    @classmethod
    def of(cls, master: Surface, nodes: FloatArray) -> _Line:
        first, second = nodes[master.segments[:, 0]], nodes[master.segments[:, 1]]
        length = np.hypot(*(second - first).T)
        tangent = (second - first) / length[:, None]
        return cls(first, second, length, tangent, master.neighbours)


def _at(carriers: FloatArray, c: FloatArray) -> FloatArray:
    share = ((1 + c) / 2)[:, None]
    points: FloatArray = (1 - share) * carriers[:, 0] + share * carriers[:, 1]
    return points


def _dots(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def _margin(difference: FloatArray, tangent: FloatArray, inverse_length: FloatArray) -> FloatArray:
    """|d·t| / 3(1 + |d|/l)."""
    size = np.hypot(difference[..., 0], difference[..., 1])
    margin: FloatArray = np.abs(_dots(difference, tangent)) / (3 * (1 + size * inverse_length))
    return margin


def _distances(line: _Line, points: FloatArray) -> tuple[FloatArray, IntArray]:
    """Distances (n_points, n_segments) to the closed segments, and the nearest, ties by overshoot and number."""
    dx, dy = (points[:, None, k] - line.first[:, k] for k in (0, 1))
    ex, ey = (points[:, None, k] - line.second[:, k] for k in (0, 1))
    foot = dx * line.tangent[:, 0] + dy * line.tangent[:, 1]
    gap = dx * line.tangent[:, 1] - dy * line.tangent[:, 0]
    before, behind = foot <= 0, foot >= line.length
    distance = np.where(before, np.hypot(dx, dy), np.where(behind, np.hypot(ex, ey), np.abs(gap)))
    overshoot = np.maximum(np.maximum(-foot, foot - line.length), 0.0)
    least = distance.min(axis=1, keepdims=True)
    overshoot[distance > least * (1 + 64 * UNIT_ROUNDOFF)] = np.inf
    home: IntArray = overshoot.argmin(axis=1)
    return distance, home


def _nearest_margin(line: _Line, points: FloatArray) -> tuple[IntArray, float]:
    """The nearest segments (n_points,) and the least margin of: which is nearest, the gap's sign, free ends."""
    distance, home = _distances(line, points)
    rows = np.arange(len(points))
    own = distance[rows, home]
    length, inverse, tangent = line.length[home], 1 / line.length[home], line.tangent[home]
    difference = points - line.first[home]
    foot, gap = _dots(difference, tangent), _dots(difference, tangent[:, ::-1] * [1, -1])
    overshoot = np.maximum(np.maximum(-foot, foot - length), 0.0)
    least = float((np.abs(gap) / (3 * (1 + overshoot * inverse))).min(initial=np.inf))
    by_distance = (distance - own[:, None]) / 4
    by_distance[rows, home] = np.inf
    for side, vertex, far in ((0, line.first, line.second), (1, line.second, line.first)):
        other = line.neighbours[home, side]
        outward = points - vertex[home]
        free = other < 0
        for past in (0.0, _SNAP):
            end = outward[free] + (1 if side == 0 else -1) * past * (length[:, None] * tangent)[free]
            least = min(least, float(_margin(end, tangent[free], inverse[free]).min(initial=np.inf)))
        mean = tangent + line.tangent[other]
        size = np.hypot(*mean.T)
        steep = (inverse + 1 / line.length[other]) / 2
        with np.errstate(divide="ignore", invalid="ignore"):
            bisector = np.minimum(_margin(outward, mean / size[:, None], steep), size / (6 * steep))
            inside = (1 if side == 1 else -1) * _dots(points - far[home], tangent)
        # The bisector decides as long as the foot stays clear of the other end.
        clear = np.where(inside > 0, _margin(points - far[home], tangent, inverse), 0.0)
        by_vertex = np.minimum(np.where(size > 0, bisector, 0.0), clear)
        at = (rows[~free], other[~free])
        twice = (line.neighbours[home, 0] == line.neighbours[home, 1])[~free]  # a chain of two, closed: both vertices
        by_distance[at] = np.where(twice, by_distance[at], np.maximum(by_distance[at], by_vertex[~free]))
    return home, min(least, float(by_distance.min(initial=np.inf)))


def _area_margin(line: _Line, home: IntArray, low: FloatArray, high: FloatArray) -> float:
    """The least margin of the decisions on the way from the nearest segments to the ends of the areas."""
    tangent, inverse = line.tangent[home], 1 / line.length[home]
    roundoff = 64 * UNIT_ROUNDOFF * np.abs(line.first).max()
    turned: BoolArray = _dots(high - low, tangent) <= 0
    least = float(_margin(high - low, tangent, inverse).min(initial=np.inf))
    for side, sign, end, nodes in ((0, -1, low, line.first), (1, 1, high, line.second)):
        going, segment = np.flatnonzero(~turned), home[~turned]
        while len(going):
            frame, step, following = tangent[going], end[going] - nodes[segment], line.neighbours[segment, side]
            past, along = sign * _dots(step, frame), line.second[following] - line.first[following]
            facing = (following >= 0) & (_dots(along, frame) > 0)
            cut = ~facing & (np.abs(past) <= roundoff)
            least = min(least, float(_margin(step, frame, inverse[going])[~cut].min(initial=np.inf)))
            seen = (cut | (past > 0)) & (following >= 0)
            least = min(least, float(_margin(along, frame, inverse[going])[seen].min(initial=np.inf)))
            onward = facing & (past > 0) & (following != home[going])
            going, segment = going[onward], following[onward]
    return least
