"""The reader of reports: it makes the `Run` again that was written, to the last bit.

A child process opens the file, see `file_groups`; here are arrays, and none is believed before it is checked. Whatever
is wrong with a file is a `MisuseError` in one line. What is read only when somebody asks for it, such as an outcome, is
checked when the file is read.
"""

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
from contactverif.contract.property import Verdict
from contactverif.contract.result import NotLoaded, Row, Run
from contactverif.contract.schema import Group, StoredColumns
from contactverif_reports.netcdf import stored_outcomes as stored
from contactverif_reports.netcdf.file_groups import read_groups
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
        return _read(groups, consistent=consistent)


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
        match error:
            case MisuseError() if error.argument == _ARGUMENT:
                raise
            case MisuseError():
                words = error.found
            case KeyError():
                words = f"{error} is missing"
            case ValueError():
                words = f"{error}"
            case _:
                words = f"{type(error).__name__}: {error}"
        description = f"{name}, which cannot be read ({' '.join(words.split())[:_LONGEST_REASON]})"
        raise MisuseError(_ARGUMENT, description, "an undamaged report") from error


def _check_schema(root: Group, path: str) -> None:
    if str(root.attrs.get("title", "")) != schema.TITLE or "schema" not in root.attrs:
        raise MisuseError(_ARGUMENT, f"{path}, a netCDF file of something else", _NEEDED)
    version, writer, advice = str(root.attrs["schema"]), "", "install a newer contactverif"
    if version.isdecimal() and int(version) < int(schema.SCHEMA):
        writer, advice = ", which an older contactverif wrote", "run the same command again to write the report anew"
    if version != schema.SCHEMA:
        raise MisuseError(_ARGUMENT, f"{path} of schema {version}{writer}", f"schema {schema.SCHEMA}; {advice}")


def _read(groups: Groups, *, consistent: bool) -> Run:
    """Return the run of the groups of a report, after the check of what the file says twice."""
    for name in (schema.SUMMARY, schema.COUNTEREXAMPLES, schema.TIMING):
        if f"/{name}" not in groups:
            raise MisuseError(_ARGUMENT, f"a report without the group {name!r}", "an undamaged report")
    root, summary = groups["/"], groups[f"/{schema.SUMMARY}"]
    folder = f"/{schema.COUNTEREXAMPLES}/"
    # {(formulation, property): counterexample with its case}
    examples = {
        (str(group.attrs["formulation"]), str(group.attrs["property_id"])): (
            group, stored.case_of_group(groups[f"{name}/{schema.CASE}"]),
        )
        for name, group in groups.items()
        if name.startswith(folder) and not name.endswith(f"/{schema.CASE}")
    }  # fmt: skip
    properties = {
        str(group.attrs["property_id"]): group
        for name, group in groups.items()
        if "property_id" in group.attrs and not name.startswith(folder)
    }
    named = stored.read_named_cases(groups)
    formulations, ids = summary.labels("formulation"), summary.labels("property")
    rows: dict[tuple[int, int], Row] = {}
    if "property" in summary:
        columns = StoredColumns(_ROW, summary, ("formulation", "property"), {})
        for j, property_id in enumerate(ids):
            its_rows = _Rows(properties[property_id], j, summary, groups[f"/{schema.TIMING}"], consistent=consistent)
            cases = {name: case for (id_, name), case in named.items() if id_ == property_id}
            for i, formulation in enumerate(formulations):
                if columns.present[i * len(ids) + j]:
                    values = columns.at(i * len(ids) + j)
                    values |= {"formulation": formulation, "verdict": Verdict(values["verdict"])}
                    rows[i, j] = its_rows.row(i, values, examples.get((formulation, property_id)), cases)
    not_loaded = zip(summary.words("not_loaded"), summary.words("not_loaded_reason"), strict=True)
    run = Run(
        rows=tuple(rows[place] for place in sorted(rows)),
        not_loaded=tuple(NotLoaded(*entry) for entry in not_loaded),
        **_facts_of(summary, formulations),
    )
    written = root_attributes(run)
    if consistent:
        if {(each.formulation, each.property_id) for each in counterexamples(run).values()} != examples.keys():
            raise ValueError("the counterexamples are not those of the rows")
        for name, value in written.items():
            if name.startswith("n_") and int(root.attrs.get(name, value)) != value:
                raise ValueError(f"{name} is {root.attrs[name]}, and the rows say {value}")
    origin = {str(name): str(value) for name, value in root.attrs.items() if name not in written}
    return replace(run, provenance=origin)


