"""One virtual slave node at the centroid of a cell of triangles, in the coordinates of the slave face.

With two edges e_1, e_2 of the slave face, its unit normal n and the dual vectors e^a (e^a · e_b = δ_ab, e^a · n = 0), a
point is x_0 + s e_1 + t e_2 + h n. So the slave face is the same triangle in all cells, and for the master corners j

    s_j = e^1 · (x_j − x_0)      t_j = e^2 · (x_j − x_0)      h_j = n · (x_j − x_0)

The area α and the centroid c of the cell, both in (s, t), depend on the six numbers s_j, t_j alone. With J = |e_1 ×
e_2| and the shape functions λ_j of the master face, seen in (s, t),

    N = (1 − c_s − c_t, c_s, c_t)      M_j = λ_j(c)      g = Σ M_j h_j      F = −ε̂ g J α

    R_i = N_i F n on the slave      R_j = −M_j F n on the master

Rules for the next editor: differences come before products, a corner of a cell is what its integers say, and nothing is
allocated. Numbers are real or complex. Master corners have the order of the cell (`face_search`), so corner j is number
2 − j of its face.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_kernel, compile_part
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif_surfaces.face_search import MOST_CORNERS, set_axes, view_face

S, T, H, REST = 0, 1, 2, 3  # The columns of a master corner; the last one is 1 − s − t.
FRAME, MASTER, CORNERS, SLOPES = 0, 4, 7, 7 + MOST_CORNERS  # The rows of `room` at which each part of a cell begins.
AXES, PLACES = SLOPES + 3, SLOPES + 6  # The axes of `face_search`, and along them the corners of slave and master.
ROOM = PLACES + 6, 4


class CentrePoint(NamedTuple):
    """The virtual slave node of a cell."""

    size: float  # J, twice the area of the slave face.
    share: float  # α, the area of the cell over J.
    s: float
    t: float
    gap: float
    n_corners: int


@compile_part
def place_centre(room: Array, x: Array, slave: IntArray, master: IntArray, codes: IntArray) -> CentrePoint:
    """Return the virtual slave node of a cell, and write all of its cell into `room`, an array of the shape `ROOM`.

    Its rows are e^1, e^2, n, e^0, the master corners, the corners of the cell (s, t), the slopes ∇λ_j, and what the
    search sees. Positions x are (n_nodes, 3); the nodes of both faces are (3,), the codes (most_corners, 2).
    """
    size = _set_frame(room, x, slave)
    set_axes(room[AXES : AXES + 3], x, slave)
    view_face(room[PLACES : PLACES + 3], x, slave, x[slave[0]], room[AXES:], False)
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
    m_1, m_2 = master_shape(room, 1, s, t), master_shape(room, 2, s, t)
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
    for axis in range(3):
        room[FRAME, axis] = x[slave[1], axis] - x[slave[0], axis]
        room[FRAME + 1, axis] = x[slave[2], axis] - x[slave[0], axis]
    a_x, a_y, a_z = room[FRAME, 0], room[FRAME, 1], room[FRAME, 2]
    b_x, b_y, b_z = room[FRAME + 1, 0], room[FRAME + 1, 1], room[FRAME + 1, 2]
    n_x, n_y, n_z = a_y * b_z - a_z * b_y, a_z * b_x - a_x * b_z, a_x * b_y - a_y * b_x
    size: float = np.sqrt(n_x * n_x + n_y * n_y + n_z * n_z)
    n_x, n_y, n_z = n_x / size, n_y / size, n_z / size
    room[FRAME, 0], room[FRAME + 1, 0] = (b_y * n_z - b_z * n_y) / size, (n_y * a_z - n_z * a_y) / size
    room[FRAME, 1], room[FRAME + 1, 1] = (b_z * n_x - b_x * n_z) / size, (n_z * a_x - n_x * a_z) / size
    room[FRAME, 2], room[FRAME + 1, 2] = (b_x * n_y - b_y * n_x) / size, (n_x * a_y - n_y * a_x) / size
    room[FRAME + 2, 0], room[FRAME + 2, 1], room[FRAME + 2, 2] = n_x, n_y, n_z
    c_x, c_y, c_z = x[slave[2], 0] - x[slave[1], 0], x[slave[2], 1] - x[slave[1], 1], x[slave[2], 2] - x[slave[1], 2]
    room[FRAME + 3, 0] = (n_y * c_z - n_z * c_y) / size
    room[FRAME + 3, 1] = (n_z * c_x - n_x * c_z) / size
    room[FRAME + 3, 2] = (n_x * c_y - n_y * c_x) / size
    return size


@compile_inline
def crossing_of(room: Array, edge: int, j: int) -> tuple[float, float]:
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
    """Write the corners of the cell, and return how many there are."""
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
            share, _ = crossing_of(room, i, j)
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
    """Write the slopes of the shape functions of the master face in (s, t)."""
    a_s, a_t = room[MASTER + 1, S] - room[MASTER, S], room[MASTER + 1, T] - room[MASTER, T]
    b_s, b_t = room[MASTER + 2, S] - room[MASTER, S], room[MASTER + 2, T] - room[MASTER, T]
    area = a_s * b_t - a_t * b_s
    room[SLOPES + 1, S], room[SLOPES + 1, T] = b_t / area, -b_s / area
    room[SLOPES + 2, S], room[SLOPES + 2, T] = -a_t / area, a_s / area
    for d in range(2):
        room[SLOPES, d] = -room[SLOPES + 1, d] - room[SLOPES + 2, d]


@compile_inline
def master_shape(room: Array, j: int, s: float, t: float) -> float:
    """Return the shape function of master corner j > 0 at a place."""
    shape: float = room[SLOPES + j, S] * (s - room[MASTER, S]) + room[SLOPES + j, T] * (t - room[MASTER, T])
    return shape


@compile_inline
def set_shapes(shapes: Array, room: Array, point: CentrePoint) -> None:
    """Write N_0, N_1, N_2, and M_j in the order of the cell."""
    shapes[0], shapes[1], shapes[2] = 1 - point.s - point.t, point.s, point.t
    shapes[4], shapes[5] = master_shape(room, 1, point.s, point.t), master_shape(room, 2, point.s, point.t)
    shapes[3] = 1 - shapes[4] - shapes[5]


@compile_kernel
def write_points(
    points: FloatArray,
    shapes: FloatArray,
    room: FloatArray,
    x: FloatArray,
    faces: tuple[IntArray, IntArray],
    codes: IntArray,
) -> None:
    """Write gap, weight and normal (n_cells, 5) and the shape functions (n_cells, 6) of all points.

    The nodes of slave and master faces are (n_cells, 3) each.
    """
    slave, master = faces
    for cell in range(len(codes)):
        point = place_centre(room, x, slave[cell], master[cell], codes[cell])
        set_shapes(shapes[cell], room, point)
        points[cell, 0], points[cell, 1] = point.gap, point.size * point.share
        for axis in range(3):
            points[cell, 2 + axis] = room[FRAME + 2, axis]


@compile_kernel
def add_forces(
    forces: Array,
    room: Array,
    shapes: Array,
    x: Array,
    faces: tuple[IntArray, IntArray],
    codes: IntArray,
    active: BoolArray,
    penalty: float,
) -> None:
    """Add the forces (n_states, n_nodes, 3) of the active points of states x (n_states, n_nodes, 3)."""
    slave, master = faces
    for state in range(len(x)):
        for cell in range(len(codes)):
            if not active[cell]:
                continue
            point = place_centre(room, x[state], slave[cell], master[cell], codes[cell])
            set_shapes(shapes, room, point)
            force = -penalty * point.gap * point.size * point.share
            for axis in range(3):
                push = force * room[FRAME + 2, axis]
                for k in range(3):
                    forces[state, slave[cell, k], axis] += shapes[k] * push
                    forces[state, master[cell, 2 - k], axis] -= shapes[3 + k] * push
