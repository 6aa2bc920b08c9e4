"""The pairing of VTS-PPT: which master segments the area of competence of each virtual slave node covers.

P is the end of the area nearer to B, Q the end nearer to A; s(·) = (· − x1)·t in the frame of V's master segment 1 → 2.
The walk goes from V's master segment to the neighbours while s(P) < s(first node) and s(Q) > s(last node). It stops at
a free end of the master, and before a segment that is seen edge-on or from behind (our choice: the paper is silent).

The paper is silent about free ends, too. The option `free_end` says what happens there:

- TRUNCATE: where several segments are involved, the master's parts end at its free end; the slave keeps its force. The
  printed transmission loses the rest of the force, the balanced one puts it on the parts that are left.
- EXTEND: Box 3 is read literally, and the last segment is continued past the free end.
- COVER (ours): the area of competence is cut to what faces the master, before anything else happens.

Everywhere else Box 3 stands as printed, whatever the option says. This holds also where the foot of V lies past the end
of an interior segment: the parts of the segments are then neither cut nor limited to [0, 1].

The balanced transmission (ours) divides by the sum S of all parts. Where the whole area lies past the same end of V's
segment (P and Q both before its first node, or both behind its last one), the part of that segment is negative. As
S → 0, on a slave that is seen edge-on, forces of both signs grow beyond all bounds. So there the balanced walk does not
begin: only V's segment is involved, and Eq. 6 holds, which is balanced as well.

Rule for the next editor: this file makes decisions. It returns integers and booleans, never a real number.

Source: Zavarise & De Lorenzis (2009), Boxes 1 and 2, Fig. 23.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_kernel
from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.geometry.block_rows import Fields
from contactverif.geometry.projection import (
    NO_PLACE,
    PointOnSegment,
    Tree,
    Vector,
    arm,
    cross,
    dot,
    foot_on_surface,
    frame,
    is_next,
    minus,
    nearest_place_from,
    node,
)
from contactverif.geometry.threads import run_in_threads, split_range
from contactverif_nts.nts_force import is_pressed

TRUNCATE, EXTEND, COVER = 0, 1, 2  # What happens to an area of competence that overhangs a free end.
FREE_ENDS = {"truncate": TRUNCATE, "extend": EXTEND, "cover": COVER}  # The words of the option `free_end`.
NOT_CUT = -1


class Areas(NamedTuple):
    """The pairing of virtual slave nodes, each array of shape (n_points,), in this order."""

    master: IntArray  # V's master segment
    first: IntArray  # the first master segment under the area, towards P
    last: IntArray  # the last one, towards Q
    frame: IntArray  # the master segment in whose frame COVER cuts the area, NOT_CUT if it does not
    cut_p: IntArray  # the master node that cuts the end P, NOT_CUT if there is none
    cut_q: IntArray  # the master node that cuts the end Q
    clip_p: IntArray  # 0 where TRUNCATE lets the first segment carry from its first node on, else NOT_CUT
    clip_q: IntArray  # 1 where TRUNCATE lets the last segment carry up to its second node, else NOT_CUT
    active: BoolArray  # V is in contact


@compile_kernel
def middle_of_part(i: int, n: int, unity: float) -> float:
    """Return where virtual slave node i of n lies on its segment, c in [−1, 1]; `unity` is 1 in the result's type."""
    return (2 * (i % n) + 1) * unity / n - 1


def pair(state: Fields, surfaces: Fields, tree: Tree, options: Fields, threads: int) -> Fields:
    """Return the fields of `Areas` for all virtual slave nodes, at x (n_nodes, 2) and multipliers.

    `options` are, in this order: n, the number of virtual slave nodes on a slave segment; `free_end`, TRUNCATE, EXTEND
    or COVER; τ, the part of a master segment by which a foot may lie past its free end; the penalty; and whether the
    transmission is balanced.
    """
    n, n_segments = options[0], len(surfaces[1])
    integers = np.full((8, n_segments * n), NOT_CUT, dtype=np.int64)
    active = np.zeros(n_segments * n, dtype=np.bool_)
    areas = *integers, active
    run_in_threads(
        [
            partial(_pair_points, begin * n, end * n, areas, state, surfaces, tree, options)
            for begin, end in split_range(n_segments, threads)
        ]
    )
    return areas


