"""Gets a counterexample out of a report again, to the last bit, and tells two reports apart."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Verdict
from contactverif_reports.netcdf import schema

_ARGUMENT = "REPORT"
# What netCDF4 and we meet in a file that is not whole: a missing name, a number that means nothing, an HDF error.
_DAMAGE = (AttributeError, LookupError, TypeError, ValueError, RuntimeError, OSError, OverflowError)


@dataclass(frozen=True, slots=True, eq=False)
class StoredCase:
    """A counterexample as it was stored.

    Attributes
    ----------
    case : Case
        Equal to the one that was judged, bit by bit.
    formulation, property_id : str
        As typed on the command line.
    verdict, reason : Verdict or str
        What was found then.
    values, tolerances : Mapping[str, float]
        {quantity: number}, in the units of the property; empty where nothing was measured.
    """

    case: Case
    formulation: str
    property_id: str
    verdict: Verdict
    reason: str
    values: Mapping[str, float]
    tolerances: Mapping[str, float]


def case_ids(path: str | os.PathLike[str]) -> list[str]:
    """Ids of the counterexamples of a report, in the order of the run.

    Raises
    ------
    MisuseError
        If the file is not there, no netCDF file, or no report of this schema.
    """
    with opened(path) as report:
        return list(_group(report, schema.COUNTEREXAMPLES, path).groups)


def read_case(path: str | os.PathLike[str], case_id: str) -> StoredCase:
    """The counterexample of that id.

    Raises
    ------
    MisuseError
        As `case_ids`, and if there is no such id.
    """
    with opened(path) as report:
        groups = _group(report, schema.COUNTEREXAMPLES, path).groups
        if case_id not in groups:
            raise MisuseError("--case", repr(case_id), _ids_that_are(case_id, list(groups)))
        return _stored(groups[case_id], path)


def read_cases(path: str | os.PathLike[str]) -> dict[str, StoredCase]:
    """{id: counterexample} of all of them, in the order of the run.

    Raises
    ------
    MisuseError
        As `case_ids`.
    """
    with opened(path) as report:
        groups = _group(report, schema.COUNTEREXAMPLES, path).groups
        return {case_id: _stored(group, path) for case_id, group in groups.items()}


def same_data(path_a: str | os.PathLike[str], path_b: str | os.PathLike[str]) -> list[str]:
    """What two reports differ in, a line each: nothing, for two runs with the same seed.

    The group `timing` and the root attributes `created`, `command` and `platform` are left out. Numbers are compared
    bit by bit.
    """
    with opened(path_a) as report_a, opened(path_b) as report_b:
        a, b = dict(_entries(report_a, "")), dict(_entries(report_b, ""))
    differences = [f"{name}: only in {os.fspath(path_a)}" for name in a if name not in b]
    differences += [f"{name}: only in {os.fspath(path_b)}" for name in b if name not in a]
    for name in a:
        if name in b and (difference := _difference(a[name], b[name])):
            differences.append(f"{name}: {difference}")
    return differences


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[Any]:
    """The report as a `netCDF4.Dataset` that neither masks nor scales.

    Raises
    ------
    MisuseError
        If the file is not there, no netCDF file, or no report of this schema; and if something is missing or
        damaged in what is read of it within the block.
    """
    import netCDF4

    found = os.fspath(path)
    if not Path(path).is_file():
        what = "which is a folder" if Path(path).is_dir() else "which does not exist"
        raise MisuseError(_ARGUMENT, f"{found}, {what}", "a report that `contactverif verify --out FILE.nc` wrote")
    try:
        report = netCDF4.Dataset(Path(path).resolve())
    except (OSError, RuntimeError) as error:
        raise MisuseError(
            _ARGUMENT, f"{found}, which is no netCDF file or a damaged one ({error})", "a report (netCDF-4)"
        ) from error
    try:
        with report:
            _check_schema(report, found)
            report.set_auto_maskandscale(False)
            yield report
    except MisuseError:
        raise
    except _DAMAGE as error:
        what = " ".join(str(error).split())
        raise MisuseError(_ARGUMENT, f"{found}, which cannot be read ({what})", "an undamaged report") from error


def _check_schema(report: Any, path: str) -> None:
    if str(getattr(report, "title", "")) != schema.TITLE or not hasattr(report, "schema"):
        needed = "a report that `contactverif verify --out FILE.nc` wrote"
        raise MisuseError(_ARGUMENT, f"{path}, a netCDF file of something else", needed)
    if str(report.schema) != schema.SCHEMA:
        raise MisuseError(_ARGUMENT, f"{path} of schema {report.schema}", f"schema {schema.SCHEMA}")


def _stored(group: Any, path: str | os.PathLike[str]) -> StoredCase:
    from contactverif_reports.netcdf.counterexample_groups import ORIGIN

    variables = _group(group, schema.CASE, path).variables
    arrays = {variable.getncattr(ORIGIN): variable[...] for variable in variables.values()}
    case = Case.from_arrays(arrays | {"seed": int(np.asarray(arrays["seed"]).item())})
    values, tolerances = _measured(group)
    return StoredCase(
        case,
        str(group.formulation),
        str(group.property_id),
        Verdict(int(group["verdict"][...])),
        "" if group.reason == schema.NONE else str(group.reason),
        values,
        tolerances,
    )


def _group(parent: Any, name: str, path: str | os.PathLike[str]) -> Any:
    if name not in parent.groups:
        raise MisuseError(_ARGUMENT, f"{os.fspath(path)} without the group {name!r}", "an undamaged report")
    return parent.groups[name]


def _ids_that_are(case_id: str, ids: list[str]) -> str:
    if not ids:
        return "a report with counterexamples; this one has none"
    near = difflib.get_close_matches(case_id, ids, n=3, cutoff=0.4)
    shown = near or ids[:5]
    more = f" (and {len(ids) - len(shown)} more)" if len(ids) > len(shown) else ""
    return f"{'an id like' if near else 'one of'} {', '.join(shown)}{more}"


def _measured(group: Any) -> tuple[dict[str, float], dict[str, float]]:
    """Values and tolerances by name, without what was not measured: both are NaN there."""
    values: dict[str, float] = {}
    tolerances: dict[str, float] = {}
    if "quantity" in group.variables:
        columns = (group[name][...] for name in ("quantity", "value", "tolerance"))
        for name, value, tolerance in zip(*columns, strict=True):
            if not (np.isnan(value) and np.isnan(tolerance)):
                values[str(name)], tolerances[str(name)] = float(value), float(tolerance)
    return values, tolerances


def _entries(group: Any, path: str) -> Iterator[tuple[str, Any]]:
    """(name, value) of every attribute, dimension and variable below."""
    for name in group.ncattrs():
        if path or name not in schema.OFF_THE_RECORD:
            yield f"{path or '/'}:{name}", group.getncattr(name)
    for name, dimension in group.dimensions.items():
        yield f"{path}/{name} (dimension)", len(dimension)
    for name, variable in group.variables.items():
        yield f"{path}/{name}", variable[...]
        yield f"{path}/{name} (dimensions)", " ".join(variable.dimensions)
        for attribute in variable.ncattrs():
            yield f"{path}/{name}:{attribute}", variable.getncattr(attribute)
    for name, child in group.groups.items():
        if path or name != schema.TIMING:
            yield from _entries(child, f"{path}/{name}")


def _difference(a: Any, b: Any) -> str:
    first, second = np.asarray(a), np.asarray(b)
    if first.shape != second.shape:
        return f"shape {first.shape} and {second.shape}"
    if first.dtype != second.dtype and "U" not in (first.dtype.kind, second.dtype.kind):
        return f"dtype {first.dtype} and {second.dtype}"
    if first.dtype.kind in "OU":
        differ = np.asarray(first != second)
    else:  # bit by bit: NaN equals NaN, and -0.0 is not 0.0
        bits = [np.ascontiguousarray(x).reshape(-1).view(np.uint8) for x in (first, second)]
        differ = (bits[0] != bits[1]).reshape(-1, first.itemsize).any(axis=1).reshape(first.shape)
    if not differ.any():
        return ""
    where = tuple(int(index[0]) for index in np.nonzero(np.atleast_1d(differ)))
    found = f"{np.atleast_1d(first)[where]!s} and {np.atleast_1d(second)[where]!s}"
    return found if not first.ndim else f"{found} at {where}, and {int(differ.sum()) - 1} more"
