"""Rows beside other rows: numbers by case, pairs, iterations, cost, and the tables of a comparison of formulations.

Numbers alone: nothing is judged, solved or timed here. It does not matter whether a row comes from memory or a file.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, isnan, nan
from typing import Any, Self

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray, freeze
from contactverif.contract.case import Case
from contactverif.contract.property import DECIDED, CheckedNumber, Outcome, PropertyInfo, Verdict, checked_numbers
from contactverif.contract.result import NotLoaded, Row, Run
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
    def from_row(cls, row: Row) -> Self:
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
        return float(np.fmax.reduce(self.margins, initial=nan))

    @property
    def standing(self) -> FloatArray:
        """(n_cases,) margins, 0 for a case that passes without a number; NaN where the case is undecided."""
        passed = (self.verdicts == Verdict.PASS) & np.isnan(self.margins)
        return np.where(passed, 0.0, self.margins)


def _facts(info: PropertyInfo, outcome: Outcome) -> tuple[Any, ...]:
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


@dataclass(frozen=True, slots=True, eq=False)
class Pair:
    """A row beside another: a candidate's beside the reference's, or a new report's beside the old one's.

    Two margins are equal if both keep their tolerances, or if both do not and are no further apart than one tolerance:
    roundoff may change a number by that much. Cases that only the longer row has are left out.
    """

    new: RowNumbers
    old: RowNumbers
    n: int  # Numbers of cases that both decided.
    better: int
    equal: int
    worse: int
    # Median over the cases of the new margin over the old one. A margin within the tolerance counts as 1, because below
    # it all is roundoff. NaN where there is none.
    ratio: float
    # (n_cases,) Powers of ten that the new row is further beyond the tolerance; a margin within it counts as 1.
    # Negative where the old row is further, NaN where one of them is undecided.
    decades: FloatArray
    apart: BoolArray  # (n_cases,) One passes and the other does not.

    @classmethod
    def from_cells(cls, new: RowNumbers, old: RowNumbers) -> Self:
        """Compare the margins of two rows case by case."""
        n_cases = min(len(new.verdicts), len(old.verdicts))
        a, b = new.standing[:n_cases], old.standing[:n_cases]
        # In other dimensions, or on faces that one of them does not take, the cases are others.
        alike = (new.kinds[:n_cases] == old.kinds[:n_cases]).all(axis=1)
        both = alike & ~(np.isnan(a) | np.isnan(b))
        apart = both & ((a > 1) != (b > 1))
        with np.errstate(divide="ignore", invalid="ignore"):  # ∞ − ∞; equal values may both be infinite.
            same = both & ~apart & ((a <= 1) | (np.abs(a - b) <= 1) | (a == b))
            logs = np.log(np.fmax(a[both], 1.0)) - np.log(np.fmax(b[both], 1.0))
            ratio = float(np.exp(np.median(np.where(a[both] == b[both], 0.0, logs)))) if both.any() else nan
            decades = np.where(a == b, 0.0, np.log10(np.fmax(a, 1.0)) - np.log10(np.fmax(b, 1.0)))
        worse = both & ~same & (a > b)
        return cls(
            *(new, old, int(both.sum()), int((both & ~same & ~worse).sum()), int(same.sum()), int(worse.sum()), ratio),
            decades=freeze(np.where(both, decades, nan), np.float64),
            apart=freeze(apart, np.bool_),
        )

    def statistics(self) -> list[tuple[str, float, float]]:
        """Return (name, old, new) of the median and the worst margin over the cases that both decided, if any."""
        n_cases = len(self.decades)
        before, after = self.old.standing[:n_cases], self.new.standing[:n_cases]
        both = ~(np.isnan(before) | np.isnan(after))
        kinds = (("median", np.median), ("worst", np.max)) if both.any() else ()
        return [(name, float(statistic(before[both])), float(statistic(after[both]))) for name, statistic in kinds]

    def furthest(self) -> int | None:
        """Return the number of the case to draw; None where no case differs.

        Cases on which one passes and the other does not come first, then those that differ most. Of those that are at
        least half as far, in decades, it is the one with the smallest mesh.
        """
        far = np.abs(np.nan_to_num(self.decades, nan=0.0, posinf=inf, neginf=-inf))
        differs = self.apart if self.apart.any() else far > 0
        if not differs.any():
            return None
        sizes = self.new.kinds[:, :2].sum(axis=1)
        numbers = np.flatnonzero(differs & (far >= MESH_CHOICE_SHARE * far[differs].max()))
        return int(min(numbers, key=lambda number: (sizes[number], -far[number], number)))


@dataclass(frozen=True, slots=True, eq=False)
class Differing:
    """The case of a property on which a candidate and the reference differ most."""

    pair: Pair
    number: int  # The number of the case in the run.
    case: Case | None = None  # The mesh and its state; a run of many examples does not keep them all.

    @property
    def info(self) -> PropertyInfo:
        """The property."""
        return self.pair.new.row.info

    @property
    def rank(self) -> tuple[bool, float]:
        """True if one passes and the other does not; and the powers of ten between them."""
        far = abs(float(self.pair.decades[self.number]))
        return bool(self.pair.apart[self.number]), inf if isnan(far) else far

    @property
    def sides(self) -> tuple[tuple[str, Outcome, float], ...]:
        """(formulation, outcome, error over its tolerance) of the candidate and of the reference."""
        outcomes = [cell.row.outcomes[self.number] for cell in (self.pair.new, self.pair.old)]
        if self.case is not None:
            outcomes = [replace(outcome, case_or_summary=self.case) for outcome in outcomes]
        return tuple(
            (cell.row.formulation, outcome, float(cell.standing[self.number]))
            for cell, outcome in zip((self.pair.new, self.pair.old), outcomes, strict=True)
        )


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
    pairs: Mapping[tuple[str, str], Pair]  # {(candidate, property): beside the reference}, where both were asked.
    iterations: tuple[Iterations, ...]  # Newton's iterations, property by property.
    not_loaded: Mapping[str, str]  # {name: reason} of plugins that did not load.
    provenance: Mapping[str, str]  # Where the run comes from.

    @classmethod
    def from_run(cls, run: Run, reference: str) -> Self:
        """Compare the formulations of a run with one of them."""
        cells = {key: RowNumbers.from_row(row) for key, row in run.row_of.items()}
        candidates = [name for name in dict.fromkeys(name for name, _ in cells) if name != reference]
        formulations, properties = (reference, *candidates), tuple(run.properties)
        pairs = {
            (name, id_): Pair.from_cells(cells[name, id_], cells[reference, id_])
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
            pairs=pairs,
            iterations=tuple(itertools.chain.from_iterable(lines)),
            not_loaded={item.formulation: item.reason for item in run.not_loaded},
            provenance=run.provenance,
        )

    @property
    def candidates(self) -> Run:
        """The candidates as a run of their own: the reference is not on trial."""
        rows = (cell.row for (name, _), cell in self.cells.items() if name != self.reference)
        return Run(tuple(rows), tuple(NotLoaded(*item) for item in self.not_loaded.items()))

    @property
    def differing(self) -> list[Differing]:
        """For each property the case on which a candidate differs most from the reference, the largest rank first."""
        largest: dict[str, Differing] = {}
        for id_, name in itertools.product(self.properties, self.formulations[1:]):
            pair = self.pairs.get((name, id_))
            if pair is not None and (number := pair.furthest()) is not None:
                differing = Differing(pair, number)
                if id_ not in largest or differing.rank > largest[id_].rank:
                    largest[id_] = differing
        return sorted(largest.values(), key=lambda differing: differing.rank, reverse=True)


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


def count_iterations(cells: Sequence[RowNumbers]) -> list[Iterations]:
    """Count Newton's iterations over the rows of one property, one line for each solution and formulation."""
    names = sorted({name for cell in cells for name in cell.details if name.partition(", ")[0] == ITERATIONS})
    lines = []
    for name in names:
        reference = _converged_counts(cells[0], name)
        for cell in cells:
            if name not in cell.details:
                continue
            counts = _converged_counts(cell, name)
            converged = counts[~np.isnan(counts)]
            n_both = min(len(counts), len(reference))
            with np.errstate(invalid="ignore"):  # A comparison with NaN is False, as it should be.
                against = np.sign(counts[:n_both] - reference[:n_both])
            lines.append(
                Iterations(
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
            )
    return lines


def _converged_counts(cell: RowNumbers, name: str) -> FloatArray:
    """Return the iterations of the cases that converged, NaN for the others; empty where the property keeps none."""
    if name not in cell.details:
        return np.zeros(0)
    end = cell.details.get(name.replace(ITERATIONS, END, 1))
    return cell.details[name] if end is None else np.where(end == CONVERGED, cell.details[name], nan)


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
        pair = comparison.pairs.get((cell.row.formulation, cell.row.property_id))
        beside = [pair.ratio, pair.better, pair.equal, pair.worse] if pair is not None and pair.n else [None] * 4
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
