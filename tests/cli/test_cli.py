"""The command line: what a user's mistake looks like, what a run prints and leaves behind, and what help costs."""

import os
import pty
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import meshio
import pytest
from asking import Answer, Ask, check_mistake, install_formulations, run_inline
from fresh_process import MAIN
from rich.cells import cell_len

from contactverif.cli import app as cli
from contactverif.plugins import registry
from contactverif.run import judge as judging
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import case_ids, read_case

ROOT = Path(__file__).parents[2]
PUNCH = ROOT / "tests" / "data" / "punch.msh"
ON_PUNCH = ("--mesh", str(PUNCH), "--slave", "punch", "--master", "base")
SVG = b"<?xml"
PNG = b"\x89PNG"


def environment(**more: str) -> dict[str, str]:
    unchanged = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "FORCE_COLOR")}
    return {**unchanged, "NO_COLOR": "1", "PYTHONWARNINGS": "error", **more}


def command(*arguments: str | Path) -> list[str]:
    return [*MAIN, *map(str, arguments)]


def rows(out: str) -> dict[tuple[str, str], list[str]]:
    """{(formulation, property): the other words of the row} of a table of verdicts."""
    cells: dict[tuple[str, str], list[str]] = {}
    table = out.split("\n\n")[1]
    formulation = ""
    for line in table.splitlines()[1:]:
        if not line.startswith(" "):
            formulation = line.strip()
        else:
            property_id, *words = line.split()
            cells[formulation, property_id] = words
    return cells


