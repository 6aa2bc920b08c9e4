"""The tangent of one virtual slave node a cell (`centre_geometry`), written straight into compressed rows.

Where positions change by δx_i on the slave and δx_j on the master,

    δn = −e^1 (n · δe_1) − e^2 (n · δe_2)      δJ = J (e^1 · δe_1 + e^2 · δe_2)      w_j = δx_j − Σ N_i(x_j) δx_i
    δs_j = e^1 · w_j + h_j n · (g^11 δe_1 + g^12 δe_2)      δt_j likewise with e^2, g^12, g^22      δh_j = n · w_j

with g^ab = e^a · e^b. A corner of the cell where slave edge i cuts the master edge j k at its share τ moves along the
slave edge, by P ((1 − τ) δx_j + τ δx_k) in (s, t). From the corners follow δα and δc, and with r = δc − Σ M_j δ(s, t)_j

    δN = (−δc_s − δc_t, δc_s, δc_t)      δM_j = ∇λ_j · r      δg = Σ M_j δh_j + (Σ h_j ∇λ_j) · r
    δF = F δJ/J − ε̂ J (α δg + g δα)      δR_i = n δ(N_i F) + N_i F δn      δR_j likewise, negative

So a row of the tangent is a derivative by the nine numbers s_j, t_j, h_j, taken to the nodes. All of δc, δg and r occur
times α, and so they are computed.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_inline, compile_kernel
from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.geometry.block_rows import AnyIntArray, Couplings, NumberArray, find_entry, zero_matrix
from contactverif_surfaces.centre_geometry import (
    CORNERS,
    FRAME,
    MASTER,
    ROOM,
    SLOPES,
    CentrePoint,
    H,
    S,
    T,
    crossing_of,
    place_centre,
    set_shapes,
)

N_NODES = 6  # The nodes of a cell: those of the slave face, then of the master face.
SCANNED = 64  # A row with at most so many entries is scanned for a column; in a longer one the column is bisected for.
# The rows of `slopes`: δα and α δc by the six s_j, t_j; then a row for the force of each node by s_j, t_j, h_j.
SHARE, PLACE_S, PLACE_T, FORCE = 0, 1, 2, 3


def forces_and_tangent(
    x: FloatArray, nodes: tuple[IntArray, IntArray], codes: IntArray, active: BoolArray, penalty: float
) -> tuple[FloatArray, sparse.csr_array]:
    """Return the forces (n_nodes, 3) of the active points, and their derivative, sparse.

    The nodes of the slave and the master face of each cell are (n_cells, 3) each.
    """
    here = np.flatnonzero(active)
    members = np.concatenate([side[here].astype(np.int32) for side in nodes], axis=1)  # (n_active, N_NODES)
    starts = np.arange(0, members.size + 1, N_NODES)
    matrix = zero_matrix(len(x), 0, Couplings(members.reshape(-1), starts, starts[:-1]), per_node=3)
    forces = np.zeros(x.shape)
    rooms = np.empty(ROOM), np.empty(N_NODES), np.empty((FORCE + N_NODES, 9)), np.empty((N_NODES, 3))
    csr = matrix.indptr, matrix.indices, matrix.data
    _add_springs(forces, csr, *rooms, x, members, codes, here, penalty)
    return forces, matrix


@compile_kernel
def _add_springs(
    forces: FloatArray,
    csr: tuple[AnyIntArray, AnyIntArray, FloatArray],
    room: FloatArray,
    shapes: FloatArray,
    slopes: FloatArray,
    row: FloatArray,
    x: FloatArray,
    members: NumberArray,
    codes: IntArray,
    cells: IntArray,
    penalty: float,
) -> None:
    """Add the forces of some cells, and their derivative to compressed rows."""
    for number in range(len(cells)):
        nodes, code = members[number], codes[cells[number]]
        point = place_centre(room, x, nodes[:3], nodes[3:], code)
        set_shapes(shapes, room, point)
        _differentiate_centroid(slopes, room, code, point)
        _differentiate_forces(slopes, room, shapes, point, penalty)
        metric, force = _metric(room), -penalty * point.gap * point.size * point.share
        for k in range(N_NODES):
            push = force * shapes[k] if k < 3 else -force * shapes[k]
            node = nodes[k if k < 3 else 8 - k]
            for axis in range(3):
                forces[node, axis] += push * room[FRAME + 2, axis]
            _set_row(row, slopes[FORCE + k], room, metric, push)
            _add_row(csr, row, room, nodes, node, push)


@compile_inline
def _differentiate_centroid(slopes: FloatArray, room: FloatArray, codes: IntArray, point: CentrePoint) -> None:
    """Write the derivatives of α, and α times those of c, by s_j and t_j: no thin cell divides by its area."""
    slopes[:FORCE] = 0.0
    first_s, first_t, n = room[CORNERS, S], room[CORNERS, T], point.n_corners
    total = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    mean_s, mean_t = point.s - first_s, point.t - first_t
    for v in range(n - 1, -1, -1):
        if v > 0:
            here_s, here_t = room[CORNERS + v, S] - first_s, room[CORNERS + v, T] - first_t
            a_s, a_t, b_s, b_t, before, behind = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            if v > 1:  # The triangle before: of the first corner, v − 1 and v.
                a_s, a_t = room[CORNERS + v - 1, S] - first_s, room[CORNERS + v - 1, T] - first_t
                before = (a_s * here_t - a_t * here_s) / 2
            if v < n - 1:
                b_s, b_t = room[CORNERS + v + 1, S] - first_s, room[CORNERS + v + 1, T] - first_t
                behind = (here_s * b_t - here_t * b_s) / 2
            # Each triangle has the area a and the middle m, so c α = Σ a m, and α δc = Σ δa (m − c) + a δm.
            p_s, p_t = (a_s + here_s) / 3 - mean_s, (a_t + here_t) / 3 - mean_t
            q_s, q_t = (b_s + here_s) / 3 - mean_s, (b_t + here_t) / 3 - mean_t
            even = (before + behind) / 3
            by = (
                (b_t - a_t) / 2,
                (a_s - b_s) / 2,
                (b_t * q_s - a_t * p_s) / 2 + even,
                (a_s * p_s - b_s * q_s) / 2,
                (b_t * q_t - a_t * p_t) / 2,
                (a_s * p_t - b_s * q_t) / 2 + even,
            )
            total = (
                total[0] + by[0], total[1] + by[1], total[2] + by[2],
                total[3] + by[3], total[4] + by[4], total[5] + by[5],
            )  # fmt: skip
        else:  # A cell that moves as a whole keeps its area.
            by = -total[0], -total[1], point.share - total[2], -total[3], -total[4], point.share - total[5]
        _move_corner(slopes, room, codes[v, 0], codes[v, 1], by)


@compile_inline
def _move_corner(
    slopes: FloatArray, room: FloatArray, i: int, j: int, by: tuple[float, float, float, float, float, float]
) -> None:
    """Add the derivatives by the place of a corner of the cell to those by the master corners."""
    if j < 0:
        return
    if i < 0:
        for part in range(3):
            slopes[part, 2 * j] += by[2 * part]
            slopes[part, 2 * j + 1] += by[2 * part + 1]
        return
    k = (j + 1) % 3
    share, fall = crossing_of(room, i, j)
    along_s, along_t = room[MASTER + k, S] - room[MASTER + j, S], room[MASTER + k, T] - room[MASTER + j, T]
    across_s = 0.0 if i == 0 else (-1.0 if i == 1 else 1.0)
    across_t = 1.0 if i == 0 else (-1.0 if i == 1 else 0.0)
    for part in range(3):
        pull = (by[2 * part] * along_s + by[2 * part + 1] * along_t) / fall
        by_s, by_t = by[2 * part] + pull * across_s, by[2 * part + 1] + pull * across_t
        slopes[part, 2 * j] += (1 - share) * by_s
        slopes[part, 2 * j + 1] += (1 - share) * by_t
        slopes[part, 2 * k] += share * by_s
        slopes[part, 2 * k + 1] += share * by_t


@compile_inline
def _differentiate_forces(
    slopes: FloatArray, room: FloatArray, shapes: FloatArray, point: CentrePoint, penalty: float
) -> None:
    """Write the derivatives of N_i F and −M_j F by s_j, t_j and h_j, with J held."""
    rate = -penalty * point.size
    stress, rise_s, rise_t = rate * point.gap, 0.0, 0.0
    for j in range(3):
        rise_s += room[MASTER + j, H] * room[SLOPES + j, S]
        rise_t += room[MASTER + j, H] * room[SLOPES + j, T]
    for j in range(3):
        for d in range(3):
            column, weight = 3 * j + d, shapes[3 + j] * point.share
            by_share, by_s, by_t, r_s, r_t, by_gap = 0.0, 0.0, 0.0, 0.0, 0.0, weight
            if d != H:
                by_share, by_s, by_t = slopes[SHARE, 2 * j + d], slopes[PLACE_S, 2 * j + d], slopes[PLACE_T, 2 * j + d]
                r_s, r_t = by_s - weight * (d == S), by_t - weight * (d == T)
                by_gap = rise_s * r_s + rise_t * r_t
            by_force = rate * by_gap + stress * by_share
            slopes[FORCE, column] = shapes[0] * by_force - stress * (by_s + by_t)
            slopes[FORCE + 1, column] = shapes[1] * by_force + stress * by_s
            slopes[FORCE + 2, column] = shapes[2] * by_force + stress * by_t
            for k in range(3):
                slide = room[SLOPES + k, S] * r_s + room[SLOPES + k, T] * r_t
                slopes[FORCE + 3 + k, column] = -shapes[3 + k] * by_force - stress * slide


@compile_inline
def _metric(room: FloatArray) -> tuple[float, float, float]:
    """Return g^11, g^12 and g^22."""
    g_11, g_12, g_22 = 0.0, 0.0, 0.0
    for axis in range(3):
        g_11 += room[FRAME, axis] * room[FRAME, axis]
        g_12 += room[FRAME, axis] * room[FRAME + 1, axis]
        g_22 += room[FRAME + 1, axis] * room[FRAME + 1, axis]
    return g_11, g_12, g_22


@compile_inline
def _set_row(
    row: FloatArray, slopes: FloatArray, room: FloatArray, metric: tuple[float, float, float], push: float
) -> None:
    """Write the derivative of a push along n by the nodes of the cell: (N_NODES, 3), by their moves along e^1, e^2, n.

    It is made of the derivatives (9,) by s_j, t_j and h_j. The push itself grows with J.
    """
    turn_1, turn_2 = 0.0, 0.0
    for d in range(3):
        row[1, d], row[2, d] = 0.0, 0.0
    for j in range(3):
        s, t, h = room[MASTER + j, S], room[MASTER + j, T], room[MASTER + j, H]
        by_s, by_t = slopes[3 * j], slopes[3 * j + 1]
        turn_1 += h * (by_s * metric[0] + by_t * metric[1])
        turn_2 += h * (by_s * metric[1] + by_t * metric[2])
        for d in range(3):
            row[3 + j, d] = slopes[3 * j + d]
            row[1, d] -= s * slopes[3 * j + d]
            row[2, d] -= t * slopes[3 * j + d]
    row[1, 0], row[1, 2] = row[1, 0] + push, row[1, 2] + turn_1
    row[2, 1], row[2, 2] = row[2, 1] + push, row[2, 2] + turn_2
    for d in range(3):  # Where all nodes move alike, nothing changes.
        row[0, d] = -(row[1, d] + row[2, d] + row[3, d] + row[4, d] + row[5, d])


@compile_inline
def _add_row(
    csr: tuple[AnyIntArray, AnyIntArray, FloatArray],
    row: FloatArray,
    room: FloatArray,
    nodes: NumberArray,
    node: int,
    push: float,
) -> None:
    """Add n ⊗ `row` and the push × ∂n/∂x to the three rows of a node."""
    indptr, indices, data = csr
    start, end = indptr[3 * node], indptr[3 * node + 1]
    width = end - start
    # Numbers of their own: the compiler must suppose that `data` and `room` overlap.
    a_x, a_y, a_z = room[FRAME, 0], room[FRAME, 1], room[FRAME, 2]
    b_x, b_y, b_z = room[FRAME + 1, 0], room[FRAME + 1, 1], room[FRAME + 1, 2]
    n_x, n_y, n_z = room[FRAME + 2, 0], room[FRAME + 2, 1], room[FRAME + 2, 2]
    for q in range(N_NODES):
        column, place = 3 * nodes[q if q < 3 else 8 - q], np.uint64(start)
        if width > SCANNED:
            place = np.uint64(find_entry(indices, start, end, column))
        while indices[place] != column:
            place += np.uint64(3)
        by_1, by_2, by_n = row[q, 0], row[q, 1], row[q, 2]
        v_x, v_y = by_1 * a_x + by_2 * b_x + by_n * n_x, by_1 * a_y + by_2 * b_y + by_n * n_y
        v_z, turn_a, turn_b = by_1 * a_z + by_2 * b_z + by_n * n_z, 0.0, 0.0
        if q == 0:
            turn_a, turn_b = push, push
        elif q == 1:
            turn_a = -push
        elif q == 2:
            turn_b = -push
        for n, turn in ((n_x, turn_a * a_x + turn_b * b_x), (n_y, turn_a * a_y + turn_b * b_y),
                        (n_z, turn_a * a_z + turn_b * b_z)):  # fmt: skip
            data[place] += n * v_x + turn * n_x
            data[place + np.uint64(1)] += n * v_y + turn * n_y
            data[place + np.uint64(2)] += n * v_z + turn * n_z
            place += np.uint64(width)
