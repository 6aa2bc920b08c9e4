"""The command line as such: help, version, completion, and what it imports.

Modules are counted and not seconds, so that a busy machine changes nothing.
"""

import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest
from asking import Ask
from fresh_process import PYTHON

from contactverif import __version__
from contactverif.cli import app as cli

# Each argument is a command line.
SCRIPT = """
import sys
from contactverif.cli import main
for words in sys.argv[1:]:
    sys.argv[1:] = words.split()
    try:
        main()
    except SystemExit as end:
        assert not end.code, end.code
print("\\nmodules:", *sorted(sys.modules))
"""
SLOW = {"numba", "hypothesis", "numpy", "xarray", "matplotlib", "scipy", "netCDF4", "meshlane", "pytest", "pandas"}
PANELS = ["Cases", "Results", "Earlier runs", "Mesh or scene", "Processes of plugins"]
FOR_SOLVING = (
    *("contactverif.mechanics", "contactverif.problems.blocks", "contactverif.problems.catalogue"),
    *("contactverif.problems.disk", "contactverif.problems.hertz", "contactverif.studies"),
    *("matplotlib", "meshlane", "scipy.sparse.linalg", "skfem", "xarray"),
)
ON_INTERFACES = "balance.* patch.flat.resultant total-stiffness unilateral projection.place purity"


# ---------------------------------------------------------------------------------------------------------------------
# Help


@pytest.mark.parametrize("page", ["", *cli.COMMANDS])
def test_help_teaches_and_fits_the_terminal(ask: Ask, page: str) -> None:
    answer = ask(f"{page} --help", columns=80)
    assert (answer.status, answer.err) == (0, "")
    assert max(map(len, answer.out.splitlines())) <= 80
    assert "\b" not in answer.out
    assert f"Usage: contactverif {page}".rstrip() in answer.out
    panels = re.findall(r"^╭─ (.*?) ─+╮$", answer.out, re.MULTILINE)
    assert page or [title.split()[-1] for title in panels[1:]] == ["day", "hours", "paper"]
    assert page != "verify" or panels[2:] == PANELS
    if page in ("verify", "replay", "draw"):
        example = f"contactverif {page}"
        examples = answer.out.partition("Examples\n" if "Examples\n" in answer.out else "Examples ")[2]
        lines = [line for line in examples.splitlines() if example in line]
        assert len(lines) >= 3
        assert len({line.index(example) for line in lines}) == 1  # they line up, each on a line of its own


EXAMPLES = [
    words
    for name in ("verify", "report", "replay", "draw", "scenes")
    for line in (cli.COMMANDS[name].__doc__ or "").splitlines()
    if (words := line.strip()).startswith("contactverif ")
]


@pytest.mark.parametrize("line", EXAMPLES)
def test_the_examples_of_the_help_parse(ask: Ask, line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each gets as far as to a file or a formulation that is not there, or runs."""
    monkeypatch.chdir(tmp_path)
    _, command, *words = shlex.split(line)
    answer = ask(command, *words, *(["--examples", "1", "-p", "purity"] if command == "verify" else []))
    assert "--help" not in answer.err
    assert answer.status == 0 or re.search(r"(ppt.nc|punch.msh|deck.inp|'mine')", answer.err)


def test_without_arguments_there_is_help(ask: Ask) -> None:
    answer = ask()
    assert answer.status == 2
    assert "verify" in answer.out + answer.err
    assert "contactverif: \n" not in answer.err


# ---------------------------------------------------------------------------------------------------------------------
# The start


def run_python(*arguments: str, **variables: str) -> str:
    """Return what a Python process prints."""
    unchanged = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "FORCE_COLOR")}
    environment = {**unchanged, "NO_COLOR": "1", "PYTHONWARNINGS": "error", **variables}
    finished = subprocess.run([*PYTHON, *arguments], env=environment, capture_output=True, text=True, check=True)
    return finished.stdout


def modules_after(*lines: str) -> set[str]:
    """Return the modules that are imported when some commands have ended, one after the other in one process."""
    return set(run_python("-c", SCRIPT, *lines).rpartition("modules: ")[2].split())


def test_help_imports_nothing_that_takes_long() -> None:
    modules = modules_after("--help", *(f"{command} --help" for command in cli.COMMANDS))
    assert not modules & SLOW
    after_numpy = run_python("-c", "import numpy, sys; print(len(sys.modules))")
    assert len(modules) <= 3 * int(after_numpy)


def test_a_run_imports_neither_mechanics_nor_the_kernels_of_another_family_unless_it_needs_them() -> None:
    """Numba compiles a kernel when it is first called; a family that is not imported is not even read."""
    properties = " ".join(f"-p {pattern}" for pattern in ON_INTERFACES.split())
    modules = modules_after(f"verify nts {properties} --examples 2 --seed 1 --jobs 1 --shrink none")
    assert {"contactverif.run.run", "contactverif_nts"} <= modules
    assert not {name for name in modules if name.startswith((*FOR_SOLVING, "contactverif_mortar"))}
    assert "contactverif.mechanics.newton" in modules_after("verify vts-ppt -p patch.flat.solve --examples 1 --seed 1")


@pytest.mark.parametrize("start", [("-m", "contactverif"), ("-c", "from contactverif.cli import main; main()")])
def test_the_version_is_told(start: tuple[str, ...]) -> None:
    assert run_python(*start, "--version") == f"contactverif {__version__}\n"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("contactverif ver", {"verify"}),
        ("contactverif verify vts-ppt-b", {"vts-ppt-basic", "vts-ppt-balanced", "vts-ppt-balanced-3d"}),
        ("contactverif compare nts --against chen", {"chen-hisada"}),
        ("contactverif verify nts -p balance", {"balance.force", "balance.moment"}),
    ],
)
def test_a_shell_completes_commands_formulations_and_properties(words: str, expected: set[str]) -> None:
    typed = {"COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    answer = run_python("-m", "contactverif", _CONTACTVERIF_COMPLETE="complete_bash", **typed)
    assert set(answer.split()) == expected
