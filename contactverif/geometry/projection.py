"""Compiled geometry that plugins may use: frames of segments, the nearest segment to a point, segments in a strip.

A vector is a pair of scalars, real or complex, so that a complex step passes through. A surface is searched by a tree
of boxes (`search_tree`) at a cost of O(log n) for each point.

Take differences of nodes first, interpolate afterwards. The difference of two nearby nodes is exact, or rounded in its
own last bit. A point inside a segment is rounded in the last bit of its distance from the origin, and a node that is
subtracted afterwards leaves that error behind. With coordinates near 1e6, segments near 1 and a penetration of 1e-6,
the rounded point is wrong by 1e-10 and the gap by 1e-4 relative; from differences the gap is wrong by 1e-10 relative.
So a point here is a `PointOnSegment`: the two nodes and c, never a rounded position. `arm` returns the vector from a
node to it. From vectors of this kind an exact translation changes no bit of a gap, of a foot, or of a decision.

Rules for the next editor:

1. No position enters a sum or a product, only a difference of two positions.
2. The harness judges plugins by `contactverif.oracle`, which shares no code with this file, and so must it stay.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.interface import Surface
from contactverif.geometry.compiled import compile_inline, compile_kernel

Vector = tuple[float, float]
Tree = tuple[IntArray, FloatArray]

LEAF = 4  # The number of segments in a leaf of the tree.


class PointOnSegment(NamedTuple):
    """A point on the segment a b that is not rounded: a at c = −1, b at c = +1. A node a is (a, a, −1.0)."""

    a: Vector
    b: Vector
    c: float


@compile_kernel
def node(x: FloatArray, number: int) -> Vector:
    """Return the position of a node, from x (n_nodes, 2)."""
    return x[number, 0], x[number, 1]


@compile_kernel
def minus(a: Vector, b: Vector) -> Vector:
    """Return a − b."""
    return a[0] - b[0], a[1] - b[1]


@compile_kernel
def dot(a: Vector, b: Vector) -> float:
    """Return a · b, without conjugation."""
    return a[0] * b[0] + a[1] * b[1]


@compile_kernel
def cross(a: Vector, b: Vector) -> float:
    """Return a × b = a_x b_y − a_y b_x.

    The gap of a point to the line 1 2 is (x_V − x_1) × (x_2 − x_1) / l. It has fewer roundings than (x_V − x_1)·n.
    """
    return a[0] * b[1] - a[1] * b[0]


@compile_kernel
def between(a: Vector, b: Vector, c: float) -> Vector:
    """Return the vector at c between two vectors: a at −1, b at +1. For a point of a segment use `arm`."""
    return (1 - c) / 2 * a[0] + (1 + c) / 2 * b[0], (1 - c) / 2 * a[1] + (1 + c) / 2 * b[1]


@compile_kernel
def arm(origin: Vector, point: PointOnSegment) -> Vector:
    """Return the vector from a node to a point of a segment: differences first, interpolated afterwards.

    Parameters
    ----------
    origin : Vector
        The position of the node from which the point is seen, a length each.
    point : PointOnSegment
        The point. Where c is −1 or 1, the result is the difference of two nodes.
    """
    return between(minus(point.a, origin), minus(point.b, origin), point.c)


@compile_kernel
def frame(x1: Vector, x2: Vector) -> tuple[float, Vector, Vector]:
    """Return length, tangent and normal of a segment; the normal points out of the body, which lies on the left."""
    d = minus(x2, x1)
    length = np.sqrt(dot(d, d))
    t = (d[0] / length, d[1] / length)
    return length, t, (t[1], -t[0])


@compile_kernel
def _box_tree(x: FloatArray, segments: IntArray, order: IntArray) -> FloatArray:
    """Return the boxes of a binary tree over the segments in a padded chain order.

    Returns
    -------
    FloatArray, shape (n_boxes, 4)
        Low x, low y, high x, high y of each box. Box 1 holds all segments, and box i is halved into 2i and 2i + 1. The
        second half of the list are the leaves, of `LEAF` segments each.
    """
    n_leaves = 1
    while n_leaves * LEAF < len(order):
        n_leaves *= 2
    boxes = np.empty((2 * n_leaves, 4))
    boxes[:, :2] = np.inf
    boxes[:, 2:] = -np.inf
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
    return boxes


@compile_kernel
def distance_to_box(origin: Vector, p: Vector, box: FloatArray) -> float:
    """Return the squared distance of origin + p to a box, a little less than exact, so that roundoff loses no tie."""
    dx = max((box[0] - origin[0]) - p[0], 0.0, p[0] - (box[2] - origin[0]))
    dy = max((box[1] - origin[1]) - p[1], 0.0, p[1] - (box[3] - origin[1]))
    return float((dx * dx + dy * dy) * (1 - 64 * UNIT_ROUNDOFF))


@compile_kernel
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


@compile_kernel
def nearest_segment(v: PointOnSegment, x: FloatArray, segments: IntArray, order: IntArray, boxes: FloatArray) -> int:
    """Return the nearest closed segment to a point.

    Of equally near segments it is the one whose end the foot passes least, then the one with the lowest number. The
    search costs O(log n) for a chain of n segments: it opens no box that is farther than the nearest segment so far.
    All vectors begin at the nearer end of the point's own segment, so an exact translation changes nothing.

    Parameters
    ----------
    v : PointOnSegment
        The point, as the nodes of its segment and c ∈ [−1, 1].
    x : FloatArray, shape (n_nodes, 2)
        Positions.
    segments : IntArray, shape (n_segments, 2)
        Nodes of the segments.
    order : IntArray, shape (n_places,)
        The padded chain order of `search_tree`.
    boxes : FloatArray, shape (n_boxes, 4)
        The boxes of `search_tree` at these positions.
    """
    place = nearest_place(v, x, segments, order, boxes)
    return int(order[place]) if place >= 0 else -1  # A position that is no number has no nearest segment.


@compile_kernel
def nearest_place(v: PointOnSegment, x: FloatArray, segments: IntArray, order: IntArray, boxes: FloatArray) -> int:
    """Return the place in `order` of the segment that `nearest_segment` returns, from the same arguments."""
    origin = v.a if v.c <= 0 else v.b
    p = arm(origin, v)
    n_leaves = len(boxes) // 2
    best, best_distance, best_past, best_place = -1, np.inf, np.inf, -1
    waiting, distances = np.empty(64, dtype=np.int64), np.empty(64)  # the boxes still to open, one for each level
    n_waiting, box, distance = 0, 1, 0.0
    while True:
        while box < n_leaves and distance <= best_distance:  # down to a leaf, the nearer box first
            box, distance, waiting[n_waiting], distances[n_waiting] = _halves(box, origin, p, boxes)
            n_waiting += 1
        if distance <= best_distance:
            start = (box - n_leaves) * LEAF
            for place in range(start, min(start + LEAF, len(order))):
                segment = order[place]
                if segment >= 0:  # no padding
                    x_1, x_2 = node(x, segments[segment, 0]), node(x, segments[segment, 1])
                    distance, past = distance_to_segment(origin, p, x_1, x_2)
                    if is_nearer(distance, past, segment, best_distance, best_past, best):
                        best, best_distance, best_past, best_place = segment, distance, past, place
        if n_waiting == 0:
            return best_place
        n_waiting -= 1
        box, distance = waiting[n_waiting], distances[n_waiting]


@compile_inline
def _halves(box: int, origin: Vector, p: Vector, boxes: FloatArray) -> tuple[int, float, int, float]:
    """Return the nearer half of a box with its distance, and the farther one with its distance."""
    first, second = 2 * box, 2 * box + 1
    d_1, d_2 = distance_to_box(origin, p, boxes[first]), distance_to_box(origin, p, boxes[second])
    if d_2 < d_1:
        return second, d_2, first, d_1
    return first, d_1, second, d_2


@compile_kernel
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


@compile_kernel
def segments_in_strip(
    a: Vector, n_a: Vector, b: Vector, n_b: Vector, reach: float, order: IntArray, boxes: FloatArray
) -> list[int]:
    """Return the segments that may meet the strip between the line through a along n_a and that through b along n_b.

    Seen along the normals, the strip lies on the left of the first line and on the right of the second. It ends at a
    distance `reach` from the segment a b. The result holds all segments that meet the strip, and others whose leaf of
    the tree does, so a caller looks closer. The cost is O(log n) for each segment of the result.
    """
    members = [0 for _ in range(0)]
    n_leaves = len(boxes) // 2
    waiting = np.empty(64, dtype=np.int64)
    waiting[0] = 1
    n_waiting = 1
    while n_waiting > 0:
        n_waiting -= 1
        box = waiting[n_waiting]
        if not _box_in_strip(a, n_a, b, n_b, reach, boxes[box]):
            continue
        if box < n_leaves:
            waiting[n_waiting], waiting[n_waiting + 1] = 2 * box + 1, 2 * box
            n_waiting += 2
            continue
        start = (box - n_leaves) * LEAF
        for place in range(start, min(start + LEAF, len(order))):
            if order[place] >= 0:  # no padding
                members.append(order[place])
    return members


@compile_kernel
def _box_in_strip(a: Vector, n_a: Vector, b: Vector, n_b: Vector, reach: float, box: FloatArray) -> bool:
    """Return whether a box may meet the strip; a doubt of some roundings of its distances counts as yes."""
    if np.isinf(box[0]):  # the box of padding is empty
        return False
    low, high = (box[0], box[1]), (box[2], box[3])
    a_low, a_high, b_low, b_high = minus(low, a), minus(high, a), minus(low, b), minus(high, b)
    size = reach
    for axis in range(2):
        size = max(size, abs(a_low[axis]), abs(a_high[axis]), abs(b_low[axis]), abs(b_high[axis]))
    doubt = 16 * UNIT_ROUNDOFF * size
    for axis in range(2):
        above, below = min(a_low[axis], b_low[axis]), max(a_high[axis], b_high[axis])
        if above > reach + doubt or below < -reach - doubt:
            return False
    behind_a, before_b = True, True  # all corners
    for corner in range(4):
        p = (box[2 * (corner % 2)], box[1 + 2 * (corner // 2)])
        d_a, d_b = minus(p, a), minus(p, b)
        behind_a = behind_a and n_a[0] * d_a[1] - n_a[1] * d_a[0] < -doubt
        before_b = before_b and n_b[0] * d_b[1] - n_b[1] * d_b[0] > doubt
    return not (behind_a or before_b)


def search_tree(surface: Surface, x: FloatArray) -> Tree:
    """Return the tree by which `nearest_segment` searches a surface at x (n_nodes, 2); it costs O(n) to make."""
    order = _pad_chains(surface)
    return order, _box_tree(x, surface.segments, order)


def _pad_chains(surface: Surface) -> IntArray:
    """Return the chain order with −1 between chains, so that each chain has a subtree of its own.

    So a chain far away costs a search one look at its box, and the subtree of the near chain is what it would be alone.
    """
    order = surface.chain_order
    begins = np.flatnonzero(surface.neighbours[order[:-1], 1] != order[1:]) + 1
    if not len(begins):
        return order
    padded = np.full(0, -1, dtype=np.int64)
    for chain in np.split(order, begins):
        width = LEAF
        while width < len(chain):
            width *= 2
        start = -(-len(padded) // width) * width
        padded = np.concatenate([padded, np.full(start + width - len(padded), -1)])
        padded[start : start + len(chain)] = chain
    return padded


@compile_kernel
def foot_on_surface(s: float, length: float, free_first: bool, free_second: bool, tolerance: float) -> bool:
    """Return whether a foot is on the surface, past a free end by at most `tolerance` × the segment's length.

    Parameters
    ----------
    s, length : float
        The place of the foot on its segment, measured from the first node, and the length of the segment.
    free_first, free_second : bool
        Whether the surface ends at the first and at the second node of the segment.
    tolerance : float
        The part of the segment's length by which the foot may lie past a free end.
    """
    before = free_first and s < -tolerance * length
    behind = free_second and s - length > tolerance * length
    return not (before or behind)
