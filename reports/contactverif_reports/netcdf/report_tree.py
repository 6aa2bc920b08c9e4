"""The groups of a whole report, before it is a file, and among them the group of each property."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain

import numpy as np

from contactverif.contract.property import Outcome, PropertyInfo
from contactverif.contract.result import Row, Run
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.groups import Group, Variable
from contactverif_reports.netcdf.outcome_variables import OutcomeVariables, SharedNames, coordinates
from contactverif_reports.netcdf.stored_cases import counterexample_groups, named_case_groups
from contactverif_reports.netcdf.summary_group import root_attributes, summary_group, timing_group
from contactverif_reports.netcdf.variables import join, numbers, words

CASES_OF_A_BLOCK = 10_000


def tree_of(run: Run, *, with_named_cases: bool = False) -> dict[str, Group]:
    """Return all groups of the report of a run, if wanted with each named case that a formulation fails."""
    groups = {"/": Group(attrs=root_attributes(run)), f"/{schema.SUMMARY}": summary_group(run)}
    properties = run.properties
    for id_, name in schema.group_names(properties).items():
        *folders, _ = name.removeprefix("/").split("/")
        for depth in range(1, len(folders) + 1):
            comment = {"comment": f"properties whose ids begin with {'.'.join(folders[:depth])}"}
            groups.setdefault(f"/{'/'.join(folders[:depth])}", Group(attrs=comment))
        rows = {row.formulation: row for row in run.rows if row.property_id == id_}
        groups[name] = property_group(properties[id_], rows, run.formulations)
    groups |= counterexample_groups(run)
    if with_named_cases:
        groups |= named_case_groups(run)
    groups[f"/{schema.TIMING}"] = timing_group(run)
    return groups


def property_group(info: PropertyInfo, rows: Mapping[str, Row], formulations: Sequence[str]) -> Group:
    """Return the group of a property, with the dimensions `formulation`, `case` and `quantity`."""
    outcomes = [rows[name].outcomes if name in rows else () for name in formulations]
    witnesses = [rows[name].witness if name in rows else None for name in formulations]
    n_cases = max(map(len, outcomes))
    names = SharedNames.from_outcomes(info, (item for item in chain(*outcomes, witnesses) if item is not None))
    table = {
        "formulation": words(["formulation"], formulations, "formulation, as typed on the command line"),
        "case": numbers(["case"], np.arange(n_cases, dtype=np.int32), "number of the case, in order of judging", "1"),
        **coordinates(info, names),
    }
    axes = {"formulation": len(formulations)}
    table |= _cases(info, outcomes, n_cases, names)
    if any(witness is not None for witness in witnesses):
        table |= OutcomeVariables(info, witnesses, axes, names, "witness_").table()
    if names.kinds:
        table |= _kind_counts(names.kinds, [rows.get(name) for name in formulations])
    attributes = {
        "property_id": schema.text(info.id),
        "family": schema.text(info.family),
        "summary": schema.text(info.summary),
        "needs": ", ".join(sorted(info.needs)) or schema.NONE,
        "least_contact": np.float64(info.least_contact),
        "usual_undecided": np.float64(info.usual_undecided),
        "comment": "one property: every random case of every formulation; names that begin with witness_ are of the "
        "named case with which a formulation proves that it fails, or of a case that failed in an earlier run",
    }
    return Group(table, attributes)


def _cases(
    info: PropertyInfo, rows: Sequence[Sequence[Outcome]], n_cases: int, names: SharedNames
) -> dict[str, Variable]:
    """Return the variables along `formulation` and `case`. The outcomes of a block of cases are in memory at a time."""
    tables = []
    for first in range(0, max(n_cases, 1), CASES_OF_A_BLOCK):
        end = min(first + CASES_OF_A_BLOCK, n_cases)
        padded: list[Outcome | None] = []
        for row in rows:
            block = row[first:end]
            padded += [*block, *[None] * (end - first - len(block))]
        axes = {"formulation": len(rows), "case": end - first}
        tables.append(OutcomeVariables(info, padded, axes, names).table())
    return tables[0] if len(tables) == 1 else join(tables, "case")


def _kind_counts(kinds: Sequence[str], rows: Sequence[Row | None]) -> dict[str, Variable]:
    """Return how many cases of each kind were planned, judged, and so on."""
    counted = ("planned", "judged", "failed", "undecided", "idle")
    counts = np.zeros((len(rows), len(kinds), len(counted)), dtype=np.int32)
    for i, row in enumerate(rows):
        for kind, cases in (row.tally.kinds if row is not None else {}).items():
            if kind:
                counts[i, kinds.index(kind)] = cases.cases, cases.judged, cases.failed, cases.undecided, cases.idle
    comment = "failed and idle ones are among those judged; idle: nothing was in contact"
    return {
        "counted": words(["counted"], counted, "what kind_count counts"),
        "kind_count": numbers(
            ["formulation", "kind", "counted"], counts, "number of random cases of each kind", "1", comment
        ),
    }
