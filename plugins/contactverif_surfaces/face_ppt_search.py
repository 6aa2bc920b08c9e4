"""The search of VTS-PPT on faces: the parts of slave faces, the partner of each, and the patch of faces under it.

A slave face has four parts, each with one virtual slave node V. With N̄_k, the mean of the shape function N_k over the
part, and corners x_k

    V = Σ N̄_k x_k          A = the area of the part

A triangle has three parts at its corners and one in its middle, a quadrilateral the quarters of its parameter square.
There both are sums over 2 × 2 Gauss points with weights |∂s × ∂t|, so they do not depend on who sees the face.

1. The partner m of V is the nearest face of the master, back faces counted. A quadrilateral is taken for four triangles
   about the mean of its corners. Squared distances tie if they differ by 64 u d D or less, where D is the distance of
   the farthest corner. Of such faces that one counts past which the foot of V lies least, then the lowest number.
2. The part faces m if the normal of its face has a negative product with the normal n of m. V lies on the surface
   unless its nearest place is on a free edge, or at a node of one, and V is past that by more than τ × the least height
   of m. It is in contact if its height g over m along n is negative, too.
3. The patch grows from m across edges, to each face that is seen from its front along n and overlaps the part there.
   So another layer of the master is never reached. What is past a free edge, or turns away, carries nothing.
4. If m carries alone, or nothing of the part, Eq. 6 holds at the foot of V, and the part has no cells. But a part of a
   quadrilateral, or over one, that lies in m is a cell: Eq. 6 would not integrate its shape functions.

A cell is the overlap of a part and a master face, seen along n, with corners as in `face_search`. The part takes the
place of the slave face there. Seen along n its corners run the other way round, so they are reversed.

Rule for the next editor: this file makes decisions. It returns integers, never a real number.
"""

import numpy as np

from contactverif.compiler import compile_inline, compile_kernel, compile_part
from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import QUADRILATERAL, TRIANGLE, Interface, Surface
from contactverif.geometry.block_rows import Fields
from contactverif_surfaces.cell_points import PAST_BORDER, SlaveView, evaluate_shapes
from contactverif_surfaces.face_search import (
    MOST_CORNERS,
    Tree,
    clip_face,
    collect_boxes,
    find_cells,
    holds_points,
    longest_edges,
    may_overlap,
    measure_distance,
    set_axes,
    tree_of_faces,
    view_face,
)

N_PARTS = 4


def _quarter(n_corners: int) -> FloatArray:
    """Return the corners of the parts as shares of the corners of a face, (N_PARTS, corners of a part, n_corners).

    Each corner of the face has a part, between the middles of its edges. A triangle has a fourth part in its middle.
    """
    whole = np.eye(n_corners)
    after, before = (whole + np.roll(whole, step, axis=0) for step in (-1, 1))
    if n_corners == TRIANGLE:
        corners = np.stack([whole, after / 2, before / 2], axis=1)
        return np.concatenate([corners, corners[None, :, 1]])
    return np.stack([whole, after / 2, np.full_like(whole, 1 / n_corners), before / 2], axis=1)


PARTS = {n_corners: _quarter(n_corners) for n_corners in (3, 4)}
TIED = 64 * UNIT_ROUNDOFF
INSIDE = -1  # The nearest place of a face is on no edge of it.
Arm = tuple[float, float, float]  # A vector in space.
# The parts of a face: their corners as shares of those of the face (N_PARTS, corners of a part, n_corners); the shape
# functions at their Gauss points (N_PARTS, n_points, n_corners), and the slopes of these along both parameters; and the
# area of the parameter plane for which a point stands.
PartTable = tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]


