"""Plugins that write where the table of verdicts should be, or where the harness talks to them."""

import ctypes
import itertools
import logging
import os
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress

from hostile_kit import CAUGHT, EITHER, LIKE_NTS, MOST_FILES, Factory, before

_calls = itertools.count(1)


print_lines = before("residual", ends=LIKE_NTS)(
    lambda: print("residual called"), "Print a line to standard output at each call."
)
print_errors = before("residual", ends=LIKE_NTS)(
    lambda: print("residual called", file=sys.stderr), "Print a line to standard error at each call."
)


@before("residual", ends=LIKE_NTS)
def write_to_1_and_2() -> None:
    """Write to the file descriptors 1 and 2, past Python's streams."""
    os.write(1, b"residual called\n")
    os.write(2, b"residual called\n")


print_from_c = before("residual", ends=LIKE_NTS)(
    lambda: ctypes.CDLL(None).printf(b"residual called\n"),
    "Print by C's printf, whose buffer is written at the end of the process.",
)
print_escapes = before("residual", ends=LIKE_NTS)(
    lambda: print(
        "\x1b[2J\x1b[H\x1b]0;all passed\x07\x1b[32mbad\n  patch.flat.transmission passes pass\x1b[0m", flush=True
    ),
    "Clear the terminal, change its title, and print a table of its own.",
)


print_commands = before("residual", ends=LIKE_NTS)(
    lambda: print(" ::error::all is lost\r::add-mask::pass\n##[set-env name=PATH]nowhere", flush=True),
    "Print commands that a workflow of GitHub obeys.",
)


@before("make", ends=CAUGHT)
def print_as_the_box_and_exit() -> None:
    """Print what a box prints that cannot be made, and end the process."""
    os.write(2, b"bwrap: Can not bind mount\n")
    os._exit(1)


@before("residual", ends=LIKE_NTS)
def print_100_megabytes() -> None:
    """Print 100 MB at the first call."""
    if next(_calls) == 1:
        for _ in range(100):
            os.write(1, b"x" * 2**20)


print_in_make = before("make", ends=LIKE_NTS)(lambda: print("made", flush=True), "Print in the factory.")


@before("residual", ends=LIKE_NTS)
def warn() -> None:
    """Warn at each call, each time in other words, and log an error."""
    warnings.warn(f"call {next(_calls)} \x1b[2J", RuntimeWarning, stacklevel=2)
    logging.getLogger("plugin").error("an error \x1b[2J")


close_standard_streams = before("residual", ends=EITHER)(
    lambda: os.closerange(0, 3), "Close the file descriptors 0, 1 and 2."
)
close_all_files = before("residual", ends=EITHER)(
    lambda: os.closerange(0, 101), "Close the file descriptors from 0 to 100, and so the line to the harness too."
)


@before("residual", ends=EITHER)
def close_python_streams() -> None:
    """Close Python's streams, so that a later print fails."""
    for stream in (sys.stdout, sys.stderr, sys.stdin):
        with suppress(Exception):
            stream.close()


def _at_every_file(act: Callable[[int], object], summary: str, *, wait: bool = True, most: int = MOST_FILES) -> Factory:
    """Make a plugin that does something to every open file descriptor but the standard streams."""

    def act_everywhere() -> None:
        for number in range(3, most):
            with suppress(OSError):
                if not wait:
                    os.set_blocking(number, False)
                act(number)
            with suppress(OSError):
                if not wait:
                    os.set_blocking(number, True)

    return before("residual", ends=EITHER)(act_everywhere, summary)


write_rubbish_everywhere = _at_every_file(
    lambda number: os.write(number, b"\xff\x00rubbish" * 1000),
    "Write rubbish to every open file descriptor but the standard streams, and so to the harness.",
    wait=False,
)
announce_a_huge_answer = _at_every_file(
    lambda number: os.write(number, b"\xff\xff\xff\xff\xff\xff\xff\x7f"),
    "Write bytes to every open file descriptor that announce more than a message may hold.",
)
read_everything = _at_every_file(
    lambda number: os.read(number, 2**16),
    "Read from every open file descriptor whatever is there, and so what the harness asks next.",
    wait=False,
)
duplicate_the_output = _at_every_file(
    lambda number: os.dup2(1, number), "Put standard output in the place of every other file descriptor.", most=40
)
