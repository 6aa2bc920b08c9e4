"""Output that cannot be written, a closed pipe, a terminal without Greek: none of them is a traceback."""

import os
import signal
import subprocess
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