def _tabulate_parts(n_corners: int) -> PartTable:
    corners = PARTS[n_corners]
    if n_corners == TRIANGLE:
        slopes = (np.tile(np.array(row), (N_PARTS, 1, 1)) for row in ([-1.0, 1, 0], [-1.0, 0, 1]))
        return corners, corners.mean(axis=1, keepdims=True), *slopes, 1 / 8
    square, low = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), (1 - 1 / np.sqrt(3)) / 2
    s, t = np.moveaxis((corners @ square).min(axis=1)[:, None] + (low + (1 - 2 * low) * square) / 2, 2, 0)
    shapes = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=-1)
    along_s, along_t = np.stack([t - 1, 1 - t, t, -t], axis=-1), np.stack([s - 1, -s, s, 1 - s], axis=-1)
    return corners, shapes, along_s, along_t, 1 / 16


TABLES = {n_corners: _tabulate_parts(n_corners) for n_corners in (TRIANGLE, QUADRILATERAL)}


def find_patches(interface: Interface, x: FloatArray, tau: float) -> tuple[IntArray, BoolArray, IntArray, IntArray]:
    """Return the partner of each part and whether the part is in contact, and all cells.

    The partner (n_parts,) is −1 where the part does not face it, or lies past the border. Cells are their parts and
    faces (n_cells, 2), ascending by part, and the codes of their corners (n_cells, most_corners, 2).
    """
    slave, master, neighbours = interface.slave.faces, interface.master.faces, interface.master.neighbours
    free, table = _mark_border(interface.master, len(x)), TABLES[slave.shape[1]]
    surfaces = slave, master, neighbours, free, interface.master.heights(x), tree_of_faces(x, master)
    n, n_slave, n_master, size = len(master), slave.shape[1], master.shape[1], 2 * MOST_CORNERS
    faces, axes = tuple(map(np.empty, ((n_slave, 3), (n_master, 3), table[0].shape[1:2] + (3,)))), np.empty((2, 3, 3))
    candidates = _make_candidates(n)
    shapes = np.empty(n_slave), np.empty(n_master), np.empty((n_master, 2))
    clips = np.empty((2, size, 2)), np.empty((2, size, 3), np.int64), np.empty(size)
    count, n_parts = 4 * len(slave) * N_PARTS, len(slave) * N_PARTS
    while True:
        home, active, mark = np.full(n_parts, -1), np.zeros(n_parts, np.bool_), np.full(n, -1)
        cells, corners = np.empty((count, 2), np.int64), np.empty((count + 1, MOST_CORNERS, 2), np.int64)
        rooms = candidates, *faces, *shapes, axes[0], axes[1], np.zeros((2, 3)), clips, np.empty(n, np.int64), mark
        room, count = count, _find_patches((home, active, cells, corners), rooms, x, surfaces, (table, tau))
        if count <= room:
            return home, active, cells[:count], corners[:count]


def find_opposite_faces(interface: Interface, x: FloatArray) -> tuple[IntArray, IntArray, IntArray]:
    """Return the face straight below each V along the slave's normal (n_parts,), −1 for none, and all cells.

    The cells are those of `face_search`, a part for a slave face, as `find_patches` returns them. V is the mean of its
    part's corners, so faces are triangles.
    """
    slave, master = interface.slave.faces, interface.master
    corners = (PARTS[TRIANGLE][:, ::-1] @ x[slave][:, None]).reshape(-1, 3)
    numbers, reverse = np.arange(len(corners)).reshape(-1, 3), master.faces[:, ::-1] + len(corners)
    edges = np.repeat(longest_edges(interface.slave, x), N_PARTS), longest_edges(master, x)
    cells, codes = find_cells(np.vstack([corners, x]), numbers, np.ascontiguousarray(reverse), *edges)
    view = SlaveView.of_corners(corners[numbers[cells[:, 0]]], x[master.faces[cells[:, 1]]])
    depth = evaluate_shapes(view.master, view.slave.mean(axis=1, keepdims=True)).min(axis=(1, 2))
    home, order = np.full(len(numbers), -1), np.argsort(-depth, kind="stable")[::-1]
    part, face = cells[order[depth[order] > -PAST_BORDER]].T
    home[part] = face  # The deepest face of a part comes last.
    return home, cells, codes


