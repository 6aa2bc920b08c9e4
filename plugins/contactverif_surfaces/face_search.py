"""Find the cells: the pairs of a slave and a master face that overlap, and the corners of each overlap.

A slave face and a master face make a cell where, seen along the slave's normal,

1. they face each other: the master's corners run the other way round;
2. they overlap: the master face, clipped by the edges of the slave face, keeps at least three corners;
3. no other master face of these is nearer in the middle of the cell; a middle on the edge of a face is on it. So of
   bodies one behind the other only the nearest is touched;
4. the gap there is at most 2 (h_s + h_m) either way, h the longest edge of the connected part of the surface. A deeper
   penetration is no contact, and neither is a body at the back of the slave's (our choice, as in the plane).

A corner of a cell is two integers (i, j): slave corner i is (i, −1), master corner j is (−1, j), and (i, j) is the
crossing of slave edge i and master edge j. The master is numbered in reverse, so that both run counter-clockwise.

Two edges cross only if both ends lie off the other edge by more than `TIE` × size × length of that edge, where the size
is no less than the distance from the origin, at which positions are rounded. Otherwise the place of a crossing would be
a quotient of two roundoffs: meshes that share an edge have many such pairs. For the same reason there is no cell that
is thinner than `TIE` × size: its centroid could be anywhere.

Candidates come from a tree of boxes, at a cost of O(log n) for each slave face. A box with more than `LEAF` faces is
halved across its longest axis, so that boxes side by side hardly overlap. A question is a box along any three axes,
seen from an origin near it, so that a far translation rounds nothing more. The tree leaves out what is clearly apart,
and decides nothing else.

Rule for the next editor: this file makes decisions. It returns integers, never a real number.
"""

import numpy as np

from contactverif.compiler import compile_kernel, compile_maker, compile_part
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray, IntArray
from contactverif.contract.interface import Surface
from contactverif.geometry.block_rows import Fields

MOST_CORNERS = 9  # Two quadrilaterals overlap in eight corners at most, and the clip may count one twice.
TIE = 32 * UNIT_ROUNDOFF  # The share of the size that counts as a distance from an edge.
REACH = 2.0  # The largest gap over the sum of the longest edges of both sides.
# The columns of the table of the cells on one slave face: the middle of the cell, and the plane of the master face,
# whose height is H + X x + Y y.
MIDDLE_X, MIDDLE_Y, HEIGHT, SLOPE_X, SLOPE_Y, N_COLUMNS = range(6)
LEAF = 4  # The number of boxes in a leaf.
# A box that is farther off than this share of all lengths in the comparison is apart, whatever was rounded.
MARGIN = 64 * UNIT_ROUNDOFF
# The numbers of the faces (n,), `LEAF` of them a leaf, and the middle and half the size of each box (2 n_leaves, 2, 3).
# Box 1 holds everything, and box i is halved into 2i and 2i + 1. The second half are the leaves.
Tree = tuple[IntArray, FloatArray]


def find_cells(
    x: FloatArray, slave: IntArray, master: IntArray, slave_edge: FloatArray, master_edge: FloatArray
) -> tuple[IntArray, IntArray]:
    """Return the faces (n_cells, 2) and the corners (n_cells, most_corners, 2) of all cells, in ascending order.

    Positions x are (n_nodes, 3). The last corner of a cell is repeated as often as the fullest cell has more corners.
    The edges are those of `longest_edges`.
    """
    faces, corners = find_face_cells(x, slave, master, (slave_edge, master_edge), tree_of_faces(x, master))
    return faces, np.ascontiguousarray(corners)


def tree_of_faces(x: FloatArray, faces: IntArray) -> Tree:
    """Return the tree of boxes around faces (n_faces, n_corners)."""
    corners = x[faces]
    return grow_tree(np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1))


def longest_edges(surface: Surface, x: FloatArray) -> FloatArray:
    """Return for each face the longest edge of its connected part of the surface, at positions x (n_nodes, 3)."""
    return _longest_edges(x, surface.faces, surface.neighbours)


