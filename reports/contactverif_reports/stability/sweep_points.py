"""The numbers of the stability sweeps, by formulation and state, read from a run.

A run of the properties `stability.sweep` and `stability.stiffness` holds them as details of its measurements, whether
it was made now or read from a report. Rule for the next editor: nothing is judged or solved here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isnan, nan

from contactverif.contract.counterexample import named_case_id
from contactverif.contract.property import Outcome, Verdict, checked_numbers
from contactverif.contract.result import Row, Run

ERROR, CONDITION, FORCE_ERROR = "relative error", "condition number", "force error"  # Details of a measurement.
SWEEPS = {  # {sweep: how the names of its states look}, in the order of the legend
    "gap": r"gap-",
    "ratio of lengths": r"ratio-",
    "offset": r"offset-[^-]+-[a-z]$",
    "offset, gap 1e-6": r"offset-[^-]+-gap-",
    "offset, gap, ratio": r"all-",
    "ε̂h/E": r"stiffness-",
}
# The factor c of the line c u κ. Against 60 digits, 500 hard states of each formulation here had at most 1.8.
LINE_FACTOR = 4.0
TOLERANCE = 16.0  # The ω up to which the properties pass: other right ways of writing may lose a digit.
COLUMNS = {  # {heading of the table of ω: the states, whose names end in a letter of their mesh}
    "plain": "gap-1e-2",
    "gap 1e-9": "gap-1e-9",
    "offset 1e6": "offset-1e6",
    "offset 1e6, gap 1e-6": "offset-1e6-gap-1e-6",
    "ratio 1e6": "ratio-1e-6",
    "all of it": "all",
}
FAR_AND_CLOSE = COLUMNS["offset 1e6, gap 1e-6"]  # The states whose relative error of the forces is shown too.


@dataclass(frozen=True, slots=True)
class SweepPoint:
    """A formulation on one state."""

    name: str  # The name of the state.
    case_id: str  # The id by which `contactverif replay` finds the case.
    sweep: str  # The sweep that the state belongs to, a key of `SWEEPS`.
    roundings: float  # ω, the error over u κ.
    error: float  # The relative error and the condition number κ of the worst force: error = ω u κ.
    condition: float
    force_error: float  # The largest error of a force over the largest force.
    verdict: Verdict  # The verdict on the state.

    @property
    def above(self) -> bool:
        """Return whether the point is above the line c u κ."""
        return self.roundings > LINE_FACTOR

    @property
    def fails(self) -> bool:
        """Return whether the point is beyond the tolerance too. Then a report stores its state."""
        return self.verdict is Verdict.FAIL


@dataclass(frozen=True, slots=True, eq=False)
class SweepPanel:
    """All points of one formulation."""

    formulation: str  # The name on the command line.
    points: tuple[SweepPoint, ...]  # The states that gave numbers.
    # Numbers of states without a verdict, and of those where the formulation raised an error or broke the contract.
    n_undecided: int = 0
    n_crashed: int = 0
    remarks: tuple[str, ...] = ()  # Reasons why a property was not asked, or was not judged.

    @property
    def above(self) -> tuple[SweepPoint, ...]:
        """The points above the line, the worst first."""
        return tuple(sorted((p for p in self.points if p.above), key=lambda p: p.roundings, reverse=True))

    @property
    def worst(self) -> SweepPoint | None:
        """The point with the largest ω; None without points."""
        return max(self.points, key=lambda point: point.roundings, default=None)

    def roundings_at(self, stem: str) -> float:
        """Return the largest ω of the states whose names are the stem and a letter; NaN without such a state."""
        return max((point.roundings for point in self._points_at(stem)), default=nan)

    def force_error_at(self, stem: str) -> float:
        """Return the largest relative error of a force in these states; NaN without such a state."""
        return max((point.force_error for point in self._points_at(stem)), default=nan)

    def _points_at(self, stem: str) -> Iterator[SweepPoint]:
        return (point for point in self.points if re.fullmatch(rf"{re.escape(stem)}-[a-z]", point.name))


def short_number(value: float) -> str:
    """Return two digits of a number without signs and zeros that say nothing: 2.7e8; a dash for NaN."""
    if isnan(value):
        return "–"
    digits, e, power = f"{value:.2g}".partition("e")
    return f"{digits}e{int(power)}" if e else digits


def sweep_panels(run: Run) -> tuple[SweepPanel, ...]:
    """Return the points of each formulation of a run."""
    return tuple(_panel(name, list(run.rows_of(name))) for name in run.formulations)


def _panel(formulation: str, rows: Sequence[Row]) -> SweepPanel:
    points, remarks = [], []
    n_undecided = n_crashed = 0
    for row in rows:
        if not row.outcomes and row.reason:
            remarks.append(f"without {row.property_id} ({row.reason})")
        for outcome in row.outcomes:
            point = _point(row, outcome)
            if point is not None:
                points.append(point)
            elif outcome.verdict is Verdict.UNDECIDED:
                n_undecided += 1
            elif outcome.verdict is Verdict.CRASHED or outcome.breach:
                n_crashed += 1
    return SweepPanel(formulation, tuple(points), n_undecided, n_crashed, tuple(remarks))


def _point(row: Row, outcome: Outcome) -> SweepPoint | None:
    """Return the point of a state; None if it gave no number, or belongs to no sweep."""
    name = outcome.summary.name
    sweep = next((sweep for sweep, pattern in SWEEPS.items() if re.match(pattern, name)), None)
    numbers = checked_numbers(row.info, outcome.measurement)
    if sweep is None or outcome.measurement is None or not numbers or ERROR not in outcome.measurement.details:
        return None
    details = outcome.measurement.details
    return SweepPoint(
        name=name,
        case_id=named_case_id(row.formulation, row.property_id, name),
        sweep=sweep,
        roundings=numbers[0].value,
        error=details[ERROR],
        condition=details[CONDITION],
        force_error=details[FORCE_ERROR],
        verdict=outcome.verdict,
    )
