"""The whole report as an `xarray.DataTree`, before it is a file."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr

from contactverif.contract.property import Property
from contactverif.contract.result import Row, Run
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.counterexample_groups import counterexample_groups
from contactverif_reports.netcdf.property_group import property_group
from contactverif_reports.netcdf.summary_group import summary_group, timing_group


def tree_of(run: Run) -> xr.DataTree:
    """All groups of the run."""
    rows: Mapping[tuple[str, str], Row] = {(row.formulation, row.question.id): row for row in run.rows}
    named = [row.formulation for row in run.rows]
    formulations = list(dict.fromkeys([*named, *run.provided]))
    questions: list[Property] = list({row.question.id: row.question for row in run.rows}.values())
    names = schema.distinct(schema.group_of(question.id, question.family) for question in questions)
    groups = {"/": xr.Dataset(attrs=_provenance(run))}
    groups[f"/{schema.SUMMARY}"] = summary_group(run, rows, formulations, questions)
    for name, question in zip(names, questions, strict=True):
        family, _, _ = name.removeprefix("/").partition("/")
        groups.setdefault(f"/{family}", xr.Dataset(attrs={"comment": f"properties of the family {family}"}))
        asked = {row.formulation: row for row in run.rows if row.question.id == question.id}
        groups[name] = property_group(question, asked, formulations)
    groups |= counterexample_groups(run)
    groups[f"/{schema.TIMING}"] = timing_group(rows, formulations, questions)
    return xr.DataTree.from_dict(groups)


def _provenance(run: Run) -> dict[str, str]:
    attributes = {
        "Conventions": schema.CONVENTIONS,
        "title": schema.TITLE,
        "schema": schema.SCHEMA,
        "passed": "true" if run.passed else "false",
        "comment": schema.UNITS_NOTE,
    }
    own = {schema.text(name): schema.text(str(value)) for name, value in run.provenance.items()}
    return attributes | {name: value for name, value in own.items() if name not in attributes}
