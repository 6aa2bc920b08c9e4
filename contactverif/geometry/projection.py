"""Compiled geometry that plugins may use: frames of segments, and the nearest segment to a point.

A vector is a pair of scalars, real or complex, so that a complex step passes through. A surface is searched by a tree
of boxes (`search_tree`) at a cost of O(log n) for each point.

Take differences of nodes first, interpolate afterwards. The difference of two nearby nodes is exact, or rounded in its
own last bit. A point inside a segment is rounded in the last bit of its distance from the origin, and a node that is
subtracted afterwards leaves that error behind. With coordinates near 1e6, segments near 1 and a penetration of 1e-6,
the rounded point is wrong by 1e-10 and the gap by 1e-4 relative; from differences the gap is wrong by 1e-10 relative.
So a point here is a `PointOnSegment`: the two nodes and c, never a rounded position. `arm` returns the vector from a
node to it. From vectors of this kind an exact translation changes no bit of a gap, of a foot, or of a decision.

Neighbours on the slave face neighbours on the master. So `nearest_place_from` starts where the last search ended,
climbs the tree from there, and opens what may hold a segment as near as the nearest so far. It returns exactly what
`nearest_place` returns, for any start:

- Segments count as level if their squared distances differ by less than `LEVEL`. What `is_nearer` calls a tie is far
  within that. No box is left out that may hold a segment level with the nearest one.
- If one segment is level with no other, it is nearer than each of them, in whichever order they are looked at.
- If two are level, and each order of looking at them chooses the same one, that one is the answer.
- In all other cases `nearest_place` itself is asked.

Rules for the next editor:

1. No position enters a sum or a product, only a difference of two positions.
2. Whatever is faster must keep the four sentences above true.
3. The harness judges plugins by `contactverif.oracle`, which shares no code with this file, and so must it stay.
"""

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_kernel, compile_part, constant
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.interface import Surface

Vector = tuple[float, float]
Tree = tuple[IntArray, FloatArray]  # The segments along their chains, −1 for padding; the boxes of `_write_boxes`.
_Searched = tuple[FloatArray, IntArray, IntArray, FloatArray]  # Positions, segments, and a tree.

ZERO = (0.0, 0.0)
_ROOT, _NO_BIT, _NONE = constant(1), constant(0), constant(-1)
NO_PLACE = constant(-1)  # There is no last answer.
LEAF = 4  # The number of segments in a leaf of the tree.
# Relative. It is far above the 16u of a tie of `is_nearer` and the rounding of squared distances, and so small that the
# search from the root is seldom asked. No answer depends on it, only the time.
LEVEL = 1e-9


class PointOnSegment(NamedTuple):
    """A point on the segment a b that is not rounded: a at c = −1, b at c = +1. A node a is (a, a, −1.0)."""

    a: Vector
    b: Vector
    c: float


@compile_part
def node(x: FloatArray, number: int) -> Vector:
    """Return the position of a node, from x (n_nodes, 2)."""
    return x[number, 0], x[number, 1]


@compile_part
def minus(a: Vector, b: Vector) -> Vector:
    """Return a − b."""
    return a[0] - b[0], a[1] - b[1]


