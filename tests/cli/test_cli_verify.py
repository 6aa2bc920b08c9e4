"""The command `verify`: its few lines or its table, pictures, what a run that is killed leaves, and the memory."""

import os
import pty
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from asking import Answer, Ask, check_mistake, install_formulations, run_inline
from fresh_process import MAIN
from rich.cells import cell_len
from subjects import Changed, ResidualAlone, load_property

from contactverif import Measurement, Outcome, Row, Run, Traits, Verdict, named_case
from contactverif.cli import progress
from contactverif.cli.run_screen import run_screen, summary
from contactverif.plugins import registry
from contactverif.run.ranking import by_rank
from contactverif.run.scheduler import Progress
from contactverif_nts import nts_ar, vts_ppt
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import case_ids, read_case

PUNCH = Path(__file__).parents[1] / "data" / "punch.msh"
ON_PUNCH = f"--mesh {PUNCH} --slave punch --master base"
TRANSMISSION = "patch.flat.transmission"
CASE = f"nts.{TRANSMISSION}"


def environment(**more: str) -> dict[str, str]:
    unchanged = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "FORCE_COLOR")}
    return {**unchanged, "NO_COLOR": "1", "PYTHONWARNINGS": "error", **more}


def command(line: str) -> list[str]:
    return [*MAIN, *line.split()]


def rows(out: str) -> dict[tuple[str, str], list[str]]:
    """{(formulation, property): the other words of the row} of a table of verdicts."""
    cells: dict[tuple[str, str], list[str]] = {}
    formulation = ""
    for line in out.split("\n\n")[1].splitlines()[1:]:
        if not line.startswith(" "):
            formulation = line.strip()
        elif line[2] != " ":  # Else it is the reason of the row above.
            property_id, *words = line.split()
            cells[formulation, property_id] = words
    return cells


@pytest.fixture(scope="module")
def nts_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a report in which NTS fails the patch test."""
    path = tmp_path_factory.mktemp("reports") / "nts.nc"
    words = f"verify nts -p {TRANSMISSION} --seed 1 --examples 20 --shrink all --out"
    assert run_inline(words, path).status == 0
    return path


# ---------------------------------------------------------------------------------------------------------------------
# Plugins that are not what they should be


class Broken:
    """Raises an error, or returns NaN."""

    def __init__(self, error: Exception | None = None) -> None:
        self.error = error

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        if self.error is not None:
            raise self.error
        return z * float("nan")


class HalfEnds(ResidualAlone):
    """Springs that promise an exact patch, with half of the force at the first slave node."""

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = super().residual(interface, pairing, z)
        forces[:2] /= 2
        return forces


class Remembering(ResidualAlone):
    """Springs that grow with every call."""

    calls = 0

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        self.calls += 1
        return super().residual(interface, pairing, z) * (1 + self.calls / 1024)


def without_licence(*, penalty: float) -> Broken:
    raise RuntimeError("no licence [red] left")


def silent(penalty: float) -> Any:
    """Return springs that promise nothing."""
    return Changed(ResidualAlone(nts_ar(penalty=penalty)), traits=Traits())


FACTOR = {"now": 2.0}  # The factor by which `mine` is too stiff; its author mends it.
INSTALLED: dict[str, Any] = {
    "absent": "no_such_module:make",
    "unlicensed": without_licence,
    "raising": lambda *, penalty: Broken(KeyError("[/bold] is no markup")),
    "nan": lambda *, penalty: Broken(),
    "half": lambda *, penalty: HalfEnds(nts_ar(penalty=penalty)),
    "remembering": lambda *, penalty: Remembering(nts_ar(penalty=penalty)),
    "twice": lambda *, penalty: silent(2 * penalty),
    "three_times": lambda *, penalty: silent(3 * penalty),
    "mine": lambda *, penalty: ResidualAlone(vts_ppt(penalty=FACTOR["now"] * penalty)),
}


@pytest.fixture
def strangers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Install formulations that do not load, raise, return NaN, are wrong, remember or promise nothing."""
    install_formulations(monkeypatch, **INSTALLED)


