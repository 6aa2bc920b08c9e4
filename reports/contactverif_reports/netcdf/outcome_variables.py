"""The variables that store outcomes: random cases, witnesses and counterexamples are written the same way.

Rule for the next editor: `stored_outcomes` reads all that is written here, and an outcome comes back as it was.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import CaseSummary
from contactverif.contract.counterexample import distinct, typeable
from contactverif.contract.measurement import Finding, Measurement
from contactverif.contract.property import Outcome, PropertyInfo
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.groups import Variable
from contactverif_reports.netcdf.variables import codes, numbers, words

Table = dict[str, Variable]


@dataclass(frozen=True, slots=True)
class SharedNames:
    """The names that all outcomes of a group share, so that random cases and witnesses have the same dimensions."""

    details: tuple[str, ...]  # The further numbers, in the order in which they first occur.
    parameters: tuple[str, ...]  # The parameters that are one number each.
    n_iterates: int  # The length of the longest series.
    kinds: tuple[str, ...] = ()  # The kinds of situation: those that the property declares, then others.
    n_components: int = 0  # The largest number of components of what was found beside what is right.

    @classmethod
    def from_outcomes(cls, info: PropertyInfo, outcomes: Iterable[Outcome]) -> SharedNames:
        """Collect the names, one outcome at a time."""
        details, parameters = dict[str, None](), dict[str, None]()
        kinds, n_iterates, n_components = set[str](), 0, 0
        for outcome in outcomes:
            case = outcome.case_or_summary
            kinds.add(case.kind)
            parameters |= dict.fromkeys(name for name, values in case.parameters.items() if np.size(values) == 1)
            if outcome.measurement is not None:
                details |= dict.fromkeys(outcome.measurement.details)
                n_iterates = max([n_iterates, *map(len, outcome.measurement.series.values())])
                finding = outcome.measurement.finding
                n_components = max(n_components, 0 if finding is None else len(finding.found))
        every_kind = dict.fromkeys([*info.kinds, *sorted(kinds - {""})])
        return cls(tuple(details), tuple(parameters), n_iterates, tuple(every_kind), n_components)


class OutcomeVariables:
    """Makes variables of flat outcomes along some axes {dimension: length}; None is no outcome.

    `prefix` is the beginning of the names of all variables, such as `witness_`.
    """

    def __init__(
        self,
        info: PropertyInfo,
        outcomes: Sequence[Outcome | None],
        axes: Mapping[str, int],
        names: SharedNames,
        prefix: str = "",
    ) -> None:
        self._info, self._outcomes, self._names, self._prefix = info, outcomes, names, prefix
        self._dims, self._shape = tuple(axes), tuple(axes.values())
        self._measurements = [outcome.measurement if outcome is not None else None for outcome in outcomes]

    def table(self, *, with_summaries: bool = True) -> Table:
        """Return all variables; the summaries of the cases only on request."""
        table = self._verdicts() | self._findings() | self._values() | self._details() | self._series()
        if with_summaries:
            table |= self._summaries()
        return {f"{self._prefix}{name}": variable for name, variable in table.items()}

    def _verdicts(self) -> Table:
        verdicts = [schema.NOT_PLANNED if outcome is None else int(outcome.verdict) for outcome in self._outcomes]
        table = {
            "verdict": codes(
                self._dims,
                self._array(verdicts, np.int8),
                schema.VERDICTS,
                "verdict on the case",
                "missing where there is no such case",
                fill=schema.NOT_PLANNED,
            ),
            "state": codes(
                self._dims,
                self._array([_state(outcome) for outcome in self._outcomes], np.int8),
                schema.STATES,
                "how the case was measured",
                "bits: numbers were measured; nothing was in contact; the plugin broke the contract",
                bits=True,
            ),
        }
        reasons = ["" if outcome is None else outcome.reason for outcome in self._outcomes]
        table |= self._words("reason", reasons, "why the verdict is no pass")
        for name, long_name in (
            ("undecided", "why a failure would not be the fault of the formulation"),
            ("broken", "a breach that no number shows"),
        ):
            texts = ["" if item is None else getattr(item, name) for item in self._measurements]
            table |= self._words(name, texts, long_name)
        return table

    def _findings(self) -> Table:
        """Return the places of what was found beside what is right there; nothing where there is none."""
        nothing = Finding("", unit="", found_name="", right_name="")
        findings = [(item and item.finding) or nothing for item in self._measurements]
        table: Table = {}
        for attribute, (name, long_name) in schema.FINDING.items():
            table |= self._words(name, [getattr(finding, attribute) for finding in findings], long_name)
        for name in ("found", "right") if self._names.n_components else ():
            values = _pad([getattr(finding, name) for finding in findings], self._names.n_components)
            comment = "at the place; missing behind the last one"
            table[name] = self._numbers("component", values, f"numbers: {name}", "see finding_unit", comment)
        return table

    def _words(self, name: str, texts: list[str], long_name: str) -> Table:
        """Return a variable of words; nothing where all are empty."""
        if not any(texts):
            return {}
        nested = np.array(texts, dtype=object).reshape(self._shape).tolist()
        return {name: words(self._dims, nested, long_name, "empty where there is nothing to say")}

    def _values(self) -> Table:
        quantities = self._info.quantities
        if not quantities:
            return {}
        names = [quantity.name for quantity in quantities]
        units = {quantity.unit for quantity in quantities}
        unit = units.pop() if len(units) == 1 else "see quantity_units"
        value, tolerance = (self._by_name(names, kind) for kind in ("values", "tolerances"))
        comment = "made from tolerance_formula; for the side see sense"
        return {
            "value": self._numbers("quantity", value, "measured value", unit, "missing where nothing was measured"),
            "tolerance": self._numbers("quantity", tolerance, "tolerance of the value", unit, comment),
        }

    def _details(self) -> Table:
        if not self._names.details:
            return {}
        values = self._by_name(self._names.details, "details")
        comment = "not judged; the property that measured them knows their units"
        return {"detail_value": self._numbers("detail", values, "further numbers", schema.UNKNOWN, comment)}

    def _series(self) -> Table:
        """Return the numbers by iterate; nothing where the property declares none."""
        table: Table = {}
        if not self._names.n_iterates:
            return table
        for name, safe in zip(self._info.series, safe_names(self._info.series), strict=True):
            series = [measurement.series.get(name, ()) if measurement else () for measurement in self._measurements]
            values = _pad(series, self._names.n_iterates)
            long_name = f"{schema.text(name)} at each iterate"
            unit = self._info.series[name]
            table[f"series_{safe}"] = self._numbers("iterate", values, long_name, unit, "missing behind the last one")
        return table

    def _summaries(self) -> Table:
        """Return what kind of case each is: sizes, penalty, and parameters that are one number."""
        summaries = [None if outcome is None else outcome.summary for outcome in self._outcomes]

        def column(
            read: Callable[[CaseSummary], float], missing: float, long_name: str, unit: str = "1", comment: str = ""
        ) -> Variable:
            values = [missing if summary is None else read(summary) for summary in summaries]
            dtype = np.int32 if missing == -1 else np.float64  # Counts and codes are missing as −1.
            return numbers(self._dims, self._array(values, dtype), long_name, unit, comment, fill=missing)

        nothing = schema.NOT_MEASURED
        table = {name: column(attrgetter(name), -1, meaning) for name, meaning in schema.CASE_COUNTS.items()}
        table |= {name: column(attrgetter(name), nothing, *words_) for name, words_ in schema.CASE_REALS.items()}
        for name, safe in zip(self._names.parameters, safe_names(self._names.parameters), strict=True):
            read, long_name = partial(_parameter, name), f"parameter of the case: {schema.text(name)}"
            unit = schema.PARAMETER_UNITS.get(name, schema.UNKNOWN)
            table[f"parameter_{safe}"] = column(read, nothing, long_name, unit)
        if self._names.kinds:
            place = {kind: number for number, kind in enumerate(self._names.kinds)}
            comment = "the index along `kind`; missing where the case is of none"
            long_name = "kind of situation of the case"
            table["case_kind"] = column(lambda case: place.get(case.kind, -1), -1, long_name, "1", comment)
        case_names = ["" if summary is None else summary.name for summary in summaries]
        return table | self._words("case_name", case_names, "name of the case")

    def _by_name(self, names: Sequence[str], kind: str) -> FloatArray:
        """Return numbers by name, (n_outcomes, n_names)."""
        place = {name: column for column, name in enumerate(names)}
        values = np.full((len(self._outcomes), len(names)), schema.NOT_MEASURED)
        for number, measurement in enumerate(self._measurements):
            entries: Mapping[str, float] = {} if measurement is None else getattr(measurement, kind)
            for name, value in entries.items():
                values[number, place[name]] = value
        return values

    def _numbers(self, axis: str, values: FloatArray, long_name: str, unit: str, comment: str) -> Variable:
        """Return numbers along the dimensions and one more."""
        shaped = values.reshape(*self._shape, values.shape[1])
        return numbers([*self._dims, axis], shaped, long_name, unit, comment, fill=schema.NOT_MEASURED)

    def _array(self, entries: list[Any], dtype: type[np.generic]) -> np.ndarray[Any, Any]:
        return np.array(entries, dtype=dtype).reshape(self._shape)


def coordinates(info: PropertyInfo, names: SharedNames) -> Table:
    """Return what stands along `quantity`, `detail`, `series` and `kind`: names, units, formulas and reasons."""
    table: Table = {}
    for name, (attribute, long_name, comment) in schema.QUANTITY.items() if info.quantities else ():
        table[name] = words(["quantity"], [getattr(each, attribute) for each in info.quantities], long_name, comment)
    if names.details:
        table["detail"] = words(["detail"], names.details, "name of the further number")
    if info.series:
        table["series"] = words(["series"], list(info.series), "name of the numbers by iterate, as in series_NAME")
        table["series_units"] = words(["series"], list(info.series.values()), "unit of the numbers by iterate")
    if names.kinds:
        comment = "n_declared: so many of them, the first ones, the property declares"
        table["kind"] = words(["kind"], names.kinds, "kind of situation that cases are of", comment)
        table["kind"].attrs["n_declared"] = np.int32(len(info.kinds))
    if names.parameters:
        long_name = "name of the parameter, as in parameter_NAME"
        table["parameter"] = words(["parameter"], names.parameters, long_name)
    return table


def safe_names(names: Sequence[str] | Mapping[str, Any]) -> list[str]:
    """Return the names as parts of the names of variables, each different."""
    return distinct(map(typeable, names))


def _pad(rows: Sequence[Sequence[float] | FloatArray], width: int) -> FloatArray:
    """Return rows of numbers as an array (n_rows, width)."""
    values = np.full((len(rows), width), schema.NOT_MEASURED)
    for padded, row in zip(values, rows, strict=True):
        padded[: len(row)] = row
    return values


def _parameter(name: str, case: CaseSummary) -> float:
    return case.parameters.get(name, schema.NOT_MEASURED)


def _state(outcome: Outcome | None) -> int:
    if outcome is None:
        return 0
    measurement: Measurement | None = outcome.measurement
    measured = 0 if measurement is None else schema.MEASURED + (schema.IDLE if measurement.idle else 0)
    return measured + (schema.BREACH if outcome.breach else 0)
