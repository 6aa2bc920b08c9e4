"""One virtual slave node a cell of triangles, compiled: pressure −ε̂ g at the centroid, on all of the cell's area.

The shape functions of triangles are linear over a cell, so the centroid integrates them exactly: a uniform pressure is
transmitted, and force and moment balance cell by cell.

With two edges e_1, e_2 of the slave face, its unit normal n and the dual vectors e^a (e^a · e_b = δ_ab, e^a · n = 0), a
point is x_0 + s e_1 + t e_2 + h n. So the slave face is the same triangle in all cells, and for the master corners j

    s_j = e^1 · (x_j − x_0)      t_j = e^2 · (x_j − x_0)      h_j = n · (x_j − x_0)

The area α and the centroid c of the cell, both in (s, t), depend on the six numbers s_j, t_j alone. With J = |e_1 ×
e_2| and the shape functions λ_j of the master face, seen in (s, t),

    N = (1 − c_s − c_t, c_s, c_t)      M_j = λ_j(c)      g = Σ M_j h_j      F = −ε̂ g J α

    R_i = N_i F n on the slave      R_j = −M_j F n on the master

Where positions change by δx_i on the slave and δx_j on the master,

    δn = −e^1 (n · δe_1) − e^2 (n · δe_2)      δJ = J (e^1 · δe_1 + e^2 · δe_2)      w_j = δx_j − Σ N_i(x_j) δx_i
    δs_j = e^1 · w_j + h_j n · (g^11 δe_1 + g^12 δe_2)      δt_j likewise with e^2, g^12, g^22      δh_j = n · w_j

with g^ab = e^a · e^b. A corner of the cell where slave edge i cuts the master edge j k at its share τ moves along the
slave edge, by P ((1 − τ) δx_j + τ δx_k) in (s, t). From the corners follow δα and δc, and with r = δc − Σ M_j δ(s, t)_j

    δN = (−δc_s − δc_t, δc_s, δc_t)      δM_j = ∇λ_j · r      δg = Σ M_j δh_j + (Σ h_j ∇λ_j) · r
    δF = F δJ/J − ε̂ J (α δg + g δα)      δR_i = n δ(N_i F) + N_i F δn      δR_j likewise, negative

So a row of the tangent is a derivative by the nine numbers s_j, t_j, h_j, taken to the nodes. All of δc, δg and r occur
times α, and so they are computed.

Rules for the next editor: differences come before products, a corner of a cell is what its integers say, and nothing is
allocated. Numbers are real or complex. Master corners have the order of the cell (`face_search`), so corner j is number
2 − j of its face.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_inline, compile_kernel, compile_part, constant
from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.formulation import ContactPoints, Pairing, check_penalty
from contactverif.contract.interface import TRIANGLE, Interface
from contactverif.contract.traits import Traits
from contactverif.geometry.block_rows import Couplings, Csr, Fields, NumberArray, TangentOfBoth, find_entry, zero_matrix
from contactverif_surfaces.cell_points import SURFACE_TRAITS, CellPoints, FacePairs, pair_faces, report_points
from contactverif_surfaces.face_search import MOST_CORNERS, set_axes, view_face

S, T, H, REST = 0, 1, 2, 3  # The columns of a master corner; the last one is 1 − s − t.
FRAME, MASTER, CORNERS, SLOPES = 0, 4, 7, 7 + MOST_CORNERS  # The rows of `room` at which each part of a cell begins.
AXES, PLACES = SLOPES + 3, SLOPES + 6  # The axes of `face_search`, and along them the corners of slave and master.
ROOM = PLACES + 6, 4
N_NODES = 6  # The nodes of a cell: those of the slave face, then of the master face.
Faces = tuple[IntArray, IntArray]  # The nodes (n_faces, 3) of all slave and of all master faces.
Cells = tuple[IntArray, IntArray, IntArray]  # The slave and the master face of each cell, and the codes of its corners.
NONE = constant(-1)  # No face.
Arm = tuple[float, float, float]  # A vector in space.
SCANNED = 64  # A row with at most so many entries is scanned for a column; in a longer one the column is bisected for.
# The rows of `slopes`: δα and α δc by the six s_j, t_j; then a row for the force of each node by s_j, t_j, h_j.
SHARE, PLACE_S, PLACE_T, FORCE = 0, 1, 2, 3


class CentrePoint(NamedTuple):
    """The virtual slave node of a cell."""

    size: float  # J, twice the area of the slave face.
    share: float  # α, the area of the cell over J.
    s: float
    t: float
    gap: float
    n_corners: int


@compile_part
def _place_slave(room: Array, x: Array, slave: IntArray) -> float:
    """Write what all cells of a slave face have in common; return J."""
    set_axes(room[AXES : AXES + 3], x, slave)
    view_face(room[PLACES : PLACES + 3], x, slave, x[slave[0]], room[AXES:], False)
    return _set_frame(room, x, slave)


@compile_part
def _place_centre(
    room: Array, x: Array, slave: IntArray, master: IntArray, codes: IntArray, size: float
) -> CentrePoint:
    """Return the virtual slave node of a cell, and write all of its cell into `room`, an array of the shape `ROOM`.

    Its rows are e^1, e^2, n, e^0, the master corners, the corners of the cell (s, t), the slopes ∇λ_j, and what the
    search sees. Positions x are (n_nodes, 3); the nodes of both faces are (3,), the codes (most_corners, 2).
    `_place_slave` comes before, and returns the size.
    """
    view_face(room[PLACES + 3 :], x, master, x[slave[0]], room[AXES:], True)
    for j in range(3):
        for row in range(3):
            room[MASTER + j, row] = 0.0
            for axis in range(3):
                arm = x[master[2 - j], axis] - x[slave[0], axis]
                room[MASTER + j, row] += arm * room[FRAME + row, axis]
        room[MASTER + j, REST] = 0.0
        for axis in range(3):
            room[MASTER + j, REST] += (x[master[2 - j], axis] - x[slave[1], axis]) * room[FRAME + 3, axis]
    n_corners = _place_corners(room, codes)
    share, s, t = _find_centroid(room, n_corners)
    _set_slopes(room)
    m_1, m_2 = _master_shape(room, 1, s, t), _master_shape(room, 2, s, t)
    gap = (1 - m_1 - m_2) * room[MASTER, H] + m_1 * room[MASTER + 1, H] + m_2 * room[MASTER + 2, H]
    # The normal of a needle is rounded, so the slave's corners have heights. They take its tilt away from the others.
    gap = gap - (s * room[PLACES + 1, H] + t * room[PLACES + 2, H])
    return CentrePoint(size, share, s, t, gap, n_corners)


@compile_inline
def _set_frame(room: Array, x: Array, slave: IntArray) -> float:
    """Write e^1, e^2, n and e^0 = −e^1 − e^2, and return J.

    On a needle 1 − s − t, or the sum of e^1 and e^2, would lose all digits near the edge where it is 0: so a product of
    its own has them.
    """
    a, b, c = _edge(x, slave[0], slave[1]), _edge(x, slave[0], slave[2]), _edge(x, slave[1], slave[2])
    n = _cross(a, b)
    size: float = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    n = n[0] / size, n[1] / size, n[2] / size
    by_1, by_2, by_0 = _cross(b, n), _cross(n, a), _cross(n, c)
    for axis in range(3):
        room[FRAME, axis], room[FRAME + 1, axis] = by_1[axis] / size, by_2[axis] / size
        room[FRAME + 2, axis], room[FRAME + 3, axis] = n[axis], by_0[axis] / size
    return size


@compile_inline
def _edge(x: Array, start: int, end: int) -> Arm:
    return x[end, 0] - x[start, 0], x[end, 1] - x[start, 1], x[end, 2] - x[start, 2]


@compile_inline
def _cross(a: Arm, b: Arm) -> Arm:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compile_inline
def _crossing_of(room: Array, edge: int, j: int) -> tuple[float, float]:
    """Return where slave edge `edge` cuts the master edge from corner j on, in [0, 1], and how fast that leaves it.

    Where edges nearly coincide, the place is a quotient of small numbers. So these are the numbers by which the search
    decided which corners the cell has: others would put this corner elsewhere.
    """
    start, end, before, behind = PLACES + edge, PLACES + (edge + 1) % 3, PLACES + 3 + j, PLACES + 3 + (j + 1) % 3
    along, across = room[end, 0] - room[start, 0], room[end, 1] - room[start, 1]
    here = along * (room[before, 1] - room[start, 1]) - across * (room[before, 0] - room[start, 0])
    there = along * (room[behind, 1] - room[start, 1]) - across * (room[behind, 0] - room[start, 0])
    column = T if edge == 0 else (REST if edge == 1 else S)  # The shape function that is 0 on the edge.
    return here / (here - there), room[MASTER + j, column] - room[MASTER + (j + 1) % 3, column]


@compile_inline
def _place_corners(room: Array, codes: IntArray) -> int:
    n_corners = 1
    while n_corners < len(codes) and (
        codes[n_corners, 0] != codes[n_corners - 1, 0] or codes[n_corners, 1] != codes[n_corners - 1, 1]
    ):
        n_corners += 1
    for v in range(n_corners):
        i, j = codes[v, 0], codes[v, 1]
        if j < 0:
            room[CORNERS + v, S], room[CORNERS + v, T] = 1.0 if i == 1 else 0.0, 1.0 if i == 2 else 0.0
        elif i < 0:
            room[CORNERS + v, S], room[CORNERS + v, T] = room[MASTER + j, S], room[MASTER + j, T]
        else:
            share, _ = _crossing_of(room, i, j)
            for d in range(2):
                before = room[MASTER + j, d]
                room[CORNERS + v, d] = before + share * (room[MASTER + (j + 1) % 3, d] - before)
    return n_corners


@compile_inline
def _find_centroid(room: Array, n_corners: int) -> tuple[float, float, float]:
    """Return the area and the centroid of the cell; one without area has its first corner."""
    first_s, first_t = room[CORNERS, S], room[CORNERS, T]
    area, by_s, by_t = 0.0 * first_s, 0.0 * first_s, 0.0 * first_s
    for v in range(1, n_corners - 1):
        a_s, a_t = room[CORNERS + v, S] - first_s, room[CORNERS + v, T] - first_t
        b_s, b_t = room[CORNERS + v + 1, S] - first_s, room[CORNERS + v + 1, T] - first_t
        part = (a_s * b_t - a_t * b_s) / 2
        area, by_s, by_t = area + part, by_s + part * (a_s + b_s) / 3, by_t + part * (a_t + b_t) / 3
    if area.real == 0:
        return area, first_s, first_t
    return area, first_s + by_s / area, first_t + by_t / area


@compile_inline
def _set_slopes(room: Array) -> None:
    a_s, a_t = room[MASTER + 1, S] - room[MASTER, S], room[MASTER + 1, T] - room[MASTER, T]
    b_s, b_t = room[MASTER + 2, S] - room[MASTER, S], room[MASTER + 2, T] - room[MASTER, T]
    area = a_s * b_t - a_t * b_s
    room[SLOPES + 1, S], room[SLOPES + 1, T] = b_t / area, -b_s / area
    room[SLOPES + 2, S], room[SLOPES + 2, T] = -a_t / area, a_s / area
    for d in range(2):
        room[SLOPES, d] = -room[SLOPES + 1, d] - room[SLOPES + 2, d]


@compile_inline
def _master_shape(room: Array, j: int, s: float, t: float) -> float:
    shape: float = room[SLOPES + j, S] * (s - room[MASTER, S]) + room[SLOPES + j, T] * (t - room[MASTER, T])
    return shape


@compile_inline
def _set_shapes(shapes: Array, room: Array, point: CentrePoint) -> None:
    """Write N_0, N_1, N_2, and M_j in the order of the cell."""
    shapes[0], shapes[1], shapes[2] = 1 - point.s - point.t, point.s, point.t
    shapes[4], shapes[5] = _master_shape(room, 1, point.s, point.t), _master_shape(room, 2, point.s, point.t)
    shapes[3] = 1 - shapes[4] - shapes[5]


@compile_kernel
def _write_points(
    points: FloatArray, shapes: FloatArray, room: FloatArray, x: FloatArray, faces: Faces, cells: Cells
) -> None:
    """Write gap, weight and normal (n_cells, 5) and the shape functions (n_cells, 6) of all points."""
    (slave, master), (slave_face, master_face, codes), before, size = faces, cells, NONE, 0.0
    for cell in range(len(codes)):
        face = slave_face[cell]
        if face != before:
            before, size = face, _place_slave(room, x, slave[face])
        point = _place_centre(room, x, slave[face], master[master_face[cell]], codes[cell], size)
        _set_shapes(shapes[cell], room, point)
        points[cell, 0], points[cell, 1] = point.gap, point.size * point.share
        for axis in range(3):
            points[cell, 2 + axis] = room[FRAME + 2, axis]


@compile_kernel
def _add_forces(
    forces: Array, rooms: Fields, x: Array, faces: Faces, cells: Cells, numbers: IntArray, penalty: float
) -> None:
    (room, shapes), (slave, master), (slave_face, master_face, codes) = rooms, faces, cells
    for state in range(len(x)):
        before, size = NONE, 0.0 * x[0, 0, 0]
        for cell in numbers:
            on_slave, on_master = slave[slave_face[cell]], master[master_face[cell]]
            if slave_face[cell] != before:
                before, size = slave_face[cell], _place_slave(room, x[state], on_slave)
            point = _place_centre(room, x[state], on_slave, on_master, codes[cell], size)
            _set_shapes(shapes, room, point)
            force = -penalty * point.gap * point.size * point.share
            for axis in range(3):
                push = force * room[FRAME + 2, axis]
                for k in range(3):
                    forces[state, on_slave[k], axis] += shapes[k] * push
                    forces[state, on_master[2 - k], axis] -= shapes[3 + k] * push


@compile_kernel
def _add_springs(forces: FloatArray, csr: Csr, rooms: Fields, x: FloatArray, cells: Fields, penalty: float) -> None:
    (room, shapes, slopes, row), (members, slave_face, codes, numbers) = rooms, cells
    before, size, g_11, g_12, g_22 = NONE, 0.0, 0.0, 0.0, 0.0
    for i in range(len(numbers)):
        nodes, code = members[i], codes[numbers[i]]
        if slave_face[numbers[i]] != before:
            before, size = slave_face[numbers[i]], _place_slave(room, x, nodes[:3])
            g_11, g_12, g_22 = 0.0, 0.0, 0.0
            for axis in range(3):
                g_11 += room[FRAME, axis] * room[FRAME, axis]
                g_12 += room[FRAME, axis] * room[FRAME + 1, axis]
                g_22 += room[FRAME + 1, axis] * room[FRAME + 1, axis]
        point = _place_centre(room, x, nodes[:3], nodes[3:], code, size)
        _set_shapes(shapes, room, point)
        _differentiate_centroid(slopes, room, code, point)
        _differentiate_forces(slopes, room, shapes, point, penalty)
        force = -penalty * point.gap * point.size * point.share
        for k in range(N_NODES):
            push = force * shapes[k] if k < 3 else -force * shapes[k]
            node = nodes[k if k < 3 else 8 - k]
            for axis in range(3):
                forces[node, axis] += push * room[FRAME + 2, axis]
            _set_row(row, slopes[FORCE + k], room, (g_11, g_12, g_22), push)
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
    share, fall = _crossing_of(room, i, j)
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
def _set_row(
    row: FloatArray, slopes: FloatArray, room: FloatArray, metric: tuple[float, float, float], push: float
) -> None:
    """Write the derivative of a push along n by moves along e^1, e^2, n, from its `slopes` by s_j, t_j and h_j."""
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
def _add_row(csr: Csr, row: FloatArray, room: FloatArray, nodes: NumberArray, node: int, push: float) -> None:
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


@dataclass(frozen=True, slots=True, eq=False)
class CentreSprings(TangentOfBoth):
    """The formulation: pressure −ε̂ g at the centroid of each cell where g < 0."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find the cells, and which of them are in contact (n_cells,)."""
        cells = pair_faces(interface, z)
        return Pairing({**cells, "active": _write_all(interface, cells, z)[0][:, 0] < 0})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        x, numbers = np.array(z).reshape(-1, interface.n_nodes, 3), np.flatnonzero(pairing["active"])
        forces, rooms = np.zeros_like(x), (np.empty(ROOM, x.dtype), np.empty(N_NODES, x.dtype))
        _add_forces(forces, rooms, x, _faces(interface), _cells(pairing), numbers, self.penalty)
        return forces.reshape(z.shape)

    def residual_and_tangent(
        self, interface: Interface, pairing: Pairing, z: FloatArray, /
    ) -> tuple[FloatArray, sparse.csr_array]:
        """Compute forces (n_unknowns,) and their derivative from the same points."""
        x, (slave_face, master_face, codes) = np.array(z).reshape(-1, 3), _cells(pairing)
        numbers, both = np.flatnonzero(pairing["active"]), [side.astype(np.int32) for side in _faces(interface)]
        members = np.concatenate([both[0][slave_face[numbers]], both[1][master_face[numbers]]], axis=1)
        starts = np.arange(0, members.size + 1, N_NODES)
        matrix = zero_matrix(len(x), 0, Couplings(members.reshape(-1), starts, starts[:-1]), per_node=3)
        forces, csr = np.zeros(x.shape), (matrix.indptr, matrix.indices, matrix.data)
        rooms = np.empty(ROOM), np.empty(N_NODES), np.empty((FORCE + N_NODES, 9)), np.empty((N_NODES, 3))
        _add_springs(forces, csr, rooms, x, (members, slave_face, codes, numbers), self.penalty)
        return forces.reshape(-1), matrix

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the points of all cells."""
        points, shapes = _write_all(interface, pairing, z)
        slave, master = shapes[:, None, :3], shapes[:, None, :2:-1]
        points_of_cells = CellPoints(slave, master, points[:, 1:2], points[:, :1], points[:, 2:])
        pairs = FacePairs.from_pairing(interface, pairing)
        return report_points(pairs, points_of_cells, z, self.penalty, pairing["active"][:, None])


def _faces(interface: Interface) -> Faces:
    """Return the triangles of both surfaces; the kernels would read past other faces."""
    for surface in (interface.slave, interface.master):
        if surface.faces.shape[1] != TRIANGLE:
            raise MisuseError("interface", f"faces with {surface.faces.shape[1]} corners", "triangles")
    return interface.slave.faces, interface.master.faces


def _cells(pairing: Mapping[str, IntArray]) -> Cells:
    return pairing["slave_face"], pairing["master_face"], pairing["corners"]


def _write_all(interface: Interface, cells: Mapping[str, IntArray], z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what `_write_points` writes for all cells."""
    points, shapes = (np.empty((len(cells["corners"]), width)) for width in (5, N_NODES))
    _write_points(points, shapes, np.empty(ROOM), np.array(z).reshape(-1, 3), _faces(interface), _cells(cells))
    return points, shapes


def vts_cell_3d(*, penalty: float) -> CentreSprings:
    """Take one virtual slave node at the centroid of each cell, with the area of the cell. On triangles it is exact."""
    return CentreSprings(SURFACE_TRAITS.revise(source="here"), check_penalty(penalty))
