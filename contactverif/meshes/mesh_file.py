"""A user's own mesh file becomes an `Interface`: the lines of two named groups, each with its body on the left.

In space it is the triangles or quadrilaterals of two groups, each seen from outside its body. Whatever a mesh from
elsewhere may have wrong is found here, before an `Interface` sees it, and is said in terms of the options of the
command line.
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import SEGMENT, Interface, Surface
from contactverif.meshes.cell_sides import CellSides, back_to_back, check_facing, describe, label_bodies, mean_direction
from contactverif.meshes.plain_mesh import CORNERS, PlainMesh, find_group, read_mesh

Flip = Literal["slave", "master", "both"]
FLAT = 1e-9  # A mesh is plane if z varies by at most this share of its size: nine digits or more are exact enough.
_FACE_KINDS = ("triangle", "quad")


def read_interface(
    path: str | Path | None,
    *,
    slave: str | None = None,
    master: str | None = None,
    pair: int = 0,
    flip: Flip | None = None,
) -> Interface:
    """Read the interface between two groups of 2-node lines, or of faces in space, from a mesh file.

    The 2-D cells beside the lines show on which side the body lies. A chain without cells beside it runs as its first
    line in the file. In space the groups have triangles or quadrilaterals, and volume cells show the side. What the
    reader has to say goes to standard error.

    Parameters
    ----------
    path : str | Path | None
        A deck of Abaqus or CalculiX, a file of Exodus, or one that meshlane reads. None if `slave` and `master` are
        two files, of a surface each.
    slave, master : str | None
        The name or the number of a group each. A set of nodes stands for all boundary between its nodes. None for those
        of a contact pair of the file.
    pair : int
        The number of the contact pair, counted from 1; 0 for the only one.
    flip : {"slave", "master", "both"} | None
        The side whose chains, or faces, are reversed, if no cells are beside them.

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
    sides = read_sides(path, slave=slave, master=master, pair=pair, flip=flip)
    sys.stderr.write(sides.words)
    return sides.interface


@dataclass(frozen=True, slots=True, eq=False)
class MeshSides:
    """A mesh with the lines of slave and master, each line with its body on the left; in space with their faces."""

    mesh: PlainMesh
    points: FloatArray  # (n_points, 2) Positions; in space (n_points, 3).
    slave: IntArray  # (n_lines, 2) Numbers of points, as in `master`; in space (n_faces, 3 or 4).
    master: IntArray
    interface: Interface  # Both surfaces on nodes of their own, slave nodes first.
    words: str  # What is to be told of the mesh, in lines.


def read_sides(
    path: str | Path | None, *, slave: str | None, master: str | None, pair: int = 0, flip: Flip | None = None
) -> MeshSides:
    """Read the lines or faces of two groups, oriented; arguments and errors are those of `read_interface`."""
    mesh = read_mesh(path) if path is not None else _two_files(slave, master)
    if path is not None and slave is None and master is None and mesh.pairs:
        slave, master = _pair(mesh, pair)
    points, remark = find_plane(mesh)
    kinds = ("line",) if points.shape[1] == 2 else _FACE_KINDS
    typed = {"--slave": slave, "--master": master}
    names = {option: find_group(mesh, option, name, (*kinds, "vertex")) for option, name in typed.items()}
    groups = {option: mesh.groups[name] for option, name in names.items()}
    if points.shape[1] == 3 and any("line" in group for group in groups.values()):
        widths = " × ".join(f"{width:g}" for width in np.ptp(points[_find_used(mesh)], axis=0))
        raise MisuseError("--mesh", f"lines of a mesh of {widths}", "lines in a plane of two axes, or faces in space")
    cells = CellSides.collect(mesh.cells, points)
    sides = {option: _members(option, name, mesh, cells) for option, name in names.items()}
    if np.array_equal(sides["--slave"], sides["--master"]):  # Under one name, or under a name and its number.
        raise MisuseError("--master", f"{master!r}, which is the slave too", "another group than --slave")
    shared = np.intersect1d(sides["--slave"], sides["--master"])
    if len(shared):
        actual = f"a node of the slave surface too, at {describe(points[shared[0]])}"
        raise MisuseError("--master", actual, "surfaces without a common node: two nodes where the bodies touch")
    (first, slave_is_known, of_slave), (second, master_is_known, of_master) = (
        _orient(option, points, side, cells, flip) for option, side in sides.items()
    )
    interface = _interface(points, first, second)
    known = {"slave": slave_is_known, "master": master_is_known}
    check_facing(interface, [name for name, is_known in known.items() if not is_known.all()])
    words = mesh.warnings + remark + of_slave + of_master
    for option, surface in zip(sides, (interface.slave, interface.master), strict=True):
        if not known[option[2:]].all():
            normal = mean_direction(surface, interface.nodes)
            place = "on the left of its lines" if normal is None else f"towards {describe(0.0 - normal.round(3))}"
            words += f"{option}: no cells beside it; its body is taken to lie {place} (--flip {option[2:]} turns it)\n"
    labels = label_bodies(mesh.cells.values(), len(points))
    of_one_body = np.isin(labels[first], labels[second]).any()
    if places := back_to_back(points, first, second, cells.around(first, *(() if of_one_body else (second,)))):
        if slave_is_known.any() or master_is_known.any():
            needed = "two sides that face each other across a gap"
            raise MisuseError(
                "--mesh", f"{places}, with {'the body' if of_one_body else 'both bodies'} between", needed
            )
        words += f"{places} turn their backs to each other, or overlap by more than a line's length\n"
    return MeshSides(mesh, points, first, second, interface, words)