@pytest.fixture(scope="module")
def nts_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a report in which NTS fails the patch test."""
    path = tmp_path_factory.mktemp("reports") / "nts.nc"
    words = "verify nts -p patch.flat.transmission --seed 1 --examples 20 --shrink all --out"
    assert run_inline(*words.split(), path).status == 0
    return path


CASE = "nts.patch.flat.transmission"

# ---------------------------------------------------------------------------------------------------------------------
# Bad input


MISTAKES = [
    # argument, found, needed
    (["verify"], r"NAME: found nothing; needed --all, or some of c, chen-hisada, feap, fedoo, ipctk, mortar, .*"),
    (["verify", "vts-pt"], r"formulation: found 'vts-pt'; needed a name that exists; the nearest: vts-ppt.*"),
    (["verify", "vts-ppt", "-p", "scaling"], "property: found 'scaling'; needed 'units', the new id of that property"),
    (["verify", "nts-ar:area=now"], r"area: found 'now'; needed 'current' or 'reference'"),
    (["verify", "nts:tau=2"], r"tau: found 2; needed a number ≥ 0 and < 1"),
    (["verify", "nts", "nts"], r"formulation: found nts 2 times; needed each of them once"),
    (["verify", "nts", "--all"], r"NAME: found nts and --all; needed one of the two"),
    (["verify", "nts", "-p", "patch.*", "-p", "pach.*"], r"property: found 'pach.\*'; needed .*"),
    (["verify", "nts", "--known", "purity"], r"--known: found 'purity'; needed ID=REASON, .*"),
    (["verify", "nts", "--known", "=why"], r"--known: found '=why'; needed ID=REASON, .*"),
    (["verify", "nts", "--known", "puritty=why"], r"--known: found 'puritty'; needed .* nearest: purity, purity.long"),
    (["verify", "nts", "-p", "patch.*", "--known", "purity=why"], r"--known: found 'purity'; needed .*patch.flat.*"),
    (["verify", "nts", "--profile", "nigthly"], r"--profile: found 'nigthly'; needed .* nearest: nightly"),
    (["verify", "nts", "--examples", "0"], r"--examples: found 0; needed at least 1, at most 1000000000"),
    (["verify", "nts", "--examples", "ten"], r".*'--examples'.* integer.* \(see contactverif verify --help\)"),
    (["verify", "nts", "--seed", "-1"], r"--seed: found -1; needed a whole number ≥ 0 and < 2\^63"),
    (["verify", "nts", "--exampels", "5"], r"No such option: --exampels.*--examples.* \(see .*--help\)"),
    (["verfy"], r"No such command 'verfy'.* \(see contactverif --help\)"),
    (["verify", "nts", "--out", ""], r"--out: found '.'; needed a name that ends in .nc, .html, .json or .xml"),
    (["verify", "nts", "--out", "no/such/folder/nts.nc"], r"--out: .* is no folder; needed a folder that exists"),
    (["verify", "nts", "--out", "nts.txt"], r"--out: found 'nts.txt'; needed a name that ends in .nc, .*"),
    (["verify", "nts", "--out", "a.nc", "--out", "b.NC"], r"--out: found a.nc and b.NC; needed one file .* .nc"),
    (["verify", "nts", "--report", "nts.nc"], r"--report: found an option of an earlier version; needed --out.*"),
    (["verify", "nts", "--pictures", str(PUNCH)], r"--pictures: found .*punch.msh, which is no folder; needed .*"),
    (["verify", "nts", "--mesh", "no.msh", "--slave", "a", "--master", "b"], r"--mesh: found no.msh, .*; needed .*"),
    (["verify", "nts", "--mesh", str(PUNCH), "--slave", "punch"], r"--master: found nothing; needed --master TAG, .*"),
    (["verify", "nts", "--mesh", str(PUNCH), "--master", "base"], r"--slave: found nothing; needed --slave TAG, .*"),
    (["verify", "nts", *ON_PUNCH[:-1], "bace"], r"--master: found 'bace', which is no group .*; needed 'base'\?.*"),
    (["verify", "nts", *ON_PUNCH[:-1], "punch"], r"--master: found 'punch', which is the slave too; needed .*"),
    (["verify", "nts", "--slave", "punch"], r"--mesh: found none, but --slave; needed --mesh FILE, .*"),
    (["verify", "nts", "--master", "base"], r"--mesh: found none, but --master; needed --mesh FILE, .*"),
    (["verify", "nts", "--flip"], r"--mesh: found none, but --flip; needed --mesh FILE, .*"),
    (["verify", "nts", "--material", "base=1,0.3"], r"--mesh: found none, but --material; needed --mesh FILE, .*"),
    (["verify", "nts", "--support", "lid=0,0"], r"--mesh: found none, but --support; needed --mesh FILE, .*"),
    (["compare", "c", "--against", "nts", "--against", "vts-me"], "--against: found 2: nts, vts-me; needed one"),
    (["paper", "--out", ""], "--out: found ''; needed the name of a folder"),
    (["replay"], r"Missing argument 'REPORT'.* \(see contactverif replay --help\)"),
    (["replay", "no.nc"], r"REPORT: found no.nc, which does not exist; needed a report .*"),
    (["replay", str(PUNCH)], r"REPORT: found .*punch.msh, which is no netCDF file.*; needed a report that .*"),
    (["replay", str(ROOT)], r"REPORT: found .*, which is a folder; needed a report .*"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("arguments", "message"), MISTAKES, ids=[" ".join(map(str, arguments))[:60] for arguments, _ in MISTAKES]
)
def test_a_mistake_is_one_line_and_nothing_is_judged(
    ask: Ask, monkeypatch: pytest.MonkeyPatch, arguments: Sequence[str], message: str
) -> None:
    judged: list[Any] = []
    monkeypatch.setattr(judging, "judge_case", lambda *anything: judged.append(anything))
    answer = ask(*arguments)
    check_mistake(answer, message)
    assert not judged


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--case", "nts.patch.flat"], rf"--case: found 'nts.patch.flat'; needed an id like {CASE}"),
        (["--case", CASE, "--formulation", "vts-pt"], "formulation: found 'vts-pt'; needed .* nearest: vts-ppt.*"),
        (["--case", CASE, "--out", "nts.xyz"], "--out: found 'nts.xyz'; needed a .* .png, .svg or .vtu"),
        (["--case", CASE, "--out", "no/such/a.png"], "--out: found .* is no folder; needed a folder that exists"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_replay_is_one_line(ask: Ask, nts_report: Path, options: Sequence[str], message: str) -> None:
    answer = ask("replay", nts_report, *options)
    check_mistake(answer, message)


def test_a_mesh_that_does_not_face_itself_is_refused_and_flip_turns_it(ask: Ask, tmp_path: Path) -> None:
    """Without cells nobody knows on which side the base lies; --flip says that it is the other one."""
    mesh = meshio.read(PUNCH)
    number = int(mesh.field_data["base"][0])
    numbers = [index for index, block in enumerate(mesh.cells) if block.type in ("line", "triangle")]
    tags = [mesh.cell_data["gmsh:physical"][index] for index in numbers]
    blocks = []
    for index, tag in zip(numbers, tags, strict=True):
        block = mesh.cells[index]
        turned = (block.type == "line") & (tag == number)
        blocks.append((block.type, block.data[:, ::-1] if turned.all() else block.data))
    answers = {}
    for name, cell_blocks in (
        ("as.msh", [(mesh.cells[i].type, mesh.cells[i].data) for i in numbers]),
        ("turned.msh", blocks),
    ):
        data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
        meshio.write(
            tmp_path / name,
            meshio.Mesh(mesh.points, cell_blocks, cell_data=data, field_data=mesh.field_data),
            file_format="gmsh22",
            binary=False,
        )
        options = ("--mesh", tmp_path / name, *ON_PUNCH[2:], "-p", "balance.force", "--examples", "2", "--seed", "1")
        for flip in ((), ("--flip",)):
            answers[name, flip] = ask("verify", "nts", *options, *flip)
    statuses = sorted(answer.status for answer in answers.values())
    assert statuses == [0, 0, 2, 2]
    for name in ("as.msh", "turned.msh"):
        assert {answers[name, ()].status, answers[name, ("--flip",)].status} == {0, 2}
    for answer in answers.values():
        if answer.status == 2:
            assert re.fullmatch(
                r"contactverif: --mesh: found mean normals .* do not oppose each other; .*\n", answer.err
            )
            assert "--flip" in answer.err
            assert not answer.out


# ---------------------------------------------------------------------------------------------------------------------
# Plugins that are not what they should be


class Broken:
    """Breaks every promise that it makes."""

    def __init__(self, fault: str) -> None:
        self.fault = fault

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        if self.fault == "raises":
            raise KeyError("[/bold] is no markup")
        return z * float("nan")


def raises(*, penalty: float) -> Broken:
    return Broken("raises")


def gives_nan(*, penalty: float) -> Broken:
    return Broken("nan")


def without_licence(*, penalty: float) -> Broken:
    raise RuntimeError("no licence [red] left")


@pytest.fixture
def strangers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four more formulations: two that do not load, one that raises, one that returns NaN."""
    monkeypatch.setitem(sys.modules, __name__, sys.modules[__name__])
    factories = {"unlicensed": without_licence, "raising": raises, "nan": gives_nan}
    places = {name: f"{__name__}:{make.__name__}" for name, make in factories.items()}
    install_formulations(monkeypatch, absent="no_such_module:make", **places)


