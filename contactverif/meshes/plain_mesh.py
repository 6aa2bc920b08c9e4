"""Mesh files as plain arrays, which a reader in a child process makes.

What comes back is checked here: whoever gets a `PlainMesh` may rely on every statement of its docstring.
"""

import os
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import Any

import msgspec
import numpy as np

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.contract.errors import MisuseError, one_line
from contactverif.isolation.file_reader import ReadError, check_ordinary, limits_for, read_in_child
from contactverif.isolation.wire import PackedArray

# {kind: the number of its nodes} for the cells that are used; others are there to be named.
CORNERS = {"vertex": 1, "line": 2, "triangle": 3, "quad": 4, "tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8}
_KNOWN_FILES = (
    "a whole file of Abaqus or CalculiX (.inp), Gmsh (.msh), Exodus, MED, XDMF, VTK (.vtu), Nastran or Medit; "
    "'gmsh FILE -save -o mesh.msh' converts many others"
)
_LONGEST_REASON = 300  # Characters of that in an error.
_MOST_LISTED = 20  # Groups that a message lists, in ten lines or so.

Group = dict[str, IntArray]  # {kind: the nodes of each member (n, n_nodes)}, in the order of the file.


@dataclass(frozen=True, slots=True, eq=False)
class PlainMesh:
    """A mesh, checked; kinds of cells have the names of meshio."""

    points: FloatArray  # (n_points, 2 or 3) Positions. Those of points that no cell names may be NaN or infinite.
    cells: Group  # All cells, each once.
    # By name, or by number as text. A set of nodes is of the kind "vertex" alone. A surface of sides of cells has lines
    # or faces, which need not be among the cells.
    groups: dict[str, Group]
    pairs: tuple[tuple[str, str], ...] = ()  # The slave and the master of each contact pair.
    materials: dict[str, tuple[float, float]] = field(default_factory=dict)  # {group: (E, ν)}.
    warnings: str = ""  # What the reader says, in lines.


def read_mesh(path: str | os.PathLike[str]) -> PlainMesh:
    """Read a mesh file; one that cannot be read within the limits, or is no mesh, is a `MisuseError`."""
    name = os.fspath(path)
    size = check_ordinary(path, "--mesh", "a mesh file").st_size
    try:
        packed = read_in_child("contactverif.meshes.read_file:pack_mesh", os.path.abspath(name), limits_for(size))
        return _check_mesh(msgspec.msgpack.decode(packed, type=PlainMesh, dec_hook=_unpack))
    except ReadError as error:
        reason, _, needed = str(error).partition("; needed ")  # Our own readers say what is needed.
        raise MisuseError("--mesh", f"{name!r}, which cannot be read ({reason})", needed or _KNOWN_FILES) from error
    except (msgspec.DecodeError, ValueError) as error:
        raise MisuseError("--mesh", f"{name!r} with {error}", "a mesh whose parts fit each other") from error


def _unpack(_: Any, packed: Any) -> Array:
    return msgspec.convert(packed, PackedArray).unpack()


def _check_mesh(mesh: PlainMesh) -> PlainMesh:
    points = mesh.points
    if points.ndim != 2 or points.shape[1] not in (2, 3) or points.dtype.kind not in "fiu":
        raise ValueError(f"points of type {points.dtype} and shape {points.shape}, not (n_points, 2 or 3)")
    cells = {kind: _whole(kind, data, len(points)) for kind, data in mesh.cells.items()}
    groups = {
        name: {kind: _whole(kind, data, len(points)) for kind, data in group.items()}
        for name, group in mesh.groups.items()
    }
    # Gmsh's format 2.2 has a cell once for each of its physical groups.
    cells = {
        kind: data[np.sort(np.unique(np.sort(data), axis=0, return_index=True)[1])] for kind, data in cells.items()
    }
    return replace(mesh, points=points.astype(np.float64), cells=cells, groups=groups)


def _whole(kind: str, data: Array, n_points: int) -> IntArray:
    if data.ndim != 2 or data.dtype.kind not in "iu":
        raise ValueError(f"{kind} cells of type {data.dtype} and shape {data.shape}, not whole numbers in rows")
    if data.shape[1] != CORNERS.get(kind, data.shape[1]):
        raise ValueError(f"{kind} cells of {data.shape[1]} nodes")
    if data.size and not 0 <= data.min() <= data.max() < n_points:
        outlier = data.min() if data.min() < 0 else data.max()
        raise ValueError(f"a {kind} on point {outlier} of {n_points} points, counted from 0")
    return data.astype(np.int64)


def find_group(mesh: PlainMesh, option: str, name: str | None, kinds: Collection[str] = CORNERS) -> str:
    """Return the name of a group as the file has it, if need be in other capitals.

    The error for a group that the file does not have names near groups, and those with elements of some kinds.
    """
    alike = [each for each in mesh.groups if each.casefold() == (name or "").casefold()]
    if name in alike or len(alike) == 1:
        return name if name in alike else alike[0]
    able = {each: group for each, group in mesh.groups.items() if not group.keys().isdisjoint(kinds)}
    by_case = {each.casefold(): each for each in able}
    near = [repr(by_case[each]) for each in get_close_matches((name or "").casefold(), by_case)]
    words = [f"{each!r} ({', '.join(sorted(group))})" for each, group in able.items()]
    listed = ", ".join(words[:_MOST_LISTED])
    if (more := len(words) - _MOST_LISTED) > 0:
        listed += f" and {more} more, which contactverif scenes lists"
    if not able:
        others = f"; those of the file are of other cells: {', '.join(map(repr, mesh.groups))}" if mesh.groups else ""
        listed = f"a group of {' or '.join(kinds)} elements, made in the mesher (a physical group, *SURFACE, …){others}"
    needed = f"{' or '.join(near)}? The groups are {listed}" if near else f"one of {listed}" if able else listed
    remark = f" ({one_line(mesh.warnings, _LONGEST_REASON)})" if mesh.warnings else ""
    actual = "nothing" if name is None else f"{name!r}, which is no group of the file"
    raise MisuseError(option, actual, needed + remark)
