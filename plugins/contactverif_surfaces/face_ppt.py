"""VTS-PPT on faces, compiled: a virtual slave node in each part of a slave face, pressing on all that lies under it.

`face_ppt_search` finds the partner m of each virtual slave node V, and the faces under its part. With the unit normal n
of m, the shape functions M_k of m at the foot of V (unclipped), and the height g of V over m along n,

    F = ε̂ g A          slave nodes get F N̄_k n          master nodes get −F M_k n, where the part has no cells (Eq. 6)

Otherwise each face j carries W_jk = ∫ N_k over its overlap with the part, in the plane across n. S is the sum of all:

    printed: master nodes get −ε̂ g W_jk n          balanced (ours), or m alone: −F W_jk/S n

Along the slave's normal (ours) n is that of the slave face, turned round, m is the face straight below V, and master
nodes get −ε̂ g W_jk n. On triangles F is all of it where the master covers the part.

Over a triangle N_k is linear, and the integral exact. On a quadrilateral it has 6 Gauss points on each triangle between
the middle of the cell and two corners, as `cell_points.gauss_points`.

All sizes of forces are functions of the coordinates y = (s, t, h) of nodes along the axes of m, and a turn about n does
not change them. With the slopes γ_k of the shape functions in the middle of m, δn = −Σ γ_k (n · δx_k), and such a size
Q with the derivatives Q_y changes by

    δQ = Σ Q_y · δx + (Σ γ_k (n · δx_k)) · Σ (h Q_st − (s, t) Q_h)          δ(Q n) = n δQ + Q δn

With the weights J = |∂s × ∂t| w of the Gauss points of a part, and with c = (−Σ h_k ∇M_k, 1),

    δN̄_k = Σ δJ (N_k − N̄_k)/A      δM_k = ∇M_k · r      δg = c · r      r = Σ N̄_k δy_k + Σ y_k δN̄_k − Σ M_k δy_k

In an integral over a cell the point p with the weight w changes by δ(w N_k) = N_k δw + w ∇N_k · (δp − Σ N_l δy_l). A
corner where an edge u of the part and an edge v of the face cross moves by what lies there of either edge, δa and δb:
by (v (u × δa) − u (v × δb))/(u × v).

Rules for the next editor: differences come before products, and nothing is allocated in a loop. Numbers are real or
complex in the residual.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_inline, compile_kernel, compile_part, constant
from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.formulation import ContactPoints, Pairing, check_penalty, check_tau, choose
from contactverif.contract.interface import Interface
from contactverif.contract.traits import Traits
from contactverif.geometry.block_rows import (
    Couplings,
    Csr,
    Fields,
    NumberArray,
    TangentOfBoth,
    find_entry,
    insert_node,
    zero_matrix,
)
from contactverif_surfaces.cell_points import GAUSS, SURFACE_TRAITS
from contactverif_surfaces.face_ppt_search import (
    N_PARTS,
    TABLES,
    combine,
    cross,
    dot,
    find_opposite_faces,
    find_patches,
    place_part,
    set_corners,
    set_shapes,
)
from contactverif_surfaces.face_search import MOST_CORNERS, set_axes, view_face

NONE = constant(0)
SCANNED = 64  # A row with at most so many entries is scanned for a column; in a longer one the column is bisected for.
# One point in the middle of a triangle integrates linear shape functions; six serve those of quadrilaterals.
RULES = {3: (np.full((1, 3), 1 / 3), np.ones(1)), 4: GAUSS[6]}


def _make_rooms(interface: Interface, dtype: Any, size: int, width: int) -> tuple[Fields, Fields, Fields]:
    """Return what kernels write for a part with `size` nodes, whose `width` coordinates derivatives are taken by.

    First the sizes of the pushes on the nodes and their derivatives, the nodes' coordinates, and the vectors γ. Then of
    the part: the axes of m, the corners of the slave face, of m and of the part, N̄, M and ∇M; the derivatives of A, of
    the foot, of N̄, of g and of a factor of all forces on the master; where the nodes of both faces are. Last of a cell:
    the corners of its face, its own, the integrals over it by these and by its middle, and means over a triangle.
    """
    n_slave, n_master = interface.slave.faces.shape[1], interface.master.faces.shape[1]
    out = size, (size, width), (size, 3), (size, 2)
    part = (3, 3), (n_slave, 3), (n_master, 3), (n_slave, 3), n_slave, n_master, (n_master, 2)
    slopes = width, (3, width), (n_slave, width), width, width
    corner = n_master, MOST_CORNERS, 2
    cell = (n_master, 3), corner[1:], corner, (n_master, 2), n_master, n_master, (n_master, 2)
    first, second, third = (tuple(np.empty(shape, dtype) for shape in each) for each in (out, part + slopes, cell))
    return first, (*second, np.empty((3, 4), np.int64)), third


@compile_inline
def _cross_plane(a_s: float, a_t: float, b_s: float, b_t: float) -> float:
    return a_s * b_t - a_t * b_s


@compile_part
def _place_node(
    of_part: Fields, x: Array, slave: IntArray, home: IntArray, table: Fields, k: int, along_slave: bool
) -> Fields:
    """Write part k of a slave face with its partner; return A, V along the axes from the slave's first corner, and g.

    All decisions were made on the same numbers (`face_ppt_search`).
    """
    axes, on_slave, on_home, part, mean, shapes, slopes = of_part[:7]
    set_axes(axes, x, slave if along_slave else home)
    for axis in range(3 if along_slave else 0):  # n points out of the master.
        axes[1, axis], axes[2, axis] = -axes[1, axis], -axes[2, axis]
    view_face(on_slave, x, slave, x[slave[0]], axes, False)
    view_face(on_home, x, home, x[slave[0]], axes, False)
    area, centre = place_part(mean, on_slave, table, k)
    set_corners(part, on_slave, table[0][k])
    set_shapes(shapes, slopes, on_home, centre[0], centre[1])
    return area, centre, centre[2] - combine(on_home, shapes)[2]


@compile_kernel
def _write_nodes(
    written: FloatArray, of_part: Fields, x: FloatArray, faces: Fields, parts: IntArray, home: IntArray, rules: Fields
) -> None:
    """Write area, gap, normal, V − x_0, N̄ and M of parts (n, 8 + n_slave_corners + n_master_corners)."""
    (slave, master), (table, _, _, along_slave, _), axes = faces, rules, of_part[0]
    for i in range(len(parts)):
        face = slave[parts[i] // N_PARTS]
        area, centre, gap = _place_node(of_part, x, face, master[home[i]], table, parts[i] % N_PARTS, along_slave)
        written[i, 0], written[i, 1] = area, gap
        for axis in range(3):
            written[i, 2 + axis] = axes[2, axis]
            written[i, 5 + axis] = dot(centre, (axes[0, axis], axes[1, axis], axes[2, axis]))
        for k in range(len(face)):
            written[i, 8 + k] = of_part[4][k]
        for k in range(master.shape[1]):
            written[i, 8 + len(face) + k] = of_part[5][k]


@compile_kernel
def _list_members(members: NumberArray, starts: IntArray, faces: Fields, pairing: Fields) -> int:
    """Write the nodes that feel each part in contact, ascending, and where they start; return the most of a part."""
    (slave, master), (home, parts, ranges, cells, _) = faces, pairing
    end, most = 0, 0
    for place in range(len(parts)):
        start, p = end, parts[place]
        for node in slave[p // N_PARTS]:
            end = insert_node(members, start, end, node)
        for node in master[home[p]]:
            end = insert_node(members, start, end, node)
        for c in range(ranges[place, 0], ranges[place, 1]):
            for node in master[cells[c]]:
                end = insert_node(members, start, end, node)
        starts[place + 1], most = end, max(most, end - start)
    return most


@compile_part
def _see_face(at_face: IntArray, places: Array, members: Fields, face: IntArray, corners: Array) -> None:
    """Write where the nodes of a face are among the members of a part, and their coordinates there."""
    numbers, start, size = members
    for k in range(len(face)):
        at_face[k] = find_entry(numbers, start, start + size, face[k]) - start
        for axis in range(3):
            places[at_face[k], axis] = corners[k, axis]


@compile_part
def _press_part(rooms: Fields, x: Array, faces: Fields, pairing: Fields, rules: Fields, place: int, width: int) -> None:
    """Write the sizes of the pushes on all nodes of a part, and their derivatives by `width` coordinates, or by none.

    Each factor of a push is a line, and its derivatives are the next ones. Slave nodes are the first.
    """
    (slave, master), (home, parts, ranges, cells, codes, members, starts) = faces, pairing
    (table, rule, balanced, along_slave, penalty), (out, of_part, of_cell) = rules, rooms
    pushes, by_nodes, places, levers = out
    axes, on_slave, on_home, _, mean, shapes, slopes, by_area, by_foot, by_mean, by_gap, by_factor, at = of_part
    p, of_members = parts[place], (members, starts[place], starts[place + 1] - starts[place])
    face, m, on_face, size = slave[p // N_PARTS], master[home[p]], of_cell[0], of_members[2]
    area, centre, gap = _place_node(of_part, x, face, m, table, p % N_PARTS, along_slave)
    force, first, last = penalty * gap * area, ranges[place, 0], ranges[place, 1]
    _see_face(at[0], places, of_members, face, on_slave)
    _see_face(at[1], places, of_members, m, on_home)
    pushes[:size], by_nodes[:size, :width], levers[:size] = 0.0, 0.0, 0.0
    if width > 0:
        _differentiate_part(of_part, centre, area, table, p % N_PARTS, width)
        _set_levers(levers, on_slave if along_slave else on_home, at[0 if along_slave else 1], of_cell)
    for k in range(len(face)):
        pushes[at[0, k]] = force * mean[k]
        for q in range(width):
            by_force = penalty * (area * by_gap[q] + gap * by_area[q])
            by_nodes[at[0, k], q] = mean[k] * by_force + force * by_mean[k, q]
    if first == last:  # IF only one segment is involved THEN Eq. 6
        for k in range(len(m)):
            pushes[at[1, k]] = -force * shapes[k]
            for q in range(width):
                by_force = penalty * (area * by_gap[q] + gap * by_area[q])
                slide = slopes[k, 0] * by_foot[0, q] + slopes[k, 1] * by_foot[1, q]
                by_nodes[at[1, k], q] = -shapes[k] * by_force - force * slide
        return
    for c in range(first, last):
        view_face(on_face, x, master[cells[c]], x[face[0]], axes, False)
        _see_face(at[2], places, of_members, master[cells[c]], on_face)
        _add_cell(rooms, rule, table[0][p % N_PARTS], codes[c], width)
    factor, whole = -penalty * gap, 0.0 * gap
    for q in range(width):
        by_factor[q] = -penalty * by_gap[q]
    if balanced or (last == first + 1 and not along_slave):
        for row in range(len(face), size):
            whole += pushes[row]
        factor = -force / whole
        for q in range(width):
            by_factor[q] = -penalty * (area * by_gap[q] + gap * by_area[q]) / whole
            for row in range(len(face), size):
                by_factor[q] -= factor * by_nodes[row, q] / whole
    for row in range(len(face), size):
        for q in range(width):
            by_nodes[row, q] = factor * by_nodes[row, q] + pushes[row] * by_factor[q]
        pushes[row] *= factor


@compile_part
def _set_levers(levers: Array, face: Array, at_face: IntArray, of_cell: Fields) -> None:
    """Write the vectors γ: the slopes in the middle of the face whose normal is n."""
    shapes, slopes = of_cell[5], of_cell[6]
    shapes[:] = 1 / len(face)
    middle = combine(face, shapes)
    set_shapes(shapes, slopes, face, middle[0], middle[1])
    for k in range(len(face)):
        levers[at_face[k], 0], levers[at_face[k], 1] = slopes[k, 0], slopes[k, 1]


@compile_part
def _differentiate_part(of_part: Fields, centre: Fields, area: float, table: Fields, k: int, width: int) -> None:
    """Write the derivatives of A, r, N̄ and g."""
    _, face, home, _, mean, feet, slopes, by_area, by_foot, by_mean, by_gap, _, at = of_part
    (_, shapes, along_s, along_t, share), rise_s, rise_t = table, 0.0, 0.0
    by_area[:width], by_foot[:, :width], by_mean[:, :width] = 0.0, 0.0, 0.0
    for axis in range(3):
        for i in range(len(face)):
            by_foot[axis, 3 * at[0, i] + axis] = mean[i]
        for i in range(len(home)):
            by_foot[axis, 3 * at[1, i] + axis] = -feet[i]
    n_points = shapes.shape[1]
    for q in range(n_points):
        a, b, there = combine(face, along_s[k, q]), combine(face, along_t[k, q]), combine(face, shapes[k, q])
        n = cross(a, b)
        weight = share / np.sqrt(dot(n, n))
        by_a, by_b = cross(b, n), cross(n, a)
        for i in range(len(face)):
            for axis in range(3):
                rate = weight * (along_s[k, q, i] * by_a[axis] + along_t[k, q, i] * by_b[axis])
                column = 3 * at[0, i] + axis
                by_area[column] += rate
                if n_points > 1:
                    for row in range(3):
                        by_foot[row, column] += (there[row] - centre[row]) / area * rate
                    for row in range(len(face)):
                        by_mean[row, column] += (shapes[k, q, row] - mean[row]) / area * rate
    for i in range(len(home)):
        rise_s, rise_t = rise_s + home[i, 2] * slopes[i, 0], rise_t + home[i, 2] * slopes[i, 1]
    for q in range(width):
        by_gap[q] = by_foot[2, q] - rise_s * by_foot[0, q] - rise_t * by_foot[1, q]


@compile_part
def _cross_edges(part: Array, face: Array, i: int, j: int) -> tuple[float, float, float]:
    """Return where edge i of a part and edge j of a face cross, as shares of both, and u × v."""
    k, end = (j + 1) % len(face), (i + 1) % len(part)
    u_s, u_t = part[end, 0] - part[i, 0], part[end, 1] - part[i, 1]
    arm_s, arm_t = face[j, 0] - part[i, 0], face[j, 1] - part[i, 1]
    here = _cross_plane(u_s, u_t, arm_s, arm_t)
    there = _cross_plane(u_s, u_t, face[k, 0] - part[i, 0], face[k, 1] - part[i, 1])
    on_part = _cross_plane(arm_s, arm_t, face[k, 0] - face[j, 0], face[k, 1] - face[j, 1]) / (there - here)
    return on_part, here / (here - there), there - here


@compile_part
def _place_cell(cell: Array, part: Array, face: Array, codes: IntArray) -> int:
    """Write the corners (n, 2) of a cell, and return n."""
    n = 1
    while n < len(codes) and (codes[n, 0] != codes[n - 1, 0] or codes[n, 1] != codes[n - 1, 1]):
        n += 1
    for v in range(n):
        i, j = codes[v, 0], codes[v, 1]
        on_face = _cross_edges(part, face, i, j)[1] if min(i, j) >= 0 else 0.0 * part[0, 0]
        for axis in range(2):
            cell[v, axis] = part[i, axis]
            if j >= 0:
                cell[v, axis] = face[j, axis] + on_face * (face[(j + 1) % len(face), axis] - face[j, axis])
    return n


@compile_part
def _place_middle(cell: Array, n: int, linear: bool) -> tuple[float, float, float]:
    """Return the mean of the edges of a cell by their squared lengths, and twice the sum of these.

    Where shape functions are linear, every point of the plane will do: the first corner is exact.
    """
    total, m_s, m_t = 0.0 * cell[0, 0], 0.0 * cell[0, 0], 0.0 * cell[0, 0]
    for v in range(0 if linear else n):
        w = (v + 1) % n
        square = (cell[w, 0] - cell[v, 0]) ** 2 + (cell[w, 1] - cell[v, 1]) ** 2
        total += 2 * square
        m_s += square * (cell[v, 0] + cell[w, 0] - 2 * cell[0, 0])
        m_t += square * (cell[v, 1] + cell[w, 1] - 2 * cell[0, 1])
    if total.real == 0:
        return cell[0, 0], cell[0, 1], total
    return cell[0, 0] + m_s / total, cell[0, 1] + m_t / total, total


@compile_part
def _add_cell(rooms: Fields, rule: Fields, shares: FloatArray, codes: IntArray, width: int) -> None:
    """Add the integrals of shape functions over a cell, and their derivatives, to the rows of the face's nodes."""
    ((pushes, by_nodes, _, _), of_part, of_cell), (places, weights) = rooms, rule
    face, cell, by_corner, by_middle, means, shapes, slopes = of_cell
    part, at = of_part[3], of_part[12]
    n, n_face = _place_cell(cell, part, face, codes), len(face)
    m_s, m_t, total = _place_middle(cell, n, n_face == 3)
    by_corner[:, :n], by_middle[:] = 0.0, 0.0
    for v in range(n):
        w = (v + 1) % n
        a_s, a_t, b_s, b_t = cell[v, 0] - m_s, cell[v, 1] - m_t, cell[w, 0] - m_s, cell[w, 1] - m_t
        area = _cross_plane(a_s, a_t, b_s, b_t) / 2
        means[:] = 0.0
        for q in range(len(weights)):
            at_v, at_w, weight = places[q, 1], places[q, 2], weights[q] * area
            set_shapes(shapes, slopes, face, m_s + at_v * a_s + at_w * b_s, m_t + at_v * a_t + at_w * b_t)
            for k in range(n_face):
                pushes[at[2, k]] += weight * shapes[k]
                means[k] += weights[q] * shapes[k] / 2
                for axis in range(2 if width > 0 else 0):
                    slide = weight * slopes[k, axis]
                    by_corner[k, v, axis] += at_v * slide
                    by_corner[k, w, axis] += at_w * slide
                    by_middle[k, axis] += places[q, 0] * slide
                    for other in range(n_face):
                        by_nodes[at[2, k], 3 * at[2, other] + axis] -= shapes[other] * slide
        for k in range(n_face):
            for axis, by_a, by_b in ((0, b_t, -a_t), (1, -b_s, a_s)):
                by_corner[k, v, axis] += means[k] * by_a
                by_corner[k, w, axis] += means[k] * by_b
                by_middle[k, axis] -= means[k] * (by_a + by_b)
    if width > 0 and total.real > 0:
        _move_middle(of_cell, n, (m_s, m_t, total))
    for v in range(n if width > 0 else 0):
        for k in range(n_face):
            by_s, by_t = by_corner[k, v, 0], by_corner[k, v, 1]
            _move_cell_corner(by_nodes[at[2, k]], at, part, face, shares, codes[v], by_s, by_t)


