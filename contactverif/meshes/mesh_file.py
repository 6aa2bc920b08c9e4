"""A user's own mesh file becomes an `Interface`: the lines of two named groups, each with its body on the left.

In space it is the triangles or quadrilaterals of two groups, each seen from outside its body. Whatever a mesh from
elsewhere may have wrong is found here, before an `Interface` sees it, and is said in terms of the options of the
command line.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import ONE_SIDED, TRIANGLE, Interface, Surface, turns_of
from contactverif.meshes.plain_mesh import Group, PlainMesh, groups_of, kinds_in, read_mesh, unknown_group_error

FLAT = 1e-9  # A mesh is plane if z varies by at most this share of its size: nine digits or more are exact enough.
_CORNERS = {"triangle": 3, "quad": 4}  # Numbers of corners.


def read_interface(path: str | Path, *, slave: str, master: str, flip: bool = False) -> Interface:
    """Read the interface between two groups of 2-node lines, or of faces in space, from a mesh file.

    The 2-D cells beside the lines show on which side the body lies. A chain without cells beside it runs as its first
    line in the file. In space the groups have triangles or quadrilaterals, and volume cells show the side.

    Parameters
    ----------
    path : str | Path
        A file that meshio reads.
    slave, master : str
        The name or the number of a group each.
    flip : bool
        True reverses the chains, or the faces, without cells beside them, or all if every one has cells.

    Returns
    -------
    Interface
        The two surfaces on nodes of their own, slave nodes first.

    Raises
    ------
    MisuseError
        If the file, a group, its lines or faces, or the way in which both surfaces face each other cannot be used.

    Examples
    --------
    ::

        interface = read_interface("punch.msh", slave="punch", master="base")
    """
    mesh, groups, in_space = _read_groups(path, slave, master)
    if in_space:
        interface = _surfaces_of(mesh, groups, (slave, master), flip=flip)
    else:
        sides = _sides_of(mesh, groups, slave=slave, master=master, flip=flip)
        interface = _renumber(sides.points, sides.slave, sides.master)
        check_facing(interface)
    sys.stderr.write(mesh.warnings)
    return interface


def _read_groups(path: str | Path, slave: str, master: str) -> tuple[PlainMesh, dict[str, Group], bool]:
    """Return a mesh, its groups, and whether that of the slave or of the master consists of faces in space."""
    if slave == master:
        raise MisuseError("--master", f"{master!r}, which is the slave too", "another group than --slave")
    mesh = read_mesh(path)
    groups = groups_of(mesh)
    return mesh, groups, any(_is_in_space(mesh, groups, name) for name in (slave, master))


@dataclass(frozen=True, slots=True, eq=False)
class MeshSides:
    """A mesh with the lines of slave and master, each line with its body on the left."""

    mesh: PlainMesh
    points: FloatArray  # (n_points, 2) Positions.
    groups: dict[str, Group]
    slave: IntArray  # (n_lines, 2) Numbers of points, as in `master`.
    master: IntArray


def read_sides(path: str | Path, *, slave: str, master: str, flip: bool) -> MeshSides:
    """Read the lines of two groups, oriented; the arguments and errors are those of `read_interface`."""
    mesh, groups, in_space = _read_groups(path, slave, master)
    if in_space:
        raise MisuseError("--mesh", "faces in space", "lines in a plane: bodies in space are not solved")
    return _sides_of(mesh, groups, slave=slave, master=master, flip=flip)


def _sides_of(mesh: PlainMesh, groups: dict[str, Group], *, slave: str, master: str, flip: bool) -> MeshSides:
    """Return the lines of two groups, oriented."""
    points = _planar(mesh)
    named = [
        (argument, _lines(mesh, groups, argument, name))
        for argument, name in (("--slave", slave), ("--master", master))
    ]
    shared = np.intersect1d(named[0][1], named[1][1])
    if len(shared):
        actual = f"a node of the slave surface too, at {describe_place(points, shared[0])}"
        raise MisuseError("--master", actual, "surfaces without a common node")
    inside = _directed_edges(mesh, points)
    oriented = [_orient_lines(argument, lines, inside, points) for argument, lines in named]
    return MeshSides(mesh, points, groups, *_flip(oriented, flip=flip))


def _flip(oriented: list[tuple[IntArray, BoolArray]], *, flip: bool) -> list[IntArray]:
    """Return the corners of both sides; `flip` turns what has no cells beside it, or all if everything has some."""
    every = all(by_cells.all() for _, by_cells in oriented)
    return [np.where((flip & (every | ~by_cells))[:, None], side[:, ::-1], side) for side, by_cells in oriented]


def check_facing(interface: Interface) -> None:
    """Refuse two surfaces whose mean normals, weighted by length, do not oppose each other."""
    slave, master = (_mean_normal(surface, interface.nodes) for surface in (interface.slave, interface.master))
    # The normals of a closed chain sum to zero whichever way it runs, so a surface without an open chain shows nothing.
    if slave is None or master is None or slave @ master < 0:
        return
    raise MisuseError(
        "--mesh",
        f"mean normals ({slave[0]:.3g}, {slave[1]:.3g}) of the slave and ({master[0]:.3g}, {master[1]:.3g}) of the "
        "master, which do not oppose each other",
        "surfaces that face each other, each with its body on the left of its lines. Keep the 2-D cells in the file, "
        "they tell the side; or turn the lines of one group in the mesher (Gmsh: a minus sign before its curves); or "
        "give --flip where only one surface has cells beside it (it turns the lines without cells, and both surfaces "
        "where neither or each has cells)",
    )


def _mean_normal(surface: Surface, nodes: FloatArray) -> FloatArray | None:
    """Return the mean normal (2,) out of the body, weighted by length; None if all chains are closed."""
    starts = surface.segments[surface.neighbours[:, 0] < 0, 0]
    ends = surface.segments[surface.neighbours[:, 1] < 0, 1]
    if not len(starts):
        return None
    along = nodes[ends].sum(axis=0) - nodes[starts].sum(axis=0)  # The sum over all segments telescopes.
    normal: FloatArray = np.array([along[1], -along[0]]) / surface.lengths(nodes).sum()
    return normal


def _planar(mesh: PlainMesh) -> FloatArray:
    """Return the positions (n_points, 2) of a mesh in a plane of constant z."""
    points = mesh.points
    numbers = [block.data.reshape(-1) for block in mesh.cells if block.dim > 0]
    # Points without cells may lie outside the plane.
    used = points[np.unique(np.concatenate(numbers))] if numbers else points[:0]
    if not np.isfinite(used).all():
        raise MisuseError("--mesh", "NaN or infinity among its coordinates", "finite coordinates")
    if len(used) and points.shape[1] == 3:
        extent = np.ptp(used, axis=0)
        if extent[2] > FLAT * extent.max():
            actual = f"z from {used[:, 2].min():g} to {used[:, 2].max():g}"
            raise MisuseError("--mesh", actual, "a mesh in a plane of constant z")
    return points[:, :2]


def _lines(mesh: PlainMesh, groups: dict[str, Group], argument: str, name: str) -> IntArray:
    """Return the nodes (n_lines, 2) of the lines of a group, in the order of the file."""
    if name not in groups:
        raise unknown_group_error(mesh, groups, argument, name)
    group = groups[name]
    kinds = kinds_in(mesh, group)
    higher = [kind for kind in kinds if kind != "line" and kind.startswith(("line", "VTK_LAGRANGE_CURVE"))]
    if higher:
        actual = f"{name!r} with elements {', '.join(higher)}"
        raise MisuseError(argument, actual, "2-node lines (mesh at first order)")
    parts = [np.empty((0, 2), dtype=np.int64)]
    for block, members in zip(mesh.cells, group, strict=True):
        if block.type == "line":
            ends = block.data
            parts.append(np.where(members[:, None] < 0, ends[:, ::-1], ends)[members != 0])
    lines = np.concatenate(parts)
    if not len(lines):
        actual = f"{name!r} with elements {', '.join(kinds) or 'none'}, no lines"
        needed = "a group of 2-node lines (by its number, where a group of cells has the same name)"
        raise MisuseError(argument, actual, needed)
    return lines


def corners_of_cells(mesh: PlainMesh) -> list[IntArray]:
    """Return the corners (n_cells, n_corners) of the cells of each block of 2-D cells, in the order of the file."""
    blocks = [block for block in mesh.cells if block.dim == 2]
    # Corners come first, nodes on edges last.
    return [
        block.data[:, : 3 if "triangle" in block.type.lower() else 4 if "quad" in block.type.lower() else None]
        for block in blocks
    ]


def _directed_edges(mesh: PlainMesh, points: FloatArray) -> IntArray:
    """Return the edges of the 2-D cells, each as first node × n_points + second node, its cell on the left."""
    edges = [np.empty(0, dtype=np.int64)]
    for corners in corners_of_cells(mesh):
        x, y = np.moveaxis(points[corners] - points[corners[:, :1]], -1, 0)  # (n_cells, n_corners) each
        twice_area = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
        corners = np.where(twice_area[:, None] < 0, corners[:, ::-1], corners)[twice_area != 0]
        edges.append((corners * len(points) + np.roll(corners, -1, axis=1)).reshape(-1))
    return np.unique(np.concatenate(edges))


def _orient_lines(argument: str, lines: IntArray, inside: IntArray, points: FloatArray) -> tuple[IntArray, BoolArray]:
    """Reverse lines (n_lines, 2) so that each chain runs one way with its body on the left.

    The cells inside show the side, by their directed edges. The second array (n_lines,) says for which lines they do.
    """
    neighbours = _neighbours_of_lines(argument, lines, points)
    left, right = (np.isin(ends[:, 0] * len(points) + ends[:, 1], inside) for ends in (lines, lines[:, ::-1]))
    if (left & right).any():
        actual = f"a line with cells on both sides, at {describe_place(points, lines[left & right][0, 0])}"
        raise MisuseError(argument, actual, "lines on the boundary of a body")
    signs = left.astype(np.int64) - right
    return _run_one_way(argument, points, lines, neighbours, signs, ("a chain", "a body on one side of a chain"))


def _run_one_way(
    argument: str,
    points: FloatArray,
    elements: IntArray,
    neighbours: list[list[tuple[int, bool]]],
    signs: IntArray,
    words: tuple[str, str],
) -> tuple[IntArray, BoolArray]:
    """Turn lines or faces (n, n_corners) as those that they hang together with, and so that the body is behind them.

    `neighbours` says of which of them one of a pair is to be turned. `signs` (n,) are 1 where a cell shows that the
    body is behind, −1 where it is in front, 0 without a cell. The second array (n,) says for which a cell does.
    """
    turned, by_cells, visited = np.zeros((3, len(elements)), dtype=bool)
    for first in range(len(elements)):
        if visited[first]:
            continue
        visited[first], patch = True, [first]
        for element in patch:  # The list grows while it is read.
            for other, is_opposite in neighbours[element]:
                if not visited[other]:
                    visited[other], turned[other] = True, turned[element] ^ is_opposite
                    patch.append(other)
                elif turned[other] != turned[element] ^ is_opposite:
                    place = describe_place(points, elements[other, 0])
                    raise MisuseError(argument, f"a surface with one side, at {place}", "the surface of a body")
        sides = signs[patch] * np.where(turned[patch], -1, 1)
        if sides.min() < 0 < sides.max():
            place = describe_place(points, elements[np.array(patch)[sides < 0][0], 0])
            raise MisuseError(argument, f"{words[0]} that changes the side of its body, at {place}", words[1])
        turned[patch] ^= bool(sides.min() < 0)
        by_cells[patch] = bool(sides.any())
    return np.where(turned[:, None], elements[:, ::-1], elements), by_cells


def _neighbours_of_lines(argument: str, lines: IntArray, points: FloatArray) -> list[list[tuple[int, bool]]]:
    """Return for each line its neighbours, and whether both begin or both end in their node; lines form chains."""
    touching: dict[int, list[int]] = {}
    for index, line in enumerate(lines.tolist()):
        for node in line:
            touching.setdefault(node, []).append(index)
    for node, several in touching.items():
        if len(several) > 2:
            actual = f"{len(several)} lines that meet at {describe_place(points, node)}"
            raise MisuseError(argument, actual, "chains: at most two lines at a node")
    if len(np.unique(np.sort(lines, axis=1), axis=0)) < len(lines):
        raise MisuseError(argument, "the same line twice", "each line once")
    return [
        [
            (other, bool(lines[other, end] == node))
            for end, node in enumerate(line)
            for other in touching[node]
            if other != index
        ]
        for index, line in enumerate(lines.tolist())
    ]


def _renumber(points: FloatArray, slave: IntArray, master: IntArray) -> Interface:
    """Return the interface on nodes of its own, slave nodes first; errors name the options of the command line."""
    used = [np.unique(side) for side in (slave, master)]
    argument = "--slave"
    try:
        first = Surface(np.searchsorted(used[0], slave))
        argument = "--master"
        second = Surface(np.searchsorted(used[1], master) + len(used[0]))
        return Interface(points[np.concatenate(used)], first, second)
    except MisuseError as error:
        option = f"--{error.argument}" if error.argument in ("slave", "master") else argument
        raise MisuseError(option, error.found, error.needed) from error


def describe_place(points: FloatArray, node: int) -> str:
    """Return the position of a node in words."""
    return f"({', '.join(f'{part:g}' for part in points[node])})"


def _is_in_space(mesh: PlainMesh, groups: dict[str, Group], name: str) -> bool:
    """Return whether a mesh lies in no plane of constant z, and a group of it has faces and no lines."""
    if mesh.points.shape[1] == 2 or name not in groups:
        return False
    dims = {block.dim for block, members in zip(mesh.cells, groups[name], strict=True) if members.any()}
    if 2 not in dims or 1 in dims:
        return False
    used = np.unique(np.concatenate([block.data.reshape(-1) for block in mesh.cells]))
    extent = np.ptp(mesh.points[used], axis=0)
    return bool(extent[2] > FLAT * extent.max())


def _surfaces_of(mesh: PlainMesh, groups: dict[str, Group], names: tuple[str, str], *, flip: bool) -> Interface:
    """Return the interface of the faces of two groups, slave first, each face seen from outside its body.

    Volume cells beside faces show on which side the body lies. Faces that hang together without any run as the first of
    them in the file.
    """
    arguments = "--slave", "--master"
    sides = [_faces(mesh, groups, argument, name) for argument, name in zip(arguments, names, strict=True)]
    shared = np.intersect1d(sides[0], sides[1])
    if len(shared):
        actual = f"a node of the slave surface too, at {describe_place(mesh.points, shared[0])}"
        raise MisuseError("--master", actual, "surfaces without a common node: two nodes where the bodies touch")
    if not np.isfinite(mesh.points[np.unique(np.concatenate([side.reshape(-1) for side in sides]))]).all():
        raise MisuseError("--mesh", "NaN or infinity among its coordinates", "finite coordinates")
    oriented = []
    for argument, faces in zip(arguments, sides, strict=True):
        neighbours, signs = _neighbours_of_faces(argument, mesh.points, faces), _outward(argument, mesh, faces)
        words = "a surface", "one body on one side"
        oriented.append(_run_one_way(argument, mesh.points, faces, neighbours, signs, words))
    interface = _renumber(mesh.points, *_flip(oriented, flip=flip))
    _check_facing_in_space(interface)
    return interface


def _faces(mesh: PlainMesh, groups: dict[str, Group], argument: str, name: str) -> IntArray:
    """Return the corners (n_faces, 3 or 4) of the faces of a group, in the order of the file."""
    if name not in groups:
        raise unknown_group_error(mesh, groups, argument, name)
    group = groups[name]
    kinds = kinds_in(mesh, group)
    if len(kinds) != 1 or kinds[0] not in _CORNERS:
        needed = "triangles alone or quadrilaterals alone, at first order (Gmsh: recombine a whole surface, or none)"
        raise MisuseError(argument, f"{name!r} with elements {', '.join(kinds) or 'none'}", needed)
    parts = [
        np.where(members[:, None] < 0, block.data[:, ::-1], block.data)[members != 0]
        for block, members in zip(mesh.cells, group, strict=True)
        if block.type == kinds[0]
    ]
    faces: IntArray = np.concatenate(parts)
    if len(np.unique(np.sort(faces, axis=1), axis=0)) < len(faces):
        raise MisuseError(argument, "the same face twice", "each face once")
    return faces


def _neighbours_of_faces(argument: str, points: FloatArray, faces: IntArray) -> list[list[tuple[int, bool]]]:
    """Return for each face its neighbours, and whether both run the same way along their edge: one is turned then."""
    owners: dict[tuple[int, int], list[tuple[int, bool]]] = {}
    for face, corners in enumerate(faces.tolist()):
        for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
            owners.setdefault((min(start, end), max(start, end)), []).append((face, start < end))
    neighbours: list[list[tuple[int, bool]]] = [[] for _ in faces]
    for edge, those in owners.items():
        if len(those) > 2:
            place = describe_place(points, edge[0])
            raise MisuseError(argument, f"{len(those)} faces on one edge, at {place}", "at most two faces on an edge")
        if len(those) == 2:
            (first, way), (second, other_way) = those
            neighbours[first].append((second, way == other_way))
            neighbours[second].append((first, way == other_way))
    return neighbours


def _outward(argument: str, mesh: PlainMesh, faces: IntArray) -> IntArray:
    """Return 1 for each face that is seen from outside of the volume cell beside it, −1 from inside, 0 without any."""
    at_node: dict[int, set[tuple[int, int]]] = {}
    for number, block in enumerate(mesh.cells):
        if block.dim == 3:
            touching = np.isin(block.data, faces)
            for cell, place in zip(*np.nonzero(touching & (touching.sum(axis=1) >= TRIANGLE)[:, None]), strict=True):
                at_node.setdefault(int(block.data[cell, place]), set()).add((number, int(cell)))
    signs = np.zeros(len(faces), dtype=np.int64)
    for face, corners in enumerate(faces.tolist()):
        beside = set.intersection(*(at_node.get(node, set()) for node in corners))
        if len(beside) > 1:
            place = describe_place(mesh.points, corners[0])
            raise MisuseError(
                argument, f"a face with cells on both sides, at {place}", "faces on the boundary of a body"
            )
        for number, cell in beside:
            places = mesh.points[corners]
            way = mesh.points[mesh.cells[number].data[cell]].mean(axis=0) - places.mean(axis=0)
            signs[face] = -int(np.sign(turns_of(places[None]).sum(axis=1)[0] @ way))
    return signs


def _check_facing_in_space(interface: Interface) -> None:
    """Refuse two surfaces whose mean normals, weighted by area, do not oppose each other; a closed one has none."""
    normals = []
    for surface in (interface.slave, interface.master):
        turns = turns_of(interface.nodes[surface.faces]).sum(axis=1)
        normals.append(turns.sum(axis=0) / np.linalg.norm(turns, axis=1).sum())
    slave, master = normals
    if slave @ master < 0 or min(np.linalg.norm(normals, axis=1)) < ONE_SIDED:
        return
    words = [f"({', '.join(f'{part:.3g}' for part in normal)})" for normal in normals]
    raise MisuseError(
        "--mesh",
        f"mean normals {words[0]} of the slave and {words[1]} of the master, which do not oppose each other",
        "surfaces that face each other, each seen from outside its body. Keep the volume cells in the file, they tell "
        "the side; or give --flip where only one surface has cells beside it (it turns the faces without cells, and "
        "both surfaces where neither or each has cells)",
    )
