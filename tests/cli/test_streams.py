"""Output that cannot be written, a closed pipe, a terminal without Greek: none of them is a traceback."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from asking import Ask, run_inline
from fresh_process import MAIN

FULL = Path("/dev/full")


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


@pytest.mark.skipif(not FULL.exists(), reason="there is no disk that is always full")
def test_a_full_disk_is_one_line_and_rows_that_nobody_can_read_do_not_stop_a_run() -> None:
    with FULL.open("w") as full:
        answer = run_command("list", stdout=full)
        of_run = run_command("verify nts -p balance.* --examples 2 --seed 1", stderr=full)
    assert answer.returncode == 2
    assert answer.stderr == "contactverif: the output cannot be written: No space left on device\n"
    assert of_run.returncode == 0
    assert "\nEvery promise is kept and every property was judged.\n" in of_run.stdout


_INTERRUPTS = """
import signal, sys

class Interrupts:
    def find_spec(self, name, path=None, target=None):
        if name == "typer":
            try:
                signal.raise_signal({number})
            except KeyboardInterrupt:  # Python drops one that arrives in a callback of its import machinery.
                pass

sys.meta_path.insert(0, Interrupts())
signal.signal({number}, signal.SIG_DFL)  # What a shell starts in its background ignores Ctrl-C.
from contactverif.cli import main
main()
"""


@pytest.mark.parametrize(
    ("shell", "words", "status", "line"),
    [
        ("exec", ["-c", _INTERRUPTS.format(number=2)], 130, "stopped, and nothing was judged"),
        ("exec", ["-c", _INTERRUPTS.format(number=15)], 143, "stopped, and nothing was judged"),
        ("exec", ["-OO", "-m", "contactverif", "list"], 2, "python: found -OO, which drops the docstrings; needed .*"),
        ("ulimit -v 350000; exec", ["-m", "contactverif", "list"], 2, "ulimit -v: found 350000 kB; needed at least .*"),
    ],
)
def test_a_start_that_cannot_be_is_one_line(shell: str, words: list[str], status: int, line: str) -> None:
    command = ["sh", "-c", f'{shell} "$@"', "sh", sys.executable, *words]
    answer = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert (answer.returncode, answer.stdout) == (status, "")
    assert re.fullmatch(f"contactverif: {line}\n", answer.stderr), answer.stderr


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
    assert rows == [f"nts {name}" for name in ("balance.force", "balance.moment", "purity", "patch.flat.solve")]
    assert "nts balance.force: pass, 2/2 judged\n" in answer.err
    assert "nts: fails 1 of 4, as it states\n" in answer.out
    assert "2/2 judged" not in answer.out
