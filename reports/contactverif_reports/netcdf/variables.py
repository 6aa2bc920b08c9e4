"""The kinds of netCDF variable in a report: numbers with a unit, codes with their meanings, flags, and words.

Words are stored as fixed-width UTF-8 characters, not as netCDF strings: a file with variables of type `string` kills
the process that opens it a second time while it is open (HDFGroup/hdf5#5359, Unidata/netcdf4-python#1444). A user does
that who looks at a report with xarray and replays a case of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from contactverif_reports.netcdf.schema import text

Dims = Sequence[str]
_WORTH_COMPRESSING = 4096  # Bytes of words from which on they are compressed, which costs 2 kB of bookkeeping.


def numbers(
    dims: Dims, values: ArrayLike, long_name: str, units: str, comment: str = "", *, fill: float | None = None
) -> xr.Variable:
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
) -> xr.Variable:
    """Return small integers, each with a meaning of one word."""
    attributes = {
        "long_name": long_name,
        "units": "1",
        "flag_values": np.array(list(meanings.values()), dtype=np.int8),
        "flag_meanings": " ".join(meanings),
    }
    return _variable(dims, np.asarray(values, dtype=np.int8), attributes, comment, fill)


def flags(dims: Dims, values: ArrayLike, meanings: Mapping[str, int], long_name: str, comment: str = "") -> xr.Variable:
    """Return small integers whose bits have a meaning of one word each."""
    attributes = {
        "long_name": long_name,
        "units": "1",
        "flag_masks": np.array(list(meanings.values()), dtype=np.int8),
        "flag_meanings": " ".join(meanings),
    }
    return _variable(dims, np.asarray(values, dtype=np.int8), attributes, comment, None)


def words(dims: Dims, values: Any, long_name: str, comment: str = "") -> xr.Variable:
    """Return strings: one for no dimensions, a list for one, nested lists for more."""
    characters = np.strings.encode(np.array(_clean_text(values), dtype=np.str_), "utf-8")
    width = max(8, 1 << (characters.dtype.itemsize - 1).bit_length())  # Few widths need few dimensions.
    return _variable(dims, characters.astype(f"S{width}"), {"long_name": long_name}, comment, None)


def _variable(
    dims: Dims, values: NDArray[Any], attributes: dict[str, Any], comment: str, fill: float | None
) -> xr.Variable:
    if comment:
        attributes["comment"] = comment
    encoding: dict[str, Any] = {}
    is_words = values.dtype.kind == "S"
    if is_words:
        attributes["_Encoding"] = "utf-8"
    elif fill is None:
        encoding["_FillValue"] = None
    else:  # As an attribute: as an encoding xarray would write it in place of every NaN.
        attributes["_FillValue"] = values.dtype.type(fill)
    return xr.Variable(dims, values, attributes, encoding | _compression(values))


def _compression(values: NDArray[Any]) -> dict[str, Any]:
    is_small = values.dtype.kind == "S" and values.nbytes < _WORTH_COMPRESSING
    return {} if is_small or not values.ndim else {"zlib": True, "complevel": 4}


def join(tables: Sequence[Mapping[str, xr.Variable]], dim: str) -> dict[str, xr.Variable]:
    """Return the variables of several tables, one behind the other along a dimension that all of them have.

    Words may be left out of a table where all of them are empty.
    """
    samples = {name: variable for table in tables for name, variable in table.items()}
    lengths = [next(iter(table.values())).sizes[dim] for table in tables]
    joined = {}
    for name, sample in samples.items():
        axis = sample.dims.index(dim)
        parts = [
            table[name].values if name in table else np.zeros(_with_length(sample.shape, axis, length), "S8")
            for table, length in zip(tables, lengths, strict=True)
        ]
        values = np.concatenate(parts, axis=axis)
        joined[name] = xr.Variable(sample.dims, values, sample.attrs, sample.encoding | _compression(values))
    return joined


def _with_length(shape: tuple[int, ...], axis: int, length: int) -> tuple[int, ...]:
    return (*shape[:axis], length, *shape[axis + 1 :])


def _clean_text(values: Any) -> Any:
    return text(values) if isinstance(values, str) else [_clean_text(value) for value in values]
