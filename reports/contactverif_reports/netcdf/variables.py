"""The kinds of netCDF variable in a report: numbers with a unit, codes with their meanings, and words.

Words are stored as fixed-width UTF-8 characters, not as netCDF strings: a file with variables of type `string` kills
the process that opens it a second time while it is open (HDFGroup/hdf5#5359, Unidata/netcdf4-python#1444). A user does
that who looks at a report with xarray and replays a case of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from contactverif_reports.netcdf.groups import Variable
from contactverif_reports.netcdf.schema import text

Dims = Sequence[str]


def numbers(
    dims: Dims, values: ArrayLike, long_name: str, units: str, comment: str = "", *, fill: float | None = None
) -> Variable:
    """Return numbers of any dtype; `fill` marks what is not there."""
    return _variable(dims, np.asarray(values), {"long_name": long_name, "units": units}, comment, fill)


def codes(
    dims: Dims,
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


def words(dims: Dims, values: Any, long_name: str, comment: str = "") -> Variable:
    """Return strings: one for no dimensions, a list for one, nested lists for more."""
    characters = np.strings.encode(np.array(_clean_text(values), dtype=np.str_), "utf-8")
    width = max(8, 1 << (characters.dtype.itemsize - 1).bit_length())  # Few widths need few dimensions.
    return _variable(dims, characters.astype(f"S{width}"), {"long_name": long_name}, comment, None)


def _variable(
    dims: Dims, values: NDArray[Any], attributes: dict[str, Any], comment: str, fill: float | None
) -> Variable:
    if comment:
        attributes["comment"] = comment
    if values.dtype.kind == "S":
        attributes["_Encoding"] = "utf-8"
    elif fill is not None:
        attributes["_FillValue"] = values.dtype.type(fill)
    return Variable(tuple(dims), values, attributes)


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


def _clean_text(values: Any) -> Any:
    return text(values) if isinstance(values, str) else [_clean_text(value) for value in values]
