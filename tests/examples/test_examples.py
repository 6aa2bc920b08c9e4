"""Each script of examples/ runs in an empty folder, and prints or writes what its first lines promise."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPTS = sorted((ROOT / "examples").glob("*.py"))
PICTURES = ROOT / "docs" / "pictures"

# {script: patterns that its output must match}
PROMISES = {
    "compare_with_vts_ppt": [
        r"patch\.flat\.transmission +pass +fail +pass",
        r"mortar passes where VTS-PPT fails: balance\.force, balance\.moment, patch\.dead-zone",
    ],
    "exact_tangent": [
        r"vts-ppt +largest .*e-1[5-7]",
        r"vts-ppt-basic +largest .*e-0[1-4]",
        r"mortar +largest .*e-1[4-7]",
    ],
    "figure_30": [r"vts-ppt-basic: converged after 1\d iterations", r"vts-ppt: converged after [3-6] iterations"],
    "first_residual": [r"25\.", r"balance\.force: pass", r"patch\.flat\.transmission: fail"],
    "hertz_errors": [
        r"nts-ar +parabola-layer 3\d, parabola-soft [89]\.\d, parabola-stiff 5\.\d",
        r"vts-ppt +parabola-layer 0\.4\d, parabola-soft 0\.5\d?, parabola-stiff 1\.\d",
    ],
    "inf_sup": [
        r"nts-lm +.*2:3: 1\.00 of β left, 0% .*3:2: 1\.00 of β left, 0% .*matching: 1\.00 of β left, 0%",
        r"vts-ppt-lm +.*2:3: 0\.50 of β left, 0% .*3:2: 1\.00 of β left, 33%",
    ],
    "locking": [
        r"nts-ar .*stiffest [1-9]e-01",
        r"two-pass/nts-ar .*stiffest [1-9]e-05",
        r"vts-ppt .*softest penalty [1-9]e-1[4-7]",
    ],
    "newton_trace": [r"vts-ppt\n(?s:.*?)converged: ", r"vts-me\n(?s:.*)2-cycle: "],
    "opposite_sign": [
        r"opposite sign: negated",
        r"unilateral: .*\n +.*your forces have the opposite sign",
        r"the run fails",
    ],
    "own_mesh": [r"2 slave segments on 2 master segments", r"vts-me +patch\.flat\.transmission +fail"],
    "own_scene": [r"converged after \d iterations", r"largest pressure in the block: \d+"],
    "read_report": [r"vts-me: largest error \de\+\d\d tolerances", r"vts-ppt: largest error \de-\d\d tolerances"],
    "shrink_fit": [
        r"sts +error .* order 2\.0",
        r"vts-ppt +error .* order 2\.0",
        r"nts-ar +error .* order 2\.0",
        r"springs a quarter .* to 5\.\de-01, order 0\.0",
    ],
    "stiff_springs": [
        r"sts +at 1e6 E/h: pressures from 0\.00 to 12\.4\d times",
        r"mortar at 1e6 E/h: pressures from 0\.4\d to 1\.5\d times",
    ],
    "wavy_rates": [
        r"flat interface, 10 E/h +nts-ar +pressures: rate +0\.[0-3]\d, last error [4-9]\.\de-02",
        r"flat interface, 10 E/h +sts +pressures: rate +1\.9\d, last error [5-7]\.\de-04",
        r"curved interface, 100 E/h +sts +pressures: rate +0\.[4-7]\d, last error [4-7]\.\de-01",
        r"curved interface, 100 E/h +mortar +pressures: rate +1\.9\d, last error [1-3]\.\de-03",
    ],
    "smallest_failing_mesh": [r"1 slave segment on 2 master segments", r"error of a nodal force 0\.\d+"],
}


def run_script(*arguments: str | Path, folder: Path) -> str:
    """Run Python in a folder and return what it prints."""
    environment = os.environ | {"MPLBACKEND": "Agg", "PYTHONIOENCODING": "utf-8"}
    finished = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", *map(str, arguments)],
        cwd=folder,
        env=environment,
        capture_output=True,
        encoding="utf-8",
        timeout=300,
        check=False,
    )
    assert finished.returncode == 0, finished.stdout + finished.stderr
    return finished.stdout


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_an_example_does_what_it_says(script: Path, tmp_path: Path) -> None:
    if script.stem == "read_report":
        verify = "from contactverif.cli import main; main()"
        options = ("-p", "patch.flat.transmission", "--examples", "20", "--seed", "1", "--out", "report.nc")
        run_script("-c", verify, "verify", "vts-me", "vts-ppt", *options, folder=tmp_path)
    printed = run_script(script, folder=tmp_path)
    for pattern in PROMISES[script.stem]:
        assert re.search(pattern, printed), f"{pattern!r} is not in:\n{printed}"
    for name in re.findall(r'savefig\("(.+)"\)', script.read_text(encoding="utf-8")):
        assert (tmp_path / name).read_text(encoding="utf-8").rstrip().endswith("</svg>")
        assert (PICTURES / name).is_file(), "the gallery shows it; python tests/docs/quotes.py writes it"


def test_there_are_enough_examples() -> None:
    assert len(SCRIPTS) >= 8
    assert {script.stem for script in SCRIPTS} == set(PROMISES)


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_an_example_is_short_and_uses_public_names_only(script: Path) -> None:
    text = script.read_text(encoding="utf-8")
    tree = ast.parse(text)
    assert "\n\n" in (ast.get_docstring(tree) or ""), "one line says what one learns, then a paragraph explains it"
    assert 12 <= len(text.splitlines()) <= 60
    modules = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    modules += [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    ours = {module for module in modules if module.startswith("contactverif")}
    assert ours <= {"contactverif", "contactverif.testing"}
