"""The nearest segment to one point after another along a chain: the search starts where the last one ended.

Neighbours on the slave face neighbours on the master. So the last answer is nearly always the next one, or close to it.
From there the search climbs the tree of boxes, and opens what may hold a segment as near as the nearest so far.

It returns exactly what `projection.nearest_segment` returns, for any start:

- Segments count as level if their squared distances differ by less than `LEVEL`. What `is_nearer` calls a tie is far
  within that. No box is left out that may hold a segment level with the nearest one.
- If one segment is level with no other, it is nearer than each of them, in whichever order they are looked at.
- If two are level, and each order of looking at them chooses the same one, that one is the answer.
- In all other cases `nearest_segment` itself is asked.

Rule for the next editor: whatever is faster must keep these four sentences true.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.geometry.compiled import compile_inline, constant
from contactverif.geometry.projection import (
    LEAF,
    PointOnSegment,
    Vector,
    arm,
    distance_to_box,
    distance_to_segment,
    is_nearer,
    minus,
    nearest_place,
    node,
)

NO_PLACE = constant(-1)  # There is no last answer.
# Relative. It is far above the 16u of a tie of `is_nearer` and the rounding of squared distances, and so small that the
# search from the root is seldom asked. No answer depends on it, only the time.
LEVEL = 1e-9


class Nearest(NamedTuple):
    """The two nearest segments so far, by their places in the order of the tree, and the distance of the third."""

    place: int
    distance: float  # squared
    past: float
    second_place: int
    second_distance: float
    second_past: float
    third_distance: float


@compile_inline
def is_next(slave: IntArray, before: int, segment: int) -> bool:
    """Return whether a segment is the one before or follows it in a chain, so that a search may start at its answer."""
    return segment == before or slave[segment, 0] == slave[before, 1]


@compile_inline
def nearest_place_from(
    last: int, v: PointOnSegment, x: FloatArray, segments: IntArray, order: IntArray, boxes: FloatArray
) -> int:
    """Return the place in `order` of the segment that `projection.nearest_segment` returns for a point.

    `last` is the place of any segment, best of one nearby; NO_PLACE if there is none.
    """
    if last == NO_PLACE:
        return nearest_place(v, x, segments, order, boxes)
    origin = v.a if v.c <= 0 else v.b
    p = arm(origin, v)
    best = Nearest(NO_PLACE, np.inf, np.inf, NO_PLACE, np.inf, np.inf, np.inf)
    best = _look_at(best, last, origin, p, x, segments, order)
    n_leaves = len(boxes) // 2
    top = n_leaves + last // LEAF  # The subtree of this box is looked through.
    best = _look_at_leaf(best, top, n_leaves, last, origin, p, x, segments, order)
    while top > 1:
        best = _look_below(best, top ^ 1, n_leaves, last, origin, p, x, segments, order, boxes)
        top >>= 1
    place = _decide(best, order)
    return place if place != NO_PLACE else nearest_place(v, x, segments, order, boxes)


@compile_inline
def _look_below(
    best: Nearest,
    top: int,
    n_leaves: int,
    last: int,
    origin: Vector,
    p: Vector,
    x: FloatArray,
    segments: IntArray,
    order: IntArray,
    boxes: FloatArray,
) -> Nearest:
    """Return the nearest segments so far, after a look at all below the box `top` that may be level with the first."""
    box = top
    while True:
        if distance_to_box(origin, p, boxes[box]) <= (1 + LEVEL) * best.distance:
            if box < n_leaves:  # down to the first half
                box = 2 * box
                continue
            best = _look_at_leaf(best, box, n_leaves, last, origin, p, x, segments, order)
        while box != top and box & 1:  # up from second halves
            box >>= 1
        if box == top:
            return best
        box += 1  # on to the second half


@compile_inline
def _decide(best: Nearest, order: IntArray) -> int:
    """Return the place of the nearest segment, or NO_PLACE where the order of looking at them might matter."""
    place, d_1, past_1, second, d_2, past_2, d_3 = best
    level = (1 + LEVEL) * d_1
    if place == NO_PLACE or d_3 <= level:
        return NO_PLACE
    if d_2 > level:
        return place
    first_wins = is_nearer(d_1, past_1, order[place], d_2, past_2, order[second])
    second_wins = is_nearer(d_2, past_2, order[second], d_1, past_1, order[place])
    if first_wins == second_wins:
        return NO_PLACE
    return place if first_wins else second


@compile_inline
def _look_at_leaf(
    best: Nearest,
    box: int,
    n_leaves: int,
    last: int,
    origin: Vector,
    p: Vector,
    x: FloatArray,
    segments: IntArray,
    order: IntArray,
) -> Nearest:
    """Return the nearest segments so far, after a look at those of a leaf but the one at the place `last`."""
    start = (box - n_leaves) * LEAF
    for place in range(start, min(start + LEAF, len(order))):
        segment = order[place]
        if segment < 0 or place == last:  # padding, or seen before
            continue
        x_1, x_2 = node(x, segments[segment, 0]), node(x, segments[segment, 1])
        if _least_distance(origin, p, x_1, x_2) <= (1 + LEVEL) * best.distance:
            best = _look_at(best, place, origin, p, x, segments, order)
    return best


@compile_inline
def _look_at(
    best: Nearest, place: int, origin: Vector, p: Vector, x: FloatArray, segments: IntArray, order: IntArray
) -> Nearest:
    """Return the nearest segments so far, after a look at the one at a place."""
    segment = order[place]
    x_1, x_2 = node(x, segments[segment, 0]), node(x, segments[segment, 1])
    distance, past = distance_to_segment(origin, p, x_1, x_2)
    first, d_1, past_1, second, d_2, past_2, d_3 = best
    if distance < d_1:
        return Nearest(place, distance, past, first, d_1, past_1, d_2)
    if distance < d_2:
        return Nearest(first, d_1, past_1, place, distance, past, d_2)
    return Nearest(first, d_1, past_1, second, d_2, past_2, min(d_3, distance))


@compile_inline
def _least_distance(origin: Vector, p: Vector, x_1: Vector, x_2: Vector) -> float:
    """Return the squared distance of origin + p to the box of the segment 1 2, a little less than exact."""
    first, second = minus(x_1, origin), minus(x_2, origin)
    dx = max(min(first[0], second[0]) - p[0], 0.0, p[0] - max(first[0], second[0]))
    dy = max(min(first[1], second[1]) - p[1], 0.0, p[1] - max(first[1], second[1]))
    return (dx * dx + dy * dy) * (1 - LEVEL / 2)
