"""A formulation from a project outside the tree is found and verified; the tutorial, run step by step.

tox's environment `external` installs the project for real. Here, without a network, an installation is what Python
sees of one: the module and a `dist-info` on the path.
"""

import re
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
import xarray as xr
from quotes import (
    DOCS,
    MINE_CLASSES,
    MINE_SOURCE,
    STEPS,
    blocks,
    call,
    commands,
    excerpt,
    install_mine,
    outputs,
    quotes,
    unlike,
)

QUICK = ("--examples", "6")  # The tutorial's commands ask for a hundred; its loops are plain Python.
FEW = ("-p", "patch.flat.*", "-p", "tangent.directional")
TUTORIAL = DOCS / "tutorial"
Run = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def run_program(tmp_path: Path) -> Run:
    """Return a function that runs a command in `tmp_path` with what is installed in `tmp_path/site`."""
    return lambda *words: call(*words, folder=tmp_path)


@pytest.fixture
def whole_project(tmp_path: Path) -> Path:
    """Install the whole project."""
    folder = tmp_path / "site"
    install_mine(folder)
    return folder


def test_it_is_found(whole_project: Path, run_program: Run) -> None:
    printed = run_program("contactverif", "list").stdout
    words = " ".join(printed.split())  # Long lines are folded.
    assert " mine 2-D – nothing; not provided: pair, tangent, contact_points " in words
    assert " mine-exact 2-D passes exact tangent; not provided: pair, contact_points " in words
    assert " mine-nodes " in words


def test_its_report_says_what_is_not_provided(whole_project: Path, run_program: Run, tmp_path: Path) -> None:
    answer = run_program("contactverif", "verify", "mine", *FEW, "--profile", "ci", *QUICK, "--out", "mine.nc")
    assert answer.returncode == 0, answer.stdout + answer.stderr
    with xr.open_datatree(tmp_path / "mine.nc") as report:
        summary = report["summary"].to_dataset().sel(formulation="mine")
        assert "pair: not provided, tangent: not provided" in summary.parts
        provided = summary.provided.to_series().to_dict()
        assert provided == {"pair": 0, "tangent": 0, "contact_points": 0}
        meanings = summary.row_verdict.flag_meanings.split()
        verdicts = {str(name): meanings[int(code)] for name, code in summary.row_verdict.to_series().items()}
        assert verdicts["patch.flat.transmission"] == "pass"
        assert verdicts["tangent.directional"] == "not_provided"
        assert str(summary.reason.sel(property="tangent.directional").item()) == "tangent: not provided"


FORCE = ("-p", "balance.force", "--examples", "2")


def test_a_file_that_is_not_finished_is_a_row_that_did_not_load(run_program: Run, tmp_path: Path) -> None:
    install_mine(tmp_path / "site", MINE_CLASSES["NodeToSegment"])
    answer = run_program("contactverif", "verify", "mine-nodes", "mine-exact", "-v", *FORCE)
    assert answer.returncode == 1
    assert re.search(r"balance\.force +– +pass", answer.stdout), "the others run"
    assert "not loaded" in answer.stdout
    assert "Exact" in answer.stdout


@pytest.mark.parametrize("name", STEPS)
def test_a_step_of_the_tutorial_ends_as_it_says(name: str, tmp_path: Path) -> None:
    page = TUTORIAL / name
    for line in commands(page.read_text(encoding="utf-8")):
        assert line.startswith(("contactverif verify mine", "pip install -e contactverif-mine"))
    (quote,) = [quote for quote in quotes(page) if quote.kind == "output"]
    finished = outputs(page, tmp_path)[quote.command]
    assert finished.returncode == 0, finished.stdout + finished.stderr
    assert not unlike(quote.block, excerpt(finished.stdout, quote.argument))


def test_the_steps_pasted_one_below_the_other_are_the_file() -> None:
    whole = "\n\n\n".join(block.rstrip("\n") for block in MINE_CLASSES.values()) + "\n"
    assert whole == MINE_SOURCE
    sources = [quote.argument for name in STEPS for quote in quotes(TUTORIAL / name) if quote.kind == "source"]
    assert [argument.partition(" ")[2] for argument in sources] == list(MINE_CLASSES)


