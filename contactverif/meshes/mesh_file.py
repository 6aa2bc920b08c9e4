"""A user's own mesh file becomes an `Interface`: the lines of two named groups, each with its body on the left.

In space it is the triangles or quadrilaterals of two groups, each seen from outside its body. Whatever a mesh from
elsewhere may have wrong is found here, before an `Interface` sees it, and is said in terms of the options of the
command line.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import ONE_SIDED, SEGMENT, TRIANGLE, Interface, Surface, turns_of
from contactverif.meshes.plain_mesh import Group, PlainMesh, groups_of, kinds_in, read_mesh, unknown_group_error

FLAT = 1e-9  # A mesh is plane if z varies by at most this share of its size: nine digits or more are exact enough.


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
    sides = read_sides(path, slave=slave, master=master, flip=flip, plane_only=False)
    used = [np.unique(side) for side in (sides.slave, sides.master)]
    argument = "--slave"
    try:
        first = Surface(np.searchsorted(used[0], sides.slave))
        argument = "--master"
        second = Surface(np.searchsorted(used[1], sides.master) + len(used[0]))
        interface = Interface(sides.points[np.concatenate(used)], first, second)
    except MisuseError as error:
        option = f"--{error.argument}" if error.argument in ("slave", "master") else argument
        raise MisuseError(option, error.found, error.needed) from error
    check_facing(interface)
    sys.stderr.write(sides.mesh.warnings)
    return interface


@dataclass(frozen=True, slots=True, eq=False)
class MeshSides:
    """A mesh with the lines of slave and master, each line with its body on the left; in space with their faces."""

    mesh: PlainMesh
    points: FloatArray  # (n_points, 2) Positions; in space (n_points, 3).
    groups: dict[str, Group]
    slave: IntArray  # (n_lines, 2) Numbers of points, as in `master`; in space (n_faces, 3 or 4).
    master: IntArray


def read_sides(path: str | Path, *, slave: str, master: str, flip: bool, plane_only: bool = True) -> MeshSides:
    """Read the lines or faces of two groups, oriented; arguments and errors are those of `read_interface`."""
    if slave == master:
        raise MisuseError("--master", f"{master!r}, which is the slave too", "another group than --slave")
    mesh = read_mesh(path)
    groups = groups_of(mesh)
    in_space = any(_is_in_space(mesh, groups, name) for name in (slave, master))
    if in_space and plane_only:
        raise MisuseError("--mesh", "faces in space", "lines in a plane: bodies in space are not solved")
    points = mesh.points if in_space else _planar(mesh)
    names = {"--slave": slave, "--master": master}
    sides = {option: _members(mesh, groups, option, name, in_space=in_space) for option, name in names.items()}
    shared = np.intersect1d(sides["--slave"], sides["--master"])
    if len(shared):
        actual = f"a node of the slave surface too, at {describe_place(points, shared[0])}"
        two_nodes = ": two nodes where the bodies touch" if in_space else ""
        raise MisuseError("--master", actual, f"surfaces without a common node{two_nodes}")
    if not np.isfinite(points[np.unique(np.concatenate([side.reshape(-1) for side in sides.values()]))]).all():
        raise MisuseError("--mesh", "NaN or infinity among its coordinates", "finite coordinates")
    inside = None if in_space else _directed_edges(mesh, points)
    oriented = []
    for argument, side in sides.items():
        neighbours = _neighbours(argument, points, side)
        signs = _outward(argument, mesh, side) if inside is None else _leftward(argument, side, inside, points)
        oriented.append(_run_one_way(argument, points, side, neighbours, signs))
    # `flip` turns what has no cells beside it, or all if everything has some.
    every = all(by_cells.all() for _, by_cells in oriented)
    turned = [np.where((flip & (every | ~by_cells))[:, None], side[:, ::-1], side) for side, by_cells in oriented]
    return MeshSides(mesh, points, groups, *turned)


def check_facing(interface: Interface) -> None:
    """Refuse two surfaces whose mean normals, weighted by length or area, do not oppose each other."""
    slave, master = (_mean_normal(surface, interface.nodes) for surface in (interface.slave, interface.master))
    if slave is None or master is None or slave @ master < 0:
        return
    words = [f"({', '.join(f'{part:.3g}' for part in normal)})" for normal in (slave, master)]
    if interface.dim == 2:
        side, cells, elements = "with its body on the left of its lines", "2-D", "lines"
        turn = "; or turn the lines of one group in the mesher (Gmsh: a minus sign before its curves)"
    else:
        side, cells, elements, turn = "seen from outside its body", "volume", "faces", ""
    needed = (
        f"surfaces that face each other, each {side}. Keep the {cells} cells in the file, they tell the side{turn}; or "
        f"give --flip where only one surface has cells beside it (it turns the {elements} without cells, and both "
        "surfaces where neither or each has cells)"
    )
    actual = f"mean normals {words[0]} of the slave and {words[1]} of the master, which do not oppose each other"
    raise MisuseError("--mesh", actual, needed)


def _mean_normal(surface: Surface, nodes: FloatArray) -> FloatArray | None:
    """Return the mean normal (dim,) out of the body; None where the surface is closed, or nearly so in space."""
    if nodes.shape[1] == 3:
        turns = turns_of(nodes[surface.faces]).sum(axis=1)
        mean: FloatArray = turns.sum(axis=0) / np.linalg.norm(turns, axis=1).sum()
        return mean if np.linalg.norm(mean) >= ONE_SIDED else None
    # The normals of a closed chain sum to zero whichever way it runs. The sum over an open one telescopes.
    starts = surface.segments[surface.neighbours[:, 0] < 0, 0]
    ends = surface.segments[surface.neighbours[:, 1] < 0, 1]
    if not len(starts):
        return None
    along = nodes[ends].sum(axis=0) - nodes[starts].sum(axis=0)
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


def _members(mesh: PlainMesh, groups: dict[str, Group], argument: str, name: str, *, in_space: bool) -> IntArray:
    """Return the nodes of the lines of a group, in space of its faces (n, n_corners), in the order of the file."""
    if name not in groups:
        raise unknown_group_error(mesh, groups, argument, name)
    kinds = kinds_in(mesh, groups[name])
    kind = next((kind for kind in kinds if kind in (("triangle", "quad") if in_space else ("line",))), "")
    parts = [
        np.where(members[:, None] < 0, block.data[:, ::-1], block.data)[members != 0]
        for block, members in zip(mesh.cells, groups[name], strict=True)
        if block.type == kind
    ]
    elements = np.concatenate(parts) if parts else np.empty((0, 2), dtype=np.int64)
    listed = f"{name!r} with elements {', '.join(kinds) or 'none'}"
    if in_space:
        if len(kinds) != 1 or not len(elements):
            needed = (
                "triangles alone or quadrilaterals alone, at first order (Gmsh: recombine a whole surface, or none)"
            )
            raise MisuseError(argument, listed, needed)
        if len(np.unique(np.sort(elements, axis=1), axis=0)) < len(elements):
            raise MisuseError(argument, "the same face twice", "each face once")
        return elements
    if higher := [kind for kind in kinds if kind != "line" and kind.startswith(("line", "VTK_LAGRANGE_CURVE"))]:
        actual = f"{name!r} with elements {', '.join(higher)}"
        raise MisuseError(argument, actual, "2-node lines (mesh at first order)")
    if not len(elements):
        needed = "a group of 2-node lines (by its number, where a group of cells has the same name)"
        raise MisuseError(argument, f"{listed}, no lines", needed)
    return elements


def corners_of_cells(mesh: PlainMesh) -> list[IntArray]:
    """Return the corners (n_cells, n_corners) of the cells of each block of 2-D cells, in the order of the file."""
    counts = [(block, block.type.lower()) for block in mesh.cells if block.dim == 2]
    # Corners come first, nodes on edges last.
    return [block.data[:, : 3 if "triangle" in kind else 4 if "quad" in kind else None] for block, kind in counts]


def _directed_edges(mesh: PlainMesh, points: FloatArray) -> IntArray:
    """Return the edges of the 2-D cells, each as first node × n_points + second node, its cell on the left."""
    edges = [np.empty(0, dtype=np.int64)]
    for corners in corners_of_cells(mesh):
        x, y = np.moveaxis(points[corners] - points[corners[:, :1]], -1, 0)  # (n_cells, n_corners) each
        twice_area = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
        corners = np.where(twice_area[:, None] < 0, corners[:, ::-1], corners)[twice_area != 0]
        edges.append((corners * len(points) + np.roll(corners, -1, axis=1)).reshape(-1))
    return np.unique(np.concatenate(edges))


def _leftward(argument: str, lines: IntArray, inside: IntArray, points: FloatArray) -> IntArray:
    """Return 1 for each line with a cell on its left, by the directed edges of cells; −1 on its right, 0 without."""
    left, right = (np.isin(ends[:, 0] * len(points) + ends[:, 1], inside) for ends in (lines, lines[:, ::-1]))
    if (left & right).any():
        actual = f"a line with cells on both sides, at {describe_place(points, lines[left & right][0, 0])}"
        raise MisuseError(argument, actual, "lines on the boundary of a body")
    return left.astype(np.int64) - right


def _run_one_way(
    argument: str,
    points: FloatArray,
    elements: IntArray,
    neighbours: list[list[tuple[int, bool]]],
    signs: IntArray,
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
            kind, needed = "surface", "one body on one side"
            if elements.shape[1] == SEGMENT:
                kind, needed = "chain", "a body on one side of a chain"
            raise MisuseError(argument, f"a {kind} that changes the side of its body, at {place}", needed)
        turned[patch] ^= bool(sides.min() < 0)
        by_cells[patch] = bool(sides.any())
    return np.where(turned[:, None], elements[:, ::-1], elements), by_cells


def _neighbours(argument: str, points: FloatArray, elements: IntArray) -> list[list[tuple[int, bool]]]:
    """Return for each line or face its neighbours, and whether one of both is to be turned.

    That is so if both lines begin or both end in their node, or both faces run the same way along their edge.
    """
    of_lines = elements.shape[1] == SEGMENT
    owners: dict[tuple[int, ...], list[tuple[int, bool]]] = {}
    for number, corners in enumerate(elements.tolist()):
        for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
            shared = (start,) if of_lines else (min(start, end), max(start, end))
            owners.setdefault(shared, []).append((number, start == corners[0] if of_lines else start < end))
    most = "chains: at most two lines at a node" if of_lines else "at most two faces on an edge"
    neighbours: list[list[tuple[int, bool]]] = [[] for _ in elements]
    for (node, *_), those in owners.items():
        if len(those) > 2:
            words = "lines that meet" if of_lines else "faces on one edge,"
            raise MisuseError(argument, f"{len(those)} {words} at {describe_place(points, node)}", most)
        if len({number for number, _ in those}) == 2:
            (first, way), (second, other_way) = those
            neighbours[first].append((second, way == other_way))
            neighbours[second].append((first, way == other_way))
    if of_lines and len(np.unique(np.sort(elements, axis=1), axis=0)) < len(elements):
        raise MisuseError(argument, "the same line twice", "each line once")
    return neighbours


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