@compile_maker
def _longest_edges(x: FloatArray, faces: IntArray, neighbours: IntArray) -> FloatArray:
    """Walk from each face that no walk has reached to all that hang together."""
    longest, path = np.full(len(faces), -1.0), np.empty(len(faces), np.int64)
    for start in range(len(faces)):
        if longest[start] >= 0:
            continue
        path[0], count, n_visited, square = start, 1, 0, 0.0
        longest[start] = 0.0
        while n_visited < count:
            face = path[n_visited]
            n_visited += 1
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
    x: FloatArray, slave: IntArray, master: IntArray, edges: tuple[FloatArray, FloatArray], tree: Tree
) -> tuple[IntArray, IntArray]:
    """Return what `find_cells` does, from a tree of the master faces."""
    room, count, most_corners, longest = 4 * (len(slave) + len(master)), 0, 1, 0.0
    slave_edge, master_edge = edges
    faces, corners = np.empty((room, 2), np.int64), np.empty((room, MOST_CORNERS, 2), np.int64)
    on_slave, axes, question = np.empty((slave.shape[1], 3)), np.empty((3, 3)), np.empty((2, 3))
    places, codes = np.empty((2, 2 * MOST_CORNERS, 2)), np.empty((2, 2 * MOST_CORNERS, 3), np.int64)
    clips = places, codes, np.empty(2 * MOST_CORNERS)
    members, rows = np.empty(len(master), np.int64), np.empty(len(master), np.int64)
    views, table = np.empty((len(master), master.shape[1], 3)), np.empty((len(master), N_COLUMNS))
    for m in range(len(master)):
        longest = max(longest, master_edge[m])
    for s in range(len(slave)):
        set_axes(axes, x, slave[s])
        origin = x[slave[s, 0]]
        view_face(on_slave, x, slave[s], origin, axes, False)
        for axis in range(2):
            question[0, axis], question[1, axis] = on_slave[0, axis], on_slave[0, axis]
            for i in range(1, len(on_slave)):
                question[0, axis] = min(question[0, axis], on_slave[i, axis])
                question[1, axis] = max(question[1, axis], on_slave[i, axis])
        # A cell's gap is that in its middle, so the question reaches farther than rule 4 by the longest master edge.
        reach = REACH * (slave_edge[s] + longest) + longest
        question[0, 2], question[1, 2] = -reach, reach
        n_facing = _collect_facing((members, rows, views), x, master, origin, axes, question, tree)
        if count + n_facing > room:
            room = 2 * (count + n_facing)
            old_faces, old_corners = faces, corners
            faces, corners = np.empty((room, 2), np.int64), np.empty((room, MOST_CORNERS, 2), np.int64)
            for cell in range(count):
                _copy_cell(faces, corners, cell, old_faces, old_corners, cell)
        first, size = count, measure_distance(origin)
        for place in range(n_facing):
            m, on_master, row = members[place], views[rows[place]], table[count - first]
            n_corners, half = clip_face(on_slave, on_master, corners[count], clips, size)
            if n_corners > 0:
                _set_plane(row, places[half], n_corners, on_master)
                gap = _height_at(row, row[MIDDLE_X], row[MIDDLE_Y])
                if abs(gap) <= REACH * (slave_edge[s] + master_edge[m]):
                    faces[count, 0], faces[count, 1], rows[count - first] = s, m, rows[place]
                    count, most_corners = count + 1, max(most_corners, n_corners)
        count = _drop_hidden(faces, corners, first, count, (table, rows, views, size))
    return faces[:count], corners[:count, :most_corners]


