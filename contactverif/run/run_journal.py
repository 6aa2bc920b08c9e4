"""The journal of a run: its plan and every outcome as it comes, so that no case is judged twice.

An outcome stands there as it does in memory: its form, once in a file, and its numbers. Nothing in a journal is
believed before it is checked; an outcome that cannot be read is judged again. A change of a record is a new `FORMAT`.
"""

from __future__ import annotations

import os
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from secrets import token_hex
from typing import IO, Any, NamedTuple

import msgspec
import numpy as np

from contactverif.contract.arrays import freeze
from contactverif.contract.case import CaseSummary
from contactverif.contract.errors import MisuseError
from contactverif.contract.measurement import Finding, Measurement, Quantity
from contactverif.contract.property import Outcome, Verdict
from contactverif.run.journal import RecordFile, decode, read_header, read_message, read_messages, record_files

FORMAT = 2
WITNESS = -1  # The number of the outcome of a row's witness.
_MOST_FORMS = 10_000  # The most forms that a process remembers.
_MOST_WRITERS = 4  # The most journals that a process has open for writing.
_OPEN_FILES = 100  # The most files that are open for reading.
_FILE_BITS = 40  # A place is the number of its file, then this many bits for the byte.
_ALWAYS = 6  # Seconds, numbers of segments, penalty and two lengths.
_LEAST_ROOM = 10_000  # A finite list may have this many cases.


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """The plan of a run, the header of its journal. A row is a formulation and a property, as on the command line."""

    command: str = ""
    options: dict[str, Any] = {}
    folder: str = ""  # The working folder of the command, to which names of files are relative.
    versions: dict[str, str] = {}  # {library or package: version or digest}.
    formulations: tuple[str, ...] = ()
    properties: tuple[str, ...] = ()
    profile: str = ""
    examples: int = 0
    seed: int = 0
    format: int = FORMAT


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


Record = FormRecord | OutcomeRecord | BlockRecord
_ENCODER = msgspec.msgpack.Encoder(enc_hook=str)  # Words of a property may be of a type of their own.
_DECODER: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(Record)


class OutcomeFile:
    """The file in which this process notes outcomes and blocks."""

    def __init__(self, folder: Path) -> None:
        self.file = RecordFile(folder)
        self._forms: dict[OutcomeForm, int] = {}

    def add_outcome(self, row: int, number: int, outcome: Outcome) -> None:
        """Append the outcome of a case."""
        form, numbers = encode_outcome(outcome)
        if form not in self._forms:
            if len(self._forms) >= _MOST_FORMS:
                self._forms.clear()
            place = self.file.append(_form_message(form))
            if place is None:
                return
            self._forms[form] = place
        record = OutcomeRecord(row, number, self._forms[form], array("d", numbers).tobytes())
        self.file.append(_ENCODER.encode(record))

    def add_block(self, block: BlockRecord) -> None:
        """Append a block that was drawn."""
        self.file.append(_ENCODER.encode(block))


def _form_message(form: OutcomeForm) -> bytes:
    try:
        return _ENCODER.encode(FormRecord(form))
    except UnicodeEncodeError:  # Words of a plugin may hold half of a character.
        return _ENCODER.encode(("form", _writable(msgspec.to_builtins(form))))


def _writable(item: Any) -> Any:
    """Return words and tuples of words in which what is no character is spelled out."""
    if isinstance(item, str):
        return item.encode("utf-8", "backslashreplace").decode()
    return [_writable(part) for part in item] if isinstance(item, list | tuple) else item


class KnownOutcomes:
    """The outcomes and the blocks in the files of some journals. Of an outcome only its place is in memory.

    A plan has `n_rows` rows, and cases with the number `room` or a larger one are not believed.
    """

    def __init__(self, folders: Sequence[Path], n_rows: int, room: int) -> None:
        self.blocks: dict[tuple[str, int], BlockRecord] = {}  # By group and number.
        self.n_outcomes = 0  # The number of different cases that are judged, witnesses included.
        self.n_twice = 0  # The number of further outcomes of the same cases.
        self._paths = [path for folder in folders for path in record_files(folder)]
        self._places = [array("q") for _ in range(n_rows)]  # One more than the place, or 0; the witness comes first.
        self._room = room
        self._files: dict[int, IO[bytes]] = {}
        self._form = lru_cache(_MOST_FORMS)(self._read_form)
        for number, path in enumerate(self._paths):
            self._read_file(path, number << _FILE_BITS)

    def outcome(self, row: int, number: int) -> Outcome | None:
        """Return the outcome of a case of a row; None if it is not known."""
        places = self._places[row]
        slot = number - WITNESS
        if slot >= len(places) or not places[slot]:
            return None
        file, place = divmod(places[slot] - 1, 1 << _FILE_BITS)
        record = self._read(file, place)
        form = self._form(file, record.form) if isinstance(record, OutcomeRecord) else None
        if form is None or not isinstance(record, OutcomeRecord) or (record.row, record.number) != (row, number):
            return None
        return _outcome_of(record, form)

    def close(self) -> None:
        """Close the files."""
        while self._files:
            self._files.popitem()[1].close()

    def _read_file(self, path: Path, start: int) -> None:
        """Note the place of each outcome of a file, up to the first record that is damaged."""
        for place, message in read_messages(path):
            record = decode(message, _DECODER)
            if record is None:
                return
            if isinstance(record, OutcomeRecord):
                self._add(record, start | place)
            elif isinstance(record, BlockRecord) and record.number >= 0 and 0 <= record.count < self._room:
                self.blocks[record.group, record.number] = record

    def _add(self, record: OutcomeRecord, place: int) -> None:
        if not (0 <= record.row < len(self._places) and WITNESS <= record.number < self._room):
            return
        places, slot = self._places[record.row], record.number - WITNESS
        if slot >= len(places):
            places.extend([0] * (slot + 1 - len(places)))
        self.n_twice += places[slot] != 0
        self.n_outcomes += places[slot] == 0
        places[slot] = place + 1

    def _read(self, file: int, place: int) -> Record | None:
        if file not in self._files:
            if len(self._files) >= _OPEN_FILES:
                self._files.pop(next(iter(self._files))).close()
            self._files[file] = self._paths[file].open("rb")
        message = read_message(self._files[file], place)
        return None if message is None else decode(message, _DECODER)

    def _read_form(self, file: int, place: int) -> OutcomeForm | None:
        record = self._read(file, place)
        return record.form if isinstance(record, FormRecord) else None


