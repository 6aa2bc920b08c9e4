"""Mesh files as plain arrays: meshio reads them in a child process, and writes scenes.

What comes back is checked here: whoever gets a `PlainMesh` may rely on every statement of its docstring. Its groups are
sets of cells and physical groups by name, and numbered groups by number as text.
"""

import os
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from difflib import get_close_matches
from io import StringIO
from pathlib import Path
from typing import Any
from warnings import catch_warnings

import meshio
import msgspec
import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.engine import SceneArrays
from contactverif.contract.errors import MisuseError
from contactverif.isolation.file_reader import ReadError, check_ordinary, limits_for, read_in_child
from contactverif.isolation.wire import PackedArray

# The cell data in which formats that number their groups store the numbers.
TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "ugrid:ref", "su2:tag", "nastran:ref", "avsucd:material")
_LONGEST_WARNING = 2000  # Characters of what meshio prints.


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Cells of one type."""

    type: str  # The type, as meshio calls it.
    dim: int  # The dimension of such a cell: 0 for a point, 1 for a line, 2 for a triangle.
    data: IntArray  # (n_cells, n_nodes) The nodes of each cell: numbers of points of the mesh.

    def __len__(self) -> int:
        return len(self.data)


@dataclass(frozen=True, slots=True, eq=False)
class PlainMesh:
    """A mesh, checked."""

    points: FloatArray  # (n_points, 2 or 3) Positions. Those of points that no cell names may be NaN or infinite.
    cells: tuple[Block, ...]  # Cells by type.
    cell_sets: dict[str, list[IntArray]]  # {name: for each block the numbers of its members}.
    # {key: for each block the number of each cell, shape (n_cells,)}, for the keys among `TAGS`.
    cell_data: dict[str, list[IntArray]]
    field_data: dict[str, tuple[int, int]]  # {name: number and dimension} of the physical groups of Gmsh.
    warnings: str  # What meshio prints.


def read_mesh(path: str | os.PathLike[str]) -> PlainMesh:
    """Read a mesh file; one that cannot be read within the limits, or is no mesh, is a `MisuseError`."""
    name = os.fspath(path)
    size = check_ordinary(path, "--mesh", "a mesh file").st_size
    try:
        packed = read_in_child(f"{__name__}:pack_mesh", os.path.abspath(name), limits_for(size))
        stored = msgspec.msgpack.decode(packed, type=_PackedMesh)
        return _unpack(stored)
    except ReadError as error:
        needed = "a whole mesh file in a format that meshio knows"
        raise MisuseError("--mesh", f"{name!r}, which meshio cannot read ({error})", needed) from error
    except (msgspec.DecodeError, ValueError) as error:
        raise MisuseError("--mesh", f"{name!r} with {error}", "a mesh whose parts fit each other") from error


class _PackedMesh(msgspec.Struct, array_like=True):
    points: PackedArray
    cells: list[tuple[str, int, PackedArray]]
    cell_sets: dict[str, list[PackedArray]]
    cell_data: dict[str, list[PackedArray]]
    field_data: dict[str, tuple[int, int]]
    warnings: str


def _unpack(stored: _PackedMesh) -> PlainMesh:
    points = stored.points.unpack()
    if points.ndim != 2 or points.shape[1] not in (2, 3) or points.dtype.kind not in "fiu":
        raise ValueError(f"points of type {points.dtype} and shape {points.shape}, not (n_points, 2 or 3)")
    cells = tuple(_block(type_, dim, packed, len(points)) for type_, dim, packed in stored.cells)
    sets = {name: _whole(name, parts) for name, parts in stored.cell_sets.items()}
    data = {key: _whole(key, parts) for key, parts in stored.cell_data.items()}
    for key, parts in data.items():
        if [part.shape for part in parts] != [(len(block),) for block in cells]:
            raise ValueError(f"{key} that is not one number for each cell")
    return PlainMesh(points.astype(np.float64), cells, sets, data, stored.field_data, stored.warnings)


def _block(type_: str, dim: int, packed: PackedArray, n_points: int) -> Block:
    data = packed.unpack()
    if data.ndim != 2 or data.dtype.kind not in "iu":
        raise ValueError(f"{type_} cells of type {data.dtype} and shape {data.shape}, not whole numbers in rows")
    if type_ == "line" and data.shape[1] != 2:
        raise ValueError(f"lines of {data.shape[1]} nodes")
    if data.size and not 0 <= data.min() <= data.max() < n_points:
        outlier = data.min() if data.min() < 0 else data.max()
        raise ValueError(f"a {type_} on point {outlier} of {n_points} points, counted from 0")
    return Block(type_, dim, data.astype(np.int64))


def _whole(name: str, parts: list[PackedArray]) -> list[IntArray]:
    """Return arrays of whole numbers, which some formats store as reals."""
    arrays = [part.unpack() for part in parts]
    for values in arrays:
        if values.dtype.kind not in "fiub" or not np.isfinite(values).all() or (np.abs(values) > 2**53).any():
            raise ValueError(f"{name!r} that holds no whole numbers")
    return [values.astype(np.int64) for values in arrays]


def pack_mesh(path: str) -> bytes:
    """Return a mesh file as bytes, in a child process; one that meshio cannot read is a ValueError."""
    output, errors = StringIO(), StringIO()
    try:
        with open(path, "rb") as stream:
            is_gmsh = stream.read(1) == b"$"  # Ansys uses the suffix .msh too, and meshio would try that first.
        # What Python itself warns of tells of meshio's code and not of the file.
        with redirect_stdout(output), redirect_stderr(errors), catch_warnings(action="ignore"):
            mesh: Any = meshio.read(path, file_format="gmsh" if is_gmsh else None)
    except SystemExit as error:  # meshio prints and exits if a reader gives up.
        raise ValueError(output.getvalue() + errors.getvalue()) from error
    except ImportError as error:
        raise ValueError(f"its format needs the package {error.name}, which is not installed") from error
    stored = _PackedMesh(
        points=PackedArray.pack(mesh.points, "points"),
        cells=[(block.type, block.dim, PackedArray.pack(block.data, block.type)) for block in mesh.cells],
        # A set has members for each block, and is none of those that Gmsh makes for its own use.
        cell_sets={
            name: [PackedArray.pack(part) for part in parts]
            for name, parts in mesh.cell_sets.items()
            if len(parts) == len(mesh.cells)
            and all(isinstance(part, np.ndarray) for part in parts)
            and "gmsh:" not in name
        },
        cell_data={
            key: [PackedArray.pack(part) for part in mesh.cell_data[key]] for key in TAGS if key in mesh.cell_data
        },
        field_data={  # Gmsh stores the number and the dimension of a name here.
            name: (int(value[0]), int(value[1])) for name, value in mesh.field_data.items() if np.shape(value) == (2,)
        },
        warnings=errors.getvalue()[:_LONGEST_WARNING],
    )
    return msgspec.msgpack.encode(stored)


Group = list[IntArray]  # For each block of cells in the file: 0 no member, 1 a member, −1 a member to be reversed.

MOST_MEMBERS = 10**8  # Groups times cells: so many take 1 GB. A mesh of a million cells may have a hundred groups.


def groups_of(mesh: PlainMesh) -> dict[str, Group]:
    """Return all groups of a mesh: sets of cells and physical groups by name, numbered groups by number as text."""
    numbers = [np.arange(len(block)) for block in mesh.cells]
    named: dict[str, Group] = {
        name: [np.isin(every, part).astype(np.int64) for every, part in zip(numbers, sets, strict=True)]
        for name, sets in mesh.cell_sets.items()
    }
    numbered: dict[str, Group] = {}
    n_cells = sum(map(len, mesh.cells))
    for key, parts in mesh.cell_data.items():
        tags = sorted({int(tag) for values in parts for tag in np.unique(values)} - {0})
        if len(tags) * n_cells > MOST_MEMBERS:
            raise MisuseError("--mesh", f"{len(tags)} groups of {n_cells} cells", "fewer groups")
        for tag in tags:
            # In Gmsh, a negative number reverses the lines of a curve.
            sign = -1 if key == "gmsh:physical" and tag < 0 else 1
            _include(numbered, str(sign * tag), [np.asarray(values == tag, dtype=np.int64) * sign for values in parts])
    for name, (number, dim) in mesh.field_data.items():
        group = numbered.get(str(number), [np.zeros(len(block), dtype=np.int64) for block in mesh.cells])
        _include(named, name, [part * (block.dim == dim) for block, part in zip(mesh.cells, group, strict=True)])
        # A line in two groups has only the number of the first, but is in the sets of both (.msh 4.1).
        _include(numbered, str(number), named[name])
    return numbered | named


def _include(groups: dict[str, Group], name: str, group: Group) -> None:
    """Add the members of a group to those that the name has already."""
    known = groups.get(name, group)
    groups[name] = [np.where(part != 0, part, more) for part, more in zip(known, group, strict=True)]


def kinds_in(mesh: PlainMesh, group: Group) -> list[str]:
    """Return the types of the cells in a group."""
    return sorted({block.type for block, members in zip(mesh.cells, group, strict=True) if members.any()})


def unknown_group_error(mesh: PlainMesh, groups: dict[str, Group], argument: str, name: str) -> MisuseError:
    """Return the error for a group that the file does not have; it names near groups and lists all."""
    listed = ", ".join(f"{each!r} ({', '.join(kinds_in(mesh, group)) or 'empty'})" for each, group in groups.items())
    by_case = {each.casefold(): each for each in groups}
    near = [repr(by_case[each]) for each in get_close_matches(name.casefold(), by_case)]
    needed = (f"{' or '.join(near)}? The groups are " if near else "one of ") + listed
    return MisuseError(argument, f"{name!r}, which is no group of the file", needed if listed else "groups in the file")


SLAVE, MASTER = 1, 2  # The roles of contact edges in a file; 0 is neither.


def write_arrays(arrays: SceneArrays, path: str | Path) -> None:
    """Write a scene to a file of which meshio knows the format by its ending, such as `.vtu` or `.msh`.

    Parameters
    ----------
    arrays : SceneArrays
        The scene. Its contact edges are lines of the mesh.
    path : str | Path
        The file.

    Raises
    ------
    MisuseError
        If meshio does not know the ending.
    """
    triangles = arrays.cells[:, 3] < 0
    blocks: list[tuple[str, Any, Any, int]] = [  # (kind, corners, body, role)
        ("line", arrays.slave, np.full(len(arrays.slave), -1), SLAVE),
        ("line", arrays.master, np.full(len(arrays.master), -1), MASTER),
        ("triangle", arrays.cells[triangles, :3], arrays.body_of_cell[triangles], 0),
        ("quad", arrays.cells[~triangles], arrays.body_of_cell[~triangles], 0),
    ]
    blocks = [block for block in blocks if len(block[1])]
    mesh = meshio.Mesh(
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
    except meshio.ReadError as error:
        raise MisuseError("path", f"{path} ({error})", "an ending that meshio writes, such as .vtu") from None
