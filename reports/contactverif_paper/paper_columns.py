"""The declaration of an item's numbers: the annotation of a field says its dimensions, its unit and its meaning once.

`moment: Annotated[FloatArray, Column("formulation tilt", "1", "moment lost")]` tells a reader of the code what the
field holds, and `variables_of` makes a variable of `paper.nc` of it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, get_type_hints

import numpy as np

from contactverif.contract.schema import Group, Variable, codes, numbers, words
from contactverif_paper.paper_formulations import PaperFormulation

WORDS = "words"  # Stands in place of a unit where a field holds words.


@dataclass(frozen=True, slots=True)
class Column:
    """The words of `paper.nc` about a field or property of an item's data."""

    dims: str  # The names of its dimensions, with blanks between them; empty for one number.
    units: str
    meaning: str
    comment: str = ""
    fill: float | None = None  # Marks what is not there.
    meanings: Mapping[str, int] | None = None  # {meaning: code} of a field that holds codes.
    part: str = ""  # The attribute of the field, or of each of its entries, that is stored; empty: all of it.
    name: str = ""  # The name of the variable; empty: that of the field.
    pad: float = np.nan  # Stands behind the end of a row that is shorter than others.

    def variable(self, values: Sequence[Any], dims: str, shape: tuple[int, ...]) -> Variable:
        """Return the variable of the field's values in all cells of a table of that shape; None is a missing cell."""
        values = [None if value is None else _part(value, self.part) for value in values]
        axes = [*dims.split(), *self.dims.split()]
        if self.units == WORDS:
            return words(axes, _shape_entries(values, shape, ""), self.meaning, self.comment)
        if self.meanings is not None:
            array, fill = _shape_entries(values, shape, self.fill), None if self.fill is None else int(self.fill)
            return codes(axes, array, self.meanings, self.meaning, self.comment, fill=fill)
        array = self._pad(values, shape) if shape and self.dims else np.asarray(_shape_entries(values, shape, np.nan))
        if array.dtype.kind == "i":
            array = array.astype(np.int32)
        return numbers(axes, array, self.meaning, self.units, self.comment, fill=self.fill)

    def _pad(self, values: Sequence[Any], shape: tuple[int, ...]) -> np.ndarray[Any, Any]:
        """Return the rows of all cells as one array (*shape, longest)."""
        rows = [np.zeros(0) if value is None else np.atleast_1d(value) for value in values]
        return np.array(list(itertools.zip_longest(*rows, fillvalue=self.pad))).T.reshape(*shape, -1)


def sparse_column(dims: str, units: str, meaning: str, name: str = "") -> Column:
    """Return the column of numbers that are not there in all cells."""
    return Column(dims, units, meaning, "NaN: nothing there", np.nan, name=name)


def name_columns(dims: str) -> tuple[Column, Column]:
    """Return both names of the formulations of a field."""
    return (
        Column(dims, WORDS, "formulation, as on the command line", part="name", name="formulation"),
        Column(dims, WORDS, "its name in the paper's legends", part="legend", name="legend"),
    )


Formulations = Annotated[tuple[PaperFormulation, ...], name_columns("formulation")]


def to_group(data: Any, **attributes: Any) -> Group:
    """Return the columns of an object as a group."""
    return Group(variables_of(data), attributes)


def variables_of(rows: Any, dims: str = "", *, kind: type | None = None) -> dict[str, Variable]:
    """Return the columns of an object, or of nested sequences of objects along `dims`, as variables.

    None stands for a missing object. `kind` is needed where there may be no object at all.
    """
    shape, cells = _flatten(rows, len(dims.split()))
    kind = kind or type(next(cell for cell in cells if cell is not None))
    values = {name: [None if cell is None else getattr(cell, name) for cell in cells] for name, _ in _columns(kind)}
    return {column.name or name: column.variable(values[name], dims, shape) for name, column in _columns(kind)}


def _columns(kind: type) -> Iterator[tuple[str, Column]]:
    """Yield (name, column) of the fields and properties of a class whose annotations hold columns."""
    hints = get_type_hints(kind, include_extras=True)
    for name, member in vars(kind).items():
        if isinstance(member, property):
            hints[name] = get_type_hints(member.fget, include_extras=True).get("return")
    for name, hint in hints.items():
        for mark in getattr(hint, "__metadata__", ()):
            yield from ((name, column) for column in (mark if isinstance(mark, tuple) else (mark,)))


def _flatten(rows: Any, depth: int) -> tuple[tuple[int, ...], list[Any]]:
    """Return the shape of nested sequences, and their entries in a row."""
    shape: tuple[int, ...] = ()
    cells = [rows]
    for _ in range(depth):
        shape = (*shape, len(cells[0]))
        cells = [cell for row in cells for cell in row]
    return shape, cells


def _part(value: Any, part: str) -> Any:
    if not part:
        return value
    return [getattr(entry, part) for entry in value] if isinstance(value, tuple) else getattr(value, part)


def _shape_entries(values: Sequence[Any], shape: tuple[int, ...], missing: Any) -> Any:
    """Return one entry for each cell as nested lists; the value of the only cell for a table without dimensions."""
    if not shape:
        return values[0]
    entries = np.empty(len(values), dtype=object)
    entries[:] = [missing if value is None else value for value in values]
    return entries.reshape(shape).tolist()
