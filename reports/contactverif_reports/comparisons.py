"""Formulations beside a reference, from the rows of a run: numbers by case, pairs, iterations, cost, and tables.

Rule for the next editor: numbers alone, for a terminal and for a page. Nothing is judged, solved or timed here, and it
does not matter whether a row comes from memory or from a file.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isnan, nan
from typing import Any

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray, freeze
from contactverif.contract.case import Case
from contactverif.contract.measurement import CheckedNumber
from contactverif.contract.property import DECIDED, Outcome, PropertyInfo, Verdict, checked_numbers
from contactverif.contract.result import Row, Run
from contactverif_reports.tables import Code, Column, Measured, ResultCell, Table, numbers

ORDER = "order of one Newton step"  # The quantity that measures the order of Newton's method.
# A smaller mesh is drawn if it shows at least this share of the largest difference, in decades.
MESH_CHOICE_SHARE = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class RowNumbers:
    """A row as numbers by case."""

    row: Row  # The result of one formulation on one property.
    verdicts: IntArray  # (n_cases,) Codes of `Verdict` of the random cases.
    # (n_cases,) The number of each case that is closest to its tolerance or furthest beyond it, over that tolerance
    # (the inverse for "at least"): above 1 fails. Infinite where a case fails without such a number (a crash, a NaN, a
    # breach); NaN where nothing was decided or measured.
    margins: FloatArray
    orders: FloatArray  # (n_cases,) Order of one Newton step; NaN where the property measures none.
    details: Mapping[str, FloatArray]  # {name: (n_cases,)} of further numbers; NaN where a case has none.
    closest: CheckedNumber | None  # The closest number of all random cases; None where there is none.
    # (n_cases, 5) Numbers of segments, penalty, largest coordinate, shortest segment: equal for equal cases.
    kinds: FloatArray
    # Median of the time that a case took, so that the first one, in which kernels compile, does not count.
    seconds: float

    @classmethod
    def from_row(cls, row: Row) -> RowNumbers:
        """Return the numbers of a row, collected in one pass over its cases."""
        facts = [_facts(row.info, outcome) for outcome in row.outcomes]
        verdicts, margins, orders, details, numbers, kinds, seconds = zip(*facts, strict=True) if facts else [()] * 7
        names = sorted({name for of_case in details for name in of_case})
        measured = (number for number in numbers if number is not None)
        return cls(
            row=row,
            verdicts=freeze(np.array(verdicts, dtype=np.int64), np.int64),
            margins=_column(margins),
            orders=_column(orders),
            details={name: _column([of_case.get(name, nan) for of_case in details]) for name in names},
            closest=max(measured, key=lambda number: number.ratio, default=None),
            kinds=freeze(np.array(kinds, dtype=np.float64).reshape(-1, 5), np.float64),
            seconds=float(np.median(seconds)) if facts else nan,
        )

    @property
    def decided(self) -> BoolArray:
        """(n_cases,) whether the case was judged."""
        return np.isin(self.verdicts, list(DECIDED))

    @property
    def median(self) -> float:
        """The median of the margins; NaN where there are none."""
        margins = self.margins[~np.isnan(self.margins)]
        return float(np.median(margins)) if len(margins) else nan

    @property
    def worst(self) -> float:
        """The largest of the margins; NaN where there are none."""
        margins = self.margins[~np.isnan(self.margins)]
        return float(margins.max()) if len(margins) else nan

    @property
    def standing(self) -> FloatArray:
        """(n_cases,) margins, 0 for a case that passes without a number; NaN where the case is undecided."""
        passed = (self.verdicts == Verdict.PASS) & np.isnan(self.margins)
        return np.where(passed, 0.0, self.margins)


def _facts(info: PropertyInfo, outcome: Outcome) -> tuple[Any, ...]:
    """Return verdict, margin, order, details, closest number, kind and seconds of one case."""
    measurement, case = outcome.measurement, outcome.summary
    closest = max(checked_numbers(info, measurement), key=lambda number: number.ratio, default=None)
    margin = nan if closest is None else closest.ratio
    if outcome.verdict not in DECIDED:
        margin = nan
    elif outcome.verdict is not Verdict.PASS and not (margin > 1 and outcome.verdict is Verdict.FAIL):
        margin = inf
    return (
        int(outcome.verdict),
        margin,
        nan if measurement is None else measurement.values.get(ORDER, nan),
        {} if measurement is None else measurement.details,
        closest if outcome.decided else None,
        (case.n_slave_segments, case.n_master_segments, case.penalty, case.largest_coordinate, case.shortest_segment),
        outcome.seconds,
    )


def _column(values: Sequence[float]) -> FloatArray:
    return freeze(np.array(values, dtype=np.float64), np.float64)


def statistics(old: RowNumbers, new: RowNumbers) -> list[tuple[str, float, float]]:
    """Return (name, before, after) of the median and the worst margin over the cases that both decided, if any."""
    n_cases = min(len(old.verdicts), len(new.verdicts))
    before, after = old.standing[:n_cases], new.standing[:n_cases]
    both = ~(np.isnan(before) | np.isnan(after))
    if not both.any():
        return []
    kinds = (("median", np.median), ("worst", np.max))
    return [(name, float(statistic(before[both])), float(statistic(after[both]))) for name, statistic in kinds]


@dataclass(frozen=True, slots=True, eq=False)
class Paired:
    """A candidate beside a reference on the cases that both decided.

    Their margins are equal if both keep their tolerances, or if both do not and are no further apart than one
    tolerance: roundoff may change a number by that much.
    """

    n: int  # Numbers of cases.
    better: int
    equal: int
    worse: int
    # Median over the cases of the candidate's margin over the reference's. A margin within the tolerance counts as 1,
    # because below it all is roundoff. NaN where there is none.
    ratio: float
    # (n_cases,) Powers of ten that the candidate is further beyond the tolerance than the reference; a margin within
    # it counts as 1. Negative where the reference is further, NaN where one of them is undecided.
    decades: FloatArray
    apart: BoolArray  # (n_cases,) One passes and the other does not.

    @classmethod
    def from_cells(cls, candidate: RowNumbers, reference: RowNumbers) -> Paired:
        """Compare cells over the same cases; further cases of the longer one are left out."""
        n_cases = min(len(candidate.verdicts), len(reference.verdicts))
        a, b = candidate.standing[:n_cases], reference.standing[:n_cases]
        # In other dimensions, or on faces that one of them does not take, the cases are others.
        alike = (candidate.kinds[:n_cases] == reference.kinds[:n_cases]).all(axis=1)
        both = alike & ~(np.isnan(a) | np.isnan(b))
        fails_a, fails_b = a > 1, b > 1
        apart = both & (fails_a != fails_b)
        with np.errstate(invalid="ignore"):  # ∞ − ∞
            close = np.abs(a - b) <= 1
        same = both & ~apart & (~fails_a | close | (a == b))
        worse = both & ~same & (a > b)
        return cls(
            n=int(both.sum()),
            better=int((both & ~same & ~worse).sum()),
            equal=int(same.sum()),
            worse=int(worse.sum()),
            ratio=_median_ratio(a[both], b[both]),
            decades=freeze(np.where(both, _decades(a, b), nan), np.float64),
            apart=freeze(apart, np.bool_),
        )

    def furthest(self, sizes: FloatArray) -> int | None:
        """Return the number of the case to draw; None where no case differs.

        Cases on which one passes and the other does not come first, then those that differ most. Of those that are at
        least half as far, in decades, it is the one with the smallest mesh (`sizes`, (n_cases,)).
        """
        far = np.abs(np.nan_to_num(self.decades, nan=0.0, posinf=inf, neginf=-inf))
        differs = self.apart if self.apart.any() else far > 0
        if not differs.any():
            return None
        enough = differs & (far >= MESH_CHOICE_SHARE * far[differs].max())
        numbers = np.flatnonzero(enough)
        return int(min(numbers, key=lambda number: (sizes[number], -far[number], number)))


def _median_ratio(a: FloatArray, b: FloatArray) -> float:
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = [np.log(np.fmax(margins, 1.0)) for margins in (a, b)]
        logs = np.where(a == b, 0.0, beyond[0] - beyond[1])  # Equal values may both be infinite.
        return float(np.exp(np.median(logs))) if len(logs) else nan


def _decades(a: FloatArray, b: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore"):  # ∞ − ∞
        decades: FloatArray = np.where(a == b, 0.0, np.log10(np.fmax(a, 1.0)) - np.log10(np.fmax(b, 1.0)))
    return decades


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
    cells: Mapping[tuple[str, str], RowNumbers]  # {(formulation, property): numbers}.
    paired: Mapping[tuple[str, str], Paired]  # {(candidate, property): comparison}, where both decided some case.
    iterations: tuple[Iterations, ...]  # Newton's iterations, property by property.
    not_loaded: Mapping[str, str]  # {name: reason} of plugins that did not load.
    provenance: Mapping[str, str]  # Where the run comes from.

    @classmethod
    def from_run(cls, run: Run, reference: str) -> Comparison:
        """Compare the formulations of a run with one of them."""
        cells = {key: RowNumbers.from_row(row) for key, row in run.row_of.items()}
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
    def unexpected(self) -> tuple[RowNumbers, ...]:
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


def count_iterations(cells: Sequence[RowNumbers]) -> list[Iterations]:
    """Count Newton's iterations over the rows of one property, one line for each solution and formulation."""
    names = sorted({name for cell in cells for name in cell.details if name.partition(", ")[0] == ITERATIONS})
    return [
        _iterations(cell, name, _converged_counts(cells[0], name))
        for name in names
        for cell in cells
        if name in cell.details
    ]


