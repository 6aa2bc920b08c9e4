"""One virtual slave node V against one master segment 1 → 2: pairing, residual (Eq. 6) and tangent (Appendix A).

    x_V = (1−c)/2 x_A + (1+c)/2 x_B        F = penalty × g × area
    R_A = (1−c)/2 F n    R_B = (1+c)/2 F n    R_1 = −(1−ξ) F n    R_2 = −ξ F n

Compiled, float64 and complex128. Area: that of the slave segment that carries the point, times a weight, plus the same
for the other slave segment at a slave node (NTS-AR); or 1 (NTS).

With multipliers λ, one for each point: F = −λ × area, and a row for each point, −area × g where it is active, area × λ
where it is not. That area is measured in the reference configuration, so that the row never vanishes. Arrays of
multipliers without columns mean a penalty.

Source: Zavarise & De Lorenzis (2009), Eq. 6, A1–A12.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.geometry.compiled import compiled
from contactverif.geometry.projection import Vector, between, dot, foot_on_surface, frame, minus, nearest_segment, node

NODAL, CURRENT, REFERENCE = 0, 1, 2  # where the area of a point comes from

N_LOCAL = 6  # A, B, 1, 2, and the two nodes of the other slave segment
ENTRIES = 4 * N_LOCAL * 4  # of one point in the tangent: rows of four nodes


@compiled
def pair(
    x: FloatArray,
    slave: IntArray,
    master: IntArray,
    master_neighbours: IntArray,
    order: IntArray,
    boxes: FloatArray,
    segment: IntArray,
    slot: IntArray,
    c: FloatArray,
    free_end: float,
    multipliers: FloatArray,
    penalty: float,
) -> tuple[IntArray, BoolArray]:
    """For each point the nearest master segment, and whether it is active: pressed, and the foot on the surface."""
    partner = np.empty(len(segment), dtype=np.int64)
    active = np.empty(len(segment), dtype=np.bool_)
    for point in range(len(segment)):
        x_v = between(node(x, slave[segment[point], 0]), node(x, slave[segment[point], 1]), c[slot[point]])
        m = nearest_segment(x_v, x, master, order, boxes)
        x1, x2 = node(x, master[m, 0]), node(x, master[m, 1])
        _, _, n = frame(x1, x2)
        free = master_neighbours[m]
        on_surface = foot_on_surface(x_v, x1, x2, free[0] < 0, free[1] < 0, free_end)
        partner[point] = m
        active[point] = pressed(dot(minus(x_v, x1), n), multipliers, point, penalty) and on_surface
    return partner, active


@compiled
def pressed(g: float, multipliers: FloatArray, point: int, penalty: float) -> bool:
    """Whether a point is in contact by its gap: g ≤ 0, and with multipliers λ − c g ≥ 0, with the penalty for c."""
    if len(multipliers) == 0:
        return g <= 0
    return bool(multipliers[point] - penalty * g >= 0)


@compiled
def residual(
    x: Array,
    multipliers: Array,
    reference: FloatArray,
    slave: IntArray,
    master: IntArray,
    segment: IntArray,
    other: IntArray,
    slot: IntArray,
    partner: IntArray,
    active: BoolArray,
    c: FloatArray,
    weight: FloatArray,
    area_from: int,
    penalty: float,
) -> tuple[Array, Array]:
    """Nodal forces (n_states, n_nodes, 2) and constraint rows (n_states, n_multipliers), at x and multipliers alike."""
    forces, rows = np.zeros_like(x), np.zeros_like(multipliers)
    held = multipliers.shape[1] > 0
    for state in range(x.shape[0]):
        x_now, r = x[state], forces[state]
        for point in range(len(segment)):
            w = weight[slot[point]]
            if not active[point]:
                if held:
                    area_0 = 1.0 if area_from == NODAL else w * _length(reference, slave, segment[point], other[point])
                    rows[state, point] = multipliers[state, point] * area_0
                continue
            a, b = slave[segment[point], 0], slave[segment[point], 1]
            node_1, node_2 = master[partner[point], 0], master[partner[point], 1]
            c_v = c[slot[point]]

            x_v = between(node(x_now, a), node(x_now, b), c_v)
            x1 = node(x_now, node_1)
            l_12, t, n = frame(x1, node(x_now, node_2))
            g = dot(minus(x_v, x1), n)
            xi = dot(minus(x_v, x1), t) / l_12

            area = 1 + 0 * g  # of the type of x
            if area_from == CURRENT:
                area = w * _length(x_now, slave, segment[point], other[point])
            elif area_from == REFERENCE:
                area = area * (w * _length(reference, slave, segment[point], other[point]))
            f = penalty * g * area
            if held:
                f = -multipliers[state, point] * area
                rows[state, point] = -area * g

            push(r, a, (1 - c_v) / 2 * f, n)
            push(r, b, (1 + c_v) / 2 * f, n)
            push(r, node_1, -(1 - xi) * f, n)
            push(r, node_2, -xi * f, n)
    return forces, rows


@compiled
def tangent(
    x: FloatArray,
    multipliers: FloatArray,
    reference: FloatArray,
    slave: IntArray,
    master: IntArray,
    segment: IntArray,
    other: IntArray,
    slot: IntArray,
    partner: IntArray,
    active: BoolArray,
    c: FloatArray,
    weight: FloatArray,
    area_from: int,
    penalty: float,
) -> tuple[IntArray, IntArray, FloatArray]:
    """Rows, columns and values of the tangent at x (n_nodes, 2), multipliers (n,); entries of one place add up."""
    held = len(multipliers) > 0
    n_active = np.sum(active)
    n_entries = ENTRIES * n_active
    if held:
        n_entries += (4 + N_LOCAL) * 2 * n_active + len(active) - n_active
    rows = np.empty(n_entries, dtype=np.int64)
    columns = np.empty(n_entries, dtype=np.int64)
    values = np.empty(n_entries)
    place = 0
    nodes = np.empty(N_LOCAL, dtype=np.int64)
    for point in range(len(segment)):
        own = x.size + point  # row and column of its multiplier
        w = weight[slot[point]]
        if not active[point]:
            if held:
                rows[place], columns[place] = own, own
                values[place] = 1.0
                if area_from != NODAL:
                    values[place] = w * _length(reference, slave, segment[point], other[point])
                place += 1
            continue
        a, b = slave[segment[point], 0], slave[segment[point], 1]
        node_1, node_2 = master[partner[point], 0], master[partner[point], 1]
        c_v = c[slot[point]]
        nodes[0], nodes[1], nodes[2], nodes[3], nodes[4], nodes[5] = a, b, node_1, node_2, a, b

        x_v = between(node(x, a), node(x, b), c_v)
        x1 = node(x, node_1)
        l_12, t, n = frame(x1, node(x, node_2))
        g = dot(minus(x_v, x1), n)
        xi = dot(minus(x_v, x1), t) / l_12

        # Δ of a scalar is a row (n_local, 2): what it gains for each displacement of each local node.
        d_omega, d_g, d_xi, d_area = np.zeros((4, N_LOCAL, 2))
        shape = ((1 - c_v) / 2, (1 + c_v) / 2, -(1 - xi), -xi)
        for i in range(2):
            d_omega[2, i] = -n[i] / l_12  # ω = n·(Δx2 − Δx1)/l
            d_omega[3, i] = n[i] / l_12
            for k in range(4):
                d_g[k, i] = shape[k] * n[i]  # Δg = n·(Δx_V − (1−ξ)Δx1 − ξΔx2)
                d_xi[k, i] = shape[k] * t[i] / l_12  # l Δξ = t·(Δx_V − (1−ξ)Δx1 − ξΔx2) + g ω
        d_xi += g * d_omega / l_12

        area = 1.0
        if area_from == CURRENT:
            area = w * _length(x, slave, segment[point], other[point])
            _stretch(d_area, 0, x, a, b, w)  # Δl_AB = t_AB·(Δx_B − Δx_A)
            if other[point] >= 0:
                nodes[4], nodes[5] = slave[other[point], 0], slave[other[point], 1]
                _stretch(d_area, 4, x, nodes[4], nodes[5], w)
        elif area_from == REFERENCE:
            area = w * _length(reference, slave, segment[point], other[point])

        f = penalty * g * area
        d_f = penalty * (area * d_g + g * d_area)
        if held:
            f = -multipliers[point] * area
            d_f = -multipliers[point] * d_area
            for column in range(N_LOCAL):
                for i in range(2):
                    rows[place], columns[place] = own, 2 * nodes[column] + i
                    values[place] = -(area * d_g[column, i] + g * d_area[column, i])
                    place += 1
            for k in range(4):
                for i in range(2):
                    rows[place], columns[place] = 2 * nodes[k] + i, own
                    values[place] = -area * shape[k] * n[i]
                    place += 1
        for k in range(4):
            for i in range(2):
                for column in range(N_LOCAL):
                    for j in range(2):
                        value = shape[k] * (d_f[column, j] * n[i] - f * t[i] * d_omega[column, j])  # Δn = −t ω
                        if k == 2:
                            value += d_xi[column, j] * f * n[i]
                        elif k == 3:
                            value -= d_xi[column, j] * f * n[i]
                        rows[place] = 2 * nodes[k] + i
                        columns[place] = 2 * nodes[column] + j
                        values[place] = value
                        place += 1
    return rows, columns, values


@compiled
def _length(x: Array, slave: IntArray, segment: int, other: int) -> float:
    """Length of a slave segment, and of the other one at a slave node where there is one."""
    length, _, _ = frame(node(x, slave[segment, 0]), node(x, slave[segment, 1]))
    if other >= 0:
        more, _, _ = frame(node(x, slave[other, 0]), node(x, slave[other, 1]))
        length += more
    return length


@compiled
def _stretch(row: FloatArray, first: int, x: FloatArray, a: int, b: int, weight: float) -> None:
    """Adds weight × Δl_ab to a row of Δ's; a and b are the local nodes `first` and `first` + 1."""
    _, t, _ = frame(node(x, a), node(x, b))
    for i in range(2):
        row[first, i] -= weight * t[i]
        row[first + 1, i] += weight * t[i]


@compiled
def push(forces: Array, number: int, size: float, direction: Vector) -> None:
    """Adds a force along a direction to that of a node."""
    forces[number, 0] += size * direction[0]
    forces[number, 1] += size * direction[1]