@pytest.mark.usefixtures("strangers")
def test_a_plugin_that_does_not_load_is_a_row_and_the_others_run(ask: Ask) -> None:
    answer = ask("verify absent unlicensed nts -p purity --examples 3 --seed 1 -v")
    assert answer.status == 1
    assert "absent\n      not loaded: ModuleNotFoundError: No module named 'no_such_module'; " in answer.out
    assert "unlicensed\n      not loaded: make: RuntimeError: no licence [red] left (test_cli_verify.py, " in answer.out
    assert rows(answer.out)["nts", "purity"][:3] == ["passes", "pass", "3/3"]
    assert answer.out.endswith("2 plugins not loaded: absent; unlicensed.\n")
    assert not answer.err


@pytest.mark.usefixtures("strangers")
def test_a_plugin_that_raises_or_returns_nan_is_an_outcome(ask: Ask, tmp_path: Path) -> None:
    report = tmp_path / "r.nc"
    answer = ask("verify raising nan nts -p balance.force --examples 3 --seed 1 -v --keep-going --out", report)
    assert answer.status == 1
    assert rows(answer.out)["raising", "balance.force"][1] == "crashed"
    assert rows(answer.out)["nan", "balance.force"][1:3] == ["BROKEN", "PROMISE"]
    assert rows(answer.out)["nts", "balance.force"][1] == "pass"
    assert "exception: residual: KeyError: '[/bold] is no markup'" in answer.out
    assert "not finite: residual: nan in" in answer.out
    again = ask("replay", report, "--case", "raising.balance.force")
    assert (again.status, "crashed" in again.out) == (1, True)


@pytest.mark.usefixtures("strangers")
def test_a_case_is_replayed_with_what_cannot_be_asked(ask: Ask, tmp_path: Path) -> None:
    report = tmp_path / "r.nc"
    words = "verify vts-ppt-basic -p tangent.directional --examples 12 --seed 1 --shrink all --out"
    assert ask(words, report).status == 0
    answer = ask("replay --case vts-ppt-basic.tangent.directional --formulation nan", report)
    assert (answer.status, "not provided" in answer.out) == (0, True)


@pytest.mark.usefixtures("strangers")
def test_the_list_has_what_does_not_load_too(ask: Ask) -> None:
    answer = ask("list")
    assert answer.status == 0
    assert re.search(r"absent +not loaded: ModuleNotFoundError", answer.out)
    assert re.search(r"raising +2-D +– +nothing; not provided: pair, tangent, contact_points", answer.out)


# ---------------------------------------------------------------------------------------------------------------------
# Promises


STIFFNESS = f"-p total-stiffness -p swap -p {TRANSMISSION} --examples 2 --seed 1"


@pytest.mark.usefixtures("strangers")
def test_who_promises_nothing_is_told_so_and_how_stiff_its_springs_are(ask: Ask) -> None:
    answer = ask(f"verify twice {STIFFNESS}")
    assert answer.status == 0
    assert "your springs are 2.00 ε̂ L: two passes, or twice too stiff" in answer.out
    assert answer.out.splitlines()[-2:] == [
        "✗ twice fails 1 of 2, the patch test among them, and promises none of these. "
        "No trait is stated, so no promise can be broken (exit 0).",
        "Properties promised to pass: 1, to fail: 0, neither: 1.",
    ]


@pytest.mark.usefixtures("strangers")
def test_a_wrong_stiffness_breaks_a_promise_that_everybody_makes(ask: Ask) -> None:
    answer = ask(f"verify three_times {STIFFNESS}")
    assert answer.status == 1
    assert "your springs are 3.00 ε̂ L: one pass has 1 ε̂ L, two passes have 2 ε̂ L" in answer.out
    assert answer.out.endswith("1 broken promise: three_times total-stiffness (against a basic law).\n")
    assert "Properties promised" not in answer.out


