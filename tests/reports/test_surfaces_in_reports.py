"""A counterexample in space is listed, drawn and stored so that a person can rebuild it."""

from dataclasses import astuple
from itertools import combinations
from pathlib import Path

import meshlane
import numpy as np
import pytest
import xarray as xr
from planned_cases import draw_cases
from subjects import load_property, load_subject, same_case

from contactverif import Case, Interface, Run, judge_case, named_case
from contactverif.api.report import make_drawing
from contactverif.contract.counterexample import counterexamples
from contactverif.contract.result import NodalForces
from contactverif.problems.space_scenes import vanishing_space_scenes
from contactverif.run.judge import forces_to_draw
from contactverif.run.run import run
from contactverif.strategies.surfaces import flat_surface_cases
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.exchange.run_document import document_of
from contactverif_reports.html.report_page import report_page
from contactverif_reports.netcdf.read import case_ids, read_case, read_run
from contactverif_reports.netcdf.stored_outcomes import check_bodies, counterexample_groups, read_forces
from contactverif_reports.netcdf.write import write
from contactverif_reports.plot.case_figures import make_case_figure, plot_case, view_from_above, widen
from contactverif_reports.plot.scene_figures import plot_scene
from contactverif_reports.plot.text import as_text
from contactverif_reports.plot.vtu import write_surfaces, write_vtu

CROSSED = named_case("crossed-diagonals")


def test_the_text_lists_nodes_and_faces() -> None:
    lines = as_text(CROSSED).splitlines()
    assert lines[0] == "crossed-diagonals: 2 slave on 2 master triangles, in space"
    assert "  faces   0: 2 1 0   1: 3 2 0" in lines
    assert "  faces   0: 4 5 7   1: 5 6 7" in lines
    assert any(line.split() == ["6", "1", "1", "0"] for line in lines)
    assert any("penetration 1/16 everywhere" in line for line in lines)


def test_a_mesh_of_many_faces_is_not_listed() -> None:
    large = max(draw_cases(flat_surface_cases(), seed="text", examples=20).cases, key=lambda case: case.n_segments)
    text = as_text(large)
    assert "too many to be listed; see replay --out case.svg" in text
    assert len(text.splitlines()) < 40
    node = large.interface.n_nodes - 1
    worst = as_text(large, worst=f"master node {node} (border): force 1, exact 2")
    assert len(worst.splitlines()) < 40
    (row,) = (line.split() for line in worst.splitlines() if line.split()[:1] == [f"{node}"])
    faces = worst.partition(" ".join(row[-1:]))[2]
    assert all(f"{number}: " in faces for number in np.flatnonzero((large.interface.master.faces == node).any(axis=1)))


def test_the_view_from_above_keeps_lengths_in_the_plane() -> None:
    for case in draw_cases(flat_surface_cases(), seed="view", examples=5).cases:
        places, n_slave = view_from_above(case), case.interface.n_slave_nodes
        plane = case.parameters["plane"]
        for part in (slice(n_slave), slice(n_slave, None)):
            lengths, expected = (np.linalg.norm(np.diff(points[part], axis=0), axis=1) for points in (places, plane))
            assert lengths == pytest.approx(expected, rel=1e-6, abs=1e-9 * case.largest_coordinate)


def test_needles_are_drawn_wider() -> None:
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    assert widen(square) == (pytest.approx(square), 1.0)
    places, factor = widen(square @ np.array([[0.6, 0.8], [-0.008, 0.006]]))
    assert factor == 50
    assert np.ptp(places, axis=0) == pytest.approx([1.0, 0.5])


@pytest.mark.parametrize("suffix", [".svg", ".png"])
def test_a_failure_is_drawn(tmp_path: Path, suffix: str) -> None:
    subject, question = load_subject("nts-ar-3d"), load_property("patch.flat.transmission")
    path = tmp_path / f"case{suffix}"
    make_drawing(subject, question, judge_case(question, CROSSED, subject)).write(path)
    assert path.stat().st_size > 5000
    plot_case(CROSSED, tmp_path / f"bare{suffix}")
    if suffix == ".svg":
        text = path.read_text(encoding="utf-8")
        assert "in space" in text
        assert "error of the nodal forces, up to" in text


def test_labels_do_not_cover_each_other_and_the_largest_error_has_its_own() -> None:
    case = next(iter(load_property("hard.deep").for_traits(load_subject("nts-ar-3d").traits).cases(None)))
    forces = np.arange(3.0 * case.interface.n_nodes).reshape(-1, 3)
    figure = make_case_figure(case, forces=forces, exact=np.ones_like(forces), width=5.4)
    figure.draw_without_rendering()
    labels = [text for axes in figure.axes for text in axes.texts if text.get_text()]
    boxes = [label.get_window_extent() for label in labels]
    assert not any(first.overlaps(second) for first, second in combinations(boxes, 2))
    assert any(label.get_text().startswith(f"{case.interface.n_nodes - 1}: ") for label in labels)


