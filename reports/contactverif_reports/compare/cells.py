"""What one formulation made of one property, as numbers by case, and two of those beside each other.

A `Cell` comes from a row of a live run or of a stored report; what is said of two of them (`Paired`) is the same for
both. Nothing is judged here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, nan

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray, freeze
from contactverif.contract.property import Outcome, Property, Verdict, excess
from contactverif.contract.result import Row
from contactverif_reports.netcdf.summary_group import worst

ORDER = "order of one Newton step"  # the quantity of a property that measures the order of Newton's method
HALF = 0.5  # of the largest difference, in decades: whoever is that far may be drawn for its smaller mesh


@dataclass(frozen=True, slots=True, eq=False)
class Cell:
    """What one formulation made of one property.

    Attributes
    ----------
    formulation, property_id : str
        As typed on the command line.
    verdict, promise, unexpected, reason, planned : Verdict or bool | None or str or int
        As of `contactverif.contract.result.Row`.
    verdicts : IntArray, shape (n_cases,)
        Of the random cases, codes of `Verdict`.
    margins : FloatArray, shape (n_cases,)
        The quantity that went furthest towards its tolerance or beyond, over it (the inverse where it must be
        at least that): above 1 fails. Infinite where it fails without such a number (a crash, a NaN, a breach);
        NaN where nothing was decided or measured.
    orders : FloatArray, shape (n_cases,)
        Order of one Newton step; empty where the property measures none.
    details : Mapping[str, FloatArray]
        {name: (n_cases,)} further numbers.
    worst_value, worst_quantity : float or str
        The number with the largest margin, in its own unit; NaN and empty if there is none.
    kinds : FloatArray, shape (n_cases, 5)
        Numbers of segments, penalty, largest coordinate, shortest segment: equal for equal cases.
    seconds : float
        Median of what judging a case took, so that the first one, in which kernels compile, does not count.
    """

    formulation: str
    property_id: str
    verdict: Verdict
    promise: bool | None
    unexpected: str
    reason: str
    planned: int
    verdicts: IntArray
    margins: FloatArray
    orders: FloatArray
    details: Mapping[str, FloatArray]
    worst_value: float
    worst_quantity: str
    kinds: FloatArray
    seconds: float

    @classmethod
    def of_row(cls, row: Row) -> Cell:
        """Of a live run."""
        outcomes, found_worst = row.outcomes, worst(row)
        measured = [outcome.measurement for outcome in outcomes]
        names = dict.fromkeys(name for found in measured if found is not None for name in found.details)
        orders = [nan if found is None else found.values.get(ORDER, nan) for found in measured]
        return cls(
            formulation=row.formulation,
            property_id=row.question.id,
            verdict=row.verdict,
            promise=row.promise,
            unexpected=row.unexpected,
            reason=row.reason,
            planned=row.planned,
            verdicts=freeze(np.array([int(outcome.verdict) for outcome in outcomes], dtype=np.int64), np.int64),
            margins=freeze(np.array([margin(row.question, outcome) for outcome in outcomes]), np.float64),
            orders=freeze(np.array(orders), np.float64),
            details={
                name: freeze(np.array([nan if m is None else m.details.get(name, nan) for m in measured]), np.float64)
                for name in names
            },
            worst_value=nan if found_worst is None else found_worst.value,
            worst_quantity="" if found_worst is None else found_worst.quantity.name,
            kinds=freeze(np.array([_kind(outcome) for outcome in outcomes]).reshape(-1, 5), np.float64),
            seconds=float(np.median([outcome.seconds for outcome in outcomes])) if outcomes else nan,
        )

    @property
    def decided(self) -> BoolArray:
        """(n_cases,) whether the case was judged."""
        found: BoolArray = np.isin(self.verdicts, [Verdict.PASS, Verdict.FAIL, Verdict.CRASHED])
        return found

    @property
    def judged(self) -> int:
        """Number of random cases that were decided."""
        return int(self.decided.sum())

    @property
    def median(self) -> float:
        """Of the margins; NaN where there are none."""
        told = self.margins[~np.isnan(self.margins)]
        return float(np.median(told)) if len(told) else nan

    @property
    def worst(self) -> float:
        """Of the margins; NaN where there are none."""
        told = self.margins[~np.isnan(self.margins)]
        return float(told.max()) if len(told) else nan

    @property
    def standing(self) -> FloatArray:
        """(n_cases,) margins, 0 for a case that passes without a number; NaN where the case is undecided."""
        passed = (self.verdicts == Verdict.PASS) & np.isnan(self.margins)
        found: FloatArray = np.where(passed, 0.0, self.margins)
        return found


def margin(question: Property, outcome: Outcome) -> float:
    """How far the case went towards its tolerance, as `Cell.margins`."""
    found = outcome.measurement
    numbers = [
        excess(quantity, found.values[quantity.name], found.tolerances[quantity.name])
        for quantity in (question.quantities if found is not None else ())
        if found is not None and quantity.name in found.values
    ]
    return margin_of(outcome.verdict, max(numbers, default=nan))


def margin_of(verdict: Verdict, furthest: float) -> float:
    """The margin of a case with that verdict whose numbers went so far (NaN: there are none)."""
    if verdict not in (Verdict.PASS, Verdict.FAIL, Verdict.CRASHED):
        return nan
    if verdict is Verdict.PASS:
        return furthest
    return furthest if furthest > 1 and verdict is Verdict.FAIL else inf


def statistics(old: Cell, new: Cell) -> list[tuple[str, float, float]]:
    """Name, before and after, of the median and the worst margin of the same cases that both decided, if any."""
    n_cases = min(len(old.verdicts), len(new.verdicts))
    before, after = old.standing[:n_cases], new.standing[:n_cases]
    both = ~(np.isnan(before) | np.isnan(after))
    if not both.any():
        return []
    of = (("median", np.median), ("worst", np.max))
    return [(name, float(statistic(before[both])), float(statistic(after[both]))) for name, statistic in of]


def _kind(outcome: Outcome) -> tuple[float, ...]:
    case, interface = outcome.case, outcome.case.interface
    sizes = len(interface.slave), len(interface.master)
    return (*map(float, sizes), case.penalty, case.largest_coordinate, case.shortest_segment)


@dataclass(frozen=True, slots=True, eq=False)
class Paired:
    """One formulation beside another on the cases that both decided.

    Two are equal where both keep their tolerances, or both do not and are no further apart than one tolerance: that is
    what roundoff may do to a number.

    Attributes
    ----------
    n, better, equal, worse : int
        Numbers of cases.
    ratio : float
        Median over the cases of the one's margin over the other's, where one within its tolerance counts as at
        it: below it all is roundoff. NaN where there is none.
    decades : FloatArray, shape (n_cases,)
        How many powers of ten beyond the tolerance the one is further than the other; within it counts as at
        it. Negative where the other is further, NaN where one of them is undecided.
    apart : BoolArray, shape (n_cases,)
        One passes and the other does not.
    """

    n: int
    better: int
    equal: int
    worse: int
    ratio: float
    decades: FloatArray
    apart: BoolArray

    @classmethod
    def of(cls, one: Cell, other: Cell) -> Paired:
        """Cells over the same cases; what one has more of them is left out."""
        n_cases = min(len(one.verdicts), len(other.verdicts))
        a, b = one.standing[:n_cases], other.standing[:n_cases]
        both = ~(np.isnan(a) | np.isnan(b))
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
        """Number of the case to draw; None where no case differs.

        Cases on which one passes and the other does not come first, then those that differ most. Of those that are at
        least half as far, in decades, it is the one with the smallest mesh (`sizes`, (n_cases,)).
        """
        far = np.abs(np.nan_to_num(self.decades, nan=0.0, posinf=inf, neginf=-inf))
        chosen = self.apart if self.apart.any() else far > 0
        if not chosen.any():
            return None
        enough = chosen & (far >= HALF * far[chosen].max())
        numbers = np.flatnonzero(enough)
        return int(min(numbers, key=lambda number: (sizes[number], -far[number], number)))


def _median_ratio(a: FloatArray, b: FloatArray) -> float:
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = [np.log(np.fmax(margins, 1.0)) for margins in (a, b)]
        logs = np.where(a == b, 0.0, beyond[0] - beyond[1])  # equal: both infinite too
        return float(np.exp(np.median(logs))) if len(logs) else nan


def _decades(a: FloatArray, b: FloatArray) -> FloatArray:
    with np.errstate(invalid="ignore"):  # ∞ − ∞
        found: FloatArray = np.where(a == b, 0.0, np.log10(np.fmax(a, 1.0)) - np.log10(np.fmax(b, 1.0)))
    return found
