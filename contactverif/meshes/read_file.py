"""A mesh file is read in a child process: by a reader of our own, or by meshlane."""

import gc
import gzip
import re
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from warnings import catch_warnings

import meshlane
import msgspec
import numpy as np

from contactverif.contract.arrays import IntArray
from contactverif.isolation.wire import PackedArray
from contactverif.meshes.deck import read_deck
from contactverif.meshes.exodus import read_exodus
from contactverif.meshes.mdpa import read_mdpa
from contactverif.meshes.plain_mesh import Group, PlainMesh

# The cell data in which formats that number their groups store the numbers: `3` names a group. In any other array of
# whole numbers `facet_tags=3` does.
TAGS = ("gmsh:physical", "medit:ref", "cell_tags", "ugrid:ref", "su2:tag", "nastran:ref", "avsucd:material")
_MOST_VALUES = 1000  # An array with more different numbers counts the cells, and groups none.
_NASTRAN, _MARK = (".bdf", ".fem", ".nas"), b"\xef\xbb\xbf"
_EXODUS = (".e", ".exo", ".ex2", ".exoii", ".g", ".gen")
_LARGEST = 2**30  # Bytes of a file that was compressed.
_LONGEST_WARNING = 2000  # Characters of what a reader prints.


def pack_mesh(path: str) -> bytes:
    """Return a mesh file as bytes, in a child process; one that cannot be read is a ValueError."""
    gc.disable()  # This process ends with the file, and a deck makes millions of lists.
    with TemporaryDirectory() as folder:
        mesh = _read(_clean(Path(path), Path(folder)), path)
    return msgspec.msgpack.encode(replace(mesh, warnings=mesh.warnings[:_LONGEST_WARNING]), enc_hook=PackedArray.pack)


def _clean(path: Path, folder: Path) -> Path:
    """Return a file, or a copy of it that is not compressed, and has no byte order mark or blank at its begin."""
    with path.open("rb") as stream:
        head, suffix = stream.read(4), path.suffix.lower()
    if head.startswith(b"\x1f\x8b"):
        with gzip.open(path) as stream:
            data, name = stream.read(_LARGEST + 1), path.name.removesuffix(".gz")
        if len(data) > _LARGEST:
            raise ValueError(f"it is longer than {_LARGEST / 2**30:g} GiB when it is not compressed")
    elif (
        suffix != ".inp"
        and (  # A deck stays where the files are that it includes.
            head.startswith(_MARK) or (head[:1].isspace() and suffix != ".stl") or suffix in _NASTRAN
        )
    ):
        data, name = path.read_bytes(), path.name
    else:
        return path
    data = data.removeprefix(_MARK).lstrip()
    if suffix in _NASTRAN:  # Most programs write the cards of the mesh alone, and go on with a card by eight blanks.
        data = re.sub(rb"(?m)^ {8}(?=.)", b"+       ", data)
        data = data if b"BEGIN BULK" in data.upper() else b"BEGIN BULK\n" + data
    copy = folder / name
    copy.write_bytes(data)
    return copy


def _read(path: Path, place: str) -> PlainMesh:
    """Read a file, or a copy of that of a place, by the reader for its kind: its first bytes and its ending say it."""
    if path.suffix.lower() in _EXODUS:
        return read_exodus(str(path))
    if path.suffix.lower() == ".mdpa":
        return read_mdpa(str(path))
    with path.open("rb") as stream:
        head = stream.read(100)
    starts_a_deck = head.removeprefix(_MARK).lstrip().startswith(b"*") and path.suffix.lower() != ".f3grid"
    if starts_a_deck or path.suffix.lower() == ".inp":
        return read_deck(str(path), place)
    output, errors = StringIO(), StringIO()
    # Ansys uses the ending .msh too, and a Nastran file may begin with a remark.
    is_gmsh = head.startswith(b"$") and path.suffix.lower() == ".msh"
    try:
        # What Python itself warns of tells of the library's code and not of the file.
        with redirect_stdout(output), redirect_stderr(errors), catch_warnings(action="ignore"):
            mesh = meshlane.read(path, file_format="gmsh" if is_gmsh else None)
    except ImportError as error:
        raise ValueError(f"its format needs the package {error.name}: pip install {error.name}") from error
    except FileNotFoundError as error:
        other = re.search(r"[^/\\']+\.h5\b", str(error))
        missing = other[0] if other else str(error)
        raise ValueError(f"{missing} is missing; needed all files of the mesh in one folder") from error
    except (Exception, SystemExit) as error:  # meshlane prints and exits if a reader gives up.
        words = output.getvalue() + errors.getvalue() + ("" if isinstance(error, SystemExit) else repr(error))
        raise ValueError("meshlane: " + words.replace(str(path), path.name)) from error
    cells: dict[str, list[IntArray]] = {}
    for block in mesh.cells:
        cells.setdefault(block.type, []).append(block.data)
    groups = _groups(mesh, errors)
    return PlainMesh(mesh.points, _join(cells), groups, warnings=errors.getvalue())


def _join(parts: dict[str, list[IntArray]]) -> Group:
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
        if key == "gmsh:geometrical" or not is_one_each or not is_whole:
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
            of_number = {number: part for number, part in members.items() if number in of_dim}
            named[name] = _unite(of_number, named.get(name, {}))
            # A line in two groups has only the number of the first, but is in the sets of both (.msh 4.1).
            _include(numbered, str(int(value[0])), named[name])
    groups = {name: _nodes_of(mesh, members) for name, members in (numbered | named).items()}
    for name, points in mesh.point_sets.items():
        groups.setdefault(name, {})["vertex"] = np.asarray(points, dtype=np.int64).reshape(-1, 1)
    return groups


def _include(groups: dict[str, _Members], name: str, more: _Members) -> None:
    groups[name] = _unite(groups.get(name, {}), more)


def _unite(first: _Members, second: _Members) -> _Members:
    """Return the members of two groups, each once; the first says which are to be reversed."""
    none = np.empty(0, dtype=np.int64)
    united = {}
    for number in {*first, *second}:
        known, more = first.get(number, none), second.get(number, none)
        every = np.concatenate([known, more[~np.isin(np.abs(more), np.abs(known))]])
        united[number] = every[np.argsort(np.abs(every))]
    return united


def _nodes_of(mesh: Any, members: _Members) -> Group:
    parts: dict[str, list[IntArray]] = {}
    for number, those in sorted(members.items()):
        block = mesh.cells[number]
        nodes = block.data[np.abs(those) - 1]
        if len(nodes):
            parts.setdefault(block.type, []).append(np.where((those < 0)[:, None], nodes[:, ::-1], nodes))
    return _join(parts)
