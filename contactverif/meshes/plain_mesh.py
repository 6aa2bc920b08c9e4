"""A mesh file as plain arrays: meshio reads it in a child process, and what comes back is checked here.

Rule for the next editor: whoever gets a `PlainMesh` may rely on every statement of its docstring.
"""

from __future__ import annotations

import os
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any
from warnings import catch_warnings

import meshio
import msgspec
import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
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
        mesh = _unpack(stored)
    except ReadError as error:
        needed = "a whole mesh file in a format that meshio knows"
        raise MisuseError("--mesh", f"{name!r}, which meshio cannot read ({error})", needed) from error
    except (msgspec.DecodeError, ValueError) as error:
        raise MisuseError("--mesh", f"{name!r} with {error}", "a mesh whose parts fit each other") from error
    return mesh


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
    _check_data(cells, data)
    return PlainMesh(points.astype(np.float64), cells, sets, data, stored.field_data, stored.warnings)


def _check_data(cells: tuple[Block, ...], data: dict[str, list[IntArray]]) -> None:
    for key, parts in data.items():
        if [part.shape for part in parts] != [(len(block),) for block in cells]:
            raise ValueError(f"{key} that is not one number for each cell")


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
    mesh, warnings = _read(Path(path))
    stored = _PackedMesh(
        points=PackedArray.pack(mesh.points, "points"),
        cells=[(block.type, block.dim, PackedArray.pack(block.data, block.type)) for block in mesh.cells],
        cell_sets={name: _parts(parts) for name, parts in mesh.cell_sets.items() if _is_whole_set(mesh, name, parts)},
        cell_data={key: _parts(mesh.cell_data[key]) for key in TAGS if key in mesh.cell_data},
        field_data={  # Gmsh stores the number and the dimension of a name here.
            name: (int(value[0]), int(value[1])) for name, value in mesh.field_data.items() if np.shape(value) == (2,)
        },
        warnings=warnings[:_LONGEST_WARNING],
    )
    return msgspec.msgpack.encode(stored)


def _parts(parts: Any) -> list[PackedArray]:
    return [PackedArray.pack(part) for part in parts]


def _is_whole_set(mesh: Any, name: str, parts: Any) -> bool:
    """Return whether a set has members for each block, and is none of those that Gmsh makes for its own use."""
    return len(parts) == len(mesh.cells) and all(isinstance(part, np.ndarray) for part in parts) and "gmsh:" not in name


def _read(path: Path) -> tuple[Any, str]:
    """Return what meshio reads, and what it prints meanwhile."""
    output, warnings = StringIO(), StringIO()
    try:
        with path.open("rb") as stream:
            is_gmsh = stream.read(1) == b"$"  # Ansys uses the suffix .msh too, and meshio would try that first.
        # What Python itself warns of tells of meshio's code and not of the file.
        with redirect_stdout(output), redirect_stderr(warnings), catch_warnings(action="ignore"):
            return meshio.read(path, file_format="gmsh" if is_gmsh else None), warnings.getvalue()
    except SystemExit as error:  # meshio prints and exits if a reader gives up.
        raise ValueError(output.getvalue() + warnings.getvalue()) from error
    except ImportError as error:
        raise ValueError(f"its format needs the package {error.name}, which is not installed") from error
