"""The command line as such: help, version, completion, what it imports; streams that cannot be written.

Modules are counted and not seconds, so that a busy machine changes nothing.
"""

import os
import re
import shlex
import signal
import subprocess
from pathlib import Path

import pytest
from asking import Ask, run_inline
from fresh_process import MAIN, PYTHON

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
SLOW = {"numba", "hypothesis", "numpy", "xarray", "matplotlib", "scipy", "netCDF4", "meshio", "pytest", "pandas"}
FOR_SOLVING = (
    *("contactverif.mechanics", "contactverif.problems.blocks", "contactverif.problems.catalogue"),
    *("contactverif.problems.disk", "contactverif.problems.hertz", "contactverif.studies"),
    *("matplotlib", "meshio", "scipy.sparse.linalg", "skfem", "xarray"),
)
ON_INTERFACES = "balance.* patch.flat.resultant total-stiffness unilateral projection.place purity"
FULL = Path("/dev/full")
with_full_disk = pytest.mark.skipif(not FULL.exists(), reason="there is no disk that is always full")


# ---------------------------------------------------------------------------------------------------------------------
# Help


@pytest.mark.parametrize("page", ["", *cli.COMMANDS])
def test_help_teaches_and_fits_the_terminal(ask: Ask, page: str) -> None:
    answer = ask(f"{page} --help", columns=80)
    assert (answer.status, answer.err) == (0, "")
    assert max(map(len, answer.out.splitlines())) <= 80
    assert "\b" not in answer.out
    assert f"Usage: contactverif {page}".rstrip() in answer.out
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
    assert answer.status == 0 or re.search(r"(ppt.nc|punch.msh|'mine')", answer.err)


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
        ("contactverif verify vts-pp", {"vts-ppt", "vts-ppt-3d", "vts-ppt-basic", "vts-ppt-balanced", "vts-ppt-lm"}),
        ("contactverif compare nts --against chen", {"chen-hisada"}),
        ("contactverif verify nts -p balance", {"balance.force", "balance.moment"}),
    ],
)
def test_a_shell_completes_commands_formulations_and_properties(words: str, expected: set[str]) -> None:
    typed = {"COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    answer = run_python("-m", "contactverif", _CONTACTVERIF_COMPLETE="complete_bash", **typed)
    assert set(answer.split()) == expected


# ---------------------------------------------------------------------------------------------------------------------
# Streams


def run_command(line: str, **settings: object) -> subprocess.CompletedProcess[str]:
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "timeout": 120} | settings
    return subprocess.run([*MAIN, *line.split()], check=False, **options)  # type: ignore[call-overload, no-any-return]


def test_a_terminal_without_greek_is_shown_question_marks() -> None:
    answer = run_command("scenes", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    assert (answer.returncode, answer.stderr) == (0, "")
    assert "?" in answer.stdout
    assert answer.stdout.isascii()


@pytest.mark.parametrize("columns", ["99999999", "9" * 5000])
def test_no_terminal_is_so_wide(ask: Ask, columns: str) -> None:
    answer = ask("verify --help", columns=columns)
    assert (answer.status, answer.err) == (0, "")
    assert max(map(len, answer.out.splitlines())) <= 10_000


@with_full_disk
def test_a_full_disk_is_one_line_and_rows_that_nobody_can_read_do_not_stop_a_run() -> None:
    with FULL.open("w") as full:
        answer = run_command("list", stdout=full)
        of_run = run_command("verify nts -p balance.* --examples 2 --seed 1", stderr=full)
    assert answer.returncode == 2
    assert answer.stderr == "contactverif: the output cannot be written: No space left on device\n"
    assert of_run.returncode == 0
    assert "\nEvery promise is kept and every property was judged.\n" in of_run.stdout


def test_who_has_seen_enough_may_close_the_pipe() -> None:
    read, write = os.pipe()
    os.close(read)
    try:
        answer = run_command("list", stdout=write)
    finally:
        os.close(write)
    assert (answer.returncode, answer.stderr) == (128 + signal.SIGPIPE, "")


def test_rows_appear_on_standard_error_as_they_are_judged_and_those_with_bodies_last() -> None:
    answer = run_inline("verify nts -p patch.flat.solve -p purity -p balance.* --examples 2 --seed 1")
    # A slow machine has further lines of progress.
    rows = [line.partition(":")[0] for line in answer.err.splitlines() if " judged" in line]
    assert rows == [f"nts {name}" for name in ("balance.force", "purity", "balance.moment", "patch.flat.solve")]
    assert "nts balance.force: pass, 2/2 judged\n" in answer.err
    assert "nts: 3 pass, 1 fail as stated\n" in answer.out
    assert "2/2 judged" not in answer.out
