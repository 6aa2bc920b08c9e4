"""Outcomes in a report, written and read: random cases, witnesses and counterexamples are stored the same way.

A report may hold millions of cases. Made all at once, they would take a hundred times the memory of the arrays, so each
is made from the arrays of its group when somebody asks for it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, get_args

import numpy as np

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, CaseSummary
from contactverif.contract.property import (
    Finding,
    Measurement,
    Outcome,
    Outcomes,
    PropertyInfo,
    Quantity,
    Role,
    Verdict,
)
from contactverif.contract.schema import Axes, Group, StoredColumns, Variable, to_variables, words

Table = dict[str, Variable]


def common_unit(units: Iterable[str], otherwise: str) -> str:
    """Return the unit that all numbers have, else where their units stand."""
    different = set(units)
    return different.pop() if len(different) == 1 else otherwise


def outcome_axes(info: PropertyInfo, outcomes: Iterable[Outcome]) -> Axes:
    """Return what stands along the dimensions of a group, so that random cases and witnesses have the same ones.

    Details and parameters are in the order in which they first occur; the kinds of the property come before others.
    """
    details, parameters = dict[str, None](), dict[str, None]()
    kinds, n_iterates, n_components = set[str](), 0, 0
    for outcome in outcomes:
        case = outcome.case_or_summary
        kinds.add(case.kind)
        parameters |= dict.fromkeys(name for name, values in case.parameters.items() if np.size(values) == 1)
        if (measurement := outcome.measurement) is not None:
            details |= dict.fromkeys(measurement.details)
            n_iterates = max([n_iterates, *map(len, measurement.series.values())])
            n_components = max(n_components, len(measurement.finding.found) if measurement.finding else 0)
    return {
        "quantity": [quantity.name for quantity in info.quantities],
        "detail": list(details),
        "series": list(info.series),
        "iterate": range(n_iterates),
        "component": range(n_components),
        "parameter": list(parameters),
        "kind": list(dict.fromkeys([*info.kinds, *sorted(kinds - {""})])),
    }


def _parameter_units(axes: Axes) -> list[str]:
    return [schema.PARAMETER_UNITS.get(name, schema.UNKNOWN) for name in axes["parameter"]]


def coordinates(info: PropertyInfo, axes: Axes) -> Table:
    """Return what stands along `quantity`, `detail`, `series`, `kind` and `parameter`: names, units, reasons."""
    table: Table = {}
    if info.quantities:
        table |= to_variables(schema.QUANTITY, info.quantities, {"quantity": len(info.quantities)}, {})
    if axes["detail"]:
        table["detail"] = words(["detail"], axes["detail"], "name of the further number")
    if info.series:
        table["series"] = words(["series"], list(info.series), "name of the numbers by iterate")
        table["series_units"] = words(["series"], list(info.series.values()), "unit of the numbers by iterate")
    if axes["kind"]:
        comment = "n_declared: so many of them, the first ones, the property declares"
        table["kind"] = words(["kind"], axes["kind"], "kind of situation that cases are of", comment)
        table["kind"].attrs["n_declared"] = np.int32(len(info.kinds))
    if axes["parameter"]:
        table["parameter"] = words(["parameter"], axes["parameter"], "name of the parameter")
        table["parameter_units"] = words(["parameter"], _parameter_units(axes), "unit of the parameter")
    return table


def outcome_variables(
    info: PropertyInfo,
    outcomes: Sequence[Outcome | None],
    dims: Mapping[str, int],
    axes: Axes,
    prefix: str = "",
    *,
    with_cases: bool = True,
) -> Table:
    """Return the variables of flat outcomes along some dimensions; None is no outcome."""
    unit = common_unit((quantity.unit for quantity in info.quantities), "see quantity_units")
    units = {
        "value": unit,
        "tolerance": unit,
        "series_value": common_unit(info.series.values(), "see series_units"),
        "parameter_value": common_unit(_parameter_units(axes), "see parameter_units"),
    }
    table = schema.OUTCOME + (schema.CASE_COLUMNS if with_cases else ())
    summaries = [outcome and replace(outcome, case_or_summary=outcome.summary) for outcome in outcomes]  # Made once.
    return to_variables(table, summaries, dims, axes, prefix=prefix, units=units)


class OutcomeArrays:
    """The outcomes of a group along some dimensions, by flat number; names of variables begin with `prefix`."""

    def __init__(self, group: Group, info: PropertyInfo, dims: Sequence[str], prefix: str = "") -> None:
        self._info = info
        axes: Axes = {
            "quantity": [quantity.name for quantity in info.quantities],
            "detail": group.labels("detail"),
            "series": list(info.series) if f"{prefix}series_value" in group else [],
            "parameter": group.labels("parameter"),
            "kind": group.labels("kind"),
            **{axis: range(group.sizes.get(axis, 0)) for axis in ("iterate", "component")},
        }
        # The whole case of a single outcome stands elsewhere.
        table = schema.OUTCOME + (schema.CASE_COLUMNS if dims else ())
        self._columns = StoredColumns(table, group, dims, axes, prefix=prefix)
        arrays = self._columns.arrays
        self.verdicts = arrays["verdict"]
        values, tolerances, found, right = (
            arrays.get(f"measurement.{name}", np.empty(0)) == schema.NOT_MEASURED
            for name in ("values", "tolerances", "finding.found", "finding.right")
        )
        if (~values & tolerances).any():
            raise ValueError(f"a value of {prefix}verdict has no tolerance")
        if (found != right).any():
            raise ValueError(f"what was found of {prefix}verdict is not as much as what is right")

    def outcome(self, number: int, case: Case | None = None, seconds: float = 0.0) -> Outcome | None:
        """Return an outcome, with the whole case if it is given; None where there is none."""
        if not self._columns.present[number]:
            return None
        values = self._columns.at(number)
        return Outcome(
            CaseSummary(**_fields_of("summary", values)) if case is None else case,
            Verdict(values["verdict"]),
            values.get("reason", ""),
            self._measurement(values) if values["measurement"] else None,
            seconds=seconds,
            breach=values["breach"],
        )

    def _measurement(self, values: Mapping[str, Any]) -> Measurement:
        fields = _fields_of("measurement", values)
        measured, tolerances = fields.pop("values", {}), fields.pop("tolerances", {})
        finding = {"unit": "", "found_name": "", "right_name": "", **_fields_of("measurement.finding", values)}
        return Measurement(
            [
                each.check(measured[each.name], tolerances[each.name])
                for each in self._info.quantities
                if each.name in measured
            ],
            finding=Finding(**finding) if finding.get("place") else None,
            **fields,
        )


def _fields_of(owner: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return {attribute: value} of the attributes of one record in the record."""
    parts = ((path.rpartition("."), value) for path, value in values.items())
    return {name: value for (its_owner, _, name), value in parts if its_owner == owner}


