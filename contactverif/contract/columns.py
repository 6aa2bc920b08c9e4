"""The codec of columns: many records become the variables of a group, and come back one by one.

A table of `Column` (`contactverif.contract.schema`) says what is stored; the checks of what is read follow from it.
Words are stored as fixed-width UTF-8 characters, not as netCDF strings: a file with variables of type `string` kills
the process that opens it a second time while it is open (HDFGroup/hdf5#5359, Unidata/netcdf4-python#1444). A user does
that who looks at a report with xarray and replays a case of it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactverif.contract.arrays import freeze
from contactverif.contract.schema import NOT_MEASURED, Column, text

Axes = Mapping[str, Sequence[Any]]  # {dimension: what stands along it}; a range where nothing does.


@dataclass(frozen=True)
class Variable:
    """A variable of a group."""

    dims: tuple[str, ...]  # The names of its dimensions.
    values: NDArray[Any]  # Its entries: numbers or words, as bytes where they are to be written.
    attrs: dict[str, Any]  # Its attributes: words, or arrays of numbers.


@dataclass(frozen=True)
class Group(Mapping[str, Variable]):
    """A group of a netCDF file, written or read: a mapping from names to variables."""

    variables: Mapping[str, Variable] = field(default_factory=dict)  # Its variables by name.
    attrs: Mapping[str, Any] = field(default_factory=dict)  # Its attributes: words, or arrays of numbers.

    def __getitem__(self, name: str) -> Variable:
        return self.variables[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.variables)

    def __len__(self) -> int:
        return len(self.variables)

    def words(self, name: str) -> list[str]:
        """Return the entries of a variable as words; none if there is no such variable."""
        return [str(word) for word in self[name].values] if name in self else []

    def labels(self, name: str) -> list[str]:
        """Return the names along a dimension, which are all different."""
        labels = self.words(name)
        if len(set(labels)) != len(labels):
            raise ValueError(f"two of {name} have one name")
        return labels

    @cached_property
    def sizes(self) -> Mapping[str, int]:
        """The lengths of all dimensions of its variables."""
        sizes: dict[str, int] = {}
        for name, variable in self.variables.items():
            for dim, length in zip(variable.dims, variable.values.shape, strict=True):
                if sizes.setdefault(dim, length) != length:
                    raise ValueError(f"{name} is {length} long along {dim}, others {sizes[dim]}")
        return sizes


def numbers(
    dims: Sequence[str],
    values: ArrayLike,
    long_name: str,
    units: str,
    comment: str = "",
    *,
    fill: float | None = None,
) -> Variable:
    """Return numbers of any dtype; `fill` marks what is not there."""
    return _variable(dims, np.asarray(values), {"long_name": long_name, "units": units}, comment, fill)


def codes(
    dims: Sequence[str],
    values: ArrayLike,
    meanings: Mapping[str, int],
    long_name: str,
    comment: str = "",
    *,
    fill: int | None = None,
    bits: bool = False,
) -> Variable:
    """Return small integers, each, or with `bits` each bit of them, with a meaning of one word."""
    attributes = {
        "long_name": long_name,
        "units": "1",
        "flag_masks" if bits else "flag_values": np.array(list(meanings.values()), dtype=np.int8),
        "flag_meanings": " ".join(meanings),
    }
    return _variable(dims, np.asarray(values, dtype=np.int8), attributes, comment, fill)


def words(dims: Sequence[str], values: Any, long_name: str, comment: str = "") -> Variable:
    """Return strings: one for no dimensions, a list for one, nested lists for more."""
    characters = np.strings.encode(np.array(_clean_text(values), dtype=np.str_), "utf-8")
    width = max(8, 1 << (characters.dtype.itemsize - 1).bit_length())  # Few widths need few dimensions.
    return _variable(dims, characters.astype(f"S{width}"), {"long_name": long_name}, comment, None)


def _clean_text(values: Any) -> Any:
    return text(values) if isinstance(values, str) else [_clean_text(value) for value in values]


def _variable(
    dims: Sequence[str], values: NDArray[Any], attributes: dict[str, Any], comment: str, fill: float | None
) -> Variable:
    if comment:
        attributes["comment"] = comment
    if values.dtype.kind == "S":
        attributes["_Encoding"] = "utf-8"
    elif fill is not None:
        attributes["_FillValue"] = values.dtype.type(fill)
    return Variable(tuple(dims), values, attributes)


def value_of(record: Any, path: str) -> Any:
    """Return an attribute of an attribute; None where one on the way is None."""
    for name in path.split("."):
        if record is None:
            return None
        record = getattr(record, name)
    return record


def to_variables(
    table: Sequence[Column],
    records: Sequence[Any],
    dims: Mapping[str, int],
    axes: Axes,
    *,
    prefix: str = "",
    units: Mapping[str, str] | None = None,
) -> dict[str, Variable]:
    """Return the columns of flat records along some dimensions {name: length}; None is no record.

    `axes` has what stands along the further dimensions; a column along one that is empty is left out. `units` takes
    the place of those of some columns.
    """
    variables = {}
    for column in table:
        if column.name and all(len(axes[axis]) for axis in column.axes):
            entries = _array_of(column, records, axes)
            if not column.optional or any(entries):
                unit = (units or {}).get(column.name, column.units)
                variables[f"{prefix}{column.name}"] = _variable_of(column, entries, dims, unit)
    return variables


def _variable_of(column: Column, entries: Any, dims: Mapping[str, int], unit: str) -> Variable:
    all_dims = (*dims, *(() if column.kind == "place" else column.axes))
    shape, meaning, comment = tuple(dims.values()), column.meaning, column.comment
    if column.kind == "words":
        return words(all_dims, np.array(entries, dtype=object).reshape(shape).tolist(), meaning, comment)
    values = entries.reshape((*shape, *entries.shape[1:]))
    if column.meanings is None:
        return numbers(all_dims, values, meaning, unit, comment, fill=column.fill)
    fill = None if column.codes is not None or column.fill is None else int(column.fill)
    return codes(all_dims, values, column.meanings, meaning, comment, fill=fill, bits=column.kind == "bits")


_DTYPES: Mapping[str, type[np.generic]] = {"real": np.float64, "count": np.int32, "code": np.int8}


def _array_of(column: Column, records: Sequence[Any], axes: Axes) -> Any:
    """Return the entries of a column as an array (n_records, …), or as a list of words."""
    if column.kind == "bits":
        masks = zip(column.path.split(), (column.meanings or {}).values(), strict=True)
        sums = [[mask * bool(value_of(record, path)) for record in records] for path, mask in masks]
        return np.sum(sums, axis=0, dtype=np.int8)
    values = [value_of(record, column.path) for record in records]
    if column.kind == "words":
        return ["" if value is None else str(value) for value in values]
    missing = 0 if column.fill is None else column.fill
    if column.kind == "place":
        places = {word: place for place, word in enumerate(axes[column.axes[0]])}
        return np.array([places.get(value, missing) for value in values], np.int32)
    if column.codes is not None:
        return np.array([column.codes[value] for value in values], np.int8)
    if not column.axes:
        return np.array([missing if value is None else value for value in values], _DTYPES[column.kind])
    array = np.full((len(values), *(len(axes[axis]) for axis in column.axes)), missing, _DTYPES[column.kind])
    labels = [{label: place for place, label in enumerate(axes[axis])} for axis in column.axes]
    for target, value in zip(array, values, strict=True):
        _fill_in(target, value, labels)
    return array


def _fill_in(target: NDArray[Any], value: Any, places: Sequence[Mapping[Any, int]]) -> None:
    """Write a series or {name: number or series} into an array; names that have no place are left out."""
    if isinstance(value, Mapping):
        for name, entry in value.items():
            place = places[0].get(name)
            if place is not None and len(places) > 1:
                _fill_in(target[place], entry, places[1:])
            elif place is not None:
                target[place] = entry
    elif value is not None:
        target[: len(value)] = value


def join(tables: Sequence[Mapping[str, Variable]], dim: str) -> dict[str, Variable]:
    """Return the variables of several tables, one behind the other along a dimension that all of them have.

    Words may be left out of a table where all of them are empty.
    """
    samples = {name: variable for table in tables for name, variable in table.items()}
    firsts = [next(iter(table.values())) for table in tables]
    lengths = [first.values.shape[first.dims.index(dim)] for first in firsts]
    joined = {}
    for name, sample in samples.items():
        axis, shape = sample.dims.index(dim), sample.values.shape
        parts = [
            table[name].values if name in table else np.zeros((*shape[:axis], length, *shape[axis + 1 :]), "S8")
            for table, length in zip(tables, lengths, strict=True)
        ]
        joined[name] = Variable(sample.dims, np.concatenate(parts, axis=axis), sample.attrs)
    return joined


class StoredColumns:
    """The columns of a group along some dimensions, by flat number of the record; a ValueError says what is damaged.

    The first column of the table says which records there are: those where it is not missing.
    """

    def __init__(
        self, table: Sequence[Column], group: Group, dims: Sequence[str], axes: Axes, *, prefix: str = ""
    ) -> None:
        self.arrays: dict[str, NDArray[Any]] = {}  # {path: (n_records, …)}
        self._readers: list[tuple[str, Callable[[int], Any]]] = []
        for column in table:
            name = f"{prefix}{column.name}"
            empty = column.optional or any(not len(axes[axis]) for axis in column.axes)
            if not column.name or (empty and name not in group):
                continue
            values = _read_variable(name, column, group[name], tuple(dims), axes)
            if not self.arrays:
                self.present: NDArray[Any] = values != column.fill
            if (flaw := _flaw_of(column, values, values[self.present], axes)) is not None:
                raise ValueError(f"{name} holds {flaw}")
            self.arrays[column.path] = values
            if column.kind == "bits":
                masks = zip(column.path.split(), (column.meanings or {}).values(), strict=True)
                self._readers += [(path, partial(_has_bit, values, mask)) for path, mask in masks]
            else:
                self._readers.append((column.path, _reader_of(column, values, axes)))

    def at(self, number: int) -> dict[str, Any]:
        """Return {path: value} of one record, without what has no variable."""
        return {path: reader(number) for path, reader in self._readers}


def _read_variable(name: str, column: Column, variable: Variable, dims: tuple[str, ...], axes: Axes) -> NDArray[Any]:
    """Return a variable as an array (n_records, …) of the dimensions and the type that its column says."""
    further = () if column.kind == "place" else column.axes
    if variable.dims != (*dims, *further):
        raise ValueError(f"{name} has the dimensions {variable.dims}")
    values = variable.values
    if values.dtype.kind != {"words": "U", "real": "f"}.get(column.kind, "i"):
        raise ValueError(f"{name} is of the type {values.dtype}")
    lengths = values.shape[len(dims) :]
    if lengths != tuple(len(axes[axis]) for axis in further):
        raise ValueError(f"the numbers of {name} are not as many as their names")
    return values.reshape(-1, *lengths)


def _flaw_of(column: Column, values: NDArray[Any], present: NDArray[Any], axes: Axes) -> str | None:
    """Return what is wrong with the numbers of a column, of which `present` are those of a record."""
    match column.kind:
        case "code" if not np.isin(values, [*(column.meanings or {}).values(), int(column.fill or 0)]).all():
            return "a code without a meaning"
        case "bits" if (present & ~sum((column.meanings or {}).values())).any():
            return "a code without a meaning"
        case "place" if ((present < -1) | (present >= len(axes[column.axes[0]]))).any():
            return "a code without a meaning"
        case "count" if (present < 0).any():
            return "a number below 0"
    return None


def _has_bit(values: NDArray[Any], mask: int, number: int) -> bool:
    return bool(values[number] & mask)


def _reader_of(column: Column, values: NDArray[Any], axes: Axes) -> Callable[[int], Any]:
    """Return the function that makes the value of a record by its number."""
    if column.kind == "words":
        return lambda number: str(values[number])
    if column.kind == "place":
        labels = [*axes[column.axes[0]], ""]  # A case of none has the code −1, which is the last.
        return lambda number: labels[values[number]]
    if column.codes is not None:
        by_code = {code: value for value, code in column.codes.items()}
        return lambda number: by_code[int(values[number])]
    if not column.axes:
        return lambda number: values[number].item()
    names = axes[column.axes[0]]
    if len(column.axes) == 2:
        return lambda number: {
            name: freeze(series[:length], np.float64)
            for name, series in zip(names, values[number], strict=True)
            if (length := _length(series))
        }
    if isinstance(names, range):
        return lambda number: tuple(values[number, : _length(values[number])].tolist())
    fill = column.fill
    return lambda number: {
        name: value for name, value in zip(names, values[number].tolist(), strict=True) if value != fill
    }


def _length(series: NDArray[Any]) -> int:
    """Return the number of entries in front of the padding."""
    present = np.flatnonzero(series != NOT_MEASURED)
    return int(present[-1]) + 1 if len(present) else 0
