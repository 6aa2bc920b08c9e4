"""Surfaces in space from mesh files: what is read, which way faces run, and every way to be wrong, with its message."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshlane
import numpy as np
import pytest
from planned_cases import draw_cases
from subjects import load_property, load_subject

from contactverif import Interface, MisuseError
from contactverif.contract.interface import turns_of
from contactverif.meshes.mesh_file import read_interface
from contactverif.meshes.mesh_scene import read_scene
from contactverif.run.run import run
from contactverif.strategies.given_interface import close_surfaces, node_directions
from contactverif.strategies.surfaces import smooth_surface_cases, surface_cases

LOWER = [[-1, -1, 0], [3, -1, 0], [3, 2, 0], [-1, 2, 0]]
UPPER = [[0, 0, 0.5], [1, 0, 0.5], [1, 1, 0.75], [0, 1, 0.75]]
POINTS = np.array([*UPPER, *LOWER, [0.5, 0.5, 2.0], [1, 0.5, -1.0]])
TRIANGLES = [[0, 2, 1], [0, 3, 2]], [[4, 5, 6], [4, 6, 7]]
QUADS = [[0, 3, 2, 1]], [[4, 5, 6, 7]]
TETRAHEDRA = [[0, 1, 2, 8], [0, 2, 3, 8], [4, 5, 6, 9], [4, 6, 7, 9]]


Read = Callable[..., Interface]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Return a function that writes two groups, `punch` and `base`, and reads the interface between them."""

    def written_and_read(
        *sides: object, points: object = POINTS, solids: object = (), suffix: str = ".msh", **flip: Any
    ) -> Interface:
        kinds = {3: "triangle", 4: "quad", 6: "triangle6"}
        parts = [(kinds[np.shape(faces)[1]], np.array(faces)) for faces in sides]
        parts += [("tetra", np.array(solids))] if len(np.array(solids)) else []
        tags = [np.full(len(data), number) for number, (_, data) in enumerate(parts, 1)]
        data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        names = {"punch": np.array([1, 2]), "base": np.array([2, 2])}
        mesh = meshlane.Mesh(np.array(points), parts, cell_data=data, field_data=names)
        file = tmp_path / f"mesh{suffix}"
        if suffix == ".vtu":
            mesh.write(file)
            return read_interface(file, slave="1", master="2", **flip)
        meshlane.write(file, mesh, file_format="gmsh22", binary=False)
        return read_interface(file, slave="punch", master="base", **flip)

    return written_and_read


def test_volume_cells_show_the_side_of_a_body(read: Read) -> None:
    upper, lower = TRIANGLES
    turned = [upper[0], upper[1][::-1]], [face[::-1] for face in lower]
    interface = read(*turned, solids=TETRAHEDRA)
    normals = turns_of(interface.nodes[np.concatenate([interface.slave.faces, interface.master.faces])])[:, 0, 2]
    assert (np.sign(normals) == [-1, -1, 1, 1]).all()


def test_faces_without_cells_run_as_the_first_of_them(read: Read) -> None:
    upper, lower = TRIANGLES
    assert read([upper[0], upper[1][::-1]], lower).slave.faces.tolist() == upper
    with pytest.raises(MisuseError, match="--mesh: found bodies on the same side"):
        read([face[::-1] for face in upper], lower)
    solids = TETRAHEDRA[2:]  # Only the master has cells.
    assert read([face[::-1] for face in upper], lower, solids=solids, flip="slave").slave.faces.tolist() == upper