@compile_part
def _move_middle(of_cell: Fields, n: int, middle: tuple[float, float, float]) -> None:
    """Add derivatives by the middle of a cell to those by its corners."""
    (_, cell, by_corner, by_middle, _, _, _), (m_s, m_t, total) = of_cell, middle
    for v in range(n):
        w = (v + 1) % n
        e_s, e_t = cell[w, 0] - cell[v, 0], cell[w, 1] - cell[v, 1]
        off_s, off_t = (cell[v, 0] + cell[w, 0]) / 2 - m_s, (cell[v, 1] + cell[w, 1]) / 2 - m_t
        for k in range(len(by_middle)):
            pull = 4 * (by_middle[k, 0] * off_s + by_middle[k, 1] * off_t) / total
            for axis, edge in ((0, e_s), (1, e_t)):
                half = (e_s * e_s + e_t * e_t) / total * by_middle[k, axis]
                by_corner[k, v, axis] += half - pull * edge
                by_corner[k, w, axis] += half + pull * edge


@compile_part
def _move_cell_corner(
    by_row: Array, at: IntArray, part: Array, face: Array, shares: FloatArray, code: IntArray, by_s: float, by_t: float
) -> None:
    """Add the derivatives of a row by a corner of a cell to those by the corners of both faces."""
    (i, j), n_part, n_face = (code[0], code[1]), len(part), len(face)
    if j < 0:
        _move_corner(by_row, at[0], shares[n_part - 1 - i], by_s, by_t)
        return
    if i < 0:
        by_row[3 * at[2, j]] += by_s
        by_row[3 * at[2, j] + 1] += by_t
        return
    end, after = (i + 1) % n_part, (j + 1) % n_face
    on_part, on_face, turn = _cross_edges(part, face, i, j)
    u_s, u_t = part[end, 0] - part[i, 0], part[end, 1] - part[i, 1]
    v_s, v_t = face[after, 0] - face[j, 0], face[after, 1] - face[j, 1]
    pull, push = (by_s * v_s + by_t * v_t) / turn, (by_s * u_s + by_t * u_t) / turn
    for corner, share in ((i, 1 - on_part), (end, on_part)):
        _move_corner(by_row, at[0], shares[n_part - 1 - corner], -share * pull * u_t, share * pull * u_s)
    for corner, share in ((j, 1 - on_face), (after, on_face)):
        by_row[3 * at[2, corner]] += share * push * v_t
        by_row[3 * at[2, corner] + 1] -= share * push * v_s