def test_what_makes_no_sense_for_a_formulation_is_no_promise(ask: Ask) -> None:
    answer = ask(f"verify nts nts-lm {STIFFNESS}")
    assert answer.status == 0
    assert answer.out.endswith("\nProperties promised to pass: 1, to fail: 2, neither: 0.\n")


def test_nobody_says_that_all_was_judged_where_something_is_undecided(ask: Ask) -> None:
    """On scene c a kink is so near that the order of Newton's method cannot be told."""
    answer = ask("verify vts-ppt-balanced --scene c -p newton.* --seed 1")
    assert answer.status == 0
    assert "\nEvery promise that was judged is kept. Undecided: vts-ppt-balanced newton.order.\n" in answer.out
    assert "every property was judged" not in answer.out


def test_a_run_that_judges_nothing_does_not_say_that_all_was_judged() -> None:
    info = load_property("purity").info
    idle = (Row("barrier", info, Verdict.NOT_APPLICABLE, None, reason="not defined in penetration"),)
    assert not Run(idle).promises_kept
    assert summary(Run(idle)).plain == "Nothing was judged: no property applies."
    judged = Row("mine", info, Verdict.PASS, True, planned=1, outcomes=(Outcome(named_case("a1"), Verdict.PASS),))
    words = "Nothing was judged of barrier: no property applies. What was judged is kept."
    assert (Run((judged, *idle)).promises_kept, Run((judged, *idle)).conclusion) == (True, words)
    assert Run((judged,)).conclusion == "Every promise is kept and every property was judged."
    swap, patch = (Row("mine", load_property(id_).info, Verdict.FAIL, None) for id_ in ("swap", TRANSMISSION))
    assert Run((judged, swap)).result == "pass"  # A trait of the method is no mistake.
    words = (
        "mine fails 1 of 2, the patch test among them, and promises none of these. No trait is stated, so no promise "
    )
    words += "can be broken."
    assert (Run((judged, patch)).result, Run((judged, patch)).conclusion) == ("fail", words)


def test_a_known_failure_that_passes_fails_the_run(ask: Ask) -> None:
    answer = ask("verify nts -p purity --known 'purity=issue 12' --examples 3 --seed 1")
    assert answer.status == 1
    assert "BROKEN PROMISE" in answer.out
    assert "listed as a known failure, but passes; known: issue 12" in answer.out
    assert answer.out.endswith("1 broken promise: nts purity (listed as a known failure, but passes).\n")


# ---------------------------------------------------------------------------------------------------------------------
# The screen of few lines, of which the first says what is wrong, and the most telling mesh is drawn


FEW = "--examples 4 --seed 1"
CHEAP = f"-p purity -p balance.* -p patch.flat.* -p hard.node-hit -p swap -p total-stiffness -p unilateral {FEW}"
MOST_LINES, MOST_LINES_OF_WRONG, COLUMNS = 25, 60, 80


def test_a_right_formulation_takes_few_lines_and_every_property_has_one_place(ask: Ask) -> None:
    answer = ask(f"verify vts-ppt {CHEAP}", columns=COLUMNS)
    lines = answer.out.splitlines()
    assert answer.status == 0
    assert len(lines) <= MOST_LINES
    assert max(map(len, lines)) <= COLUMNS
    assert lines[2].startswith("vts-ppt: ")
    assert "\ntraits of the method, no mistakes: fails swap\n" in answer.out
    assert "\npasses: " in answer.out
    assert "✗" not in answer.out


@pytest.mark.usefixtures("strangers")
def test_a_wrong_formulation_shows_one_mesh_and_a_line_for_all_else(ask: Ask) -> None:
    answer = ask(f"verify half {CHEAP}", columns=COLUMNS)
    lines = answer.out.splitlines()
    assert answer.status == 1
    assert len(lines) <= MOST_LINES_OF_WRONG
    assert max(map(len, lines)) <= COLUMNS
    assert "half: ✗ fails " in lines[2]
    assert answer.out.count("●──") == 1
    mesh, others = answer.out.split("also wrong:\n")
    assert ("BROKEN PROMISE" in mesh, "BROKEN PROMISE" in others) == (True, False)
    assert "  patch.flat.resultant  " in others
    assert TRANSMISSION in others
    assert "\n                           all slave nodes" in others  # What is found there, below its number.
    assert "on a reference" not in others  # It follows the right configuration.
    assert answer.out.endswith(" more.\n")
    assert ask(f"verify half {CHEAP} --show all").out.count("half, patch.flat.") > 2


