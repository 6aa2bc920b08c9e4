"""VTS-PPT: from a virtual slave node to all master segments under its area of competence, and the exact tangent.

One segment: Eq. 6. Otherwise segment j with nodes f, m and projected length L_j carries the part [a, b] of itself:

    a = (x_P − x_f)·t / L_j on the first segment, else 0        b = (x_Q − x_f)·t / L_j on the last, else 1
    W_m = L_j (b² − a²)/2                                        W_f = L_j [(b − a) − (b² − a²)/2]

Printed: R_V by Eq. 6's slave rows with F_V = ε̂ g l_AB (c_P − c_Q)/2, and −ε̂ g W n on the master nodes. Balanced:
−F_V (W/S) n with S = ΣW, so that action equals reaction.

With multipliers −λ stands for ε̂ g on both sides, and each virtual slave node has a row: −F_V/(ε̂ g) × g where it is
active, λ × its share of the slave segment's reference length where it is not. Arrays of multipliers without columns
mean a penalty.

The tangent follows Appendix A. A Δ is a row: what a number gains for each displacement of each of the `CORE` nodes that
all numbers of a virtual slave node hang on (A, B, 1, 2, and where its area is cut the segment of the frame and the
cutting nodes), and behind them of f and m.

Source: Zavarise & De Lorenzis (2009), Box 3, Eqs. 6, 8–11, A1–A28.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.geometry.compiled import compiled
from contactverif.geometry.projection import Vector, between, dot, frame, minus, node
from contactverif_nts.eq6 import push
from contactverif_nts.walk import NOT_CUT

PRINTED, BALANCED = 0, 1  # how the master side gets its share

A, B, ONE, TWO, FRAME_1, FRAME_2, CUT_P, CUT_Q, F, M = range(10)  # local nodes
CORE = 8
N_LOCAL = 10
NO_MULTIPLIER = -1


@compiled
def cut_at(x_a: Vector, x_b: Vector, x_e: Vector, t: Vector) -> float:
    """Where on the slave segment A B its projection along t meets that of the master node e, as c."""
    return dot(minus(x_e, between(x_a, x_b, 0.0)), t) / (dot(minus(x_b, x_a), t) / 2)


@compiled
def area_of_competence(
    x: Array, slave: IntArray, master: IntArray, point: int, n: int, cutting: int, cut_p: int, cut_q: int
) -> tuple[float, float]:
    """The ends P and Q of the area of competence, as c; cut where a node says so."""
    c = -1 + (2 * (point % n) + 1) / n
    x_a, x_b = node(x, slave[point // n, 0]), node(x, slave[point // n, 1])
    zero = 0 * x_a[0]  # of the type of x
    c_p, c_q = c + 1 / n + zero, c - 1 / n + zero
    if cutting != NOT_CUT:
        _, t, _ = frame(node(x, master[cutting, 0]), node(x, master[cutting, 1]))
        if cut_p != NOT_CUT:
            c_p = cut_at(x_a, x_b, node(x, cut_p), t)
        if cut_q != NOT_CUT:
            c_q = cut_at(x_a, x_b, node(x, cut_q), t)
    return c_p, c_q


@compiled
def residual(
    x: Array,
    multipliers: Array,
    reference: FloatArray,
    slave: IntArray,
    master: IntArray,
    neighbours: IntArray,
    partner: IntArray,
    first: IntArray,
    last: IntArray,
    cutting: IntArray,
    cut_p: IntArray,
    cut_q: IntArray,
    clip_p: IntArray,
    clip_q: IntArray,
    active: BoolArray,
    n: int,
    transmission: int,
    current_area: bool,
    penalty: float,
) -> tuple[Array, Array]:
    """Nodal forces (n_states, n_nodes, 2) and constraint rows (n_states, n_multipliers), at x and multipliers alike."""
    forces, rows = np.zeros_like(x), np.zeros_like(multipliers)
    held = multipliers.shape[1] > 0
    for state in range(x.shape[0]):
        now, r = x[state], forces[state]
        for point in range(len(active)):
            node_a, node_b = slave[point // n, 0], slave[point // n, 1]
            if not active[point]:
                if held:
                    l_0, _, _ = frame(node(reference, node_a), node(reference, node_b))
                    rows[state, point] = multipliers[state, point] * l_0 / n
                continue
            node_1, node_2 = master[partner[point], 0], master[partner[point], 1]
            x_a, x_b, x1 = node(now, node_a), node(now, node_b), node(now, node_1)
            c_p, c_q = area_of_competence(now, slave, master, point, n, cutting[point], cut_p[point], cut_q[point])
            c = (c_p + c_q) / 2
            x_v = between(x_a, x_b, c)
            l_12, t, normal = frame(x1, node(now, node_2))
            g = dot(minus(x_v, x1), normal)

            pressure = -multipliers[state, point] if held else penalty * g  # its negative
            l_ab, _, _ = frame(x_a, x_b)
            if not current_area:
                l_0, _, _ = frame(node(reference, node_a), node(reference, node_b))
                l_ab = 0 * l_ab + l_0
            f_v = pressure * l_ab * (c_p - c_q) / 2
            if held:
                rows[state, point] = -g * l_ab * (c_p - c_q) / 2
            push(r, node_a, (1 - c) / 2 * f_v, normal)
            push(r, node_b, (1 + c) / 2 * f_v, normal)

            if first[point] == last[point]:
                xi = dot(minus(x_v, x1), t) / l_12
                push(r, node_1, -(1 - xi) * f_v, normal)
                push(r, node_2, -xi * f_v, normal)
                continue

            x_p, x_q = between(x_a, x_b, c_p), between(x_a, x_b, c_q)
            if transmission == BALANCED:
                pressure = f_v / dot(minus(x_q, x_p), t)  # S = ΣW telescopes to s(Q) − s(P)
            j = first[point]
            while True:
                f, m = master[j, 0], master[j, 1]
                x_f, x_m = node(now, f), node(now, m)
                length = dot(minus(x_m, x_f), t)
                a, b = 0 * length, 0 * length + 1
                if j == first[point]:
                    a = dot(minus(x_p, x_f), t) / length
                    if clip_p[point] != NOT_CUT:
                        a = 0 * length + clip_p[point]
                if j == last[point]:
                    b = dot(minus(x_q, x_f), t) / length
                    if clip_q[point] != NOT_CUT:
                        b = 0 * length + clip_q[point]
                w_m = length * (b * b - a * a) / 2
                w_f = length * ((b - a) - (b * b - a * a) / 2)
                push(r, f, -pressure * w_f, normal)
                push(r, m, -pressure * w_m, normal)
                if j == last[point]:
                    break
                j = neighbours[j, 1]
    return forces, rows


@compiled
def tangent(
    x: FloatArray,
    multipliers: FloatArray,
    reference: FloatArray,
    slave: IntArray,
    master: IntArray,
    neighbours: IntArray,
    partner: IntArray,
    first: IntArray,
    last: IntArray,
    cutting: IntArray,
    cut_p: IntArray,
    cut_q: IntArray,
    clip_p: IntArray,
    clip_q: IntArray,
    active: BoolArray,
    n: int,
    transmission: int,
    current_area: bool,
    penalty: float,
) -> tuple[IntArray, IntArray, FloatArray]:
    """Rows, columns and values of the tangent at x (n_nodes, 2), multipliers (n,); entries of one place add up."""
    held = len(multipliers) > 0
    n_entries = _count_entries(neighbours, first, last, cutting, active, held)
    rows = np.empty(n_entries, dtype=np.int64)
    columns = np.empty(n_entries, dtype=np.int64)
    values = np.empty(n_entries)
    place = 0
    nodes = np.empty(N_LOCAL, dtype=np.int64)
    for point in range(len(active)):
        own = x.size + point if held else NO_MULTIPLIER  # row and column of its multiplier
        if not active[point]:
            if held:
                l_0, _, _ = frame(node(reference, slave[point // n, 0]), node(reference, slave[point // n, 1]))
                rows[place], columns[place], values[place] = own, own, l_0 / n
                place += 1
            continue
        n_core = 4 if cutting[point] == NOT_CUT else CORE
        nodes[A], nodes[B] = slave[point // n, 0], slave[point // n, 1]
        nodes[ONE], nodes[TWO] = master[partner[point], 0], master[partner[point], 1]
        x_a, x_b, x1 = node(x, nodes[A]), node(x, nodes[B]), node(x, nodes[ONE])
        c_p, c_q = area_of_competence(x, slave, master, point, n, cutting[point], cut_p[point], cut_q[point])
        c = (c_p + c_q) / 2
        share = (c_p - c_q) / 2
        x_v, x_p, x_q = between(x_a, x_b, c), between(x_a, x_b, c_p), between(x_a, x_b, c_q)
        l_12, t, normal = frame(x1, node(x, nodes[TWO]))
        g = dot(minus(x_v, x1), normal)
        xi = dot(minus(x_v, x1), t) / l_12
        ab = minus(x_b, x_a)

        d_cp, d_cq = np.zeros((2, CORE, 2))
        if n_core == CORE:
            nodes[FRAME_1], nodes[FRAME_2] = master[cutting[point], 0], master[cutting[point], 1]
            nodes[CUT_P] = nodes[FRAME_1] if cut_p[point] == NOT_CUT else cut_p[point]
            nodes[CUT_Q] = nodes[FRAME_2] if cut_q[point] == NOT_CUT else cut_q[point]
            if cut_p[point] != NOT_CUT:
                _cut_gains(d_cp, x, nodes, CUT_P, c_p)
            if cut_q[point] != NOT_CUT:
                _cut_gains(d_cq, x, nodes, CUT_Q, c_q)
        d_c = (d_cp + d_cq) / 2

        d_omega, d_g, d_xi, d_l = np.zeros((4, CORE, 2))
        for i in range(2):
            d_omega[ONE, i] = -normal[i] / l_12  # ω = n·(Δx2 − Δx1)/l
            d_omega[TWO, i] = normal[i] / l_12
            for k, shape in ((A, (1 - c) / 2), (B, (1 + c) / 2), (ONE, -(1 - xi)), (TWO, -xi)):
                d_g[k, i] = shape * normal[i]  # Δg = n·(Δx_V − (1−ξ)Δx1 − ξΔx2)
                d_xi[k, i] = shape * t[i] / l_12  # l Δξ = t·(Δx_V − (1−ξ)Δx1 − ξΔx2) + g ω
        d_g += dot(ab, normal) / 2 * d_c  # Δx_V gains (x_B − x_A)/2 Δc_V
        d_xi += dot(ab, t) / 2 * d_c / l_12 + g * d_omega / l_12

        if current_area:
            l_ab, t_ab, _ = frame(x_a, x_b)
            for i in range(2):  # Δl_AB = t_AB·(Δx_B − Δx_A)
                d_l[A, i], d_l[B, i] = -t_ab[i], t_ab[i]
        else:
            l_ab, _, _ = frame(node(reference, nodes[A]), node(reference, nodes[B]))
        stiffness, e, d_e, area = penalty, g, d_g, l_ab * share  # the pressure is −stiffness × e
        if held:
            stiffness, e, d_e = 1.0, -multipliers[point], np.zeros((CORE, 2))
            d_row = -(share * (l_ab * d_g + g * d_l) + g * l_ab * (d_cp - d_cq) / 2)
            for column in range(n_core):
                for i in range(2):
                    rows[place], columns[place], values[place] = own, 2 * nodes[column] + i, d_row[column, i]
                    place += 1
        f_v = stiffness * e * l_ab * share
        d_f = stiffness * share * (l_ab * d_e + e * d_l) + stiffness * e * l_ab * (d_cp - d_cq) / 2

        place = _fill(rows, columns, values, place, nodes, n_core, A, (1 - c) / 2 * f_v,
                      (1 - c) / 2 * d_f - f_v / 2 * d_c, d_omega, t, normal, own, (1 - c) / 2 * area)  # fmt: skip
        place = _fill(rows, columns, values, place, nodes, n_core, B, (1 + c) / 2 * f_v,
                      (1 + c) / 2 * d_f + f_v / 2 * d_c, d_omega, t, normal, own, (1 + c) / 2 * area)  # fmt: skip

        if first[point] == last[point]:
            place = _fill(rows, columns, values, place, nodes, n_core, ONE, -(1 - xi) * f_v,
                          -(1 - xi) * d_f + f_v * d_xi, d_omega, t, normal, own, -(1 - xi) * area)  # fmt: skip
            place = _fill(rows, columns, values, place, nodes, n_core, TWO, -xi * f_v,
                          -xi * d_f - f_v * d_xi, d_omega, t, normal, own, -xi * area)  # fmt: skip
            continue

        pressure, carried = stiffness * e, 1.0  # on the master, and how much of the point's own
        d_pressure = np.zeros((N_LOCAL, 2))
        d_pressure[:CORE] = stiffness * d_e
        if transmission == BALANCED:
            s = dot(minus(x_q, x_p), t)  # S = ΣW; ΔS = t·(Δx_Q − Δx_P) + ((x_Q − x_P)·n) ω
            d_s = dot(minus(x_q, x_p), normal) * d_omega + dot(ab, t) / 2 * (d_cq - d_cp)
            for i in range(2):
                d_s[A, i] += share * t[i]
                d_s[B, i] -= share * t[i]
            pressure, carried = f_v / s, area / s
            d_pressure[:CORE] = d_f / s - f_v * d_s / (s * s)

        j = first[point]
        while True:
            nodes[F], nodes[M] = master[j, 0], master[j, 1]
            x_f, x_m = node(x, nodes[F]), node(x, nodes[M])
            length = dot(minus(x_m, x_f), t)
            d_length = np.zeros((N_LOCAL, 2))
            d_length[:CORE] = dot(minus(x_m, x_f), normal) * d_omega  # ΔL_j = t·(Δx_m − Δx_f) + ((x_m − x_f)·n) ω
            for i in range(2):
                d_length[F, i] -= t[i]
                d_length[M, i] += t[i]
            a, b = 0.0, 1.0
            d_a, d_b = np.zeros((2, N_LOCAL, 2))
            if j == first[point]:
                if clip_p[point] == NOT_CUT:
                    a = dot(minus(x_p, x_f), t) / length
                    _end_gains(d_a, x_p, c_p, d_cp, a, x_f, x_m, length, ab, t, normal, d_omega)
                else:
                    a = float(clip_p[point])
            if j == last[point]:
                if clip_q[point] == NOT_CUT:
                    b = dot(minus(x_q, x_f), t) / length
                    _end_gains(d_b, x_q, c_q, d_cq, b, x_f, x_m, length, ab, t, normal, d_omega)
                else:
                    b = float(clip_q[point])
            w_m = length * (b * b - a * a) / 2
            w_f = length * ((b - a) - (b * b - a * a) / 2)
            d_wm = length * (b * d_b - a * d_a) + (b * b - a * a) / 2 * d_length
            d_wf = length * (d_b - d_a - (b * d_b - a * d_a)) + ((b - a) - (b * b - a * a) / 2) * d_length
            place = _fill(rows, columns, values, place, nodes, n_core, F, -pressure * w_f,
                          -(w_f * d_pressure + pressure * d_wf), d_omega, t, normal, own, -carried * w_f)  # fmt: skip
            place = _fill(rows, columns, values, place, nodes, n_core, M, -pressure * w_m,
                          -(w_m * d_pressure + pressure * d_wm), d_omega, t, normal, own, -carried * w_m)  # fmt: skip
            if j == last[point]:
                break
            j = neighbours[j, 1]
    return rows, columns, values


@compiled
def _cut_gains(d_c: FloatArray, x: FloatArray, nodes: IntArray, cutting_node: int, c: float) -> None:
    """Δc = −[t·(Δx_c − Δx_e) + ((x_c − x_e)·n) ω] / (t·(x_B − x_A)/2), in the frame of the segment that cuts."""
    x_a, x_b, x_e = node(x, nodes[A]), node(x, nodes[B]), node(x, nodes[cutting_node])
    l_12, t, normal = frame(node(x, nodes[FRAME_1]), node(x, nodes[FRAME_2]))
    half = dot(minus(x_b, x_a), t) / 2
    lever = dot(minus(between(x_a, x_b, c), x_e), normal)
    for i in range(2):
        d_c[A, i] -= (1 - c) / 2 * t[i] / half
        d_c[B, i] -= (1 + c) / 2 * t[i] / half
        d_c[cutting_node, i] += t[i] / half
        d_c[FRAME_1, i] += lever * normal[i] / l_12 / half
        d_c[FRAME_2, i] -= lever * normal[i] / l_12 / half


@compiled
def _end_gains(
    d_end: FloatArray,
    x_end: Vector,
    c_end: float,
    d_c_end: FloatArray,
    end: float,
    x_f: Vector,
    x_m: Vector,
    length: float,
    ab: Vector,
    t: Vector,
    normal: Vector,
    d_omega: FloatArray,
) -> None:
    """L_j Δa = t·(Δx_P − (1−a)Δx_f − aΔx_m) + ((x_P − (1−a)x_f − a x_m)·n) ω, and likewise b with Q."""
    lever = dot(minus(x_end, x_f), normal) - end * dot(minus(x_m, x_f), normal)
    d_end[:CORE] += (lever * d_omega + dot(ab, t) / 2 * d_c_end) / length
    for i in range(2):
        d_end[A, i] += (1 - c_end) / 2 * t[i] / length
        d_end[B, i] += (1 + c_end) / 2 * t[i] / length
        d_end[F, i] -= (1 - end) * t[i] / length
        d_end[M, i] -= end * t[i] / length


@compiled
def _fill(
    rows: IntArray,
    columns: IntArray,
    values: FloatArray,
    place: int,
    nodes: IntArray,
    n_core: int,
    at: int,
    force: float,
    d_force: FloatArray,
    d_omega: FloatArray,
    t: Vector,
    normal: Vector,
    own: int,
    area: float,
) -> int:
    """Enters Δ(force n) = n Δforce + force Δn, Δn = −t ω, as two rows of local node `at`; of a multiplier −area n."""
    for i in range(2):
        for column in range(len(d_force)):
            if n_core <= column < CORE:
                continue
            for j in range(2):
                value = normal[i] * d_force[column, j]
                if column < CORE:
                    value -= force * t[i] * d_omega[column, j]
                rows[place] = 2 * nodes[at] + i
                columns[place] = 2 * nodes[column] + j
                values[place] = value
                place += 1
        if own != NO_MULTIPLIER:
            rows[place], columns[place], values[place] = 2 * nodes[at] + i, own, -area * normal[i]
            place += 1
    return place


@compiled
def _count_entries(
    neighbours: IntArray, first: IntArray, last: IntArray, cutting: IntArray, active: BoolArray, held: bool
) -> int:
    n_entries, more = 0, 2 if held else 0  # a node's entries in the column of a multiplier
    for point in range(len(active)):
        if not active[point]:
            n_entries += more // 2
            continue
        n_core = 4 if cutting[point] == NOT_CUT else CORE
        n_entries += more * n_core
        if first[point] == last[point]:
            n_entries += 4 * (4 * n_core + more)
            continue
        n_entries += 2 * (4 * n_core + more)
        j = first[point]
        while True:
            n_entries += 2 * (4 * (n_core + 2) + more)
            if j == last[point]:
                break
            j = neighbours[j, 1]
    return n_entries