@compile_part
def _move_corner(by_row: Array, at_slave: IntArray, shares: FloatArray, by_s: float, by_t: float) -> None:
    for node in range(len(shares)):
        by_row[3 * at_slave[node]] += shares[node] * by_s
        by_row[3 * at_slave[node] + 1] += shares[node] * by_t


@compile_kernel
def _add_forces(forces: Array, rooms: Fields, x: Array, faces: Fields, pairing: Fields, rules: Fields) -> None:
    """Add the residuals (n_states, n_nodes, 3) at positions x of the same shape."""
    pushes, axes, members, starts = rooms[0][0], rooms[1][0], pairing[5], pairing[6]
    for state in range(len(x)):
        for place in range(len(pairing[1])):
            _press_part(rooms, x[state], faces, pairing, rules, place, NONE)
            for r in range(starts[place + 1] - starts[place]):
                for axis in range(3):
                    forces[state, members[starts[place] + r], axis] += pushes[r] * axes[2, axis]


@compile_kernel
def _add_springs(
    forces: FloatArray, csr: Csr, rooms: Fields, x: FloatArray, faces: Fields, pairing: Fields, rules: Fields
) -> None:
    """Add the residual (n_nodes, 3) and its derivative: n ⊗ the derivatives of the pushes, and the pushes × ∂n/∂x."""
    (pushes, by_nodes, places, levers), axes, (indptr, indices, data) = rooms[0], rooms[1][0], csr
    members, starts = pairing[5], pairing[6]
    for part in range(len(pairing[1])):
        start, size = starts[part], starts[part + 1] - starts[part]
        _press_part(rooms, x, faces, pairing, rules, part, 3 * size)
        # Numbers of their own: the compiler must suppose that arrays overlap.
        a_x, a_y, a_z, b_x, b_y, b_z = axes[0, 0], axes[0, 1], axes[0, 2], axes[1, 0], axes[1, 1], axes[1, 2]
        n_x, n_y, n_z = axes[2, 0], axes[2, 1], axes[2, 2]
        for r in range(size):
            row, push, tilt_s, tilt_t = members[start + r], pushes[r], 0.0, 0.0
            for q in range(size):
                s, t, h = places[q, 0], places[q, 1], places[q, 2]
                tilt_s += by_nodes[r, 3 * q] * h - by_nodes[r, 3 * q + 2] * s
                tilt_t += by_nodes[r, 3 * q + 1] * h - by_nodes[r, 3 * q + 2] * t
            for axis in range(3):
                forces[row, axis] += push * axes[2, axis]
            place, end = np.uint64(indptr[3 * row]), indptr[3 * row + 1]
            width = np.uint64(end) - place
            for q in range(size):
                column = 3 * members[start + q]
                if width > SCANNED:
                    place = np.uint64(find_entry(indices, indptr[3 * row], end, column))
                while indices[place] != column:
                    place += np.uint64(3)
                by_s, by_t, turn_s, turn_t = by_nodes[r, 3 * q], by_nodes[r, 3 * q + 1], levers[q, 0], levers[q, 1]
                by_n = by_nodes[r, 3 * q + 2] + turn_s * tilt_s + turn_t * tilt_t
                v_x, v_y = by_s * a_x + by_t * b_x + by_n * n_x, by_s * a_y + by_t * b_y + by_n * n_y
                v_z, at = by_s * a_z + by_t * b_z + by_n * n_z, place
                for n, a, b in ((n_x, a_x, b_x), (n_y, a_y, b_y), (n_z, a_z, b_z)):
                    turn = -push * (turn_s * a + turn_t * b)
                    data[at] += n * v_x + turn * n_x
                    data[at + np.uint64(1)] += n * v_y + turn * n_y
                    data[at + np.uint64(2)] += n * v_z + turn * n_z
                    at += width


