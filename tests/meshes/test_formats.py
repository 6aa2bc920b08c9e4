"""An interface that is written in each format and read back keeps its nodes, elements and orientation."""

from pathlib import Path
from typing import Any, NamedTuple

import meshlane
import netCDF4
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contactverif import Interface, MisuseError, read_interface

FEW = settings(max_examples=8, deadline=None, database=None, derandomize=True)
NAMES, NUMBERS = ("punch", "base"), ("1", "2")
CELLS = {"line": "triangle", "triangle": "tetra", "quad": "hexahedron"}  # {kind of the sides: kind of the cells}
FIRST_FACE = {"line": 1, "triangle": 4, "quad": 5}  # Its number in Exodus.
# {ending: (format of meshlane, the data in which it keeps numbers, what is asked)}
FORMATS = {
    "22.msh": ("gmsh22", "gmsh:physical", NAMES),
    "41.msh": ("gmsh", "gmsh:physical", NAMES),
    ".inp": ("abaqus", "", NAMES),
    ".vtu": ("vtu", "facet_tags", ("facet_tags=1", "facet_tags=2")),
    ".vtk": ("vtk", "MaterialIDs", ("MaterialIDs=1", "MaterialIDs=2")),
    ".xdmf": ("xdmf", "facet_tags", ("facet_tags=1", "facet_tags=2")),
    ".med": ("med", "", NAMES),
    ".mesh": ("medit", "medit:ref", NUMBERS),
    ".meshb": ("medit", "medit:ref", NUMBERS),
    ".bdf": ("nastran", "nastran:ref", NUMBERS),
    ".avs": ("avsucd", "avsucd:material", NUMBERS),
    ".g": ("exodus", "", NAMES),
    ".mdpa": ("mdpa", "", NAMES),
}


class Bodies(NamedTuple):
    """Two bodies, the punch above the base. A side is the first face of a cell, and is seen from outside."""

    kind: str  # That of the sides
    points: np.ndarray
    sides: list[np.ndarray]  # The nodes of each member, of the punch and of the base
    cells: list[np.ndarray]  # One behind each member


@st.composite
def bodies(draw: st.DrawFn) -> Bodies:
    kind = draw(st.sampled_from(list(CELLS)))
    points: list[list[float]] = []
    sides, cells = [], []
    for up in (1, -1):
        n, m = draw(st.integers(1, 3)), draw(st.integers(1, 2)) if kind != "line" else 0
        heights = draw(st.lists(st.integers(0, 4), min_size=(n + 1) * (m + 1), max_size=(n + 1) * (m + 1)))
        number = np.arange(len(points), len(points) + len(heights)).reshape(m + 1, n + 1)
        flat = [[3 * i / n, 3 * j / max(m, 1)][: 2 if m else 1] for j in range(m + 1) for i in range(n + 1)]
        points += [[*place, up * (1 + height / 8)] for place, height in zip(flat, heights, strict=True)]
        members = np.column_stack([number[0, :-1], number[0, 1:]])
        if kind != "line":
            corners = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
            quads = np.column_stack([part.reshape(-1) for part in corners])
            members = quads if kind == "quad" else np.vstack([quads[:, :3], quads[:, [0, 2, 3]]])
        sides.append(np.array(draw(st.permutations(members.tolist())))[:, ::up])
        tips = np.arange(len(points), len(points) + len(members))[:, None]  # Each line or triangle has its own.
        cells.append(np.hstack([sides[-1], sides[-1] + len(heights) if kind == "quad" else tips]))
        places = flat if kind == "quad" else np.mean(np.array(points)[sides[-1]], axis=1)[:, :-1]
        points += [[*place, 3 * up] for place in places]
    return Bodies(kind, np.array(points), sides, cells)


def cycles(elements: np.ndarray) -> list[Any]:
    """Return the corners of elements, each begun at its least one, which keeps the orientation of faces."""
    rows = elements.tolist()
    return sorted(row if len(row) == 2 else min(row[k:] + row[:k] for k in range(len(row))) for row in rows)


def check(interface: Interface, truth: Bodies) -> None:
    for side, surface in zip(truth.sides, (interface.slave, interface.master), strict=True):
        elements = surface.segments if truth.kind == "line" else surface.faces
        assert cycles(interface.nodes[elements]) == cycles(truth.points[side])


def write_exodus(path: Path, truth: Bodies, mesh: meshlane.Mesh, *, is_old: bool, in_space: bool) -> None:
    """Write the blocks by meshlane, and add side sets; files of today have a variable for each axis."""
    meshlane.write(path, meshlane.Mesh(mesh.points if in_space else truth.points, mesh.cells[2:]), file_format="exodus")
    with netCDF4.Dataset(path, "a") as data:
        data.createDimension("num_side_sets", 2)
        data.createVariable("ss_names", "S1", ("num_side_sets", "len_string"))[:, :5] = [[*"punch"], [*"base\0"]]
        for k, cells in enumerate(truth.cells):
            size = data.createDimension(f"num_side_ss{k + 1}", len(cells)).name
            elements = np.arange(len(cells)) + 1 + k * len(truth.cells[0])
            data.createVariable(f"elem_ss{k + 1}", "i8", size)[:] = elements
            data.createVariable(f"side_ss{k + 1}", "i4", size)[:] = FIRST_FACE[truth.kind]
        if not is_old:
            data.renameVariable("coord", "unused")
            for axis, values in zip("xyz", (mesh.points if in_space else truth.points).T, strict=False):
                data.createVariable(f"coord{axis}", "f8", "num_nodes")[:] = values