def _orient(
    option: str, points: FloatArray, side: IntArray, cells: CellSides, flip: Flip | None
) -> tuple[IntArray, BoolArray, str]:
    """Return lines or faces with the body behind each, for which of them a cell shows it, and what is to be told."""
    neighbours = _neighbours(option, points, side)
    words = _chain_words(option, points, side)
    one_way, by_cells = _run_one_way(option, points, side, neighbours, cells.signs(option, side))
    if n_turned := int((one_way[~by_cells] != side[~by_cells]).any(axis=1).sum()):
        words += f"{option}: turned to run as the first of its {len(side)} {_word(side)}: {n_turned}\n"
    if flip in (option[2:], "both"):
        if by_cells.all():
            needed = "a side without cells: they say on which side a body lies"
            raise MisuseError("--flip", f"{flip}, and cells beside all {_word(side)} of the {option[2:]}", needed)
        one_way = np.where(by_cells[:, None], one_way, one_way[:, ::-1])
    return one_way, by_cells, words


def _word(elements: IntArray) -> str:
    return "lines" if elements.shape[1] == SEGMENT else "faces"


def _interface(points: FloatArray, slave: IntArray, master: IntArray) -> Interface:
    used = [np.unique(side) for side in (slave, master)]
    argument = "--slave"
    try:
        first = Surface(np.searchsorted(used[0], slave))
        argument = "--master"
        second = Surface(np.searchsorted(used[1], master) + len(used[0]))
        interface = Interface(points[np.concatenate(used)], first, second)
    except MisuseError as error:
        option = f"--{error.argument}" if error.argument in ("slave", "master") else argument
        raise MisuseError(option, error.found, error.needed) from error
    return interface


def _pair(mesh: PlainMesh, number: int) -> tuple[str, str]:
    listed = "; ".join(f"{each} {slave}, {master}" for each, (slave, master) in enumerate(mesh.pairs, 1))
    if not number and len(mesh.pairs) > 1:
        raise MisuseError("--pair", f"nothing, and {len(mesh.pairs)} contact pairs: {listed}", "one of them")
    if not 0 <= number <= len(mesh.pairs):
        raise MisuseError("--pair", str(number), f"one of the contact pairs {listed}")
    return mesh.pairs[max(number, 1) - 1]


def _two_files(slave: str | None, master: str | None) -> PlainMesh:
    """Return the mesh of two files of a surface each; the name of a file is a group of all its lines or faces."""
    parts: dict[str, list[IntArray]] = {}
    points, groups, words, n_points = [], {}, "", 0
    for name in filter(None, (slave, master)):
        mesh = read_mesh(name)
        moved = {kind: data + n_points for kind, data in mesh.cells.items()}
        points.append(np.column_stack([mesh.points, np.zeros((len(mesh.points), 3 - mesh.points.shape[1]))]))
        for kind, data in moved.items():
            parts.setdefault(kind, []).append(data)
        n_points, words = n_points + len(mesh.points), words + mesh.warnings
        faces = {kind: data for kind, data in moved.items() if kind in ("triangle", "quad")}
        groups[name] = faces or {kind: data for kind, data in moved.items() if kind == "line"}
    cells = {kind: np.concatenate(each) for kind, each in parts.items()}
    return PlainMesh(np.concatenate(points), cells, groups, warnings=words)


def find_plane(mesh: PlainMesh) -> tuple[FloatArray, str]:
    """Return the positions (n_points, 2) of a mesh in a plane of two axes, or (n_points, 3) in space; and what to tell.

    The axes keep their order: a mesh in x and z is seen with x to the right and z up.
    """
    used = mesh.points[_find_used(mesh)]
    if not np.isfinite(used).all():
        raise MisuseError("--mesh", "NaN or infinity among its coordinates", "finite coordinates")
    extent = np.ptp(used, axis=0) if len(used) else np.zeros(2)
    if len(extent) == 2:
        return mesh.points[:, :2], ""
    thin = [axis for axis in (2, 1, 0) if extent[axis] <= FLAT * extent.max()]
    if not thin:
        return mesh.points, ""
    axes = ("y and z", "x and z", "")[thin[0]]
    remark = f"the mesh lies in a plane of its {axes}, which are x and y here\n" if axes else ""
    return np.delete(mesh.points, thin[0], axis=1), remark