def _iterations(cell: RowNumbers, name: str, reference: FloatArray) -> Iterations:
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


def _converged_counts(cell: RowNumbers, name: str) -> FloatArray:
    """Return the iterations of the cases that converged, NaN for the others; empty where the property keeps none."""
    if name not in cell.details:
        return np.zeros(0)
    counts = cell.details[name]
    end = cell.details.get(name.replace(ITERATIONS, END, 1))
    return counts if end is None else np.where(end == CONVERGED, counts, nan)


# Tables of a comparison, for the terminal and for a page.

_NAME_WIDTH = 18  # The least width of a column of names in the terminal.


def name_column(page_head: str) -> Column:
    """Return the column of names below the title of a group, which has no head in the terminal."""
    return Column("", wrap=True, width=_NAME_WIDTH, page_head=page_head)


def results_table(comparison: Comparison) -> Table:
    """Return a line for each property and a column for each formulation, with a mark where verdicts differ."""
    columns = [Column("property"), *(Column(name, wrap=True) for name in comparison.formulations)]
    columns[1] = replace(columns[1], page_head=f"{comparison.reference} (reference)")
    table = Table(columns, f"results (≠: not that of {comparison.reference})")
    for id_ in comparison.properties:
        reference = comparison.cells.get((comparison.reference, id_))
        results = []
        for name in comparison.formulations:
            cell = comparison.cells.get((name, id_))
            if cell is None:
                results.append(ResultCell(None, differs=False))
                continue
            differs = reference is not None and cell.row.verdict is not reference.row.verdict
            results.append(ResultCell(cell.row.result, cell.row.unexpected, differs))
        table.add(Code(id_), *results)
    return table


