"""The terminal: how wide it is, and how text is printed, without a control character of a plugin or a file."""

import os
import sys
import textwrap
from typing import NoReturn

import typer
from rich.console import Console, Group, RenderableType
from rich.segment import Segment, Segments
from rich.text import Text

from contactverif.contract.errors import printable
from contactverif.isolation.host import end_all

_PIPE_WIDTH = 140  # The number of columns where no terminal says how many there are.


class QuietConsole(Console):
    """A console for which words of a plugin are neither markup nor emoji, whatever brackets they hold."""

    def __init__(self, width: int | None = None, *, stderr: bool = False) -> None:
        super().__init__(width=width, stderr=stderr, highlight=False, markup=False, emoji=False)

    def on_broken_pipe(self) -> NoReturn:
        """Raise the error instead of ending the process; `cli.main` turns it into an exit status."""
        raise BrokenPipeError


def columns() -> int:
    """Return the columns of the terminal, or enough of them where there is none."""
    return _console().width


def show(*contents: RenderableType) -> None:
    """Print to standard output, as wide as the terminal, or wide enough where there is none. A command is never cut."""
    console = _console()
    console.print(_clean(console, Group(*contents)), crop=False)


def _console() -> QuietConsole:
    width_is_known = sys.stdout.isatty() or "COLUMNS" in os.environ
    return QuietConsole(None if width_is_known else _PIPE_WIDTH)


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
        lines = printed.decode(errors="replace").splitlines()[-5:]
        show_verbatim(Text("\n".join([f"the process of {name} printed, at last:", *(f"    {line}" for line in lines)])))


def _clean(console: Console, content: RenderableType, *, soft_wrap: bool = False) -> Segments:
    """Return the lines of a table or text with their styles, and no control character in them."""
    options = console.options.update(no_wrap=True, overflow="ignore") if soft_wrap else console.options
    lines = console.render(content, options)
    return Segments([Segment(printable(line.text), line.style) for line in lines if not line.is_control])


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
