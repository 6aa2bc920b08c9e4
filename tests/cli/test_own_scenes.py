"""`verify` on bodies of the user: a mesh with cells, and a scene that a Python file makes."""

import re
from pathlib import Path

import pytest
import xarray
from asking import Ask, check_mistake
from curved_bodies import write_curved_bodies

FEW = ("--examples", "2", "--seed", "1")
PROCESS = ("--isolation", "process")
SCENE = """
from contactverif import load_scene


def scene():
    return load_scene("c")
"""


@pytest.fixture
def on_mesh(tmp_path: Path) -> tuple[str, ...]:
    path = write_curved_bodies(tmp_path / "curved.msh")
    return "--mesh", str(path), "--slave", "arc", "--master", "top"


def test_a_mesh_with_cells_is_a_scene_and_the_screen_says_what_is_not_asked(ask: Ask, on_mesh: tuple[str, ...]) -> None:
    families = ("-p", "balance.force", "-p", "newton.units", "-p", "accuracy.*", "-p", "hard.*", "-p", "patch.flat.*")
    answer = ask("verify", "vts-ppt-balanced", *on_mesh, "--material", "base=1000,0.25", *families, *FEW, columns=80)
    assert answer.status == 0, answer.err
    assert "contactverif: slave: 21 cells, E = 1, ν = 0.3, 8 nodes held, moved by (0, -0." in answer.err
    assert "contactverif: master: 36 cells, E = 1000, ν = 0.25, 13 nodes held\n" in answer.err
    assert "passes: balance 1 of 1, newton 1 of 1\n" in answer.out
    folded = " ".join(answer.out.split())
    assert re.search(r"not asked here, needs: own meshes with a known answer: .* \d+ of hard", folded)
    assert "a straight slave over a parallel master: patch.flat." in folded
    assert all(len(line) <= 80 for line in answer.out.splitlines())


def test_a_mesh_of_which_no_scene_can_be_made_is_an_interface_and_the_reason_is_said(ask: Ask, tmp_path: Path) -> None:
    path = write_curved_bodies(tmp_path / "curved.msh")
    on_one_body = ("--mesh", path, "--slave", "lid", "--master", "bottom")  # Both look away from the other body.
    answer = ask("verify", "vts-ppt", *on_one_body, "--flip", "-p", "units", "-p", "newton.units", *FEW)
    assert "contactverif: no bodies are solved: " in answer.err
    assert "  elastic bodies: newton.units\n" in answer.out


MISTAKES = [
    (["--material", "bass=1,0.3"], r"--material: found 'bass', which is no group of the file; needed 'base'\?.*"),
    (["--material", "base"], r"--material: found 'base'; needed GROUP=E,ν such as base=1000,0\.3"),
    (["--support", "lid=1"], r"--support: found 'lid=1'; needed GROUP=X,Y such as .*"),
    (["--scene", "c"], r"--scene: found c and --mesh .*; needed one of the two"),
    (["--scene-file", "own.py:scene"], r"--scene-file: found own.py:scene and --mesh .*; needed one of the two"),
]


@pytest.mark.parametrize(("options", "message"), MISTAKES)
def test_a_mistake_is_one_line(ask: Ask, on_mesh: tuple[str, ...], options: list[str], message: str) -> None:
    check_mistake(ask("verify", "nts", *on_mesh, *options), message)


def test_a_scene_of_a_file_is_judged_stored_and_replayed_without_the_file(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "own.py"
    file.write_text(SCENE)
    words = ("vts-me", "--scene-file", "own.py:scene", "-p", "patch.flat.solve", "--out", "own.nc")
    answer = ask("verify", *words, *FEW, *PROCESS)
    assert answer.status == 0, answer.err
    with xarray.open_datatree("own.nc") as report:
        assert report.attrs["place"] == "--scene-file own.py:scene"
        assert re.fullmatch(r"[0-9a-f]{16}", report.attrs["code_of_scene_file"])
    (case,) = ask("replay", "own.nc").out.split()
    file.unlink()
    replayed = ask("replay", "own.nc", "--case", case, *PROCESS)
    assert replayed.status == 1, replayed.err
    check_mistake(
        ask("audit", "own.nc", "--scene-file", "own.py:scene"),
        r"--scene-file: found own\.py, which does not exist; needed FILE\.py:FUNCTION, .*",
    )


def test_a_scene_file_that_gives_no_scene_is_one_line(ask: Ask, tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text("def scene():\n    return 3\n")
    message = r"--scene-file: found \S+, which gives no scene \(scene returns a int, no Scene\); needed .*"
    check_mistake(ask("verify", "nts", "--scene-file", f"{tmp_path / 'own.py'}:scene"), message)