@pytest.mark.usefixtures("strangers")
def test_one_line_is_enough_for_a_script(ask: Ask) -> None:
    assert ask(f"verify sts -q {CHEAP}").out == "Every promise is kept and every property was judged.\n"
    stated = "vts-ppt fails 2 of 14, as it states. No promise is broken (exit 0).\n"
    assert ask(f"verify vts-ppt -q {CHEAP}").out == stated
    assert ask(f"verify half -q -p swap -p total-stiffness {FEW}").out.count("\n") == 1


@pytest.mark.usefixtures("strangers")
def test_the_first_round_alone_says_how_little_it_asks(ask: Ask, tmp_path: Path) -> None:
    report = tmp_path / "r.nc"
    answer = ask("verify vts-ppt --quick --seed 1 --durations 2 -p balance.* -p swap -p patch.curved --out", report)
    assert answer.status == 0
    assert "asked: 2 of 4 properties, 5 cases each, seed 1" in answer.out
    assert re.search(r"\n +\d+\.\d s  vts-ppt balance\.\w+, 5 cases\n +\d+\.\d s  vts-ppt balance", answer.out)
    assert "asked: 2 of 4 properties" in ask("report", report).out
    check_mistake(
        ask("verify vts-ppt --quick -p swap"), "--quick: found 1 properties, none of them of the first round.*"
    )


@pytest.mark.usefixtures("strangers")
def test_the_first_row_that_is_wrong_can_be_the_last_one_that_is_asked(ask: Ask) -> None:
    answer = ask(f"verify half -x -p purity -p balance.* -p total-stiffness -p swap {FEW}", columns=COLUMNS)
    assert answer.status == 1
    assert re.search(r"properties were not asked: half .* is wrong \(-x\)\.\n", " ".join(answer.out.split("\n ")))
    assert "--keep-going" not in answer.out


@pytest.mark.usefixtures("strangers")
def test_what_is_left_out_has_one_line_that_says_why_and_how_to_ask_it(ask: Ask) -> None:
    answer = ask(f"verify remembering {CHEAP}", columns=COLUMNS)
    assert answer.status == 1
    assert "not asked: purity fails. --keep-going asks them all." in " ".join(answer.out.split())
    assert "✗ entries that change" in answer.out
    assert len(answer.out.splitlines()) <= MOST_LINES_OF_WRONG
    assert "not asked" not in ask(f"verify remembering --keep-going {CHEAP}").out


def test_what_could_not_be_judged_is_not_called_wrong() -> None:
    info = load_property("purity").info
    row = Row("mine", info, Verdict.NOT_JUDGED, True, reason="stopped: 3 of 100 cases judged", planned=100)
    screen = "\n".join(map(str, run_screen(Run((row,)), COLUMNS)))
    assert "mine: 1 not judged\nnot judged:\n  purity  stopped: 3 of 100 cases judged\n" in screen


def test_a_wrong_force_beside_an_exact_one_is_shown_before_two_answers_that_differ() -> None:
    def row(name: str, verdict: Verdict) -> Row:
        return Row("mine", load_property(name).info, verdict, True)

    for exact in ("patch.flat.resultant", "balance.moment", "hard.node-hit"):
        failing = [row(name, Verdict.FAIL) for name in ("mirror", "swap", exact, "purity")]
        assert [each.property_id for each in by_rank(failing)] == ["purity", exact, "mirror", "swap"]
    assert by_rank([failing[0], row("patch.flat.resultant", Verdict.PASS)])[0].property_id == "mirror"