@compile_kernel
def _pair_points(
    begin: int, end: int, areas: Fields, state: Fields, surfaces: Fields, tree: Tree, options: Fields
) -> None:
    """Write the entries of the virtual slave nodes from begin to end.

    A virtual slave node is active where `is_pressed` says so, its foot is on the surface and s(P) < s(Q). A balanced
    walk does not begin where the whole area lies past one end of V's segment.
    """
    x, multipliers = state
    _, slave, master, neighbours = surfaces
    partner, first, last, cutting, cut_p, cut_q, clip_p, clip_q, active = areas
    order, boxes = tree
    n, free_end, tau, penalty, balanced = options
    place = NO_PLACE
    for i in range(begin, end):
        if i > begin and not is_next(slave, (i - 1) // n, i // n):
            place = NO_PLACE
        x_a, x_b = node(x, slave[i // n, 0]), node(x, slave[i // n, 1])
        c = middle_of_part(i, n, 1.0)
        c_p, c_q = c + 1 / n, c - 1 / n
        place = nearest_place_from(place, PointOnSegment(x_a, x_b, c), x, master, order, boxes)
        m = order[place]
        if free_end == COVER:
            c_p, c_q, cut_p[i], cut_q[i] = _cover(x, master, neighbours, m, x_a, x_b, c_p, c_q)
            if max(cut_p[i], cut_q[i]) != NOT_CUT:
                cutting[i] = m
                if c_p > c_q:
                    c = (c_p + c_q) / 2
                    place = nearest_place_from(place, PointOnSegment(x_a, x_b, c), x, master, order, boxes)
                    m = order[place]

        partner[i], first[i], last[i] = m, m, m
        x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
        l_12, t, _ = frame(x_1, x_2)
        if c_p <= c_q or dot(minus(x_b, x_a), t) >= 0:  # s(P) ≥ s(Q)
            continue
        v, p, q = PointOnSegment(x_a, x_b, c), PointOnSegment(x_a, x_b, c_p), PointOnSegment(x_a, x_b, c_q)
        d = arm(x_1, v)
        g = cross(d, minus(x_2, x_1)) / l_12
        on_surface = foot_on_surface(dot(d, t), l_12, neighbours[m, 0] < 0, neighbours[m, 1] < 0, tau)
        active[i] = is_pressed(g, multipliers, i, penalty) and on_surface
        if balanced and _lies_past_one_end(x, p, q, m, t, master):
            continue
        first[i], last[i] = _walk(x, p, q, m, t, master, neighbours)
        if free_end == TRUNCATE and first[i] != last[i]:
            if neighbours[first[i], 0] < 0 and dot(arm(node(x, master[first[i], 0]), p), t) < 0:
                clip_p[i] = 0
            if neighbours[last[i], 1] < 0 and dot(arm(node(x, master[last[i], 1]), q), t) > 0:
                clip_q[i] = 1


@compile_inline
def _walk(
    x: FloatArray, p: PointOnSegment, q: PointOnSegment, m: int, t: Vector, master: IntArray, neighbours: IntArray
) -> tuple[int, int]:
    """Return the first and the last master segment under the area of competence P … Q, in the frame of segment m."""
    first, last = m, m
    while dot(arm(node(x, master[first, 0]), p), t) < 0:
        following = neighbours[first, 0]
        if following < 0 or _projected_length(x, master, following, t) <= 0:
            break
        first = following
    while dot(arm(node(x, master[last, 1]), q), t) > 0:
        following = neighbours[last, 1]
        if following < 0 or _projected_length(x, master, following, t) <= 0:
            break
        last = following
    return first, last


@compile_inline
def _lies_past_one_end(
    x: FloatArray, p: PointOnSegment, q: PointOnSegment, m: int, t: Vector, master: IntArray
) -> bool:
    """Return whether P and Q lie before the first node of segment m, or both behind its last node, along its t."""
    x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
    return (dot(arm(x_1, p), t) < 0 and dot(arm(x_1, q), t) < 0) or (
        dot(arm(x_2, p), t) > 0 and dot(arm(x_2, q), t) > 0
    )


@compile_inline
def _projected_length(x: FloatArray, master: IntArray, segment: int, t: Vector) -> float:
    """Return the length of a master segment along t, negative where the segment runs backwards."""
    return dot(minus(node(x, master[segment, 1]), node(x, master[segment, 0])), t)


@compile_inline
def _cover(
    x: FloatArray, master: IntArray, neighbours: IntArray, m: int, x_a: Vector, x_b: Vector, c_p: float, c_q: float
) -> tuple[float, float, int, int]:
    """Cut [c_q, c_p] to what faces the master; return c_p, c_q (nothing is left if c_p ≤ c_q) and the cutting nodes."""
    cut_p = cut_q = NOT_CUT
    _, t, _ = frame(node(x, master[m, 0]), node(x, master[m, 1]))
    half = dot(minus(x_b, x_a), t) / 2  # s gains this for each unit of c
    if half >= 0:  # P does not come before Q: the slave is seen edge-on or from behind
        return c_q, c_q, cut_p, cut_q
    p, q, middle = PointOnSegment(x_a, x_b, c_p), PointOnSegment(x_a, x_b, c_q), PointOnSegment(x_a, x_b, 0.0)
    first, last = _walk(x, p, q, m, t, master, neighbours)
    x_first, x_last = node(x, master[first, 0]), node(x, master[last, 1])
    if dot(arm(x_first, p), t) < 0:
        cut_p = master[first, 0]
        c_p = -dot(arm(x_first, middle), t) / half
    if dot(arm(x_last, q), t) > 0:
        cut_q = master[last, 1]
        c_q = -dot(arm(x_last, middle), t) / half
    return c_p, c_q, cut_p, cut_q
