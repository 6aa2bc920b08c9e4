"""Compiled geometry that plugins may use: frames of segments, the nearest segment to a point, segments in a strip.

A vector is a pair of scalars, real or complex, so that a complex step passes through. A surface is searched by a tree
of boxes (`search_tree`) at a cost of O(log n) for each point.

Rule for the next editor: the harness judges plugins by `contactverif.oracle`, which shares no code with this file, and
so must it stay.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.interface import Surface
from contactverif.geometry.compiled import compile_kernel

Vector = tuple[float, float]
Tree = tuple[IntArray, FloatArray]

_LEAF = 4  # The number of segments in a leaf of the tree.


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
def between(a: Vector, b: Vector, c: float) -> Vector:
    """Return the point at c on the segment a b: a at −1, b at +1."""
    return (1 - c) / 2 * a[0] + (1 + c) / 2 * b[0], (1 - c) / 2 * a[1] + (1 + c) / 2 * b[1]


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
        second half of the list are the leaves, of `_LEAF` segments each.
    """
    n_leaves = 1
    while n_leaves * _LEAF < len(order):
        n_leaves *= 2
    boxes = np.empty((2 * n_leaves, 4))
    boxes[:, :2] = np.inf
    boxes[:, 2:] = -np.inf
    for place in range(len(order)):
        if order[place] < 0:  # padding
            continue
        box = boxes[n_leaves + place // _LEAF]
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
def _distance_to_box(p: Vector, box: FloatArray) -> float:
    """Return the squared distance to a box, a little less than exact, so that no tie is lost to roundoff."""
    dx = max(box[0] - p[0], 0.0, p[0] - box[2])
    dy = max(box[1] - p[1], 0.0, p[1] - box[3])
    return float((dx * dx + dy * dy) * (1 - 16 * UNIT_ROUNDOFF))


@compile_kernel
def distance_to_segment(p: Vector, x1: Vector, x2: Vector) -> tuple[float, float]:
    """Return the squared distance to the closed segment, and the length by which the foot lies past its end.

    Where the foot lies at or past an end, the distance is that to the end node itself, so that the two segments at a
    vertex tie exactly.
    """
    length, t, n = frame(x1, x2)
    s = dot(minus(p, x1), t)
    if s <= 0:
        d = minus(p, x1)
        return dot(d, d), -s
    if s >= length:
        d = minus(p, x2)
        return dot(d, d), s - length
    g = dot(minus(p, x1), n)
    return g * g, 0.0


@compile_kernel
def nearest_segment(p: Vector, x: FloatArray, segments: IntArray, order: IntArray, boxes: FloatArray) -> int:
    """Return the nearest closed segment to p.

    Of equally near segments it is the one whose end the foot passes least, then the one with the lowest number. The
    search costs O(log n) for a chain of n segments: it opens no box that is farther than the nearest segment so far.

    Parameters
    ----------
    p : Vector
        The point.
    x : FloatArray, shape (n_nodes, 2)
        Positions.
    segments : IntArray, shape (n_segments, 2)
        Nodes of the segments.
    order : IntArray, shape (n_places,)
        The padded chain order of `search_tree`.
    boxes : FloatArray, shape (n_boxes, 4)
        The boxes of `search_tree` at these positions.
    """
    n_leaves = len(boxes) // 2
    best, best_distance, best_past = -1, np.inf, np.inf
    waiting = np.empty(64, dtype=np.int64)  # the boxes still to open, at most one for each level of the tree
    waiting[0] = 1
    n_waiting = 1
    while n_waiting > 0:
        n_waiting -= 1
        box = waiting[n_waiting]
        if _distance_to_box(p, boxes[box]) > best_distance:
            continue
        if box < n_leaves:
            near, far = 2 * box, 2 * box + 1
            if _distance_to_box(p, boxes[far]) < _distance_to_box(p, boxes[near]):
                near, far = far, near
            waiting[n_waiting] = far
            waiting[n_waiting + 1] = near
            n_waiting += 2
            continue
        start = (box - n_leaves) * _LEAF
        for place in range(start, min(start + _LEAF, len(order))):
            segment = order[place]
            if segment < 0:  # padding
                continue
            distance, past = distance_to_segment(p, node(x, segments[segment, 0]), node(x, segments[segment, 1]))
            if _is_nearer(distance, past, segment, best_distance, best_past, best):
                best, best_distance, best_past = segment, distance, past
    return best


@compile_kernel
def _is_nearer(distance: float, past: float, segment: int, best_distance: float, best_past: float, best: int) -> bool:
    """Return whether a segment comes before the best one so far, by distance, then by `past`, then by number."""
    if distance != best_distance:
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
        start = (box - n_leaves) * _LEAF
        for place in range(start, min(start + _LEAF, len(order))):
            if order[place] >= 0:  # no padding
                members.append(order[place])
    return members


@compile_kernel
def _box_in_strip(a: Vector, n_a: Vector, b: Vector, n_b: Vector, reach: float, box: FloatArray) -> bool:
    """Return whether a box may meet the strip; a doubt of some roundings of the coordinates counts as yes."""
    size = max(abs(a[0]), abs(a[1]), abs(b[0]), abs(b[1]), reach)
    if not np.isinf(box[0]):  # the box of padding is empty
        size = max(size, abs(box[0]), abs(box[1]), abs(box[2]), abs(box[3]))
    doubt = 16 * UNIT_ROUNDOFF * size
    for axis in range(2):
        if box[axis] > max(a[axis], b[axis]) + reach + doubt or box[2 + axis] < min(a[axis], b[axis]) - reach - doubt:
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
        width = _LEAF
        while width < len(chain):
            width *= 2
        start = -(-len(padded) // width) * width
        padded = np.concatenate([padded, np.full(start + width - len(padded), -1)])
        padded[start : start + len(chain)] = chain
    return padded


@compile_kernel
def foot_on_surface(p: Vector, x1: Vector, x2: Vector, free_first: bool, free_second: bool, tolerance: float) -> bool:
    """Return whether the foot of p is on the surface, past a free end by at most `tolerance` × the segment's length."""
    length, t, _ = frame(x1, x2)
    s = dot(minus(p, x1), t)
    before = free_first and s < -tolerance * length
    behind = free_second and s - length > tolerance * length
    return not (before or behind)
