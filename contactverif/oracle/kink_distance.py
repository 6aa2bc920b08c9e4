"""A bound, in floats, on the distance of a state to the nearest kink.

Rule for the next editor: the bound must be conservative, since a case within it is undecided and one beyond it is
judged. The derivation is in `kink_margin`; a new decision of formulations needs a margin of its own.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface

_PAIRS_AT_ONCE = 2**18  # The number of pairs of points and master segments in memory at once.
_SNAP = 1e-2  # Formulations may still see contact past a free end by this share of the segment.


def default_points(interface: Interface) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """Return contact points for plugins that name none: nodes, quarter points and middles of the slave segments.

    They are `slave_segment`, `c`, `area_from` and `area_to` (n_points,), five points a segment. The area of competence
    of a quarter point is its half of the segment; its ends are NaN for other points.
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
    """Return how far every node may move, at least, before a formulation of the node-to-segment kind decides otherwise.

    That is a length r ≥ 0. As long as no node moves by more than r, the same master segment is nearest to each point,
    its gap keeps its sign, its foot stays on its side of a free end (and of 1e-2 segments past it), and the walk from
    that segment to the ends of the area crosses the same nodes. Never more than ℓ/8, with ℓ the shortest master
    segment.

    Points and ends of areas of competence are (n_points,); −1, NaN or None is no point and no area. An end exactly at
    the node where the walk must stop was cut there by the formulation, which is no decision.

    Points are convex combinations of nodes, so a difference d of two places changes by 2r, and the tangent of a segment
    of length l turns by at most 1.05 (2r/l) while r ≤ l/8. Thus d·t changes by less than 3r (1 + |d|/l), and each
    decision of that form gets the margin |d·t| / 3(1 + |d|/l). The bisector at a vertex, whose direction is the mean of
    two, has the mean of both 1/l. For gaps the overshoot of the foot replaces |d|, since a line moves by r (1 + 2
    overshoot/l) there. Other pairs of segments get a quarter of the difference of the distances, which changes by 4r.
    """
    nodes = np.asarray(z, dtype=np.float64)[: interface.n_unknowns].reshape(-1, 2)
    valid = (np.asarray(slave_segment) >= 0) & np.isfinite(c)
    carriers = nodes[interface.slave.segments[np.asarray(slave_segment)[valid]]]  # (n_points, 2 ends, dim)
    first, second = (nodes[interface.master.segments[:, end]] for end in (0, 1))
    length = np.hypot(*(second - first).T)
    line = _Line(first, second, length, (second - first) / length[:, None], interface.master.neighbours)
    margin = float(line.length.min()) / 8
    points = _interpolate(carriers, np.asarray(c, dtype=np.float64)[valid])
    rows = max(1, _PAIRS_AT_ONCE // len(interface.master))
    home = np.empty(len(points), dtype=np.int64)
    for start in range(0, len(points), rows):
        part = slice(start, start + rows)
        home[part], least = _nearest_margin(line, points[part])
        margin = min(margin, least)
    if area_from is not None and area_to is not None:
        high, low = (_interpolate(carriers, np.asarray(end, dtype=np.float64)[valid]) for end in (area_from, area_to))
        whole = np.isfinite(low).all(axis=1) & np.isfinite(high).all(axis=1)
        margin = min(margin, _area_margin(line, home[whole], low[whole], high[whole]))
    return max(margin, 0.0)


class _Line(NamedTuple):
    """The segments of the master in floats."""

    first: FloatArray  # (n_segments, 2), as are the second ends and the tangents.
    second: FloatArray
    length: FloatArray  # (n_segments,)
    tangent: FloatArray
    neighbours: IntArray


def _interpolate(carriers: FloatArray, c: FloatArray) -> FloatArray:
    """Return the points (n_points, dim) at c (n_points,) of segments with these end points (n_points, 2, dim)."""
    share = ((1 + c) / 2)[:, None]
    return (1 - share) * carriers[:, 0] + share * carriers[:, 1]


def _dots(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def _margin(difference: FloatArray, tangent: FloatArray, inverse_length: FloatArray) -> FloatArray:
    """Return the margin |d·t| / 3(1 + |d|/l) of a difference d, a tangent t and 1/l."""
    size = np.hypot(difference[..., 0], difference[..., 1])
    return np.abs(_dots(difference, tangent)) / (3 * (1 + size * inverse_length))


def _nearest_margin(line: _Line, points: FloatArray) -> tuple[IntArray, float]:
    """Return the nearest segments (n_points,) and the least margin of that choice, the gap's sign and free ends."""
    dx, dy = (points[:, None, k] - line.first[:, k] for k in (0, 1))  # (n_points, n_segments)
    ex, ey = (points[:, None, k] - line.second[:, k] for k in (0, 1))
    feet = dx * line.tangent[:, 0] + dy * line.tangent[:, 1]
    gaps = dx * line.tangent[:, 1] - dy * line.tangent[:, 0]
    beyond = np.where(feet >= line.length, np.hypot(ex, ey), np.abs(gaps))
    distance = np.where(feet <= 0, np.hypot(dx, dy), beyond)
    past = np.maximum(np.maximum(-feet, feet - line.length), 0.0)
    past[distance > distance.min(axis=1, keepdims=True) * (1 + 64 * UNIT_ROUNDOFF)] = np.inf
    rows, home = np.arange(len(points)), past.argmin(axis=1)
    length, inverse, tangent = line.length[home], 1 / line.length[home], line.tangent[home]
    least = float((np.abs(gaps[rows, home]) / (3 * (1 + past[rows, home] * inverse))).min(initial=np.inf))
    by_distance = (distance - distance[rows, home, None]) / 4
    by_distance[rows, home] = np.inf
    for side, vertex, far in ((0, line.first, line.second), (1, line.second, line.first)):
        other = line.neighbours[home, side]
        outward = points - vertex[home]
        free = other < 0
        for share in (0.0, _SNAP):
            end = outward[free] + (1 if side == 0 else -1) * share * (length[:, None] * tangent)[free]
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
        twice = (line.neighbours[home, 0] == line.neighbours[home, 1])[~free]  # A closed chain of two.
        by_distance[at] = np.where(twice, by_distance[at], np.maximum(by_distance[at], by_vertex[~free]))
    return home, min(least, float(by_distance.min(initial=np.inf)))


def _area_margin(line: _Line, home: IntArray, low: FloatArray, high: FloatArray) -> float:
    """Return the least margin of the decisions on the way from the nearest segments to the ends of the areas."""
    tangent, inverse = line.tangent[home], 1 / line.length[home]
    roundoff = 64 * UNIT_ROUNDOFF * np.abs(line.first).max()
    turned: BoolArray = _dots(high - low, tangent) <= 0
    least = float(_margin(high - low, tangent, inverse).min(initial=np.inf))
    for end, nodes in ((high, line.first), (low, line.second)):  # Does the whole area lie past an end of the segment?
        least = min(least, float(_margin(end - nodes[home], tangent, inverse).min(initial=np.inf)))
    for side, sign, end, nodes in ((0, -1, low, line.first), (1, 1, high, line.second)):
        going, segment = np.flatnonzero(~turned), home[~turned]
        while len(going):
            frame, step, following = tangent[going], end[going] - nodes[segment], line.neighbours[segment, side]
            past, along = sign * _dots(step, frame), line.second[following] - line.first[following]
            facing = (following >= 0) & (_dots(along, frame) > 0)
            cut = ~facing & (np.abs(past) <= roundoff)
            least = min(least, float(_margin(step, frame, inverse[going])[~cut].min(initial=np.inf)))
            visible = (cut | (past > 0)) & (following >= 0)
            least = min(least, float(_margin(along, frame, inverse[going])[visible].min(initial=np.inf)))
            onward = facing & (past > 0) & (following != home[going])
            going, segment = going[onward], following[onward]
    return least
