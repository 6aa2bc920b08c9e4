"""Which master segments the area of competence of a virtual slave node covers (Boxes 1 and 2).

P is the end of the area nearer B, Q the end nearer A; s(·) = (· − x1)·t in the frame of V's master segment 1 → 2.
From V's master segment one walks to the neighbours while s(P) < s(first node) and s(Q) > s(last node), and stops at a
free end and before a segment seen edge-on or from behind. Decisions only: all that leaves this file is a pairing.

Source: Zavarise & De Lorenzis (2009), Boxes 1 and 2, Fig. 23.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.geometry.compiled import compiled
from contactverif.geometry.projection import Vector, between, dot, foot_on_surface, frame, minus, nearest_segment, node
from contactverif_nts.eq6 import pressed

TRUNCATE, EXTEND, COVER = 0, 1, 2  # what becomes of an area of competence that overhangs a free end
NOT_CUT = -1


@compiled
def pair(
    x: FloatArray,
    slave: IntArray,
    master: IntArray,
    neighbours: IntArray,
    order: IntArray,
    boxes: FloatArray,
    n: int,
    free_end: int,
    tau: float,
    multipliers: FloatArray,
    penalty: float,
) -> tuple[IntArray, IntArray, IntArray, IntArray, IntArray, IntArray, IntArray, IntArray, BoolArray]:
    """For each virtual slave node (n on each slave segment) what its area of competence covers.

    Returns master, first, last: segments; frame: the segment in whose frame the area is cut, −1 if it is not;
    cut_p, cut_q: the nodes that cut it, −1 none; clip_p, clip_q: 0 or 1 where a part of a segment is cut to its first
    or second node on the master side only, −1 none; and active.
    """
    n_points = len(slave) * n
    partner, first, last = np.full((3, n_points), -1, dtype=np.int64)
    cutting, cut_p, cut_q = np.full((3, n_points), NOT_CUT, dtype=np.int64)
    clip_p, clip_q = np.full((2, n_points), NOT_CUT, dtype=np.int64)
    active = np.zeros(n_points, dtype=np.bool_)
    for point in range(n_points):
        x_a, x_b = node(x, slave[point // n, 0]), node(x, slave[point // n, 1])
        c = -1 + (2 * (point % n) + 1) / n
        c_p, c_q = c + 1 / n, c - 1 / n
        m = nearest_segment(between(x_a, x_b, c), x, master, order, boxes)

        if free_end == COVER:
            x1 = node(x, master[m, 0])
            _, t, _ = frame(x1, node(x, master[m, 1]))
            half = dot(minus(x_b, x_a), t) / 2  # s gains this for each unit of c
            if half >= 0:  # P does not come before Q: the slave is seen edge-on or from behind
                partner[point], first[point], last[point] = m, m, m
                continue
            x_p, x_q = between(x_a, x_b, c_p), between(x_a, x_b, c_q)
            start, stop = _walk(x, x_p, x_q, m, t, master, neighbours)
            x_mid = between(x_a, x_b, 0.0)
            x_start, x_stop = node(x, master[start, 0]), node(x, master[stop, 1])
            if dot(minus(x_p, x_start), t) < 0:
                cut_p[point] = master[start, 0]
                c_p = dot(minus(x_start, x_mid), t) / half
            if dot(minus(x_q, x_stop), t) > 0:
                cut_q[point] = master[stop, 1]
                c_q = dot(minus(x_stop, x_mid), t) / half
            if cut_p[point] != NOT_CUT or cut_q[point] != NOT_CUT:
                cutting[point] = m
                if c_p <= c_q:  # nothing is left
                    partner[point], first[point], last[point] = m, m, m
                    continue
                c = (c_p + c_q) / 2
                m = nearest_segment(between(x_a, x_b, c), x, master, order, boxes)

        x_v, x_p, x_q = between(x_a, x_b, c), between(x_a, x_b, c_p), between(x_a, x_b, c_q)
        x1, x2 = node(x, master[m, 0]), node(x, master[m, 1])
        _, t, n_m = frame(x1, x2)
        partner[point], first[point], last[point] = m, m, m
        if dot(minus(x_p, x1), t) >= dot(minus(x_q, x1), t):
            continue
        on_surface = foot_on_surface(x_v, x1, x2, neighbours[m, 0] < 0, neighbours[m, 1] < 0, tau)
        active[point] = pressed(dot(minus(x_v, x1), n_m), multipliers, point, penalty) and on_surface
        start, stop = _walk(x, x_p, x_q, m, t, master, neighbours)
        first[point], last[point] = start, stop
        if free_end == TRUNCATE and start != stop:
            clip_p[point] = _clipped(x_p, node(x, master[start, 0]), node(x, master[start, 1]), t)
            clip_q[point] = _clipped(x_q, node(x, master[stop, 0]), node(x, master[stop, 1]), t)
    return partner, first, last, cutting, cut_p, cut_q, clip_p, clip_q, active


@compiled
def _walk(
    x: FloatArray, x_p: Vector, x_q: Vector, m: int, t: Vector, master: IntArray, neighbours: IntArray
) -> tuple[int, int]:
    """The first and the last master segment under the area of competence P … Q, in the frame of segment m."""
    start, stop = m, m
    while dot(minus(x_p, node(x, master[start, 0])), t) < 0:
        following = neighbours[start, 0]
        if following < 0 or _projected_length(x, master, following, t) <= 0:
            break
        start = following
    while dot(minus(x_q, node(x, master[stop, 1])), t) > 0:
        following = neighbours[stop, 1]
        if following < 0 or _projected_length(x, master, following, t) <= 0:
            break
        stop = following
    return start, stop


@compiled
def _projected_length(x: FloatArray, master: IntArray, segment: int, t: Vector) -> float:
    return dot(minus(node(x, master[segment, 1]), node(x, master[segment, 0])), t)


@compiled
def _clipped(end: Vector, x_f: Vector, x_m: Vector, t: Vector) -> int:
    """0 where the end lies before the first node of its segment, 1 where behind the second, else −1."""
    if dot(minus(end, x_f), t) < 0:
        return 0
    if dot(minus(end, x_m), t) > 0:
        return 1
    return NOT_CUT
