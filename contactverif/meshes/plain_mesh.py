"""Mesh files as plain arrays: a reader in a child process makes them, and scenes are written.

What comes back is checked here: whoever gets a `PlainMesh` may rely on every statement of its docstring.
"""

import gzip
import os
import re
from collections.abc import Collection
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from difflib import get_close_matches
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from warnings import catch_warnings

import meshlane
import msgspec
import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.engine import SceneArrays
from contactverif.contract.errors import MisuseError, one_line
from contactverif.isolation.file_reader import ReadError, check_ordinary, limits_for, read_in_child
from contactverif.isolation.wire import PackedArray

# The cell data in which formats that number their groups store the numbers: `3` names a group. In any other array of
# whole numbers `facet_tags=3` does.
TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "ugrid:ref", "su2:tag", "nastran:ref", "avsucd:material")
NO_GROUPS = ("gmsh:geometrical",)
# {kind: the number of its nodes} for the cells that are used; others are there to be named.
CORNERS = {"vertex": 1, "line": 2, "triangle": 3, "quad": 4, "tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8}
_KNOWN_FILES = (
    "a whole file of Abaqus or CalculiX (.inp), Gmsh (.msh), Exodus, MED, XDMF, VTK (.vtu), Nastran or Medit; "
    "'gmsh FILE -save -o mesh.msh' converts many others"
)
_MOST_VALUES = 1000  # An array with more different numbers counts the cells, and groups none.
_LONGEST_REASON = 300  # Characters of that in an error.
_NASTRAN, _MARK = (".bdf", ".fem", ".nas"), b"\xef\xbb\xbf"
_LARGEST = 2**30  # Bytes of a file that was compressed.
_LONGEST_WARNING = 2000  # Characters of what a reader prints.
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
        packed = read_in_child(f"{__name__}:pack_mesh", os.path.abspath(name), limits_for(size))
        return _unpack(msgspec.msgpack.decode(packed, type=_PackedMesh))
    except ReadError as error:
        raise MisuseError("--mesh", f"{name!r}, which cannot be read ({error})", _KNOWN_FILES) from error
    except (msgspec.DecodeError, ValueError) as error:
        raise MisuseError("--mesh", f"{name!r} with {error}", "a mesh whose parts fit each other") from error


class _PackedMesh(msgspec.Struct, array_like=True):
    points: PackedArray
    cells: dict[str, PackedArray]
    groups: dict[str, dict[str, PackedArray]]
    pairs: list[tuple[str, str]]
    materials: dict[str, tuple[float, float]]
    warnings: str


def _unpack(stored: _PackedMesh) -> PlainMesh:
    points = stored.points.unpack()
    if points.ndim != 2 or points.shape[1] not in (2, 3) or points.dtype.kind not in "fiu":
        raise ValueError(f"points of type {points.dtype} and shape {points.shape}, not (n_points, 2 or 3)")
    cells = {kind: _whole(kind, packed, len(points)) for kind, packed in stored.cells.items()}
    groups = {
        name: {kind: _whole(kind, packed, len(points)) for kind, packed in parts.items()}
        for name, parts in stored.groups.items()
    }
    # Gmsh's format 2.2 has a cell once for each of its physical groups.
    cells = {
        kind: data[np.sort(np.unique(np.sort(data), axis=0, return_index=True)[1])] for kind, data in cells.items()
    }
    pairs = tuple(pair for pair in stored.pairs)
    return PlainMesh(points.astype(np.float64), cells, groups, pairs, stored.materials, stored.warnings)


def _whole(kind: str, packed: PackedArray, n_points: int) -> IntArray:
    """Return the nodes of cells, checked."""
    data = packed.unpack()
    if data.ndim != 2 or data.dtype.kind not in "iu":
        raise ValueError(f"{kind} cells of type {data.dtype} and shape {data.shape}, not whole numbers in rows")
    if data.shape[1] != CORNERS.get(kind, data.shape[1]):
        raise ValueError(f"{kind} cells of {data.shape[1]} nodes")
    if data.size and not 0 <= data.min() <= data.max() < n_points:
        outlier = data.min() if data.min() < 0 else data.max()
        raise ValueError(f"a {kind} on point {outlier} of {n_points} points, counted from 0")
    return data.astype(np.int64)


def pack_mesh(path: str) -> bytes:
    """Return a mesh file as bytes, in a child process; one that cannot be read is a ValueError."""
    with TemporaryDirectory() as folder:
        mesh = _read(_cleaned(Path(path), Path(folder)))
    return msgspec.msgpack.encode(
        _PackedMesh(
            PackedArray.pack(mesh.points, "points"),
            _pack(mesh.cells),
            {name: _pack(group) for name, group in mesh.groups.items()},
            list(mesh.pairs),
            mesh.materials,
            mesh.warnings[:_LONGEST_WARNING],
        )
    )


def _pack(group: Group) -> dict[str, PackedArray]:
    return {kind: PackedArray.pack(data, kind) for kind, data in group.items()}


def _cleaned(path: Path, folder: Path) -> Path:
    """Return a file, or a copy of it that is not compressed, and has no byte order mark or blank at its begin."""
    with path.open("rb") as stream:
        head, suffix = stream.read(4), path.suffix.lower()
    if head.startswith(b"\x1f\x8b"):
        with gzip.open(path) as stream:
            data, name = stream.read(_LARGEST + 1), path.name.removesuffix(".gz")
        if len(data) > _LARGEST:
            raise ValueError(f"it is longer than {_LARGEST / 2**30:g} GiB when it is not compressed")
    elif head.startswith(_MARK) or (head[:1].isspace() and suffix != ".stl") or suffix in _NASTRAN:
        data, name = path.read_bytes(), path.name
    else:
        return path
    data = data.removeprefix(_MARK).lstrip()
    if suffix in _NASTRAN:  # Most programs write the cards of the mesh alone, and go on with a card by eight blanks.
        data = re.sub(rb"(?m)^ {8}(?=\S)", b"+       ", data)
        data = data if b"BEGIN BULK" in data.upper() else b"BEGIN BULK\n" + data
    copy = folder / name
    copy.write_bytes(data)
    return copy


def _read(path: Path) -> PlainMesh:
    """Read a file by the reader for its kind, which its first bytes and its ending say."""
    with path.open("rb") as stream:
        head = stream.read(4)
    output, errors = StringIO(), StringIO()
    # Ansys uses the ending .msh too, and a Nastran file may begin with a remark.
    is_gmsh = head.startswith(b"$") and path.suffix.lower() == ".msh"
    try:
        # What Python itself warns of tells of the library's code and not of the file.
        with redirect_stdout(output), redirect_stderr(errors), catch_warnings(action="ignore"):
            mesh = meshlane.read(path, file_format="gmsh" if is_gmsh else None)
    except ImportError as error:
        raise ValueError(f"its format needs the package {error.name}: pip install {error.name}") from error
    except (Exception, SystemExit) as error:  # meshlane prints and exits if a reader gives up.
        words = output.getvalue() + errors.getvalue() + ("" if isinstance(error, SystemExit) else repr(error))
        raise ValueError("meshlane: " + words.replace(str(path), path.name)) from error
    cells: dict[str, list[IntArray]] = {}
    for block in mesh.cells:
        cells.setdefault(block.type, []).append(block.data)
    groups = _groups(mesh, errors)
    return PlainMesh(mesh.points, _joined(cells), groups, warnings=errors.getvalue())


def _joined(parts: dict[str, list[IntArray]]) -> Group:
    return {kind: np.concatenate(each) for kind, each in parts.items()}


_Members = dict[int, IntArray]  # {block of cells: its members, counted from 1, negative where one is to be reversed}.


def _groups(mesh: Any, errors: StringIO) -> dict[str, Group]:
    """Return the groups of a mesh of meshlane: sets and physical groups by name, numbered groups by number as text."""
    named: dict[str, _Members] = {
        name: {number: np.asarray(part, dtype=np.int64) + 1 for number, part in enumerate(parts) if part is not None}
        for name, parts in mesh.cell_sets.items()
        if len(parts) == len(mesh.cells) and "gmsh:" not in name  # Some sets are for Gmsh's own use.
    }
    numbered: dict[str, _Members] = {}
    for key, parts in mesh.cell_data.items():
        values = [np.reshape(part, -1) for part in parts]  # In VTK a number may be a row.
        is_one_each = [part.shape for part in values] == [(len(block),) for block in mesh.cells]
        is_whole = key in TAGS or all(part.dtype.kind in "iub" for part in values)
        if key in NO_GROUPS or not is_one_each or not is_whole:
            continue
        if any(not np.isfinite(part).all() or (np.abs(part) > 2**53).any() for part in values):
            raise ValueError(f"{key!r} that holds no whole numbers")
        tags = (
            np.unique(np.concatenate([part.astype(np.int64) for part in values])) if values else np.empty(0, np.int64)
        )
        if len(tags) > _MOST_VALUES:
            errors.write(f"{key!r} has {len(tags)} different numbers: they make no groups\n")
            continue
        for tag in tags.tolist():
            # In Gmsh, a negative number reverses the lines of a curve; in MED it is that of a family of sets.
            sign = -1 if key == "gmsh:physical" and tag < 0 else 1
            if key in TAGS and (tag == 0 or (tag < 0 and key == "cell_tags")):
                continue
            name = str(sign * tag) if key in TAGS else f"{key}={tag}"
            members = {number: sign * (np.flatnonzero(part == tag) + 1) for number, part in enumerate(values)}
            _include(numbered, name, members)
    for name, value in mesh.field_data.items():  # Gmsh stores the number and the dimension of a name here.
        if np.shape(value) == (2,):
            of_dim = {number for number, block in enumerate(mesh.cells) if block.dim == int(value[1])}
            members = numbered.get(str(int(value[0])), {})
            own = {number: part for number, part in members.items() if number in of_dim}
            named[name] = _united(own, named.get(name, {}))
            # A line in two groups has only the number of the first, but is in the sets of both (.msh 4.1).
            _include(numbered, str(int(value[0])), named[name])
    groups = {name: _nodes_of(mesh, members) for name, members in (numbered | named).items()}
    for name, points in mesh.point_sets.items():
        groups.setdefault(name, {})["vertex"] = np.asarray(points, dtype=np.int64).reshape(-1, 1)
    return groups


def _include(groups: dict[str, _Members], name: str, more: _Members) -> None:
    groups[name] = _united(groups.get(name, {}), more)


def _united(first: _Members, second: _Members) -> _Members:
    """Return the members of two groups, each once; the first says which are to be reversed."""
    none = np.empty(0, dtype=np.int64)
    united = {}
    for number in {*first, *second}:
        known, more = first.get(number, none), second.get(number, none)
        every = np.concatenate([known, more[~np.isin(np.abs(more), np.abs(known))]])
        united[number] = every[np.argsort(np.abs(every))]
    return united


def _nodes_of(mesh: Any, members: _Members) -> Group:
    """Return the nodes of the members of a group, by kind."""
    parts: dict[str, list[IntArray]] = {}
    for number, those in sorted(members.items()):
        block = mesh.cells[number]
        nodes = block.data[np.abs(those) - 1]
        if len(nodes):
            parts.setdefault(block.type, []).append(np.where((those < 0)[:, None], nodes[:, ::-1], nodes))
    return _joined(parts)


def unknown_group_error(
    mesh: PlainMesh, option: str, name: str | None, kinds: Collection[str] = CORNERS
) -> MisuseError:
    """Return the error for a group that the file does not have; it names near groups, and those of some kinds."""
    able = {each: group for each, group in mesh.groups.items() if not group.keys().isdisjoint(kinds)}
    by_case = {each.casefold(): each for each in able}
    near = [repr(by_case[each]) for each in get_close_matches((name or "").casefold(), by_case)]
    words = [f"{each!r} ({', '.join(sorted(group))})" for each, group in able.items()]
    listed = ", ".join(words[:_MOST_LISTED])
    if (more := len(words) - _MOST_LISTED) > 0:
        listed += f" and {more} more, which contactverif scenes lists"
    if not able:
        others = f", which has {', '.join(map(repr, mesh.groups))} of other cells" if mesh.groups else ""
        listed = f"a group of {' or '.join(kinds)} elements, made in the mesher (a physical group, *SURFACE, …){others}"
    needed = f"{' or '.join(near)}? The groups are {listed}" if near else f"one of {listed}" if able else listed
    said = f" ({one_line(mesh.warnings, _LONGEST_REASON)})" if mesh.warnings else ""
    found = "nothing" if name is None else f"{name!r}, which is no group of the file"
    return MisuseError(option, found, needed + said)


SLAVE, MASTER = 1, 2  # The roles of contact edges in a file; 0 is neither.


def write_arrays(arrays: SceneArrays, path: str | Path) -> None:
    """Write a scene to a file of which meshlane knows the format by its ending, such as `.vtu` or `.msh`.

    Parameters
    ----------
    arrays : SceneArrays
        The scene. Its contact edges are lines of the mesh.
    path : str | Path
        The file.

    Raises
    ------
    MisuseError
        If meshlane does not know the ending.
    """
    triangles = arrays.cells[:, 3] < 0
    blocks: list[tuple[str, Any, Any, int]] = [  # (kind, corners, body, role)
        ("line", arrays.slave, np.full(len(arrays.slave), -1), SLAVE),
        ("line", arrays.master, np.full(len(arrays.master), -1), MASTER),
        ("triangle", arrays.cells[triangles, :3], arrays.body_of_cell[triangles], 0),
        ("quad", arrays.cells[~triangles], arrays.body_of_cell[~triangles], 0),
    ]
    blocks = [block for block in blocks if len(block[1])]
    mesh = meshlane.Mesh(
        np.column_stack([arrays.nodes, np.zeros(len(arrays.nodes))]),
        [(kind, corners) for kind, corners, _, _ in blocks],
        point_data={
            "fixed": arrays.fixed.astype(np.int64),
            "imposed": arrays.imposed,
            "load": arrays.load,
            "start": arrays.start,
            "body": arrays.body_of_node,
        },
        cell_data={
            "body_of_cell": [body for _, _, body, _ in blocks],
            "role": [np.full(len(corners), role) for _, corners, _, role in blocks],
        },
    )
    try:
        mesh.write(path)
    except meshlane.ReadError as error:
        raise MisuseError("path", f"{path} ({error})", "an ending that meshlane writes, such as .vtu") from None
