"""Reads a stored report as cells, which compare with those of a live run."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray, freeze
from contactverif.contract.property import Quantity, Verdict, excess
from contactverif_reports.compare.cells import ORDER, Cell, margin_of
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.read import opened

_KINDS = ("n_slave_segments", "n_master_segments", "penalty", "largest_coordinate", "shortest_segment")
_PROMISES = {schema.Promise.NO_PROMISE: None, schema.Promise.PROMISED: True, schema.Promise.SAID_TO_FAIL: False}


@dataclass(frozen=True, slots=True, eq=False)
class StoredCells:
    """What a stored report says, as cells.

    Attributes
    ----------
    path : str
        As the caller wrote it.
    cells : Mapping[tuple[str, str], Cell]
        By (formulation, property), those that were asked.
    formulations, properties : tuple[str, ...]
        In the order of the report.
    not_loaded : Mapping[str, str]
        {name: reason}.
    provenance : Mapping[str, str]
        Root attributes.
    """

    path: str
    cells: Mapping[tuple[str, str], Cell]
    formulations: tuple[str, ...]
    properties: tuple[str, ...]
    not_loaded: Mapping[str, str]
    provenance: Mapping[str, str]

    def only(self, properties: Sequence[str]) -> StoredCells:
        """What the report says of these properties."""
        return replace(
            self,
            cells={key: cell for key, cell in self.cells.items() if key[1] in properties},
            properties=tuple(id_ for id_ in self.properties if id_ in properties),
        )


def read_cells(path: str | os.PathLike[str]) -> StoredCells:
    """All rows of a report, without its counterexamples.

    Raises
    ------
    MisuseError
        If the file is not there, no netCDF file, no report of this schema, or damaged.
    """
    found = os.fspath(path)
    with opened(path) as report:
        return _report(report, found)


def _report(report: Any, path: str) -> StoredCells:
    summary, timing = report[schema.SUMMARY], report[schema.TIMING]
    formulations, properties = _words(summary, "formulation"), _words(summary, "property")
    groups = {
        group.property_id: group
        for name, family in report.groups.items()
        if name not in schema.RESERVED
        for group in family.groups.values()
    }
    cells = {}
    tables = [_Table(groups[id_]) for id_ in properties]
    rows = {name: variable[...] for name, variable in summary.variables.items()}  # once: a cell at a time is slow
    seconds: Any = timing["case_seconds"][...] if properties else None
    for i, name in enumerate(formulations):
        for j, (id_, table) in enumerate(zip(properties, tables, strict=True)):
            verdict = int(rows["row_verdict"][i, j])
            if verdict != schema.NOT_PLANNED:
                cells[name, id_] = table.cell(name, id_, i, (i, j), rows, _median(seconds[i, j]))
    return StoredCells(
        path=path,
        cells=cells,
        formulations=tuple(formulations),
        properties=tuple(properties),
        not_loaded=dict(zip(_words(summary, "not_loaded"), _words(summary, "not_loaded_reason"), strict=True)),
        provenance={name: str(report.getncattr(name)) for name in report.ncattrs()},
    )


class _Table:
    """The group of one property, all formulations, its arrays read once."""

    def __init__(self, group: Any) -> None:
        names = ("verdict", "value", "tolerance", "detail_value", *_KINDS)
        self._arrays: Mapping[str, Any] = {name: group[name][...] for name in names if name in group.variables}
        self._details = _words(group, "detail")
        columns = ("quantity", "quantity_units", "tolerance_formula", "tolerance_reason", "sense")
        self._quantities = [Quantity(*row) for row in zip(*(_words(group, name) for name in columns), strict=True)]

    def cell(
        self, name: str, id_: str, i: int, ij: tuple[int, int], summary: Mapping[str, Any], seconds: float
    ) -> Cell:
        """What formulation number `i` made of it; `ij` is the place of its row in the summary."""
        codes: IntArray = np.asarray(self._arrays["verdict"][i], dtype=np.int64)
        n_cases = int((codes != schema.NOT_PLANNED).sum())  # behind them is padding
        verdicts = codes[:n_cases]
        values, tolerances = (self._of(kind, i, n_cases, len(self._quantities)) for kind in ("value", "tolerance"))
        details = self._of("detail_value", i, n_cases, len(self._details))
        orders = [k for k, quantity in enumerate(self._quantities) if quantity.name == ORDER]
        margins = [self._margin(*case) for case in zip(verdicts.tolist(), values, tolerances, strict=True)]
        kinds = [np.asarray(self._arrays[kind][i, :n_cases], dtype=np.float64) for kind in _KINDS]
        return Cell(
            formulation=name,
            property_id=id_,
            verdict=Verdict(int(summary["row_verdict"][ij])),
            promise=_PROMISES[schema.Promise(int(summary["promise"][ij]))],
            unexpected=str(summary["unexpected"][ij]),
            reason=str(summary["reason"][ij]),
            planned=int(summary["planned"][ij]),
            verdicts=freeze(verdicts, np.int64),
            margins=freeze(np.array(margins), np.float64),
            orders=freeze(values[:, orders[0]] if orders else np.full(n_cases, nan), np.float64),
            details={
                detail: freeze(details[:, k], np.float64)
                for k, detail in enumerate(self._details)
                if not np.isnan(details[:, k]).all()
            },
            worst_value=float(summary["worst_value"][ij]),
            worst_quantity=str(summary["worst_quantity"][ij]),
            kinds=freeze(np.column_stack(kinds), np.float64),
            seconds=seconds,
        )

    def _margin(self, verdict: int, values: FloatArray, tolerances: FloatArray) -> float:
        numbers = [
            excess(quantity, float(value), float(tolerance))
            for quantity, value, tolerance in zip(self._quantities, values, tolerances, strict=True)
            if not np.isnan(value)  # not measured, or NaN, which fails and has no margin
        ]
        return margin_of(Verdict(verdict), max(numbers, default=nan))

    def _of(self, kind: str, i: int, n_cases: int, n_columns: int) -> FloatArray:
        """(n_cases, n_columns) of formulation `i`; no columns where the property has no such numbers."""
        if not n_columns:
            return np.empty((n_cases, 0))
        return np.asarray(self._arrays[kind][i, :n_cases], dtype=np.float64)


def _median(seconds: FloatArray) -> float:
    told = seconds[~np.isnan(seconds)]
    return float(np.median(told)) if len(told) else nan


def _words(group: Any, name: str) -> list[str]:
    return [str(word) for word in group[name][...]] if name in group.variables else []
