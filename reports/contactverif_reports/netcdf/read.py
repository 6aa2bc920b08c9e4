"""The reader of reports: it makes the `Run` again that was written, to the last bit.

Rules for the next editor:

- A child process opens the file, see `file_groups`; here are arrays, and none is believed before it is checked.
- Whatever is wrong with a file is a `MisuseError` in one line. What is read only when somebody asks for it, such as an
  outcome, is checked when the file is read.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, replace
from typing import Any

import numpy as np

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.counterexample import (
    Counterexample,
    Origin,
    counterexamples,
    find_counterexample,
    named_failures,
)
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Outcome, PropertyInfo, Verdict
from contactverif.contract.result import NodalForces, NotLoaded, Row, Run
from contactverif.contract.schema import Group, StoredColumns
from contactverif_reports.netcdf.file_groups import read_groups
from contactverif_reports.netcdf.stored_cases import case_of_group, read_forces, read_named_cases
from contactverif_reports.netcdf.stored_outcomes import OutcomeArrays, StoredOutcomes, read_info
from contactverif_reports.netcdf.write import root_attributes

Groups = Mapping[str, Group]
_ROW = tuple(column for column in schema.ROW if column.path in {field.name for field in fields(Row)})

_ARGUMENT = "REPORT"
_NEEDED = "a report that `contactverif verify --out FILE.nc` wrote"
# What a file that is not whole leads to: a missing name, an array of another shape, a number that means nothing.
_DAMAGE = (AttributeError, LookupError, TypeError, ValueError, RuntimeError, ArithmeticError, AssertionError)
_LONGEST_REASON = 300  # Characters: a reason may quote what the file holds.


def read_run(path: str | os.PathLike[str], *, consistent: bool = True) -> Run:
    """Return the run that a report stores; only an audit reads one whose verdicts and counts may disagree."""
    with open_report(path) as groups:
        return _Reader(groups, consistent=consistent).run()


def read_case(path: str | os.PathLike[str], case_id: str) -> Counterexample:
    """Return the counterexample of that id."""
    return find_counterexample(read_run(path), case_id)


def case_ids(path: str | os.PathLike[str]) -> list[str]:
    """Return the ids of the counterexamples of a report, in the order of the run, then those of named cases."""
    run = read_run(path)
    return list({**counterexamples(run), **named_failures(run)})


@contextmanager
def open_report(path: str | os.PathLike[str], *, decode: bool = True) -> Iterator[Groups]:
    """Yield the groups of a report {path: dataset}, loaded; the file is closed already."""
    name = os.fspath(path)
    groups = read_groups(path, _ARGUMENT, _NEEDED, decode=decode)
    try:
        _check_schema(groups["/"], name)
        yield groups
    except _DAMAGE as error:
        if isinstance(error, MisuseError) and error.argument == _ARGUMENT:
            raise
        description = f"{name}, which cannot be read ({_describe(error)})"
        raise MisuseError(_ARGUMENT, description, "an undamaged report") from error


def _describe(error: Exception) -> str:
    """Return in one line what is wrong with a report, which a part of the reader has said by an error."""
    match error:
        case KeyError():
            words = f"{error} is missing"
        case MisuseError():
            words = error.found
        case ValueError():
            words = f"{error}"
        case _:
            words = f"{type(error).__name__}: {error}"
    return " ".join(words.split())[:_LONGEST_REASON]


def _check_schema(root: Group, path: str) -> None:
    if str(root.attrs.get("title", "")) != schema.TITLE or "schema" not in root.attrs:
        raise MisuseError(_ARGUMENT, f"{path}, a netCDF file of something else", _NEEDED)
    version = str(root.attrs["schema"])
    if version.isdecimal() and int(version) < int(schema.SCHEMA):
        needed = f"schema {schema.SCHEMA}; run the same command again to write the report anew"
        raise MisuseError(_ARGUMENT, f"{path} of schema {version}, which an older contactverif wrote", needed)
    if version != schema.SCHEMA:
        raise MisuseError(
            _ARGUMENT, f"{path} of schema {version}", f"schema {schema.SCHEMA}; install a newer contactverif"
        )


class _Reader:
    """Makes a run of the groups of a report."""

    def __init__(self, groups: Groups, *, consistent: bool) -> None:
        self._consistent = consistent
        for name in (schema.SUMMARY, schema.COUNTEREXAMPLES, schema.TIMING):
            if f"/{name}" not in groups:
                raise MisuseError(_ARGUMENT, f"a report without the group {name!r}", "an undamaged report")
        self._root, self._summary, self._timing = (groups[name] for name in ("/", "/summary", "/timing"))
        self._properties = {
            str(dataset.attrs["property_id"]): dataset
            for name, dataset in groups.items()
            if "property_id" in dataset.attrs and not name.startswith(f"/{schema.COUNTEREXAMPLES}/")
        }
        self._examples = _examples(groups)
        self._named = read_named_cases(groups)
        if "property" in self._summary:
            self._rows = StoredColumns(_ROW, self._summary, ("formulation", "property"), {})

    def run(self) -> Run:
        """Return the run."""
        formulations, properties = (self._summary.labels(name) for name in ("formulation", "property"))
        names, reasons = (self._summary.words(name) for name in ("not_loaded", "not_loaded_reason"))
        by_formulation: list[dict[int, Row]] = [{} for _ in formulations]
        for j, property_id in enumerate(properties):
            for i, row in self._rows_of(j, property_id, formulations, len(properties)):
                by_formulation[i][j] = row
        run = Run(
            rows=tuple(row for rows in by_formulation for row in rows.values()),
            not_loaded=tuple(NotLoaded(*entry) for entry in zip(names, reasons, strict=True)),
            **self._facts_of(formulations),
        )
        written = root_attributes(run)
        if self._consistent:
            self._check(run, written)
        origin = {str(name): str(value) for name, value in self._root.attrs.items() if name not in written}
        return replace(run, provenance=origin)

    def _check(self, run: Run, written: Mapping[str, Any]) -> None:
        """Check what the file says twice: the counterexamples, and the counts of the root."""
        stored = {(example.formulation, example.property_id) for example in counterexamples(run).values()}
        if stored != self._examples.keys():
            raise ValueError("the counterexamples are not those of the rows")
        for name, value in written.items():
            if name.startswith("n_") and int(self._root.attrs.get(name, value)) != value:
                raise ValueError(f"{name} is {self._root.attrs[name]}, and the rows say {value}")

    def _rows_of(
        self, j: int, property_id: str, formulations: list[str], n_properties: int
    ) -> Iterator[tuple[int, Row]]:
        """Yield the rows of a property, with the number of the formulation."""
        group = self._properties[property_id]
        info = read_info(group)
        outcomes = OutcomeArrays(group, info, ("formulation", "case"))
        witnesses = OutcomeArrays(group, info, ("formulation",), "witness_") if "witness_verdict" in group else None
        n_cases = group.sizes["case"]
        named = {name: case for (id_, name), case in self._named.items() if id_ == property_id}
        codes = outcomes.verdicts.reshape(len(formulations), n_cases)
        for i, formulation in enumerate(formulations):
            if not self._rows.present[i * n_properties + j]:
                continue
            values = self._rows.at(i * n_properties + j)
            shrunk, first, case = self._example(formulation, property_id, info)
            length = self._n_outcomes(i, j, property_id, codes[i])
            yield (
                i,
                Row(
                    formulation=formulation,
                    info=info,
                    outcomes=StoredOutcomes(outcomes, i * n_cases, length, self._case_seconds(i, j, length), named),
                    witness=None if witnesses is None else witnesses.outcome(i, case),
                    shrunk=shrunk,
                    first=first,
                    seconds=float(self._timing["row_seconds"].values[i, j]),
                    forces=self._forces(formulation, property_id),
                    **{**values, "verdict": Verdict(values["verdict"])},
                ),
            )

    def _n_outcomes(self, i: int, j: int, property_id: str, codes: np.ndarray[Any, Any]) -> int:
        """Return the number of outcomes of a row, checked against what the summary counts."""
        length = int((codes != schema.NOT_PLANNED).sum())
        counts = np.bincount(codes[:length].clip(0), minlength=len(schema.VERDICTS))
        wrong = self._consistent and (counts != self._summary["count"].values[i, j]).any()
        if wrong or (codes[:length] == schema.NOT_PLANNED).any():
            raise ValueError(f"the verdicts of {property_id} are not those that the summary counts")
        return length

    def _example(
        self, formulation: str, property_id: str, info: PropertyInfo
    ) -> tuple[Outcome | None, Outcome | None, Case | None]:
        """Return the shrunk case, the first one and that of the witness, of which a report stores one at most."""
        if (formulation, property_id) not in self._examples:
            return None, None, None
        dataset, case = self._examples[formulation, property_id]
        origin = Origin(str(dataset.attrs["origin"]))
        if origin in (Origin.WITNESS, Origin.EARLIER):
            return None, None, case
        outcome = OutcomeArrays(dataset, info, ()).outcome(0, case)
        return (outcome, None, None) if origin is Origin.SHRUNK else (None, outcome, None)

    def _forces(self, formulation: str, property_id: str) -> NodalForces | None:
        example = self._examples.get((formulation, property_id))
        return None if example is None else read_forces(*example)

    def _case_seconds(self, i: int, j: int, n_cases: int) -> FloatArray:
        seconds: FloatArray = self._timing["case_seconds"].values[i, j, :n_cases]
        if len(seconds) != n_cases:
            raise ValueError("case_seconds is too short")
        return seconds

    def _facts_of(self, formulations: list[str]) -> dict[str, Any]:
        """Return what is known of whole formulations: parts that they provide, opposite signs, diagnoses."""
        if not formulations:
            return {}
        parts, codes = self._summary.words("part"), self._summary["provided"].values.tolist()
        opposite = (self._summary["sign"].values == schema.SIGNS["opposite"]).tolist()
        diagnoses = zip(formulations, self._summary.words("diagnosis"), strict=True)
        return {
            "provided": {
                name: {part: bool(code) for part, code in zip(parts, line, strict=True) if code != schema.UNSAID}
                for name, line in zip(formulations, codes, strict=True)
            },
            "opposite_signs": tuple(name for name, turned in zip(formulations, opposite, strict=True) if turned),
            "diagnoses": {name: words for name, words in diagnoses if words},
        }


def _examples(groups: Groups) -> dict[tuple[str, str], tuple[Group, Case]]:
    """Return the counterexamples by formulation and property, each with its case."""
    examples = {}
    folder = f"/{schema.COUNTEREXAMPLES}/"
    for name, dataset in groups.items():
        if name.startswith(folder) and not name.endswith(f"/{schema.CASE}"):
            key = str(dataset.attrs["formulation"]), str(dataset.attrs["property_id"])
            examples[key] = dataset, case_of_group(groups[f"{name}/{schema.CASE}"])
    return examples
