"""The outcomes in the journals of a run, as they are read: where each stands, and whether it is proven.

A record is proven if its tag fits the key of the journal, and no plugin could read that key. One whose tag does not fit
is named, and counts no more than one that cannot be read.
"""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np

from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Outcome
from contactverif.journals.journal import JournalKey, decode, read_header, read_message, read_messages, record_files
from contactverif.journals.outcome_records import (
    DECODER,
    MOST_FORMS,
    WITNESS,
    BlockRecord,
    DistrustRecord,
    FormRecord,
    OutcomeForm,
    OutcomeRecord,
    Record,
    outcome_of,
)
from contactverif.journals.run_plan import Plan, is_provable
from contactverif.plugins.provenance import machine

_OPEN_FILES = 100  # The most files that are open for reading.
_FILE_BITS = 40  # A place is the number of its file, then this many bits for the byte.
_PROVEN, _MEASURED = 2, 1  # The bits of what is known of an outcome.
_PAGE = 512  # The number of cases whose places lie side by side in memory.
_MOST_NAMES = 3  # The most records that a message names.


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
        self._form = lru_cache(MOST_FORMS)(self._read_form)
        self._distrusted: set[tuple[int, str]] = set()  # Row and name of a file.
        self._read_files()
        if self._distrusted:  # Whichever file says so.
            self._read_files()

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
        return outcome_of(record, form)

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
            record = decode(message, DECODER)
            if source.key.key and not fits:
                self._note_misfit(path, record)
                continue
            match record:
                case None:
                    return
                case FormRecord():
                    measured[place] = record.form.measured
                case OutcomeRecord() if record.form in measured:
                    bits = source.proves * _PROVEN | measured[record.form] * _MEASURED
                    self._add(record, (number << _FILE_BITS | place) << 2 | bits, path)
                case BlockRecord() if source.proves:
                    self.blocks[record.group, record.number] = record
                case DistrustRecord():  # Without a proof, too: it costs time and nothing else.
                    self._distrusted |= {(record.row, name) for name in record.files}

    @property
    def files(self) -> tuple[str, ...]:
        """The names of all files of records."""
        return tuple(path.name for path, _ in self._paths)

    def _read_files(self) -> None:
        """Note the places of all outcomes."""
        self._slots.clear()
        self.misfits.clear()
        self.n_outcomes = self.n_twice = self.n_misfits = 0
        for number in range(len(self._paths)):
            self._read_file(number)

    def _note_misfit(self, path: Path, record: Record | None) -> None:
        self.n_misfits += 1
        if isinstance(record, OutcomeRecord) and len(self.misfits) < _MOST_NAMES:
            self.misfits.append(Misfit(f"{path.parent.name}/{path.name}", record.row, record.number))

    def _add(self, record: OutcomeRecord, slot: int, path: Path) -> None:
        if not (0 <= record.row < self._n_rows and WITNESS <= record.number < self._room):
            return
        if not slot & _PROVEN and self._distrusted and (record.row, path.name) in self._distrusted:
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
        return None if message is None else decode(message, DECODER)

    def _read_form(self, file: int, place: int) -> OutcomeForm | None:
        record = self._read(file, place)
        return record.form if isinstance(record, FormRecord) else None
