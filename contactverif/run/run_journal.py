"""The journal of a run: its plan and every outcome as it comes, so that no case is judged twice.

An outcome stands there as it does in memory: its form, once in a file, and its numbers. Nothing in a journal is
believed before it is checked. A record is proven if its tag fits the key of the journal, and no plugin could read that
key. One whose tag does not fit is named, and is judged again like one that cannot be read. Without a proof, outcomes
count once a share of their row is judged again (`contactverif.run.second_look`). Verdicts are never read: they follow
from the numbers. A change of a record is a new `FORMAT`.
"""

from __future__ import annotations

import os
from array import array
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from pathlib import Path
from secrets import token_hex
from typing import IO, Any, NamedTuple

import msgspec
import numpy as np

from contactverif.contract.arrays import freeze
from contactverif.contract.case import CaseSummary
from contactverif.contract.errors import MisuseError
from contactverif.contract.measurement import Finding, Measurement, Quantity
from contactverif.contract.property import Outcome, PropertyInfo, Verdict, judge_stored
from contactverif.run.journal import (
    JournalKey,
    RecordFile,
    decode,
    read_header,
    read_message,
    read_messages,
    record_files,
)
from contactverif.run.provenance import CODE, machine

FORMAT = 3
UNPROVEN = "unproven_outcomes"  # The attribute of a report that says how many outcomes had no proof.
WITNESS = -1  # The number of the outcome of a row's witness.
_MOST_FORMS = 10_000  # The most forms that a process remembers.
_MOST_WRITERS = 4  # The most journals that a process has open for writing.
_OPEN_FILES = 100  # The most files that are open for reading.
_FILE_BITS = 40  # A place is the number of its file, then this many bits for the byte.
_ALWAYS = 6  # Seconds, numbers of segments, penalty and two lengths.
_LEAST_ROOM = 10_000  # A finite list may have this many cases.
_PROVEN, _MEASURED = 2, 1  # The bits of what is known of an outcome.
_PAGE = 512  # The number of cases whose places lie side by side in memory.
_MOST_NAMES = 3  # The most records that a message names.


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
    machine: dict[str, str] = {}  # What the last bits of a number depend on, beside the versions.
    nonce: str = ""  # It tells two runs with the same plan apart.
    format: int = FORMAT

    @property
    def place(self) -> str:
        """The options that say where the run asked; empty if it was on random interfaces and scenes."""
        return place_words(self.options.get("place") or {})


def place_words(options: Mapping[str, Any]) -> str:
    """Return options {name: value} as they are typed, without those that are not there."""
    return " ".join(f"--{name}" if value is True else f"--{name} {value}" for name, value in options.items() if value)


def is_provable(options: Mapping[str, Any]) -> bool:
    """Return whether no plugin of a run with these options could read the key of its journal."""
    isolation = options.get("isolation")
    return isinstance(isolation, Mapping) and isolation.get("isolation") == "box"


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

    def __init__(self, folder: Path, key: JournalKey) -> None:
        self.file = RecordFile(folder, key)
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


class Source:
    """A journal that is read: its files of records, its key, and whether that proves anything."""

    def __init__(self, folder: Path) -> None:
        self.key = JournalKey.read(folder)
        self.paths = record_files(folder)
        try:
            plan = read_header(folder, Plan, "")
        except MisuseError:
            plan = Plan()
        self.proves = bool(self.key.key) and is_provable(plan.options)
        self.machine = plan.machine


class Misfit(NamedTuple):
    """The record of an outcome with a tag that does not fit the key of its journal."""

    file: str
    row: int
    number: int