def errors_table(comparison: Comparison) -> Table:
    """Return the errors over their tolerances, and each formulation beside the reference case by case."""
    title = f"error over tolerance, above 1 fails; ratio and numbers of cases beside {comparison.reference}"
    counts = numbers("median", "worst", "ratio", "better", "equal", "worse")
    worst = Column("worst number", page_head="number furthest beyond, or closest to, its tolerance")
    table = Table([name_column("property, formulation"), *counts, worst], title)
    for cell in measured_cells(comparison):
        paired = comparison.paired.get((cell.row.formulation, cell.row.property_id))
        beside = [None] * 4 if paired is None else [paired.ratio, paired.better, paired.equal, paired.worse]
        closest = None if cell.closest is None else Measured(cell.closest.value, cell.closest.quantity.name)
        table.add(cell.row.formulation, cell.median, cell.worst, *beside, closest, group=Code(cell.row.property_id))
    return table


def measured_cells(comparison: Comparison) -> list[RowNumbers]:
    """Return the cells of the table of errors, property by property, the reference first."""
    keys = [(name, id_) for id_ in comparison.properties for name in comparison.formulations]
    return [comparison.cells[key] for key in keys if key in comparison.cells and not isnan(comparison.cells[key].worst)]


def iterations_table(comparison: Comparison) -> Table:
    """Return Newton's iterations for each property that solves, and beside the reference where both converged."""
    title = f"Newton iterations where it converged; numbers of cases beside {comparison.reference}"
    heads = numbers("converged", "median", "most", "fewer", "same", "more", "order")
    table = Table([name_column("property, formulation"), *heads], title)
    for line in comparison.iterations:
        is_reference = line.formulation == comparison.reference
        counts = [None] * 3 if is_reference else [line.fewer, line.same, line.more]
        order = None if isnan(line.order) else line.order
        converged = f"{line.converged}/{line.solved}"
        table.add(line.formulation, converged, line.median, line.most, *counts, order, group=Code(line.title))
    return table


def cost_table(costs: Sequence[Cost], reference: str) -> Table:
    """Return the microseconds of an evaluation on shared states, and their ratio to those of the reference."""
    totals = {cost.n_segments: cost.total for cost in costs if cost.formulation == reference}
    title = f"time of one evaluation, µs, in turns on a flat interface; ratio to {reference}"
    columns = [name_column("slave segments, formulation"), *numbers(*PARTS, "all", "a segment", "ratio")]
    table = Table(columns, title)
    for cost in costs:
        times = [f"{1e6 * seconds:.1f}" for seconds in (*(cost.seconds[part] for part in PARTS), cost.total)]
        ratio = f"{cost.total / totals[cost.n_segments]:.2f}"
        cells = [*times, f"{1e6 * cost.total / cost.n_segments:.2f}", ratio]
        cells = ["–" if text == "nan" else text for text in cells]
        table.add(cost.formulation, *cells, group=f"{cost.n_segments} slave segments")
    return table
