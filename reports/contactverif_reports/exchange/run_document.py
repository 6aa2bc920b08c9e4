"""A run as JSON: what it found, row by row, with the counterexamples. `run.schema.json` is its schema.

A number that is not finite is null: JSON has no other word for it.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from contactverif.contract.counterexample import Counterexample, counterexamples
from contactverif.contract.property import CheckedNumber, checked_numbers
from contactverif.contract.result import Row, Run
from contactverif.contract.schema import ROW, value_of
from contactverif_reports.files import whole
from contactverif_reports.plot.text import as_text

VERSION = 1  # A change that a reader must know of is a new one.
SCHEMA = Path(__file__).with_name("run.schema.json")


class Number(msgspec.Struct, frozen=True, kw_only=True):
    """A measured number beside its tolerance, both in `unit`; a pass has it "at most" or "at least" the tolerance."""

    name: str
    value: float | None
    tolerance: float | None
    sense: str
    unit: str


ROW_WORDS = "A formulation and a property. `breaks` says why the run fails because of it; empty if it does not."


class Example(msgspec.Struct, frozen=True, kw_only=True):
    """A case that fails: the mesh in its reference and current positions, and what was measured on it."""

    id: str
    origin: str
    reason: str
    numbers: list[Number]
    finding: str  # The worst place, with what is found and right there; empty where nothing is known of it.
    nodes: list[list[float]]  # x and y of each node in the reference, slave nodes first.
    positions: list[list[float]]  # The same in the current state.
    slave: list[list[int]]  # The nodes of each segment.
    master: list[list[int]]
    penalty: float
    drawing: str


_KEYS = tuple(column for column in ROW if column.key)
_TYPES: dict[str, Any] = {"words": str, "count": int, "real": float}
_TYPES |= {"bool or none": bool | None, "number": Number | None}
if TYPE_CHECKING:
    RowDocument = Any
else:
    RowDocument = msgspec.defstruct(
        "RowDocument",
        [*((column.key, _TYPES[column.type or column.kind]) for column in _KEYS), ("counterexample", Example | None)],
        namespace={"__doc__": ROW_WORDS},
        module=__name__,
        frozen=True,
        kw_only=True,
    )


class Missing(msgspec.Struct, frozen=True, kw_only=True):
    """A plugin that did not load."""

    name: str
    reason: str


class RunDocument(msgspec.Struct, frozen=True, kw_only=True):
    """A run. `provenance` says where it comes from: versions, seed, profile, machine."""

    version: int
    promises_kept: bool
    provenance: dict[str, str]
    rows: list[RowDocument]
    not_loaded: list[Missing]
    opposite_signs: list[str]  # The formulations whose forces have the opposite sign.
    diagnoses: dict[str, str]  # {formulation that fails: what kind of mistake it makes}, where a rule knows it.


def write_json(run: Run, path: str | os.PathLike[str]) -> None:
    """Write a run as JSON."""
    data = msgspec.json.format(msgspec.json.encode(document_of(run)), indent=1)
    with whole(path) as part:
        part.write_bytes(data + b"\n")


def document_of(run: Run) -> RunDocument:
    """Return a run as the document that is written."""
    examples = {(each.formulation, each.property_id): _example(each) for each in counterexamples(run).values()}
    return RunDocument(
        version=VERSION,
        promises_kept=run.promises_kept,
        provenance=dict(run.provenance),
        rows=[
            RowDocument(**row_values(row), counterexample=examples.get((row.formulation, row.property_id)))
            for row in run.rows
        ],
        not_loaded=[Missing(name=item.formulation, reason=item.reason) for item in run.not_loaded],
        opposite_signs=list(run.opposite_signs),
        diagnoses=dict(run.diagnoses),
    )


def schema() -> bytes:
    """Return the schema of the document, as it stands beside this file."""
    return msgspec.json.format(msgspec.json.encode(msgspec.json.schema(RunDocument)), indent=1) + b"\n"


def row_values(row: Row) -> dict[str, Any]:
    """Return {key: value} of the columns of a row that are in JSON and in data frames."""
    values = {column.key: value_of(row, column.path) for column in _KEYS}
    closest = values["closest"]
    return values | {"result": str(row.result), "closest": None if closest is None else _number(closest)}


def _number(number: CheckedNumber) -> Number:
    quantity = number.quantity
    return Number(
        name=quantity.name, value=number.value, tolerance=number.tolerance, sense=quantity.sense, unit=quantity.unit
    )


def _example(example: Counterexample) -> Example:
    case, measurement = example.case, example.outcome.measurement
    finding = None if measurement is None else measurement.finding
    return Example(
        id=example.id,
        origin=str(example.origin),
        reason=example.reason,
        numbers=[_number(number) for number in checked_numbers(example.row.info, measurement)],
        finding="" if finding is None else str(finding),
        nodes=case.interface.nodes.tolist(),
        positions=case.positions.tolist(),
        slave=case.interface.slave.faces.tolist(),
        master=case.interface.master.faces.tolist(),
        penalty=case.penalty,
        drawing=as_text(case),
    )
