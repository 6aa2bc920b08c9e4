"""Candidates beside a reference: the cells of a run, Newton's iterations, cost, and the meshes that tell most.

Numbers alone, for a terminal and for a page: nothing is judged, solved or timed here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, Property
from contactverif.contract.result import Run
from contactverif_reports.compare.cells import Cell, Paired

ITERATIONS, END = "iterations", "end"  # the details in which a property that solves says how it went
PARTS = ("pair", "residual", "tangent")  # of an evaluation, as it is timed
CONVERGED = 0.0  # the code of an end that is one


@dataclass(frozen=True, slots=True, eq=False)
class Iterations:
    """How many Newton iterations a formulation took where a property solved.

    Attributes
    ----------
    what : str
        Empty, or which of several solutions of a case.
    solved, converged : int
        Numbers of cases.
    median, most : float
        Of the iterations of those that converged; NaN where none did.
    fewer, same, more : int
        Numbers of cases, of those where the reference converged too, against it.
    order : float
        Median order of one step, NaN where it was not measured.
    """

    formulation: str
    property_id: str
    what: str
    solved: int
    converged: int
    median: float
    most: float
    fewer: int
    same: int
    more: int
    order: float = nan

    @property
    def title(self) -> str:
        """The property, and which of its solutions."""
        return f"{self.property_id}, {self.what}" if self.what else self.property_id


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """Candidates against a reference, on the same cases.

    Attributes
    ----------
    reference : str
        The formulation that the others are held against.
    formulations : tuple[str, ...]
        All of them, the reference first.
    properties : tuple[str, ...]
        Ids, in the order of the run.
    cells : Mapping[tuple[str, str], Cell]
        By (formulation, property).
    paired : Mapping[tuple[str, str], Paired]
        By (candidate, property), where both decided some case.
    iterations : tuple[Iterations, ...]
        Of Newton's method, property by property.
    not_loaded : Mapping[str, str]
        {name: reason} of what could not be asked.
    provenance : Mapping[str, str]
        Of the run.
    """

    reference: str
    formulations: tuple[str, ...]
    properties: tuple[str, ...]
    cells: Mapping[tuple[str, str], Cell]
    paired: Mapping[tuple[str, str], Paired]
    iterations: tuple[Iterations, ...]
    not_loaded: Mapping[str, str]
    provenance: Mapping[str, str]

    @classmethod
    def of(cls, run: Run, reference: str) -> Comparison:
        """Of a live run that asked the reference too."""
        cells = {(row.formulation, row.question.id): Cell.of_row(row) for row in run.rows}
        named = dict.fromkeys(row.formulation for row in run.rows)
        formulations = (reference, *(name for name in named if name != reference))
        properties = tuple(dict.fromkeys(row.question.id for row in run.rows))
        pairs = {
            (name, id_): Paired.of(cells[name, id_], cells[reference, id_])
            for name in formulations[1:]
            for id_ in properties
        }
        return cls(
            reference=reference,
            formulations=formulations,
            properties=properties,
            cells=cells,
            paired={key: found for key, found in pairs.items() if found.n},
            iterations=tuple(
                line for id_ in properties for line in iterations([cells[name, id_] for name in formulations])
            ),
            not_loaded={item.formulation: item.reason for item in run.not_loaded},
            provenance=run.provenance,
        )

    @property
    def unexpected(self) -> tuple[Cell, ...]:
        """What candidates promised otherwise, or could not be judged on; the reference is not on trial."""
        return tuple(cell for (name, _), cell in self.cells.items() if name != self.reference and cell.unexpected)

    @property
    def kept(self) -> bool:
        """Whether every candidate was asked something and keeps all that it promises."""
        return not self.unexpected and not self.not_loaded and len(self.formulations) > 1


@dataclass(frozen=True, slots=True, eq=False)
class Cost:
    """Seconds of one evaluation on one state, the fastest of the turns; NaN for a part that is not provided.

    Attributes
    ----------
    n_segments : int
        Of the slave.
    seconds : dict[str, float]
        {"pair", "residual", "tangent"}.
    failed : str
        Empty, or why it could not be timed.
    """

    formulation: str
    n_segments: int
    seconds: dict[str, float]
    failed: str = ""

    @property
    def total(self) -> float:
        """Of all parts that are provided; NaN where nothing could be timed."""
        told = [value for value in self.seconds.values() if value == value]
        return sum(told) if told else nan


@dataclass(frozen=True, slots=True, eq=False)
class Differing:
    """The case of a property on which a candidate and the reference differ most.

    Attributes
    ----------
    question : Property
        The property.
    formulation : str
        The candidate.
    number : int
        Of the case in the run.
    apart : bool
        One passes and the other does not.
    decades : float
        Powers of ten beyond the tolerance that the candidate is further than the reference; negative where the
        reference is further.
    margin, reference_margin : float
        How far each went, over its tolerance.
    outcome, reference_outcome : Outcome
        Of the case.
    """

    question: Property
    formulation: str
    number: int
    apart: bool
    decades: float
    margin: float
    reference_margin: float
    outcome: Outcome
    reference_outcome: Outcome

    @property
    def case(self) -> Case:
        """The mesh and its state."""
        return self.outcome.case


def iterations(cells: Sequence[Cell]) -> list[Iterations]:
    """A line for each solution that the property keeps and each formulation; the first cell is the reference's."""
    found = []
    names = dict.fromkeys(
        name for cell in cells for name in cell.details if name == ITERATIONS or name.startswith(f"{ITERATIONS}, ")
    )
    orders = {cell.formulation: float(np.nanmedian(cell.orders)) for cell in cells if np.isfinite(cell.orders).any()}
    for name in names:
        _, _, what = name.partition(", ")
        reference = _converged(cells[0], name)
        for cell in cells:
            own = _converged(cell, name)
            if own is None:
                continue
            done = own[~np.isnan(own)]
            n_both = min(len(own), 0 if reference is None else len(reference))
            with np.errstate(invalid="ignore"):  # NaN compares as False
                against = np.sign(own[:n_both] - reference[:n_both]) if reference is not None else np.zeros(0)
            solved = int((~np.isnan(cell.details[name])).sum())
            median, most = (float(np.median(done)), float(done.max())) if len(done) else (nan, nan)
            fewer, same, more = (int((against == sign).sum()) for sign in (-1, 0, 1))
            order = orders.get(cell.formulation, nan)
            found.append(
                Iterations(
                    formulation=cell.formulation,
                    property_id=cell.property_id,
                    what=what,
                    solved=solved,
                    converged=len(done),
                    median=median,
                    most=most,
                    fewer=fewer,
                    same=same,
                    more=more,
                    order=order,
                )
            )
    return found


def _converged(cell: Cell, name: str) -> FloatArray | None:
    """(n_cases,) iterations of the cases that converged, NaN of the others; None where the property kept none."""
    if name not in cell.details:
        return None
    taken = cell.details[name]
    end = cell.details.get(name.replace(ITERATIONS, END, 1))
    found: FloatArray = taken if end is None else np.where(end == CONVERGED, taken, nan)
    return found