@compile_part
def _collect_facing(
    candidates: Fields,
    x: FloatArray,
    master: IntArray,
    origin: FloatArray,
    axes: FloatArray,
    question: FloatArray,
    tree: Tree,
) -> int:
    """Write the master faces that may overlap a slave face, ascending, and where their views are; return how many."""
    (members, rows, views), n_facing = candidates, 0
    for place in range(collect_boxes(members, tree, origin, axes, question)):
        m = members[place]
        view_face(views[n_facing], x, master[m], origin, axes, True)
        if may_overlap(question, views[n_facing]):
            i = n_facing
            while i > 0 and members[i - 1] > m:
                members[i], rows[i] = members[i - 1], rows[i - 1]
                i -= 1
            members[i], rows[i] = m, n_facing
            n_facing += 1
    return n_facing


@compile_part
def _copy_cell(
    faces: IntArray, corners: IntArray, to: int, old_faces: IntArray, old_corners: IntArray, place: int
) -> None:
    for side in range(2):
        faces[to, side] = old_faces[place, side]
        for v in range(MOST_CORNERS):
            corners[to, v, side] = old_corners[place, v, side]


@compile_part
def set_axes(axes: FloatArray, x: FloatArray, face: IntArray) -> None:
    """Write the axes (3, 3) of a slave face: along its first edge, across it in its plane, and its normal."""
    along, across, normal = axes[0], axes[1], axes[2]
    first, last = (1, 2) if len(face) == 3 else (2, 3)
    start = 0 if len(face) == 3 else 1
    for axis in range(3):
        along[axis] = x[face[first], axis] - x[face[0], axis]
        across[axis] = x[face[last], axis] - x[face[start], axis]
    _set_cross(normal, along, across)
    _scale(normal)
    part = 0.0
    for axis in range(3):
        along[axis] = x[face[1], axis] - x[face[0], axis]
        part += along[axis] * normal[axis]
    for axis in range(3):
        along[axis] -= part * normal[axis]
    _scale(along)
    _set_cross(across, normal, along)


@compile_part
def _set_cross(product: FloatArray, a: FloatArray, b: FloatArray) -> None:
    product[0] = a[1] * b[2] - a[2] * b[1]
    product[1] = a[2] * b[0] - a[0] * b[2]
    product[2] = a[0] * b[1] - a[1] * b[0]


@compile_part
def _scale(vector: FloatArray) -> None:
    length = np.sqrt(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2])
    for axis in range(3):
        vector[axis] /= length


@compile_part
def view_face(
    places: FloatArray, x: FloatArray, face: IntArray, origin: FloatArray, axes: FloatArray, reverse: bool
) -> None:
    """Write the components (n_corners, 3) of the corners of a face along the axes, seen from the origin."""
    for i in range(len(face)):
        node = face[len(face) - 1 - i if reverse else i]
        arm_x, arm_y, arm_z = x[node, 0] - origin[0], x[node, 1] - origin[1], x[node, 2] - origin[2]
        for row in range(3):
            places[i, row] = arm_x * axes[row, 0] + arm_y * axes[row, 1] + arm_z * axes[row, 2]


@compile_part
def measure_distance(point: FloatArray) -> float:
    """Return the largest coordinate of a point (3,)."""
    return float(max(abs(point[0]), abs(point[1]), abs(point[2])))


@compile_part
def may_overlap(question: FloatArray, master: FloatArray) -> bool:
    """Return whether the box of a master face, seen in the plane, meets that of the slave, and faces it."""
    for axis in range(2):
        first, last = master[0, axis], master[0, axis]
        for j in range(1, len(master)):
            first, last = min(first, master[j, axis]), max(last, master[j, axis])
        if first > question[1, axis] or last < question[0, axis]:
            return False
    turn = 0.0
    for j in range(len(master)):
        k = (j + 1) % len(master)
        turn += master[j, 0] * master[k, 1] - master[j, 1] * master[k, 0]
    return turn > 0