def test_an_exact_tangent_is_judged(whole_project: Path, run_program: Run, tmp_path: Path) -> None:
    (quote,) = [quote for quote in quotes(TUTORIAL / "tangent.md") if quote.kind == "output"]
    assert "tangent 1 of 1" in quote.block
    answer = run_program(
        *("contactverif", "verify", "mine-exact", "-p", "tangent.directional", "--profile", "ci", *QUICK),
        *("--out", "exact.nc"),
    )
    assert answer.returncode == 0, answer.stdout + answer.stderr
    with xr.open_datatree(tmp_path / "exact.nc") as report:
        tangent = report["tangent/directional"].to_dataset().sel(formulation="mine-exact")
        assert int((tangent.verdict == 0).sum()) >= 0.9 * int(QUICK[1])
        assert float(tangent.value.sel(quantity="error against a complex step").max()) < 1e-8
        assert tangent.value.sel(quantity="error against a central difference").notnull().all()


def test_a_wrong_tangent_is_found_out(run_program: Run, tmp_path: Path) -> None:
    wrong = MINE_SOURCE.replace("return np.column_stack(columns)", "return -np.column_stack(columns)")
    fixed_step = MINE_SOURCE.replace("h = 2.0**-100 * np.ptp(z)", "h = 1e-20")
    for text, property_id in ((wrong, "tangent.directional"), (fixed_step, "units")):
        assert text != MINE_SOURCE
        install_mine(tmp_path / "site", text)
        answer = run_program(
            "contactverif", "verify", "mine-exact", "-p", property_id, "--seed", "1", "--examples", "15", "-v"
        )
        assert answer.returncode == 1
        assert re.search(rf"^ +{property_id} +passes +BROKEN PROMISE", answer.stdout, re.MULTILINE)


def _counts(printed: str) -> list[tuple[str, int]]:
    """Return the numbers of tests that pytest prints, by their word."""
    return [(word, int(number)) for number, word in re.findall(r"(\d+) (passed|skipped|xfailed|failed)\b", printed)]


def test_its_own_tests_pass(whole_project: Path, run_program: Run, tmp_path: Path) -> None:
    text = (TUTORIAL / "tests.md").read_text(encoding="utf-8")
    (block,) = blocks("text", text)
    command, folder, *options = shlex.split(commands(text)[-1])
    (tmp_path / folder).mkdir()
    (tmp_path / folder / "test_mine.py").write_text(blocks("python", text)[0], encoding="utf-8")
    answer = run_program(command, folder, *options, "--contactverif-examples", QUICK[1])
    assert answer.returncode == 0, answer.stdout + answer.stderr
    counts = [dict(_counts(text)) for text in (block, answer.stdout)]
    assert counts[0].pop("deselected", 0) == counts[1].pop("deselected", 0)
    assert counts[0]["skipped"] == counts[1]["skipped"]
    assert sum(counts[0].values()) == sum(counts[1].values())  # What is not promised may fail in a few cases more.
    assert f"contactverif: {sum(counts[1].values())} checks" in answer.stdout


def bench_rows(printed: str) -> list[tuple[str, str, str]]:
    """Return the formulation, how many instances reach the error, and how many runs failed, from each row."""
    return re.findall(r"^ ([\w-]+\*?) +(\d+/\d+) .* (\d+/\d+) *$", printed, re.MULTILINE)


def test_the_bench_of_the_tutorial_reaches_what_its_page_shows(whole_project: Path, run_program: Run) -> None:
    (quote,) = [quote for quote in quotes(TUTORIAL / "speed.md") if quote.kind == "output"]
    answer = run_program(*shlex.split(quote.command))
    assert answer.returncode == 0, answer.stdout + answer.stderr
    names = [row[0] for row in bench_rows(quote.block)]
    assert names == ["mine-nodes*", "mine*", "mine-exact", "vts-ppt"]
    assert bench_rows(quote.block) == bench_rows(answer.stdout)
