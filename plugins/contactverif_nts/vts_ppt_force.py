"""The pairing and the residual of VTS-PPT: a virtual slave node V presses on all master segments under its area.

Boxes 1 and 2, the pairing. P is the end of the area of competence nearer to B, Q the end nearer to A;
s(·) = (· − x1)·t in the frame of V's master segment 1 → 2. A walk goes from V's master segment to the neighbours while
s(P) < s(first node) and s(Q) > s(last node). It stops at a free end of the master, and before a segment that is seen
edge-on or from behind (our choice: the paper is silent).

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

Box 3, the residual. One segment: Eq. 6. Otherwise segment j with nodes f, m and projected length L_j carries the part
[a, b] of itself:

    a = (x_P − x_f)·t / L_j on the first segment, else 0        b = (x_Q − x_f)·t / L_j on the last, else 1
    W_m = L_j (b² − a²)/2                                        W_f = L_j [(b − a) − (b² − a²)/2]

Printed: the slave nodes get Eq. 6 with F_V = ε̂ g l_AB (c_P − c_Q)/2, the master nodes −ε̂ g W n. Balanced: the master
nodes get −F_V (W/S) n with S = ΣW, so that action equals reaction. Where a free end truncates the parts, S is the
sum of what is left: the master gets the whole force there too, on its last nodes.

With multipliers −λ stands for ε̂ g on both sides. Each virtual slave node then has a constraint row: −F_V/(ε̂ g) × g
where it is active, λ × its share of the slave segment's reference length where it is not. Arrays of multipliers without
columns mean a penalty.

Rules for the next editor:

1. `pair` makes all decisions and returns integers and booleans. `add_residual` compares no real numbers.
2. `add_residual` takes float64 and complex128, so a number that starts as a constant gets the type of x first.
3. A kernel gets plain tuples and unpacks them first; `nts_force` says why, and what `surfaces` are. `areas` are the
   fields of `Areas`. `options` are n, the number of virtual slave nodes on a slave segment, PRINTED or BALANCED,
   whether lengths are measured in the current configuration, and the penalty.
4. `vts_ppt_tangent` differentiates the residual line by line. Change both.

Source: Zavarise & De Lorenzis (2009), Boxes 1–3, Fig. 23, Eqs. 6, 8, 9.
"""

from functools import partial
from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_kernel, compile_part
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
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
from contactverif_nts.nts_force import area_length, is_pressed, push

PRINTED, BALANCED = 0, 1  # How the master side gets its share.
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


class Area(NamedTuple):
    """The pairing of one virtual slave node: one entry of each array of `Areas`."""

    master: int
    first: int
    last: int
    frame: int
    cut_p: int
    cut_q: int
    clip_p: int
    clip_q: int


class VirtualSlaveNode(NamedTuple):
    """One virtual slave node V at one state, in the middle of its area of competence."""

    x_a: Vector  # the slave segment
    x_b: Vector
    p: PointOnSegment  # the ends of the area of competence
    q: PointOnSegment
    d: Vector  # from the first node of V's master segment to V
    c: float  # V, P and Q as c
    c_p: float
    c_q: float
    l_12: float  # the frame of V's master segment
    t: Vector
    normal: Vector
    g: float  # the gap, negative in penetration


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