@pytest.mark.parametrize(
    ("upper", "lower", "message"),
    [
        ([[0, 2, 1, 10, 11, 12]], TRIANGLES[1], "--slave: found 'punch' with elements triangle6; needed triangles al"),
        ([*TRIANGLES[0], [2, 0, 1]], TRIANGLES[1], "--slave: found the same face twice; needed each face once"),
        (TRIANGLES[0], [[4, 5, 6], [4, 6, 0]], r"--master: found a node of the slave surface too, at \(0, 0, 0.5\)"),
        (TRIANGLES[0], [[4, 5, 6], [4, 6, 7], [4, 6, 9]], r"--master: found 3 faces on one edge, at \(-1, -1, 0\)"),
    ],
)
def test_what_is_wrong_is_said(read: Read, upper: object, lower: object, message: str) -> None:
    points = [*POINTS, [0.5, 0.5, 0.6], [1, 0.5, 0.6], [0.5, 0, 0.5]]
    with pytest.raises(MisuseError, match=message):
        read(upper, lower, points=points)


def test_a_face_inside_a_body_is_refused(read: Read) -> None:
    with pytest.raises(MisuseError, match="--slave: found a face with cells on both sides"):
        read(*TRIANGLES, solids=[*TETRAHEDRA, [0, 1, 2, 9]])
    with pytest.raises(MisuseError, match="--slave: found a surface that changes the side of its body"):
        read(*TRIANGLES, solids=[[0, 1, 2, 8], [0, 2, 3, 9]])


def test_a_group_that_is_missing_is_named(tmp_path: Path) -> None:
    tags = {"cell_tags": [np.array([1, 1, 2, 2])]}
    mesh = meshlane.Mesh(POINTS, [("triangle", np.concatenate(TRIANGLES))], cell_data=tags)
    mesh.write(tmp_path / "mesh.vtu")
    assert len(read_interface(tmp_path / "mesh.vtu", slave="1", master="2").master) == 2
    with pytest.raises(MisuseError, match=r"--master: found '3', which is no group of the file; needed one of '1'"):
        read_interface(tmp_path / "mesh.vtu", slave="1", master="3")
    with pytest.raises(
        MisuseError, match="--mesh: found no tetrahedra or hexahedra behind the faces of slave or master"
    ):
        read_scene(tmp_path / "mesh.vtu", slave="1", master="2")


def test_a_slave_is_bent_onto_the_master_it_faces(read: Read) -> None:
    interface = read(*QUADS)
    directions = node_directions(interface.slave, interface.nodes)
    closed = close_surfaces(interface, directions[:4])
    assert closed[:4, 2] == pytest.approx(np.zeros(4), abs=4 * np.finfo(float).eps)  # Lengths are 1.
    assert np.array_equal(closed[4:], interface.nodes[4:])


@pytest.mark.parametrize("make", [surface_cases, smooth_surface_cases])
def test_states_of_a_given_interface_penetrate_it(read: Read, make: Callable[..., object]) -> None:
    interface = read(*TRIANGLES)
    cases = draw_cases(make(interface), seed="given", examples=20).cases
    assert all(case.interface is interface for case in cases)
    depths = [case.positions[:4, 2].min() for case in cases]
    assert max(depths) < 0
    assert min(depths) > -4
    assert len({case.z.tobytes() for case in cases}) > 10


@pytest.mark.parametrize(
    ("name", "faces", "needed"),
    [
        ("nts-3d", QUADS, "quadrilaterals in space; needed one of triangles in space, on which nts-3d is asked"),
        ("nts", TRIANGLES, "triangles in space; needed one of segments in the plane, on which nts is asked"),
    ],
)
def test_a_formulation_is_refused_on_other_faces(read: Read, name: str, faces: Any, needed: str) -> None:
    with pytest.raises(MisuseError, match=f"place: found an interface of {needed}"):
        run([load_subject(name)], [load_property("balance.force")], place=read(*faces), examples=1, seed=1)


def test_a_mesh_in_space_is_asked_what_has_cases_there(read: Read) -> None:
    questions = [load_property(id_) for id_ in ("balance.force", "patch.flat.transmission", "hard.c", "patch.curved")]
    result = run([load_subject("vts-cell-3d")], questions, place=read(*TRIANGLES), examples=3, seed=1)
    assert [str(row.verdict) for row in result.rows] == ["pass", *["not applicable"] * 3]
    assert result.rows[0].contact_share == 1
