"""The contract of an item: one table, figure, group of figures, section or defect of the paper.

Rules for the next editor:

1. An item is one file. It computes its data, draws its figures, names its numbers for `paper.nc`, states its claims
   and fills its tables. One line in `items.py` registers it.
2. Everything else in this package (`paper_run`, `paper_tree`, `paper_page`, the template) works on any list of items
   and names none of them.
3. A statement sets side by side what the paper says and what was computed. Its verdict follows from numbers, never
   from the author's hand.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

Progress = Callable[[str], None]  # The callback that reports what comes next, in a few words.
OURS = "ours"  # The source of a figure that the paper does not have.


class Agreement(IntEnum):
    """The verdict on a statement of the paper, compared with what was computed. The file stores these numbers."""

    AGREES = 0
    DIFFERS = 1
    SILENT = 2
    DEFECT = 3
    CONDITIONAL = 4

    @property
    def words(self) -> str:
        """The verdict in words, for a table."""
        return _WORDS[self]

    @classmethod
    def decide(cls, agrees: bool) -> Agreement:
        """Return AGREES or DIFFERS, for a statement that a number decides."""
        return cls.AGREES if agrees else cls.DIFFERS


_WORDS: Mapping[Agreement, str] = {
    Agreement.AGREES: "agrees",
    Agreement.DIFFERS: "differs",
    Agreement.SILENT: "silent",
    Agreement.DEFECT: "defect",
    Agreement.CONDITIONAL: "under a condition",
}


@dataclass(frozen=True, slots=True)
class Statement:
    """A statement of the paper, in our words, beside what was computed."""

    place: str  # Where in the paper: a figure, a section, an equation.
    claim: str  # What the paper says.
    result: str  # What was computed.
    agreement: Agreement  # The verdict.
    figure: str = ""  # File name, without its suffix, of the figure that shows it; empty if none does.
    condition: str = ""  # When the statement holds; empty unless the verdict is CONDITIONAL.

    def __post_init__(self) -> None:
        if bool(self.condition) != (self.agreement is Agreement.CONDITIONAL):
            raise ValueError(f"{self.place}: a condition and the verdict {Agreement.CONDITIONAL.words!r} go together")


@dataclass(frozen=True, slots=True)
class Cell:
    """A cell of a table on the page."""

    values: tuple[str, ...]  # Text, or several values in a row, each in a space of its own.
    details: tuple[str, ...] = ()  # Lines below it, in small letters.
    tone: str = ""  # CSS classes, of "good", "bad", "soft", "strong", "n" (a number, set to the right).


@dataclass(frozen=True, slots=True)
class PageTable:
    """A table of the page: the head of each column, and rows of cells, of which the first is the head of its row."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    title: str = ""

    def __post_init__(self) -> None:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"table {self.caption!r}: each row needs {len(self.columns)} cells")


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """A figure of the page, and how it is drawn from the data of its item."""

    name: str  # File name without suffix.
    source: str  # The paper's figure that it reproduces, or `OURS`.
    caption: str  # What it shows, in whole sentences.
    plot: Callable[[Any], Figure]  # Draws it from the data that the item's `compute` returns.


@dataclass(frozen=True, slots=True)
class Item:
    """An item of the paper, as its file registers it."""

    name: str  # Its group in `paper.nc`.
    title: str  # The heading of its section on the page.
    compute: Callable[[Progress], Any]  # Computes its data and calls `Progress` `n_steps` times.
    statements: Callable[[Any], tuple[Statement, ...]]  # Compares the data with what the paper says.
    # Returns its numbers: {group below its own: dataset}, with "" for its own group.
    datasets: Callable[[Any], Mapping[str, xr.Dataset]]
    figures: tuple[PaperFigure, ...] = ()  # Its figures, in order.
    tables: Callable[[Any], tuple[PageTable, ...]] = lambda _: ()  # Fills its tables.
    text: str = ""  # A paragraph under the heading.
    # {subject: what was chosen where the paper is silent}.
    choices: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    n_steps: int = 1  # The number of times that `compute` reports progress.
    slow: bool = False  # True if it takes long enough for the tests to skip it.


@dataclass(frozen=True, slots=True, eq=False)
class ItemResult:
    """An item with the data that it computed."""

    item: Item
    data: Any
    statements: tuple[Statement, ...]
    tables: tuple[PageTable, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Paper:
    """The results of all items, in the order of the paper, and where they come from."""

    results: tuple[ItemResult, ...]
    provenance: Mapping[str, str]

    @property
    def statements(self) -> tuple[Statement, ...]:
        """The statements of all items."""
        return tuple(statement for result in self.results for statement in result.statements)

    @property
    def figures(self) -> tuple[PaperFigure, ...]:
        """The figures of all items."""
        return tuple(figure for result in self.results for figure in result.item.figures)

    @property
    def choices(self) -> dict[str, str]:
        """{subject: choice} of all items; a subject that several items share stands once."""
        return {subject: choice for result in self.results for subject, choice in result.item.choices.items()}

    def data(self, name: str) -> Any:
        """Return the data of the item of that name."""
        for result in self.results:
            if result.item.name == name:
                return result.data
        raise KeyError(name)


def steps_of(items: tuple[Item, ...]) -> int:
    """Return how many times computing these items and drawing their figures report progress."""
    return sum(item.n_steps + len(item.figures) for item in items)


def sentence(words: str) -> str:
    """Return the words with a capital at their beginning."""
    return words[:1].upper() + words[1:]
