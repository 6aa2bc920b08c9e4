"""The commands on scenes: `scenes`, `draw`, `verify` on a scene or on bodies of the user; and scenes in a report."""

import re
from pathlib import Path
from typing import Any

import meshlane
import netCDF4
import numpy as np
import pytest
import xarray
from asking import Ask, check_mistake
from curved_bodies import write_curved_bodies
from handmade_run import run_with
from subjects import Changed, load_subject

from contactverif import Case, End, Placing, Rectangle, Subject, named_case, two_blocks
from contactverif.cli.listing import MEANINGS
from contactverif.contract.result import NotLoaded
from contactverif.mechanics.scene import has_bodies, scene_of
from contactverif.plugins import registry
from contactverif.problems.catalogue import OPTIONS, SCENES, NamedBlocks, load_scene
from contactverif.run import judge as judging
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import case_ids, read_case
from contactverif_reports.netcdf.write import write

FIG_30 = "c:penalty=1e4,sides=free,lowered=0,ratio=0.5"
SVG, PNG = b"<?xml", b"\x89PNG"
FEW = "--examples 2 --seed 1"


def ends(out: str) -> dict[str, list[str]]:
    """{formulation: the other words of its row} of a table of solutions."""
    lines = [line.split() for line in out.splitlines()]
    start = next(number for number, words in enumerate(lines) if words[:2] == ["formulation", "end"])
    rows = lines[start + 2 :]
    return {words[0]: words[1:] for words in rows[: rows.index([])]}


@pytest.fixture
def scene_report(tmp_path: Path) -> Path:
    """Return a report whose counterexample is the scene c′."""
    path = tmp_path / "scene.nc"
    write(run_with(load_scene("c-prime").case(), "vts-me"), path)
    return path


CASE = "vts-me.patch.flat.transmission"

# ---------------------------------------------------------------------------------------------------------------------
# scenes


def test_scenes_of_a_mesh_file_lists_its_groups(ask: Ask) -> None:
    answer = ask("scenes tests/data/punch.msh")
    assert re.search(r"punch or 1 +5 lines +2 +A", answer.out)
    assert {"A" * 10, "B" * 10} <= {part[:10] for part in re.findall("A+|B+", answer.out)}
    assert "verify NAME --mesh tests/data/punch.msh --slave GROUP --master GROUP" in answer.out


@pytest.mark.parametrize("columns", [1, 10])
def test_a_terminal_that_is_too_narrow_cuts_what_it_shows(ask: Ask, columns: int) -> None:
    answer = ask("scenes", columns=columns)
    assert (answer.status, answer.err) == (0, "")
    assert answer.out.startswith("a")


@pytest.mark.parametrize("columns", [60, 80, 140])
def test_scenes_lists_all_with_drawings_and_fits(ask: Ask, columns: int) -> None:
    answer = ask("scenes", columns=columns)
    assert (answer.status, answer.err) == (0, "")
    assert max(map(len, answer.out.splitlines())) <= columns
    blocks = {block.splitlines()[0]: block for block in answer.out.split("\n\n")}
    assert list(blocks)[:-1] == list(SCENES)
    for name, entry in SCENES.items():
        words = " ".join(blocks[name].split())
        source = f"Zavarise & De Lorenzis (2009), {entry.source}" if entry.source else "this project"
        for words_of_scene in (entry.summary, f"source: {source}", entry.assumptions):
            assert words_of_scene in words
        if not isinstance(entry, NamedBlocks):
            assert {"▒", "░", "↓"} <= set(blocks[name])
            assert "options: refine (1), penalty (1e+09)" in words
            continue
        n_slave = len(entry.slave) + 1
        assert blocks[name].count("●") == n_slave
        assert "┌" in blocks[name]
        assert ("/////" in blocks[name]) == entry.rigid_master
    options = list(blocks.values())[-1]
    assert all(re.search(rf"^  {option} ", options, re.M) for option in OPTIONS)
    assert "ratio     E of the master over E of the slave (1)" in options


def test_every_option_has_a_meaning() -> None:
    assert tuple(MEANINGS) == tuple(OPTIONS)


# ---------------------------------------------------------------------------------------------------------------------
# draw


