"""The commands that know scenes: `scenes`, `draw`, and `verify --scene`."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from asking import Ask, check_mistake
from handmade_run import run_with
from subjects import Changed, load_subject

from contactverif import End, Subject, named_case
from contactverif.cli import scenes
from contactverif.cli.scenes import MEANINGS
from contactverif.contract.result import NotLoaded
from contactverif.problems.catalogue import OPTIONS, SCENES, NamedBlocks, load_scene
from contactverif.run import judge as judging
from contactverif.studies import solved_scenes as pictures
from contactverif_reports.netcdf.write import write

FIG_30 = "c:penalty=1e4,sides=free,lowered=0,ratio=0.5"
SVG, PNG = b"<?xml", b"\x89PNG"


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

DRAW_C = ["draw", "--scene", "c", "-f", "vts-ppt"]
MISTAKES = [
    (["draw"], r"--scene: found nothing to draw; needed --scene NAME, or REPORT --case ID"),
    (["draw", "file"], r"--case: found nothing; needed --case ID; `contactverif replay file` lists the ids"),
    (["draw", "hertz"], r"REPORT: found hertz, which does not exist; needed a report .*, or --scene NAME"),
    (["draw", "--case", "a.b"], r"REPORT: found none, but --case a.b; needed the report that holds the case"),
    (["draw", "r.nc", "--case", "a.b"], r"REPORT: found r.nc, which does not exist; needed a report .*"),
    (["draw", "r.nc", "--case", "a.b", "--scene", "c"], r"--scene: found c and --case a.b; needed one of the two"),
    (["draw", "r.nc", "--scene", "c", "-f", "nts"], r"--scene: found c and REPORT r.nc; needed one of the two"),
    (["draw", "--scene", "c"], r"--formulation: found nothing; needed some of .*nts, .*vts-ppt.*"),
    (["draw", "--scene", "cc", "-f", "nts"], r"--scene: found 'cc'; needed a name that exists; the nearest: .*"),
    (["draw", "--scene", "c:refien=2", "-f", "nts"], r"--scene: option of .*: found 'refien'; needed .* refine.*"),
    (["draw", "--scene", "c:sides=up", "-f", "nts"], r"--scene: sides of .*: found 'up'; needed rollers or free"),
    (["draw", "--scene", "c", "-f", "nst"], r"formulation: found 'nst'; needed .* nearest: .*nts.*"),
    (["draw", "--scene", "c", "-f", "nts", "-f", "nts"], r"--formulation: found nts twice; needed each .* once"),
    ([*DRAW_C, "--out", "c.pdf"], r"--out: found 'c.pdf'; needed a name that ends in .png, .svg or .vtu"),
    ([*DRAW_C, "--out", "no/c.png"], r"--out: found no/c.png in .*, which is no folder; needed a folder that exists"),
    ([*DRAW_C, "--out", "file/c.png"], r"--out: found file/c.png in .*, which is no folder; needed .*"),
    ([*DRAW_C, "--out", "a.svg", "--out", "b.svg"], r"--out: found a.svg and b.svg; needed one file that ends in .svg"),
    ([*DRAW_C, "--vtu", "c.vtu"], r"--vtu: found an option of an earlier version; needed --out FILE, .*"),
    ([*DRAW_C, "--out", "no/c.vtu"], r"--out: found no/c.vtu in .*, which is no folder; needed a folder that exists"),
    ([*DRAW_C, "-f", "nts", "--out", "c.vtu"], r"--out: found c.vtu for 2 formulations; needed one --formulation: .*"),
    (["verify", "nts", "--scene", "c", "--mesh", "m.msh"], r"--scene: found c and --mesh m.msh; needed one of the two"),
    (["verify", "nts", "--scene", "d"], r"--scene: found 'd'; needed one of a1, .*"),
    (["verify", "nts", "--scene", "c:young=0"], r"--scene: young of .*: found 0; needed a number > 0"),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "message"), MISTAKES, ids=[" ".join(arguments) for arguments, _ in MISTAKES])
def test_a_mistake_is_one_line_and_nothing_is_solved(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: Sequence[str], message: str
) -> None:
    def never(*anything: Any, **more: Any) -> Any:
        raise AssertionError("solved or judged")

    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(pictures, "solve", never)
    monkeypatch.setattr(judging, "judge_case", never)
    answer = ask(*arguments)
    check_mistake(answer, message)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(("suffix", "begins", "columns"), [("png", PNG, 80), ("svg", SVG, 140)])
def test_fig_30_of_the_paper(ask: Ask, tmp_path: Path, suffix: str, begins: bytes, columns: int) -> None:
    names = ["vts-me", "vts-ppt-basic", "vts-ppt"]
    options = [word for name in names for word in ("--formulation", name)]
    picture = tmp_path / f"fig30.{suffix}"
    answer = ask("draw", "--scene", FIG_30, *options, "--out", picture, columns=columns)
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
    answer = ask("draw", "--scene", "c", "-f", "nts", "-f", "vts-ppt")
    assert answer.status == 0
    rows = ends(answer.out)
    assert float(rows["nts"][-1]) > 0.01
    assert float(rows["vts-ppt"][-1]) < 1e-9
    assert "●─2─●─2─●───4───●───4───●" in answer.out  # no file was asked for


def test_draw_writes_for_paraview(ask: Ask, tmp_path: Path) -> None:
    answer = ask(*DRAW_C, "--out", tmp_path / "c.vtu", "--out", tmp_path / "c.svg")
    assert answer.status == 0
    assert answer.out.endswith(f"picture: {tmp_path / 'c.svg'}\nfor ParaView: {tmp_path / 'c.vtu'}\n")
    mesh, scene = meshio.read(tmp_path / "c.vtu"), load_scene("c")
    assert len(mesh.points) == sum(len(body.nodes) for body in scene.bodies)
    assert mesh.cell_data["pressure"][0] == pytest.approx(100.0)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c.svg", "c.vtu"]


def test_a_formulation_that_cannot_be_asked_is_a_line(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = scenes.load_formulation

    def load(name: str, limits: Any) -> Any:
        return NotLoaded(name, "no licence") if name == "nts" else real(name, limits)

    monkeypatch.setattr(scenes, "load_formulation", load)
    answer = ask("draw", "--scene", "c", "-f", "nts", "-f", "vts-ppt", "--out", tmp_path / "c.png")
    assert (answer.status, answer.err) == (1, "")
    assert "\nnts: not loaded: no licence\n" in answer.out
    assert list(ends(answer.out)) == ["vts-ppt"]
    assert (tmp_path / "c.png").is_file()
    answer = ask("draw", "--scene", "c", "-f", "nts", "--out", tmp_path / "none.png")
    assert answer.status == 1
    assert answer.out.endswith("nts: not loaded: no licence\n")
    assert not (tmp_path / "none.png").exists()


def test_draw_says_what_to_try_where_newtons_method_diverges(
    ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plugin = load_subject("vts-ppt").with_penalty(1e4).plugin
    plugin = Changed(plugin, tangent=lambda *state: -1e4 * np.eye(state[-1].size))
    diverging = Subject("mine", lambda *, penalty: plugin)
    monkeypatch.setattr(scenes, "load_formulation", lambda name, limits: diverging)
    answer = ask("draw", "--scene", "c", "-f", "mine", "--out", tmp_path / "c.svg", columns=80)
    assert answer.status == 0
    assert "diverged" in answer.out
    assert f"mine: {End.DIVERGED.advice}" in " ".join(answer.out.split())
    assert max(len(line) for line in answer.out.splitlines() if not line.startswith("picture: ")) <= 80
    assert "mine: " + End.DIVERGED.advice in (tmp_path / "c.svg").read_text()


def test_a_stored_scene_is_solved_by_who_failed_it_or_by_another(ask: Ask, scene_report: Path, tmp_path: Path) -> None:
    picture = tmp_path / "it.png"
    answer = ask("draw", scene_report, "--case", CASE, "--out", picture)
    assert answer.status == 0
    assert list(ends(answer.out)) == ["vts-me"]
    assert float(ends(answer.out)["vts-me"][-1]) > 0.01
    assert picture.read_bytes().startswith(PNG)
    answer = ask("draw", scene_report, "--case", CASE, "-f", "vts-ppt")
    assert list(ends(answer.out)) == ["vts-ppt"]


def test_a_stored_interface_is_drawn_as_replay_does(ask: Ask, tmp_path: Path) -> None:
    report = tmp_path / "plain.nc"
    write(run_with(named_case("c"), "nts"), report)
    case_id = "nts.patch.flat.transmission"
    files = {name: tmp_path / f"{name}.svg" for name in ("draw", "replay")}
    answer = ask("draw", report, "--case", case_id, "--out", files["draw"])
    notice = "the report names the formulation nts, without options\n"
    assert (answer.status, answer.out, answer.err) == (0, f"picture: {files['draw']}\n", notice)
    ask("replay", report, "--case", case_id, "--out", files["replay"])
    assert files["draw"].read_bytes() == files["replay"].read_bytes()
    assert "●─2─●─2─●───4───●───4───●" in ask("draw", report, "--case", case_id).out
    for options, message in (
        (["--out", tmp_path / "a.vtu"], r"--out: found .*a.vtu for a case without bodies; needed a .png or .svg file"),
        (["-f", "nts", "-f", "vts-g"], r"--formulation: found 2 of them; needed one, .*"),
    ):
        answer = ask("draw", report, "--case", case_id, *options)
        assert (answer.status, answer.out) == (2, "")
        assert re.fullmatch(f"contactverif: {message}\n", answer.err)


# ---------------------------------------------------------------------------------------------------------------------
# verify --scene


def test_verify_asks_on_a_scene(ask: Ask, monkeypatch: pytest.MonkeyPatch) -> None:
    cases = []
    real = judging.judge_case

    def judge(question: Any, case: Any, subject: Any) -> Any:
        cases.append(case)
        return real(question, case, subject)

    monkeypatch.setattr(judging, "judge_case", judge)
    options = ("-p", "patch.flat.transmission", "--examples", "4", "--seed", "1")
    assert ask("verify", "vts-ppt", "--scene", "b:refine=2", *options).status == 0
    interface = load_scene("b:refine=2").interface
    assert len(cases) == 4
    assert all(len(case.interface.slave) == len(interface.slave) == 8 for case in cases)