@compile_inline
def cross(a: Arm, b: Arm) -> Arm:
    """Return the cross product of two vectors."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compile_inline
def dot(a: Arm, b: Arm) -> float:
    """Return the scalar product of two vectors, also of complex ones."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compile_part
def combine(face: Array, shares: FloatArray) -> Arm:
    """Return the sum of shares (n_corners,) × corners (n_corners, 3)."""
    x, y, z = 0.0 * face[0, 0], 0.0 * face[0, 0], 0.0 * face[0, 0]
    for i in range(len(face)):
        x, y, z = x + shares[i] * face[i, 0], y + shares[i] * face[i, 1], z + shares[i] * face[i, 2]
    return x, y, z


@compile_part
def place_part(mean: Array, face: Array, table: Fields, k: int) -> tuple[float, Arm]:
    """Write N̄ (n_corners,) of part k of a face with corners (n_corners, 3); return its area and V."""
    _, shapes, along_s, along_t, share = table
    area = 0.0 * face[0, 0]
    mean[:] = 0.0
    for point in range(shapes.shape[1]):
        n = cross(combine(face, along_s[k, point]), combine(face, along_t[k, point]))
        weight = share * np.sqrt(dot(n, n))
        area += weight
        for i in range(len(face)):  # A single point has no differences, and its shape functions are not rounded.
            mean[i] += weight * (shapes[k, point, i] - shapes[k, 0, i])
    for i in range(len(face)):
        mean[i] = shapes[k, 0, i] + mean[i] / area
    return area, combine(face, mean)


@compile_part
def set_corners(part: Array, face: Array, shares: FloatArray) -> None:
    """Write the corners (n_part_corners, 3) of a part of a face (n_corners, 3), in reverse."""
    for i in range(len(part)):
        part[i, 0], part[i, 1], part[i, 2] = combine(face, shares[len(part) - 1 - i])


