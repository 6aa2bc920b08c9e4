"""The terminal: how wide it is, how text is printed, how a table looks, and which colour a result has."""

from __future__ import annotations

import os
import sys
from typing import NoReturn

from rich import box
from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from contactverif.contract.result import Result

STYLES = {  # Red only where the run fails by it. What a formulation states about itself is no news.
    Result.PASS: "green",
    Result.FAIL: "magenta",
    Result.BROKEN_PROMISE: "bold red",
    Result.CRASHED: "red",
    Result.NOT_LOADED: "red",
    Result.NOT_JUDGED: "yellow",
    Result.UNDECIDED: "yellow",
}
PLAIN_STYLE = "dim"  # The style of the other results.
_PIPE_WIDTH = 140  # The number of columns where no terminal says how many there are.


class _Console(Console):
    """A console that raises BrokenPipeError instead of ending the process.

    `cli.main` turns the error into an exit status.
    """

    def on_broken_pipe(self) -> NoReturn:
        raise BrokenPipeError


def show(content: RenderableType) -> None:
    """Print to standard output, as wide as the terminal, or wide enough where there is none."""
    width_is_known = sys.stdout.isatty() or "COLUMNS" in os.environ
    # Words of a plugin may hold square brackets, which are no markup.
    console = _Console(width=None if width_is_known else _PIPE_WIDTH, highlight=False, markup=False)
    console.print(content)


def show_as_it_is(text: Text) -> None:
    """Print without folding a line: a drawing, or a command that is to be copied."""
    _Console(highlight=False, markup=False).print(text, soft_wrap=True)


def plain_table(title: str) -> Table:
    """Return a table without lines that a narrow terminal would break."""
    return Table(
        title=title or None, title_justify="left", title_style="bold", header_style="bold", box=box.SIMPLE_HEAD
    )


def result_text(result: Result, before: str = "") -> Text:
    """Return the word of a result in its colour."""
    return Text(f"{before}{result}", style=STYLES.get(result, PLAIN_STYLE))