@pytest.mark.usefixtures("strangers")
def test_a_plugin_that_does_not_load_is_a_row_and_the_others_run(ask: Ask) -> None:
    answer = ask("verify", "absent", "unlicensed", "nts", "-p", "purity", "--examples", "3", "--seed", "1", "-v")
    assert answer.status == 1
    assert "absent\n      not loaded: ModuleNotFoundError: No module named 'no_such_module'\n" in answer.out
    assert "unlicensed\n      not loaded: make: RuntimeError: no licence [red] left (test_cli.py, line " in answer.out
    assert rows(answer.out)["nts", "purity"][:3] == ["passes", "pass", "3/3"]
    assert answer.out.endswith("2 plugins not loaded: absent; unlicensed.\n")
    assert not answer.err


@pytest.mark.usefixtures("strangers")
def test_a_plugin_that_raises_or_returns_nan_is_an_outcome(ask: Ask, tmp_path: Path) -> None:
    report = tmp_path / "r.nc"
    options = ("-p", "balance.force", "--examples", "3", "--seed", "1", "--out", report, "-v", "--keep-going")
    answer = ask("verify", "raising", "nan", "nts", *options)
    assert answer.status == 1
    assert rows(answer.out)["raising", "balance.force"][1] == "crashed"
    assert rows(answer.out)["nan", "balance.force"][1:3] == ["BROKEN", "PROMISE"]
    assert rows(answer.out)["nts", "balance.force"][1] == "pass"
    assert "exception: residual: KeyError: '[/bold] is no markup'" in answer.out
    assert "not finite: residual: nan in" in answer.out
    again = ask("replay", report, "--case", "raising.balance.force")
    assert again.status == 1
    assert "crashed" in again.out