@compile_kernel
def add_residual(
    forces: Array, rows: Array, x: Array, multipliers: Array, surfaces: Fields, areas: Fields, options: Fields
) -> None:
    """Add forces and constraint rows, in the shapes of `nts_force.add_residual`."""
    reference, slave, master, neighbours = surfaces
    partner, first, last, cutting, cut_p, cut_q, clip_p, clip_q, active = areas
    n, transmission, current_area, penalty = options
    has_multipliers = multipliers.shape[1] > 0
    for state in range(x.shape[0]):
        now, r = x[state], forces[state]
        for i in range(len(active)):  # FOR each virtual slave node
            if not active[i]:
                if has_multipliers:
                    rows[state, i] = multipliers[state, i] * area_length(reference, slave, i // n, -1) / n
                continue
            area = Area(partner[i], first[i], last[i], cutting[i], cut_p[i], cut_q[i], clip_p[i], clip_q[i])
            node_a, node_b = slave[i // n, 0], slave[i // n, 1]
            node_1, node_2 = master[area.master, 0], master[area.master, 1]
            x_a, x_b, x_1, x_2 = node(now, node_a), node(now, node_b), node(now, node_1), node(now, node_2)
            c_p, c_q = area_of_competence(now, slave, master, n, i, area.frame, area.cut_p, area.cut_q)
            l_ab = length_of_area(x_a, x_b, node(reference, node_a), node(reference, node_b), current_area)
            v = virtual_slave_node(x_a, x_b, x_1, x_2, c_p, c_q)
            pressure = -multipliers[state, i] if has_multipliers else penalty * v.g  # its negative
            f_v = pressure * l_ab * (v.c_p - v.c_q) / 2
            if has_multipliers:
                rows[state, i] = -v.g * l_ab * (v.c_p - v.c_q) / 2
            push(r, node_a, (1 - v.c) / 2 * f_v, v.normal)
            push(r, node_b, (1 + v.c) / 2 * f_v, v.normal)
            if area.first == area.last:  # IF only one segment is involved THEN Eq. 6
                xi = dot(v.d, v.t) / v.l_12
                push(r, node_1, -(1 - xi) * f_v, v.normal)
                push(r, node_2, -xi * f_v, v.normal)
                continue
            if transmission == BALANCED:  # ELSE assembly of all the involved segments
                pressure = f_v / sum_of_parts(now, v, area, master)
            j = area.first
            while True:
                f, m = master[j, 0], master[j, 1]
                w_f, w_m = _parts(node(now, f), node(now, m), v, area, j)
                push(r, f, -pressure * w_f, v.normal)
                push(r, m, -pressure * w_m, v.normal)
                if j == area.last:
                    break
                j = neighbours[j, 1]


@compile_part
def _parts(x_f: Vector, x_m: Vector, v: VirtualSlaveNode, area: Area, j: int) -> tuple[float, float]:
    """Return W_f and W_m of master segment j with the nodes f and m."""
    length = dot(minus(x_m, x_f), v.t)
    a, b = 0 * length, 0 * length + 1
    if j == area.first:
        a = dot(arm(x_f, v.p), v.t) / length if area.clip_p == NOT_CUT else 0 * length + area.clip_p
    if j == area.last:
        b = dot(arm(x_f, v.q), v.t) / length if area.clip_q == NOT_CUT else 0 * length + area.clip_q
    w_m = length * (b * b - a * a) / 2
    return length * ((b - a) - (b * b - a * a) / 2), w_m


@compile_part
def virtual_slave_node(x_a: Vector, x_b: Vector, x_1: Vector, x_2: Vector, c_p: float, c_q: float) -> VirtualSlaveNode:
    """Return the virtual slave node in the middle of the area of competence [c_q, c_p] of A B, against 1 2."""
    c = (c_p + c_q) / 2
    p, q = PointOnSegment(x_a, x_b, c_p), PointOnSegment(x_a, x_b, c_q)
    l_12, t, normal = frame(x_1, x_2)
    d = arm(x_1, PointOnSegment(x_a, x_b, c))
    g = cross(d, minus(x_2, x_1)) / l_12
    return VirtualSlaveNode(x_a, x_b, p, q, d, c, c_p, c_q, l_12, t, normal, g)


@compile_part
def sum_of_parts(x: Array, v: VirtualSlaveNode, area: Area, master: IntArray) -> float:
    """Return S = ΣW, which telescopes to s(Q) − s(P), or to a free end in the place of the end that it truncates.

    Where nothing is truncated, it is a multiple of the number by which the pairing decides that the slave faces the
    master. So it is not zero where the pairing decides so, however nearly edge-on the slave is. Elsewhere it is at
    least the projected length of the segment at the free end: the walk went past the other end of that segment.
    """
    if area.clip_p == NOT_CUT and area.clip_q == NOT_CUT:
        return (v.c_q - v.c_p) / 2 * dot(minus(v.x_b, v.x_a), v.t)
    return dot(across_parts(x, v, area, master), v.t)


@compile_part
def across_parts(x: Array, v: VirtualSlaveNode, area: Area, master: IntArray) -> Vector:
    """Return the vector from P to Q, a free end in the place of the end that it truncates."""
    if area.clip_p == NOT_CUT and area.clip_q == NOT_CUT:
        ab, share = minus(v.x_b, v.x_a), (v.c_q - v.c_p) / 2
        return share * ab[0], share * ab[1]
    x_f, x_m = node(x, master[area.first, 0]), node(x, master[area.last, 1])
    if area.clip_q == NOT_CUT:
        return arm(x_f, v.q)
    if area.clip_p == NOT_CUT:
        back = arm(x_m, v.p)
        return -back[0], -back[1]
    return minus(x_m, x_f)


@compile_part
def length_of_area(x_a: Vector, x_b: Vector, ref_a: Vector, ref_b: Vector, current_area: bool) -> float:
    """Return the length of the slave segment A B that counts for the area, of the type of its current positions."""
    l_ab, _, _ = frame(x_a, x_b)
    if not current_area:
        l_0, _, _ = frame(ref_a, ref_b)
        l_ab = 0 * l_ab + l_0
    return l_ab


@compile_kernel
def area_of_competence(
    x: Array, slave: IntArray, master: IntArray, n: int, i: int, cutting: int, cut_p: int, cut_q: int
) -> tuple[float, float]:
    """Return the ends P and Q of the area of competence of virtual slave node i, as c (Box 1).

    Where `cutting` names a master segment, master nodes cut the ends in its frame.
    """
    x_a, x_b = node(x, slave[i // n, 0]), node(x, slave[i // n, 1])
    unity = 1 + 0 * x_a[0]  # has the type of x
    c = middle_of_part(i, n, unity)
    c_p, c_q = c + unity / n, c - unity / n
    if cutting != NOT_CUT:
        _, t, _ = frame(node(x, master[cutting, 0]), node(x, master[cutting, 1]))
        if cut_p != NOT_CUT:
            c_p = _cut_at(x_a, x_b, node(x, cut_p), t)
        if cut_q != NOT_CUT:
            c_q = _cut_at(x_a, x_b, node(x, cut_q), t)
    return c_p, c_q


@compile_part
def _cut_at(x_a: Vector, x_b: Vector, x_e: Vector, t: Vector) -> float:
    """Return where the slave segment A B meets the master node e, both projected along t, as c."""
    return -dot(arm(x_e, PointOnSegment(x_a, x_b, 0.0)), t) / (dot(minus(x_b, x_a), t) / 2)