def test_a_failure_in_words_is_not_shown_by_a_number_that_keeps_its_tolerance() -> None:
    info = load_property("hard.free-end").info
    measured = Measurement(
        [next(iter(info.quantities)).check(0.5, 4.0)], broken="a force of 2 on a slave that faces no master"
    )
    outcomes = (Outcome(named_case("a1"), Verdict.FAIL, measured.broken, measured),)
    other = Row("mine", load_property("purity").info, Verdict.FAIL, True, reason="it remembers")
    row = Row("mine", info, Verdict.FAIL, True, reason=measured.broken, planned=1, outcomes=outcomes)
    screen = "\n".join(map(str, run_screen(Run((other, row)), COLUMNS)))
    assert "hard.free-end  a force of 2 on a slave that faces no master\n" in screen


# ---------------------------------------------------------------------------------------------------------------------
# The table


def test_verify_says_what_was_asked_and_how_it_came_out(ask: Ask) -> None:
    answer = ask("verify vts-ppt-balanced -p balance.* -p purity --examples 7 --seed 1 -v")
    assert (answer.status, answer.err) == (0, "")
    assert answer.out.startswith("profile dev: 7 random cases for each property, seed 1\n")
    table = rows(answer.out)
    assert set(table) == {("vts-ppt-balanced", id_) for id_ in ("balance.force", "balance.moment", "purity")}
    assert answer.out.splitlines()[-2:] == [
        "Every promise is kept and every property was judged.",
        "Properties promised to pass: 3, to fail: 0, neither: 0.",
    ]
    promise, verdict, judged, _, worst, sign, tolerance = table["vts-ppt-balanced", "balance.force"]
    assert (promise, verdict, judged, sign) == ("passes", "pass", "7/7", "≤")
    assert 0 <= float(worst) <= float(tolerance) < 1e-6


def test_what_fails_as_promised_is_drawn_and_the_run_passes(ask: Ask) -> None:
    answer = ask("verify nts vts-ppt -p patch.* --examples 10 --seed 1 -v")
    assert answer.status == 0
    promise, fails, as_, stated, judged, _, closest, _, tolerance, *_ = rows(answer.out)["nts", TRANSMISSION]
    assert (promise, fails, as_, stated, judged) == ("fails", "fails", "as", "stated", "10/10")
    assert float(closest) > float(tolerance)
    assert rows(answer.out)["vts-ppt", TRANSMISSION][:3] == ["passes", "pass", "10/10"]
    title = f"nts, {TRANSMISSION}: fails as stated, "
    assert f"{title}its witness, the case a1\n    slave node 0 (free end): force " in answer.out
    assert "\n    ✗ error of a nodal force: " in answer.out
    shrunk = ask(f"verify nts -p {TRANSMISSION} --examples 10 --seed 1 --shrink all --show all")
    assert f"{title}the smallest case found\n    slave node 0 (free end): force " in shrunk.out
    assert "●──" in answer.out


def test_all_is_every_installed_formulation(ask: Ask) -> None:
    answer = ask("verify --all -p purity --examples 1 --seed 1 -v")
    assert answer.status == 0
    assert {formulation for formulation, _ in rows(answer.out)} == set(registry.standalone_names())


def test_a_mesh_of_the_user_is_judged(ask: Ask) -> None:
    answer = ask(f"verify vts-ppt-balanced {ON_PUNCH} --examples 5 --seed 1 -v")
    assert answer.status == 0, answer.out
    assert {property_id for _, property_id in rows(answer.out)} == set(registry.property_ids())
    verdicts = {words[1] for words in rows(answer.out).values()}
    assert "pass" in verdicts
    assert verdicts <= {"pass", "not", "fails"}  # not applicable, fails as stated


def test_the_table_lines_up_at_any_width(ask: Ask, tmp_path: Path) -> None:
    globs = " ".join(f"-p {glob}" for glob in ("patch.flat.[tr]*", "hard.n*", "symm*", "swap", "balance.*"))
    words = f"verify nts-ar vts-ppt-balanced {globs} --examples 3 --seed 1 -v --out"
    check_table(ask(words, tmp_path / "a.nc", columns=80), 80)
    for columns in (100, 140):
        check_table(ask("report -v", tmp_path / "a.nc", columns=columns), columns)