@pytest.mark.usefixtures("strangers")
def test_a_case_is_replayed_with_what_cannot_be_asked(ask: Ask, tmp_path: Path) -> None:
    report = tmp_path / "r.nc"
    options = ("-p", "tangent.directional", "--examples", "12", "--seed", "1", "--shrink", "all", "--out", report)
    assert ask("verify", "vts-ppt-basic", *options).status == 0
    answer = ask("replay", report, "--case", "vts-ppt-basic.tangent.directional", "--formulation", "nan")
    assert answer.status == 0
    assert "not provided" in answer.out


@pytest.mark.usefixtures("strangers")
def test_the_list_has_what_does_not_load_too(ask: Ask) -> None:
    answer = ask("list")
    assert answer.status == 0
    assert re.search(r"absent +not loaded: ModuleNotFoundError", answer.out)
    assert re.search(r"raising +2-D +nothing; not provided: pair, tangent, contact_points", answer.out)


# ---------------------------------------------------------------------------------------------------------------------
# What a run prints


def test_verify_says_what_was_asked_and_how_it_came_out(ask: Ask) -> None:
    options = ("-p", "balance.*", "-p", "purity", "--examples", "7", "--seed", "1", "-v")
    answer = ask("verify", "vts-ppt-balanced", *options)
    assert answer.status == 0
    assert not answer.err
    assert answer.out.startswith("profile dev: 7 random cases for each property, seed 1\n")
    assert set(rows(answer.out)) == {
        ("vts-ppt-balanced", property_id) for property_id in ("balance.force", "balance.moment", "purity")
    }
    assert answer.out.splitlines()[-2:] == [
        "Every promise is kept and every property was judged.",
        "Properties promised to pass: 3, to fail: 0, neither: 0.",
    ]
    promise, verdict, judged, _, worst, sign, tolerance = rows(answer.out)["vts-ppt-balanced", "balance.force"]
    assert (promise, verdict, judged, sign) == ("passes", "pass", "7/7", "≤")
    assert 0 <= float(worst) <= float(tolerance) < 1e-6


def test_what_fails_as_promised_is_drawn_and_the_run_passes(ask: Ask) -> None:
    answer = ask("verify", "nts", "vts-ppt", "-p", "patch.*", "--examples", "10", "--seed", "1", "-v")
    assert answer.status == 0
    promise, fails, as_, stated, judged, _, closest, _, tolerance = rows(answer.out)["nts", "patch.flat.transmission"]
    assert (promise, fails, as_, stated, judged) == ("fails", "fails", "as", "stated", "10/10")
    assert float(closest) > float(tolerance)
    assert rows(answer.out)["vts-ppt", "patch.flat.transmission"][:3] == ["passes", "pass", "10/10"]
    first_lines = (
        "nts, patch.flat.transmission: fails as stated, its witness, the case a1\n    slave node 0 (free end): force "
    )
    assert first_lines in answer.out
    assert "\n    ✗ error of a nodal force: " in answer.out
    options = ("--examples", "10", "--seed", "1", "--shrink", "all", "--show", "all")
    shrunk = ask("verify", "nts", "-p", "patch.flat.transmission", *options)
    assert first_lines.replace("its witness, the case a1", "the smallest case found") in shrunk.out
    assert "●──" in answer.out


def test_a_known_failure_that_passes_fails_the_run(ask: Ask) -> None:
    answer = ask("verify", "nts", "-p", "purity", "--known", "purity=issue 12", "--examples", "3", "--seed", "1")
    assert answer.status == 1
    assert "BROKEN PROMISE" in answer.out
    assert "listed as a known failure, but passes; known: issue 12" in answer.out
    assert answer.out.endswith("1 broken promise: nts purity (listed as a known failure, but passes).\n")