@dataclass(frozen=True, slots=True, eq=False)
class FacePatches(TangentOfBoth):
    """The formulation: a virtual slave node in each part of a slave face presses on the patch under its part."""

    traits: Traits
    penalty: float  # Distributed stiffness ε̂.
    balanced: bool
    along_slave: bool  # The normal is that of the slave face, not of the partner.
    tau: float  # The part of the height of a master face by which a foot may lie past the border and still count.

    def pair(self, interface: Interface, z: FloatArray, /) -> Pairing:
        """Find partners and patches of all parts, and which parts are in contact (n_parts,)."""
        x = np.array(z).reshape(-1, 3)
        if self.along_slave:
            home, cells, codes = find_opposite_faces(interface, x)
            active, parts = np.zeros(len(home), bool), np.flatnonzero(home >= 0)
            active[parts] = self._nodes(interface, parts, home[parts], x)[:, 1] < 0
        else:
            home, active, cells, codes = find_patches(interface, x, self.tau)
        part, face = np.ascontiguousarray(cells.T)
        return Pairing({"home": home, "active": active, "part": part, "master_face": face, "corners": codes})

    def residual(self, interface: Interface, pairing: Pairing, z: Array, /) -> Array:
        """Compute the forces (..., n_unknowns)."""
        x, (arrays, size) = np.array(z).reshape(-1, interface.n_nodes, 3), _arrays_of(interface, pairing)
        forces, rooms = np.zeros_like(x), _make_rooms(interface, x.dtype, size, 0)
        _add_forces(forces, rooms, x, _faces(interface), arrays, self._rules(interface))
        return forces.reshape(z.shape)

    def residual_and_tangent(
        self, interface: Interface, pairing: Pairing, z: FloatArray, /
    ) -> tuple[FloatArray, sparse.csr_array]:
        """Compute forces (n_unknowns,) and their derivative from the same parts."""
        x, (arrays, size) = np.array(z).reshape(-1, 3), _arrays_of(interface, pairing)
        members, starts = arrays[5:]
        matrix = zero_matrix(len(x), 0, Couplings(members, starts, starts[:-1]), per_node=3)
        forces, csr = np.zeros(x.shape), (matrix.indptr, matrix.indices, matrix.data)
        rooms = _make_rooms(interface, x.dtype, size, 3 * size)
        _add_springs(forces, csr, rooms, x, _faces(interface), arrays, self._rules(interface))
        return forces.reshape(-1), matrix

    def contact_points(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> ContactPoints:
        """Return the virtual slave nodes of all parts that have a partner."""
        x, slave, parts = np.array(z).reshape(-1, 3), interface.slave.faces, np.flatnonzero(pairing["home"] >= 0)
        home, active = pairing["home"][parts], pairing["active"][parts]
        written = self._nodes(interface, parts, home, x)
        weight, gap, normal, centre, mean, feet = np.split(written, [1, 2, 5, 8, 8 + slave.shape[1]], axis=1)
        return ContactPoints.on_faces(
            slave_segment=parts // N_PARTS,
            slave_shape=mean,
            master_segment=home,
            master_shape=feet,
            position=x[slave[parts // N_PARTS, 0]] + centre,
            normal=normal,
            gap=gap[:, 0],
            pressure=np.where(active, -self.penalty * gap[:, 0], 0.0),
            weight=weight[:, 0],
            active=active,
        )

    def _nodes(self, interface: Interface, parts: IntArray, home: IntArray, x: FloatArray) -> FloatArray:
        faces, of_part = _faces(interface), _make_rooms(interface, x.dtype, 0, 0)[1]
        written = np.empty((len(parts), 8 + faces[0].shape[1] + faces[1].shape[1]))
        _write_nodes(written, of_part, x, faces, parts, home, self._rules(interface))
        return written

    def _rules(self, interface: Interface) -> Fields:
        n_slave, n_master = (faces.shape[1] for faces in _faces(interface))
        return TABLES[n_slave], RULES[n_master], self.balanced, self.along_slave, self.penalty


def _faces(interface: Interface) -> tuple[IntArray, IntArray]:
    return interface.slave.faces, interface.master.faces


def _arrays_of(interface: Interface, pairing: Pairing) -> tuple[Fields, int]:
    """Return the arrays of a pairing, and the most nodes that a part has.

    They are the partners, the parts in contact (n,), where their cells begin and end (n, 2), the faces and codes of
    the cells, the nodes that feel each part, and where these begin (n + 1,).
    """
    (slave, master), part, parts = _faces(interface), pairing["part"], np.flatnonzero(pairing["active"])
    ranges = np.stack([np.searchsorted(part, parts, side) for side in ("left", "right")], axis=1)
    arrays = pairing["home"], parts, ranges, pairing["master_face"], pairing["corners"]
    most = len(parts) * (slave.shape[1] + master.shape[1]) + len(part) * master.shape[1]
    members, starts = np.empty(most, np.int32), np.zeros(len(parts) + 1, np.int64)
    size = _list_members(members, starts, (slave, master), arrays)
    return (*arrays, members[: starts[-1]], starts), size


def vts_ppt_3d(*, penalty: float, normal: str = "master", tau: float = 1e-2) -> FacePatches:
    """VTS-PPT on faces: virtual slave nodes in four parts of each face, pressing on all master faces under their parts.

    Gaps, forces and projections are along the normal of the nearest master face, as the paper has it in the plane. It
    passes the flat patch test. Where surfaces are tilted, the slave is pushed by areas of its own, and the master by
    projected ones: neither force nor moment is conserved, and forces jump where a part crosses an edge of the master.

    With ``normal="slave"`` (ours) everything is along the normal of the slave face, on triangles alone. `tau` is not
    used: a virtual slave node needs a master face opposite.

    Source: Zavarise & De Lorenzis (2009), Boxes 1–3, after their Section 6.3.
    """
    along_slave = choose("normal", normal, {"master": False, "slave": True})
    traits = _ALONG_SLAVE if along_slave else _PRINTED
    return FacePatches(traits, check_penalty(penalty), balanced=False, along_slave=along_slave, tau=check_tau(tau))


def vts_ppt_balanced_3d(*, penalty: float, tau: float = 1e-2) -> FacePatches:
    """VTS-PPT on faces with action equal to reaction (ours): the master faces share the force on the slave.

    Forces do not jump where a part crosses an edge of a flat master. Moment is conserved where the master covers the
    part; else the master's faces push elsewhere than in the middle of the part.
    """
    return FacePatches(_BALANCED, check_penalty(penalty), balanced=True, along_slave=False, tau=check_tau(tau))


_PRINTED = SURFACE_TRAITS.revise(
    faces=(3, 4),
    gap="closest point",
    force_along="master normal",
    integrates_linear_gap=False,
    conserves_force=False,
    conserves_moment=False,
    continuity="jumps",
    witnesses={
        **SURFACE_TRAITS.evidence.witnesses,
        "balance": "tilted-faces",
        "patch.tilted": "tilted-faces",
        "continuity": "sliding-faces",
    },
    source="Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009) 379–416, Boxes 1–3; on faces: here",
)
# A part that overhangs the master presses the slave with all its area, and the master with what is covered.
_ALONG_SLAVE = SURFACE_TRAITS.revise(
    gap="slave normal",
    conserves_force=False,
    conserves_moment=False,
    witnesses={**SURFACE_TRAITS.evidence.witnesses, "balance": "tilted-faces"},
    source="here",
)
_BALANCED = _PRINTED.revise(
    conserves_force=True,
    continuity="C0",
    witnesses={**_PRINTED.evidence.witnesses, "balance": "moved-diagonals"},
)