def check_table(answer: Answer, columns: int) -> None:
    """Check that the columns of a table of a run are where its head says, and that it fits the terminal."""
    table = next(part for part in answer.out.split("\n\n") if re.search("closest +tolerance", part))
    head, *lines = table.strip("\n").splitlines()
    assert max(map(len, (head, *lines))) <= columns
    result, tolerance = head.index("result"), head.index("tolerance") + len("tolerance")
    for line in lines:
        if re.match(r" {1,2}\S", line) and "not applicable" not in line:
            assert line[result : result + 15].rstrip() in ("pass", "fail", "fails as stated")
            assert line[:tolerance].rstrip() == line[:tolerance]
            assert re.search(r"[≤≥] \S+$", line[:tolerance])
            assert line[tolerance : tolerance + 2].strip() == ""


@pytest.mark.parametrize("columns", [80, 140])
def test_lists_fit_the_terminal_and_lose_nothing(ask: Ask, columns: int) -> None:
    for line in ("list", "list --traits"):
        answer = ask(line, columns=columns)
        assert answer.status == 0
        assert max(map(cell_len, answer.out.splitlines())) <= columns  # ε̂ is two characters in one column.
        assert "…" not in answer.out
        for name in (*registry.formulation_names(), *registry.property_ids(), *registry.load_problems()):
            assert re.search(rf"^ *{re.escape(name)} ", answer.out, re.M)
    assert "balance.force fails on tilted" in " ".join(answer.out.split())


def test_a_line_to_be_copied_is_never_folded(ask: Ask, tmp_path: Path) -> None:
    folder = tmp_path / "a folder with a name that is far too long for a line of a narrow terminal, as names are"
    folder.mkdir()
    words = f"verify nts -p {TRANSMISSION} --examples 5 --seed 1 --show all --out"
    answer = ask(words, folder / "r.nc", columns=80)
    assert f"    contactverif replay '{folder / 'r.nc'}' --case {CASE}.witness\n" in answer.out


def test_a_remark_that_is_too_long_stands_below_its_line(ask: Ask) -> None:
    known = f"{TRANSMISSION}=" + "long " * 30
    answer = ask(f"verify nts -p {TRANSMISSION} --examples 5 --seed 1 -v --known", known, columns=80)
    assert answer.status == 0
    lines = answer.out.splitlines()
    (row,) = (number for number, line in enumerate(lines) if line.lstrip().startswith("patch.flat"))
    assert lines[row + 1].startswith("      known: long long")
    assert max(map(len, lines[row : row + 4])) <= 80


def test_the_bar_is_for_a_terminal_and_leaves_a_pipe_alone() -> None:
    """Standard error is a terminal, standard output a pipe: the bar is there, and the table has no trace of it."""
    arguments = command("verify nts -p purity --examples 40 --seed 1")
    ours, theirs = pty.openpty()
    screen = bytearray()
    try:
        variables = environment(TERM="xterm")
        with subprocess.Popen(arguments, env=variables, stdout=subprocess.PIPE, stderr=theirs, text=True) as running:
            os.close(theirs)
            try:
                while piece := os.read(ours, 4096):
                    screen += piece
            except OSError:  # the other end is closed
                pass
            assert running.stdout is not None
            out = running.stdout.read()
    finally:
        os.close(ours)
    alone = subprocess.run(arguments, env=environment(), capture_output=True, text=True, check=True)
    assert b"nts purity: judging" in screen
    assert out == alone.stdout
    assert "\x1b" not in out
    assert "\r" not in out
    # A slow machine has a line now and then.
    assert alone.stderr.splitlines()[-1] == "nts purity: pass, 40/40 judged"