@pytest.fixture(scope="module")
def failing_run() -> Run:
    return run([load_subject("nts-3d")], [load_property("patch.flat.transmission")], examples=4, seed=1, shrink="all")


@pytest.fixture(scope="module")
def path(failing_run: Run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("surfaces") / "report.nc"
    write(failing_run, path)
    return path


def test_a_report_stores_faces_and_gives_the_cases_back(path: Path, failing_run: Run) -> None:
    (id_,) = case_ids(path)
    example = next(iter(counterexamples(failing_run).values()))
    assert same_case(read_case(path, id_).case, example.case)
    (row,), (again,) = failing_run.rows, read_run(path).rows
    assert (again.verdict, again.reason) == (row.verdict, row.reason)
    mesh = xr.open_datatree(path)[f"counterexamples/{id_}"]
    assert mesh["mesh"].attrs["topology_dimension"] == 2
    assert mesh["mesh"].attrs["node_coordinates"] == "node_x node_y node_z"
    assert mesh["face_nodes"].shape == (example.case.n_segments, 3)
    assert np.array_equal(mesh["current_z"], example.case.positions[:, 2])


def test_the_forces_found_and_exact_are_stored_and_stand_on_the_page(path: Path, failing_run: Run) -> None:
    (row,), again = failing_run.rows, read_run(path)
    forces, stored = row.forces, again.rows[0].forces
    assert forces is not None
    assert forces.exact is not None
    np.testing.assert_equal(astuple(stored), astuple(forces))  # type: ignore[type-var]
    page = report_page(again, path)
    assert page == report_page(failing_run, path)
    assert "at the nodes, given room: number, force and, where it differs, exact force" in page
    assert page.count(">exact 0.") + page.count(">exact 1") >= 2
    figure = page[page.index("<svg data-figure") :]
    assert "segment" not in figure[: figure.index("</svg>")]


def test_the_page_shows_forces_in_the_plane_too() -> None:
    page = report_page(run([load_subject("nts")], [load_property("patch.flat.transmission")], examples=2, seed=1), "a")
    assert ">force of the formulation<" in page
    assert ">exact force<" in page


def test_the_page_lists_properties_that_do_not_apply_by_their_reason() -> None:
    properties = [load_property(id_) for id_ in ("balance.force", "hard.c", "accuracy.wavy-curved")]
    page = report_page(run([load_subject("nts-3d")], properties, examples=1, seed=1), "report.nc")
    assert "2 properties do not apply</summary>" in page
    assert "the interfaces are plane, and the formulation takes none of them: hard.c, accuracy.wavy-curved</li>" in page
    assert "1 pass, 2 not applicable" in page
    assert "<dt" in page[page.index("The properties") :]
    assert "Case C" not in page


def test_forces_of_other_nodes_are_damage(failing_run: Run) -> None:
    (example,) = counterexamples(failing_run).values()
    groups = counterexample_groups(failing_run)
    mesh = groups[f"/counterexamples/{example.id}"]
    assert read_forces(mesh, example.case) is not None
    with pytest.raises(ValueError, match="forces on other nodes than those of the case"):
        read_forces(mesh, named_case("a1"))


def test_a_case_in_space_is_written_for_paraview(tmp_path: Path) -> None:
    subject, question = load_subject("nts-3d"), load_property("patch.flat.transmission")
    write_surfaces(CROSSED, forces_to_draw(question, CROSSED, subject), tmp_path / "case.vtu")
    mesh = meshlane.read(tmp_path / "case.vtu")
    assert np.array_equal(mesh.points, CROSSED.positions)
    assert [len(block) for block in mesh.cells] == [4]
    assert np.concatenate(mesh.cell_data["side"]).tolist() == [0, 0, 1, 1]
    pressure = CROSSED.penalty * CROSSED.parameter("penetration")
    assert mesh.point_data["exact_pressure"] == pytest.approx(np.full(8, pressure))
    assert mesh.point_data["pressure"].max() == pytest.approx(1.5 * pressure)
    assert mesh.point_data["force"][:4].sum(axis=0) == pytest.approx([0, 0, pressure])
    write_surfaces(CROSSED, None, tmp_path / "bare.vtu")
    assert meshlane.read(tmp_path / "bare.vtu").point_data.keys() == {"node"}


def test_quadrilaterals_have_the_pressure_of_their_forces(tmp_path: Path) -> None:
    nodes = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]
    interface = Interface.from_faces(nodes, [[3, 2, 1, 0]], nodes, [[0, 1, 2, 3]])
    case = Case(interface, interface.nodes.ravel())
    forces = np.repeat([[0, 0, 1.5], [0, 0, -1.5]], 4, axis=0)
    write_surfaces(case, NodalForces(forces), tmp_path / "case.vtu")
    mesh = meshlane.read(tmp_path / "case.vtu")
    assert mesh.point_data["pressure"] == pytest.approx(np.full(8, 3.0))
    assert "exact_force" not in mesh.point_data