@compile_part
def clip_face(
    slave: FloatArray, master: FloatArray, corners: IntArray, room: Fields, distance: float
) -> tuple[int, int]:
    """Clip the master face by the slave face; write the corners of what is left, and return their number, 0 for none.

    Stored positions are rounded at their `distance` from the origin, which ties must allow for.

    The room is for places, codes and sides. Of both halves of places and codes one is written from the other, once for
    each slave edge that cuts; the half of the result is returned, too. A code is (i, j) and a label, which tells which
    edge leaves a corner: master edge j is j, slave edge i is −1 − i.
    """
    (places, codes, _), size, count, old = room, distance, len(master), 0
    for i in range(len(slave)):
        size = max(size, abs(slave[i, 0]), abs(slave[i, 1]))
    for j in range(count):
        size = max(size, abs(master[j, 0]), abs(master[j, 1]))
        places[0, j, 0], places[0, j, 1] = master[j, 0], master[j, 1]
        codes[0, j, 0], codes[0, j, 1], codes[0, j, 2] = -1, j, j
    for i in range(len(slave)):
        count, old = _cut_by_edge(slave, i, TIE * size, room, count, old)
    area, longest, cell = 0.0, 0.0, places[old]
    for v in range(1, count):
        w = v + 1 if v + 1 < count else v
        x, y = cell[v, 0] - cell[0, 0], cell[v, 1] - cell[0, 1]
        area += (x * (cell[w, 1] - cell[0, 1]) - y * (cell[w, 0] - cell[0, 0])) / 2
        longest = max(longest, x * x + y * y)
    if area <= np.sqrt(longest) * (TIE * size):  # A thin cell
        return 0, old
    for v in range(len(corners)):
        corners[v, 0], corners[v, 1] = codes[old, min(v, count - 1), 0], codes[old, min(v, count - 1), 1]
    return count, old


@compile_part
def _cut_by_edge(slave: FloatArray, i: int, width: float, room: Fields, count: int, old: int) -> tuple[int, int]:
    """Write what lies within slave edge i of a cell of so many corners; return the number of its corners, and its half.

    The half is the old one if the edge cuts nothing off.
    """
    (places, codes, sides), after, n_left, lowest = room, (i + 1) % len(slave), 0, 0.0
    along, across = slave[after, 0] - slave[i, 0], slave[after, 1] - slave[i, 1]
    for v in range(count):
        sides[v] = along * (places[old, v, 1] - slave[i, 1]) - across * (places[old, v, 0] - slave[i, 0])
        lowest = min(lowest, sides[v])
    if lowest == 0:
        return count, old
    tie, new = width * np.sqrt(along * along + across * across), 1 - old
    if lowest >= -tie:
        return count, old
    for v in range(count):
        w = v + 1 if v + 1 < count else 0
        here, there = sides[v], sides[w]
        if here >= -tie:
            places[new, n_left, 0], places[new, n_left, 1] = places[old, v, 0], places[old, v, 1]
            # A corner on the edge goes on along it, if what follows lies beyond.
            label = -1 - i if here <= tie and there < -tie else codes[old, v, 2]
            codes[new, n_left, 0], codes[new, n_left, 1], codes[new, n_left, 2] = (
                codes[old, v, 0],
                codes[old, v, 1],
                label,
            )
            n_left += 1
        if min(here, there) < -tie and max(here, there) > tie:
            share, label = here / (here - there), codes[old, v, 2]
            for axis in range(2):
                start = places[old, v, axis]
                places[new, n_left, axis] = start + share * (places[old, w, axis] - start)
            if label >= 0:
                codes[new, n_left, 0], codes[new, n_left, 1] = i, label
            else:  # Two slave edges cross at a corner.
                codes[new, n_left, 0], codes[new, n_left, 1] = i if -label % len(slave) == i else after, -1
            codes[new, n_left, 2] = -1 - i if here > tie else label
            n_left += 1
    return n_left, new