# ---------------------------------------------------------------------------------------------------------------------
# What a run leaves behind


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--case nts.patch.flat", rf"--case: found 'nts.patch.flat'; needed an id like {CASE}"),
        (f"--case {CASE} --formulation vts-pt", "formulation: found 'vts-pt'; needed .* nearest: vts-ppt.*"),
        (f"--case {CASE} --out nts.xyz", "--out: found 'nts.xyz'; needed a .* .png, .svg or .vtu"),
        (f"--case {CASE} --out no/such/a.png", "--out: found .* is no folder; needed a folder that exists"),
    ],
)
def test_a_mistake_in_a_replay_is_one_line(ask: Ask, nts_report: Path, options: str, message: str) -> None:
    check_mistake(ask(f"replay {options}", nts_report), message)


def test_replay_gives_the_same_verdict_and_the_drawing(ask: Ask, nts_report: Path) -> None:
    assert ask("replay", nts_report) == Answer(0, f"{CASE}\n", "")
    answer = ask(f"replay --case {CASE}", nts_report)
    assert answer.status == 1
    stored = read_case(nts_report, CASE)
    lines = [line.rstrip().split(maxsplit=3) for line in answer.out.splitlines()]
    assert ["stored", "nts", "fail", stored.reason] in lines
    assert ["now", "nts", "fail", stored.reason] in lines
    assert "●──" in answer.out
    assert "o──" in answer.out
    cleared = ask(f"replay --case {CASE} --formulation vts-ppt", nts_report)
    assert cleared.status == 0
    assert ["now", "vts-ppt", "pass"] in [line.split() for line in cleared.out.splitlines()]