class _Rows:
    """The rows of one property: its group, and the number of the property in the summary and the times."""

    def __init__(self, group: Group, number: int, summary: Group, timing: Group, *, consistent: bool) -> None:
        self._info, self._timing = stored.read_info(group), timing
        self._number, self._consistent, self._counts = number, consistent, summary["count"].values
        self._outcomes = stored.OutcomeArrays(group, self._info, ("formulation", "case"))
        self._codes = self._outcomes.verdicts.reshape(summary.sizes["formulation"], group.sizes["case"])
        has_witnesses = "witness_verdict" in group
        self._witnesses = (
            stored.OutcomeArrays(group, self._info, ("formulation",), "witness_") if has_witnesses else None
        )

    def row(
        self, i: int, values: Mapping[str, Any], example: tuple[Group, Case] | None, named: Mapping[str, Case]
    ) -> Row:
        """Return the row of a formulation with the values of the summary, a counterexample, and cases by name."""
        case = shrunk = first = None
        if example is not None:  # A report stores one case at most: that of a shrunk failure, a first one or a witness.
            dataset, case = example
            origin = Origin(str(dataset.attrs["origin"]))
            if origin not in (Origin.WITNESS, Origin.EARLIER):
                outcome = stored.OutcomeArrays(dataset, self._info, ()).outcome(0, case)
                shrunk, first = (outcome, None) if origin is Origin.SHRUNK else (None, outcome)
        codes = self._codes[i]
        length = int((codes != schema.NOT_PLANNED).sum())
        counts = np.bincount(codes[:length].clip(0), minlength=len(schema.VERDICTS))
        wrong = self._consistent and (counts != self._counts[i, self._number]).any()
        if wrong or (codes[:length] == schema.NOT_PLANNED).any():
            raise ValueError(f"the verdicts of {self._info.id} are not those that the summary counts")
        seconds: FloatArray = self._timing["case_seconds"].values[i, self._number, :length]
        if len(seconds) != length:
            raise ValueError("case_seconds is too short")
        return Row(
            info=self._info,
            outcomes=stored.StoredOutcomes(self._outcomes, i * self._codes.shape[1], length, seconds, named),
            witness=None if self._witnesses is None else self._witnesses.outcome(i, None if shrunk or first else case),
            shrunk=shrunk,
            first=first,
            seconds=float(self._timing["row_seconds"].values[i, self._number]),
            forces=None if example is None else stored.read_forces(*example),
            **values,
        )


def _facts_of(summary: Group, formulations: list[str]) -> dict[str, Any]:
    """Return what is known of whole formulations: parts that they provide, opposite signs, diagnoses."""
    if not formulations:
        return {}
    parts, codes, signs = summary.words("part"), summary["provided"].values.tolist(), summary["sign"].values.tolist()
    diagnoses = zip(formulations, summary.words("diagnosis"), strict=True)
    return {
        "provided": {
            name: {part: bool(code) for part, code in zip(parts, line, strict=True) if code != schema.UNSAID}
            for name, line in zip(formulations, codes, strict=True)
        },
        "opposite_signs": tuple(
            name for name, sign in zip(formulations, signs, strict=True) if sign == schema.SIGNS["opposite"]
        ),
        "diagnoses": {name: words for name, words in diagnoses if words},
    }
