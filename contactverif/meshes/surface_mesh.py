"""The triangles and quadrilaterals of a mesh file in space become an `Interface`, each face seen from outside its body.

Rule for the next editor: whatever a mesh from elsewhere may have wrong is said in terms of the options of the command
line.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.faces import TRIANGLE, turns_of
from contactverif.contract.interface import ONE_SIDED, Interface, Surface
from contactverif.meshes.mesh_groups import Group, kinds_in, unknown_group_error
from contactverif.meshes.plain_mesh import PlainMesh

FLAT = 1e-9  # A mesh is plane if z varies by at most this share of its size: nine digits or more are exact enough.
_CORNERS = {"triangle": 3, "quad": 4}  # Numbers of corners.


def is_in_space(mesh: PlainMesh, groups: dict[str, Group], name: str) -> bool:
    """Return whether a mesh lies in no plane of constant z, and a group of it has faces and no lines."""
    if mesh.points.shape[1] == 2 or name not in groups:
        return False
    dims = {block.dim for block, members in zip(mesh.cells, groups[name], strict=True) if members.any()}
    if 2 not in dims or 1 in dims:
        return False
    used = np.unique(np.concatenate([block.data.reshape(-1) for block in mesh.cells]))
    extent = np.ptp(mesh.points[used], axis=0)
    return bool(extent[2] > FLAT * extent.max())


def surfaces_of(mesh: PlainMesh, groups: dict[str, Group], names: tuple[str, str], *, flip: bool) -> Interface:
    """Return the interface of the faces of two groups, slave first.

    Volume cells beside faces show on which side the body lies. Faces that hang together without any run as the first of
    them in the file. `flip` turns those, or all if every face has a volume cell.
    """
    arguments = "--slave", "--master"
    sides = [_faces(mesh, groups, argument, name) for argument, name in zip(arguments, names, strict=True)]
    shared = np.intersect1d(sides[0], sides[1])
    if len(shared):
        actual = f"a node of the slave surface too, at {_place(mesh.points, shared[0])}"
        raise MisuseError("--master", actual, "surfaces without a common node: two nodes where the bodies touch")
    if not np.isfinite(mesh.points[np.unique(np.concatenate([side.reshape(-1) for side in sides]))]).all():
        raise MisuseError("--mesh", "NaN or infinity among its coordinates", "finite coordinates")
    oriented = [_orient(argument, mesh, faces) for argument, faces in zip(arguments, sides, strict=True)]
    every = all(by_cells.all() for _, by_cells in oriented)
    faces = [np.where((flip & (every | ~by_cells))[:, None], side[:, ::-1], side) for side, by_cells in oriented]
    interface = _renumber(mesh.points, faces)
    _check_facing(interface)
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


def _orient(argument: str, mesh: PlainMesh, faces: IntArray) -> tuple[IntArray, BoolArray]:
    """Turn faces (n_faces, n_corners) so that all are seen from outside the body.

    The second array (n_faces,) says of which a volume cell shows the body.
    """
    neighbours = _neighbours(argument, mesh.points, faces)
    outward = _outward(argument, mesh, faces)
    turned, by_cells = np.zeros(len(faces), dtype=bool), np.zeros(len(faces), dtype=bool)
    visited = np.zeros(len(faces), dtype=bool)
    for first in range(len(faces)):
        if visited[first]:
            continue
        visited[first], queue, patch = True, deque([first]), [first]
        while queue:
            face = queue.popleft()
            for other, same_way in neighbours[face]:
                if not visited[other]:
                    visited[other], turned[other] = True, turned[face] ^ same_way
                    queue.append(other)
                    patch.append(other)
                elif turned[other] != turned[face] ^ same_way:
                    place = _place(mesh.points, faces[other, 0])
                    raise MisuseError(argument, f"a surface with one side, at {place}", "the surface of a body")
        signs = outward[patch] * np.where(turned[patch], -1, 1)
        if signs.min() < 0 < signs.max():
            place = _place(mesh.points, faces[np.array(patch)[signs < 0][0], 0])
            raise MisuseError(
                argument, f"a surface that changes the side of its body, at {place}", "one body on one side"
            )
        turned[patch] ^= bool(signs.min() < 0)
        by_cells[patch] = bool(signs.any())
    return np.where(turned[:, None], faces[:, ::-1], faces), by_cells


def _neighbours(argument: str, points: FloatArray, faces: IntArray) -> list[list[tuple[int, bool]]]:
    """Return for each face its neighbours, and whether both run the same way along their edge: one is turned then."""
    owners: dict[tuple[int, int], list[tuple[int, bool]]] = {}
    for face, corners in enumerate(faces.tolist()):
        for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
            owners.setdefault((min(start, end), max(start, end)), []).append((face, start < end))
    neighbours: list[list[tuple[int, bool]]] = [[] for _ in faces]
    for edge, those in owners.items():
        if len(those) > 2:
            place = _place(points, edge[0])
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
            place = _place(mesh.points, corners[0])
            raise MisuseError(
                argument, f"a face with cells on both sides, at {place}", "faces on the boundary of a body"
            )
        for number, cell in beside:
            places = mesh.points[corners]
            way = mesh.points[mesh.cells[number].data[cell]].mean(axis=0) - places.mean(axis=0)
            signs[face] = -int(np.sign(turns_of(places[None]).sum(axis=1)[0] @ way))
    return signs


def _renumber(points: FloatArray, sides: list[IntArray]) -> Interface:
    """Return the interface on nodes of its own, slave nodes first; errors name the options of the command line."""
    used = [np.unique(side) for side in sides]
    argument = "--slave"
    try:
        slave = Surface(np.searchsorted(used[0], sides[0]))
        argument = "--master"
        master = Surface(np.searchsorted(used[1], sides[1]) + len(used[0]))
        return Interface(points[np.concatenate(used)], slave, master)
    except MisuseError as error:
        option = f"--{error.argument}" if error.argument in ("slave", "master") else argument
        raise MisuseError(option, error.found, error.needed) from error


def _check_facing(interface: Interface) -> None:
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


def _place(points: FloatArray, node: int) -> str:
    """Return the position of a node in words."""
    return f"({', '.join(f'{part:g}' for part in points[node])})"
