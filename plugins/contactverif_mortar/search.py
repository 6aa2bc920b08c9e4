"""Which pairs of a slave and a master segment make a cell. Decisions only: all that leaves this file is a pairing.

A slave segment and a master segment make a cell where

1. they face each other: the master's normal runs against the directions in which both ends of the slave look;
2. they overlap: some point of the slave sees the master segment along its direction (`geometry`), either way;
3. from the middle of the overlap no other master segment that faces the slave is seen nearer: so of bodies one behind
   the other only the first is touched, and never one at the far side of a ring, which does not face the slave either;
4. the gap there is at most 2 (h_s + h_m) either way, h the longest segment of the chain: deeper is no contact, and a
   floor far below an overhang is none (CHOICE; a penetration of two segments is well within it).

Candidates come from the tree that `search_tree` makes, O(log n) for each slave segment and cell.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Surface
from contactverif.geometry.compiled import compiled
from contactverif.geometry.projection import Vector, dot, frame, minus, node, segments_in_strip
from contactverif_mortar.geometry import end_normals, facing_point, seen_from, turned

# An overlap no longer than this, in c ∈ [−1, 1], is none: its points would not be told apart.
ROUNDOFF = 4 * UNIT_ROUNDOFF


def longest_of_chain(surface: Surface, x: FloatArray) -> FloatArray:
    """For each segment the length of the longest one of its chain, at the positions x (n_nodes, 2)."""
    order = surface.chain_order
    begins = np.flatnonzero(np.r_[True, surface.neighbours[order[:-1], 1] != order[1:]])
    longest = np.maximum.reduceat(surface.lengths(x)[order], begins)
    found = np.empty(len(order))
    found[order] = np.repeat(longest, np.diff(np.r_[begins, len(order)]))
    return found


@compiled
def averaging(x: FloatArray, slave: IntArray, neighbours: IntArray) -> tuple[IntArray, IntArray]:
    """With which segment the normals at the two ends of each slave segment are averaged, −1 none.

    None at a free end and where two segments meet at 90° or sharper: that is a corner, no faceting (CHOICE).
    """
    found = np.full((2, len(slave)), -1, dtype=np.int64)
    for segment in range(len(slave)):
        _, t, _ = frame(node(x, slave[segment, 0]), node(x, slave[segment, 1]))
        for end in range(2):
            other = neighbours[segment, end]
            if other >= 0:
                _, t_other, _ = frame(node(x, slave[other, 0]), node(x, slave[other, 1]))
                if dot(t, t_other) > 0:
                    found[end, segment] = other
    return found[0], found[1]


@compiled
def find_cells(
    x: FloatArray,
    slave: IntArray,
    master: IntArray,
    before: IntArray,
    behind: IntArray,
    slave_longest: FloatArray,
    master_longest: FloatArray,
    order: IntArray,
    boxes: FloatArray,
) -> tuple[IntArray, IntArray, BoolArray, BoolArray]:
    """Slave segment and master segment of each cell, and whether a master node cuts its lower and its upper end.

    The second node of the master segment cuts the lower end, the first the upper. Cells are in the order of the slave
    segments and then as one meets them along the slave.
    """
    slave_found, master_found = [0 for _ in range(0)], [0 for _ in range(0)]
    low_found, high_found = [False for _ in range(0)], [False for _ in range(0)]
    reach_of_all = np.max(master_longest)
    for s in range(len(slave)):
        x_a, x_b = node(x, slave[s, 0]), node(x, slave[s, 1])
        n_a, n_b = end_normals(x, slave, s, before[s], behind[s])
        straight = before[s] < 0 and behind[s] < 0
        candidates = segments_in_strip(x_a, n_a, x_b, n_b, 2 * (slave_longest[s] + reach_of_all), order, boxes)
        candidates.sort()
        ends = np.empty((len(candidates), 3))  # low, high, gap in the middle
        members = np.empty(len(candidates), dtype=np.int64)
        count = 0
        for m in candidates:
            x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
            low, high = overlap(x_a, x_b, n_a, n_b, straight, x_1, x_2)
            if high - low <= ROUNDOFF:
                continue
            _, gap, _ = facing_point(x_a, x_b, n_a, n_b, x_1, x_2, (low + high) / 2)
            if abs(gap) <= 2 * (slave_longest[s] + master_longest[m]):
                ends[count, 0], ends[count, 1], ends[count, 2] = low, high, abs(gap)
                members[count] = m
                count += 1
        along = np.argsort(ends[:count, 0], kind="mergesort")
        reached = -1.0  # the highest upper end so far
        for place in range(count):
            i = along[place]
            middle = (ends[i, 0] + ends[i, 1]) / 2
            stop = place + 1  # who may overlap: all before if any of them reaches here, and those that begin before it
            while stop < count and ends[along[stop], 0] < middle:
                stop += 1
            nearest = True
            for other in along[0 if reached > middle else place + 1 : stop]:
                if other != i and ends[other, 0] < middle < ends[other, 1]:
                    x_1, x_2 = node(x, master[members[other], 0]), node(x, master[members[other], 1])
                    _, gap, _ = facing_point(x_a, x_b, n_a, n_b, x_1, x_2, middle)
                    if abs(gap) < ends[i, 2] or (abs(gap) == ends[i, 2] and members[other] < members[i]):
                        nearest = False
            reached = max(reached, ends[i, 1])
            if nearest:
                slave_found.append(s)
                master_found.append(members[i])
                low_found.append(ends[i, 0] > -1)
                high_found.append(ends[i, 1] < 1)
    return np.array(slave_found), np.array(master_found), np.array(low_found), np.array(high_found)


@compiled
def overlap(
    x_a: Vector, x_b: Vector, n_a: Vector, n_b: Vector, straight: bool, x_1: Vector, x_2: Vector
) -> tuple[float, float]:
    """Lower and upper end on the slave of what it sees of the segment 1 2; (1, −1) if nothing.

    As c grows the line along the slave's direction passes node 2 first: the master runs against the slave. So node 1 is
    ahead of where the slave begins to look, and node 2 is passed where it ends; they are not where averaged directions
    have crossed before they reach the master, deeper than the slave's own radius of curvature (CHOICE: nothing seen).
    """
    along = minus(x_2, x_1)
    tau_a, tau_b = turned(n_a), turned(n_b)
    if dot(along, tau_a) >= 0 or dot(along, tau_b) >= 0:
        return 1.0, -1.0
    if dot(minus(x_1, x_a), tau_a) <= 0 or dot(minus(x_2, x_b), tau_b) >= 0:
        return 1.0, -1.0
    low, high = -1.0, 1.0
    if dot(minus(x_2, x_a), tau_a) > 0:
        low = max(seen_from(x_2, x_a, x_b, n_a, n_b, straight), -1.0)
    if dot(minus(x_1, x_b), tau_b) < 0:
        high = min(seen_from(x_1, x_a, x_b, n_a, n_b, straight), 1.0)
    return low, high
