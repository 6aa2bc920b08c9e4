"""An outcome as a form and numbers: the words that many outcomes have in common, and what only one has.

The store of a row and the journal of a run keep outcomes in this way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import freeze
from contactverif.contract.case import CaseSummary
from contactverif.contract.property import Finding, Measurement, Outcome, Quantity, Verdict

_ALWAYS = 6  # Seconds, numbers of segments, penalty and two lengths.


class OutcomeForm(NamedTuple):
    """The words and names that outcomes have in common. Most outcomes of a row have one of a few forms."""

    verdict: Verdict
    breach: bool
    measured: bool
    idle: bool
    reason: str
    undecided: str
    broken: str
    quantities: tuple[Quantity, ...]
    finding: Finding | None  # Without its numbers.
    n_found: int
    details: tuple[str, ...]
    series: tuple[tuple[str, int], ...]
    parameters: tuple[str, ...]
    case_name: str
    kind: str

    @property
    def n_numbers(self) -> int:
        """The number of numbers that an outcome of this form has."""
        lengths = [length for _, length in self.series]
        if min(lengths, default=0) < 0:
            raise ValueError(f"a series of {min(lengths)} numbers")
        n_pairs = len(self.quantities) + self.n_found
        return _ALWAYS + len(self.parameters) + 2 * n_pairs + len(self.details) + sum(lengths)


def encode(outcome: Outcome) -> tuple[OutcomeForm, list[float]]:
    """Return the form of an outcome and its numbers; of its case only the summary stays."""
    summary, measurement = outcome.summary, outcome.measurement
    sizes = [float(summary.n_slave_segments), float(summary.n_master_segments)]
    lengths = [summary.penalty, summary.largest_coordinate, summary.shortest_segment]
    numbers = [outcome.seconds, *sizes, *lengths, *summary.parameters.values()]
    measured = measurement or Measurement()
    finding = measured.finding or Finding("")
    numbers += np.array([(number.value, number.tolerance) for number in measured.numbers]).ravel().tolist()
    numbers += np.concatenate([[*measured.details.values()], *measured.series.values()]).tolist()
    numbers += finding.found + finding.right
    form = OutcomeForm(
        outcome.verdict,
        bool(outcome.breach),
        measurement is not None,
        bool(measured.idle),
        outcome.reason,
        measured.undecided,
        measured.broken,
        tuple(number.quantity for number in measured.numbers),
        measured.finding and replace(finding, found=(), right=()),
        len(finding.found),
        tuple(measured.details),
        tuple((name, len(entries)) for name, entries in measured.series.items()),
        tuple(summary.parameters),
        summary.name,
        summary.kind,
    )
    return form, numbers


def decode(form: OutcomeForm, numbers: Sequence[float]) -> Outcome:
    """Return the outcome that `encode` made a form and numbers of."""
    rest = iter(numbers)

    def read_named(names: Sequence[str]) -> dict[str, float]:
        return {name: next(rest) for name in names}

    seconds, n_slave, n_master, penalty, largest, shortest = (next(rest) for _ in range(_ALWAYS))
    parameters = read_named(form.parameters)
    summary = CaseSummary(
        int(n_slave), int(n_master), penalty, largest, shortest, parameters, form.case_name, form.kind
    )
    measurement = None
    if form.measured:
        measurement = Measurement(
            [quantity.check(next(rest), next(rest)) for quantity in form.quantities],
            undecided=form.undecided,
            broken=form.broken,
            details=read_named(form.details),
            series={name: freeze([next(rest) for _ in range(length)], np.float64) for name, length in form.series},
            idle=form.idle,
        )
        if form.finding is not None:
            found, right = (tuple(next(rest) for _ in range(form.n_found)) for _ in range(2))
            measurement = replace(measurement, finding=replace(form.finding, found=found, right=right))
    return Outcome(summary, form.verdict, form.reason, measurement, seconds, form.breach)
