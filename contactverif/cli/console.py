"""The terminal: how wide it is, how text is printed, how a table looks, and which colour a result has.

Whatever a command prints goes through `show`, `show_verbatim` or `echo`, which let no control character of a plugin or
a file reach the terminal.
"""

from __future__ import annotations

import os
import sys
import textwrap
from collections.abc import Callable, Iterable, Sequence
from itertools import groupby
from typing import NoReturn, TypeVar

import typer
from rich import box
from rich.console import Console, RenderableType
from rich.segment import Segment, Segments
from rich.table import Table
from rich.text import Text

from contactverif.contract.errors import printable
from contactverif.contract.result import Result
from contactverif.isolation.host import end_all
from contactverif_reports.tables import PLAIN_STYLE, STYLES

_Item = TypeVar("_Item")
_LINES_OF_A_PLUGIN = 5
_PIPE_WIDTH = 140  # The number of columns where no terminal says how many there are.


class QuietConsole(Console):
    """A console for which words of a plugin are neither markup nor emoji, whatever brackets they hold."""

    def __init__(self, width: int | None = None, *, stderr: bool = False) -> None:
        super().__init__(width=width, stderr=stderr, highlight=False, markup=False, emoji=False)

    def on_broken_pipe(self) -> NoReturn:
        """Raise the error instead of ending the process; `cli.main` turns it into an exit status."""
        raise BrokenPipeError


def show(content: RenderableType) -> None:
    """Print to standard output, as wide as the terminal, or wide enough where there is none."""
    width_is_known = sys.stdout.isatty() or "COLUMNS" in os.environ
    console = QuietConsole(None if width_is_known else _PIPE_WIDTH)
    console.print(_clean(console, content))


def show_verbatim(text: Text) -> None:
    """Print without folding a line: a drawing, or a command that is to be copied."""
    console = QuietConsole()
    console.print(_clean(console, text, soft_wrap=True), soft_wrap=True)


def echo(words: str, *, to_stderr: bool = False) -> None:
    """Print words as they are, without folding a line."""
    typer.echo(printable(words), err=to_stderr)


def print_plugin_output() -> None:
    """End the processes of the plugins, and show the last lines that each of them printed."""
    for name, printed in end_all().items():
        lines = printed.decode(errors="replace").splitlines()[-_LINES_OF_A_PLUGIN:]
        show_verbatim(Text("\n".join([f"the process of {name} printed, at last:", *(f"    {line}" for line in lines)])))


def _clean(console: Console, content: RenderableType, *, soft_wrap: bool = False) -> Segments:
    """Return the lines of a table or text with their styles, and no control character in them."""
    options = console.options.update(no_wrap=True, overflow="ignore") if soft_wrap else console.options
    lines = console.render(content, options)
    return Segments([Segment(printable(line.text), line.style) for line in lines if not line.is_control])


def plain_table(
    title: str = "",
    name: str | None = None,
    *,
    width: int | None = None,
    words: Sequence[str] = (),
    numbers: Sequence[str] = (),
    dense: bool = False,
) -> Table:
    """Return a table without lines that a narrow terminal would break.

    Only the column `name`, at least `width` wide, gives way where the terminal is narrow: a number that is cut off is
    wrong. Behind it are columns of `words`, left-aligned, and of `numbers`, right-aligned.
    """
    table = Table(
        title=title or None, title_justify="left", title_style="bold", header_style="bold", box=box.SIMPLE_HEAD
    )
    if dense:
        table.padding = (0, 1, 0, 0)
    if name is not None:
        table.add_column(name, overflow="fold", min_width=width)
    for word in words:
        table.add_column(word, no_wrap=True)
    for number in numbers:
        table.add_column(number, justify="right", no_wrap=True)
    return table


def add_groups(
    table: Table,
    items: Iterable[_Item],
    heading: Callable[[_Item], str],
    cells: Callable[[_Item], Iterable[RenderableType]],
) -> None:
    """Add a row for each item, and a bold heading above the items of a group, which follow one another."""
    for title, group in groupby(items, heading):
        table.add_row(Text(title, style="bold"))
        for item in group:
            table.add_row(*cells(item))


def line(words: str, style: str = "") -> Text:
    """Return a line that the terminal does not wrap."""
    return Text(words, style=style, no_wrap=True, overflow="ignore")


def indent_below(title: str, *lines: str) -> Text:
    """Return lines below a title and an empty line."""
    return Text("\n".join(["", title, *(f"    {each}" for each in lines)]))


def fold(words: str, width: int, style: str = "", *, indent: int = 6) -> Text:
    """Return words of any length, indented, to stand below a line."""
    lines = textwrap.wrap(words, max(width - indent, 20), break_on_hyphens=False)
    return line("\n".join(" " * indent + each for each in lines), style)


def result_text(result: Result, before: str = "") -> Text:
    """Return the word of a result in its colour."""
    return Text(f"{before}{result}", style=STYLES.get(result, PLAIN_STYLE))