def _outcome_of(record: OutcomeRecord, form: OutcomeForm) -> Outcome | None:
    """Return the outcome of a record and its form; None if they do not belong together."""
    if len(record.numbers) % array("d").itemsize:
        return None
    numbers = array("d", record.numbers)
    try:
        return decode_outcome(form, numbers.tolist()) if form.n_numbers == len(numbers) else None
    except (ValueError, OverflowError):  # Such as NaN segments.
        return None


@dataclass(frozen=True, slots=True)
class Notes:
    """The place in a journal where the outcomes of some cases go. It travels to the process that judges them."""

    folder: str  # Empty if there is no journal.
    session: str  # A word for the process that began or resumed the run.
    row: int
    first: int  # The number of the first of the cases.

    def add(self, place: int, outcome: Outcome) -> None:
        """Append the outcome of the case at a place behind the first."""
        if self.folder:
            _file_of(self.folder, self.session).add_outcome(self.row, self.first + place, outcome)

    @property
    def trouble(self) -> str:
        """The reason why this process could not write; empty if it could."""
        return _file_of(self.folder, self.session).file.trouble if self.folder else ""


_files_of_process: dict[tuple[str, str, int], OutcomeFile] = {}


def _file_of(folder: str, session: str) -> OutcomeFile:
    """Return the file of this process. A process that was forked has another one than its parent."""
    key = folder, session, os.getpid()
    if key not in _files_of_process:
        while len(_files_of_process) >= _MOST_WRITERS:
            _files_of_process.pop(next(iter(_files_of_process))).file.close()
        _files_of_process[key] = OutcomeFile(Path(folder))
    return _files_of_process[key]


class Journal:
    """The record of a run by earlier processes (`sources`), and the folder for what comes; None to keep nothing.

    `trouble` is the first thing that kept a process from writing; empty if nothing did.
    """

    def __init__(self, plan: Plan | None = None, folder: Path | None = None, sources: Sequence[Path] = ()) -> None:
        plan = plan or Plan()
        self.folder = folder
        self.trouble = ""
        self._session = token_hex(4)
        names = [(name, id_) for name in plan.formulations for id_ in plan.properties]
        self._rows = {key: number for number, key in enumerate(names)}
        self.known = KnownOutcomes(sources, len(names), max(_LEAST_ROOM, 2 * plan.examples))

    def notes(self, formulation: str, property_id: str, first: int) -> Notes:
        """Return the place for the outcomes of some cases of a row; `WITNESS` is the number of its witness."""
        if self.folder is None:
            return Notes("", "", 0, first)
        return Notes(str(self.folder), self._session, self._rows[formulation, property_id], first)

    def outcomes(self, formulation: str, property_id: str, first: int, count: int) -> dict[int, Outcome]:
        """Return {place behind the first: outcome} of those of some cases of a row that are judged already."""
        row = self._rows.get((formulation, property_id))
        if row is None:
            return {}
        earlier = ((place, self.known.outcome(row, first + place)) for place in range(count))
        return {place: outcome for place, outcome in earlier if outcome is not None}

    def block(self, group: str, number: int) -> BlockRecord | None:
        """Return what is known of a block of cases; None if it was not drawn."""
        return self.known.blocks.get((group, number))

    def add_block(self, block: BlockRecord) -> None:
        """Note that a block was drawn."""
        if self.folder is not None and (block.group, block.number) not in self.known.blocks:
            writer = _file_of(str(self.folder), self._session)
            writer.add_block(block)
            self.note_trouble(writer.file.trouble)

    def note_trouble(self, trouble: str) -> None:
        """Keep the first reason why something could not be written."""
        self.trouble = self.trouble or trouble

    def close(self) -> None:
        """Close all files, and let the operating system write that of this process to the disk."""
        self.known.close()
        key = str(self.folder), self._session, os.getpid()
        if self.folder is not None and (writer := _files_of_process.pop(key, None)):
            writer.file.sync()
            self.note_trouble(writer.file.trouble)
            writer.file.close()


def read_plan(folder: Path, argument: str) -> Plan:
    """Return the plan of a journal of a run, one of this format."""
    plan = read_header(folder, Plan, argument)
    if plan.format != FORMAT:
        raise MisuseError(argument, f"{folder.name} with format {plan.format}", f"a journal of format {FORMAT}")
    return plan


def check_versions(journal: Mapping[str, str], here: Mapping[str, str], argument: str) -> None:
    """Check that a run goes on with what it began with; the message names the first version or digest that differs."""
    for name in sorted({*journal, *here}):
        if journal.get(name) != here.get(name):
            versions = f"{journal.get(name, 'nothing')} in the journal and {here.get(name, 'nothing')} here"
            raise MisuseError(argument, f"{name.replace('_', ' ')}: {versions}", "the same, or a new run")
