"""Find the cells: the pairs of a slave and a master face that overlap, and the corners of each overlap.

A slave face and a master face make a cell where, seen along the slave's normal,

1. they face each other: the master's corners run the other way round;
2. they overlap: the master face, clipped by the edges of the slave face, keeps at least three corners;
3. no other master face of these is nearer in the middle of the cell. So of bodies one behind the other only the nearest
   is touched;
4. the gap there is at most 2 (h_s + h_m) either way, h the longest edge of the connected part of the surface. A deeper
   penetration is no contact, and neither is a body at the back of the slave's (our choice, as in the plane).

A corner of a cell is two integers (i, j): slave corner i is (i, −1), master corner j is (−1, j), and (i, j) is the
crossing of slave edge i and master edge j. The master is numbered in reverse, so that both run counter-clockwise.

Two edges cross only if both ends lie off the other edge by more than `TIE` × size × length of that edge. Otherwise the
place of a crossing would be a quotient of two roundoffs: meshes that share an edge have many such pairs. For the same
reason there is no cell that is thinner than `TIE` × size: its centroid could be anywhere.

Candidates come from a tree of boxes (`face_tree`), at a cost of O(log n) for each slave face.

Rule for the next editor: this file makes decisions. It returns integers, never a real number.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.interface import Surface
from contactverif.geometry.compiled import compile_maker, compile_part
from contactverif_surfaces.face_tree import Tree, collect_boxes, grow_tree

MOST_CORNERS = 9  # Two quadrilaterals overlap in eight corners at most, and the clip may count one twice.
TIE = 32 * UNIT_ROUNDOFF  # The share of the size that counts as a distance from an edge.
REACH = 2.0  # The largest gap over the sum of the longest edges of both sides.
# The columns of the table of the cells on one slave face: the middle of the cell, and the plane of the master face,
# whose height is H + X x + Y y.
MIDDLE_X, MIDDLE_Y, HEIGHT, SLOPE_X, SLOPE_Y, N_COLUMNS = range(6)


def find_cells(
    x: FloatArray, slave: IntArray, master: IntArray, slave_edge: FloatArray, master_edge: FloatArray
) -> tuple[IntArray, IntArray]:
    """Return the faces (n_cells, 2) and the corners (n_cells, MOST_CORNERS, 2) of all cells, in ascending order.

    Positions x are (n_nodes, 3). The last corner of a cell is repeated. The edges are those of `longest_edges`.
    """
    return find_face_cells(x, slave, master, slave_edge, master_edge, *tree_of_faces(x, master))


def tree_of_faces(x: FloatArray, faces: IntArray) -> Tree:
    """Return the tree of boxes around faces (n_faces, n_corners)."""
    corners = x[faces]
    return grow_tree(np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1))


def longest_edges(surface: Surface, x: FloatArray) -> FloatArray:
    """Return for each face the longest edge of its connected part of the surface, at positions x (n_nodes, 3)."""
    return _longest_edges(x, surface.faces, surface.neighbours)


@compile_maker
def _longest_edges(x: FloatArray, faces: IntArray, neighbours: IntArray) -> FloatArray:
    """Return the lengths (n_faces,), walking from each face that no walk has reached to all that hang together."""
    longest, path = np.full(len(faces), -1.0), np.empty(len(faces), np.int64)
    for start in range(len(faces)):
        if longest[start] >= 0:
            continue
        path[0], count, done, square = start, 1, 0, 0.0
        longest[start] = 0.0
        while done < count:
            face = path[done]
            done += 1
            for i in range(faces.shape[1]):
                a, b, length = faces[face, i], faces[face, (i + 1) % faces.shape[1]], 0.0
                for axis in range(3):
                    length += (x[b, axis] - x[a, axis]) ** 2
                square = max(square, length)
                other = neighbours[face, i]
                if other >= 0 and longest[other] < 0:
                    path[count], longest[other] = other, 0.0
                    count += 1
        for place in range(count):
            longest[path[place]] = np.sqrt(square)
    return longest


@compile_maker
def find_face_cells(
    x: FloatArray,
    slave: IntArray,
    master: IntArray,
    slave_edge: FloatArray,
    master_edge: FloatArray,
    order: IntArray,
    boxes: FloatArray,
) -> tuple[IntArray, IntArray]:
    """Return what `find_cells` does, from a tree of the master faces."""
    room, count, n_slave, n_master = 4 * (len(slave) + len(master)), 0, slave.shape[1], master.shape[1]
    faces, corners = np.empty((room, 2), np.int64), np.empty((room, MOST_CORNERS, 2), np.int64)
    seen_slave, seen_master = np.empty((n_slave, 3)), np.empty((n_master, 3))
    axes, low, high, members = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(len(master), np.int64)
    places, codes = np.empty((2, 2 * MOST_CORNERS, 2)), np.empty((2, 2 * MOST_CORNERS, 3), np.int64)
    table, longest = np.empty((len(master), N_COLUMNS)), master_edge.max()
    for s in range(len(slave)):
        set_axes(axes, x, slave[s])
        origin = x[slave[s, 0]]
        view_face(seen_slave, x, slave[s], origin, axes, False)
        for axis in range(2):
            low[axis], high[axis] = seen_slave[:, axis].min(), seen_slave[:, axis].max()
        high[2] = REACH * (slave_edge[s] + longest) + longest  # A cell's gap is that in its middle.
        low[2] = -high[2]
        n_members = collect_boxes(order, boxes, origin, axes, low, high, members)
        n_facing = 0
        for place in range(n_members):  # Sorted as they come.
            m = members[place]
            view_face(seen_master, x, master[m], origin, axes, True)
            if may_overlap(low, high, seen_master):
                i = n_facing
                while i > 0 and members[i - 1] > m:
                    members[i] = members[i - 1]
                    i -= 1
                members[i] = m
                n_facing += 1
        first = count
        for place in range(n_facing):
            m = members[place]
            view_face(seen_master, x, master[m], origin, axes, True)
            if count == room:
                room *= 2
                faces, corners = lengthen(faces, corners, room)
            n_corners = clip_face(seen_slave, seen_master, corners[count], places, codes)
            if n_corners == 0:
                continue
            row = table[count - first]
            set_plane(row, places[n_slave % 2], n_corners, seen_master)
            gap = height_at(row, row[MIDDLE_X], row[MIDDLE_Y])
            if abs(gap) <= REACH * (slave_edge[s] + master_edge[m]):
                faces[count, 0], faces[count, 1] = s, m
                count += 1
        if count > first + 1:
            count = drop_hidden(x, master, origin, axes, faces, corners, first, count, table, seen_master)
    return faces[:count], corners[:count]


@compile_maker
def lengthen(faces: IntArray, corners: IntArray, room: int) -> tuple[IntArray, IntArray]:
    """Return copies of both arrays with room for more cells."""
    more_faces, more_corners = np.empty((room, 2), np.int64), np.empty((room, MOST_CORNERS, 2), np.int64)
    more_faces[: len(faces)], more_corners[: len(corners)] = faces, corners
    return more_faces, more_corners


@compile_part
def set_axes(axes: FloatArray, x: FloatArray, face: IntArray) -> None:
    """Write the axes (3, 3) of a slave face: along its first edge, across it in its plane, and its normal."""
    along, across, normal = axes
    first, last = (1, 2) if len(face) == 3 else (2, 3)
    start = 0 if len(face) == 3 else 1
    for axis in range(3):
        along[axis] = x[face[first], axis] - x[face[0], axis]
        across[axis] = x[face[last], axis] - x[face[start], axis]
    set_cross(normal, along, across)
    scale(normal)
    part = 0.0
    for axis in range(3):
        along[axis] = x[face[1], axis] - x[face[0], axis]
        part += along[axis] * normal[axis]
    for axis in range(3):
        along[axis] -= part * normal[axis]
    scale(along)
    set_cross(across, normal, along)


@compile_part
def set_cross(product: FloatArray, a: FloatArray, b: FloatArray) -> None:
    """Write a × b."""
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]


@compile_part
def scale(vector: FloatArray) -> None:
    """Divide a vector by its length."""
    length = np.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])
    for axis in range(3):
        vector[axis] /= length


@compile_part
def view_face(
    seen: FloatArray, x: FloatArray, face: IntArray, origin: FloatArray, axes: FloatArray, reverse: bool
) -> None:
    """Write the components (n_corners, 3) of the corners of a face along the axes, seen from the origin."""
    for i in range(len(face)):
        node = face[len(face) - 1 - i if reverse else i]
        arm_x, arm_y, arm_z = x[node, 0] - origin[0], x[node, 1] - origin[1], x[node, 2] - origin[2]
        for row in range(3):
            seen[i, row] = arm_x * axes[row, 0] + arm_y * axes[row, 1] + arm_z * axes[row, 2]


@compile_part
def may_overlap(low: FloatArray, high: FloatArray, master: FloatArray) -> bool:
    """Return whether the boxes of two faces, seen in the plane, overlap, and the master faces the slave."""
    for axis in range(2):
        first, last = master[0, axis], master[0, axis]
        for j in range(1, len(master)):
            first, last = min(first, master[j, axis]), max(last, master[j, axis])
        if first > high[axis] or last < low[axis]:
            return False
    turn = 0.0
    for j in range(len(master)):
        k = (j + 1) % len(master)
        turn += master[j, 0] * master[k, 1] - master[j, 1] * master[k, 0]
    return turn > 0


@compile_part
def clip_face(slave: FloatArray, master: FloatArray, corners: IntArray, places: FloatArray, codes: IntArray) -> int:
    """Clip the master face by the slave face; write the corners of what is left, and return their number, 0 for none.

    Of both halves of `places` and `codes` one is written from the other, once for each slave edge: the result is in
    half `len(slave) % 2`. A code is (i, j) and a label, which tells which edge leaves a corner: master edge j is j,
    slave edge i is −1 − i.
    """
    size, count, old = 0.0, len(master), 0
    for i in range(len(slave)):
        size = max(size, abs(slave[i, 0]), abs(slave[i, 1]))
    for j in range(count):
        size = max(size, abs(master[j, 0]), abs(master[j, 1]))
        places[0, j, 0], places[0, j, 1] = master[j, 0], master[j, 1]
        codes[0, j, 0], codes[0, j, 1], codes[0, j, 2] = -1, j, j
    for i in range(len(slave)):
        after = (i + 1) % len(slave)
        along, across = slave[after, 0] - slave[i, 0], slave[after, 1] - slave[i, 1]
        tie = TIE * size * np.sqrt(along * along + across * across)
        n_left, new = 0, 1 - old
        for v in range(count):
            w = (v + 1) % count
            here = along * (places[old, v, 1] - slave[i, 1]) - across * (places[old, v, 0] - slave[i, 0])
            there = along * (places[old, w, 1] - slave[i, 1]) - across * (places[old, w, 0] - slave[i, 0])
            if here >= -tie:
                for axis in range(2):
                    places[new, n_left, axis] = places[old, v, axis]
                for part in range(3):
                    codes[new, n_left, part] = codes[old, v, part]
                if here <= tie and there < -tie:  # The corner is on the edge, which goes on from there.
                    codes[new, n_left, 2] = -1 - i
                n_left += 1
            if (here > tie and there < -tie) or (here < -tie and there > tie):
                share = here / (here - there)
                for axis in range(2):
                    step = places[old, w, axis] - places[old, v, axis]
                    places[new, n_left, axis] = places[old, v, axis] + share * step
                set_crossing(codes[new, n_left], i, codes[old, v, 2], len(slave))
                codes[new, n_left, 2] = -1 - i if here > tie else codes[old, v, 2]
                n_left += 1
        if n_left < 3:
            return 0
        count, old = n_left, new
    if is_thin(places[old], count, TIE * size):
        return 0
    for v in range(len(corners)):
        corners[v, 0], corners[v, 1] = codes[old, min(v, count - 1), 0], codes[old, min(v, count - 1), 1]
    return count


@compile_part
def is_thin(places: FloatArray, count: int, width: float) -> bool:
    """Return whether the first corners (count, 2) of a cell enclose less than their longest distance × a width."""
    area, longest = 0.0, 0.0
    for v in range(1, count):
        w = v + 1 if v + 1 < count else v
        x, y = places[v, 0] - places[0, 0], places[v, 1] - places[0, 1]
        area += (x * (places[w, 1] - places[0, 1]) - y * (places[w, 0] - places[0, 0])) / 2
        longest = max(longest, x * x + y * y)
    return bool(area <= np.sqrt(longest) * width)


@compile_part
def set_crossing(code: IntArray, i: int, label: int, n_corners: int) -> None:
    """Write the code of the crossing of slave edge i and the edge with a label: two slave edges cross at a corner."""
    if label >= 0:
        code[0], code[1] = i, label
    else:
        other = -1 - label
        code[0] = i if (other + 1) % n_corners == i else (i + 1) % n_corners
        code[1] = -1


@compile_part
def set_plane(row: FloatArray, places: FloatArray, count: int, master: FloatArray) -> None:
    """Write the middle of a cell, the mean of its corners, and the plane of its master face, seen from the slave.

    The plane of a warped quadrilateral is that of its diagonals, through the mean of its corners.
    """
    row[:] = 0.0
    for v in range(count):
        row[MIDDLE_X] += places[v, 0] / count
        row[MIDDLE_Y] += places[v, 1] / count
    last, start = (2, 0) if len(master) == 3 else (3, 1)
    first = 1 if len(master) == 3 else 2
    a_x, a_y, a_z = master[first, 0] - master[0, 0], master[first, 1] - master[0, 1], master[first, 2] - master[0, 2]
    b_x, b_y = master[last, 0] - master[start, 0], master[last, 1] - master[start, 1]
    b_z, turn = master[last, 2] - master[start, 2], a_x * b_y - a_y * b_x
    row[SLOPE_X], row[SLOPE_Y] = (a_z * b_y - a_y * b_z) / turn, (a_x * b_z - a_z * b_x) / turn
    for corner in master:
        rise = row[SLOPE_X] * corner[0] + row[SLOPE_Y] * corner[1]
        row[HEIGHT] += (corner[2] - rise) / len(master)


@compile_part
def height_at(row: FloatArray, x: float, y: float) -> float:
    """Return the height of the plane of a master face over a place in the plane of the slave face."""
    return float(row[HEIGHT] + row[SLOPE_X] * x + row[SLOPE_Y] * y)


@compile_part
def drop_hidden(
    x: FloatArray,
    master: IntArray,
    origin: FloatArray,
    axes: FloatArray,
    faces: IntArray,
    corners: IntArray,
    first: int,
    count: int,
    table: FloatArray,
    seen: FloatArray,
) -> int:
    """Keep the cells, from the first one of a slave face on, in whose middle no other master face is nearer."""
    for other in range(first, count):
        view_face(seen, x, master[faces[other, 1]], origin, axes, True)
        for cell in range(first, count):
            row = table[cell - first]
            x_m, y_m = row[MIDDLE_X], row[MIDDLE_Y]
            if other == cell or not holds_place(seen, x_m, y_m):
                continue
            if abs(height_at(table[other - first], x_m, y_m)) < abs(height_at(row, x_m, y_m)):
                faces[cell, 0] = -1
    kept = first
    for cell in range(first, count):
        if faces[cell, 0] >= 0:
            for side in range(2):
                faces[kept, side] = faces[cell, side]
                for v in range(MOST_CORNERS):
                    corners[kept, v, side] = corners[cell, v, side]
            kept += 1
    return kept


@compile_part
def holds_place(face: FloatArray, x: float, y: float) -> bool:
    """Return whether a place lies inside a face, both seen in the plane of the slave face."""
    for j in range(len(face)):
        k = (j + 1) % len(face)
        along, across = face[k, 0] - face[j, 0], face[k, 1] - face[j, 1]
        if along * (y - face[j, 1]) - across * (x - face[j, 0]) <= 0:
            return False
    return True
