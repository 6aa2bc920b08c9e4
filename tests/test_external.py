"""A formulation from a project outside the tree is found and verified; the README's tutorial, run step by step.

tox's environment `external` installs the project for real. Here, without a network, an installation is what Python
sees of one: the module and a `dist-info` on the path.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
import xarray as xr
from test_readme import MINE, blocks, classes, rows, section

from contactverif.run.registry import property_ids

QUICK = "12"  # examples; the README's commands ask for a hundred
COMMANDS = {
    "contactverif": [sys.executable, "-c", "from contactverif.cli import main; main()"],
    "pytest": [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir=."],
}
Ask = Callable[..., "subprocess.CompletedProcess[str]"]


def install(folder: Path, source: str) -> None:
    """What `pip install` would leave in `folder` of a project whose mine.py holds `source`."""
    project = tomllib.loads((MINE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    name, version = project["name"], project["version"]
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True, exist_ok=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.4\nName: {name}\nVersion: {version}\n", encoding="utf-8")
    lines = []
    for group, points in project["entry-points"].items():
        lines += [f"[{group}]", *(f"{point} = {target}" for point, target in points.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (folder / "mine.py").write_text(source, encoding="utf-8")


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder with the whole project installed."""
    folder = tmp_path / "site"
    install(folder, (MINE / "mine.py").read_text(encoding="utf-8"))
    return folder


@pytest.fixture
def ask(tmp_path: Path) -> Ask:
    """A command in a process of its own that sees what is installed in `tmp_path/site`."""

    def asked(command: str, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        path = os.pathsep.join(filter(None, [str(tmp_path / "site"), os.environ.get("PYTHONPATH")]))
        environment = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "FORCE_COLOR")}
        environment |= {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "PYTHONIOENCODING": "utf-8"}
        return subprocess.run(
            [*COMMANDS[command], *map(str, arguments)],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            encoding="utf-8",
            timeout=300,
            check=False,
        )

    return asked


def test_it_is_found(site: Path, ask: Ask) -> None:
    printed = ask("contactverif", "list").stdout
    lines = {line.split()[0]: line for line in printed.splitlines() if line.strip()}
    assert "nothing; not provided: pair, tangent, contact_points" in lines["mine"]
    assert "passes the flat patch test; exact tangent; not provided: pair, contact_points" in lines["mine-exact"]
    assert "mine-nodes" in lines


def test_its_report_says_what_is_not_provided(site: Path, ask: Ask, tmp_path: Path) -> None:
    answer = ask("contactverif", "verify", "mine", "--profile", "ci", "--examples", QUICK, "--out", "mine.nc")
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


def test_a_file_that_is_not_finished_is_a_row_that_did_not_load(ask: Ask, tmp_path: Path) -> None:
    install(tmp_path / "site", classes()["NodeToSegment"])
    answer = ask("contactverif", "verify", "mine-nodes", "mine-exact", "-p", "balance.force", "--examples", "2")
    assert answer.returncode == 1
    assert rows(answer.stdout) == [("balance.force", "–", "pass")], "the others run"
    assert "not loaded" in answer.stdout
    assert "Exact" in answer.stdout


# What each step of the tutorial writes, and what else its outcome must say.
STEPS = {
    "### Step 1: a residual": ("NodeToSegment", ["patch.flat.transmission: fail", "slave   ●", "master  o"]),
    "### Step 2: pass the patch test": ("SegmentToSegment", ["tangent: not provided"]),
    "### Step 3: promise, and give the tangent": ("Exact", []),
}


@pytest.mark.parametrize("title", STEPS)
def test_a_step_of_the_tutorial_ends_as_it_says(title: str, ask: Ask, tmp_path: Path) -> None:
    step, words = STEPS[title]
    so_far = list(classes())[: list(classes()).index(step) + 1]
    install(tmp_path / "site", "\n\n\n".join(classes()[name] for name in so_far))
    (commands,), (shown,) = blocks("sh", section(title)), blocks("text", section(title))
    *before, command = map(shlex.split, commands.splitlines())
    assert all(other[:2] == ["pip", "install"] for other in before)
    answer = ask(*command, "--examples", QUICK)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert rows(answer.stdout) == rows(shown) != []
    for word in words:
        assert word in answer.stdout
        assert word in shown
    assert shown.splitlines()[-1] == answer.stdout.splitlines()[-1]


def test_an_exact_tangent_is_judged(site: Path, ask: Ask, tmp_path: Path) -> None:
    title = "### Step 3: promise, and give the tangent"
    assert ("tangent.directional", "passes", "pass") in rows(blocks("text", section(title))[0])
    answer = ask(
        *("contactverif", "verify", "mine-exact", "-p", "tangent.*", "--profile", "ci", "--examples", QUICK),
        *("--out", "exact.nc"),
    )
    assert answer.returncode == 0, answer.stdout + answer.stderr
    with xr.open_datatree(tmp_path / "exact.nc") as report:
        tangent = report["tangent/directional"].to_dataset().sel(formulation="mine-exact")
        assert int((tangent.verdict == 0).sum()) >= 0.9 * int(QUICK)
        assert float(tangent.value.sel(quantity="error against a complex step").max()) < 1e-8
        assert tangent.value.sel(quantity="error against a central difference").notnull().all()


def test_a_wrong_tangent_is_found_out(ask: Ask, tmp_path: Path) -> None:
    source = (MINE / "mine.py").read_text(encoding="utf-8")
    wrong = source.replace("return np.column_stack(columns)", "return -np.column_stack(columns)")
    fixed_step = source.replace("h = 2.0**-100 * np.ptp(z)", "h = 1e-20")
    for text, property_id in ((wrong, "tangent.directional"), (fixed_step, "scaling")):
        assert text != source
        install(tmp_path / "site", text)
        answer = ask("contactverif", "verify", "mine-exact", "-p", property_id, "--seed", "1", "--examples", "40")
        assert answer.returncode == 1
        assert rows(answer.stdout) == [(property_id, "passes", "fail")]
        assert "PROMISED, AND FAILS" in answer.stdout


def test_its_own_tests_pass(site: Path, ask: Ask, tmp_path: Path) -> None:
    title = "### Step 4: your own tests"
    (commands,), (shown,) = blocks("sh", section(title)), blocks("text", section(title))
    command, folder, *options = shlex.split(commands.splitlines()[-1])
    (tmp_path / folder).mkdir()
    (tmp_path / folder / "test_mine.py").write_text(blocks("python", section(title))[0], encoding="utf-8")
    answer = ask(command, folder, *options, "--contactverif-examples", QUICK)
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert shown.strip() in answer.stdout
    assert f"contactverif: {2 * len(property_ids())} checks" in answer.stdout
