"""Tells two reports apart: what was measured must be the same, bit by bit, in two runs with the same seed."""

import os
from collections.abc import Iterator
from typing import Any

import numpy as np

from contactverif.contract import schema
from contactverif_reports.netcdf.read import Groups, open_report


def same_data(
    path_a: str | os.PathLike[str], path_b: str | os.PathLike[str], *, names: tuple[str, str] | None = None
) -> list[str]:
    """Return the differences of two reports, a line each; none for two runs with the same seed.

    The group `timing` and the root attributes `created`, `command` and `platform` are left out. `names` stand in the
    lines in place of the paths.
    """
    name_a, name_b = names or (os.fspath(path_a), os.fspath(path_b))
    with open_report(path_a, decode=False) as groups:
        a = dict(_entries(groups))
    with open_report(path_b, decode=False) as groups:
        b = dict(_entries(groups))
    differences = [f"{name}: only in {name_a}" for name in a if name not in b]
    differences += [f"{name}: only in {name_b}" for name in b if name not in a]
    for name in a:
        if name in b and (difference := _difference(a[name], b[name])):
            differences.append(f"{name}: {difference}")
    return differences


def _entries(groups: Groups) -> Iterator[tuple[str, Any]]:
    for path, dataset in groups.items():
        if path == f"/{schema.TIMING}":
            continue
        folder = path.rstrip("/")
        for name, value in dataset.attrs.items():
            if folder or name not in schema.OFF_THE_RECORD:
                yield f"{path}:{name}", value
        for name, size in dataset.sizes.items():
            yield f"{folder}/{name} (dimension)", size
        for name, variable in dataset.variables.items():
            yield f"{folder}/{name}", variable.values
            yield f"{folder}/{name} (dimensions)", " ".join(map(str, variable.dims))
            for attribute, value in variable.attrs.items():
                yield f"{folder}/{name}:{attribute}", value


def _difference(a: Any, b: Any) -> str:
    first, second = np.asarray(a), np.asarray(b)
    if first.shape != second.shape:
        return f"shape {first.shape} and {second.shape}"
    if first.dtype != second.dtype and "U" not in (first.dtype.kind, second.dtype.kind):
        return f"dtype {first.dtype} and {second.dtype}"
    if first.dtype.kind in "OU":
        differ = np.asarray(first != second)
    else:  # Bit by bit: NaN equals NaN, and -0.0 is not 0.0.
        bits = [np.ascontiguousarray(x).reshape(-1).view(np.uint8) for x in (first, second)]
        differ = (bits[0] != bits[1]).reshape(-1, first.itemsize).any(axis=1).reshape(first.shape)
    if not differ.any():
        return ""
    index = tuple(int(places[0]) for places in np.nonzero(np.atleast_1d(differ)))
    values = f"{np.atleast_1d(first)[index]!s} and {np.atleast_1d(second)[index]!s}"
    return values if not first.ndim else f"{values} at {index}, and {int(differ.sum()) - 1} more"
