"""Reads a whole report: its cells (`stored_cells`), and what a reader wants to know around them.

Arrays by case are in the cells; here are the words, the witnesses, the clock, and the questions that were asked.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from contactverif.contract.property import Quantity, Verdict, excess
from contactverif_reports.compare.cells import Cell
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.read import StoredCase, opened, read_cases
from contactverif_reports.netcdf.stored_cells import StoredCells, read_cells

_NOT_SHOWN = frozenset({"passed", "title", "comment", "Conventions"})  # root attributes that say nothing of the run


@dataclass(frozen=True, slots=True)
class StoredProperty:
    """A question as the report tells it.

    Attributes
    ----------
    id : str
        As typed with --property.
    summary : str
        What is asked.
    quantities : tuple[Quantity, ...]
        What is measured, with units, formulas and their reasons.
    """

    id: str
    summary: str
    quantities: tuple[Quantity, ...]


@dataclass(frozen=True, slots=True)
class Held:
    """A number against its tolerance."""

    quantity: Quantity
    value: float
    tolerance: float

    @property
    def excess(self) -> float:
        """How far the value is towards its tolerance: above 1 fails."""
        return excess(self.quantity, self.value, self.tolerance)

    @property
    def sign(self) -> str:
        """Between value and tolerance where it passes."""
        return "≤" if self.quantity.sense == "at most" else "≥"


@dataclass(frozen=True, slots=True)
class StoredWitness:
    """The named case of a promise "does not".

    Attributes
    ----------
    name : str
        Of the case.
    verdict, reason : Verdict or str
        How it came out.
    numbers : tuple[Held, ...]
        What was measured.
    """

    name: str
    verdict: Verdict
    reason: str
    numbers: tuple[Held, ...]


@dataclass(frozen=True, slots=True, eq=False)
class StoredRow:
    """One formulation, one property.

    Attributes
    ----------
    cell : Cell
        Verdicts and margins by case, and the verdict over all.
    known : str
        Why a failure is known, empty if it is not.
    worst : Held | None
        The number that went furthest towards its tolerance among the random cases; None where nothing was
        measured.
    silences : Mapping[str, int]
        {reason: number of cases} of the cases that were not decided.
    witness : StoredWitness | None
        None where the promise names none.
    seconds : float
        Spent judging, shrinking excluded; NaN where the report does not say.
    n_quantities : int
        How many the property has.
    """

    cell: Cell
    known: str
    worst: Held | None
    silences: Mapping[str, int]
    witness: StoredWitness | None
    seconds: float
    n_quantities: int

    @property
    def furthest(self) -> Held | None:
        """The worst number, that of the witness among them, where it was decided."""
        own = self.witness.numbers if self.witness and self.witness.verdict is not Verdict.UNDECIDED else ()
        return max([*([self.worst] if self.worst else []), *own], key=lambda held: held.excess, default=None)

    @property
    def undecided(self) -> int:
        """Number of random cases that were judged and not decided."""
        return int((self.cell.verdicts == Verdict.UNDECIDED).sum())


@dataclass(frozen=True, slots=True, eq=False)
class StoredReport:
    """All that a report says.

    Attributes
    ----------
    path : str
        As the caller wrote it.
    passed : bool
        Whether every promise was kept and every property judged.
    formulations : tuple[str, ...]
        In the order of the run.
    properties : Mapping[str, StoredProperty]
        By id, in the order of the run.
    rows : Mapping[tuple[str, str], StoredRow]
        By (formulation, property), those that were asked.
    provided : Mapping[str, Mapping[str, bool]]
        {formulation: {part of the contract: provided}}.
    not_loaded : Mapping[str, str]
        {name: reason} of plugins that did not load.
    examples : Mapping[str, StoredCase]
        {id: counterexample}.
    provenance : Mapping[str, str]
        The other root attributes: versions, seed, commit, ….
    """

    path: str
    passed: bool
    formulations: tuple[str, ...]
    properties: Mapping[str, StoredProperty]
    rows: Mapping[tuple[str, str], StoredRow]
    provided: Mapping[str, Mapping[str, bool]]
    not_loaded: Mapping[str, str]
    examples: Mapping[str, StoredCase]
    provenance: Mapping[str, str]

    @property
    def unexpected(self) -> tuple[StoredRow, ...]:
        """Rows that make the run fail."""
        return tuple(row for row in self.rows.values() if row.cell.unexpected)

    def examples_of(self, formulation: str) -> dict[str, StoredCase]:
        """{id: counterexample} of one formulation."""
        return {name: found for name, found in self.examples.items() if found.formulation == formulation}


def read_report(path: str | os.PathLike[str]) -> StoredReport:
    """The whole report.

    Raises
    ------
    MisuseError
        If the file is not there, no netCDF file, no report of this schema, or damaged.
    """
    found = os.fspath(path)
    cells = read_cells(path)
    with opened(path) as report:
        groups = {
            str(group.property_id): _Group(group)
            for name, family in report.groups.items()
            if name not in schema.RESERVED
            for group in family.groups.values()
        }
        rows = _rows(report, groups, cells)
        provided = _provided(report[schema.SUMMARY], cells.formulations)
    examples = read_cases(path)
    return StoredReport(
        path=found,
        passed=cells.provenance.get("passed") == "true",
        formulations=cells.formulations,
        properties={id_: groups[id_].asked for id_ in cells.properties},
        rows=rows,
        provided=provided,
        not_loaded=cells.not_loaded,
        examples=examples,
        provenance={
            name: "" if value == schema.NONE else value
            for name, value in cells.provenance.items()
            if name not in _NOT_SHOWN
        },
    )


class _Group:
    """The group of one property, all formulations, its arrays read once."""

    def __init__(self, group: Any) -> None:
        columns = ("quantity", "quantity_units", "tolerance_formula", "tolerance_reason", "sense")
        quantities = (Quantity(*row) for row in zip(*(_words(group, name) for name in columns), strict=True))
        self.asked = StoredProperty(str(group.property_id), str(group.summary), tuple(quantities))
        names = ("reason", *(f"witness{of}" for of in ("", "_verdict", "_reason", "_value", "_tolerance")))
        self._arrays = {name: group[name][...] for name in names if name in group.variables}

    def silences(self, cell: Cell, i: int) -> dict[str, int]:
        """{reason: number of cases} of the cases of formulation `i` that were not decided, the commonest first."""
        reasons = self._arrays.get("reason")
        told = (str(reasons[i, n]) if reasons is not None else "" for n in np.flatnonzero(~cell.decided).tolist())
        return dict(Counter(told).most_common())

    def witness(self, i: int) -> StoredWitness | None:
        """Of formulation `i`."""
        if "witness" not in self._arrays or (code := int(self._arrays["witness_verdict"][i])) == schema.NOT_PLANNED:
            return None
        held: list[Held] = []
        if self.asked.quantities:
            columns = (self._arrays[name][i].tolist() for name in ("witness_value", "witness_tolerance"))
            held = [Held(*row) for row in zip(self.asked.quantities, *columns, strict=True)]
        told = tuple(one for one in held if one.value == one.value)  # the others were not measured
        words = (str(self._arrays[name][i]) for name in ("witness", "witness_reason"))
        return StoredWitness(next(words), Verdict(code), next(words), told)


def _rows(report: Any, groups: Mapping[str, _Group], cells: StoredCells) -> dict[tuple[str, str], StoredRow]:
    if not cells.cells:
        return {}
    known, tolerances = (report[schema.SUMMARY][name][...] for name in ("known", "worst_tolerance"))
    seconds = report[schema.TIMING]["row_seconds"][...]
    place = {name: i for i, name in enumerate(cells.formulations)}
    column = {id_: j for j, id_ in enumerate(cells.properties)}
    rows = {}
    for (name, id_), cell in cells.cells.items():
        group, i, j = groups[id_], place[name], column[id_]
        worst = (
            Held(quantity, cell.worst_value, float(tolerances[i, j]))
            for quantity in group.asked.quantities
            if quantity.name == cell.worst_quantity
        )
        rows[name, id_] = StoredRow(
            cell=cell,
            known=str(known[i, j]),
            worst=next(worst, None),
            silences=group.silences(cell, i),
            witness=group.witness(i),
            seconds=float(seconds[i, j]),
            n_quantities=len(group.asked.quantities),
        )
    return rows


def _provided(summary: Any, formulations: tuple[str, ...]) -> dict[str, dict[str, bool]]:
    if "provided" not in summary.variables:
        return {name: {} for name in formulations}
    has = np.asarray(summary["provided"][...]) == schema.PROVIDED["provided"]
    parts = _words(summary, "part")
    return {name: dict(zip(parts, has[i].tolist(), strict=True)) for i, name in enumerate(formulations)}


def _words(group: Any, name: str) -> list[str]:
    return [str(word) for word in group[name][...]] if name in group.variables else []
