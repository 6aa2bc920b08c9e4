"""The journal of a bench: every finished cell, on the disk before the next one begins, so that a killed bench goes on.

A journal of another plan is refused, and never overwritten. A cell whose record is damaged, or does not fit the key of
the journal, is run again. Without the key the journal is refused: no second run tells whether seconds are right.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from contactverif.contract.errors import MisuseError
from contactverif.journals import journal
from contactverif.journals.keys import state_folder
from contactverif.studies.bench.bench_plan import BenchPlan
from contactverif.studies.bench.cell_runs import CellRecord


class Header(msgspec.Struct, frozen=True):
    """The facts that must agree before a killed bench goes on."""

    bench: BenchPlan
    formulations: tuple[str, ...]
    versions: dict[str, str]
    nonce: str = ""  # It tells two benches with the same header apart.

    @classmethod
    def from_plan(cls, plan: BenchPlan, names: Sequence[str], provenance: Mapping[str, str]) -> Header:
        """Return the header of a bench of some formulations, with the versions of its provenance."""
        versions = {key: fact for key, fact in provenance.items() if key.endswith("_version") or key == "commit"}
        return cls(plan, tuple(names), versions)


class FinishedCell(msgspec.Struct, frozen=True):
    """The record of a cell that is finished."""

    number: int  # Process × number of cells + cell
    record: CellRecord


_ENCODER = msgspec.msgpack.Encoder(enc_hook=float)  # Numbers of numpy are numbers of a type of their own.
_DECODER = msgspec.msgpack.Decoder(FinishedCell)


class Journal:
    """The journal of one output file. `finished` has the records of the cells that are finished, by number."""

    def __init__(self, output: Path, header: Header) -> None:
        folder = journal.journal_folder(output)
        self.finished: dict[int, CellRecord] = {}
        if not folder.exists():
            journal.begin_journal(folder, header, ())
        elif msgspec.structs.replace(journal.read_header(folder, Header, "--out"), nonce="") != header:
            needed = "the same command and version, or another name, or no such folder"
            raise MisuseError("--out", f"{folder}, the journal of another bench", needed)
        key = journal.JournalKey.read(folder)
        for path in journal.record_files(folder):
            self._read(path, key, {*header.formulations})
        self._file = journal.RecordFile(folder, key)

    def _read(self, path: Path, key: journal.JournalKey, names: set[str]) -> None:
        """Read the records of a file."""
        for _, message, fits in journal.read_messages(path, key):
            if not key.key:
                needed = f"its key, which {state_folder()} of its user and machine has, or no such folder"
                raise MisuseError("--out", f"{path.parent}, a journal that proves nothing", needed)
            cell = journal.decode(message, _DECODER) if fits else None
            if cell is not None and cell.record.runs.keys() == names:
                self.finished[cell.number] = cell.record

    def add(self, number: int, record: CellRecord) -> None:
        """Append the record of a cell that is finished."""
        self._file.append(_ENCODER.encode(FinishedCell(number, record)))
        self._file.sync()
        self.finished[number] = record

    def close(self) -> None:
        """Close the file."""
        self._file.close()
