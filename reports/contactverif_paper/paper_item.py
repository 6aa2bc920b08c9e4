"""The contract of an item: one table, figure, group of figures or section of the paper.

An item computes its data, draws its figures, declares its numbers for `paper.nc`, states its claims and fills its
tables. `items.py` registers it; `paper_columns`, `paper_page` and the template name no item. A statement sets side by
side what the paper says and what was computed; its verdict follows from numbers, never from the author's hand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import Annotated, Any

from matplotlib.figure import Figure

from contactverif.contract.schema import Group
from contactverif_paper.paper_columns import WORDS, Column, to_group

Progress = Callable[[str], None]  # The callback that reports what comes next, in a few words.
OURS = "ours"  # The source of a figure that the paper does not have.


class Agreement(IntEnum):
    """The verdict on a statement of the paper, compared with what was computed. The file stores these numbers."""

    AGREES = 0
    DIFFERS = 1
    SILENT = 2
    CONDITIONAL = 4

    @property
    def words(self) -> str:
        """The verdict in words, for a table."""
        return "under a condition" if self is Agreement.CONDITIONAL else self.name.lower()

    @classmethod
    def decide(cls, holds: bool, *, always: bool = True) -> Agreement:
        """Return AGREES or DIFFERS, or CONDITIONAL for what holds but not always."""
        return cls.DIFFERS if not holds else cls.AGREES if always else cls.CONDITIONAL


_MEANINGS = {agreement.words.replace(" ", "_"): int(agreement) for agreement in Agreement}


@dataclass(frozen=True, slots=True)
class Statement:
    """A statement of the paper, in our words, beside what was computed."""

    place: Annotated[str, Column("", WORDS, "where in the paper")]
    claim: Annotated[str, Column("", WORDS, "what the paper says, in our words")]
    result: Annotated[str, Column("", WORDS, "what was computed here")]
    agreement: Annotated[Agreement, Column("", "1", "how claim and result compare", meanings=_MEANINGS)]
    figure: Annotated[str, Column("", WORDS, "file name of the figure here; empty: none")] = ""  # Without its suffix.
    # It is dropped unless the statement holds under a condition only.
    condition: Annotated[str, Column("", WORDS, "when the statement holds; empty: always, or not at all")] = ""

    def __post_init__(self) -> None:
        if self.agreement is not Agreement.CONDITIONAL:
            object.__setattr__(self, "condition", "")
        elif not self.condition:
            raise ValueError(f"{self.place}: the verdict {self.agreement.words!r} needs a condition")


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

    def __post_init__(self) -> None:
        if any(len(row) != len(self.columns) for row in self.rows):
            raise ValueError(f"table {self.caption!r}: each row needs {len(self.columns)} cells")

    @classmethod
    def of_numbers(cls, caption: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> PageTable:
        """Return a table whose rows have a head and, to its right, numbers."""
        cells = tuple((Cell((head,)), *(Cell((text,), tone="n") for text in texts)) for head, *texts in rows)
        return cls(caption, tuple(columns), cells)


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """A figure of the page, and how it is drawn from the data of its item."""

    # "fig" and two digits for one of the paper's, else a figure of ours.
    name: Annotated[str, Column("", WORDS, "file name, without its suffix")]
    caption: Annotated[str, Column("", WORDS, "what it shows")]  # In whole sentences.
    plot: Callable[[Any], Figure]  # Draws it from the data that the item's `compute` returns.

    @classmethod
    def define(cls, name: str, caption: str) -> Callable[[Callable[[Any], Figure]], PaperFigure]:
        """Return a decorator that makes a figure of the function that draws it."""
        return lambda plot: cls(name, caption, plot)

    @property
    def source(self) -> Annotated[str, Column("", WORDS, "the paper's figure, or ours")]:
        """The paper's figure that it reproduces, or `OURS`."""
        number = self.name.removeprefix("fig")
        return f"Fig. {int(number)}" if number.isdecimal() else OURS


@dataclass(frozen=True, slots=True)
class Item:
    """An item of the paper, as its file registers it."""

    name: str  # Its group in `paper.nc`.
    title: str  # The heading of its section on the page.
    compute: Callable[[Progress], Any]  # Computes its data and calls `Progress` `n_steps` times.
    statements: Callable[[Any], Iterable[Statement]]  # Compares the data with what the paper says.
    # Returns its numbers: {name below its own: group}, with "" for its own group. The default is the columns of its
    # data, with `attributes`.
    datasets: Callable[[Any], Mapping[str, Group]] | None = None
    attributes: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    figures: tuple[PaperFigure, ...] = ()  # Its figures, in order.
    tables: Callable[[Any], Iterable[PageTable]] = lambda _: ()  # Fills its tables.
    text: str = ""  # A paragraph under the heading.
    # {subject: what was chosen where the paper is silent}.
    choices: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    n_steps: int = 1  # The number of times that `compute` reports progress.
    slow: bool = False  # True if it takes long enough for the tests to skip it.

    def groups(self, data: Any) -> Mapping[str, Group]:
        """Return its numbers by group."""
        return self.datasets(data) if self.datasets else {"": to_group(data, **self.attributes)}


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
        return {result.item.name: result.data for result in self.results}[name]


def sentence(words: str) -> str:
    """Return the words with a capital at their beginning."""
    return words[:1].upper() + words[1:]
