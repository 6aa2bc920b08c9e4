"""Tables: columns and rows are stated once, and rendered for the terminal, for a page and as Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isnan
from typing import TYPE_CHECKING, Any

from contactverif.contract.result import Result

if TYPE_CHECKING:
    from rich.table import Table as TerminalTable

STYLES = {  # Red only where the run fails by it. What a formulation states about itself is no news.
    Result.PASS: "green",
    Result.FAIL: "magenta",
    Result.BROKEN_PROMISE: "bold red",
    Result.CRASHED: "red",
    Result.WRONG_TRAITS: "red",
    Result.NOT_LOADED: "red",
    Result.NOT_JUDGED: "yellow",
    Result.OMITTED: "yellow",
    Result.UNDECIDED: "yellow",
}
WRONG_RESULTS = {  # {result that makes a run fail: (words for one row, words for several)}
    Result.BROKEN_PROMISE: ("broken promise", "broken promises"),
    Result.CRASHED: ("crash", "crashes"),
    Result.WRONG_TRAITS: ("mistake in the traits", "mistakes in the traits"),
    Result.NOT_JUDGED: ("property not judged", "properties not judged"),
    Result.OMITTED: ("property not asked", "properties not asked"),
    Result.NOT_LOADED: ("plugin not loaded", "plugins not loaded"),
}
PROMISES = {True: "passes", False: "fails", None: "–"}  # {what a formulation states about a property: its word}
PLAIN_STYLE = "dim"  # The style of the other results in the terminal.


@dataclass(frozen=True, slots=True)
class Column:
    """A column: its head, and how its cells stand."""

    head: str
    number: bool = False  # Cells are right-aligned.
    wrap: bool = False  # Cells give way where the terminal is narrow. A number that is cut off would be wrong.
    width: int | None = None  # The least width in the terminal.
    page_head: str = ""  # The head on a page, where it is another one.

    @property
    def html_class(self) -> str:
        """The class of a cell on a page: a number, words that stay in one line, or none."""
        return "n" if self.number else "" if self.wrap else "words"


def numbers(*heads: str) -> tuple[Column, ...]:
    """Return columns of numbers."""
    return tuple(Column(head, number=True) for head in heads)


class Code(str):
    """An id that one types; a page shows it so."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Change:
    """A cell with a value before and after; one that is the same is shown once."""

    old: Any
    new: Any
    style: str = ""  # The colour in the terminal.


@dataclass(frozen=True, slots=True)
class Measured:
    """A cell with a number and what it is."""

    value: float
    name: str


@dataclass(frozen=True, slots=True)
class ResultCell:
    """A cell with the result of a row, in its colour or with its mark."""

    result: Result | None  # None where there is none.
    unexpected: str = ""  # Why the run fails by it.
    differs: bool | None = None  # Whether it is not that of the reference; None where there is none to compare with.


@dataclass(slots=True)
class Table:
    """A table: rows of cells, in groups with a title each.

    A cell is words, a number, a `Change`, a `Measured`, a `ResultCell`, or None; it may also be rich's `Text` or a
    page's `Markup` where only one of the renderers is asked. A number that is not whole gets two digits. A page renders
    a table with the macro `table` of `parts.html.j2`.
    """

    columns: Sequence[Column]
    title: str = ""
    groups: dict[str, list[tuple[Any, ...]]] = field(default_factory=dict)  # {title or "": rows}

    def add(self, *cells: Any, group: str = "") -> None:
        """Add a row to a group."""
        self.groups.setdefault(group, []).append(cells)

    def insert(self, place: int, column: Column, cells: Iterable[Any]) -> None:
        """Insert a column with its cells, row by row."""
        each = iter(cells)
        self.columns = [*self.columns[:place], column, *self.columns[place:]]
        for title, rows in self.groups.items():
            self.groups[title] = [(*row[:place], next(each), *row[place:]) for row in rows]

    def without(self, *heads: str) -> Table:
        """Return the table without some columns."""
        places = [place for place, column in enumerate(self.columns) if column.head not in heads]
        groups = {title: [tuple(row[place] for place in places) for row in rows] for title, rows in self.groups.items()}
        return replace(self, columns=[self.columns[place] for place in places], groups=groups)

    def terminal(self, *, dense: bool = False) -> TerminalTable:
        """Return the table for the terminal, without lines; the names of a group are indented below its title."""
        from rich import box
        from rich.table import Table as TerminalTable
        from rich.text import Text

        table = TerminalTable(
            title=self.title or None, title_justify="left", title_style="bold", header_style="bold", box=box.SIMPLE_HEAD
        )
        if dense:
            table.padding = (0, 1, 0, 0)
        for column in self.columns:
            table.add_column(
                column.head,
                justify="right" if column.number else "left",
                no_wrap=not column.wrap,
                overflow="fold" if column.wrap else "ellipsis",
                min_width=column.width,
            )
        for title, rows in self.groups.items():
            if title:
                table.add_row(Text(title, style="bold"))
            for name, *others in rows:
                table.add_row(*map(_terminal_cell, (f"  {name}" if title else name, *others)))
        return table

    def markdown(self) -> str:
        """Return the table in Markdown; the first column, of names, has no head."""
        others = self.columns[1:]
        lines = [
            f"| | {' | '.join(column.head for column in others)} |",
            f"|---|{''.join('--:|' if column.number else '---|' for column in others)}",
        ]
        rows = [row for group in self.groups.values() for row in group]
        lines += [f"| `{name}` | {' | '.join(map(plain_text, cells))} |" for name, *cells in rows]
        return "\n".join(lines)


def decimal(value: float, digits: int) -> str:
    """Return a number with so many digits, and a plain exponent: 1e-5, 1e6."""
    return re.sub(r"e([+-])0*", lambda match: "e" + match[1].strip("+"), f"{value:.{digits}g}")


def short_number(value: float) -> str:
    """Return two digits; ∞ for a failure without a number, – where there is none."""
    return "–" if isnan(value) else "∞" if value == inf else f"{value:.2g}"


def plain_text(value: Any) -> str:
    """Return a cell in words."""
    match value:
        case None:
            return ""
        case float():
            return short_number(value)
        case Change(old, new):
            before, after = plain_text(old), plain_text(new)
            return after if before == after else f"{before} → {after}"
        case Measured(number, name):
            return f"{short_number(number)} {name}"
        case ResultCell(result, _, differs):
            mark = "" if differs is None else "≠ " if differs else "  "
            return f"{mark}{result or '–'}"
    return str(value)


def _terminal_cell(value: Any) -> Any:
    from rich.text import Text

    match value:
        case ResultCell(result):
            return Text(plain_text(value), style=STYLES.get(result, PLAIN_STYLE) if result else PLAIN_STYLE)
        case Change(style=style):
            return Text(plain_text(value), style=style)
    return value if isinstance(value, Text) else plain_text(value)