def _find_used(mesh: PlainMesh) -> IntArray:
    """Return the points of all cells, and of all groups of lines and faces."""
    groups = [mesh.cells, *mesh.groups.values()]
    numbers = [data.reshape(-1) for group in groups for kind, data in group.items() if kind != "vertex"]
    return np.unique(np.concatenate([np.empty(0, dtype=np.int64), *numbers]))  # Others may lie outside the plane.


def _members(option: str, name: str, mesh: PlainMesh, cells: CellSides) -> IntArray:
    """Return the nodes of the lines of a group, in space of its faces (n, n_corners), in the order of the file."""
    group = mesh.groups[name]
    kinds = ("line",) if cells.points.shape[1] == 2 else _FACE_KINDS
    elements = [group[kind] for kind in kinds if len(group.get(kind, ()))]
    listed = f"{name!r} with elements {', '.join(sorted(group)) or 'none'}"
    if not elements and "vertex" in group:
        elements = [cells.between(group["vertex"], CORNERS[kind]) for kind in kinds]
        elements = [each for each in elements if len(each)]
        listed = f"{name!r}, a set of {len(group['vertex'])} nodes without an edge or a face of a cell between them"
    higher = [kind for kind in group if kind not in CORNERS and kind.startswith(("line", "VTK_LAGRANGE", *_FACE_KINDS))]
    needed = "lines of two nodes" if len(kinds) == 1 else "triangles alone or quadrilaterals alone"
    if higher and not elements:
        raise MisuseError(option, listed, f"{needed}: a mesh of first order (gmsh -order 1)")
    if len(elements) > 1:
        raise MisuseError(option, listed, f"{needed} (Gmsh: recombine a whole surface, or none)")
    if not elements:
        more = " (by its number, where a group of cells has the same name)" if len(kinds) == 1 else ""
        nodes = np.concatenate([np.empty(0, dtype=np.int64), *(data.reshape(-1) for data in group.values())])
        sides = [(repr(each), other[kind]) for each, other in mesh.groups.items() for kind in kinds if kind in other]
        near = dict.fromkeys(each for each, lines in sides if np.isin(lines, nodes).all())
        more += f": {' or '.join(near)}" if near else ", or of nodes on the boundary of cells"
        raise MisuseError(option, listed, f"a group of {needed}{more}")
    if len(np.unique(np.sort(elements[0]), axis=0)) < len(elements[0]):
        word = _word(elements[0])[:-1]
        raise MisuseError(option, f"the same {word} twice", f"each {word} once")
    return elements[0]


def _chain_words(option: str, points: FloatArray, lines: IntArray) -> str:
    """Return in a line where the second of several chains begins; empty for one chain, or for faces."""
    if lines.shape[1] != SEGMENT:
        return ""
    labels = label_bodies([lines], len(points))[lines[:, 0]]
    is_first = labels == labels[0]
    if is_first.all():
        return ""
    ends, starts = points[lines[is_first]].reshape(-1, 2), points[lines[~is_first]].reshape(-1, 2)
    apart = np.linalg.norm(ends[:, None] - starts, axis=-1)
    end, start = np.unravel_index(apart.argmin(), apart.shape)
    return f"{option} is several chains: no line from {describe(ends[end])} to {describe(starts[start])}\n"


def _run_one_way(
    argument: str, points: FloatArray, elements: IntArray, neighbours: list[list[tuple[int, bool]]], signs: IntArray
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
                    place = describe(points[elements[other, 0]])
                    raise MisuseError(argument, f"a surface with one side, at {place}", "the surface of a body")
        sides = signs[patch] * np.where(turned[patch], -1, 1)
        if sides.min() < 0 < sides.max():
            place = describe(points[elements[np.array(patch)[sides < 0][0], 0]])
            kind, needed = "surface", "one body on one side"
            if elements.shape[1] == SEGMENT:
                kind, needed = "chain", "a body on one side of a chain"
            raise MisuseError(argument, f"a {kind} that changes the side of its body, at {place}", needed)
        turned[patch] ^= bool(sides.min() < 0)
        by_cells[patch] = bool(sides.any())
    return np.where(turned[:, None], elements[:, ::-1], elements), by_cells


def _neighbours(argument: str, points: FloatArray, elements: IntArray) -> list[list[tuple[int, bool]]]:
    """Return neighbours, and whether one is to be turned: both begin or both end in a node, or run an edge alike."""
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
            raise MisuseError(argument, f"{len(those)} {words} at {describe(points[node])}", most)
        if len({number for number, _ in those}) == 2:
            (first, way), (second, other_way) = those
            neighbours[first].append((second, way == other_way))
            neighbours[second].append((first, way == other_way))
    return neighbours
