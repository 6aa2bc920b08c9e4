"""The exact tangent of VTS-PPT: the derivative of `box3.residual`, as Appendix A of the paper derives it.

A Δ of a number belongs to one node at a time, a column of the tangent: it is the vector of what the number gains for a
displacement of that node along x and along y. Every Δ of a virtual slave node is zero but for its first `N_CORE` local
nodes. Only the Δ of a master segment's part belong to its nodes f and m, too.

Rules for the next editor:

1. What is frozen in the pairing has no Δ.
2. A kernel gets the fields of `Surfaces`, `Areas` and `Options` as plain tuples and unpacks them first; `eq6` says why.
3. `list_couplings` says which nodes feel which. `add_tangent` writes no other block.
4. Nothing is allocated for a point: vectors and named tuples of numbers are free, arrays are not.

Source: Zavarise & De Lorenzis (2009), Eqs. 8–11, A1–A28.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.geometry.block_rows import AnyIntArray, NumberArray, add_column, add_entry, add_row
from contactverif.geometry.compiled import compile_inline, compile_kernel
from contactverif.geometry.projection import PointOnSegment, Vector, arm, dot, frame, minus, node
from contactverif_nts.box3 import (
    BALANCED,
    Area,
    VirtualSlaveNode,
    area_of_competence,
    from_p_to_q,
    length_of_area,
    segment_length,
    sum_of_parts,
    virtual_slave_node,
)
from contactverif_nts.eq6 import Fields
from contactverif_nts.turned_force import ZERO, add_turned_force, plus, times
from contactverif_nts.walk import NOT_CUT

# Local nodes: where the area is cut, the nodes of the segment of the frame and the two that cut; 1, 2, A, B; f, m.
FRAME_1, FRAME_2, CUT_P, CUT_Q, NODE_1, NODE_2, A, B, F, M = range(10)
N_CORE, N_LOCAL = 8, 10
NO_MULTIPLIER = -1


class Cut(NamedTuple):
    """An end of an area of competence, c = c_P or c_Q, that a master node cuts in the frame of a master segment."""

    by: int  # CUT_P or CUT_Q, the local node that cuts, or NOT_CUT
    c: float
    l_12: float
    t: Vector
    normal: Vector
    half: float  # t·(x_B − x_A)/2, what s gains for each unit of c
    lever: float  # (x_c − x_e)·n


class Gains(NamedTuple):
    """Vectors by which the numbers of a virtual slave node grow for a displacement of one node."""

    c_p: Vector
    c_q: Vector
    omega: Vector
    g: Vector
    xi: Vector
    l_ab: Vector


class Lever(NamedTuple):
    """Numbers that all derivatives of one virtual slave node share."""

    xi: float
    per_length: float  # 1/l of the master segment
    t_ab: Vector  # the tangent of the slave segment, or zero where its length is that of the reference configuration
    along: float  # t·(x_B − x_A)/2
    across: float  # n·(x_B − x_A)/2
    p_cut: Cut
    q_cut: Cut


class Force(NamedTuple):
    """The force of a virtual slave node, negative where it presses."""

    stiffness: float  # the penalty, or 1 for a multiplier: the pressure is −stiffness × e
    e: float  # the gap, or −λ
    l_ab: float
    share: float  # (c_P − c_Q)/2
    size: float  # l_AB × share, the force of a unit pressure
    f_v: float  # F_V = stiffness × e × size
    is_spring: bool  # e is the gap, not a multiplier


class Pressure(NamedTuple):
    """The pressure on the master segments of a virtual slave node, negative where it presses."""

    is_balanced: bool
    s: float  # S = ΣW
    size: float  # F_V/S, or stiffness × e
    unit: float  # its derivative by the multiplier, sign reversed


class Part(NamedTuple):
    """The part [a, b] of one master segment f m under an area of competence (Box 3)."""

    length: float  # L_j
    per_length: float  # 1/L_j
    rise: float  # (x_m − x_f)·n
    a: float
    b: float
    a_moves: bool  # a is where P projects, else it is fixed
    b_moves: bool
    a_lever: float  # (x_P − (1−a)x_f − a x_m)·n
    b_lever: float


@compile_kernel
def add_tangent(
    indptr: AnyIntArray,
    indices: AnyIntArray,
    data: FloatArray,
    x: FloatArray,
    multipliers: FloatArray,
    surfaces: Fields,
    areas: Fields,
    options: Fields,
) -> None:
    """Add the derivative of `residual` at one state to a matrix with the pattern of `list_couplings`.

    Parameters
    ----------
    indptr, indices, data : AnyIntArray, AnyIntArray, FloatArray
        The matrix in compressed rows.
    x : FloatArray, shape (n_nodes, 2)
        Positions.
    multipliers : FloatArray, shape (n_multipliers,)
        Multipliers λ, empty for a penalty.
    surfaces, areas, options : Fields
        The fields of `Surfaces`, `Areas` and `Options`.

    References
    ----------
    Zavarise & De Lorenzis (2009), Eqs. A1–A28.
    """
    reference, slave, master, neighbours = surfaces
    partner, first, last, cutting, cut_p, cut_q, clip_p, clip_q, active = areas
    n, transmission, current_area, penalty = options
    has_multipliers = len(multipliers) > 0
    nodes = np.empty(N_LOCAL, dtype=np.int32)
    for i in range(len(active)):
        unknown = x.size + i  # row and column of the multiplier
        if not active[i]:
            if has_multipliers:
                add_entry(indptr, indices, data, unknown, unknown, segment_length(reference, slave, i // n) / n)
            continue
        area = Area(partner[i], first[i], last[i], cutting[i], cut_p[i], cut_q[i], clip_p[i], clip_q[i])
        begin = _fill_nodes(nodes, slave, master, i // n, area)
        x_a, x_b, x_1, x_2 = node(x, nodes[A]), node(x, nodes[B]), node(x, nodes[NODE_1]), node(x, nodes[NODE_2])
        c_p, c_q = area_of_competence(x, slave, master, n, i, area.frame, area.cut_p, area.cut_q)
        l_ab = length_of_area(x_a, x_b, node(reference, nodes[A]), node(reference, nodes[B]), current_area)
        v = virtual_slave_node(x_a, x_b, x_1, x_2, c_p, c_q)
        at = _lever(x, nodes, v, area, current_area)
        stiffness, e = (1.0, -multipliers[i]) if has_multipliers else (penalty, v.g)
        share = (v.c_p - v.c_q) / 2
        f_v = stiffness * e * l_ab * share
        force = Force(stiffness, e, l_ab, share, l_ab * share, f_v, not has_multipliers)
        _add_slave_rows(indptr, indices, data, nodes, begin, v, at, force)
        if has_multipliers:
            _add_constraint(indptr, indices, data, nodes, begin, unknown, v, at, force)
        if area.first == area.last:  # IF only one segment is involved THEN Eq. 6
            _add_eq6_rows(indptr, indices, data, nodes, begin, unknown, v, at, force)
            continue
        s = sum_of_parts(v)  # ELSE assembly of all the involved segments
        pressure = Pressure(False, s, stiffness * e, 1.0)
        if transmission == BALANCED:
            pressure = Pressure(True, s, f_v / s, l_ab * share / s)
        j = area.first
        while True:
            nodes[F], nodes[M] = master[j, 0], master[j, 1]
            part = _part(node(x, nodes[F]), node(x, nodes[M]), v, area, j)
            _add_segment_rows(indptr, indices, data, nodes, begin, unknown, v, at, force, pressure, part)
            if j == area.last:
                break
            j = neighbours[j, 1]


@compile_inline
def _add_slave_rows(
    indptr: AnyIntArray,
    indices: AnyIntArray,
    data: FloatArray,
    nodes: NumberArray,
    begin: int,
    v: VirtualSlaveNode,
    at: Lever,
    force: Force,
) -> None:
    """Add Δ of the forces on A and B, (1 ∓ c)/2 F_V n."""
    c, f_v = v.c, force.f_v
    for k in range(begin, N_CORE):
        d = _gains(k, v, at)
        d_f, d_c = _gain_of_force(d, force), times(0.5, plus(d.c_p, d.c_q))
        d_fa = plus(times((1 - c) / 2, d_f), times(-f_v / 2, d_c))
        d_fb = plus(times((1 + c) / 2, d_f), times(f_v / 2, d_c))
        add_turned_force(indptr, indices, data, nodes[A], nodes[k], v.normal, v.t, (1 - c) / 2 * f_v, d_fa, d.omega)
        add_turned_force(indptr, indices, data, nodes[B], nodes[k], v.normal, v.t, (1 + c) / 2 * f_v, d_fb, d.omega)


@compile_inline
def _add_eq6_rows(
    indptr: AnyIntArray,
    indices: AnyIntArray,
    data: FloatArray,
    nodes: NumberArray,
    begin: int,
    unknown: int,
    v: VirtualSlaveNode,
    at: Lever,
    force: Force,
) -> None:
    """Add Δ of the forces on the nodes of one master segment, −(1−ξ) F_V n and −ξ F_V n."""
    xi, f_v = at.xi, force.f_v
    f_1, f_2 = -(1 - xi) * f_v, -xi * f_v
    for k in range(begin, N_CORE):
        d = _gains(k, v, at)
        d_f = _gain_of_force(d, force)
        d_f1, d_f2 = plus(times(-(1 - xi), d_f), times(f_v, d.xi)), plus(times(-xi, d_f), times(-f_v, d.xi))
        add_turned_force(indptr, indices, data, nodes[NODE_1], nodes[k], v.normal, v.t, f_1, d_f1, d.omega)
        add_turned_force(indptr, indices, data, nodes[NODE_2], nodes[k], v.normal, v.t, f_2, d_f2, d.omega)
    if not force.is_spring:
        _add_push(indptr, indices, data, nodes[NODE_1], unknown, (1 - xi) * force.size, v.normal)
        _add_push(indptr, indices, data, nodes[NODE_2], unknown, xi * force.size, v.normal)


@compile_inline
def _add_segment_rows(
    indptr: AnyIntArray,
    indices: AnyIntArray,
    data: FloatArray,
    nodes: NumberArray,
    begin: int,
    unknown: int,
    v: VirtualSlaveNode,
    at: Lever,
    force: Force,
    pressure: Pressure,
    part: Part,
) -> None:
    """Add Δ of the forces on the nodes f and m of one of several master segments, −pressure × W n (Box 3)."""
    p, s = pressure.size, pressure.s
    w_f, w_m = _shares(part)
    for k in range(begin, N_LOCAL):
        d = _gains(k, v, at)
        d_p = times(force.stiffness, d.g) if force.is_spring else ZERO
        if pressure.is_balanced:
            d_s = _gain_of_sum(k, d, v, at)
            d_p = plus(times(1 / s, _gain_of_force(d, force)), times(-force.f_v / (s * s), d_s))
        d_wf, d_wm = _gains_of_shares(k, d, v, at, part)
        d_ff, d_fm = plus(times(-w_f, d_p), times(-p, d_wf)), plus(times(-w_m, d_p), times(-p, d_wm))
        add_turned_force(indptr, indices, data, nodes[F], nodes[k], v.normal, v.t, -p * w_f, d_ff, d.omega)
        add_turned_force(indptr, indices, data, nodes[M], nodes[k], v.normal, v.t, -p * w_m, d_fm, d.omega)
    if not force.is_spring:
        _add_push(indptr, indices, data, nodes[F], unknown, pressure.unit * w_f, v.normal)
        _add_push(indptr, indices, data, nodes[M], unknown, pressure.unit * w_m, v.normal)


@compile_inline
def _add_constraint(
    indptr: AnyIntArray,
    indices: AnyIntArray,
    data: FloatArray,
    nodes: NumberArray,
    begin: int,
    unknown: int,
    v: VirtualSlaveNode,
    at: Lever,
    force: Force,
) -> None:
    """Add Δ of the constraint −g × size, and what a unit of the multiplier pushes A and B with: −size n."""
    for k in range(begin, N_CORE):
        d = _gains(k, v, at)
        d_size = plus(times(force.share, d.l_ab), times(force.l_ab / 2, minus(d.c_p, d.c_q)))
        d_row = plus(times(-force.size, d.g), times(-v.g, d_size))
        add_row(indptr, indices, data, unknown, nodes[k], d_row[0], d_row[1])
    _add_push(indptr, indices, data, nodes[A], unknown, -(1 - v.c) / 2 * force.size, v.normal)
    _add_push(indptr, indices, data, nodes[B], unknown, -(1 + v.c) / 2 * force.size, v.normal)


@compile_inline
def _fill_nodes(nodes: NumberArray, slave: IntArray, master: IntArray, segment: int, area: Area) -> int:
    """Write the local nodes of a virtual slave node, except f and m, into `nodes`; return the first one."""
    nodes[A], nodes[B] = slave[segment, 0], slave[segment, 1]
    nodes[NODE_1], nodes[NODE_2] = master[area.master, 0], master[area.master, 1]
    if area.frame == NOT_CUT:
        return NODE_1
    nodes[FRAME_1], nodes[FRAME_2] = master[area.frame, 0], master[area.frame, 1]
    nodes[CUT_P] = nodes[FRAME_1] if area.cut_p == NOT_CUT else area.cut_p
    nodes[CUT_Q] = nodes[FRAME_2] if area.cut_q == NOT_CUT else area.cut_q
    return FRAME_1


@compile_kernel
def _cut(x: FloatArray, nodes: NumberArray, by: int, v: VirtualSlaveNode, c: float) -> Cut:
    """Return the cut of the end c of an area by the local node `by`, or one that is none where `by` is NOT_CUT."""
    if by == NOT_CUT:
        return Cut(by, c, 1.0, ZERO, ZERO, 1.0, 0.0)
    l_12, t, normal = frame(node(x, nodes[FRAME_1]), node(x, nodes[FRAME_2]))
    half = dot(minus(v.x_b, v.x_a), t) / 2
    lever = dot(arm(node(x, nodes[by]), PointOnSegment(v.x_a, v.x_b, c)), normal)
    return Cut(by, c, l_12, t, normal, half, lever)


@compile_inline
def _gain_of_cut(k: int, cut: Cut) -> Vector:
    """Return Δc of a cut end for a displacement of the local node k.

    Δc = −[t·(Δx_c − Δx_e) + ((x_c − x_e)·n) ω] / (t·(x_B − x_A)/2), e the cutting node, Δx_c at fixed c.
    """
    along, turning = 0.0, 0.0
    if cut.by == NOT_CUT:
        return ZERO
    if k == A:
        along = -(1 - cut.c) / 2
    elif k == B:
        along = -(1 + cut.c) / 2
    elif k == cut.by:
        along = 1.0
    elif k == FRAME_1:
        turning = cut.lever / cut.l_12
    elif k == FRAME_2:
        turning = -cut.lever / cut.l_12
    return times(1 / cut.half, plus(times(along, cut.t), times(turning, cut.normal)))


@compile_inline
def _lever(x: FloatArray, nodes: NumberArray, v: VirtualSlaveNode, area: Area, current_area: bool) -> Lever:
    """Return what all derivatives of a virtual slave node share."""
    ab, per_length = minus(v.x_b, v.x_a), 1 / v.l_12
    _, t_ab, _ = frame(v.x_a, v.x_b)
    t_ab = t_ab if current_area else ZERO
    p_cut = _cut(x, nodes, NOT_CUT if area.cut_p == NOT_CUT else CUT_P, v, v.c_p)
    q_cut = _cut(x, nodes, NOT_CUT if area.cut_q == NOT_CUT else CUT_Q, v, v.c_q)
    xi = dot(v.d, v.t) / v.l_12
    return Lever(xi, per_length, t_ab, dot(ab, v.t) / 2, dot(ab, v.normal) / 2, p_cut, q_cut)


@compile_inline
def _gains(k: int, v: VirtualSlaveNode, at: Lever) -> Gains:
    """Return Δc_P, Δc_Q, Δω, Δg, Δξ and Δl_AB of V for a displacement of the local node k."""
    c_p, c_q = _gain_of_cut(k, at.p_cut), _gain_of_cut(k, at.q_cut)
    d_c = times(0.5, plus(c_p, c_q))  # Δx_V gains (x_B − x_A)/2 Δc_V where the area is cut
    omega, l_ab, shape = ZERO, ZERO, 0.0
    if k == NODE_1:
        shape, omega = -(1 - at.xi), times(-at.per_length, v.normal)  # ω = n·(Δx2 − Δx1)/l
    elif k == NODE_2:
        shape, omega = -at.xi, times(at.per_length, v.normal)
    elif k == A:
        shape, l_ab = (1 - v.c) / 2, times(-1.0, at.t_ab)  # Δl_AB = t_AB·(Δx_B − Δx_A)
    elif k == B:
        shape, l_ab = (1 + v.c) / 2, at.t_ab
    g = plus(times(shape, v.normal), times(at.across, d_c))  # Δg = n·(Δx_V − (1−ξ)Δx1 − ξΔx2)
    s = plus(times(shape, v.t), times(at.along, d_c))
    d_xi = times(at.per_length, plus(s, times(v.g, omega)))  # l Δξ = t·(Δx_V − (1−ξ)Δx1 − ξΔx2) + g ω
    return Gains(c_p, c_q, omega, g, d_xi, l_ab)


@compile_inline
def _gain_of_force(d: Gains, force: Force) -> Vector:
    """Return ΔF_V = stiffness × (size Δe + e share Δl_AB + e l_AB (Δc_P − Δc_Q)/2)."""
    by_e = times(force.size, d.g) if force.is_spring else ZERO
    by_size = plus(times(force.share, d.l_ab), times(force.l_ab / 2, minus(d.c_p, d.c_q)))
    return times(force.stiffness, plus(by_e, times(force.e, by_size)))


@compile_inline
def _gain_of_sum(k: int, d: Gains, v: VirtualSlaveNode, at: Lever) -> Vector:
    """Return ΔS = t·(Δx_Q − Δx_P) + ((x_Q − x_P)·n) ω, where S = ΣW = s(Q) − s(P)."""
    share = (v.c_p - v.c_q) / 2
    along = share if k == A else (-share if k == B else 0.0)
    d_s = plus(times(along, v.t), times(dot(from_p_to_q(v), v.normal), d.omega))
    return plus(d_s, times(at.along, minus(d.c_q, d.c_p)))


@compile_inline
def _part(x_f: Vector, x_m: Vector, v: VirtualSlaveNode, area: Area, j: int) -> Part:
    """Return the part of master segment j with the nodes f and m, and what its derivative needs."""
    fm = minus(x_m, x_f)
    length, rise = dot(fm, v.t), dot(fm, v.normal)
    a, b, a_lever, b_lever = 0.0, 1.0, 0.0, 0.0
    a_moves, b_moves = j == area.first and area.clip_p == NOT_CUT, j == area.last and area.clip_q == NOT_CUT
    if a_moves:
        fp = arm(x_f, v.p)
        a = dot(fp, v.t) / length
        a_lever = dot(fp, v.normal) - a * rise
    elif j == area.first:
        a = float(area.clip_p)
    if b_moves:
        fq = arm(x_f, v.q)
        b = dot(fq, v.t) / length
        b_lever = dot(fq, v.normal) - b * rise
    elif j == area.last:
        b = float(area.clip_q)
    return Part(length, 1 / length, rise, a, b, a_moves, b_moves, a_lever, b_lever)


@compile_inline
def _shares(part: Part) -> tuple[float, float]:
    """Return W_f and W_m of a part (Eq. 9)."""
    half = (part.b * part.b - part.a * part.a) / 2
    return part.length * ((part.b - part.a) - half), part.length * half


@compile_inline
def _gains_of_shares(k: int, d: Gains, v: VirtualSlaveNode, at: Lever, part: Part) -> tuple[Vector, Vector]:
    """Return ΔW_f and ΔW_m of a part for a displacement of the local node k (A13–A27)."""
    length, a, b = part.length, part.a, part.b
    sign = 1 if k == M else (-1 if k == F else 0)
    d_length = plus(times(sign, v.t), times(part.rise, d.omega))  # ΔL_j = t·(Δx_m − Δx_f) + ((x_m − x_f)·n) ω
    d_a, d_b = ZERO, ZERO
    if part.a_moves:
        d_a = times(part.per_length, _gain_of_end(k, d, v.t, at.along, v.c_p, d.c_p, a, part.a_lever))
    if part.b_moves:
        d_b = times(part.per_length, _gain_of_end(k, d, v.t, at.along, v.c_q, d.c_q, b, part.b_lever))
    moment = minus(times(b, d_b), times(a, d_a))  # b Δb − a Δa
    half = (b * b - a * a) / 2
    d_wm = plus(times(length, moment), times(half, d_length))
    d_wf = plus(times(length, minus(minus(d_b, d_a), moment)), times((b - a) - half, d_length))
    return d_wf, d_wm


@compile_inline
def _gain_of_end(k: int, d: Gains, t: Vector, along: float, c: float, d_c: Vector, end: float, lever: float) -> Vector:
    """Return L_j Δa of the end P at c = c_P, or L_j Δb of Q.

    L_j Δa = t·(Δx_P − (1−a)Δx_f − aΔx_m) + ((x_P − (1−a)x_f − a x_m)·n) ω.
    """
    shape = 0.0
    if k == A:
        shape = (1 - c) / 2
    elif k == B:
        shape = (1 + c) / 2
    elif k == F:
        shape = -(1 - end)
    elif k == M:
        shape = -end
    s = plus(times(shape, t), times(along, d_c))
    return plus(s, times(lever, d.omega))


@compile_inline
def _add_push(
    indptr: AnyIntArray, indices: AnyIntArray, data: FloatArray, row: int, unknown: int, size: float, normal: Vector
) -> None:
    """Add the force size × n on the node `row` to the column of a multiplier."""
    add_column(indptr, indices, data, row, unknown, size * normal[0], size * normal[1])


@compile_kernel
def list_couplings(
    surfaces: Fields, areas: Fields, n: int, first_multiplier: int
) -> tuple[NumberArray, IntArray, IntArray]:
    """List which nodes feel which, as the fields of `Couplings`.

    The slave's forces, and on one segment all, depend on the core nodes. Those of a further master segment depend on
    its own nodes, too. The number of the first multiplier is −1 for a penalty.
    """
    _, slave, master, neighbours = surfaces
    partner, first, last, cutting, cut_p, cut_q, clip_p, clip_q, active = areas
    n_couplings, n_entries = _count_couplings(neighbours, first, last, cutting, active, first_multiplier >= 0)
    listed = np.empty(n_entries, dtype=np.int32)
    starts, first_row = np.empty(n_couplings + 1, dtype=np.int64), np.empty(n_couplings, dtype=np.int64)
    nodes = np.empty(N_LOCAL, dtype=np.int32)
    coupling, place, starts[0] = 0, 0, 0
    for i in range(len(active)):
        multiplier = first_multiplier + i if first_multiplier >= 0 else NO_MULTIPLIER
        if not active[i]:
            if multiplier != NO_MULTIPLIER:
                first_row[coupling] = place
                place = _append(listed, place, nodes, 0, 0, multiplier)
                starts[coupling + 1], coupling = place, coupling + 1
            continue
        area = Area(partner[i], first[i], last[i], cutting[i], cut_p[i], cut_q[i], clip_p[i], clip_q[i])
        begin, is_one = _fill_nodes(nodes, slave, master, i // n, area), area.first == area.last
        first_row[coupling] = place + (NODE_1 if is_one else A) - begin
        place = _append(listed, place, nodes, begin, N_CORE, multiplier)
        starts[coupling + 1], coupling = place, coupling + 1
        j = area.first
        while not is_one:
            nodes[F], nodes[M] = master[j, 0], master[j, 1]
            first_row[coupling] = place + F - begin
            place = _append(listed, place, nodes, begin, N_LOCAL, multiplier)
            starts[coupling + 1], coupling = place, coupling + 1
            if j == area.last:
                break
            j = neighbours[j, 1]
    return listed, starts, first_row


@compile_inline
def _append(listed: NumberArray, place: int, nodes: NumberArray, begin: int, end: int, multiplier: int) -> int:
    """Append the local nodes from begin to end and the multiplier to the list; return the next place."""
    for k in range(begin, end):
        listed[place] = nodes[k]
        place += 1
    if multiplier != NO_MULTIPLIER:
        listed[place] = multiplier
        place += 1
    return place


@compile_kernel
def _count_couplings(
    neighbours: IntArray, first: IntArray, last: IntArray, cutting: IntArray, active: BoolArray, has_multipliers: bool
) -> tuple[int, int]:
    """Return how many couplings there are, and how many entries they have together."""
    n_couplings, n_entries, more = 0, 0, 1 if has_multipliers else 0
    for i in range(len(active)):
        if not active[i]:
            n_couplings, n_entries = n_couplings + more, n_entries + more
            continue
        n_core = N_CORE - NODE_1 if cutting[i] == NOT_CUT else N_CORE
        n_couplings, n_entries = n_couplings + 1, n_entries + n_core + more
        if first[i] == last[i]:
            continue
        j = first[i]
        while True:
            n_couplings, n_entries = n_couplings + 1, n_entries + n_core + 2 + more
            if j == last[i]:
                break
            j = neighbours[j, 1]
    return n_couplings, n_entries