@pytest.mark.parametrize(("suffix", "begins", "columns"), [("png", PNG, 80), ("svg", SVG, 140)])
def test_fig_30_of_the_paper(ask: Ask, tmp_path: Path, suffix: str, begins: bytes, columns: int) -> None:
    names = ["vts-me", "vts-ppt-basic", "vts-ppt"]
    picture = tmp_path / f"fig30.{suffix}"
    answer = ask(f"draw --scene {FIG_30} -f {' -f '.join(names)} --out", picture, columns=columns)
    assert (answer.status, answer.err) == (0, "")
    assert answer.out.endswith(f"picture: {picture}\n")
    assert list(ends(answer.out)) == names
    iterations = {name: int(words[1]) for name, words in ends(answer.out).items()}
    assert all(words[0] == "converged" for words in ends(answer.out).values())
    assert iterations["vts-me"] in (3, 4, 5)
    assert iterations["vts-ppt"] in (4, 5)
    assert 13 <= iterations["vts-ppt-basic"] <= 18
    assert picture.read_bytes().startswith(begins)
    assert "stress error" not in answer.out  # no exact stress is known with free sides


def test_draw_shows_the_error_of_the_stress_where_it_is_known(ask: Ask) -> None:
    answer = ask("draw --scene c -f nts -f vts-ppt")
    assert answer.status == 0
    rows = ends(answer.out)
    assert float(rows["nts"][-1]) > 0.01
    assert float(rows["vts-ppt"][-1]) < 1e-9
    assert "●─2─●─2─●───4───●───4───●" in answer.out  # no file was asked for