def test_all_is_every_installed_formulation(ask: Ask) -> None:
    answer = ask("verify", "--all", "-p", "purity", "--examples", "1", "--seed", "1", "-v")
    assert answer.status == 0
    assert {formulation for formulation, _ in rows(answer.out)} == set(registry.standalone_names())


def test_a_mesh_of_the_user_is_judged(ask: Ask) -> None:
    answer = ask("verify", "vts-ppt-balanced", *ON_PUNCH, "--examples", "5", "--seed", "1", "-v")
    assert answer.status == 0, answer.out
    assert {property_id for _, property_id in rows(answer.out)} == set(registry.property_ids())
    verdicts = {words[1] for words in rows(answer.out).values()}
    assert "pass" in verdicts
    assert verdicts <= {"pass", "not", "fails"}  # not applicable, fails as stated


def test_the_table_lines_up_at_any_width(ask: Ask, tmp_path: Path) -> None:
    globs = [word for glob in ("patch.flat.[tr]*", "hard.n*", "symm*", "swap", "balance.*") for word in ("-p", glob)]
    sampling = ("--examples", "3", "--seed", "1", "--out", tmp_path / "a.nc", "-v")
    check_table(ask("verify", "nts-ar", "vts-ppt-balanced", *globs, *sampling, columns=80), 80)
    for columns in (100, 140):
        check_table(ask("report", tmp_path / "a.nc", "-v", columns=columns), columns)


def check_table(answer: Answer, columns: int) -> None:
    """Check that the columns of a table of a run are where its head says, and that it fits the terminal."""
    table = (
        next(part for part in answer.out.split("\n\n") if re.search("closest +tolerance", part))
        .strip("\n")
        .splitlines()
    )
    assert max(map(len, table)) <= columns
    head, *lines = table
    result, tolerance = head.index("result"), head.index("tolerance") + len("tolerance")
    for line in lines:
        if re.match(r" {1,2}\S", line) and "not applicable" not in line:
            assert line[result : result + 15].rstrip() in ("pass", "fail", "fails as stated")
            assert line[:tolerance].rstrip() == line[:tolerance]
            assert re.search(r"[≤≥] \S+$", line[:tolerance])
            assert line[tolerance : tolerance + 2].strip() == ""


@pytest.mark.parametrize("columns", [80, 140])
def test_lists_fit_the_terminal_and_lose_nothing(ask: Ask, columns: int) -> None:
    for arguments in (["list"], ["list", "--traits"]):
        answer = ask(*arguments, columns=columns)
        assert answer.status == 0
        assert max(map(cell_len, answer.out.splitlines())) <= columns  # ε̂ is two characters in one column.
        assert "…" not in answer.out
        for name in (*registry.formulation_names(), *registry.property_ids(), *registry.load_problems()):
            assert re.search(rf"^ *{re.escape(name)} ", answer.out, re.M)
    assert "balance.force fails on tilted" in " ".join(answer.out.split())


def test_a_line_to_be_copied_is_never_folded(ask: Ask, tmp_path: Path) -> None:
    folder = tmp_path / "a folder with a name that is far too long for a line of a narrow terminal, as names are"
    folder.mkdir()
    options = ("-p", "patch.flat.transmission", "--examples", "5", "--seed", "1", "--show", "all")
    answer = ask("verify", "nts", *options, "--out", folder / "r.nc", columns=80)
    assert f"    contactverif replay '{folder / 'r.nc'}' --case {CASE}.witness\n" in answer.out


def test_a_remark_that_is_too_long_stands_below_its_line(ask: Ask) -> None:
    patch = "patch.flat.transmission"
    options = ("-p", patch, "--examples", "5", "--seed", "1", "--known", f"{patch}=" + "long " * 30, "-v")
    answer = ask("verify", "nts", *options, columns=80)
    assert answer.status == 0
    lines = answer.out.splitlines()
    (row,) = (number for number, line in enumerate(lines) if line.lstrip().startswith("patch.flat"))
    assert lines[row + 1].startswith("      known: long long")
    assert max(map(len, lines[row : row + 4])) <= 80


