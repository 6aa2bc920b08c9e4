"""Drawings of scenes: text to scale, figures true to the factors that they state, pressures, files for ParaView."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshlane
import numpy as np
import pytest
from handmade_scene import PRESSURE, bodies, make_solved_scene
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from contactverif import Body, Case, MisuseError, Rectangle, Scene, block, load_formulation, load_scene
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.plot.case_figures import plot_case
from contactverif_reports.plot.geometry import Gaps
from contactverif_reports.plot.scene_figures import (
    Magnification,
    choose_pen,
    close_up,
    colour_scale,
    magnifications,
    plot_bodies,
    plot_scene,
)
from contactverif_reports.plot.solved_scene import PointPressures, SolvedScene, pressures_across
from contactverif_reports.plot.text import blocks_as_text, silhouettes_as_text
from contactverif_reports.plot.vtu import write_vtu


def test_blocks_as_one_would_draw_them() -> None:
    scene = make_solved_scene(wide=2.0)
    assert blocks_as_text(scene.case, *scene.bodies).splitlines() == [
        "      ↓   ↓   ↓   ↓   ↓   ↓",
        "      ┌───────────────────┐",
        "      │       slave       │",
        "↓   ↓ ●─1─●──2──●────3────● ↓   ↓",
        "o─────4──────o────────6─────────o",
        "│             master            │",
        "└───────────────────────────────┘",
    ]


def test_a_rigid_master_is_hatched_and_no_pressure_no_arrows() -> None:
    scene = make_solved_scene(rigid_master=True)
    lines = blocks_as_text(scene.case, *scene.bodies).splitlines()
    assert lines[-1] == "/" * len(lines[-2])
    fixed_nodes = make_solved_scene().bodies[1]  # nothing loads or moves it
    assert "↓" in lines[0]
    assert "↓" not in blocks_as_text(make_solved_scene().case, fixed_nodes, fixed_nodes)


@pytest.mark.parametrize("width", [40, 60, 100])
@pytest.mark.parametrize("angle", [0.0, 0.5, 3.0])
def test_it_fits_and_its_boxes_close(width: int, angle: float) -> None:
    scene = make_solved_scene(wide=1.0, angle=angle)
    lines = blocks_as_text(scene.case, *bodies(wide=1.0, angle=angle), width).splitlines()
    assert max(map(len, lines)) <= width
    top, slave = lines[1], lines[3]
    assert (top.index("┌"), top.index("┐")) == (slave.index("●"), slave.rindex("●"))
    bottom, master = lines[6], lines[4]
    assert (bottom.index("└"), bottom.index("┘")) == (master.index("o"), master.rindex("o"))


@pytest.fixture(scope="module")
def disk() -> SolvedScene:
    return solve_scene(load_scene("example-2").case(), [load_formulation("vts-ppt")])


@pytest.mark.parametrize("width", [40, 72, 120])
def test_silhouettes_are_to_scale(width: int) -> None:
    scene = load_scene("example-2")
    slave, master = scene.bodies
    lines = silhouettes_as_text(scene.case(), slave, master, width).splitlines()
    assert max(map(len, lines)) <= width
    disk, foundation = ([line.count(ink) for line in lines[:-2] if ink in line] for ink in "▒░")
    assert len(disk) == pytest.approx(2 * len(foundation), abs=2)
    assert len(set(foundation)) == 1
    assert max(disk) == pytest.approx(foundation[0], abs=1)
    area = 20 * 10 / sum(foundation)  # The height of a character over its width
    assert sum(disk) * area == pytest.approx(np.pi * 100, rel=0.1)
    assert lines[0].strip() == "↓"
    assert lines[-2:] == ["▒ slave, 60 segments of 0.025 or more", "░ master, 82 segments of 0.02 or more"]


def test_a_flat_pair_has_silhouettes_too() -> None:
    upper = block(Rectangle([0, 1, 2], [0, 1]), contact="bottom", approach=0.1, name="slave")
    lower = block(Rectangle([0, 2], [-1, 0]), contact="top", approach=0.0, name="master")
    text = silhouettes_as_text(Scene((upper, lower)).case(), upper, lower, 40).splitlines()
    assert (text[0], set(text[1]), set(text[-3])) == ("", {"▒"}, {"░"})


def test_a_small_contact_is_drawn_from_near(disk: SolvedScene) -> None:
    box = close_up(disk)
    assert disk.sides == ["slave", "master"]
    assert box is not None
    assert np.abs(box.mean(axis=0)).max() <= 0.05
    assert np.ptp(box, axis=0) == pytest.approx([1.6 * 2 * 0.42] * 2, rel=0.02)
    assert magnifications(disk)["vts-ppt"].move == 1


@pytest.mark.parametrize("name", ["c", "c-prime:sides=free", "example-1", "b:degrees=33"])
def test_a_contact_as_wide_as_its_bodies_is_not(name: str) -> None:
    assert close_up(solve_scene(load_scene(name).case(), [load_formulation("nts-ar")])) is None


def test_it_is_drawn(disk: SolvedScene, tmp_path: Path) -> None:
    plot_scene(disk, tmp_path / "a.svg", title="example-2")
    words = (tmp_path / "a.svg").read_text()
    assert "displacements × 1, penetration × 50" in words
    assert "all of the meshes" in words


@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi])
@pytest.mark.parametrize("rigid_master", [False, True])
def test_exact_consistent_forces_of_a_uniform_pressure_give_it_back(angle: float, rigid_master: bool) -> None:
    """Against forces that are written down here: a node has half of each segment beside it, master nodes of [0, 6]."""
    scene = make_solved_scene(angle=angle, rigid_master=rigid_master)
    masters = [2.0, 3.0, 1.0] if rigid_master else [1.0, 3.0, 2.0]
    into_slave = bodies(angle=angle)[0].frame @ [0.0, 1.0]
    sizes = np.array([0.5, 1.5, 2.5, 1.5, *(-value for value in masters)]) * PRESSURE
    np.testing.assert_allclose(scene.solutions[0].forces, sizes[:, None] * into_slave, atol=1e-11)
    np.testing.assert_allclose(scene.node_pressures(scene.solutions[0]), PRESSURE, rtol=1e-12)


def test_a_force_that_is_too_large_is_seen_as_it_is() -> None:
    scene = make_solved_scene()
    scene.solutions[0].forces[5] *= 1.25
    expected = np.where(np.arange(7) == 5, 1.25, 1.0) * PRESSURE
    assert scene.node_pressures(scene.solutions[0]) == pytest.approx(expected)


def test_the_share_of_a_master_node_ends_where_the_slave_does() -> None:
    """∫ of the shape function of the node at −2 over [0, 6]: half of 2 × 1/2; and at 2: the rest of its hat."""
    scene = make_solved_scene(wide=2.0)
    shares = np.linalg.norm(scene.shares(scene.case.positions), axis=1)
    np.testing.assert_allclose(shares[4:], [0.5, 1.5 + 8 / 3, 4 / 3], rtol=1e-12)
    assert shares[4:].sum() == pytest.approx(6.0)


def test_what_lies_beyond_the_other_side_has_no_pressure() -> None:
    scene = make_solved_scene(wide=2.0)
    far = scene.case.positions.copy()
    far[:4, 0] += 3.5  # the slave now covers 3.5 to 9.5, and the first master segment ends at 2
    shares = scene.shares(far)
    assert (shares[4] == 0).all()
    assert np.linalg.norm(shares[5:], axis=1).sum() == pytest.approx(8 - 3.5)


def test_points_lie_where_they_say() -> None:
    scene = make_solved_scene()
    points = PointPressures(np.array([2, 0]), np.array([-0.5, 1.0]), np.array([[-1.0, 0.0], [np.nan, 1.0]]), np.ones(2))
    at, areas = scene.points_along(points)
    np.testing.assert_allclose(at, [3.75, 1.0])
    np.testing.assert_allclose(areas, [[3.0, 4.5], [np.nan, 1.0]])


@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 2])
def test_the_pressure_across_is_the_same_however_a_body_is_turned(angle: float) -> None:
    scene = make_solved_scene(angle=angle)
    for body, stresses in zip(scene.bodies, scene.solutions[0].stresses, strict=True):
        np.testing.assert_allclose(pressures_across(body, stresses), PRESSURE, rtol=1e-12)
    shear = np.array([[0.0, 0.0, 3.0]])
    assert pressures_across(scene.bodies[0], shear) == pytest.approx(3.0 * np.sin(2 * angle), abs=1e-12)


def change(scene: SolvedScene, index: int = 0, **values: Any) -> SolvedScene:
    """With one solution changed."""
    solutions = list(scene.solutions)
    solutions[index] = replace(solutions[index], **values)
    return replace(scene, solutions=tuple(solutions))


SCENES = {
    "two": make_solved_scene(),
    "one": make_solved_scene(names=("only",), ends=("converged",)),
    "turned": make_solved_scene(angle=0.5, wide=1.0),
    "upright": make_solved_scene(angle=np.pi / 2),
    "rigid": make_solved_scene(rigid_master=True),
    "open": make_solved_scene(penetration=-0.3),
    "touching": make_solved_scene(penetration=0.0),
    "deep": make_solved_scene(penetration=1.0),
    "unknown pressure": change(change(make_solved_scene(), pressure=np.nan), 1, pressure=np.nan),
    "no forces": change(make_solved_scene(), forces=np.full((7, 2), np.nan), points=None),
    "exactly zero": change(
        make_solved_scene(), residuals=np.array([1.0, 0.5, 0.0]), energies=np.array([1.0, 0.0, np.nan])
    ),
    "at once": change(
        make_solved_scene(), residuals=np.zeros(1), energies=np.full(1, np.nan), floors=np.zeros(1), factors=np.ones(1)
    ),
    "load steps": change(
        make_solved_scene(names=("only",), ends=("converged",)), factors=np.array([0.5, 0.5, 1.0])
    ),
    "many": make_solved_scene(names=tuple(f"$m_{n}\\alpha$" for n in range(8)), ends=("converged",) * 8),
}  # fmt: skip


@pytest.mark.parametrize(("name", "suffix"), [*((name, "png") for name in SCENES), ("many", "svg")])
def test_everything_is_drawn(name: str, suffix: str, tmp_path: Path) -> None:
    plot_scene(SCENES[name], tmp_path / f"a.{suffix}", title=f"$ {name} \\alpha_ ′ ℓ")
    assert [path.name for path in tmp_path.iterdir()] == [f"a.{suffix}"]
    assert (tmp_path / f"a.{suffix}").stat().st_size > 10_000


def test_a_figure_says_what_it_shows_and_nothing_that_is_not_known(tmp_path: Path) -> None:
    plot_scene(SCENES["two"], tmp_path / "a.svg", title="a scene")
    plot_scene(SCENES["two"], tmp_path / "b.svg", title="a scene")
    words = (tmp_path / "a.svg").read_text()
    for phrase in (
        "a scene", "penalty 1e4; slave E 1, ν 0, master E 1, ν 0", "displacements × 40, penetration × 40",
        "one: converged after 2 iterations", "two: 2-cycle, 2 iterations", "two: try load steps", "exact pressure 100",
        "at contact points, over their areas", "position along the interface (length)", "largest residual",
        "roundoff of the residual",
    ):  # fmt: skip
        assert phrase in words, phrase
    assert (tmp_path / "b.svg").read_text() == words
    plot_scene(SCENES["unknown pressure"], tmp_path / "a.svg")
    assert "exact pressure" not in (tmp_path / "a.svg").read_text()


@pytest.mark.parametrize("name", ["two", "turned", "upright", "rigid", "open"])
def test_gaps_are_drawn_magnified_by_what_is_said(name: str) -> None:
    """The nodes of the slave as drawn, against the master as drawn."""
    scene = SCENES[name]
    large = Magnification(3.0, 7.0)
    axes = Figure().add_subplot()
    plot_bodies(axes, scene, scene.solutions[0], large, colour_scale(scene))
    polygons = [each for each in axes.collections if isinstance(each, PolyCollection)]
    bodies = [each for each in polygons if each.get_array() is not None]
    assert len(bodies) == (1 if scene.bodies[1].rigid else 2)  # The slave is drawn over the master.
    corners = np.array([path.vertices[:4] for path in bodies[-1].get_paths()])  # (n_cells, 4, 2)
    cells, nodes = scene.bodies[0].cells, scene.bodies[0].contact_nodes
    places = np.array([corners[cells == node][0] for node in nodes])
    reference = scene.case.interface.nodes  # the master has not moved
    gaps = Gaps.from_case(Case(scene.case.interface, np.vstack([places, reference[len(places) :]]).ravel())).gap
    right = Gaps.from_case(Case(scene.case.interface, scene.solutions[0].z)).gap
    np.testing.assert_allclose(gaps, 7.0 * right, atol=1e-12)
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    whole = scene.bodies[0].nodes[cells]
    np.testing.assert_allclose(lengths, np.linalg.norm(whole - np.roll(whole, 1, axis=1), axis=-1), atol=1e-12)


def test_one_magnification_for_all_that_stayed_near() -> None:
    scene = make_solved_scene(names=("a", "b", "far"), ends=("converged", "2-cycle", "diverged"))
    deeper = make_solved_scene(penetration=0.02, names=("b",), ends=("2-cycle",)).solutions[0]
    scene = replace(scene, solutions=(scene.solutions[0], deeper, scene.solutions[2]))
    away = scene.solutions[0].z + 1e5
    far = change(scene, 2, displacements=tuple(u + 1e5 for u in scene.solutions[0].displacements), z=away)
    large = magnifications(far)
    assert large["a"] == large["b"] == Magnification(20.0, 20.0)
    assert large["far"].move < 1e-5
    assert magnifications(make_solved_scene(penetration=0.0))["one"] == Magnification(1.0, 1.0)


def test_a_difference_of_roundoff_is_drawn_in_one_colour() -> None:
    stresses = SCENES["two"].solutions[0].stresses
    for name, factor, limits in (
        ("two", 1 + 1e-12, (90.0, 110.0)),
        ("two", 1.5, (50.0, 150.0)),  # The exact pressure, 100, is in the middle.
        ("unknown pressure", 1.5, (100.0, 150.0)),
    ):
        scene = change(SCENES[name], stresses=(stresses[0] * factor, stresses[1]))
        assert colour_scale(scene).get_clim() == pytest.approx(limits)


def test_curves_are_told_apart_without_colours() -> None:
    pens = [choose_pen(number) for number in range(6)]
    assert len({str(pen.style) for pen in pens}) == len({pen.marker for pen in pens}) == 6


def read_back(scene: SolvedScene, folder: Path) -> meshlane.Mesh:
    write_vtu(scene, scene.solutions[0], folder / "a.vtu")
    return meshlane.read(folder / "a.vtu")


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
    assert [mesh.cell_data[name][1].tolist() for name in ("side", "pressure")] == [[1, 1], [0, 0]]
    np.testing.assert_allclose(mesh.point_data["contact_force"][8:, 1], [-2 * 100, -3 * 100, -100])


def test_triangles_beside_quadrilaterals(tmp_path: Path) -> None:
    mesh = read_back(in_triangles(make_solved_scene()), tmp_path)
    assert {block.type: len(block.data) for block in mesh.cells} == {"quad": 3, "triangle": 4}
    np.testing.assert_array_equal(mesh.cell_data["body"][1], [1, 1, 1, 1])


def test_what_is_not_known_is_zero_and_no_nan(tmp_path: Path) -> None:
    scene = make_solved_scene(wide=8.0)
    unknown = replace(scene.solutions[0], forces=np.full((7, 2), np.nan))
    mesh = read_back(replace(scene, solutions=(unknown,)), tmp_path)
    assert not any(mesh.point_data[name].any() for name in ("contact_force", "contact_pressure"))


WRITERS: dict[str, Callable[[Path], None]] = {
    "scene.png": lambda path: plot_scene(SCENES["two"], path),
    "case.svg": lambda path: plot_case(SCENES["two"].case, path),
    "scene.vtu": lambda path: write_vtu(SCENES["two"], SCENES["two"].solutions[0], path),
}


@pytest.mark.parametrize("name", WRITERS)
def test_files_that_cannot_be(name: str, tmp_path: Path) -> None:
    with pytest.raises(MisuseError, match=r"needed a name that ends in \.(png or \.svg|vtu)"):
        WRITERS[name](tmp_path / "a.pdf")
    with pytest.raises(MisuseError, match="No such file"):
        WRITERS[name](tmp_path / "no" / name)


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_that_fails_leaves_the_one_that_was_there(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / name
    target.write_text("before")

    def fail(self: Any, path: Path, *arguments: Any, **options: Any) -> None:
        Path(path).write_text("half of a file")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", fail)
    monkeypatch.setattr(meshlane, "write", lambda path, mesh, file_format: fail(mesh, path))
    with pytest.raises(MisuseError, match="No space left"):
        WRITERS[name](target)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(name, "before")]
