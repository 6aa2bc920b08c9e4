"""The records of a run's journal: outcomes, their forms, and the blocks of cases that were drawn.

An outcome stands there as it does in memory: its form, once in a file, and its numbers. A change of a record is a new
`FORMAT` of the plan.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from contactverif.contract.arrays import freeze
from contactverif.contract.case import CaseSummary
from contactverif.contract.measurement import Finding, Measurement, Quantity
from contactverif.contract.property import Outcome, Verdict
from contactverif.journals.journal import JournalKey, RecordFile

WITNESS = -1  # The number of the outcome of a row's witness.
MOST_FORMS = 10_000  # The most forms that a process remembers.
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


def encode_outcome(outcome: Outcome) -> tuple[OutcomeForm, list[float]]:
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


def decode_outcome(form: OutcomeForm, numbers: Sequence[float]) -> Outcome:
    """Return the outcome that `encode_outcome` made a form and numbers of."""
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


class FormRecord(msgspec.Struct, frozen=True, array_like=True, tag="form"):
    """The form of outcomes that stand behind it in the same file."""

    form: OutcomeForm


class OutcomeRecord(msgspec.Struct, frozen=True, array_like=True, tag="outcome"):
    """The outcome of one case."""

    row: int  # Its number in the plan.
    number: int  # The number of the case in the row; `WITNESS` for its witness.
    form: int  # The place of the form in the file, in bytes.
    numbers: bytes  # As little-endian float64.


class BlockRecord(msgspec.Struct, frozen=True, array_like=True, tag="block"):
    """A block of cases that was drawn."""

    group: str  # The name of the cases' source and seed.
    number: int
    count: int  # The number of its cases.
    exhausted: bool  # The strategy has no other cases.
    last: bool  # No further block follows.


class DistrustRecord(msgspec.Struct, frozen=True, array_like=True, tag="distrust"):
    """A row of which an outcome without a proof was wrong: of these files only what is proven counts for it."""

    row: int
    files: tuple[str, ...]


Record = FormRecord | OutcomeRecord | BlockRecord | DistrustRecord
ENCODER = msgspec.msgpack.Encoder(enc_hook=str)  # Words of a property may be of a type of their own.
DECODER: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(Record)


class OutcomeFile:
    """The file in which this process notes outcomes and blocks."""

    def __init__(self, folder: Path, key: JournalKey) -> None:
        self.file = RecordFile(folder, key)
        self._forms: dict[OutcomeForm, int] = {}

    def add_outcome(self, row: int, number: int, outcome: Outcome) -> None:
        """Append the outcome of a case."""
        form, numbers = encode_outcome(outcome)
        if form not in self._forms:
            if len(self._forms) >= MOST_FORMS:
                self._forms.clear()
            place = self.file.append(_form_message(form))
            if place is None:
                return
            self._forms[form] = place
        record = OutcomeRecord(row, number, self._forms[form], array("d", numbers).tobytes())
        self.file.append(ENCODER.encode(record))

    def add_block(self, block: BlockRecord) -> None:
        """Append a block that was drawn."""
        self.file.append(ENCODER.encode(block))


def _form_message(form: OutcomeForm) -> bytes:
    try:
        return ENCODER.encode(FormRecord(form))
    except UnicodeEncodeError:  # Words of a plugin may hold half of a character.
        return ENCODER.encode(("form", _writable(msgspec.to_builtins(form))))


def _writable(item: Any) -> Any:
    """Return words and tuples of words in which what is no character is spelled out."""
    if isinstance(item, str):
        return item.encode("utf-8", "backslashreplace").decode()
    return [_writable(part) for part in item] if isinstance(item, list | tuple) else item


def outcome_of(record: OutcomeRecord, form: OutcomeForm) -> Outcome | None:
    """Return the outcome of a record and its form; None if they do not belong together."""
    if len(record.numbers) % array("d").itemsize:
        return None
    numbers = array("d", record.numbers)
    try:
        return decode_outcome(form, numbers.tolist()) if form.n_numbers == len(numbers) else None
    except (ValueError, OverflowError):  # Such as NaN segments.
        return None