def test_the_bar_is_for_a_terminal_and_leaves_a_pipe_alone() -> None:
    """Standard error is a terminal, standard output a pipe: the bar is there, and the table has no trace of it."""
    arguments = command("verify", "nts", "-p", "purity", "--examples", "40", "--seed", "1")
    ours, theirs = pty.openpty()
    shown_bytes = bytearray()
    try:
        variables = environment(TERM="xterm")
        with subprocess.Popen(arguments, env=variables, stdout=subprocess.PIPE, stderr=theirs, text=True) as running:
            os.close(theirs)
            while True:
                try:
                    piece = os.read(ours, 4096)
                except OSError:  # the other end is closed
                    break
                if not piece:
                    break
                shown_bytes += piece
            assert running.stdout is not None
            out = running.stdout.read()
    finally:
        os.close(ours)
    alone = subprocess.run(arguments, env=environment(), capture_output=True, text=True, check=True)
    assert b"nts purity: judging" in shown_bytes
    assert out == alone.stdout
    assert "\x1b" not in out
    assert "\r" not in out
    # A slow machine has a line now and then.
    assert alone.stderr.splitlines()[-1] == "nts purity: pass, 40/40 judged"


# ---------------------------------------------------------------------------------------------------------------------
# What a run leaves behind


def test_replay_gives_the_same_verdict_and_the_drawing(ask: Ask, nts_report: Path) -> None:
    assert ask("replay", nts_report) == Answer(0, f"{CASE}\n", "")
    answer = ask("replay", nts_report, "--case", CASE)
    assert answer.status == 1
    stored = read_case(nts_report, CASE)
    lines = [line.rstrip().split(maxsplit=3) for line in answer.out.splitlines()]
    assert ["stored", "nts", "fail", stored.reason] in lines
    assert ["now", "nts", "fail", stored.reason] in lines
    assert "●──" in answer.out
    assert "o──" in answer.out


@pytest.mark.parametrize(("suffix", "begins"), [("png", PNG), ("svg", SVG)])
def test_replay_draws_a_picture(ask: Ask, nts_report: Path, tmp_path: Path, suffix: str, begins: bytes) -> None:
    picture = tmp_path / f"nts.{suffix}"
    answer = ask("replay", nts_report, "--case", CASE, "--out", picture)
    assert answer.status == 1
    assert answer.out.endswith(f"picture: {picture}\n")
    assert picture.read_bytes().startswith(begins)


def test_replay_clears_another_formulation(ask: Ask, nts_report: Path) -> None:
    answer = ask("replay", nts_report, "--case", CASE, "--formulation", "vts-ppt")
    assert answer.status == 0
    assert ["now", "vts-ppt", "pass"] in [line.split() for line in answer.out.splitlines()]


