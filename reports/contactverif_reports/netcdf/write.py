"""The writer of reports: the groups of a run, made by the tables of `contactverif.contract.schema`.

A file is written whole, or not at all.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from contactverif.contract import schema
from contactverif.contract.counterexample import distinct, typeable
from contactverif.contract.property import Outcome, PropertyInfo, Verdict
from contactverif.contract.result import Result, Row, Run
from contactverif.contract.schema import Group, Variable, codes, join, numbers, to_variables, words
from contactverif_reports.files import check_writable, whole
from contactverif_reports.netcdf.stored_cases import counterexample_groups, named_case_groups
from contactverif_reports.netcdf.stored_outcomes import common_unit, coordinates, outcome_axes, outcome_variables

if TYPE_CHECKING:
    import xarray as xr

CASES_OF_A_BLOCK = 10_000
PARTS = ("pair", "tangent", "contact_points")
_RESERVED = frozenset({schema.SUMMARY, schema.COUNTEREXAMPLES, schema.TIMING, schema.NAMED_CASES})
_COUNTED = ("planned", "judged", "failed", "undecided", "idle")
Table = dict[str, Variable]


def write(run: Run, path: str | os.PathLike[str], *, with_named_cases: bool = False) -> None:
    """Write the report of a run, whole or not at all, in place of a file that is there."""
    from contactverif_reports.netcdf.file_groups import write_tree

    check_writable(path)
    with whole(path) as part:
        write_tree(tree_of(run, with_named_cases=with_named_cases), part)


def as_tree(run: Run) -> xr.DataTree:
    """Return the report of a run as xarray reads it from a file, in memory."""
    import xarray as xr

    with TemporaryDirectory() as folder:
        path = Path(folder) / "report.nc"
        write(run, path)
        with xr.open_datatree(path, engine="netcdf4") as tree:
            for node in tree.subtree:
                for variable in node.variables.values():
                    variable.load()
    return tree


def tree_of(run: Run, *, with_named_cases: bool = False) -> dict[str, Group]:
    """Return all groups of the report of a run, if wanted with each named case that a formulation fails."""
    groups = {"/": Group(attrs=root_attributes(run)), f"/{schema.SUMMARY}": _summary(run)}
    rows = run.row_of
    for (id_, info), name in zip(run.properties.items(), group_names(run.properties).values(), strict=True):
        *folders, _ = name.removeprefix("/").split("/")
        for depth in range(1, len(folders) + 1):
            comment = {"comment": f"properties whose ids begin with {'.'.join(folders[:depth])}"}
            groups.setdefault(f"/{'/'.join(folders[:depth])}", Group(attrs=comment))
        groups[name] = _property_group(info, {name: rows.get((name, id_)) for name in run.formulations})
    groups |= counterexample_groups(run)
    if with_named_cases:
        groups |= named_case_groups(run)
    groups[f"/{schema.TIMING}"] = _timing(run)
    return groups


def group_names(property_ids: Iterable[str]) -> dict[str, str]:
    """Return {property id: group}: `patch.flat.transmission` is the group `/patch/flat/transmission`.

    A name that is a folder of others already, or a group of the report itself, gets `_` behind it.
    """
    ids = list(property_ids)
    paths = [tuple(map(typeable, id_.split("."))) for id_ in ids]
    paths = [(f"{path[0]}_" if path[0] in _RESERVED else path[0], *path[1:]) for path in paths]
    folders = {path[:n] for path in paths for n in range(1, len(path))}
    names = [f"/{'/'.join(path)}{'_' if path in folders else ''}" for path in paths]
    return dict(zip(ids, distinct(names), strict=True))


def root_attributes(run: Run) -> dict[str, Any]:
    """Return how the run came out, in counts of pairs of a formulation and a property, and where it comes from."""
    judged = (Verdict.PASS, Verdict.FAIL, Verdict.CRASHED)
    counts = {
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
    attributes: dict[str, Any] = {
        "Conventions": schema.CONVENTIONS,
        "title": schema.TITLE,
        "schema": schema.SCHEMA,
        "promises_kept": "true" if run.promises_kept else "false",
        **{name: np.int32(count) for name, count in counts.items()},
        "comment": schema.ROOT_NOTE,
    }
    origin = {schema.text(name): schema.text(str(value)) for name, value in run.provenance.items()}
    return attributes | {name: value for name, value in origin.items() if name not in attributes}


def _summary(run: Run) -> Group:
    table, attributes = dict[str, Variable](), dict[str, Any]()
    if run.not_loaded:
        plugins = [(entry.formulation, entry.reason) for entry in run.not_loaded]
        table["not_loaded"] = words(["plugin"], [name for name, _ in plugins], "plugin that did not load")
        table["not_loaded_reason"] = words(["plugin"], [reason for _, reason in plugins], "why it did not load")
        attributes["not_loaded"] = "\n".join(schema.text(f"{name}: not loaded: {reason}") for name, reason in plugins)
    attributes["comment"] = (
        "one row for each formulation and property; closest_value is the measured number nearest to its tolerance or "
        "furthest beyond it, among all decided cases"
    )
    if run.formulations:
        table |= _labels(run) | _formulation_columns(run)
        attributes["parts"] = "\n".join(
            schema.text(f"{name}: ")
            + ", ".join(f"{part}: {'' if has else 'not '}provided" for part, has in parts.items())
            for name, parts in run.provided.items()
        )
    if run.rows:
        infos, rows = run.properties.values(), _grid(run)
        table["property_summary"] = words(["property"], [info.summary for info in infos], "the property in one line")
        names = list(schema.VERDICTS)
        table["verdict"] = words(["verdict"], names, "verdict, as in flag_meanings of row_verdict")
        closest = [row.closest.number.quantity.unit for row in rows if row is not None and row.closest is not None]
        unit = common_unit(closest, "see closest_units") if closest else schema.RATIO
        units = {"closest_value": unit, "closest_tolerance": unit}
        table |= to_variables(schema.ROW, rows, _dims(run), {"verdict": tuple(Verdict)}, units=units)
    return Group(table, attributes)


def _dims(run: Run) -> dict[str, int]:
    return {"formulation": len(run.formulations), "property": len(run.properties)}


def _labels(run: Run) -> Table:
    return {
        "formulation": words(["formulation"], run.formulations, "formulation, as typed on the command line"),
        "property": words(["property"], list(run.properties), "property, as typed with --property"),
    }


def _grid(run: Run) -> list[Row | None]:
    """Return the rows, formulation by formulation; None where a property was not checked."""
    rows = run.row_of
    return [rows.get((name, id_)) for name in run.formulations for id_ in run.properties]


def _formulation_columns(run: Run) -> Table:
    names, axis = run.formulations, ["formulation"]
    parts = [[run.provided.get(name, {}).get(part, schema.UNSAID) for part in PARTS] for name in names]
    signs = [int(name in run.opposite_signs) for name in names]
    comment = "opposite: the slave is pulled towards the master, and the run fails"
    long_name = "kind of mistake that a formulation makes which fails"
    return {
        "part": words(["part"], PARTS, "part of the contract that a plugin may leave out"),
        "provided": codes(
            ["formulation", "part"],
            parts,
            schema.PROVIDED,
            "whether the formulation has that part",
            "see also parts",
            fill=schema.UNSAID,
        ),
        "sign": codes(axis, signs, schema.SIGNS, "sign of the forces", comment),
        "diagnosis": words(
            axis, [run.diagnoses.get(name, "") for name in names], long_name, "empty where no rule knows it"
        ),
    }


def _timing(run: Run) -> Group:
    """Return the seconds of every row and case, the only numbers that depend on a clock."""
    attributes = {"comment": "wall clock; all that two runs with the same seed may differ in"}
    if not run.rows:
        return Group(attrs=attributes)
    dims, rows = _dims(run), _grid(run)
    seconds = np.full((len(rows), max(len(row.outcomes) for row in run.rows)), np.nan)
    for line, row in zip(seconds, rows, strict=True):
        if row is not None:
            line[: len(row.outcomes)] = [outcome.seconds for outcome in row.outcomes]
    of_rows = np.array([np.nan if row is None else row.seconds for row in rows]).reshape(*dims.values())
    of_cases = seconds.reshape(*dims.values(), -1) if seconds.size else np.zeros((*dims.values(), 0))
    table = _labels(run)
    table["row_seconds"] = numbers(
        list(dims), of_rows, "time spent judging, shrinking excluded", schema.SECONDS, fill=np.nan
    )
    table["case_seconds"] = numbers(
        [*dims, "case"], of_cases, "time spent judging each case", schema.SECONDS, fill=np.nan
    )
    return Group(table, attributes)


def _property_group(info: PropertyInfo, rows: Mapping[str, Row | None]) -> Group:
    outcomes = [() if row is None else row.outcomes for row in rows.values()]
    witnesses = [None if row is None else row.witness for row in rows.values()]
    n_cases = max(map(len, outcomes))
    axes = outcome_axes(info, (item for item in chain(*outcomes, witnesses) if item is not None))
    table = {
        "formulation": words(["formulation"], list(rows), "formulation, as typed on the command line"),
        "case": numbers(["case"], np.arange(n_cases, dtype=np.int32), "number of the case, in order of judging", "1"),
        **coordinates(info, axes),
    }
    blocks = []
    for first in range(0, max(n_cases, 1), CASES_OF_A_BLOCK):  # The outcomes of a block are in memory at a time.
        end = min(first + CASES_OF_A_BLOCK, n_cases)
        padded: list[Outcome | None] = []
        for row in outcomes:
            block = row[first:end]
            padded += [*block, *[None] * (end - first - len(block))]
        blocks.append(outcome_variables(info, padded, {"formulation": len(rows), "case": end - first}, axes))
    table |= blocks[0] if len(blocks) == 1 else join(blocks, "case")
    if any(witness is not None for witness in witnesses):
        table |= outcome_variables(info, witnesses, {"formulation": len(rows)}, axes, "witness_")
    if axes["kind"]:
        table |= _kind_counts(axes["kind"], list(rows.values()))
    attributes = {
        "property_id": schema.text(info.id),
        "family": schema.text(info.family),
        "summary": schema.text(info.summary),
        "needs": ", ".join(sorted(info.needs)) or schema.NONE,
        "least_contact": np.float64(info.least_contact),
        "usual_undecided": np.float64(info.usual_undecided),
        "rank": np.float64(info.rank),
        "role": info.role or schema.NONE,
        "comment": "one property: every random case of every formulation; names that begin with witness_ are of the "
        "named case with which a formulation proves that it fails, or of a case that failed in an earlier run",
    }
    return Group(table, attributes)


def _kind_counts(kinds: Sequence[str], rows: Sequence[Row | None]) -> Table:
    counts = np.zeros((len(rows), len(kinds), len(_COUNTED)), dtype=np.int32)
    for i, row in enumerate(rows):
        for kind, cases in (row.tally.kinds if row is not None else {}).items():
            if kind:
                counts[i, kinds.index(kind)] = cases.cases, cases.judged, cases.failed, cases.undecided, cases.idle
    dims, comment = (
        ["formulation", "kind", "counted"],
        "failed and idle ones are among those judged; idle: nothing was in contact",
    )
    return {
        "counted": words(["counted"], _COUNTED, "what kind_count counts"),
        "kind_count": numbers(dims, counts, "number of random cases of each kind", "1", comment),
    }
