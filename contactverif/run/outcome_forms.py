"""An outcome as a form and numbers: the words that many outcomes have in common, and what only one has.

The store of a row and the journal of a run keep outcomes in this way.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import freeze
from contactverif.contract.case_summary import CaseSummary
from contactverif.contract.property import Measurement, Outcome, Verdict

_ALWAYS = 6  # Seconds, numbers of segments, penalty and two lengths.


class OutcomeForm(NamedTuple):
    """The words and names that outcomes have in common. Most outcomes of a row have one of a few forms."""

    verdict: Verdict
    breach: bool
    measured: bool
    idle: bool
    reason: str
    texts: tuple[str, str, str]
    values: tuple[str, ...]
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
        return _ALWAYS + len(self.parameters) + 2 * len(self.values) + len(self.details) + sum(lengths)


def encode(outcome: Outcome) -> tuple[OutcomeForm, list[float]]:
    """Return the form of an outcome and its numbers; of its case only the summary stays."""
    summary, measurement = outcome.summary, outcome.measurement
    sizes = [float(summary.n_slave_segments), float(summary.n_master_segments)]
    lengths = [summary.penalty, summary.largest_coordinate, summary.shortest_segment]
    numbers = [outcome.seconds, *sizes, *lengths, *summary.parameters.values()]
    values: Mapping[str, float] = {}
    details: Mapping[str, float] = {}
    series: tuple[tuple[str, int], ...] = ()
    texts = "", "", ""
    if measurement is not None:
        values, details = measurement.values, measurement.details
        numbers += values.values()
        numbers += [measurement.tolerances[name] for name in values]
        numbers += details.values()
        series = tuple((name, len(entries)) for name, entries in measurement.series.items())
        for entries in measurement.series.values():
            numbers += np.asarray(entries).tolist()
        texts = measurement.undecided, measurement.broken, measurement.place
    form = OutcomeForm(
        outcome.verdict,
        bool(outcome.breach),
        measurement is not None,
        measurement is not None and bool(measurement.idle),
        outcome.reason,
        texts,
        tuple(values),
        tuple(details),
        series,
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
        undecided, broken, place = form.texts
        measurement = Measurement(
            read_named(form.values),
            read_named(form.values),
            undecided=undecided,
            broken=broken,
            place=place,
            details=read_named(form.details),
            series={name: freeze([next(rest) for _ in range(length)], np.float64) for name, length in form.series},
            idle=form.idle,
        )
    return Outcome(summary, form.verdict, form.reason, measurement, seconds, form.breach)
