"""A solved scene as others read it: meshio gives back what was solved."""

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
from handmade_scene import PRESSURE, make_solved_scene

from contactverif import Body, MisuseError
from contactverif_reports.draw.solved_scene import SolvedScene
from contactverif_reports.draw.vtu import write_vtu


def read_back(scene: SolvedScene, folder: Path) -> meshio.Mesh:
    write_vtu(scene, scene.solutions[0], folder / "a.vtu")
    assert [path.name for path in folder.iterdir()] == ["a.vtu"]
    return meshio.read(folder / "a.vtu")


def in_triangles(scene: SolvedScene) -> SolvedScene:
    """Cut the master's two cells in two."""
    lower = scene.bodies[1]
    cells = np.vstack([lower.cells[:, [0, 1, 2]], lower.cells[:, [0, 2, 3]]])
    cut = Body(lower.nodes, cells, lower.contact, 1.0, 0.0, lower.fixed, lower.imposed, lower.load, name="master")
    stresses = np.vstack([scene.solutions[0].stresses[1]] * 2)
    solutions = tuple(replace(solution, stresses=(solution.stresses[0], stresses)) for solution in scene.solutions)
    return replace(scene, bodies=(scene.bodies[0], cut), solutions=solutions)


def test_all_bodies_are_there_with_what_they_carry(tmp_path: Path) -> None:
    scene = make_solved_scene(angle=0.4, wide=1.0)
    mesh, (upper, lower) = read_back(scene, tmp_path), scene.bodies
    np.testing.assert_array_equal(mesh.points[:, :2], np.vstack([upper.nodes, lower.nodes]))
    assert [block.type for block in mesh.cells] == ["quad"]
    np.testing.assert_array_equal(mesh.cells[0].data, np.vstack([upper.cells, lower.cells + len(upper.nodes)]))
    assert all(mesh.point_data[name].shape == (14, 3) for name in ("displacement", "contact_force"))
    np.testing.assert_array_equal(mesh.point_data["displacement"][:, :2], np.vstack(scene.solutions[0].displacements))
    np.testing.assert_array_equal(mesh.point_data["displacement"][:, 2], 0)
    force = mesh.point_data["contact_force"][:, :2]
    np.testing.assert_array_equal(force[upper.contact_nodes], scene.solutions[0].forces[:4])
    np.testing.assert_array_equal(force[8 + lower.contact_nodes], scene.solutions[0].forces[4:])
    assert np.linalg.norm(force.sum(axis=0)) < 1e-10
    assert np.linalg.norm(force[: len(upper.nodes)].sum(axis=0)) == pytest.approx(6 * PRESSURE)
    pressures = mesh.point_data["contact_pressure"]
    np.testing.assert_allclose(pressures[upper.contact_nodes], PRESSURE, rtol=1e-12)
    assert (pressures != 0).sum() == 7
    data = {name: values[0] for name, values in mesh.cell_data.items()}
    np.testing.assert_allclose(data["pressure"], PRESSURE, rtol=1e-12)
    np.testing.assert_array_equal(data["body"], [0, 0, 0, 1, 1])
    np.testing.assert_array_equal(data["side"], [0, 0, 0, 1, 1])
    tensor = np.column_stack([data[f"stress_{name}"] for name in ("xx", "yy", "xy")])
    np.testing.assert_array_equal(tensor, np.vstack(scene.solutions[0].stresses))


def test_a_rigid_body_is_lines(tmp_path: Path) -> None:
    scene = make_solved_scene(rigid_master=True)
    mesh = read_back(scene, tmp_path)
    assert [block.type for block in mesh.cells] == ["quad", "line"]
    np.testing.assert_array_equal(mesh.cells[1].data, scene.bodies[1].contact + 8)
    np.testing.assert_array_equal(mesh.cell_data["side"][1], [1, 1])
    np.testing.assert_array_equal(mesh.cell_data["pressure"][1], [0, 0])
    np.testing.assert_allclose(mesh.point_data["contact_force"][8:, 1], [-2 * 100, -3 * 100, -100])


def test_triangles_beside_quadrilaterals(tmp_path: Path) -> None:
    mesh = read_back(in_triangles(make_solved_scene()), tmp_path)
    assert {block.type: len(block.data) for block in mesh.cells} == {"quad": 3, "triangle": 4}
    np.testing.assert_array_equal(mesh.cell_data["body"][1], [1, 1, 1, 1])


def test_what_is_not_known_is_zero_and_no_nan(tmp_path: Path) -> None:
    scene = make_solved_scene(wide=8.0)
    unknown = replace(scene.solutions[0], forces=np.full((7, 2), np.nan))
    mesh = read_back(replace(scene, solutions=(unknown,)), tmp_path)
    assert (mesh.point_data["contact_force"] == 0).all()
    assert (mesh.point_data["contact_pressure"] == 0).all()


def test_files_that_cannot_be(tmp_path: Path) -> None:
    scene = make_solved_scene()
    with pytest.raises(MisuseError, match=r"needed a name that ends in \.vtu"):
        write_vtu(scene, scene.solutions[0], tmp_path / "a.vtk")
    with pytest.raises(MisuseError, match="No such file"):
        write_vtu(scene, scene.solutions[0], tmp_path / "no" / "a.vtu")


def test_a_file_that_fails_leaves_the_one_that_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "a.vtu"
    target.write_text("before")

    def full(path: Path, mesh: meshio.Mesh, file_format: str) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(meshio, "write", full)
    with pytest.raises(MisuseError, match="No space left"):
        write_vtu(make_solved_scene(), make_solved_scene().solutions[0], target)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a.vtu", "before")]