class StoredOutcomes(Outcomes):
    """The outcomes of one row, in the order of the run.

    `first` is the flat number of the first, and `named` has the cases that the report stores whole, by their names.
    """

    def __init__(
        self, arrays: OutcomeArrays, first: int, n_cases: int, seconds: FloatArray, named: Mapping[str, Case]
    ) -> None:
        self._arrays, self._first, self._n_cases, self._seconds = arrays, first, n_cases, seconds
        self._named = named

    def __len__(self) -> int:
        return self._n_cases

    def at(self, number: int) -> Outcome:
        """Return an outcome, with its case if the report stores that whole."""
        outcome = self._arrays.outcome(self._first + number, seconds=float(self._seconds[number]))
        assert outcome is not None
        case = self._named.get(outcome.summary.name)
        return outcome if case is None else replace(outcome, case_or_summary=case)


def read_info(group: Group) -> PropertyInfo:
    """Return the property of a group."""
    columns = {column.path: group.words(column.name) for column in schema.QUANTITY}
    needs = str(group.attrs["needs"])
    group.labels("quantity")
    strangers = set(group.words("sense")) - {"at most", "at least"}
    if strangers:
        raise ValueError(f"the sense of a quantity is {strangers.pop()!r}")
    roles = [role for role in get_args(Role) if (role or schema.NONE) == str(group.attrs["role"])]
    if not roles:
        raise ValueError(f"the role of a property is {group.attrs['role']!r}")
    return PropertyInfo(
        str(group.attrs["property_id"]),
        str(group.attrs["family"]),
        str(group.attrs["summary"]),
        tuple(Quantity(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)),
        needs=frozenset() if needs == schema.NONE else frozenset(needs.split(", ")),
        series=dict(zip(group.labels("series"), group.words("series_units"), strict=True)),
        kinds=tuple(group.labels("kind")[: int(group["kind"].attrs["n_declared"])]) if "kind" in group else (),
        least_contact=float(group.attrs["least_contact"]),
        usual_undecided=float(group.attrs["usual_undecided"]),
        rank=float(group.attrs["rank"]),
        role=roles[0],
    )
