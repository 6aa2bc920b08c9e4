"""A comparison of candidates with a reference: the cells of a run, Newton's iterations, and the cost.

Rule for the next editor: numbers alone, for a terminal and for a page. Nothing is judged, solved or timed here.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, PropertyInfo
from contactverif.contract.result import Run
from contactverif_reports.compare.cells import Cell, Paired

ITERATIONS, END = "iterations", "end"  # The details in which a property that solves says how Newton's method went.
PARTS = ("pair", "residual", "tangent")  # The parts of an evaluation that are timed.
CONVERGED = 0.0  # The code of an end that is a solution.


@dataclass(frozen=True, slots=True, eq=False)
class Iterations:
    """The Newton iterations of a formulation, where a property solved."""

    formulation: str  # The names on the command line.
    property_id: str
    solution: str  # The name of the solution if a case has several ("high penalty"), else empty.
    solved: int  # Numbers of cases.
    converged: int
    median: float  # Median and largest number of iterations of those that converged; NaN where none did.
    most: float
    fewer: int  # Numbers of cases against the reference, of those where the reference converged too.
    same: int
    more: int
    order: float = nan  # Median order of one step, NaN where it was not measured.

    @property
    def title(self) -> str:
        """The property, and the solution if there are several."""
        return f"{self.property_id}, {self.solution}" if self.solution else self.property_id


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Candidates against a reference, on the same cases."""

    reference: str  # The formulation that the candidates are compared with.
    formulations: tuple[str, ...]  # All of them, the reference first.
    properties: tuple[str, ...]  # Ids, in the order of the run.
    cells: Mapping[tuple[str, str], Cell]  # {(formulation, property): numbers}.
    paired: Mapping[tuple[str, str], Paired]  # {(candidate, property): comparison}, where both decided some case.
    iterations: tuple[Iterations, ...]  # Newton's iterations, property by property.
    not_loaded: Mapping[str, str]  # {name: reason} of plugins that did not load.
    provenance: Mapping[str, str]  # Where the run comes from.

    @classmethod
    def from_run(cls, run: Run, reference: str) -> Comparison:
        """Compare the formulations of a run with one of them."""
        cells = {key: Cell.from_row(row) for key, row in run.row_of.items()}
        candidates = [name for name in dict.fromkeys(name for name, _ in cells) if name != reference]
        formulations, properties = (reference, *candidates), tuple(run.properties)
        pairs = {
            (name, id_): Paired.from_cells(cells[name, id_], cells[reference, id_])
            for name in candidates
            for id_ in properties
            if (name, id_) in cells and (reference, id_) in cells
        }
        lines = [
            count_iterations([cells[name, id_] for name in formulations if (name, id_) in cells]) for id_ in properties
        ]
        return cls(
            reference=reference,
            formulations=formulations,
            properties=properties,
            cells=cells,
            paired={key: pair for key, pair in pairs.items() if pair.n},
            iterations=tuple(itertools.chain.from_iterable(lines)),
            not_loaded={item.formulation: item.reason for item in run.not_loaded},
            provenance=run.provenance,
        )

    @property
    def unexpected(self) -> tuple[Cell, ...]:
        """The cells in which a candidate breaks a promise or was not judged; the reference is not on trial."""
        return tuple(cell for (name, _), cell in self.cells.items() if name != self.reference and cell.row.unexpected)

    @property
    def promises_kept(self) -> bool:
        """Return whether every candidate was checked and keeps all that it promises."""
        return not self.unexpected and not self.not_loaded and len(self.formulations) > 1


@dataclass(frozen=True, slots=True, eq=False)
class Cost:
    """The time of one evaluation on one state, the fastest of the turns."""

    formulation: str  # The name on the command line.
    n_segments: int  # The number of slave segments.
    seconds: dict[str, float]  # {"pair", "residual", "tangent"}; NaN for a part that is not provided.
    failed: str = ""  # The reason why it could not be timed; empty if it was.

    @property
    def total(self) -> float:
        """The sum over all parts that are provided; NaN where nothing could be timed."""
        seconds = [value for value in self.seconds.values() if value == value]
        return sum(seconds) if seconds else nan


@dataclass(frozen=True, slots=True, eq=False)
class Differing:
    """The case of a property on which a candidate and the reference differ most."""

    info: PropertyInfo  # The property.
    formulation: str  # The candidate.
    number: int  # The number of the case in the run.
    apart: bool  # One passes and the other does not.
    # Powers of ten that the candidate is further beyond the tolerance than the reference; negative where the reference
    # is further.
    decades: float
    margin: float  # The error of each over its tolerance.
    reference_margin: float
    outcome: Outcome  # The verdict on each, with its numbers.
    reference_outcome: Outcome

    @property
    def case(self) -> Case:
        """The mesh and its state."""
        return self.outcome.case


def count_iterations(cells: Sequence[Cell]) -> list[Iterations]:
    """Count Newton's iterations over the rows of one property, one line for each solution and formulation."""
    names = sorted({name for cell in cells for name in cell.details if name.partition(", ")[0] == ITERATIONS})
    return [
        _iterations(cell, name, _converged_counts(cells[0], name))
        for name in names
        for cell in cells
        if name in cell.details
    ]


def _iterations(cell: Cell, name: str, reference: FloatArray) -> Iterations:
    counts = _converged_counts(cell, name)
    converged = counts[~np.isnan(counts)]
    n_both = min(len(counts), len(reference))
    with np.errstate(invalid="ignore"):  # A comparison with NaN is False, as it should be.
        against = np.sign(counts[:n_both] - reference[:n_both])
    return Iterations(
        formulation=cell.row.formulation,
        property_id=cell.row.property_id,
        solution=name.partition(", ")[2],
        solved=int((~np.isnan(cell.details[name])).sum()),
        converged=len(converged),
        median=float(np.median(converged)) if len(converged) else nan,
        most=float(converged.max()) if len(converged) else nan,
        fewer=int((against < 0).sum()),
        same=int((against == 0).sum()),
        more=int((against > 0).sum()),
        order=float(np.nanmedian(cell.orders)) if np.isfinite(cell.orders).any() else nan,
    )


def _converged_counts(cell: Cell, name: str) -> FloatArray:
    """Return the iterations of the cases that converged, NaN for the others; empty where the property keeps none."""
    if name not in cell.details:
        return np.zeros(0)
    counts = cell.details[name]
    end = cell.details.get(name.replace(ITERATIONS, END, 1))
    return counts if end is None else np.where(end == CONVERGED, counts, nan)
