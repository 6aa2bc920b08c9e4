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
from contactverif_reports.netcdf import stored_outcomes as stored

if TYPE_CHECKING:
    import xarray as xr

CASES_OF_A_BLOCK = 10_000
PARTS = ("pair", "tangent", "contact_points")
_RESERVED = frozenset({schema.SUMMARY, schema.COUNTEREXAMPLES, schema.TIMING, schema.NAMED_CASES})
_COUNTED = ("planned", "judged", "failed", "undecided", "idle")


def write(run: Run, path: str | os.PathLike[str]) -> None:
    """Write the report of a run, whole or not at all, in place of a file that is there."""
    from contactverif_reports.netcdf.file_groups import write_tree

    check_writable(path)
    with whole(path) as part:
        write_tree(tree_of(run), part)


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


def tree_of(run: Run) -> dict[str, Group]:
    """Return all groups of the report of a run."""
    groups = {"/": Group(attrs=root_attributes(run)), f"/{schema.SUMMARY}": _summary(run)}
    rows = run.row_of
    for (id_, info), name in zip(run.properties.items(), group_names(run.properties).values(), strict=True):
        *folders, _ = name.removeprefix("/").split("/")
        for depth in range(1, len(folders) + 1):
            comment = {"comment": f"properties whose ids begin with {'.'.join(folders[:depth])}"}
            groups.setdefault(f"/{'/'.join(folders[:depth])}", Group(attrs=comment))
        groups[name] = _property_group(info, {name: rows.get((name, id_)) for name in run.formulations})
    groups |= stored.counterexample_groups(run)
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
        plugins, reasons = zip(*((entry.formulation, entry.reason) for entry in run.not_loaded), strict=True)
        table["not_loaded"] = words(["plugin"], plugins, "plugin that did not load")
        table["not_loaded_reason"] = words(["plugin"], reasons, "why it did not load")
        lines = (f"{name}: not loaded: {reason}" for name, reason in zip(plugins, reasons, strict=True))
        attributes["not_loaded"] = "\n".join(map(schema.text, lines))
    attributes["comment"] = (
        "one row for each formulation and property; closest_value is the measured number nearest to its tolerance or "
        "furthest beyond it, among all decided cases"
    )
    if names := run.formulations:
        provided = [[run.provided.get(name, {}).get(part, schema.UNSAID) for part in PARTS] for name in names]
        table |= _labels(run)
        table["part"] = words(["part"], PARTS, "part of the contract that a plugin may leave out")
        table["provided"] = codes(
            ["formulation", "part"], provided, schema.PROVIDED, "whether the formulation has that part",
            "see also parts", fill=schema.UNSAID,
        )  # fmt: skip
        table["sign"] = codes(
            ["formulation"], [int(name in run.opposite_signs) for name in names], schema.SIGNS, "sign of the forces",
            "opposite: the slave is pulled towards the master, and the run fails",
        )  # fmt: skip
        table["diagnosis"] = words(
            ["formulation"], [run.diagnoses.get(name, "") for name in names],
            "kind of mistake that a formulation makes which fails", "empty where no rule knows it",
        )  # fmt: skip
        attributes["parts"] = "\n".join(
            schema.text(f"{name}: ")
            + ", ".join(f"{part}: {'' if has else 'not '}provided" for part, has in parts.items())
            for name, parts in run.provided.items()
        )
    if run.rows:
        infos, rows = run.properties.values(), _grid(run)
        table["property_summary"] = words(["property"], [info.summary for info in infos], "the property in one line")
        table["verdict"] = words(["verdict"], list(schema.VERDICTS), "verdict, as in flag_meanings of row_verdict")
        closest = [row.closest.number.quantity.unit for row in rows if row is not None and row.closest is not None]
        unit = stored.common_unit(closest, "see closest_units") if closest else schema.RATIO
        units = {"closest_value": unit, "closest_tolerance": unit}
        table |= to_variables(schema.ROW, rows, _dims(run), {"verdict": tuple(Verdict)}, units=units)
    return Group(table, attributes)


