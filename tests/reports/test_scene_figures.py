"""Figures of solved scenes: legible whatever is solved, true to the factors that they state, whole or not there."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from handmade_scene import make_solved_scene
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from contactverif import Case, MisuseError
from contactverif_reports.draw import case_figure as figures
from contactverif_reports.draw.case_geometry import Gaps
from contactverif_reports.draw.scene_figures import choose_pen, draw_scene
from contactverif_reports.draw.scene_meshes import Magnification, colour_scale, draw_bodies, magnifications
from contactverif_reports.draw.solved_scene import SolvedScene


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
    draw_scene(SCENES[name], tmp_path / f"a.{suffix}", title=f"$ {name} \\alpha_ ′ ℓ")
    assert [path.name for path in tmp_path.iterdir()] == [f"a.{suffix}"]
    assert (tmp_path / f"a.{suffix}").stat().st_size > 10_000


def test_a_figure_says_what_it_shows(tmp_path: Path) -> None:
    draw_scene(SCENES["two"], tmp_path / "a.svg", title="a scene")
    draw_scene(SCENES["two"], tmp_path / "b.svg", title="a scene")
    words = (tmp_path / "a.svg").read_text()
    for phrase in (
        "a scene",
        "penalty 1e4; slave E 1, ν 0, master E 1, ν 0",
        "displacements × 40, penetration × 40",
        "one: converged after 2 iterations",
        "two: 2-cycle, 2 iterations",
        "two: try load steps",
        "exact pressure 100",
        "at contact points, over their areas",
        "position along the interface (length)",
        "largest residual",
        "roundoff of the residual",
    ):
        assert phrase in words, phrase
    assert (tmp_path / "b.svg").read_text() == words


def test_what_is_not_known_is_not_said(tmp_path: Path) -> None:
    draw_scene(SCENES["unknown pressure"], tmp_path / "a.svg")
    assert "exact pressure" not in (tmp_path / "a.svg").read_text()


@pytest.mark.parametrize("name", ["two", "turned", "upright", "rigid", "open"])
def test_gaps_are_drawn_magnified_by_what_is_said(name: str) -> None:
    """The nodes of the slave as drawn, against the master as drawn."""
    scene = SCENES[name]
    large = Magnification(3.0, 7.0)
    axes = Figure().add_subplot()
    draw_bodies(axes, scene, scene.solutions[0], large, colour_scale(scene))
    faces = next(
        collection
        for collection in axes.collections
        if isinstance(collection, PolyCollection) and collection.get_array() is not None
    )
    index = 0 if scene.bodies[1].rigid else 1  # the master is drawn first
    bodies = [
        collection
        for collection in axes.collections
        if isinstance(collection, PolyCollection) and collection.get_array() is not None
    ]
    slave = bodies[-1]
    assert faces is bodies[0]
    assert len(bodies) == index + 1
    corners = np.array([path.vertices[:4] for path in slave.get_paths()])  # (n_cells, 4, 2)
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
    scene = SCENES["two"]
    stresses = scene.solutions[0].stresses
    low, high = colour_scale(change(scene, stresses=(stresses[0] * (1 + 1e-12), stresses[1]))).get_clim()
    assert (low, high) == (pytest.approx(90.0), pytest.approx(110.0))
    low, high = colour_scale(change(scene, stresses=(stresses[0] * 1.5, stresses[1]))).get_clim()
    assert (low, high) == (pytest.approx(50.0), pytest.approx(150.0))  # the exact pressure, 100, in the middle
    low, high = colour_scale(change(SCENES["unknown pressure"], stresses=(stresses[0] * 1.5, stresses[1]))).get_clim()
    assert (low, high) == (pytest.approx(100.0), pytest.approx(150.0))


def test_curves_are_told_apart_without_colours() -> None:
    looks = [(str(choose_pen(number).style), choose_pen(number).marker) for number in range(6)]
    assert len({style for style, _ in looks}) == len({marker for _, marker in looks}) == 6


def test_figures_that_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(MisuseError, match=r"needed a name that ends in \.png or \.svg"):
        draw_scene(SCENES["two"], tmp_path / "a.pdf")
    with pytest.raises(MisuseError, match="No such file"):
        draw_scene(SCENES["two"], tmp_path / "no" / "a.png")


def test_a_figure_that_fails_leaves_the_one_that_was_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "a.png"
    target.write_text("before")

    def full(self: Figure, path: Path, **options: Any) -> None:
        path.write_text("half of a picture")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figures.Figure, "savefig", full)
    with pytest.raises(MisuseError, match="No space left"):
        draw_scene(SCENES["two"], target)
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("a.png", "before")]
