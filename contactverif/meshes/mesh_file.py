"""A user's own mesh becomes an Interface: the lines of two named groups, each turned so that its body is on the left.

meshio reads the file, so a format is read as well as meshio reads it. What a mesh from elsewhere may have wrong is said
here in terms of the options of the command line, before an `Interface` sees it.
"""

from __future__ import annotations

import sys
from contextlib import redirect_stderr, redirect_stdout
from difflib import get_close_matches
from io import StringIO
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface, Surface

Group = list[IntArray]  # for each block of cells in the file: 0 no member, 1 a member, -1 one that is to be turned

# Cell data in which the formats that number their groups keep the numbers.
TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "ugrid:ref", "su2:tag", "nastran:ref", "avsucd:material")
FLAT = 1e-9  # of the mesh's size: what a plane written with nine digits or more may depart from a plane


def read_interface(path: str | Path, *, slave: str, master: str, flip: bool = False) -> Interface:
    """The interface between two groups of 2-node lines in a mesh file.

    The 2-D cells beside the lines tell the side of the body; a chain that has none beside it runs as its first line.

    Parameters
    ----------
    path : str | Path
        A file that meshio reads.
    slave, master : str
        A group each, by its name or its number.
    flip : bool
        Exchange the orientation: turn the chains that no cell told, or all where cells told every one.

    Raises
    ------
    MisuseError
        If the file, a group, its lines or the way in which the two face each other cannot be used.
    """
    if slave == master:
        raise MisuseError("--master", f"{master!r}, which is the slave too", "another group than --slave")
    names = (("--slave", slave), ("--master", master))
    mesh = _read(Path(path))
    points = _planar(mesh)
    groups = _groups(mesh)
    sides = [(argument, _lines(mesh, groups, argument, name)) for argument, name in names]
    shared = np.intersect1d(sides[0][1], sides[1][1])
    if len(shared):
        found = f"a node of the slave surface too, at {_place(points, shared[0])}"
        raise MisuseError("--master", found, "surfaces without a common node")
    inside = _directed_edges(mesh, points)
    oriented = [_oriented(argument, lines, inside, points) for argument, lines in sides]
    if flip:
        every = all(told.all() for _, told in oriented)
        oriented = [(np.where((every | ~told)[:, None], lines[:, ::-1], lines), told) for lines, told in oriented]
    interface = _renumbered(points, *(lines for lines, _ in oriented))
    check_facing(interface)
    return interface


def check_facing(interface: Interface) -> None:
    """Whether the two surfaces face each other.

    Raises
    ------
    MisuseError
        If the mean normals, weighted by length, do not oppose each other.
    """
    slave, master = (_mean_normal(surface, interface.nodes) for surface in (interface.slave, interface.master))
    # The normals of a closed chain sum to zero whichever way it runs: a surface without an open chain tells nothing.
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
    """Out of the body, weighted by length; None where all chains are closed."""
    starts = surface.segments[surface.neighbours[:, 0] < 0, 0]
    ends = surface.segments[surface.neighbours[:, 1] < 0, 1]
    if not len(starts):
        return None
    along = nodes[ends].sum(axis=0) - nodes[starts].sum(axis=0)  # the sum over all segments telescopes
    normal: FloatArray = np.array([along[1], -along[0]]) / surface.lengths(nodes).sum()
    return normal


def _read(path: Path) -> Any:
    if not path.is_file():
        raise MisuseError("--mesh", f"{str(path)!r}, which is no file", "a mesh file")
    said, warned = StringIO(), StringIO()
    try:
        with path.open("rb") as stream:
            is_gmsh = stream.read(1) == b"$"  # .msh is Ansys' ending too, and meshio would try that first
        with redirect_stdout(said), redirect_stderr(warned):
            mesh = meshio.read(path, file_format="gmsh" if is_gmsh else None)
    except (Exception, SystemExit) as error:  # meshio prints and exits where a reader gives up
        reason = said.getvalue() + warned.getvalue() if isinstance(error, SystemExit) else str(error)
        brief = " ".join(reason.split()) or type(error).__name__
        found = f"{str(path)!r}, which meshio cannot read ({brief})"
        raise MisuseError("--mesh", found, "a whole mesh file in a format that meshio knows") from error
    sys.stderr.write(warned.getvalue())
    return mesh