@compile_part
def _set_plane(row: FloatArray, places: FloatArray, count: int, master: FloatArray) -> None:
    """Write the middle of a cell and the plane of its master face: that of its diagonals, through its corners' mean."""
    row[MIDDLE_X], row[MIDDLE_Y], row[HEIGHT] = 0.0, 0.0, 0.0
    for v in range(count):
        row[MIDDLE_X] += places[v, 0]
        row[MIDDLE_Y] += places[v, 1]
    row[MIDDLE_X], row[MIDDLE_Y] = row[MIDDLE_X] / count, row[MIDDLE_Y] / count
    last, start = (2, 0) if len(master) == 3 else (3, 1)
    first = 1 if len(master) == 3 else 2
    a_x, a_y, a_z = master[first, 0] - master[0, 0], master[first, 1] - master[0, 1], master[first, 2] - master[0, 2]
    b_x, b_y = master[last, 0] - master[start, 0], master[last, 1] - master[start, 1]
    b_z, turn = master[last, 2] - master[start, 2], a_x * b_y - a_y * b_x
    row[SLOPE_X], row[SLOPE_Y] = (a_z * b_y - a_y * b_z) / turn, (a_x * b_z - a_z * b_x) / turn
    for j in range(len(master)):
        rise = row[SLOPE_X] * master[j, 0] + row[SLOPE_Y] * master[j, 1]
        row[HEIGHT] += (master[j, 2] - rise) / len(master)


@compile_part
def _height_at(row: FloatArray, x: float, y: float) -> float:
    return float(row[HEIGHT] + row[SLOPE_X] * x + row[SLOPE_Y] * y)


@compile_part
def _drop_hidden(faces: IntArray, corners: IntArray, first: int, count: int, of_cells: Fields) -> int:
    """Keep the cells, from the first one of a slave face on, in whose middle no other master face is nearer."""
    (table, rows, views, size), n_left = of_cells, first
    for cell in range(first, count):
        k, hidden = cell - first, False
        x, y = table[k, MIDDLE_X], table[k, MIDDLE_Y]
        height = abs(_height_at(table[k], x, y))
        for other in range(count - first):
            if abs(_height_at(table[other], x, y)) < height:
                hidden = hidden or holds_points(views[rows[other]], table[k : k + 1], size)
        if not hidden:
            if n_left < cell:
                _copy_cell(faces, corners, n_left, faces, corners, cell)
            n_left += 1
    return n_left


@compile_part
def holds_points(face: FloatArray, points: FloatArray, size: float) -> bool:
    """Return whether all points lie on a face, seen along an axis, or past an edge of it by no more than a tie.

    The size is the distance at which positions are rounded.
    """
    for j in range(len(face)):
        k = (j + 1) % len(face)
        along, across = face[k, 0] - face[j, 0], face[k, 1] - face[j, 1]
        for i in range(len(points)):
            place = along * (points[i, 1] - face[j, 1]) - across * (points[i, 0] - face[j, 0])
            if place < 0 and place < -_tie_of(face, points, size) * np.sqrt(along * along + across * across):
                return False
    return True


@compile_part
def _tie_of(face: FloatArray, points: FloatArray, size: float) -> float:
    for corners in (face, points):
        for i in range(len(corners)):
            size = max(size, abs(corners[i, 0]), abs(corners[i, 1]))
    return TIE * size