@pytest.mark.parametrize(("suffix", "begins"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_replay_draws_a_picture(ask: Ask, nts_report: Path, tmp_path: Path, suffix: str, begins: bytes) -> None:
    picture = tmp_path / f"nts.{suffix}"
    answer = ask(f"replay --case {CASE} --out", picture, nts_report)
    assert answer.status == 1
    assert answer.out.endswith(f"picture: {picture}\n")
    assert picture.read_bytes().startswith(begins)


def test_verify_draws_each_counterexample_into_a_folder(ask: Ask, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "pictures"
    answer = ask(f"verify nts vts-ppt -p {TRANSMISSION} --examples 5 --seed 1 --pictures", folder)
    assert answer.status == 0
    assert [path.name for path in folder.iterdir()] == [f"{CASE}.png"]
    assert f"pictures: {folder}\n" in answer.out


def test_the_same_seed_gives_the_same_report(tmp_path: Path) -> None:
    """In two processes with other hashes, from other folders; and another seed gives another."""
    reports = {}
    for name, seed in (("a", 5), ("b", 5), ("c", 6)):
        (tmp_path / name).mkdir()
        reports[name] = tmp_path / name / "r.nc"
        line = f"verify nts -p patch.flat.* -p p[ru]* --seed {seed} --examples 8 --out {reports[name]}"
        if name == "a":
            variables = environment(PYTHONHASHSEED="1")
            subprocess.run(command(line), cwd=tmp_path / name, env=variables, capture_output=True, check=True)
        else:
            assert run_inline(line).status == 0
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
def running(tmp_path: Path, nts_report: Path) -> Iterator[subprocess.Popen[str]]:
    """`verify slow --out r.nc` over a report that is there already, in the middle of its first case."""
    about = tmp_path / "plugins" / "slow-1.0.dist-info"
    about.mkdir(parents=True)
    (about.parent / "slow_plugin.py").write_text(SLOW)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: slow\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[contactverif.formulations]\nslow = slow_plugin:make\n")
    folder = tmp_path / "here"
    folder.mkdir()
    shutil.copy(nts_report, folder / "r.nc")
    arguments = command("verify slow -p purity --examples 3 --seed 1 --out r.nc")
    variables, pipe = environment(PYTHONPATH=str(about.parent)), subprocess.PIPE
    with subprocess.Popen(arguments, cwd=folder, env=variables, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            deadline = time.monotonic() + 60
            while not (folder / "judging").exists():
                assert process.poll() is None, process.communicate()
                assert time.monotonic() < deadline
                time.sleep(0.02)
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT, signal.SIGTERM])
def test_a_run_that_is_killed_or_stopped_keeps_the_report_that_was_there_apart(
    running: subprocess.Popen[str], tmp_path: Path, nts_report: Path, number: signal.Signals
) -> None:
    running.send_signal(number)
    out, err = running.communicate(timeout=30)
    if number is signal.SIGKILL:
        assert running.returncode == -signal.SIGKILL
    else:
        assert (running.returncode, err.splitlines()[-1]) == (128 + number, "contactverif: stopped")
        assert "stopped: 0 of 3 cases judged" in out
        assert out.endswith("what was judged is kept; to go on: contactverif verify --resume r.nc\n")
    folder = tmp_path / "here"
    assert sorted(path.name for path in folder.iterdir()) == ["judging", "r.nc.journal"]
    assert (folder / "r.nc.journal" / "earlier.nc").read_bytes() == nts_report.read_bytes()


# ---------------------------------------------------------------------------------------------------------------------
# The failures that a command remembers in its folder, and asks first, or alone with `--last-failed`


MINE = f"verify mine -p {TRANSMISSION} -p balance.force --examples 5 --isolation inline"


@pytest.fixture
def memory(strangers: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Return the folder that remembers failures, in an empty working folder."""
    monkeypatch.setitem(FACTOR, "now", 2.0)
    monkeypatch.chdir(tmp_path)
    return tmp_path / ".contactverif" / "failures"


def test_what_fails_is_kept_and_asked_first_until_it_passes(
    ask: Ask, memory: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines: list[str] = []

    def show_progress(bar: progress.Bar, step: Progress) -> None:
        if step.row is not None and step.phase != "first round":
            lines.append(f"{step.row.property_id} {step.row.planned}")

    monkeypatch.setattr(progress.Bar, "show_progress", show_progress)
    assert ask(f"{MINE} --seed 1").status == 1
    assert [file.name for file in memory.iterdir()] == [f"mine.{TRANSMISSION}.npz"]
    assert lines == ["balance.force 5", f"{TRANSMISSION} 5"]
    lines.clear()
    assert ask(f"{MINE} --seed 2").status == 1
    assert lines == [f"{TRANSMISSION} 0", "balance.force 5", f"{TRANSMISSION} 5"]
    again = ask(f"{MINE} --last-failed")
    assert again.status == 1
    assert f"mine, {TRANSMISSION}: BROKEN PROMISE, a case that failed in an earlier run\n" in again.out
    assert again.out.endswith("1 of 1 failures of earlier runs are left.\n")
    FACTOR["now"] = 1.0
    mended = ask(f"{MINE} --last-failed")
    assert (mended.status, list(memory.iterdir())) == (0, [])
    assert mended.out.endswith("0 of 1 failures of earlier runs are left.\n")
    needed = "a run of `verify` here in which something fails"
    message = f"--last-failed: found no failure of 'mine' in .contactverif; needed {needed}"
    check_mistake(ask(f"{MINE} --last-failed"), message)


def test_nothing_is_kept_without_a_memory(ask: Ask, memory: Path) -> None:
    assert ask(f"{MINE} --no-memory").status == 1
    Path("pyproject.toml").write_text("[tool.contactverif]\nmemory = false\n", encoding="utf-8")
    assert ask(MINE).status == 1
    assert not memory.exists()


def test_what_cannot_be_judged_is_left(ask: Ask, memory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert ask(f"{MINE} --seed 1").status == 1
    check_mistake(ask(f"{MINE} --last-failed --out mine.nc"), "--last-failed: found --out beside it; .*")
    install_formulations(monkeypatch, mine="no_such_module:make")
    answer = ask(f"{MINE} --last-failed")
    assert (answer.status, len(list(memory.iterdir()))) == (1, 1)
    assert "mine: not loaded: ModuleNotFoundError" in answer.out
    assert answer.out.endswith("1 of 1 failures of earlier runs are left.\n")
