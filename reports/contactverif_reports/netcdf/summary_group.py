"""The groups over all properties: `summary`, one row for each formulation and property, and `timing`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from contactverif.contract.property import Verdict
from contactverif.contract.result import ClosestNumber, Result, Row, Run
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.groups import Group, Variable
from contactverif_reports.netcdf.variables import codes, numbers, words

_ROW = ("formulation", "property")
Table = dict[str, Variable]


class _Grid:
    """The rows of a run as a table, formulation by property; None where a property was not checked."""

    def __init__(self, run: Run) -> None:
        self.formulations, self.properties = run.formulations, run.properties
        rows = run.row_of
        self._rows = [[rows.get((name, id_)) for id_ in self.properties] for name in self.formulations]

    def each(self, read: Callable[[Row], Any], missing: Any) -> list[list[Any]]:
        """Return one entry for each row, and `missing` where there is no row."""
        return [[missing if row is None else read(row) for row in line] for line in self._rows]

    def count(self, read: Callable[[Row], int], long_name: str) -> Variable:
        """Return a variable of numbers of cases."""
        return numbers(_ROW, np.array(self.each(read, 0), dtype=np.int32), long_name, "1")

    def words(self, read: Callable[[Row], str], long_name: str, comment: str = "") -> Variable:
        """Return a variable of words, empty where there is no row."""
        return words(_ROW, self.each(read, ""), long_name, comment)

    def labels(self) -> Table:
        """Return the names along the two dimensions."""
        return {
            "formulation": words(["formulation"], self.formulations, "formulation, as typed on the command line"),
            "property": words(["property"], list(self.properties), "property, as typed with --property"),
        }


def root_attributes(run: Run) -> dict[str, Any]:
    """Return how the run came out, in counts, and where it comes from."""
    attributes: dict[str, Any] = {
        "Conventions": schema.CONVENTIONS,
        "title": schema.TITLE,
        "schema": schema.SCHEMA,
        "promises_kept": "true" if run.promises_kept else "false",
        **{name: np.int32(count) for name, count in _counts(run).items()},
        "comment": schema.ROOT_NOTE,
    }
    origin = {schema.text(name): schema.text(str(value)) for name, value in run.provenance.items()}
    return attributes | {name: value for name, value in origin.items() if name not in attributes}


def _counts(run: Run) -> dict[str, int]:
    """Return numbers of pairs of a formulation and a property."""
    judged = (Verdict.PASS, Verdict.FAIL, Verdict.CRASHED)
    return {
        "n_properties_planned": len(run.rows),
        "n_judged": sum(row.verdict in judged for row in run.rows),
        "n_passed": run.count(Result.PASS),
        "n_failed": run.count(Result.FAIL),
        "n_failed_as_stated": run.count(Result.FAILS_AS_STATED),
        "n_broken_promises": run.count(Result.BROKEN_PROMISE),
        "n_crashed": run.count(Result.CRASHED, Result.WRONG_TRAITS),
        "n_not_judged": run.count(Result.NOT_JUDGED, Result.UNDECIDED),
        "n_not_applicable": run.count(Result.NOT_APPLICABLE),
        "n_not_provided": run.count(Result.NOT_PROVIDED),
        "n_not_loaded": len(run.not_loaded),
    }


def summary_group(run: Run) -> Group:
    """Return counts, verdicts, promises, closest numbers, what the formulations provide, and what did not load."""
    table, attributes = _not_loaded(run)
    attributes["comment"] = (
        "one row for each formulation and property; closest_value is the measured number nearest to its tolerance or "
        "furthest beyond it, among all decided cases"
    )
    grid = _Grid(run)
    if run.formulations:
        table |= grid.labels() | _provided_parts(run)
        attributes["parts"] = "\n".join(
            schema.text(f"{name}: ")
            + ", ".join(f"{part}: {'' if has else 'not '}provided" for part, has in parts.items())
            for name, parts in run.provided.items()
        )
    if run.rows:
        table |= _rows(grid, run) | _closest(grid)
    return Group(table, attributes)


def _rows(grid: _Grid, run: Run) -> Table:
    summaries = [info.summary for info in run.properties.values()]
    counts = grid.each(lambda row: [row.tally.verdicts.get(verdict, 0) for verdict in Verdict], [0] * len(Verdict))
    return {
        "property_summary": words(["property"], summaries, "the property in one line"),
        "verdict": words(["verdict"], list(schema.VERDICTS), "verdict, as in flag_meanings of row_verdict"),
        "row_verdict": codes(
            _ROW,
            grid.each(lambda row: row.verdict, schema.NOT_PLANNED),
            schema.VERDICTS,
            "verdict on the formulation over all cases",
            "crashed and fail first, then not judged, then pass; missing where the property was not checked",
            fill=schema.NOT_PLANNED,
        ),
        "result": grid.words(
            lambda row: str(row.result), "the verdict beside what the formulation states, as tables and pages show it"
        ),
        "promise": codes(
            _ROW,
            grid.each(lambda row: schema.Promise.from_promise(row.promise), schema.Promise.NO_PROMISE),
            schema.PROMISES,
            "what the traits of the formulation say",
            "stated_to_fail names a witness, a case that always runs",
        ),
        "unexpected": grid.words(lambda row: row.unexpected, "why this row makes the run fail", "empty if it does not"),
        "promised_by": grid.words(
            lambda row: row.promised_by, "the traits from which the promise follows", "empty if it is one of everybody"
        ),
        "known": grid.words(lambda row: row.known, "why a failure is known", "empty where none is"),
        "reason": grid.words(lambda row: row.reason, "why the verdict is no pass, in the worst case"),
        "planned": grid.count(lambda row: row.planned, "number of random cases planned"),
        "judged": grid.count(lambda row: row.judged, "number of random cases that were decided"),
        "idle": grid.count(lambda row: row.idle, "number of judged random cases in which nothing was in contact"),
        "contact_share": numbers(
            _ROW,
            grid.each(
                lambda row: schema.NOT_MEASURED if row.contact_share is None else row.contact_share, schema.NOT_MEASURED
            ),
            "share of judged random cases in which something was in contact",
            "1",
            "clearly below the attribute least_contact of the property nothing is judged; missing where no case was",
            fill=schema.NOT_MEASURED,
        ),
        "suspicion": grid.words(
            lambda row: row.suspicion,
            "whether more cases are undecided than those of right formulations",
            "empty if they are not",
        ),
        "count": numbers(
            [*_ROW, "verdict"], np.array(counts, dtype=np.int32), "number of random cases with each verdict", "1"
        ),
    }


def _provided_parts(run: Run) -> Table:
    """Return the parts of the contract that each formulation has; missing where the run does not say it."""
    parts = [
        [run.provided.get(name, {}).get(part, schema.UNSAID) for part in schema.PARTS] for name in run.formulations
    ]
    return {
        "part": words(["part"], schema.PARTS, "part of the contract that a plugin may leave out"),
        "provided": codes(
            ["formulation", "part"],
            parts,
            schema.PROVIDED,
            "whether the formulation has that part",
            "see also parts",
            fill=schema.UNSAID,
        ),
        "sign": codes(
            ["formulation"],
            [int(name in run.opposite_signs) for name in run.formulations],
            schema.SIGNS,
            "sign of the forces",
            "opposite: the slave is pulled towards the master, and the run fails",
        ),
        "diagnosis": words(
            ["formulation"],
            [run.diagnoses.get(name, "") for name in run.formulations],
            "kind of mistake that a formulation makes which fails",
            "empty where no rule knows it",
        ),
    }


def _not_loaded(run: Run) -> tuple[Table, dict[str, str]]:
    if not run.not_loaded:
        return {}, {}
    axis = ["plugin"]
    table = {
        "not_loaded": words(axis, [entry.formulation for entry in run.not_loaded], "plugin that did not load"),
        "not_loaded_reason": words(axis, [entry.reason for entry in run.not_loaded], "why it did not load"),
    }
    lines = [schema.text(f"{entry.formulation}: not loaded: {entry.reason}") for entry in run.not_loaded]
    return table, {"not_loaded": "\n".join(lines)}


def _closest(grid: _Grid) -> Table:
    def each(read: Callable[[ClosestNumber], Any], missing: Any) -> list[list[Any]]:
        return grid.each(lambda row: missing if row.closest is None else read(row.closest), missing)

    name_of_each = each(lambda closest: closest.number.quantity.name, "")
    unit_of_each = each(lambda closest: closest.number.quantity.unit, "")
    units = {unit for line in unit_of_each for unit in line} - {""}
    unit = units.pop() if len(units) == 1 else "see closest_units" if units else schema.RATIO
    cases = each(lambda closest: schema.NO_CASE if closest.case is None else closest.case, schema.NO_CASE)

    def real(read: Callable[[ClosestNumber], float], long_name: str, comment: str = "") -> Variable:
        missing = schema.NOT_MEASURED
        return numbers(_ROW, each(read, missing), long_name, unit, comment, fill=missing)

    return {
        "closest_value": real(
            lambda closest: closest.number.value,
            "number nearest to its tolerance, or furthest beyond it",
            "missing where nothing was measured",
        ),
        "closest_tolerance": real(lambda closest: closest.number.tolerance, "tolerance of closest_value"),
        "closest_quantity": words(_ROW, name_of_each, "name of closest_value"),
        "closest_units": words(_ROW, unit_of_each, "unit of closest_value"),
        "closest_case": numbers(
            _ROW,
            np.array(cases, dtype=np.int32),
            "number of the case with closest_value",
            "1",
            "the index along `case` in the group of the property; missing where it is the witness",
            fill=schema.NO_CASE,
        ),
    }


def timing_group(run: Run) -> Group:
    """Return the seconds of every row and case, the only numbers that depend on a clock."""
    attributes = {"comment": "wall clock; all that two runs with the same seed may differ in"}
    if not run.rows:
        return Group(attrs=attributes)
    grid = _Grid(run)
    n_cases = max(len(row.outcomes) for row in run.rows)
    nothing = [np.nan] * n_cases
    row_seconds = np.array(grid.each(lambda row: row.seconds, np.nan))
    case_seconds = grid.each(
        lambda row: [outcome.seconds for outcome in row.outcomes] + nothing[len(row.outcomes) :], nothing
    )
    shape = (*row_seconds.shape, n_cases)
    table = grid.labels()
    table["row_seconds"] = numbers(
        _ROW, row_seconds, "time spent judging, shrinking excluded", schema.SECONDS, fill=np.nan
    )
    table["case_seconds"] = numbers(
        [*_ROW, "case"],
        np.array(case_seconds, dtype=np.float64).reshape(shape),
        "time spent judging each case",
        schema.SECONDS,
        fill=np.nan,
    )
    return Group(table, attributes)