def test_verify_draws_each_counterexample_into_a_folder(ask: Ask, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "pictures"
    options = ("-p", "patch.flat.transmission", "--examples", "5", "--seed", "1", "--pictures", folder)
    answer = ask("verify", "nts", "vts-ppt", *options)
    assert answer.status == 0
    assert [path.name for path in folder.iterdir()] == [f"{CASE}.png"]
    assert f"pictures: {folder}\n" in answer.out


def test_the_same_seed_gives_the_same_report(tmp_path: Path) -> None:
    """In two processes with other hashes, from other folders; and another seed gives another."""
    reports = {}
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        (tmp_path / name).mkdir()
        reports[name] = tmp_path / name / "r.nc"
        words = f"verify nts -p patch.flat.* -p p[ru]* --seed {seed} --examples 8 --out"
        arguments = [*words.split(), reports[name]]
        if name == "a":
            variables = environment(PYTHONHASHSEED="1")
            subprocess.run(command(*arguments), cwd=tmp_path / name, env=variables, capture_output=True, check=True)
        else:
            assert run_inline(*arguments).status == 0
    assert same_data(reports["a"], reports["b"]) == []
    assert any("/patch" in difference for difference in same_data(reports["a"], reports["c"]))
    assert case_ids(reports["a"])


SLOW = """
import pathlib, time

class Slow:
    def residual(self, interface, pairing, z):
        pathlib.Path("judging").touch()
        time.sleep(60)
        return 0 * z

def make(*, penalty):
    return Slow()
"""


@pytest.fixture
def slow_plugin(tmp_path: Path) -> Path:
    """Return a folder for PYTHONPATH with a formulation `slow`, which makes a file when it is judged."""
    folder = tmp_path / "plugins"
    about = folder / "slow-1.0.dist-info"
    about.mkdir(parents=True)
    (folder / "slow_plugin.py").write_text(SLOW)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: slow\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[contactverif.formulations]\nslow = slow_plugin:make\n")
    return folder


@pytest.fixture
def running(slow_plugin: Path, tmp_path: Path, nts_report: Path) -> Iterator[subprocess.Popen[str]]:
    """`verify slow --out r.nc` over a report that is there already, in the middle of its first case."""
    folder = tmp_path / "here"
    folder.mkdir()
    shutil.copy(nts_report, folder / "r.nc")
    arguments = command("verify", "slow", "-p", "purity", "--examples", "3", "--seed", "1", "--out", "r.nc")
    variables = environment(PYTHONPATH=str(slow_plugin))
    with subprocess.Popen(
        arguments, cwd=folder, env=variables, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            deadline = time.monotonic() + 60
            while not (folder / "judging").exists():
                assert process.poll() is None, process.communicate()
                assert time.monotonic() < deadline
                time.sleep(0.02)
            yield process
        finally:
            process.kill()


def left_behind(folder: Path, report: Path) -> None:
    """Check that the earlier report is there, but not under the name of this one."""
    assert sorted(path.name for path in folder.iterdir()) == ["judging", "r.nc.journal"]
    assert (folder / "r.nc.journal" / "earlier.nc").read_bytes() == report.read_bytes()


def test_a_killed_run_keeps_the_report_that_was_there_apart(
    running: subprocess.Popen[str], tmp_path: Path, nts_report: Path
) -> None:
    running.send_signal(signal.SIGKILL)
    assert running.wait(30) == -signal.SIGKILL
    left_behind(tmp_path / "here", nts_report)


def test_a_stopped_run_says_so(running: subprocess.Popen[str], tmp_path: Path, nts_report: Path) -> None:
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=30)
    assert (running.returncode, err) == (130, "contactverif: stopped\n")
    assert "stopped: 0 of 3 cases judged" in out
    assert out.endswith("what was judged is kept; to go on: contactverif verify --resume r.nc\n")
    left_behind(tmp_path / "here", nts_report)


# ---------------------------------------------------------------------------------------------------------------------
# Help

PAGES = [[], *([name] for name in cli.COMMANDS)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: " ".join(page) or "contactverif")
def test_help_teaches_and_fits_the_terminal(ask: Ask, page: list[str]) -> None:
    answer = ask(*page, "--help", columns=80)
    assert (answer.status, answer.err) == (0, "")
    assert max(map(len, answer.out.splitlines())) <= 80
    assert "\b" not in answer.out
    assert f"Usage: contactverif {' '.join(page)}".rstrip() in answer.out
    if page in (["verify"], ["replay"], ["draw"]):
        example = f"contactverif {page[0]}"
        examples = answer.out.partition("Examples\n" if "Examples\n" in answer.out else "Examples ")[2]
        lines = [line for line in examples.splitlines() if example in line]
        assert len(lines) >= 3
        assert len({line.index(example) for line in lines}) == 1  # they line up, each on a line of its own


@pytest.mark.parametrize(
    "line", [line.strip() for name in ("verify", "report", "replay", "draw", "scenes")
             for line in (cli.COMMANDS[name].__doc__ or "").splitlines() if line.strip().startswith("contactverif ")],
)  # fmt: skip
def test_the_examples_of_the_help_parse(ask: Ask, line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each gets as far as to a file or a formulation that is not there, or runs."""
    monkeypatch.chdir(tmp_path)
    words = shlex.split(line)[1:]
    if words[0] == "verify":
        words += ["--examples", "1", "-p", "purity"]
    answer = ask(*words)
    assert "--help" not in answer.err
    assert answer.status == 0 or re.search(r"(ppt.nc|punch.msh|'mine')", answer.err)


def test_without_arguments_there_is_help(ask: Ask) -> None:
    answer = ask()
    assert answer.status == 2
    assert "verify" in answer.out + answer.err
    assert "contactverif: \n" not in answer.err