@compile_part
def set_shapes(shapes: Array, slopes: Array, face: Array, s: float, t: float) -> None:
    """Write the shape functions (n_corners,) of a face (n_corners, 3), seen along its third axis, at (s, t).

    `slopes` (n_corners, 2) are their derivatives by s and t. `cell_points.evaluate_shapes` explains the formulas.
    """
    last = len(face) - 1
    a_s, a_t = face[1, 0] - face[0, 0], face[1, 1] - face[0, 1]
    b_s, b_t = face[last, 0] - face[0, 0], face[last, 1] - face[0, 1]
    arm_s, arm_t = s - face[0, 0], t - face[0, 1]
    area = a_s * b_t - a_t * b_s
    by_u, by_v = arm_s * b_t - arm_t * b_s, a_s * arm_t - a_t * arm_s
    if last == 2:
        shapes[1], shapes[2] = by_u / area, by_v / area
        shapes[0] = 1 - shapes[1] - shapes[2]
        slopes[1, 0], slopes[1, 1] = b_t / area, -b_s / area
        slopes[2, 0], slopes[2, 1] = -a_t / area, a_s / area
        slopes[0, 0], slopes[0, 1] = (a_t - b_t) / area, (b_s - a_s) / area
        return
    w_s, w_t = face[2, 0] - face[3, 0] - a_s, face[2, 1] - face[3, 1] - a_t
    turn = arm_s * w_t - arm_t * w_s
    root_u = _signed_root((area - turn) ** 2 + 4 * (a_s * w_t - a_t * w_s) * by_u, area)
    root_v = _signed_root((area + turn) ** 2 + 4 * (w_s * b_t - w_t * b_s) * by_v, area)
    u, v = 2 * by_u / (area - turn + root_u), 2 * by_v / (area + turn + root_v)
    shapes[0], shapes[1], shapes[2], shapes[3] = (1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v
    a_s, a_t, b_s, b_t = a_s + v * w_s, a_t + v * w_t, b_s + u * w_s, b_t + u * w_t
    area = a_s * b_t - a_t * b_s
    for axis, u_d, v_d in ((0, b_t / area, -a_t / area), (1, -b_s / area, a_s / area)):
        slopes[0, axis], slopes[1, axis] = -u_d * (1 - v) - v_d * (1 - u), u_d * (1 - v) - v_d * u
        slopes[2, axis], slopes[3, axis] = u_d * v + v_d * u, v_d * (1 - u) - u_d * v


@compile_inline
def _signed_root(square: float, sign: float) -> float:
    root: float = np.sqrt(square) if square.real > 0 else 0.0 * square
    return -root if sign.real < 0 else root


@compile_part
def _look_at_triangle(nearest: FloatArray, corners: FloatArray) -> tuple[int, float]:
    """Write the point (3,) of a triangle (3, 3) nearest to the origin; return where it is, and its squared distance.

    It is on an edge, is 3 + a corner, or is INSIDE. Edge i runs from corner i to the next one.
    """
    site, best, a = INSIDE, np.inf, (corners[0, 0], corners[0, 1], corners[0, 2])
    n = cross(_run(corners, 0, 1), _run(corners, 0, 2))
    height = dot(n, a) / dot(n, n)
    foot = height * n[0], height * n[1], height * n[2]
    for i in range(3):
        k, edge = (i + 1) % 3, _run(corners, i, (i + 1) % 3)
        start = corners[i, 0], corners[i, 1], corners[i, 2]
        arm = foot[0] - start[0], foot[1] - start[1], foot[2] - start[2]
        if dot(n, cross(edge, arm)) >= 0:
            continue
        share = min(max(-dot(edge, start) / dot(edge, edge), 0.0), 1.0)
        place = start[0] + share * edge[0], start[1] + share * edge[1], start[2] + share * edge[2]
        if share == 1:  # At the node itself, so that the faces there tie exactly.
            place = corners[k, 0], corners[k, 1], corners[k, 2]
        if dot(place, place) < best:
            site, best = (i if 0 < share < 1 else 3 + (i if share == 0 else k)), dot(place, place)
            nearest[0], nearest[1], nearest[2] = place
    if site == INSIDE:
        best = dot(foot, foot)
        nearest[0], nearest[1], nearest[2] = foot
    return site, best


@compile_inline
def _run(corners: FloatArray, i: int, k: int) -> Arm:
    return corners[k, 0] - corners[i, 0], corners[k, 1] - corners[i, 1], corners[k, 2] - corners[i, 2]


@compile_part
def _look_at_face(rooms: Fields, x: FloatArray, face: IntArray, point: Fields) -> tuple[int, float, float]:
    """Write the place (3,) of a face nearest to a point, from there; return where it is, d and D.

    It is on an edge, is n_corners + a corner, or is INSIDE. The point is an origin (3,) and its place from there.
    """
    (nearest, there, corners, middle), (origin, centre), n_corners = rooms, point, len(face)
    site, best, farthest = INSIDE, np.inf, 0.0
    for axis in range(3 if n_corners == 4 else 0):
        middle[axis] = 0.0
        for i in range(4):
            middle[axis] += (x[face[i], axis] - origin[axis]) / 4
    for i in range(n_corners if n_corners == 4 else 1):
        for axis in range(3):
            for k in range(3):
                corners[k, axis] = x[face[(i + k) % n_corners], axis] - origin[axis] - centre[axis]
            if n_corners == 4:
                corners[2, axis] = middle[axis] - centre[axis]
        place, square = _look_at_triangle(there, corners)
        for k in range(2 if n_corners == 4 else 3):
            arm = corners[k, 0], corners[k, 1], corners[k, 2]
            farthest = max(farthest, dot(arm, arm))
        if square < best:
            site, best = place, square
            if n_corners == 4:
                site = i if place == 0 else (4 + (i + place - 3) % 4 if place == 3 or place == 4 else INSIDE)
            for axis in range(3):
                nearest[axis] = there[axis]
    return site, np.sqrt(best), np.sqrt(farthest)


@compile_inline
def _is_near(x: FloatArray, face: IntArray, point: Fields, distance: float) -> bool:
    """Return whether the box around a face may be within a distance of a point."""
    origin, centre = point
    for axis in range(3):
        low, high = np.inf, -np.inf
        for node in face:
            place = x[node, axis] - origin[axis]
            low, high = min(low, place), max(high, place)
        reach = distance + TIED * (distance + max(abs(low), abs(high)))
        if low - centre[axis] > reach or centre[axis] - high > reach:
            return False
    return True


@compile_part
def _find_partner(candidates: Fields, surface: Fields, tree: Tree, point: Fields, near: int) -> tuple[int, int, float]:
    """Return the face nearest to a point, where on it the nearest place is, and how far the foot is past the face.

    A walk from the face `near` to neighbours that are nearer leaves few candidates in a cube around the point.
    """
    members, lengths, places, rooms, axes, cube = candidates
    (x, master, neighbours), (origin, centre) = surface, point
    face, best = near, np.inf
    while face >= 0:
        here, face = face, -1
        best = min(best, _look_at_face(rooms, x, master[here], point)[1])
        for i in range(neighbours.shape[1]):
            other = neighbours[here, i]
            if other >= 0 and _is_near(x, master[other], point, best):
                _, distance, _ = _look_at_face(rooms, x, master[other], point)
                if distance < best:
                    best, face = distance, other
    reach = best * (1 + 2.0**-20)
    for axis in range(3):
        cube[0, axis], cube[1, axis] = centre[axis] - reach, centre[axis] + reach
        for row in range(3):
            axes[row, axis] = 1.0 if row == axis else 0.0
    count = 0
    for i in range(collect_boxes(members, tree, origin, axes, cube)):
        if _is_near(x, master[members[i]], point, best):
            members[count] = members[i]
            places[count], lengths[0, count], lengths[1, count] = _look_at_face(rooms, x, master[members[i]], point)
            best = min(best, lengths[0, count])
            count += 1
    partner, least, nearest = -1, np.inf, rooms[0]
    for i in range(count):
        if lengths[0, i] > best + TIED / 2 * lengths[1, i]:
            continue
        past, slack = 0.0, TIED * lengths[1, i]
        if places[i] != INSIDE:
            _look_at_face(rooms, x, master[members[i]], point)
            set_axes(axes, x, master[members[i]])
            n = cross((nearest[0], nearest[1], nearest[2]), (axes[2, 0], axes[2, 1], axes[2, 2]))
            past = np.sqrt(dot(n, n))
        if past < least - slack or (past <= least + slack and members[i] < members[partner]):
            partner, least = i, past
    return members[partner], places[partner], least


@compile_kernel
def _find_patches(out: Fields, rooms: Fields, x: FloatArray, surfaces: Fields, rules: Fields) -> int:
    """Write what `find_patches` returns, cells as far as there is room for them; return their number."""
    (home, active, cells, corners), (slave, master, neighbours, free, heights, tree) = out, surfaces
    candidates, face, on_master, part, mean, shapes, slopes, slave_axes, axes, question, clips, queue, mark = rooms
    (table, tau), normal = rules, slave_axes[2]
    m, count, n_slave, n_master = 0, 0, slave.shape[1], master.shape[1]
    on_triangles = n_slave == TRIANGLE and n_master == TRIANGLE
    for p in range(len(home)):
        nodes, shares = slave[p // N_PARTS], table[0][p % N_PARTS]
        origin = x[nodes[0]]
        set_axes(slave_axes, x, nodes)
        for i in range(n_slave):
            for axis in range(3):
                face[i, axis] = x[nodes[i], axis] - origin[axis]
        _, centre = place_part(mean, face, table, p % N_PARTS)
        m, site, past = _find_partner(candidates, (x, master, neighbours), tree, (origin, centre), m)
        set_axes(axes, x, master[m])
        n = axes[2, 0], axes[2, 1], axes[2, 2]
        at_border = _is_free(neighbours[m], free, master[m], site)
        if dot((normal[0], normal[1], normal[2]), n) >= 0 or (at_border and past > tau * heights[m]):
            continue
        home[p] = m
        view_face(face, x, nodes, origin, axes, False)
        view_face(on_master, x, master[m], origin, axes, False)
        centre = combine(face, mean)
        set_shapes(shapes, slopes, on_master, centre[0], centre[1])
        active[p] = centre[2] - combine(on_master, shapes)[2] < 0
        set_corners(part, face, shares)
        inside = holds_points(on_master, part, measure_distance(origin))
        if not active[p] or (inside and on_triangles):
            continue
        for axis in range(2):
            question[0, axis], question[1, axis] = part[0, axis], part[0, axis]
            for i in range(1, len(part)):
                question[0, axis] = min(question[0, axis], part[i, axis])
                question[1, axis] = max(question[1, axis], part[i, axis])
        first, n_queued, n_seen = count, 1, 0
        queue[0], mark[m] = m, p
        while n_seen < n_queued:
            j, n_corners = queue[n_seen], 0
            n_seen += 1
            view_face(on_master, x, master[j], origin, axes, False)
            if may_overlap(question, on_master):
                room = corners[min(count, len(cells))]
                n_corners, _ = clip_face(part, on_master, room, clips, measure_distance(origin))
            if n_corners == 0 and j == m:
                break
            if n_corners > 0:
                cells[min(count, len(cells) - 1), 0], cells[min(count, len(cells) - 1), 1] = p, j
                count += 1
                for other in neighbours[j]:
                    if other >= 0 and mark[other] != p:
                        queue[n_queued], mark[other] = other, p
                        n_queued += 1
        if count == first + 1 and (on_triangles or not inside):
            count = first
    return count


def find_nearest_faces(x: FloatArray, n_points: int, surface: Surface, tau: float) -> IntArray:
    """Return the nearest face (n_points,) of a surface to each of the first nodes.

    It is −1 where the nearest place is on the border, and the node past that by more than τ × the height of the face.
    """
    faces, neighbours = surface.faces, surface.neighbours
    surfaces = faces, neighbours, _mark_border(surface, len(x)), surface.heights(x), tree_of_faces(x, faces)
    nearest = np.empty(n_points, np.int64)
    _find_nearest(nearest, _make_candidates(len(faces)), x, surfaces, tau)
    return nearest


@compile_kernel
def _find_nearest(nearest: IntArray, candidates: Fields, x: FloatArray, surfaces: Fields, tau: float) -> None:
    (faces, neighbours, free, heights, tree), centre, m = surfaces, (0.0, 0.0, 0.0), 0
    for node in range(len(nearest)):
        m, site, past = _find_partner(candidates, (x, faces, neighbours), tree, (x[node], centre), m)
        is_past = _is_free(neighbours[m], free, faces[m], site) and past > tau * heights[m]
        nearest[node] = -1 if is_past else m


def _mark_border(surface: Surface, n_nodes: int) -> BoolArray:
    """Return which nodes (n_nodes,) are on the border of a surface."""
    free, at_border = np.zeros(n_nodes, np.bool_), surface.neighbours < 0
    free[surface.faces[at_border]] = free[np.roll(surface.faces, -1, axis=1)[at_border]] = True
    return free


def _make_candidates(n: int) -> Fields:
    """Return what the search of a partner among n faces writes."""
    looks = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty(3)
    return np.empty(n, np.int64), np.empty((2, n)), np.empty(n, np.int64), looks, np.empty((3, 3)), np.empty((2, 3))


@compile_inline
def _is_free(neighbours: IntArray, free: BoolArray, face: IntArray, site: int) -> bool:
    """Return whether a place of a face is on the border of the surface."""
    if site == INSIDE:
        return False
    return bool(neighbours[site] < 0 if site < len(face) else free[face[site - len(face)]])
