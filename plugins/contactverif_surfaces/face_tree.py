"""A tree of boxes in space: which boxes meet the box of a question, at a cost of O(log n) for each answer.

Boxes are sorted along a curve that fills space (Morton's), so that neighbours in the list are neighbours in space. Of
this list `LEAF` boxes at a time are a leaf, and a parent is the box around its two halves. A question is a box along
any three axes, seen from an origin near it, so that a far translation rounds nothing more.

The tree decides nothing: it leaves out what is clearly apart, and who asks looks at what is left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_kernel, compile_maker, compile_part
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray

LEAF = 4  # The number of boxes in a leaf.
BITS = 20  # The bits of a place along each axis; three such numbers are interleaved in 60 bits.
# A box that is farther off than this share of all lengths in the comparison is apart, whatever was rounded.
MARGIN = 64 * UNIT_ROUNDOFF


class Tree(NamedTuple):
    """A tree: box 1 holds everything, and box i is halved into 2i and 2i + 1. The second half are the leaves."""

    order: IntArray  # (n,) The numbers of the boxes along the curve.
    boxes: FloatArray  # (2 n_leaves, 2, 3) The lower and the upper corner of each box.


def grow_tree(boxes: FloatArray) -> Tree:
    """Return the tree of boxes (n, 2, 3), lower and upper corner each."""
    middle = boxes.mean(axis=1)
    size = float((middle.max(axis=0) - middle.min(axis=0)).max())
    scale = (2**BITS - 1) / size if size > 0 else 0.0
    keys = np.empty(len(boxes), np.int64)
    _write_keys(keys, ((middle - middle.min(axis=0)) * scale).astype(np.int64))
    order = np.argsort(keys, kind="stable")
    tree = Tree(order, np.empty((2 << max(0, (len(boxes) - 1) // LEAF).bit_length(), 2, 3)))
    _write_boxes(*tree, boxes)
    return tree


@compile_kernel
def _write_keys(keys: IntArray, places: IntArray) -> None:
    """Interleave the bits of the places (n, 3)."""
    for i in range(len(keys)):
        key = 0
        for bit in range(BITS - 1, -1, -1):
            for axis in range(3):
                key = 2 * key + ((places[i, axis] >> bit) & 1)
        keys[i] = key


@compile_kernel
def _write_boxes(order: IntArray, nodes: FloatArray, boxes: FloatArray) -> None:
    """Write the boxes of a tree; those of empty leaves meet nothing."""
    n_leaves = len(nodes) // 2
    for box in range(len(nodes)):
        for axis in range(3):
            nodes[box, 0, axis], nodes[box, 1, axis] = np.inf, -np.inf
    for place in range(len(order)):
        for axis in range(3):
            leaf = n_leaves + place // LEAF
            nodes[leaf, 0, axis] = min(nodes[leaf, 0, axis], boxes[order[place], 0, axis])
            nodes[leaf, 1, axis] = max(nodes[leaf, 1, axis], boxes[order[place], 1, axis])
    for parent in range(n_leaves - 1, 0, -1):
        for axis in range(3):
            nodes[parent, 0, axis] = min(nodes[2 * parent, 0, axis], nodes[2 * parent + 1, 0, axis])
            nodes[parent, 1, axis] = max(nodes[2 * parent, 1, axis], nodes[2 * parent + 1, 1, axis])


@compile_part
def collect_boxes(
    order: IntArray,
    nodes: FloatArray,
    origin: FloatArray,
    axes: FloatArray,
    low: FloatArray,
    high: FloatArray,
    members: IntArray,
) -> int:
    """Write the numbers of boxes into `members`, all that meet a question and some more; return how many.

    The question holds the points whose components along the `axes` (3, 3), seen from the origin, are between low (3,)
    and high (3,).
    """
    n_leaves, count, box = len(nodes) // 2, 0, 1
    while True:
        if _meets(nodes, box, origin, axes, low, high):
            if box < n_leaves:  # down to the first half
                box = 2 * box
                continue
            start = (box - n_leaves) * LEAF
            for place in range(start, min(start + LEAF, len(order))):
                members[count] = order[place]
                count += 1
        while box & 1:  # up from second halves
            box >>= 1
        if box == 0:
            return count
        box += 1  # on to the second half


@compile_part
def _meets(
    nodes: FloatArray, box: int, origin: FloatArray, axes: FloatArray, low: FloatArray, high: FloatArray
) -> bool:
    """Return whether a box may meet a question; an empty one does not."""
    if nodes[box, 0, 0] > nodes[box, 1, 0]:
        return False
    for row in range(3):
        nearest, farthest, size = 0.0, 0.0, 0.0
        for axis in range(3):
            first = axes[row, axis] * (nodes[box, 0, axis] - origin[axis])
            second = axes[row, axis] * (nodes[box, 1, axis] - origin[axis])
            nearest += min(first, second)
            farthest += max(first, second)
            size += abs(first) + abs(second)
        margin = MARGIN * size
        if nearest > high[row] + margin or farthest < low[row] - margin:
            return False
    return True


@compile_maker
def find_boxes_at(points: FloatArray, order: IntArray, boxes: FloatArray) -> tuple[IntArray, IntArray]:
    """Return pairs of points (n, 3) and boxes by their numbers, all where the point lies in the box and some more."""
    axes, zeros, members = np.eye(3), np.zeros(3), np.empty(len(order), np.int64)
    counts = np.empty(len(points), np.int64)
    for i in range(len(points)):
        counts[i] = collect_boxes(order, boxes, points[i], axes, zeros, zeros, members)
    point, box, count = np.empty(counts.sum(), np.int64), np.empty(counts.sum(), np.int64), 0
    for i in range(len(points)):
        for place in range(collect_boxes(order, boxes, points[i], axes, zeros, zeros, members)):
            point[count], box[count] = i, members[place]
            count += 1
    return point, box