def test_forces_of_one_size_and_two_directions_are_told_apart(tmp_path: Path) -> None:
    forces = np.repeat([[0.0, 0, 1], [0, 0, -1]], 4, axis=0)
    plot_case(CROSSED, tmp_path / "case.svg", forces=-forces, exact=forces)
    text = (tmp_path / "case.svg").read_text(encoding="utf-8")
    assert text.count("other way") == 8
    assert "slave, from inside" in text  # The view is against the master's normal.
    plot_case(CROSSED, tmp_path / "nan.svg", forces=np.nan * forces, exact=forces)
    assert "error of the nodal forces, not finite" in (tmp_path / "nan.svg").read_text(encoding="utf-8")


def test_the_document_of_a_run_lists_faces(failing_run: Run) -> None:
    (row,) = document_of(failing_run).rows
    assert row.counterexample is not None
    assert all(len(face) == 3 for face in row.counterexample.master)
    assert "in space" in row.counterexample.drawing


@pytest.fixture(scope="module")
def solved_run() -> Run:
    return run([load_subject("nts-3d")], [load_property("patch.flat.solve")], examples=2, seed=1)


def test_two_blocks_are_stored_told_and_drawn(solved_run: Run, tmp_path: Path) -> None:
    (example,) = counterexamples(solved_run).values()
    write(solved_run, tmp_path / "r.nc")
    (id_,) = case_ids(tmp_path / "r.nc")
    assert same_case(read_case(tmp_path / "r.nc", id_).case, example.case)
    lines = as_text(example.case).splitlines()
    assert "  slave: 12 tetrahedra in layers of 1/2, 1/2, E 1, ν 0.3" in lines
    assert lines[-1] == "penalty 10   approach 1/64   seed 0"
    finding = example.outcome.measurement and example.outcome.measurement.finding
    assert "slave node 1 (border): force 0.0390625, exact 0.002278645833" in str(finding)
    page = report_page(read_run(tmp_path / "r.nc"), tmp_path / "r.nc")
    assert page == report_page(solved_run, tmp_path / "r.nc")
    for words in ("the bodies, slave darker", "forces at the exact solution", "0.25 of the largest exact force"):
        assert words in page


def test_forces_of_blocks_are_compared_at_the_exact_solution(solved_run: Run) -> None:
    """The first guess of an approach is deeper, so a right formulation would look wrong there."""
    (example,) = counterexamples(solved_run).values()
    forces = forces_to_draw(load_property("patch.flat.solve"), example.case, load_subject("sts-3d"))
    assert forces is not None
    assert forces.of_formulation == pytest.approx(forces.exact, abs=1e-15)


@pytest.mark.parametrize(("faces", "kind"), [(3, "tetra"), (4, "hexahedron")])
def test_a_solution_of_two_blocks_is_drawn_and_written(faces: int, kind: str, tmp_path: Path) -> None:
    case = next(case for case in vanishing_space_scenes((faces,)) if "inclined" in case.name)
    solved = solve_scene(case, [load_subject("sts-3d"), load_subject("mortar-3d")])
    (solution, _), (upper, lower) = solved.solutions, solved.bodies
    assert solution.stress_error < 1e-9
    plot_scene(solved, tmp_path / "a.svg", title="two blocks")
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert all(words in text for words in ("mortar-3d: converged", "nodal force over its share", "exact pressure"))
    write_vtu(solved, solution, tmp_path / "a.vtu")
    mesh = meshlane.read(tmp_path / "a.vtu")
    assert {block.type: len(block.data) for block in mesh.cells} == {kind: len(upper.cells) + len(lower.cells)}
    np.testing.assert_array_equal(mesh.point_data["displacement"], np.vstack(solution.displacements))
    forces = mesh.point_data["contact_force"]
    assert np.linalg.norm(forces[: len(upper.nodes)].sum(axis=0)) > 0
    assert forces.sum(axis=0) == pytest.approx(0, abs=1e-12 * np.abs(forces).max())
    np.testing.assert_allclose(mesh.cell_data["pressure"][0], case.parameter("pressure"), rtol=1e-9)
    corners = mesh.points[mesh.cells[0].data]
    spans = np.cross(corners[:, 1] - corners[:, 0], corners[:, faces - 1] - corners[:, 0])
    assert ((spans * (corners[:, -1] - corners[:, 0])).sum(axis=1) > 0).all()  # As ParaView wants cells.


def test_damaged_blocks_are_refused(solved_run: Run) -> None:
    (example,) = counterexamples(solved_run).values()
    arrays = dict(example.case.parameters)
    check_bodies(arrays)
    for name, wrong in (("contact", -1.0), ("cells", 99.0), ("nodes", np.nan)):
        damaged = arrays[f"bodies_{name}"].copy()
        damaged[0, 0] = wrong
        with pytest.raises(ValueError, match=r"that no node has|not those|NaN"):
            check_bodies(arrays | {f"bodies_{name}": damaged})
