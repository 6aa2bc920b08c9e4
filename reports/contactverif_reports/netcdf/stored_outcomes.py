"""Outcomes as they are read from a report: each is made from the arrays of its group when somebody asks for it.

A report may hold millions of cases. Made all at once, they would take a hundred times the memory of the arrays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray, freeze
from contactverif.contract.case import Case, CaseSummary
from contactverif.contract.measurement import Finding, Measurement, Quantity
from contactverif.contract.outcomes import Outcomes
from contactverif.contract.property import LEAST_CONTACT, NONE_UNDECIDED, Outcome, PropertyInfo, Verdict
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.groups import Group
from contactverif_reports.netcdf.outcome_variables import safe_names

# The kind of numpy's types of each variable; all others hold reals.
_KINDS = dict.fromkeys(("verdict", "state", *schema.CASE_COUNTS, "case_kind"), "i")
_TEXTS = ("reason", "undecided", "broken", *(name for name, _ in schema.FINDING.values()))
_KINDS |= dict.fromkeys((*_TEXTS, "case_name"), "U")


class OutcomeArrays:
    """The outcomes of a group along some dimensions, by flat number; names of variables begin with `prefix`."""

    def __init__(self, dataset: Group, info: PropertyInfo, dims: Sequence[str], prefix: str = "") -> None:
        self._dataset, self._dims, self._prefix = dataset, tuple(dims), prefix
        self.verdicts = self._read("verdict")
        known = [schema.NOT_PLANNED, *schema.VERDICTS.values()]
        if not np.isin(self.verdicts, known).all():
            raise ValueError(f"{prefix}verdict holds a code without a meaning")
        self._states = self._read("state")
        self._texts = {name: self._read(name) for name in _TEXTS if self._has(name)}
        self._found, self._right = (
            self._read(name, "component") if self._has(name) else np.empty((len(self.verdicts), 0))
            for name in ("found", "right")
        )
        self._quantities = info.quantities
        self._details = dataset.labels("detail")
        self._values, self._tolerances, self._detail_values = (
            self._read(name, axis) if along else np.empty((len(self.verdicts), 0))
            for name, axis, along in (
                ("value", "quantity", self._quantities),
                ("tolerance", "quantity", self._quantities),
                ("detail_value", "detail", self._details),
            )
        )
        self._series = {
            name: self._read(f"series_{safe}", "iterate")
            for name, safe in zip(info.series, safe_names(info.series), strict=True)
            if self._has(f"series_{safe}")
        }
        self._read_summaries()
        self._check()

    def _check(self) -> None:
        """Check what is used only when somebody asks for an outcome."""
        place = f"of {self._prefix}verdict"
        planned = self.verdicts != schema.NOT_PLANNED
        if (self._states[planned] & ~sum(schema.STATES.values())).any():
            raise ValueError(f"the states {place} hold a code without a meaning")
        if self._values.shape[1] != len(self._quantities) or self._detail_values.shape[1] != len(self._details):
            raise ValueError(f"the numbers {place} are not as many as their names")
        measured = self._states & schema.MEASURED != 0
        lacks_tolerance = (self._values != schema.NOT_MEASURED) & (self._tolerances == schema.NOT_MEASURED)
        if lacks_tolerance[planned & measured].any():
            raise ValueError(f"a value {place} has no tolerance")
        if ((self._found == schema.NOT_MEASURED) != (self._right == schema.NOT_MEASURED)).any():
            raise ValueError(f"what was found {place} is not as much as what is right")
        if self._dims:
            kinds = self._case_kinds[planned]
            if ((kinds < -1) | (kinds >= len(self._kinds) - 1)).any():
                raise ValueError(f"the kinds {place} hold a code without a meaning")
            if (self._counts[planned] < 0).any():
                raise ValueError(f"the cases {place} have fewer than no segments")

    def _read_summaries(self) -> None:
        self._parameters = self._dataset.labels("parameter")
        if not self._dims:  # The whole case of a single outcome stands elsewhere.
            return
        self._counts = np.column_stack([self._read(name) for name in schema.CASE_COUNTS])
        columns = (*schema.CASE_REALS, *(f"parameter_{safe}" for safe in safe_names(self._parameters)))
        self._reals = np.column_stack([self._read(name) for name in columns]).astype(np.float64)
        self._case_names = self._read("case_name") if self._has("case_name") else None
        self._kinds = [*self._dataset.labels("kind"), ""]  # A case of none has the code −1, which is the last.
        self._case_kinds = self._read("case_kind") if self._has("case_kind") else np.full(len(self.verdicts), -1)

    def outcome(self, number: int, case: Case | None = None, seconds: float = 0.0) -> Outcome | None:
        """Return an outcome, with the whole case if it is given; None where there is none."""
        verdict = int(self.verdicts[number])
        if verdict == schema.NOT_PLANNED:
            return None
        state = int(self._states[number])
        return Outcome(
            self._summary(number) if case is None else case,
            Verdict(verdict),
            self._text("reason", number),
            self._measurement(number, idle=bool(state & schema.IDLE)) if state & schema.MEASURED else None,
            seconds=seconds,
            breach=bool(state & schema.BREACH),
        )

    def _summary(self, number: int) -> CaseSummary:
        n_slave, n_master = self._counts[number].tolist()
        penalty, largest, shortest, *parameters = self._reals[number].tolist()
        name = "" if self._case_names is None else str(self._case_names[number])
        present, kind = _present(self._parameters, parameters), self._kinds[self._case_kinds[number]]
        return CaseSummary(n_slave, n_master, penalty, largest, shortest, present, name, kind)

    def _measurement(self, number: int, *, idle: bool) -> Measurement:
        pairs = zip(self._quantities, self._values[number].tolist(), self._tolerances[number].tolist(), strict=True)
        return Measurement(
            [quantity.check(value, bound) for quantity, value, bound in pairs if value != schema.NOT_MEASURED],
            undecided=self._text("undecided", number),
            broken=self._text("broken", number),
            details=_present(self._details, self._detail_values[number].tolist()) if self._details else {},
            series={
                name: freeze(values[number, :length], np.float64)
                for name, values in self._series.items()
                if (length := _length(values[number]))
            },
            idle=idle,
            finding=self._finding(number),
        )

    def _finding(self, number: int) -> Finding | None:
        words = {attribute: self._text(name, number) for attribute, (name, _) in schema.FINDING.items()}
        if not words["place"]:
            return None
        found, right = (
            tuple(value for value in values[number].tolist() if value != schema.NOT_MEASURED)
            for values in (self._found, self._right)
        )
        if not found:  # As in reports of schema 2.
            return Finding(words["place"], remark=words["remark"])
        return Finding(found=found, right=right, **words)

    def _text(self, name: str, number: int) -> str:
        return str(self._texts[name][number]) if name in self._texts else ""

    def _has(self, name: str) -> bool:
        return f"{self._prefix}{name}" in self._dataset.variables

    def _read(self, name: str, *axes: str) -> np.ndarray[Any, Any]:
        """Return a variable as an array (n_outcomes, *axes)."""
        variable = self._dataset.variables[f"{self._prefix}{name}"]
        if variable.dims != (*self._dims, *axes):
            raise ValueError(f"{self._prefix}{name} has the dimensions {variable.dims}")
        values: np.ndarray[Any, Any] = variable.values
        if values.dtype.kind not in _KINDS.get(name, "f"):
            raise ValueError(f"{self._prefix}{name} is of the type {values.dtype}")
        return values.reshape(-1, *values.shape[len(self._dims) :])


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


def read_info(dataset: Group) -> PropertyInfo:
    """Return the property of a group."""
    columns = {attribute: dataset.words(name) for name, (attribute, _, _) in schema.QUANTITY.items()}
    needs = str(dataset.attrs["needs"])
    dataset.labels("quantity")
    strangers = set(dataset.words("sense")) - {"at most", "at least"}
    if strangers:
        raise ValueError(f"the sense of a quantity is {strangers.pop()!r}")
    return PropertyInfo(
        str(dataset.attrs["property_id"]),
        str(dataset.attrs["family"]),
        str(dataset.attrs["summary"]),
        tuple(Quantity(**dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)),
        needs=frozenset() if needs == schema.NONE else frozenset(needs.split(", ")),
        series=dict(zip(dataset.labels("series"), dataset.words("series_units"), strict=True)),
        kinds=tuple(dataset.labels("kind")[: int(dataset["kind"].attrs["n_declared"])]) if "kind" in dataset else (),
        # Reports that are older than these two have no such attribute.
        least_contact=float(dataset.attrs.get("least_contact", LEAST_CONTACT)),
        usual_undecided=float(dataset.attrs.get("usual_undecided", NONE_UNDECIDED)),
    )


def _present(names: Sequence[str], values: Sequence[float]) -> dict[str, float]:
    """Return {name: value} without what was not measured."""
    return {name: value for name, value in zip(names, values, strict=True) if value != schema.NOT_MEASURED}


def _length(series: FloatArray) -> int:
    """Return the number of iterates in front of the padding."""
    present = np.flatnonzero(series != schema.NOT_MEASURED)
    return int(present[-1]) + 1 if len(present) else 0