def _planar(mesh: Any) -> FloatArray:
    """Positions (n_points, 2) of a mesh in a plane of constant z."""
    points = np.asarray(mesh.points, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise MisuseError("--mesh", f"points of shape {points.shape}", "points with two or three coordinates")
    numbers = [np.asarray(block.data).reshape(-1) for block in mesh.cells if block.dim > 0]
    used = points[np.unique(np.concatenate(numbers))] if numbers else points[:0]  # a lone point may lie anywhere
    if not np.isfinite(used).all():
        raise MisuseError("--mesh", "NaN or infinity among its coordinates", "finite coordinates")
    if len(used) and points.shape[1] == 3:
        extent = np.ptp(used, axis=0)
        if extent[2] > FLAT * extent.max():
            found = f"z from {used[:, 2].min():g} to {used[:, 2].max():g}"
            raise MisuseError("--mesh", found, "a mesh in a plane of constant z")
    return points[:, :2]


def _groups(mesh: Any) -> dict[str, Group]:
    """Sets of cells and physical groups by name, and numbered groups by their number as text."""
    names: dict[str, Group] = {}
    for name, sets in mesh.cell_sets.items():
        if len(sets) == len(mesh.cells) and all(isinstance(some, np.ndarray) for some in sets) and "gmsh:" not in name:
            members = [np.isin(np.arange(len(block)), some) for block, some in zip(mesh.cells, sets, strict=True)]
            names[name] = [some.astype(np.int64) for some in members]
    numbers: dict[str, Group] = {}
    for key in TAGS:
        for tag in sorted({int(tag) for values in mesh.cell_data.get(key, ()) for tag in np.unique(values)} - {0}):
            group = [np.asarray(values == tag, dtype=np.int64) for values in mesh.cell_data[key]]
            if key == "gmsh:physical" and tag < 0:  # Gmsh's way to say that the lines run against the curve
                _include(numbers, str(-tag), [-some for some in group])
            else:
                _include(numbers, str(tag), group)
    for name, value in mesh.field_data.items():  # of Gmsh: the number and the dimension of a name
        if np.shape(value) == (2,):
            number, dim = str(int(value[0])), int(value[1])
            numbered = numbers.get(number, [np.zeros(len(block), dtype=np.int64) for block in mesh.cells])
            _include(names, name, [some * (block.dim == dim) for block, some in zip(mesh.cells, numbered, strict=True)])
            # A line in two groups has only the first one's number, but is in the sets of both (.msh 4.1).
            _include(numbers, number, names[name])
    return numbers | names


def _include(groups: dict[str, Group], name: str, group: Group) -> None:
    """Add the members of a group to those that the name has already."""
    known = groups.get(name, group)
    groups[name] = [np.where(one != 0, one, other) for one, other in zip(known, group, strict=True)]


def _lines(mesh: Any, groups: dict[str, Group], argument: str, name: str) -> IntArray:
    """Nodes (n_lines, 2) of the lines of a group, in the order of the file."""

    def kinds(group: Group) -> list[str]:
        return sorted({block.type for block, some in zip(mesh.cells, group, strict=True) if some.any()})

    if name not in groups:
        listed = ", ".join(f"{each!r} ({', '.join(kinds(group)) or 'empty'})" for each, group in groups.items())
        by_case = {each.casefold(): each for each in groups}
        near = [repr(by_case[each]) for each in get_close_matches(name.casefold(), by_case)]
        needed = (f"{' or '.join(near)}? The groups are " if near else "one of ") + listed
        raise MisuseError(
            argument, f"{name!r}, which is no group of the file", needed if listed else "groups in the file"
        )
    group = groups[name]
    higher = [kind for kind in kinds(group) if kind != "line" and kind.startswith(("line", "VTK_LAGRANGE_CURVE"))]
    if higher:
        found = f"{name!r} with elements {', '.join(higher)}"
        raise MisuseError(argument, found, "2-node lines (mesh at first order)")
    parts = [np.empty((0, 2), dtype=np.int64)]
    for block, some in zip(mesh.cells, group, strict=True):
        if block.type == "line":
            ends = np.asarray(block.data, dtype=np.int64)
            parts.append(np.where(some[:, None] < 0, ends[:, ::-1], ends)[some != 0])
    lines = np.concatenate(parts)
    if not len(lines):
        found = f"{name!r} with elements {', '.join(kinds(group)) or 'none'}, no lines"
        needed = "a group of 2-node lines (by its number, where a group of cells has the same name)"
        raise MisuseError(argument, found, needed)
    return lines


def _directed_edges(mesh: Any, points: FloatArray) -> IntArray:
    """The edges of the 2-D cells, each as `first node × n_points + second node`, its cell on the left."""
    edges = [np.empty(0, dtype=np.int64)]
    for block in mesh.cells:
        if block.dim != 2:
            continue
        kind = block.type.lower()
        n_corners = 3 if "triangle" in kind else 4 if "quad" in kind else None  # corners first; the rest is on edges
        corners = np.asarray(block.data, dtype=np.int64)[:, :n_corners]
        x, y = np.moveaxis(points[corners] - points[corners[:, :1]], -1, 0)  # (n_cells, n_corners) each
        twice_area = (x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y).sum(axis=1)
        corners = np.where(twice_area[:, None] < 0, corners[:, ::-1], corners)[twice_area != 0]
        edges.append((corners * len(points) + np.roll(corners, -1, axis=1)).reshape(-1))
    return np.unique(np.concatenate(edges))


def _oriented(argument: str, lines: IntArray, inside: IntArray, points: FloatArray) -> tuple[IntArray, BoolArray]:
    """The lines, turned so that each chain runs one way with its body on the left; and which of them cells told."""
    touching: dict[int, list[int]] = {}
    for index, line in enumerate(lines.tolist()):
        for node in line:
            touching.setdefault(node, []).append(index)
    for node, several in touching.items():
        if len(several) > 2:
            found = f"{len(several)} lines that meet at {_place(points, node)}"
            raise MisuseError(argument, found, "chains: at most two lines at a node")
    if len(np.unique(np.sort(lines, axis=1), axis=0)) < len(lines):
        raise MisuseError(argument, "the same line twice", "each line once")

    left, right = (np.isin(ends[:, 0] * len(points) + ends[:, 1], inside) for ends in (lines, lines[:, ::-1]))
    if (left & right).any():
        found = f"a line with cells on both sides, at {_place(points, lines[left & right][0, 0])}"
        raise MisuseError(argument, found, "lines on the boundary of a body")

    turned, told = np.zeros(len(lines), dtype=bool), np.zeros(len(lines), dtype=bool)
    seen: set[int] = set()
    for first in range(len(lines)):
        if first in seen:
            continue
        chain = [first]  # runs as it stands; its neighbours are turned to follow it, and theirs
        for index in chain:
            if index in seen:
                continue
            seen.add(index)
            begin, end = lines[index, ::-1] if turned[index] else lines[index]
            for node, met_by in ((begin, 1), (end, 0)):
                for following in set(touching[int(node)]) - seen:
                    turned[following] = lines[following, met_by] != node
                    chain.append(following)
        body_left, body_right = (np.where(turned, one, other)[chain] for one, other in ((right, left), (left, right)))
        if body_left.any() and body_right.any():
            found = f"a chain that changes the side of its body, at {_place(points, lines[chain][body_right][0, 0])}"
            raise MisuseError(argument, found, "a body on one side of a chain")
        told[chain] = body_left.any() or body_right.any()
        if body_right.any():
            turned[chain] = ~turned[chain]
    return np.where(turned[:, None], lines[:, ::-1], lines), told


def _renumbered(points: FloatArray, slave: IntArray, master: IntArray) -> Interface:
    """The interface on its own nodes, slave nodes first; what is wrong with it is said of the options."""
    used = [np.unique(side) for side in (slave, master)]
    argument = "--slave"
    try:
        first = Surface(np.searchsorted(used[0], slave))
        argument = "--master"
        second = Surface(np.searchsorted(used[1], master) + len(used[0]))
        return Interface(points[np.concatenate(used)], first, second)
    except MisuseError as error:
        named = f"--{error.argument}" if error.argument in ("slave", "master") else argument
        raise MisuseError(named, error.found, error.needed) from error


def _place(points: FloatArray, node: int) -> str:
    return f"({points[node, 0]:g}, {points[node, 1]:g})"
