"""Contact by construction: half of a slave segment lies over the master, and below it.

A formulation looks for contact at nodes, at points inside segments, or on whole segments. Half of a segment, from a
node to the middle, has points of all of them. A state that is in contact already stays as it is, so that cases go on
shrinking to one segment a side without any motion.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.strategies.panels import on_lattice
from contactverif.strategies.parts import ends_of

STEEPEST = 1e-3  # An edge seen at a smaller slope than this from a point counts as seen at this slope.
SMALLEST = 0.25  # The smallest factor for a slave, and the inverse of the largest.


def extend_line(line: FloatArray, slave: Sequence[float], room: float) -> FloatArray:
    """Return the broken line (n, 2), from 0 to the right, long enough for half of the first or last slave segment.

    `slave` has the lengths of its segments; `room` is a length that is left free at the right end.
    """
    needed = max(slave[0], slave[-1]) / 2 + 2 * room
    if line[-1, 0] >= needed:
        return line
    return np.vstack([line, [needed + room, line[-1, 1]]])


def covered_start(start: float, slave: Sequence[float], width: float) -> float:
    """Return where a slave of these lengths starts so that half of one of its segments lies between 0 and `width`.

    Half of its first or last segment fits into the width. The start stays if half of some segment is covered there.
    """
    x = start + ends_of(slave)
    if any(True for _ in _covered_halves(x, 0.0, width)):
        return start
    if start >= 0:
        return min(start, width - slave[0] / 2)
    total = float(sum(slave))
    return min(max(start, slave[-1] / 2 - total), width - total)


def sink_below(slave: FloatArray, line: FloatArray, depth: float) -> FloatArray:
    """Return the slave (n, 2), lowered as a whole until half of a segment is below the line (m, 2) by `depth` or more.

    Both run from left to right.
    """
    heights = []
    for left, right in _covered_halves(slave[:, 0], line[0, 0], line[-1, 0]):
        places = np.array([left, right, *line[(line[:, 0] > left) & (line[:, 0] < right), 0]])
        heights.append(float((np.interp(places, *slave.T) - np.interp(places, *line.T)).max()))
    lift = min(heights, default=-depth) + depth
    if lift <= 0:
        return slave
    return slave - [0.0, float(on_lattice(np.array(lift + 2.0**-20)))]


def radial_factor(slave: FloatArray, polygon: FloatArray, depth: float, *, outside: bool, closed: bool) -> float:
    """Return the factor for the distances of the slave (n, 2) from the origin by which half of a segment penetrates.

    The master's polygon (m, 2) is convex and runs counter-clockwise; its body is outside of it, or inside. The factor
    is 1 if half of a segment penetrates by `depth` already, or none can; else above 1 outside, and below 1 inside.
    """
    last = None if closed else -1
    begin, along = polygon[:last], (np.roll(polygon, -1, axis=0) - polygon)[:last]
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    heights = np.einsum("ij,ij->i", normals, begin)  # The distances of the edges from the centre.
    first, second = slave[:last], np.roll(slave, -1, axis=0)[:last]
    shares = np.array([[1.0, 0.75, 0.5], [0.5, 0.25, 0.0]])[..., None, None]  # Node, point between and middle.
    points = shares * first + (1 - shares) * second  # (half, place, segment, 2)
    radius = float(np.hypot(*polygon.T).max())
    toward = np.maximum(points @ normals.T, radius * STEEPEST)  # (half, place, segment, edge)
    if outside:  # A point is in the body if it is beyond one edge.
        factor = float(((heights + depth) / toward).min(axis=3).max(axis=1).min())
        return factor if 1 < factor < 1 / SMALLEST else 1.0
    factor = float(((heights - depth) / toward).min(axis=3).min(axis=1).max())
    return factor if SMALLEST < factor < 1 else 1.0  # A polygon beside the centre may have no place for a segment.


def _covered_halves(x: FloatArray, begin: float, end: float) -> Iterator[tuple[float, float]]:
    """Yield both halves of each segment between ascending places that lie between `begin` and `end`."""
    for left, right in zip(x[:-1].tolist(), x[1:].tolist(), strict=True):
        middle = (left + right) / 2
        for half in ((left, middle), (middle, right)):
            if begin <= half[0] and half[1] <= end:
                yield half