class KnownOutcomes:
    """The outcomes and the blocks in the files of some journals. Of an outcome only its place is in memory.

    A plan has `n_rows` rows, and cases with the number `room` or a larger one are not believed.
    """

    def __init__(self, folders: Sequence[Path], n_rows: int, room: int) -> None:
        self.blocks: dict[tuple[str, int], BlockRecord] = {}  # By group and number.
        self.n_outcomes = 0  # The number of different cases that are judged, witnesses included.
        self.n_twice = 0  # The number of further outcomes of the same cases.
        self.misfits: list[Misfit] = []  # The first of them.
        self.n_misfits = 0  # The number of all records that do not fit.
        sources = [Source(folder) for folder in folders]
        self.same_machine = all(source.machine == machine() for source in sources)
        self._paths = [(path, source) for source in sources for path in source.paths]
        # By row and page; the witness comes first. A slot is a place above two bits, or 0 if nothing is known.
        self._slots: dict[tuple[int, int], array[int]] = {}
        self._n_rows, self._room = n_rows, room
        self._files: dict[int, IO[bytes]] = {}
        self._form = lru_cache(_MOST_FORMS)(self._read_form)
        for number in range(len(self._paths)):
            self._read_file(number)

    def outcome(self, row: int, number: int) -> Outcome | None:
        """Return the outcome of a case of a row as it is stored; None if it is not known."""
        slot = self._slot(row, number)
        if not slot:
            return None
        file, place = divmod(slot >> 2, 1 << _FILE_BITS)
        record = self._read(file, place)
        form = self._form(file, record.form) if isinstance(record, OutcomeRecord) else None
        if form is None or not isinstance(record, OutcomeRecord) or (record.row, record.number) != (row, number):
            return None
        return _outcome_of(record, form)

    def is_proven(self, row: int, number: int) -> bool:
        """Return whether the outcome of a case is known and proven."""
        return bool(self._slot(row, number) & _PROVEN)

    def unproven(self, row: int) -> list[int]:
        """Return the numbers of the cases of a row whose outcomes have numbers, but no proof."""
        numbers = []
        for (its_row, page), slots in self._slots.items():
            if its_row == row:
                bits = np.frombuffer(slots, dtype=np.int64) & (_PROVEN | _MEASURED)
                places = np.flatnonzero(bits == _MEASURED)
                numbers += (places + (page * _PAGE + WITNESS)).tolist()
        return sorted(numbers)

    def close(self) -> None:
        """Close the files."""
        while self._files:
            self._files.popitem()[1].close()

    def _slot(self, row: int, number: int) -> int:
        page, place = divmod(number - WITNESS, _PAGE)
        slots = self._slots.get((row, page))
        return 0 if slots is None else slots[place]

    def _read_file(self, number: int) -> None:
        """Note the place of each outcome of a file, up to the first record that is damaged."""
        path, source = self._paths[number]
        measured: dict[int, bool] = {}  # {place of a form: whether its outcomes are measured}
        for place, message, fits in read_messages(path, source.key):
            record = decode(message, _DECODER)
            if source.key.key and not fits:
                self._note_misfit(path, record)
            elif record is None:
                return
            elif isinstance(record, FormRecord):
                measured[place] = record.form.measured
            elif isinstance(record, OutcomeRecord) and record.form in measured:
                bits = source.proves * _PROVEN | measured[record.form] * _MEASURED
                self._add(record, (number << _FILE_BITS | place) << 2 | bits)
            elif isinstance(record, BlockRecord) and source.proves:
                self.blocks[record.group, record.number] = record

    def _note_misfit(self, path: Path, record: Record | None) -> None:
        self.n_misfits += 1
        if isinstance(record, OutcomeRecord) and len(self.misfits) < _MOST_NAMES:
            self.misfits.append(Misfit(f"{path.parent.name}/{path.name}", record.row, record.number))

    def _add(self, record: OutcomeRecord, slot: int) -> None:
        if not (0 <= record.row < self._n_rows and WITNESS <= record.number < self._room):
            return
        page, place = divmod(record.number - WITNESS, _PAGE)
        slots = self._slots.setdefault((record.row, page), array("q", bytes(8 * _PAGE)))
        earlier = slots[place]
        self.n_twice += earlier != 0
        self.n_outcomes += earlier == 0
        if slot & _PROVEN or not earlier & _PROVEN:
            slots[place] = slot

    def _read(self, number: int, place: int) -> Record | None:
        if number not in self._files:
            if len(self._files) >= _OPEN_FILES:
                self._files.pop(next(iter(self._files))).close()
            self._files[number] = self._paths[number][0].open("rb")
        message = read_message(self._files[number], place)
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
    key: JournalKey
    session: str  # A word for the process that began or resumed the run.
    row: int
    first: int  # The number of the first of the cases.

    def add(self, place: int, outcome: Outcome) -> None:
        """Append the outcome of the case at a place behind the first."""
        if self.folder:
            _file_of(self.folder, self.session, self.key).add_outcome(self.row, self.first + place, outcome)

    @property
    def trouble(self) -> str:
        """The reason why this process could not write; empty if it could."""
        return _file_of(self.folder, self.session, self.key).file.trouble if self.folder else ""


_files_of_process: dict[tuple[str, str, int], OutcomeFile] = {}


def _file_of(folder: str, session: str, journal_key: JournalKey) -> OutcomeFile:
    """Return the file of this process. A process that was forked has another one than its parent."""
    key = folder, session, os.getpid()
    if key not in _files_of_process:
        while len(_files_of_process) >= _MOST_WRITERS:
            _files_of_process.pop(next(iter(_files_of_process))).file.close()
        _files_of_process[key] = OutcomeFile(Path(folder), journal_key)
    return _files_of_process[key]


