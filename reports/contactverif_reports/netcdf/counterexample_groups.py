"""The group of counterexamples: each a case that can be rebuilt to the last bit, and a mesh that others can draw."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, Verdict
from contactverif.contract.result import Row, Run
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.property_group import detail_values, quantity_notes, quantity_values
from contactverif_reports.netcdf.variables import codes, numbers, words

ORIGIN = "case_array"  # the attribute that names the array of Case.to_arrays()
_ARRAYS = {  # name: dimensions, long name, unit
    "nodes": (("node", "dim"), "reference positions, slave nodes first", schema.LENGTH),
    "slave_segments": (("slave_segment", "two"), "first and second node of each slave segment", "1"),
    "master_segments": (("master_segment", "two"), "first and second node of each master segment", "1"),
    "z": (("unknown",), "current positions, flat: x and y of each node in turn", schema.LENGTH),
    "penalty": (
        (),
        "distributed penalty: force per length of the interface, per length of penetration",
        schema.PENALTY,
    ),
    "seed": ((), "seed of anything random that the property does with the case", "1"),
    "name": ((), "name of the case, empty if it has none", ""),
}


def found_in(run: Run) -> Iterator[tuple[str, Row, Outcome]]:
    """(id, row, outcome) of every counterexample: the shrunk case, else a witness that failed or broke a promise."""
    entries: list[tuple[str, Row, Outcome]] = []
    for row in run.rows:
        if row.shrunk is not None:
            entries.append((schema.case_id(row.formulation, row.question.id), row, row.shrunk))
        elif row.witness is not None and (
            row.witness.verdict in (Verdict.FAIL, Verdict.CRASHED) or (row.promise is False and row.unexpected)
        ):
            entries.append((schema.case_id(row.formulation, row.question.id, witness=True), row, row.witness))
    for name, (_, row, outcome) in zip(schema.distinct(entry[0] for entry in entries), entries, strict=True):
        yield name, row, outcome


def counterexample_groups(run: Run) -> dict[str, xr.Dataset]:
    """`counterexamples`, and for each one a group with its mesh and in it a group with its arrays."""
    entries = list(found_in(run))
    folder = f"/{schema.COUNTEREXAMPLES}"
    comment = (
        "the smallest case found for each failure, each a UGRID mesh with the verdict on it; its group `case` rebuilds "
        "it exactly. Again: contactverif replay REPORT --case ID"
    )
    ids = " ".join(name for name, *_ in entries)
    groups = {folder: xr.Dataset(attrs={"comment": comment, "ids": ids or schema.NONE})}
    for name, row, outcome in entries:
        groups[f"{folder}/{name}"] = _mesh(name, row, outcome)
        groups[f"{folder}/{name}/{schema.CASE}"] = _arrays(outcome.case)
    return groups


def _mesh(name: str, row: Row, outcome: Outcome) -> xr.Dataset:
    """The case as a UGRID-1.0 topology of dimension 1, and what was found on it."""
    case, interface = outcome.case, outcome.case.interface
    edges = np.vstack([interface.slave.segments, interface.master.segments])
    on_nodes = {"mesh": "mesh", "location": "node", "coordinates": "node_x node_y"}
    table = {
        "mesh": numbers([], np.int32(0), "topology of the two surfaces", "1"),
        "edge_nodes": numbers(["edge", "two"], edges, "first and second node of each segment, body on the left", "1"),
        "side": codes(
            ["edge"], [0] * len(interface.slave) + [1] * len(interface.master), schema.SIDES, "surface of each segment"
        ),
        "node_x": numbers(["node"], interface.nodes[:, 0], "reference position, x", schema.LENGTH),
        "node_y": numbers(["node"], interface.nodes[:, 1], "reference position, y", schema.LENGTH),
        "current_x": numbers(["node"], case.positions[:, 0], "current position, x", schema.LENGTH),
        "current_y": numbers(["node"], case.positions[:, 1], "current position, y", schema.LENGTH),
        "verdict": codes([], outcome.verdict, schema.VERDICTS, "verdict on the case"),
    }
    table["mesh"].attrs |= {
        "cf_role": "mesh_topology",
        "topology_dimension": np.int32(1),
        "node_coordinates": "node_x node_y",
        "edge_node_connectivity": "edge_nodes",
        "edge_dimension": "edge",
    }
    table["edge_nodes"].attrs |= {"cf_role": "edge_node_connectivity", "start_index": np.int64(0)}
    table["side"].attrs |= {"mesh": "mesh", "location": "edge"}
    for current in ("current_x", "current_y"):
        table[current].attrs |= on_nodes
    table |= quantity_notes(row.question.quantities)
    table |= quantity_values(row.question.quantities, outcome.measurement, [])
    table |= detail_values(outcome.measurement, [])
    attributes = {
        "title": f"{row.formulation}, {row.question.id}: {outcome.verdict}",
        "formulation": row.formulation,
        "property_id": row.question.id,
        "summary": row.question.summary,
        "reason": outcome.reason or schema.NONE,
        "origin": "shrunk from the random cases" if outcome is row.shrunk else "the witness of a promise",
        "case_name": case.name or schema.NONE,
        "replay": f"contactverif replay REPORT --case {name}",
    }
    return xr.Dataset(table, attrs={key: schema.text(value) for key, value in attributes.items()})


def _arrays(case: Case) -> xr.Dataset:
    """`Case.to_arrays()` as it is; the attribute `case_array` of each variable says which array it is."""
    arrays = case.to_arrays()
    table: dict[str, xr.Variable] = {}
    for safe, (name, values) in zip(schema.distinct(map(schema.typeable, arrays)), arrays.items(), strict=True):
        variable = _array(safe, name, values)
        variable.attrs[ORIGIN] = schema.text(name)
        table[safe] = variable
    return xr.Dataset(table, attrs={"comment": "contactverif.contract.case.Case.from_arrays makes the case of these"})


def _array(safe: str, name: str, values: NDArray[Any]) -> xr.Variable:
    parameter = name.removeprefix("parameter_")
    dims, long_name, units = _ARRAYS.get(
        name,
        (
            tuple(f"{safe}_axis_{axis}" for axis in range(values.ndim)),
            schema.text(f"parameter of the case: {parameter}"),
            schema.PARAMETER_UNITS.get(parameter, schema.UNKNOWN),
        ),
    )
    if values.dtype.kind in "OU":  # words, and integers beyond 64 bits
        return words(dims, values.astype(np.str_).tolist(), long_name)
    return numbers(dims, values, long_name, units)
