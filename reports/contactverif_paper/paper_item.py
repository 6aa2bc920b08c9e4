"""The contract of an item: one table, figure, group of figures or section of the paper.

An item computes its data, draws its figures, states its claims and fills its tables; the annotations of its data
declare the variables of `paper.nc`. `items.py` registers it, and nothing on the page or in the template names one.
The verdict on a statement follows from numbers, never from the author's hand.
"""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import Annotated, Any, Self, get_type_hints

import numpy as np
from matplotlib.figure import Figure

from contactverif.contract.schema import Group, Variable, codes, numbers, words

Progress = Callable[[str], None]  # The callback that reports what comes next, in a few words.
OURS = "ours"  # The source of a figure that the paper does not have.
WORDS = "words"  # Stands in place of a unit where a field holds words.


@dataclass(frozen=True, slots=True)
class Column:
    """The words of `paper.nc` about a field or property of an item's data; an annotation holds one, or a tuple."""

    dims: str  # The names of its dimensions, with blanks between them; empty for one number.
    units: str
    meaning: str
    comment: str = ""
    fill: float | None = None  # Marks what is not there.
    meanings: Mapping[str, int] | None = None  # {meaning: code} of a field that holds codes.
    part: str = ""  # The attribute of the field, or of each of its entries, that is stored; empty: all of it.
    name: str = ""  # The name of the variable; empty: that of the field.
    pad: float = np.nan  # Stands behind the end of a row that is shorter than others.

    def variable(self, values: Sequence[Any], dims: str = "", shape: tuple[int, ...] = ()) -> Variable:
        """Return the variable of the field's values in all cells of a table of that shape; None is a missing cell."""
        axes = [*dims.split(), *self.dims.split()]
        if self.part:
            values = [None if value is None else _part(value, self.part) for value in values]
        if shape and self.dims and self.units != WORDS:
            rows = [np.zeros(0) if value is None else np.atleast_1d(value) for value in values]
            entries: Any = np.array(list(itertools.zip_longest(*rows, fillvalue=self.pad))).T.reshape(*shape, -1)
        else:
            missing = "" if self.units == WORDS else np.nan if self.meanings is None else self.fill
            filled = [missing if value is None else value for value in values]
            entries = np.array(filled, dtype=object).reshape(shape).tolist() if shape else values[0]
        if self.units == WORDS:
            return words(axes, entries, self.meaning, self.comment)
        if self.meanings is not None:
            fill = None if self.fill is None else int(self.fill)
            return codes(axes, entries, self.meanings, self.meaning, self.comment, fill=fill)
        array = np.asarray(entries)
        array = array.astype(np.int32) if array.dtype.kind == "i" else array
        return numbers(axes, array, self.meaning, self.units, self.comment, fill=self.fill)


def sparse_column(dims: str, units: str, meaning: str, name: str = "") -> Column:
    """Return the column of numbers that are not there in all cells."""
    return Column(dims, units, meaning, "NaN: nothing there", np.nan, name=name)


def _part(value: Any, part: str) -> Any:
    return [getattr(entry, part) for entry in value] if isinstance(value, tuple) else getattr(value, part)


def variables_of(rows: Any, dims: str = "", *, kind: type | None = None) -> dict[str, Variable]:
    """Return the columns of an object, or of nested sequences of objects along `dims`, as variables.

    None stands for a missing object. `kind` is needed where there may be no object at all.
    """
    shape: tuple[int, ...] = ()
    cells = [rows]
    for _ in dims.split():
        shape = (*shape, len(cells[0]))
        cells = [cell for row in cells for cell in row]
    kind = kind or type(next(cell for cell in cells if cell is not None))
    variables = {}
    for name, column in _columns(kind):
        values = [None if cell is None else getattr(cell, name) for cell in cells]
        variables[column.name or name] = column.variable(values, dims, shape)
    return variables


def _columns(kind: type) -> Iterator[tuple[str, Column]]:
    """Yield (name, column) of the fields and properties of a class whose annotations hold columns."""
    hints = get_type_hints(kind, include_extras=True)
    for name, member in vars(kind).items():
        if isinstance(member, property):
            hints[name] = get_type_hints(member.fget, include_extras=True).get("return")
    for name, hint in hints.items():
        for mark in getattr(hint, "__metadata__", ()):
            yield from ((name, column) for column in (mark if isinstance(mark, tuple) else (mark,)))


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
    def decide(cls, holds: bool, *, always: bool = True) -> Self:
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

    @classmethod
    def of_cells(cls, caption: str, columns: Sequence[str], rows: Iterable[tuple[str, Iterable[Cell]]]) -> Self:
        """Return a table of rows (head, cells)."""
        table = cls(caption, tuple(columns), tuple((Cell((head,)), *cells) for head, cells in rows))
        if any(len(row) != len(columns) for row in table.rows):
            raise ValueError(f"table {caption!r}: each row needs {len(columns)} cells")
        return table

    @classmethod
    def of_numbers(cls, caption: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> Self:
        """Return a table whose rows have a head and, to its right, numbers."""
        return cls.of_cells(caption, columns, [(head, [Cell((t,), tone="n") for t in texts]) for head, *texts in rows])


@dataclass(frozen=True, slots=True)
class PaperFigure:
    """A figure of the page, and how it is drawn from the data of its item."""

    # "fig" and two digits for one of the paper's, else a figure of ours.
    name: Annotated[str, Column("", WORDS, "file name, without its suffix")]
    caption: Annotated[str, Column("", WORDS, "what it shows")]  # In whole sentences.
    plot: Callable[[Any], Figure]  # Draws it from the data that the item's `compute` returns.

    @classmethod
    def define(cls, name: str, caption: str) -> Callable[[Callable[[Any], Figure]], "PaperFigure"]:
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
    compute: Callable[[], Any]  # Computes its data.
    statements: Callable[[Any], Iterable[Statement]]  # Compares the data with what the paper says.
    # Returns its numbers: {name below its own: group}, with "" for its own group. The default is the columns of its
    # data, which has one row or several along `dims`, with `attributes`.
    datasets: Callable[[Any], Mapping[str, Group]] | None = None
    dims: str = ""
    attributes: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    figures: tuple[PaperFigure, ...] = ()  # Its figures, in order.
    tables: Callable[[Any], Iterable[PageTable]] = lambda _: ()  # Fills its tables.
    text: str = ""  # A paragraph under the heading.
    # {subject: what was chosen where the paper is silent}.
    choices: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    slow: bool = False  # True if it takes long enough for the tests to skip it.

    def groups(self, data: Any) -> Mapping[str, Group]:
        """Return its numbers by group."""
        return self.datasets(data) if self.datasets else {"": Group(variables_of(data, self.dims), {**self.attributes})}


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


def sentence(words_: str) -> str:
    """Return the words with a capital at their beginning."""
    return words_[:1].upper() + words_[1:]