class Journal:
    """The record of a run by earlier processes (`sources`), and the folder for what comes; None to keep nothing.

    `trouble` is the first thing that kept a process from writing; empty if nothing did.
    """

    def __init__(self, plan: Plan | None = None, folder: Path | None = None, sources: Sequence[Path] = ()) -> None:
        self.plan = plan = plan or Plan()
        self.folder = folder
        self.trouble = ""
        self.n_unproven = 0  # The number of outcomes without a proof that the run met.
        self.n_judged_again = 0  # The number of those that were judged again.
        self.remarks: list[str] = []  # What the user should know of records that were not believed.
        self._key = JournalKey() if folder is None else JournalKey.read(folder)
        self._session = token_hex(4)
        self._names = list(product(plan.formulations, plan.properties))
        self._rows = {key: number for number, key in enumerate(self._names)}
        self._distrusted: set[int] = set()
        self.known = KnownOutcomes(sources, len(self._names), max(_LEAST_ROOM, 2 * plan.examples))
        if self.known.n_misfits:
            self.remarks.append(self._name_misfits())

    def notes(self, formulation: str, property_id: str, first: int) -> Notes:
        """Return the place for the outcomes of some cases of a row; `WITNESS` is the number of its witness."""
        if self.folder is None:
            return Notes("", self._key, "", 0, first)
        return Notes(str(self.folder), self._key, self._session, self._rows[formulation, property_id], first)

    def outcomes(self, formulation: str, info: PropertyInfo, first: int, count: int) -> dict[int, Outcome]:
        """Return {place behind the first: outcome} of those of some cases of a row that are judged already."""
        row = self._rows.get((formulation, info.id))
        if row is None:
            return {}
        earlier = ((place, self._outcome(row, info, first + place)) for place in range(count))
        return {place: outcome for place, outcome in earlier if outcome is not None}

    def _outcome(self, row: int, info: PropertyInfo, number: int) -> Outcome | None:
        """Return an outcome with the verdict that follows from its numbers; None if it is to be judged again."""
        proven = self.known.is_proven(row, number)
        outcome = None if row in self._distrusted and not proven else self.known.outcome(row, number)
        if outcome is None or (outcome.measurement is None and not proven):
            return None
        try:
            return judge_stored(info, outcome)
        except ValueError:  # Of another property.
            return None

    def unproven(self, formulation: str, property_id: str) -> list[int]:
        """Return the numbers of the cases of a row whose outcomes have numbers, but no proof."""
        row = self._rows.get((formulation, property_id))
        return [] if row is None else self.known.unproven(row)

    def distrust(self, formulation: str, property_id: str, remark: str) -> None:
        """Believe none of the outcomes of a row that are not proven, so that they are judged again."""
        self._distrusted.add(self._rows[formulation, property_id])
        self.remarks.append(remark)

    def provenance(self) -> dict[str, str]:
        """Return what a report should say of where its outcomes come from: code, place, and how many had no proof."""
        digests = {name: digest for name, digest in self.plan.versions.items() if name.startswith(CODE)}
        facts = {name.replace(" ", "_"): digest for name, digest in digests.items()}
        return facts | {name: words for name, words in (("place", self.plan.place), (UNPROVEN, self.doubt)) if words}

    @property
    def doubt(self) -> str:
        """The number of outcomes without a proof, in words; empty if there are none."""
        return f"{self.n_unproven}, of which {self.n_judged_again} were judged again" if self.n_unproven else ""

    def _name_misfits(self) -> str:
        """Return how many records do not fit, with the first outcomes among them."""
        count = self.known.n_misfits
        words = f"{count} record{' does' if count == 1 else 's do'} not fit the key of the journal"
        names = []
        for file, row, number in self.known.misfits:
            row_name = " ".join(self._names[row]) if 0 <= row < len(self._names) else f"row {row}"
            names.append(f"{row_name} {'witness' if number == WITNESS else f'case {number}'} in {file}")
        return f"{'; '.join([words, *names])}{'; …' if count > len(names) else ''}; what they say is judged again"

    def block(self, group: str, number: int) -> BlockRecord | None:
        """Return what is known of a block of cases; None if it was not drawn."""
        return self.known.blocks.get((group, number))

    def add_block(self, block: BlockRecord) -> None:
        """Note that a block was drawn."""
        if (block.group, block.number) in self.known.blocks:
            return
        self.known.blocks[block.group, block.number] = block
        if self.folder is not None:
            writer = _file_of(str(self.folder), self._session, self._key)
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
