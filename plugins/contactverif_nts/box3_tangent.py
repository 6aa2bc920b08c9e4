"""The exact tangent of VTS-PPT: the derivative of `box3.residual`, as Appendix A of the paper derives it.

A Δ of a number is an array (n_local, 2): what the number gains for each displacement of each local node. Every Δ of a
virtual slave node depends on the first `N_CORE` local nodes at most. Only the Δ of a master segment's part depend on
its nodes f and m, too.

Rules for the next editor:

1. What is frozen in the pairing has no Δ.
2. A kernel gets the fields of `Surfaces`, `Areas` and `Options` as plain tuples and unpacks them first; `eq6` says why.
3. Entries of one place add up, so the order of entries does not matter; their number does (`_count_entries`).

Source: Zavarise & De Lorenzis (2009), Eqs. 8–11, A1–A28.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.geometry.compiled import compile_kernel
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
from contactverif_nts.walk import NOT_CUT

# Local nodes: A, B, 1, 2; where the area is cut, the nodes of the segment of the frame and the two that cut; f, m.
A, B, NODE_1, NODE_2, FRAME_1, FRAME_2, CUT_P, CUT_Q, F, M = range(10)
N_UNCUT, N_CORE, N_LOCAL = 4, 8, 10
NO_MULTIPLIER = -1


class Local(NamedTuple):
    """The numbers that all entries of one virtual slave node share."""

    n_core: int  # N_UNCUT, or N_CORE where the area is cut
    unknown: int  # row and column of the multiplier, or NO_MULTIPLIER
    t: Vector
    normal: Vector


class Pressure(NamedTuple):
    """The pressure on the master segments of one virtual slave node, negative where it presses."""

    size: float
    by_multiplier: float  # its derivative by the multiplier, sign reversed


@compile_kernel
def tangent(
    x: FloatArray, multipliers: FloatArray, surfaces: Fields, areas: Fields, options: Fields
) -> tuple[IntArray, IntArray, FloatArray]:
    """Compute the derivative of `residual` at one state, as rows, columns and values; entries of one place add up.

    Parameters
    ----------
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
    n_entries = _count_entries(neighbours, first, last, cutting, active, has_multipliers)
    index, values, place = np.empty((2, n_entries), dtype=np.int64), np.empty(n_entries), 0
    nodes, gains = np.empty(N_LOCAL, dtype=np.int64), np.empty((7, N_CORE, 2))
    d_cp, d_cq, d_omega, d_g, d_xi, d_l, d_pressure = gains
    for i in range(len(active)):
        unknown = x.size + i if has_multipliers else NO_MULTIPLIER
        if not active[i]:
            if has_multipliers:
                index[0, place], index[1, place] = unknown, unknown
                values[place] = segment_length(reference, slave, i // n) / n
                place += 1
            continue
        area = Area(partner[i], first[i], last[i], cutting[i], cut_p[i], cut_q[i], clip_p[i], clip_q[i])
        n_core = _fill_nodes(nodes, slave[i // n], master, area)
        x_a, x_b, x_1, x_2 = node(x, nodes[A]), node(x, nodes[B]), node(x, nodes[NODE_1]), node(x, nodes[NODE_2])
        c_p, c_q = area_of_competence(x, slave, master, n, i, area.frame, area.cut_p, area.cut_q)
        l_ab = length_of_area(x_a, x_b, node(reference, nodes[A]), node(reference, nodes[B]), current_area)
        v = virtual_slave_node(x_a, x_b, x_1, x_2, c_p, c_q)
        _fill_gains(gains, x, nodes, area, v, current_area)
        at = Local(n_core, unknown, v.t, v.normal)

        c, d_c, share = v.c, (d_cp + d_cq) / 2, (v.c_p - v.c_q) / 2
        stiffness, e, d_e = penalty, v.g, d_g  # the pressure is −stiffness × e
        if has_multipliers:
            stiffness, e, d_e = 1.0, -multipliers[i], np.zeros((N_CORE, 2))
            d_row = -(share * (l_ab * d_g + v.g * d_l) + v.g * l_ab * (d_cp - d_cq) / 2)
            place = _add_constraint(index, values, place, nodes, at, d_row)
        size = l_ab * share  # the force of a unit pressure
        f_v = stiffness * e * l_ab * share
        d_f = stiffness * share * (l_ab * d_e + e * d_l) + stiffness * e * l_ab * (d_cp - d_cq) / 2
        d_fa, d_fb = (1 - c) / 2 * d_f - f_v / 2 * d_c, (1 + c) / 2 * d_f + f_v / 2 * d_c
        place = _add_force(index, values, place, nodes, at, A, (1 - c) / 2 * f_v, d_fa, d_omega, (1 - c) / 2 * size)
        place = _add_force(index, values, place, nodes, at, B, (1 + c) / 2 * f_v, d_fb, d_omega, (1 + c) / 2 * size)
        if area.first == area.last:
            xi = dot(v.d, v.t) / v.l_12
            d_f1, d_f2 = -(1 - xi) * d_f + f_v * d_xi, -xi * d_f - f_v * d_xi
            f_1, size_1 = -(1 - xi) * f_v, -(1 - xi) * size
            place = _add_force(index, values, place, nodes, at, NODE_1, f_1, d_f1, d_omega, size_1)
            place = _add_force(index, values, place, nodes, at, NODE_2, -xi * f_v, d_f2, d_omega, -xi * size)
            continue
        pressure = Pressure(stiffness * e, 1.0)
        d_pressure[:] = stiffness * d_e
        if transmission == BALANCED:
            s, d_s = _sum_of_parts(v, d_cp, d_cq, d_omega)
            pressure = Pressure(f_v / s, size / s)
            d_pressure[:] = d_f / s - f_v * d_s / (s * s)
        place = _add_segments(index, values, place, nodes, at, x, master, neighbours, area, v, gains, pressure)
    return index[0], index[1], values


@compile_kernel
def _fill_nodes(nodes: IntArray, ab: IntArray, master: IntArray, area: Area) -> int:
    """Write the local nodes of a virtual slave node, except f and m, into `nodes`; return how many there are."""
    nodes[A], nodes[B] = ab
    nodes[NODE_1], nodes[NODE_2] = master[area.master, 0], master[area.master, 1]
    if area.frame == NOT_CUT:
        return N_UNCUT
    nodes[FRAME_1], nodes[FRAME_2] = master[area.frame, 0], master[area.frame, 1]
    nodes[CUT_P] = nodes[FRAME_1] if area.cut_p == NOT_CUT else area.cut_p
    nodes[CUT_Q] = nodes[FRAME_2] if area.cut_q == NOT_CUT else area.cut_q
    return N_CORE


@compile_kernel
def _fill_gains(
    gains: FloatArray, x: FloatArray, nodes: IntArray, area: Area, v: VirtualSlaveNode, current_area: bool
) -> None:
    """Write Δc_P, Δc_Q, Δω, Δg, Δξ and Δl_AB of V into `gains` (7, N_CORE, 2); the last Δ, of the pressure, is zero."""
    gains[:] = 0.0
    d_cp, d_cq, d_omega, d_g, d_xi, d_l, _ = gains
    if area.cut_p != NOT_CUT:
        _add_cut(d_cp, x, nodes, CUT_P, v.c_p)
    if area.cut_q != NOT_CUT:
        _add_cut(d_cq, x, nodes, CUT_Q, v.c_q)
    d_c = (d_cp + d_cq) / 2
    ab, xi = minus(v.x_b, v.x_a), dot(v.d, v.t) / v.l_12
    for i in range(2):
        d_omega[NODE_1, i] = -v.normal[i] / v.l_12  # ω = n·(Δx2 − Δx1)/l
        d_omega[NODE_2, i] = v.normal[i] / v.l_12
        for k, shape in ((A, (1 - v.c) / 2), (B, (1 + v.c) / 2), (NODE_1, -(1 - xi)), (NODE_2, -xi)):
            d_g[k, i] = shape * v.normal[i]  # Δg = n·(Δx_V − (1−ξ)Δx1 − ξΔx2)
            d_xi[k, i] = shape * v.t[i] / v.l_12  # l Δξ = t·(Δx_V − (1−ξ)Δx1 − ξΔx2) + g ω
    d_g += dot(ab, v.normal) / 2 * d_c  # Δx_V gains (x_B − x_A)/2 Δc_V
    d_xi += dot(ab, v.t) / 2 * d_c / v.l_12 + v.g * d_omega / v.l_12
    if current_area:
        _, t_ab, _ = frame(v.x_a, v.x_b)
        for i in range(2):  # Δl_AB = t_AB·(Δx_B − Δx_A)
            d_l[A, i], d_l[B, i] = -t_ab[i], t_ab[i]


@compile_kernel
def _add_cut(d_c: FloatArray, x: FloatArray, nodes: IntArray, cutting_node: int, c: float) -> None:
    """Add Δ of the cut end c = c_P or c_Q, in the frame of the segment that cuts.

    Δc = −[t·(Δx_c − Δx_e) + ((x_c − x_e)·n) ω] / (t·(x_B − x_A)/2), e the cutting node, Δx_c at fixed c.
    """
    x_a, x_b, x_e = node(x, nodes[A]), node(x, nodes[B]), node(x, nodes[cutting_node])
    l_12, t, normal = frame(node(x, nodes[FRAME_1]), node(x, nodes[FRAME_2]))
    half = dot(minus(x_b, x_a), t) / 2
    lever = dot(arm(x_e, PointOnSegment(x_a, x_b, c)), normal)
    for i in range(2):
        d_c[A, i] -= (1 - c) / 2 * t[i] / half
        d_c[B, i] -= (1 + c) / 2 * t[i] / half
        d_c[cutting_node, i] += t[i] / half
        d_c[FRAME_1, i] += lever * normal[i] / l_12 / half
        d_c[FRAME_2, i] -= lever * normal[i] / l_12 / half


@compile_kernel
def _sum_of_parts(
    v: VirtualSlaveNode, d_cp: FloatArray, d_cq: FloatArray, d_omega: FloatArray
) -> tuple[float, FloatArray]:
    """Return S = ΣW = s(Q) − s(P) and ΔS = t·(Δx_Q − Δx_P) + ((x_Q − x_P)·n) ω."""
    pq = from_p_to_q(v)
    share = (v.c_p - v.c_q) / 2
    d_s = dot(pq, v.normal) * d_omega + dot(minus(v.x_b, v.x_a), v.t) / 2 * (d_cq - d_cp)
    for i in range(2):
        d_s[A, i] += share * v.t[i]
        d_s[B, i] -= share * v.t[i]
    return sum_of_parts(v), d_s


@compile_kernel
def _add_segments(
    index: IntArray,
    values: FloatArray,
    place: int,
    nodes: IntArray,
    at: Local,
    x: FloatArray,
    master: IntArray,
    neighbours: IntArray,
    area: Area,
    v: VirtualSlaveNode,
    gains: FloatArray,
    pressure: Pressure,
) -> int:
    """Enter Δ of −pressure × W n for all involved master segments; return the next place."""
    d_cp, d_cq, d_omega, _, _, _, d_pressure = gains
    p, unit = pressure
    d_p = np.zeros((N_LOCAL, 2))
    d_p[:N_CORE] = d_pressure
    j = area.first
    while True:
        nodes[F], nodes[M] = master[j, 0], master[j, 1]
        x_f, x_m = node(x, nodes[F]), node(x, nodes[M])
        length = dot(minus(x_m, x_f), v.t)
        d_length, d_a, d_b = np.zeros((3, N_LOCAL, 2))
        d_length[:N_CORE] = dot(minus(x_m, x_f), v.normal) * d_omega  # ΔL_j = t·(Δx_m − Δx_f) + ((x_m − x_f)·n) ω
        for i in range(2):
            d_length[F, i] -= v.t[i]
            d_length[M, i] += v.t[i]
        a, b = 0.0, 1.0
        if j == area.first:
            a = _end_of_part(d_a, v, v.p, d_cp, area.clip_p, x_f, x_m, d_omega)
        if j == area.last:
            b = _end_of_part(d_b, v, v.q, d_cq, area.clip_q, x_f, x_m, d_omega)
        w_m = length * (b * b - a * a) / 2
        w_f = length * ((b - a) - (b * b - a * a) / 2)
        d_wm = length * (b * d_b - a * d_a) + (b * b - a * a) / 2 * d_length
        d_wf = length * (d_b - d_a - (b * d_b - a * d_a)) + ((b - a) - (b * b - a * a) / 2) * d_length
        d_ff, d_fm = -(w_f * d_p + p * d_wf), -(w_m * d_p + p * d_wm)
        place = _add_force(index, values, place, nodes, at, F, -p * w_f, d_ff, d_omega, -unit * w_f)
        place = _add_force(index, values, place, nodes, at, M, -p * w_m, d_fm, d_omega, -unit * w_m)
        if j == area.last:
            return place
        j = neighbours[j, 1]


@compile_kernel
def _end_of_part(
    d_end: FloatArray,
    v: VirtualSlaveNode,
    p: PointOnSegment,
    d_c_end: FloatArray,
    clip: int,
    x_f: Vector,
    x_m: Vector,
    d_omega: FloatArray,
) -> float:
    """Return where the end p of the area lies on the master segment f m, a of P or b of Q, and add its Δ to `d_end`.

    L_j Δa = t·(Δx_P − (1−a)Δx_f − aΔx_m) + ((x_P − (1−a)x_f − a x_m)·n) ω, likewise b with Q. A clipped end is fixed.
    """
    if clip != NOT_CUT:
        return float(clip)
    fm, fp = minus(x_m, x_f), arm(x_f, p)
    length = dot(fm, v.t)
    end = dot(fp, v.t) / length
    lever = dot(fp, v.normal) - end * dot(fm, v.normal)
    d_end[:N_CORE] += (lever * d_omega + dot(minus(v.x_b, v.x_a), v.t) / 2 * d_c_end) / length
    for i in range(2):
        d_end[A, i] += (1 - p.c) / 2 * v.t[i] / length
        d_end[B, i] += (1 + p.c) / 2 * v.t[i] / length
        d_end[F, i] -= (1 - end) * v.t[i] / length
        d_end[M, i] -= end * v.t[i] / length
    return end


@compile_kernel
def _add_constraint(
    index: IntArray, values: FloatArray, place: int, nodes: IntArray, at: Local, d_row: FloatArray
) -> int:
    """Enter Δ of the constraint of a multiplier as one row; return the next place."""
    for column in range(at.n_core):
        for j in range(2):
            index[0, place], index[1, place], values[place] = at.unknown, 2 * nodes[column] + j, d_row[column, j]
            place += 1
    return place


@compile_kernel
def _add_force(
    index: IntArray,
    values: FloatArray,
    place: int,
    nodes: IntArray,
    at: Local,
    k: int,
    force: float,
    d_force: FloatArray,
    d_omega: FloatArray,
    size: float,
) -> int:
    """Enter Δ(force n) = n Δforce + force Δn as two rows, those of local node k; return the next place.

    Δn = −t ω. A multiplier adds its column: a unit of it pushes with −size n.
    """
    for i in range(2):
        for column in range(len(d_force)):
            if at.n_core <= column < N_CORE:
                continue
            for j in range(2):
                value = at.normal[i] * d_force[column, j]
                if column < N_CORE:
                    value -= force * at.t[i] * d_omega[column, j]
                index[0, place] = 2 * nodes[k] + i
                index[1, place] = 2 * nodes[column] + j
                values[place] = value
                place += 1
        if at.unknown != NO_MULTIPLIER:
            index[0, place], index[1, place], values[place] = 2 * nodes[k] + i, at.unknown, -size * at.normal[i]
            place += 1
    return place


@compile_kernel
def _count_entries(
    neighbours: IntArray, first: IntArray, last: IntArray, cutting: IntArray, active: BoolArray, has_multipliers: bool
) -> int:
    """Return how many entries the tangent has."""
    n_entries, more = 0, 2 if has_multipliers else 0  # a node's entries in the column of a multiplier
    for i in range(len(active)):
        if not active[i]:
            n_entries += more // 2
            continue
        n_core = N_UNCUT if cutting[i] == NOT_CUT else N_CORE
        n_entries += more * n_core
        if first[i] == last[i]:
            n_entries += 4 * (4 * n_core + more)
            continue
        n_entries += 2 * (4 * n_core + more)
        j = first[i]
        while True:
            n_entries += 2 * (4 * (n_core + 2) + more)
            if j == last[i]:
                break
            j = neighbours[j, 1]
    return n_entries
