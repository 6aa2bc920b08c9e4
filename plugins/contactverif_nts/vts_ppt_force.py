"""The residual of VTS-PPT (Box 3): the force of a virtual slave node V, spread over all master segments under its area.

One segment: Eq. 6. Otherwise segment j with nodes f, m and projected length L_j carries the part [a, b] of itself:

    a = (x_P − x_f)·t / L_j on the first segment, else 0        b = (x_Q − x_f)·t / L_j on the last, else 1
    W_m = L_j (b² − a²)/2                                        W_f = L_j [(b − a) − (b² − a²)/2]

Printed: the slave nodes get Eq. 6 with F_V = ε̂ g l_AB (c_P − c_Q)/2, the master nodes −ε̂ g W n. Balanced: the master
nodes get −F_V (W/S) n with S = ΣW, so that action equals reaction. Where a free end truncates the parts, S is the
sum of what is left: the master gets the whole force there too, on its last nodes.

With multipliers −λ stands for ε̂ g on both sides. Each virtual slave node then has a constraint row: −F_V/(ε̂ g) × g
where it is active, λ × its share of the slave segment's reference length where it is not. Arrays of multipliers without
columns mean a penalty.

Rules for the next editor:

1. All decisions are in the pairing (`walk.Areas`). Nothing here compares real numbers.
2. `add_residual` takes float64 and complex128, so a number that starts as a constant gets the type of x first.
3. A kernel gets plain tuples and unpacks them first; `nts_force` says why, and what `surfaces` are. `areas` are the
   fields of `walk.Areas`. `options` are n, the number of virtual slave nodes on a slave segment, PRINTED or BALANCED,
   whether lengths are measured in the current configuration, and the penalty.
4. `vts_ppt_tangent` differentiates this file line by line. Change both.

Source: Zavarise & De Lorenzis (2009), Box 3, Eqs. 6, 8, 9.
"""

from typing import NamedTuple

from contactverif.compiler import compile_kernel, compile_part
from contactverif.contract.arrays import Array, IntArray
from contactverif.geometry.block_rows import Fields
from contactverif.geometry.projection import PointOnSegment, Vector, arm, cross, dot, frame, minus, node
from contactverif_nts.nts_force import area_length, push
from contactverif_nts.walk import NOT_CUT, middle_of_part

PRINTED, BALANCED = 0, 1  # How the master side gets its share.


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