def write_mdpa(path: Path, mesh: meshlane.Mesh) -> None:
    """Write the sides as conditions in sub model parts."""
    lines = ["Begin Nodes", *(f"{10 * n} {x} {y} {z}" for n, (x, y, z) in enumerate(mesh.points)), "End Nodes"]
    number, dim = 0, "2D" if mesh.cells[0].type == "line" else "3D"
    for block, name in zip(mesh.cells, [*NAMES, "", ""], strict=True):
        section, numbers = "Conditions" if name else "Elements", range(number, number := number + len(block))
        rows = [f"{n} 0 {' '.join(map(str, 10 * row))} // a remark" for n, row in zip(numbers, block.data, strict=True)]
        lines += [f"Begin {section} {section[:-1]}{dim}{block.data.shape[1]}N", *rows, f"End {section}"]
        if name:
            lines += [f"Begin SubModelPart {name}", "Begin SubModelPartConditions", *map(str, numbers), *2 * ["End"]]
    path.write_text("\n".join(lines))


@pytest.mark.parametrize("ending", FORMATS)
@FEW
@given(truth=bodies(), is_turned=st.booleans(), binary=st.booleans())
def test_what_is_written_is_read(
    ending: str, tmp_path_factory: pytest.TempPathFactory, truth: Bodies, is_turned: bool, binary: bool
) -> None:
    format_, key, (slave, master) = FORMATS[ending]
    path, dim = tmp_path_factory.mktemp("formats") / f"a{ending}", truth.points.shape[1]
    parts = [(truth.kind, side[:, :: -1 if is_turned else 1]) for side in truth.sides]  # The cells tell the side.
    parts += [(CELLS[truth.kind], cells) for cells in truth.cells]
    tags = [np.full(len(nodes), number) for number, (_, nodes) in enumerate(parts, 1)]
    if format_ == "med":  # It has one block of each kind.
        parts = [(parts[k][0], np.vstack([parts[k][1], parts[k + 1][1]])) for k in (0, 2)]
        tags = [np.concatenate(tags[:2]), np.concatenate(tags[2:])]
    entities = np.array([(dim - 1, 1 + (z < 0)) if abs(z) < 3 else (dim, 3 + (z < 0)) for z in truth.points[:, -1]])
    is_gmsh = format_.startswith("gmsh")
    mesh = meshlane.Mesh(
        np.column_stack([truth.points, np.zeros((len(truth.points), 3 - dim))]),
        parts,
        point_data={"gmsh:dim_tags": entities} if format_ == "gmsh" else {},
        cell_data={name: tags for name in (key, "gmsh:geometrical" if is_gmsh else "") if name},
        cell_sets={} if key else {name: [np.flatnonzero(t == n) for t in tags] for n, name in enumerate(NAMES, 1)},
        field_data={name: np.array([n, dim - 1]) for n, name in enumerate(NAMES, 1)} if is_gmsh else {},
    )
    if format_ == "exodus":
        write_exodus(path, truth, mesh, is_old=is_turned, in_space=binary)
    elif format_ == "mdpa":
        write_mdpa(path, mesh)
    else:
        meshlane.write(path, mesh, file_format=format_, **({"binary": binary} if is_gmsh or "vt" in format_ else {}))
    check(read_interface(path, slave=slave, master=master), truth)


def test_what_exodus_and_mdpa_files_cannot_have(tmp_path: Path) -> None:
    nodes = "Begin Nodes\n1 0 0 0\n2 1 0 0\n3 2 0 0\nEnd Nodes\nBegin Conditions LineCondition2D"
    for text, message in (
        (f"{nodes}3N\n1 0 1 2 3\n", r"line 7, '1 0 1 2 3': LineCondition2D3N of 3 nodes; mesh at first order"),
        (f"{nodes}2N\n1 0 1 2\n", "no 'End Conditions': the file is not whole"),
        (
            f"{nodes}2N\n1 0 1 2\nEnd\nBegin SubModelPart a\nBegin SubModelPartConditions\n7\nEnd\nEnd",
            "number 7, which",
        ),
    ):
        (tmp_path / "a.mdpa").write_text(text)
        with pytest.raises(MisuseError, match=message):
            read_interface(tmp_path / "a.mdpa", slave="punch", master="base")
    meshlane.write(tmp_path / "a.e", meshlane.Mesh(np.zeros((6, 2)), [("triangle6", [[0, 1, 2, 3, 4, 5]])]))
    with pytest.raises(MisuseError, match="elements TRI6 of 6 nodes, block '0'; mesh at first order"):
        read_interface(tmp_path / "a.e", slave="punch", master="base")