def grow_tree(boxes: FloatArray) -> Tree:
    """Return the tree of boxes (n, 2, 3), lower and upper corner each."""
    order, nodes = np.arange(len(boxes)), np.empty((2 << max(0, (len(boxes) - 1) // LEAF).bit_length(), 2, 3))
    _halve_boxes(order, np.empty(len(boxes)), boxes.sum(axis=1), len(nodes) // 2)
    _write_boxes(order, nodes, boxes)
    return order, nodes


@compile_kernel
def _halve_boxes(order: IntArray, keys: FloatArray, middles: FloatArray, n_leaves: int) -> None:
    """Sort boxes so that the halves of each box lie on both sides of a plane, across its longest axis."""
    width = n_leaves
    while width > 1:
        for first in range(0, n_leaves, width):
            start, cut, end = first * LEAF, (first + width // 2) * LEAF, min((first + width) * LEAF, len(order))
            longest, length = 0, -1.0
            for axis in range(3 if cut < end else 0):
                low, high = np.inf, -np.inf
                for place in range(start, end):
                    low, high = min(low, middles[order[place], axis]), max(high, middles[order[place], axis])
                if high - low > length:
                    longest, length = axis, high - low
            for place in range(start, end if cut < end else start):
                keys[place] = middles[order[place], longest]
            while start < end and cut < end:  # Hoare's selection: what is below the cut comes before it.
                i, j, middle = start, end - 1, keys[(start + end) // 2]
                while i <= j:
                    while keys[i] < middle:
                        i += 1
                    while keys[j] > middle:
                        j -= 1
                    if i <= j:
                        keys[i], keys[j], order[i], order[j] = keys[j], keys[i], order[j], order[i]
                        i, j = i + 1, j - 1
                start, end = (start, j + 1) if cut <= j else ((i, end) if cut >= i else (end, end))
        width //= 2


@compile_kernel
def _write_boxes(order: IntArray, nodes: FloatArray, boxes: FloatArray) -> None:
    """Write the middle and half the size of the boxes of a tree; those of empty leaves meet nothing."""
    n_leaves = len(nodes) // 2
    for box in range(len(nodes)):
        for axis in range(3):
            nodes[box, 0, axis], nodes[box, 1, axis] = np.inf, -np.inf
    for place in range(len(order)):
        for axis in range(3):
            leaf = n_leaves + place // LEAF
            nodes[leaf, 0, axis] = min(nodes[leaf, 0, axis], boxes[order[place], 0, axis])
            nodes[leaf, 1, axis] = max(nodes[leaf, 1, axis], boxes[order[place], 1, axis])
    for parent in range(n_leaves - 1, 0, -1):
        for axis in range(3):
            nodes[parent, 0, axis] = min(nodes[2 * parent, 0, axis], nodes[2 * parent + 1, 0, axis])
            nodes[parent, 1, axis] = max(nodes[2 * parent, 1, axis], nodes[2 * parent + 1, 1, axis])
    for box in range(len(nodes)):
        for axis in range(3):
            low, high = nodes[box, 0, axis], nodes[box, 1, axis]
            middle = low / 2 + high / 2 if low <= high else 0.0
            nodes[box, 0, axis], nodes[box, 1, axis] = middle, max(high - middle, middle - low)


@compile_part
def collect_boxes(members: IntArray, tree: Tree, origin: FloatArray, axes: FloatArray, question: FloatArray) -> int:
    """Write the numbers of boxes into `members`, all that meet a question and some more; return how many.

    The question (2, 3) holds the points whose components along the `axes` (3, 3), seen from the origin, are between its
    rows.
    """
    order, nodes = tree
    n_leaves, count, box = len(nodes) // 2, 0, 1
    while True:
        if _meets(nodes[box], origin, axes, question):
            if box < n_leaves:  # down to the first half
                box = 2 * box
                continue
            start = (box - n_leaves) * LEAF
            for place in range(start, min(start + LEAF, len(order))):
                members[count] = order[place]
                count += 1
        while box & 1:  # up from second halves
            box >>= 1
        if box == 0:
            return count
        box += 1  # on to the second half


@compile_part
def _meets(box: FloatArray, origin: FloatArray, axes: FloatArray, question: FloatArray) -> bool:
    """Return whether a box (2, 3) may meet a question; an empty one does not."""
    if box[1, 0] < 0:
        return False
    for row in range(3):
        middle, half, size = 0.0, 0.0, 0.0
        for axis in range(3):
            arm = axes[row, axis] * (box[0, axis] - origin[axis])
            middle, size = middle + arm, size + abs(arm)
            half += abs(axes[row, axis]) * box[1, axis]
        half += MARGIN * (size + half)
        if middle - half > question[1, row] or middle + half < question[0, row]:
            return False
    return True
