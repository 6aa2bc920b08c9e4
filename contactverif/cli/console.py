"""The terminal: how wide it is, how text is printed, how a table looks, and which colour a result has.

Rule for the next editor: whatever a command prints goes through `show`, `show_as_it_is` or `say`, which let no control
character of a plugin or a file reach the terminal.
"""

from __future__ import annotations

import os
import sys
from typing import NoReturn

import typer
from rich import box
from rich.console import Console, RenderableType
from rich.segment import Segment, Segments
from rich.table import Table
from rich.text import Text

from contactverif.contract.foreign_text import printable
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
    console = _console(None if width_is_known else _PIPE_WIDTH)
    console.print(_clean(console, content))


def show_as_it_is(text: Text) -> None:
    """Print without folding a line: a drawing, or a command that is to be copied."""
    console = _console(None)
    console.print(_clean(console, text, soft_wrap=True), soft_wrap=True)


def say(words: str, *, to_stderr: bool = False) -> None:
    """Print words as they are, without folding a line."""
    typer.echo(printable(words), err=to_stderr)


def _console(width: int | None) -> _Console:
    """Return a console for which words of a plugin are neither markup nor emoji, whatever brackets they hold."""
    return _Console(width=width, highlight=False, markup=False, emoji=False)


def _clean(console: Console, content: RenderableType, *, soft_wrap: bool = False) -> Segments:
    """Return the lines of a table or text with their styles, and no control character in them."""
    options = console.options.update(no_wrap=True, overflow="ignore") if soft_wrap else console.options
    lines = console.render(content, options)
    return Segments([Segment(printable(line.text), line.style) for line in lines if not line.is_control])


def plain_table(title: str) -> Table:
    """Return a table without lines that a narrow terminal would break."""
    return Table(
        title=title or None, title_justify="left", title_style="bold", header_style="bold", box=box.SIMPLE_HEAD
    )


def result_text(result: Result, before: str = "") -> Text:
    """Return the word of a result in its colour."""
    return Text(f"{before}{result}", style=STYLES.get(result, PLAIN_STYLE))
