"""Scenes that are no pair of blocks: silhouettes in text, and a close-up where the contact is small."""

from pathlib import Path

import numpy as np
import pytest

from contactverif import Rectangle, Scene, block, load_formulation, load_scene
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.draw.scene_figures import draw_scene
from contactverif_reports.draw.scene_meshes import close_up, magnifications
from contactverif_reports.draw.scene_text import silhouettes_as_text
from contactverif_reports.draw.solved_scene import SolvedScene


@pytest.fixture(scope="module")
def disk() -> SolvedScene:
    return solve_scene(load_scene("example-2").case(), [load_formulation("vts-ppt")])


@pytest.mark.parametrize("width", [40, 72, 120])
def test_silhouettes_are_to_scale(width: int) -> None:
    scene = load_scene("example-2")
    slave, master = scene.bodies
    lines = silhouettes_as_text(scene.case(), slave, master, width).splitlines()
    assert max(map(len, lines)) <= width
    disk = [line.count("▒") for line in lines if "▒" in line and "segments" not in line]
    foundation = [line.count("░") for line in lines if "░" in line and "segments" not in line]
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
    assert text[0] == ""
    assert set(text[1]) == {"▒"}
    assert set(text[-3]) == {"░"}


def test_a_small_contact_is_drawn_from_near(disk: SolvedScene) -> None:
    box = close_up(disk)
    assert box is not None
    assert np.abs(box.mean(axis=0)).max() <= 0.05
    assert np.ptp(box, axis=0) == pytest.approx([1.6 * 2 * 0.42] * 2, rel=0.02)
    assert magnifications(disk)["vts-ppt"].move == 1


@pytest.mark.parametrize("name", ["c", "c-prime:sides=free", "example-1", "b:degrees=33"])
def test_a_contact_as_wide_as_its_bodies_is_not(name: str) -> None:
    assert close_up(solve_scene(load_scene(name).case(), [load_formulation("nts-ar")])) is None


def test_it_is_drawn(disk: SolvedScene, tmp_path: Path) -> None:
    draw_scene(disk, tmp_path / "a.svg", title="example-2")
    words = (tmp_path / "a.svg").read_text()
    assert "displacements × 1, penetration × 50" in words
    assert "all of the meshes" in words