@compile_part
def plus(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return a[0] + b[0], a[1] + b[1]


@compile_part
def times(factor: float, a: Vector) -> Vector:
    """Return factor × a."""
    return factor * a[0], factor * a[1]


@compile_part
def dot(a: Vector, b: Vector) -> float:
    """Return a · b, without conjugation."""
    return a[0] * b[0] + a[1] * b[1]


@compile_part
def cross(a: Vector, b: Vector) -> float:
    """Return a × b = a_x b_y − a_y b_x.

    The gap of a point to the line 1 2 is (x_V − x_1) × (x_2 − x_1) / l. It has fewer roundings than (x_V − x_1)·n.
    """
    return a[0] * b[1] - a[1] * b[0]


@compile_part
def between(a: Vector, b: Vector, c: float) -> Vector:
    """Return the vector at c between two vectors: a at −1, b at +1. For a point of a segment use `arm`."""
    return (1 - c) / 2 * a[0] + (1 + c) / 2 * b[0], (1 - c) / 2 * a[1] + (1 + c) / 2 * b[1]


@compile_part
def arm(origin: Vector, point: PointOnSegment) -> Vector:
    """Return the vector from a node to a point of a segment: differences first, interpolated afterwards."""
    return between(minus(point.a, origin), minus(point.b, origin), point.c)


@compile_part
def frame(x1: Vector, x2: Vector) -> tuple[float, Vector, Vector]:
    """Return length, tangent and normal of a segment; the normal points out of the body, which lies on the left."""
    d = minus(x2, x1)
    length = np.sqrt(dot(d, d))
    t = (d[0] / length, d[1] / length)
    return length, t, (t[1], -t[0])


@compile_kernel
def _write_boxes(boxes: FloatArray, x: FloatArray, segments: IntArray, order: IntArray) -> None:
    """Write the boxes (n_boxes, 4) of a binary tree over the segments: low x, low y, high x, high y.

    Box 1 holds all segments, and box i is halved into 2i and 2i + 1. The second half of the list are the leaves.
    """
    n_leaves = len(boxes) // 2
    for box in range(len(boxes)):
        for axis in range(2):
            boxes[box, axis], boxes[box, 2 + axis] = np.inf, -np.inf
    for place in range(len(order)):
        if order[place] < 0:  # padding
            continue
        box = boxes[n_leaves + place // LEAF]
        for end in range(2):
            for axis in range(2):
                value = x[segments[order[place], end], axis]
                box[axis] = min(box[axis], value)
                box[2 + axis] = max(box[2 + axis], value)
    for parent in range(n_leaves - 1, 0, -1):
        for axis in range(2):
            boxes[parent, axis] = min(boxes[2 * parent, axis], boxes[2 * parent + 1, axis])
            boxes[parent, 2 + axis] = max(boxes[2 * parent, 2 + axis], boxes[2 * parent + 1, 2 + axis])


@compile_part
def distance_to_box(origin: Vector, p: Vector, box: FloatArray) -> float:
    """Return the squared distance of origin + p to a box, a little less than exact, so that roundoff loses no tie."""
    dx = max((box[0] - origin[0]) - p[0], 0.0, p[0] - (box[2] - origin[0]))
    dy = max((box[1] - origin[1]) - p[1], 0.0, p[1] - (box[3] - origin[1]))
    return float((dx * dx + dy * dy) * (1 - 64 * UNIT_ROUNDOFF))


@compile_part
def distance_to_segment(origin: Vector, p: Vector, x_1: Vector, x_2: Vector) -> tuple[float, float]:
    """Return the squared distance to the closed segment 1 2, and the length by which the foot lies past its end.

    `p` is the vector from the node `origin` to the point. All is measured from the nearer end of the segment. Where the
    foot lies at or past it, the distance is that to the end node itself, so that the two segments at a vertex tie
    exactly.
    """
    length, t, n = frame(x_1, x_2)
    d = minus(p, minus(x_1, origin))
    s = dot(d, t)
    past = -s
    if 2 * s > length:
        d = minus(p, minus(x_2, origin))
        past = dot(d, t)
    if past >= 0:
        return dot(d, d), past
    g = dot(d, n)
    return g * g, 0.0


@compile_part
def nearest_segment(v: PointOnSegment, x: FloatArray, segments: IntArray, order: IntArray, boxes: FloatArray) -> int:
    """Return the nearest closed segment to a point at x (n_nodes, 2), by the tree of `search_tree`.

    Of equally near segments it is the one whose end the foot passes least, then the one with the lowest number. The
    search costs O(log n) for a chain of n segments: it opens no box that is farther than the nearest segment so far.
    All vectors begin at the nearer end of the point's own segment, so an exact translation changes nothing.
    """
    place = nearest_place(v, x, segments, order, boxes)
    return int(order[place]) if place >= 0 else -1  # A position that is no number has no nearest segment.


@compile_part
def nearest_place(v: PointOnSegment, x: FloatArray, segments: IntArray, order: IntArray, boxes: FloatArray) -> int:
    """Return the place in `order` of the segment that `nearest_segment` returns, from the same arguments."""
    origin = v.a if v.c <= 0 else v.b
    p = arm(origin, v)
    n_leaves = len(boxes) // 2
    best, best_distance, best_past, best_place = _NONE, np.inf, np.inf, _NONE
    box, distance, waiting = _ROOT, 0.0, _NO_BIT
    while True:
        while box < n_leaves and distance <= best_distance:  # down to a leaf, the nearer box first
            box, distance = _nearer_half(box, origin, p, boxes)
            waiting = 2 * waiting + 1
        if distance <= best_distance:
            start = (box - n_leaves) * LEAF
            for place in range(start, min(start + LEAF, len(order))):
                segment = order[place]
                if segment >= 0:  # no padding
                    x_1, x_2 = node(x, segments[segment, 0]), node(x, segments[segment, 1])
                    distance, past = distance_to_segment(origin, p, x_1, x_2)
                    if is_nearer(distance, past, segment, best_distance, best_past, best):
                        best, best_distance, best_past, best_place = segment, distance, past, place
        if waiting == 0:
            return best_place
        box, waiting = _climb(box, waiting)
        distance = distance_to_box(origin, p, boxes[box])


@compile_inline
def _nearer_half(box: int, origin: Vector, p: Vector, boxes: FloatArray) -> tuple[int, float]:
    first, second = 2 * box, 2 * box + 1
    d_1, d_2 = distance_to_box(origin, p, boxes[first]), distance_to_box(origin, p, boxes[second])
    return (second, d_2) if d_2 < d_1 else (first, d_1)


@compile_inline
def _climb(box: int, waiting: int) -> tuple[int, int]:
    """Return the next box to open, and which are waiting then.

    The last bit of `waiting` says whether the other half beside a box waits, the bit before it the same of the box
    above, and so on.
    """
    while waiting & 1 == 0:
        box, waiting = box >> 1, waiting >> 1
    return box ^ 1, waiting - 1


@compile_part
def is_nearer(distance: float, past: float, segment: int, best_distance: float, best_past: float, best: int) -> bool:
    """Return whether a segment comes before the best one so far, by distance, then by `past`, then by number.

    Where the foot of one lies past a node, distances that differ by some roundings are equal: both are functions of the
    vector from the node to the point, and roundoff must not choose between the two segments at the node.
    """
    past_a_node = past > 0.0 or best_past > 0.0
    roundoff = 16 * UNIT_ROUNDOFF * distance if past_a_node else 0.0
    if abs(distance - best_distance) > roundoff:
        return distance < best_distance
    return past < best_past or (past == best_past and segment < best)


def search_tree(surface: Surface, x: FloatArray) -> Tree:
    """Return the tree by which `nearest_segment` searches a surface at x (n_nodes, 2); it costs O(n) to make."""
    order = _pad_chains(surface)
    boxes = np.empty((2 << max(0, (len(order) - 1) // LEAF).bit_length(), 4))
    _write_boxes(boxes, x, surface.segments, order)
    return order, boxes


def _pad_chains(surface: Surface) -> IntArray:
    """Return the chain order with −1 between chains, so that each chain has a subtree of its own.

    So a chain far away costs a search one look at its box, and the subtree of the near chain is what it would be alone.
    """
    order = surface.chain_order
    if len(surface.chain_starts) == 1:
        return order
    padded = np.full(0, -1, dtype=np.int64)
    for chain in np.split(order, surface.chain_starts[1:]):
        width = LEAF
        while width < len(chain):
            width *= 2
        start = -(-len(padded) // width) * width
        padded = np.concatenate([padded, np.full(start + width - len(padded), -1)])
        padded[start : start + len(chain)] = chain
    padded.setflags(write=False)  # as `chain_order` is: a kernel is compiled once for both
    return padded


@compile_part
def foot_on_surface(s: float, length: float, free_first: bool, free_second: bool, tolerance: float) -> bool:
    """Return whether a foot at s along its segment is past a free end by at most `tolerance` × the segment's length."""
    before = free_first and s < -tolerance * length
    behind = free_second and s - length > tolerance * length
    return not (before or behind)


@compile_inline
def is_next(slave: IntArray, before: int, segment: int) -> bool:
    """Return whether a segment is the one before or follows it in a chain, so that a search may start at its answer."""
    return segment == before or slave[segment, 0] == slave[before, 1]


class _Nearest(NamedTuple):
    """The two nearest segments so far, by their places in the order of the tree, and the distance of the third."""

    place: int
    distance: float  # squared
    past: float
    second_place: int
    second_distance: float
    second_past: float
    third_distance: float


@compile_inline
def nearest_place_from(
    last: int, v: PointOnSegment, x: FloatArray, segments: IntArray, order: IntArray, boxes: FloatArray
) -> int:
    """Return what `nearest_place` returns, by a search from the place `last` of a segment nearby, or NO_PLACE."""
    if last == NO_PLACE:
        return nearest_place(v, x, segments, order, boxes)
    origin, surface = v.a if v.c <= 0 else v.b, (x, segments, order, boxes)
    p = arm(origin, v)
    best = _Nearest(NO_PLACE, np.inf, np.inf, NO_PLACE, np.inf, np.inf, np.inf)
    best = _look_at(best, last, origin, p, surface)
    n_leaves = len(boxes) // 2
    top = n_leaves + last // LEAF  # The subtree of this box is looked through.
    best = _look_at_leaf(best, top, last, origin, p, surface)
    while top > 1:
        best = _look_below(best, top ^ 1, last, origin, p, surface)
        top >>= 1
    place = _decide(best, order)
    return place if place != NO_PLACE else nearest_place(v, x, segments, order, boxes)


@compile_inline
def _look_below(best: _Nearest, top: int, last: int, origin: Vector, p: Vector, surface: _Searched) -> _Nearest:
    """Return the nearest segments so far, after a look at all below the box `top` that may be level with the first."""
    _, _, _, boxes = surface
    box, n_leaves = top, len(boxes) // 2
    while True:
        if distance_to_box(origin, p, boxes[box]) <= (1 + LEVEL) * best.distance:
            if box < n_leaves:  # down to the first half
                box = 2 * box
                continue
            best = _look_at_leaf(best, box, last, origin, p, surface)
        while box != top and box & 1:  # up from second halves
            box >>= 1
        if box == top:
            return best
        box += 1  # on to the second half


@compile_inline
def _decide(best: _Nearest, order: IntArray) -> int:
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
def _look_at_leaf(best: _Nearest, box: int, last: int, origin: Vector, p: Vector, surface: _Searched) -> _Nearest:
    """Return the nearest segments so far, after a look at those of a leaf but the one at the place `last`."""
    x, segments, order, boxes = surface
    start = (box - len(boxes) // 2) * LEAF
    for place in range(start, min(start + LEAF, len(order))):
        segment = order[place]
        if segment < 0 or place == last:  # padding, or seen before
            continue
        x_1, x_2 = node(x, segments[segment, 0]), node(x, segments[segment, 1])
        if _least_distance(origin, p, x_1, x_2) <= (1 + LEVEL) * best.distance:
            best = _look_at(best, place, origin, p, surface)
    return best


@compile_inline
def _look_at(best: _Nearest, place: int, origin: Vector, p: Vector, surface: _Searched) -> _Nearest:
    x, segments, order, _ = surface
    segment = order[place]
    x_1, x_2 = node(x, segments[segment, 0]), node(x, segments[segment, 1])
    distance, past = distance_to_segment(origin, p, x_1, x_2)
    first, d_1, past_1, second, d_2, past_2, d_3 = best
    if distance < d_1:
        return _Nearest(place, distance, past, first, d_1, past_1, d_2)
    if distance < d_2:
        return _Nearest(first, d_1, past_1, place, distance, past, d_2)
    return _Nearest(first, d_1, past_1, second, d_2, past_2, min(d_3, distance))


@compile_inline
def _least_distance(origin: Vector, p: Vector, x_1: Vector, x_2: Vector) -> float:
    """Return the squared distance of origin + p to the box of the segment 1 2, a little less than exact."""
    first, second = minus(x_1, origin), minus(x_2, origin)
    dx = max(min(first[0], second[0]) - p[0], 0.0, p[0] - max(first[0], second[0]))
    dy = max(min(first[1], second[1]) - p[1], 0.0, p[1] - max(first[1], second[1]))
    return (dx * dx + dy * dy) * (1 - LEVEL / 2)
