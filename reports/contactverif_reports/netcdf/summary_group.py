"""The groups over all properties: `summary`, one row for each formulation and property, and `timing`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from contactverif.contract.property import Property, Quantity, Verdict, excess
from contactverif.contract.result import Row, Run
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.variables import codes, numbers, words

_ROW = ("formulation", "property")
Rows = Mapping[tuple[str, str], Row]


@dataclass(frozen=True, slots=True)
class Worst:
    """The number that went furthest towards its tolerance, or beyond, among the decided cases of a row."""

    case: int
    quantity: Quantity
    value: float
    tolerance: float


def worst(row: Row) -> Worst | None:
    """The worst number of a row, the first of equals; None where nothing was measured."""
    found: Worst | None = None
    most = -1.0
    for number, outcome in enumerate(row.outcomes):
        if not outcome.decided or outcome.measurement is None:
            continue
        values, tolerances = outcome.measurement.values, outcome.measurement.tolerances
        for quantity in row.question.quantities:
            if quantity.name not in values:
                continue
            value, tolerance = values[quantity.name], tolerances[quantity.name]
            if (how_far := excess(quantity, value, tolerance)) > most:
                found, most = Worst(number, quantity, value, tolerance), how_far
    return found


def summary_group(run: Run, rows: Rows, formulations: Sequence[str], questions: Sequence[Property]) -> xr.Dataset:
    """Counts, verdicts, promises, worst values, what the formulations provide, and what did not load."""
    table, attributes = _not_loaded(run)
    if rows:
        table |= _row_numbers(rows, formulations, questions)
        table |= _provided(run, formulations)
        attributes["parts"] = "\n".join(
            schema.text(f"{name}: ")
            + ", ".join(f"{part}: {'' if has else 'not '}provided" for part, has in _parts(run, name).items())
            for name in formulations
        )
    return xr.Dataset(table, attrs=attributes)


def _row_numbers(rows: Rows, formulations: Sequence[str], questions: Sequence[Property]) -> dict[str, xr.Variable]:
    grid = [[rows.get((name, question.id)) for question in questions] for name in formulations]

    def each(what: Any, missing: Any) -> list[list[Any]]:
        return [[missing if row is None else what(row) for row in line] for line in grid]

    def count(what: Any, long_name: str, comment: str = "") -> xr.Variable:
        return numbers(_ROW, np.array(each(what, 0), dtype=np.int32), long_name, "1", comment)

    worsts = [[None if row is None else worst(row) for row in line] for line in grid]
    table = _labels(formulations, questions)
    table |= {
        "property_summary": words(["property"], [question.summary for question in questions], "what is asked"),
        "verdict": words(["verdict"], list(schema.VERDICTS), "verdict, as in flag_meanings of row_verdict"),
        "row_verdict": codes(
            _ROW,
            each(lambda row: row.verdict, schema.NOT_PLANNED),
            schema.VERDICTS,
            "verdict on the formulation over all cases",
            "crashed and fail first, then not judged, then pass; missing where the property was not asked",
            fill=schema.NOT_PLANNED,
        ),
        "promise": codes(
            _ROW,
            each(lambda row: schema.Promise.of(row.promise), schema.Promise.NO_PROMISE),
            schema.PROMISES,
            "what the traits of the formulation say",
            "said_to_fail names a witness, a case that always runs",
        ),
        "unexpected": words(
            _ROW, each(lambda row: row.unexpected, ""), "why this row makes the run fail", "empty where it does not"
        ),
        "known": words(_ROW, each(lambda row: row.known, ""), "why a failure is known", "empty where none is"),
        "reason": words(_ROW, each(lambda row: row.reason, ""), "why the verdict is no pass, of the worst case"),
        "planned": count(lambda row: row.planned, "number of random cases planned"),
        "judged": count(lambda row: row.judged, "number of random cases that were decided"),
        "count": numbers(
            [*_ROW, "verdict"],
            np.array(each(_counts, [0] * len(Verdict)), dtype=np.int32),
            "number of random cases with each verdict",
            "1",
        ),
    }
    return table | _worst_numbers(worsts)


def _parts(run: Run, formulation: str) -> dict[str, bool]:
    return {part: run.provided.get(formulation, {}).get(part, False) for part in schema.PARTS}


def _provided(run: Run, formulations: Sequence[str]) -> dict[str, xr.Variable]:
    provided = [list(_parts(run, name).values()) for name in formulations]
    return {
        "part": words(["part"], schema.PARTS, "part of the contract that a plugin may leave out"),
        "provided": codes(
            ["formulation", "part"],
            provided,
            schema.PROVIDED,
            "whether the formulation has that part",
            "see also parts",
        ),
    }


def _not_loaded(run: Run) -> tuple[dict[str, xr.Variable], dict[str, str]]:
    comment = (
        "one row for each formulation and property; worst_value is the one nearest to its tolerance or furthest "
        "beyond it, among the decided cases"
    )
    if not run.not_loaded:
        return {}, {"comment": comment}
    one = ["plugin"]
    return {
        "not_loaded": words(one, [entry.formulation for entry in run.not_loaded], "plugin that did not load"),
        "not_loaded_reason": words(one, [entry.reason for entry in run.not_loaded], "why it did not load"),
    }, {
        "comment": comment,
        "not_loaded": "\n".join(
            schema.text(f"{entry.formulation}: not loaded: {entry.reason}") for entry in run.not_loaded
        ),
    }


def timing_group(rows: Rows, formulations: Sequence[str], questions: Sequence[Property]) -> xr.Dataset:
    """Seconds of every row and case, the only numbers that a clock has a say in."""
    attributes = {"comment": "wall clock; all that two runs with the same seed may differ in"}
    if not rows:
        return xr.Dataset(attrs=attributes)
    longest = max(len(row.outcomes) for row in rows.values())
    row_seconds = np.full((len(formulations), len(questions)), np.nan)
    case_seconds = np.full((*row_seconds.shape, longest), np.nan)
    for i, name in enumerate(formulations):
        for j, question in enumerate(questions):
            if (row := rows.get((name, question.id))) is not None:
                row_seconds[i, j] = row.seconds
                case_seconds[i, j, : len(row.outcomes)] = [outcome.seconds for outcome in row.outcomes]
    table = _labels(formulations, questions)
    table["row_seconds"] = numbers(
        _ROW, row_seconds, "time spent judging, shrinking excluded", schema.SECONDS, fill=np.nan
    )
    table["case_seconds"] = numbers(
        [*_ROW, "case"], case_seconds, "time spent judging each case", schema.SECONDS, fill=np.nan
    )
    return xr.Dataset(table, attrs=attributes)


def _labels(formulations: Sequence[str], questions: Sequence[Property]) -> dict[str, xr.Variable]:
    return {
        "formulation": words(["formulation"], formulations, "formulation, as typed on the command line"),
        "property": words(["property"], [question.id for question in questions], "property, as typed with --property"),
    }


def _counts(row: Row) -> list[int]:
    verdicts = [outcome.verdict for outcome in row.outcomes]
    return [verdicts.count(verdict) for verdict in Verdict]


def _worst_numbers(worsts: list[list[Worst | None]]) -> dict[str, xr.Variable]:
    def each(what: Any, missing: Any) -> list[list[Any]]:
        return [[missing if entry is None else what(entry) for entry in line] for line in worsts]

    units = {entry.quantity.unit for line in worsts for entry in line if entry is not None} or {schema.RATIO}
    unit = units.pop() if len(units) == 1 else "see worst_units"
    return {
        "worst_value": numbers(
            _ROW, each(lambda entry: entry.value, np.nan), "worst value", unit, "NaN: nothing decided", fill=np.nan
        ),
        "worst_tolerance": numbers(
            _ROW, each(lambda entry: entry.tolerance, np.nan), "tolerance of the worst value", unit, fill=np.nan
        ),
        "worst_quantity": words(_ROW, each(lambda entry: entry.quantity.name, ""), "what worst_value is"),
        "worst_units": words(_ROW, each(lambda entry: entry.quantity.unit, ""), "unit of worst_value"),
        "worst_case": numbers(
            _ROW,
            np.array(each(lambda entry: entry.case, -1), dtype=np.int32),
            "number of the case with the worst value",
            "1",
            "the index along `case` in the group of the property",
            fill=-1,
        ),
    }