def _dims(run: Run) -> dict[str, int]:
    return {"formulation": len(run.formulations), "property": len(run.properties)}


def _labels(run: Run) -> stored.Table:
    return {
        "formulation": words(["formulation"], run.formulations, "formulation, as typed on the command line"),
        "property": words(["property"], list(run.properties), "property, as typed with --property"),
    }


def _grid(run: Run) -> list[Row | None]:
    """Return the rows, formulation by formulation; None where a property was not checked."""
    rows = run.row_of
    return [rows.get((name, id_)) for name in run.formulations for id_ in run.properties]


def _timing(run: Run) -> Group:
    """Return the seconds of every row and case, the only numbers that depend on a clock."""
    table: stored.Table = {}
    if run.rows:
        dims, rows = _dims(run), _grid(run)
        of_rows = np.array([np.nan if row is None else row.seconds for row in rows]).reshape(*dims.values())
        of_cases = np.full((len(rows), max(len(row.outcomes) for row in run.rows)), np.nan)
        for line, row in zip(of_cases, rows, strict=True):
            if row is not None:
                line[: len(row.outcomes)] = [outcome.seconds for outcome in row.outcomes]
        of_cases = of_cases.reshape(*dims.values(), of_cases.shape[1])
        table = _labels(run)
        for name, axes, values, meaning in (
            ("row_seconds", [*dims], of_rows, "time spent judging, shrinking excluded"),
            ("case_seconds", [*dims, "case"], of_cases, "time spent judging each case"),
        ):
            table[name] = numbers(axes, values, meaning, schema.SECONDS, fill=np.nan)
    return Group(table, {"comment": "wall clock; all that two runs with the same seed may differ in"})


def _property_group(info: PropertyInfo, rows: Mapping[str, Row | None]) -> Group:
    outcomes = [() if row is None else row.outcomes for row in rows.values()]
    witnesses = [None if row is None else row.witness for row in rows.values()]
    n_cases = max(map(len, outcomes))
    axes = stored.outcome_axes(info, (item for item in chain(*outcomes, witnesses) if item is not None))
    table = {
        "formulation": words(["formulation"], list(rows), "formulation, as typed on the command line"),
        "case": numbers(["case"], np.arange(n_cases, dtype=np.int32), "number of the case, in order of judging", "1"),
        **stored.coordinates(info, axes),
    }
    blocks = []
    for first in range(0, max(n_cases, 1), CASES_OF_A_BLOCK):  # The outcomes of a block are in memory at a time.
        end = min(first + CASES_OF_A_BLOCK, n_cases)
        padded: list[Outcome | None] = []
        for row in outcomes:
            block = row[first:end]
            padded += [*block, *[None] * (end - first - len(block))]
        blocks.append(stored.outcome_variables(info, padded, {"formulation": len(rows), "case": end - first}, axes))
    table |= blocks[0] if len(blocks) == 1 else join(blocks, "case")
    if any(witness is not None for witness in witnesses):
        table |= stored.outcome_variables(info, witnesses, {"formulation": len(rows)}, axes, "witness_")
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


def _kind_counts(kinds: Sequence[str], rows: Sequence[Row | None]) -> stored.Table:
    counts = np.zeros((len(rows), len(kinds), len(_COUNTED)), dtype=np.int32)
    for i, row in enumerate(rows):
        for kind, cases in (row.tally.kinds if row is not None else {}).items():
            if kind:
                counts[i, kinds.index(kind)] = cases.cases, cases.judged, cases.failed, cases.undecided, cases.idle
    comment = "failed and idle ones are among those judged; idle: nothing was in contact"
    meaning = "number of random cases of each kind"
    return {
        "counted": words(["counted"], _COUNTED, "what kind_count counts"),
        "kind_count": numbers(["formulation", "kind", "counted"], counts, meaning, "1", comment),
    }
