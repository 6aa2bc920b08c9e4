"""The journal of a bench: every finished cell, on the disk before the next one begins, so that a killed bench goes on.

A journal of another plan is refused, and never overwritten. A cell whose record is damaged is run again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path

import msgspec

from contactverif.contract.errors import MisuseError
from contactverif.run import journal
from contactverif.studies.bench.bench_plan import BenchPlan
from contactverif.studies.bench.cell_runs import CellRecord


class Header(msgspec.Struct, frozen=True):
    """The facts that must agree before a killed bench goes on."""

    bench: BenchPlan
    formulations: tuple[str, ...]
    versions: dict[str, str]

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


class FinishedCells:
    """The records of the cells that are finished, by number, and the file for the others."""

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        messages = (message for path in journal.record_files(folder) for _, message in journal.read_messages(path))
        cells = (journal.decode(message, _DECODER) for message in messages)
        self.records = {
            cell.number: cell.record for cell in cells if cell is not None and cell.record.runs.keys() == {*names}
        }
        self._file = journal.RecordFile(folder)

    def add(self, number: int, record: CellRecord) -> None:
        """Append the record of a cell that is finished."""
        self._file.append(_ENCODER.encode(FinishedCell(number, record)))
        self._file.sync()
        self.records[number] = record

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@contextmanager
def open_journal(output: Path, header: Header) -> Iterator[FinishedCells]:
    """Open a block with the finished cells of an output file, in which no other bench uses its journal."""
    folder = journal.journal_folder(output)
    if not folder.exists():
        held = journal.new_journal(folder, header)
    elif journal.read_header(folder, Header, "--out") == header:
        held = journal.hold_journal(folder, "--out")
    else:
        needed = "the same command and version, or another name, or no such folder"
        raise MisuseError("--out", f"{folder}, the journal of another bench", needed)
    with held, closing(FinishedCells(folder, header.formulations)) as cells:
        yield cells
