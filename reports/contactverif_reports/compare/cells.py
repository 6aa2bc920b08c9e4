"""The rows of a run as numbers by case, and two of those beside each other.

Rule for the next editor: nothing is judged here. A `Cell` is arrays that follow from its `Row`, and it does not matter
whether the row comes from memory or from a file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import Any

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray, freeze
from contactverif.contract.measurement import CheckedNumber
from contactverif.contract.property import DECIDED, Outcome, PropertyInfo, Verdict, checked_numbers
from contactverif.contract.result import Row

ORDER = "order of one Newton step"  # The quantity that measures the order of Newton's method.
# A smaller mesh is drawn if it shows at least this share of the largest difference, in decades.
MESH_CHOICE_SHARE = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Cell:
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
    def from_row(cls, row: Row) -> Cell:
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
    return (
        int(outcome.verdict),
        margin(outcome.verdict, nan if closest is None else closest.ratio),
        nan if measurement is None else measurement.values.get(ORDER, nan),
        {} if measurement is None else measurement.details,
        closest if outcome.decided else None,
        (case.n_slave_segments, case.n_master_segments, case.penalty, case.largest_coordinate, case.shortest_segment),
        outcome.seconds,
    )


def margin(verdict: Verdict, furthest: float) -> float:
    """Return the margin of a case with that verdict whose closest number is `furthest` (NaN: there is none)."""
    if verdict not in DECIDED:
        return nan
    if verdict is Verdict.PASS:
        return furthest
    return furthest if furthest > 1 and verdict is Verdict.FAIL else inf


def _column(values: Sequence[float]) -> FloatArray:
    return freeze(np.array(values, dtype=np.float64), np.float64)


def statistics(old: Cell, new: Cell) -> list[tuple[str, float, float]]:
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
    def from_cells(cls, candidate: Cell, reference: Cell) -> Paired:
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
