"""Find the segments that may lie in a strip over a slave segment, by the tree of boxes of `search_tree`.

The strip holds all that the slave segment sees within a distance `reach`, on either side. A box is opened if it may
meet the strip. So the result holds all segments that meet it, and others whose leaf of the tree does.

Rules for the next editor:

1. A doubt of some roundings keeps a box. No segment in the strip may be lost.
2. Nothing is allocated here. The segments come in the reverse order of their chains, which is that of the slave.
"""

from __future__ import annotations

from typing import NamedTuple

from contactverif.compiler import compile_inline, compile_part
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.geometry.projection import Vector, minus
from contactverif_mortar.cell_geometry import SlaveView

AHEAD = 8  # A region reaches so many strips ahead.
LEAF = 4  # The number of segments in a leaf of `search_tree`.


class Strip(NamedTuple):
    """The strip over a slave segment a b, with directions n_a and n_b at its ends."""

    a: Vector
    b: Vector
    n_a: Vector
    n_b: Vector
    reach: float
    low: Vector  # The box around the strip, measured from a.
    high: Vector
    straight: bool  # n_a and n_b are the normal of the segment.


@compile_part
def make_strip(view: SlaveView, reach: float) -> Strip:
    """Return the strip over a slave segment."""
    a, b, n_a, n_b, straight = view
    d = minus(b, a)
    wide = (reach, reach)
    if straight:
        wide = (reach * abs(n_a[0]), reach * abs(n_a[1]))
    doubt = 16 * UNIT_ROUNDOFF * (reach + abs(d[0]) + abs(d[1]))
    low = (min(d[0], 0.0) - wide[0] - doubt, min(d[1], 0.0) - wide[1] - doubt)
    high = (max(d[0], 0.0) + wide[0] + doubt, max(d[1], 0.0) + wide[1] + doubt)
    return Strip(a, b, n_a, n_b, reach, low, high, straight)


class Region(NamedTuple):
    """A rectangle, and the smallest box of the tree that holds all segments which meet it.

    The strips of slave segments that follow each other lie in one region, so that a search for them begins there and
    not with the box of all segments.
    """

    origin: Vector  # A node nearby.
    low: Vector  # Corners of the rectangle, measured from the origin.
    high: Vector
    box: int


@compile_inline
def holds(region: Region, strip: Strip) -> bool:
    """Return whether a strip lies in a region, by more than roundoff."""
    d = minus(strip.a, region.origin)
    doubt = 16 * UNIT_ROUNDOFF * (abs(d[0]) + abs(d[1]) + strip.reach)
    for axis in range(2):
        if (
            d[axis] + strip.low[axis] - doubt < region.low[axis]
            or d[axis] + strip.high[axis] + doubt > region.high[axis]
        ):
            return False
    return True


@compile_part
def make_region(strip: Strip, boxes: FloatArray) -> Region:
    """Return the region that is `AHEAD` times as large as the box around a strip, on each side of it.

    One goes down the tree as long as one half of the box alone meets the rectangle.
    """
    around = AHEAD * max(strip.high[0] - strip.low[0], strip.high[1] - strip.low[1])
    low = (strip.low[0] - around, strip.low[1] - around)
    high = (strip.high[0] + around, strip.high[1] + around)
    box, n_leaves = 1, len(boxes) // 2
    while box < n_leaves:
        near = _in_rectangle(strip.a, low, high, boxes[2 * box])
        far = _in_rectangle(strip.a, low, high, boxes[2 * box + 1])
        if near == far:
            break
        box = 2 * box if near else 2 * box + 1
    return Region(strip.a, low, high, box)


@compile_inline
def _in_rectangle(origin: Vector, low: Vector, high: Vector, box: FloatArray) -> bool:
    """Return whether a box meets a rectangle; `holds` leaves room for the roundoff of both."""
    for axis in range(2):
        if box[axis] - origin[axis] > high[axis] or box[2 + axis] - origin[axis] < low[axis]:
            return False
    return True


@compile_inline
def collect_segments(
    strip: Strip, begin: int, order: IntArray, boxes: FloatArray, waiting: IntArray, members: IntArray
) -> int:
    """Write the segments below a box that may meet the strip into `members`, and return how many there are.

    The cost is O(log n) for each of them, n the number of segments below the box `begin`. `order` and `boxes` are those
    of `search_tree`, `waiting` (64,) is room for the boxes still to open, and `members` has room for all segments.
    """
    n_leaves = len(boxes) // 2
    count, n_waiting = 0, 1
    waiting[0] = begin
    while n_waiting > 0:
        n_waiting -= 1
        box = waiting[n_waiting]
        if not _meets(strip, boxes[box, 0], boxes[box, 1], boxes[box, 2], boxes[box, 3]):
            continue
        if box < n_leaves:
            waiting[n_waiting], waiting[n_waiting + 1] = 2 * box, 2 * box + 1
            n_waiting += 2
            continue
        start = (box - n_leaves) * LEAF
        for place in range(min(start + LEAF, len(order)) - 1, start - 1, -1):
            if order[place] >= 0:  # no padding
                members[count] = order[place]
                count += 1
    return count


@compile_part
def _meets(strip: Strip, low_x: float, low_y: float, high_x: float, high_y: float) -> bool:
    """Return whether a box may meet the strip. An empty box, from infinity to minus infinity, meets nothing."""
    a, b, n_a, n_b, reach, low, high, straight = strip
    a_low, a_high = minus((low_x, low_y), a), minus((high_x, high_y), a)
    if a_low[0] > high[0] or a_low[1] > high[1] or a_high[0] < low[0] or a_high[1] < low[1]:
        return False
    b_low, b_high = minus((low_x, low_y), b), minus((high_x, high_y), b)
    size = max(abs(a_low[0]), abs(a_low[1]), abs(a_high[0]), abs(a_high[1]))
    size = max(reach, size, abs(b_low[0]), abs(b_low[1]), abs(b_high[0]), abs(b_high[1]))
    doubt = 16 * UNIT_ROUNDOFF * size
    # n × d, d from a or b to a corner: the largest is negative behind a, the smallest positive before b.
    if max(n_a[0] * a_low[1], n_a[0] * a_high[1]) + max(-n_a[1] * a_low[0], -n_a[1] * a_high[0]) < -doubt:
        return False
    if min(n_b[0] * b_low[1], n_b[0] * b_high[1]) + min(-n_b[1] * b_low[0], -n_b[1] * b_high[0]) > doubt:
        return False
    if not straight:
        return True
    lowest = min(n_a[0] * a_low[0], n_a[0] * a_high[0]) + min(n_a[1] * a_low[1], n_a[1] * a_high[1])
    highest = max(n_a[0] * a_low[0], n_a[0] * a_high[0]) + max(n_a[1] * a_low[1], n_a[1] * a_high[1])
    return lowest <= reach + doubt and highest >= -reach - doubt
