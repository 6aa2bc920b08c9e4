"""The outcomes and the blocks of cases that the files of some journals hold."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import IO

from contactverif.contract.property import Outcome
from contactverif.run.journal_records import (
    SUFFIX,
    WITNESS,
    BlockRecord,
    FormRecord,
    OutcomeRecord,
    outcome_of,
    read_record_at,
    read_records,
)
from contactverif.run.outcome_forms import OutcomeForm

_OPEN_FILES = 100  # The most files that are open at a time.
_FORMS_IN_MEMORY = 10_000
_FILE_BITS = 40  # A place is the number of its file, then this many bits for the byte.


class KnownOutcomes:
    """The outcomes and the blocks in the files of some journals. Of an outcome only its place is in memory.

    Parameters
    ----------
    folders : Sequence[Path]
        The folders of the journals.
    n_rows : int
        The number of rows of the plan.
    room : int
        Cases with this number or a larger one are not believed.

    Attributes
    ----------
    blocks : dict[tuple[str, int], BlockRecord]
        {(group, number): block}.
    n_outcomes : int
        The number of different cases that are judged, witnesses included.
    n_twice : int
        The number of further outcomes of the same cases.
    """

    def __init__(self, folders: Sequence[Path], n_rows: int, room: int) -> None:
        self.blocks: dict[tuple[str, int], BlockRecord] = {}
        self.n_outcomes = self.n_twice = 0
        self._paths = [path for folder in folders for path in sorted(folder.glob(f"*{SUFFIX}"))]
        self._places = [array("q") for _ in range(n_rows)]  # One more than the place, or 0; the witness comes first.
        self._room = room
        self._files: dict[int, IO[bytes]] = {}
        self._form = lru_cache(_FORMS_IN_MEMORY)(self._read_form)
        for number, path in enumerate(self._paths):
            for place, record in read_records(path):
                if isinstance(record, OutcomeRecord):
                    self._add(record, number << _FILE_BITS | place)
                elif isinstance(record, BlockRecord):
                    self._add_block(record)

    def outcome(self, row: int, number: int) -> Outcome | None:
        """Return the outcome of a case of a row; None if it is not known."""
        places = self._places[row]
        slot = number - WITNESS
        if slot >= len(places) or not places[slot]:
            return None
        file, place = divmod(places[slot] - 1, 1 << _FILE_BITS)
        record = read_record_at(self._open(file), place)
        form = self._form(file, record.form) if isinstance(record, OutcomeRecord) else None
        if form is None or not isinstance(record, OutcomeRecord) or (record.row, record.number) != (row, number):
            return None
        return outcome_of(record, form)

    def close(self) -> None:
        """Close the files."""
        while self._files:
            self._files.popitem()[1].close()

    def _add(self, record: OutcomeRecord, place: int) -> None:
        if not (0 <= record.row < len(self._places) and WITNESS <= record.number < self._room):
            return
        places, slot = self._places[record.row], record.number - WITNESS
        if slot >= len(places):
            places.extend([0] * (slot + 1 - len(places)))
        self.n_twice += places[slot] != 0
        self.n_outcomes += places[slot] == 0
        places[slot] = place + 1

    def _add_block(self, block: BlockRecord) -> None:
        if block.number >= 0 and 0 <= block.count < self._room:
            self.blocks[block.group, block.number] = block

    def _open(self, file: int) -> IO[bytes]:
        if file not in self._files:
            if len(self._files) >= _OPEN_FILES:
                self._files.pop(next(iter(self._files))).close()
            self._files[file] = self._paths[file].open("rb")
        return self._files[file]

    def _read_form(self, file: int, place: int) -> OutcomeForm | None:
        record = read_record_at(self._open(file), place) if place >= 0 else None
        return record.form if isinstance(record, FormRecord) else None