def test_draw_writes_for_paraview(ask: Ask, tmp_path: Path) -> None:
    answer = ask("draw --scene c -f vts-ppt", "--out", tmp_path / "c.vtu", "--out", tmp_path / "c.svg")
    assert answer.status == 0
    assert answer.out.endswith(f"picture: {tmp_path / 'c.svg'}\nfor ParaView: {tmp_path / 'c.vtu'}\n")
    mesh, scene = meshlane.read(tmp_path / "c.vtu"), load_scene("c")
    assert len(mesh.points) == sum(len(body.nodes) for body in scene.bodies)
    assert mesh.cell_data["pressure"][0] == pytest.approx(100.0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.svg", "c.vtu"]


def test_a_formulation_that_cannot_be_asked_is_a_line(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = registry.load_formulation

    def load(name: str, limits: Any) -> Any:
        return NotLoaded(name, "no licence") if name == "nts" else real(name, limits)

    monkeypatch.setattr(registry, "load_formulation", load)
    answer = ask("draw --scene c -f nts -f vts-ppt --out", tmp_path / "c.png")
    assert (answer.status, answer.err) == (1, "")
    assert "\nnts: not loaded: no licence\n" in answer.out
    assert list(ends(answer.out)) == ["vts-ppt"]
    assert (tmp_path / "c.png").is_file()
    answer = ask("draw --scene c -f nts --out", tmp_path / "none.png")
    assert answer.status == 1
    assert answer.out.endswith("nts: not loaded: no licence\n")
    assert not (tmp_path / "none.png").exists()


def test_draw_says_what_to_try_where_newtons_method_diverges(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plugin = load_subject("vts-ppt").with_penalty(1e4).plugin
    plugin = Changed(plugin, tangent=lambda *state: -1e4 * np.eye(state[-1].size))
    diverging = Subject("mine", lambda *, penalty: plugin)
    monkeypatch.setattr(registry, "load_formulation", lambda name, limits: diverging)
    answer = ask("draw --scene c -f mine --out", tmp_path / "c.svg", columns=80)
    assert answer.status == 0
    assert "diverged" in answer.out
    assert f"mine: {End.DIVERGED.advice}" in " ".join(answer.out.split())
    assert max(len(line) for line in answer.out.splitlines() if not line.startswith("picture: ")) <= 80
    assert End.DIVERGED.advice.partition(";")[0] in (tmp_path / "c.svg").read_text()


def test_a_stored_scene_is_solved_by_who_failed_it_or_by_another(ask: Ask, scene_report: Path, tmp_path: Path) -> None:
    picture = tmp_path / "it.png"
    answer = ask(f"draw --case {CASE} --out", picture, scene_report)
    assert answer.status == 0
    assert list(ends(answer.out)) == ["vts-me"]
    assert float(ends(answer.out)["vts-me"][-1]) > 0.01
    assert picture.read_bytes().startswith(PNG)
    assert list(ends(ask(f"draw --case {CASE} -f vts-ppt", scene_report).out)) == ["vts-ppt"]


def test_a_stored_interface_is_drawn_as_replay_does(ask: Ask, tmp_path: Path) -> None:
    report = tmp_path / "plain.nc"
    write(run_with(named_case("c"), "nts"), report)
    words = f"{report} --case nts.patch.flat.transmission"
    files = {name: tmp_path / f"{name}.svg" for name in ("draw", "replay")}
    answer = ask(f"draw {words} --out", files["draw"])
    notice = "the report names the formulation nts, without options\n"
    assert (answer.status, answer.out, answer.err) == (0, f"picture: {files['draw']}\n", notice)
    ask(f"replay {words} --out", files["replay"])
    assert files["draw"].read_bytes() == files["replay"].read_bytes()
    assert "●─2─●─2─●───4───●───4───●" in ask(f"draw {words}").out
    refused = r"--out: found a.vtu for a case without bodies; needed a .png or .svg file"
    check_mistake(ask(f"draw {words} --out a.vtu"), refused)
    check_mistake(ask(f"draw {words} -f nts -f vts-g"), r"--formulation: found 2 of them; needed one, .*")


# ---------------------------------------------------------------------------------------------------------------------
# verify --scene


def test_verify_asks_on_a_scene(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    cases = []
    real = judging.judge_case

    def judge(question: Any, case: Any, subject: Any) -> Any:
        cases.append(case)
        return real(question, case, subject)

    monkeypatch.setattr(judging, "judge_case", judge)
    words = "verify vts-ppt --scene b:refine=2 -p patch.flat.transmission --examples 4 --seed 1"
    assert ask(words).status == 0
    interface = load_scene("b:refine=2").interface
    assert len(cases) == 4
    assert all(len(case.interface.slave) == len(interface.slave) == 8 for case in cases)


# ---------------------------------------------------------------------------------------------------------------------
# Bodies of the user: a mesh with cells, and a scene that a Python file makes


@pytest.fixture
def on_mesh(tmp_path: Path) -> str:
    return f"--mesh {write_curved_bodies(tmp_path / 'curved.msh')} --slave arc --master top"


def test_a_mesh_with_cells_is_a_scene_and_the_screen_says_what_is_not_asked(ask: Ask, on_mesh: str) -> None:
    families = "-p balance.force -p newton.units -p accuracy.* -p hard.* -p patch.flat.*"
    answer = ask(f"verify vts-ppt-balanced {on_mesh} --material base=1000,0.25 {families} {FEW}", columns=80)
    assert answer.status == 0, answer.err
    assert "contactverif: slave: 21 cells, E = 1, ν = 0.3, 8 nodes held, moved by (0, -0." in answer.err
    assert "contactverif: master: 36 cells, E = 1000, ν = 0.25, 13 nodes held\n" in answer.err
    assert "passes: balance 1 of 1, newton 1 of 1\n" in answer.out
    folded = " ".join(answer.out.split())
    assert re.search(r"not asked here, needs: meshes with a known answer: .* \d+ of hard", folded)
    assert "a straight slave over a parallel master that covers it: patch.flat." in folded
    assert all(len(line) <= 80 for line in answer.out.splitlines())


def test_a_mesh_of_which_no_scene_can_be_made_is_an_interface_and_the_reason_is_said(ask: Ask, tmp_path: Path) -> None:
    points = np.array([[0, 0.1, 0], [1, 0.1, 0], [2, 0, 0], [1, 0, 0], [-1, 0, 0]])
    lines = meshlane.Mesh(points, [("line", [[0, 1], [2, 3], [3, 4]])], cell_data={"side": [np.array([1, 2, 2])]})
    lines.write(tmp_path / "lines.vtu")  # Without cells.
    on_lines = f"--mesh {tmp_path / 'lines.vtu'} --slave side=1 --master side=2"
    answer = ask(f"verify vts-ppt {on_lines} -p units -p newton.units {FEW}")
    assert "contactverif: the interface alone is asked, no bodies are solved: " in answer.err
    assert "Asked on the interface alone; no bodies were solved.\n" in answer.out
    assert "  elastic bodies: newton.units\n" in answer.out


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--material bass=1,0.3", r"--material: found 'bass', which is no group of the file; needed 'base'\?.*"),
        ("--material base", r"--material: found 'base'; needed GROUP=E,ν such as base=1000,0\.3"),
        ("--support lid=1", r"--support: found 'lid=1'; needed GROUP=X,Y such as .*"),
        ("--scene c", r"--scene: found c and --mesh .*; needed one of the two"),
        ("--scene-file own.py:scene", r"--scene-file: found own.py:scene and --mesh .*; needed one of the two"),
    ],
)
def test_a_mistake_about_a_mesh_is_one_line(ask: Ask, on_mesh: str, options: str, message: str) -> None:
    check_mistake(ask(f"verify nts {on_mesh} {options}"), message)


def test_a_scene_of_a_file_is_judged_stored_and_replayed_without_the_file(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    file = Path("own.py")
    file.write_text("def scene():\n    return 3\n")
    message = r"--scene-file: found \S+, which gives no scene \(scene returns a int, no Scene\); needed .*"
    check_mistake(ask("verify nts --scene-file own.py:scene"), message)
    file.write_text('from contactverif import load_scene\n\n\ndef scene():\n    return load_scene("c")\n')
    words = f"vts-me --scene-file own.py:scene -p patch.flat.solve --out own.nc {FEW} --isolation process"
    answer = ask(f"verify {words}")
    assert answer.status == 0, answer.err
    with xarray.open_datatree("own.nc") as report:
        assert report.attrs["place"] == "--scene-file own.py:scene"
        assert re.fullmatch(r"[0-9a-f]{16}", report.attrs["code_of_scene_file"])
    (case,) = ask("replay own.nc").out.split()
    file.unlink()
    replayed = ask(f"replay own.nc --case {case} --isolation process")
    assert replayed.status == 1, replayed.err
    message = r"--scene-file: found own\.py, which does not exist; needed FILE\.py:FUNCTION, .*"
    check_mistake(ask("audit own.nc --scene-file own.py:scene"), message)


# ---------------------------------------------------------------------------------------------------------------------
# Scenes in a report


def odd() -> Case:
    """Numbers that no decimal holds, and an approach instead of a pressure."""
    third = 1 / 3
    return two_blocks(
        Rectangle([0, third, 1], [0, np.pi], young=third, poisson=0.1),
        Rectangle([0, 0.7, 1], [-np.e, 0], young=1e9 / 7, poisson=0.3),
        penalty=np.pi,
        approach=1e-3 / 7,
        placing=Placing((np.cos(1.0), np.sin(1.0)), (1e3, -third), 2.0**-40),
    ).case(seed=2**63 - 5)


CASES = {name: load_scene(name).case() for name in SCENES}
CASES |= {"free": load_scene("c:sides=free,lowered=0,degrees=33").case(), "odd": odd()}


@pytest.mark.parametrize("name", CASES)
def test_a_scene_comes_back_to_the_last_bit(name: str, tmp_path: Path) -> None:
    case, files = CASES[name], [tmp_path / "a.nc", tmp_path / "b.nc"]
    for file in files:
        write(run_with(case, "vts-me"), file)
    assert case_ids(files[0]) == [CASE]
    assert same_data(*files) == []
    again = read_case(files[0], CASE).case
    before, after = case.to_arrays(), again.to_arrays()
    assert list(before) == list(after)
    for key, values in before.items():
        assert values.shape == after[key].shape
        if values.dtype.kind != "U":
            assert (values.dtype, values.tobytes()) == (after[key].dtype, after[key].tobytes())
    assert has_bodies(again)
    for first, second in zip(scene_of(case).bodies, scene_of(again).bodies, strict=True):
        for key in ("nodes", "cells", "contact", "fixed", "imposed", "load", "axis", "start"):
            assert getattr(first, key).tobytes() == getattr(second, key).tobytes(), key
        assert (first.young, first.poisson, first.rigid) == (second.young, second.poisson, second.rigid)


@pytest.mark.parametrize("name", ["c", "odd"])
def test_every_number_of_a_scene_has_its_unit(name: str, tmp_path: Path) -> None:
    write(run_with(CASES[name], "vts-me"), tmp_path / "a.nc")
    with netCDF4.Dataset(tmp_path / "a.nc") as report:
        variables = report[f"counterexamples/{CASE}/case"].variables
        numbers = {key: value for key, value in variables.items() if value.dtype.kind != "S"}  # The others are words.
        units = {key.removeprefix("parameter_"): value.units for key, value in numbers.items()}
    assert "unknown" not in units.values()
    expected = {"bodies_nodes": "m", "bodies_load": "N", "bodies_young": "N m-1", "compliance": "m2 N-1"}
    expected |= {"penalty": "N m-2"} | ({"approach": "m"} if name == "odd" else {"pressure": "N m-1"})
    assert expected.items() <= units.items()


def test_a_stored_case_in_space_is_written_for_paraview(ask: Ask, tmp_path: Path) -> None:
    report, plane, picture = (tmp_path / name for name in ("report.nc", "plane.nc", "case.vtu"))
    words = f"-p patch.flat.transmission {FEW} --shrink none --out"
    assert ask(f"verify nts-3d {words}", report).status == 0
    for command, status in (("replay", 1), ("draw", 0)):
        answer = ask(f"{command} --case nts-3d.patch.flat.transmission.witness --out", picture, report)
        assert answer.status == status
        assert f"for ParaView: {picture}\n" in answer.out
        assert "exact_force" in meshlane.read(picture).point_data
    ask(f"verify nts {words}", plane)
    answer = ask("replay --case nts.patch.flat.transmission.witness --out", picture, plane)
    check_mistake(answer, r".*a case without bodies; needed a .png.*")
