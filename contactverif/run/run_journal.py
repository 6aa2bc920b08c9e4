"""The journal of a run: what is to be judged, and every outcome as it comes, so that a run that was killed goes on.

A journal is a folder. Its `header` is the plan: what is judged, and with which versions. Beside it each process that
judges has a file of its own (`journal_records.py`). A finished shard of a campaign has a file `done`.

Rules for the next editor: nothing that stands in a journal is believed before it is checked, and an outcome that cannot
be read is judged again. The files of an earlier process are read, and never written.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from secrets import token_hex
from typing import Any

import msgspec

from contactverif.contract.property import Outcome
from contactverif.run.journal_records import FORMAT, BlockRecord, RecordWriter
from contactverif.run.known_outcomes import KnownOutcomes

_LEAST_ROOM = 10_000  # A finite list may have this many cases.
_MOST_WRITERS = 4  # The most journals that a process has open for writing.


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """The plan of a run, as the header of its journal has it.

    Attributes
    ----------
    command : str
        The command that judges.
    options : dict[str, Any]
        The options of the command.
    folder : str
        The working folder of the command, to which names of files are relative.
    versions : dict[str, str]
        {library or package: version or digest}.
    formulations, properties : tuple[str, ...]
        The names on the command line. A row of the plan is a formulation and a property.
    profile : str
        The name of the profile.
    examples, seed : int
        The number of cases of each property, and their seed.
    format : int
        The version of the journal's format.
    """

    command: str
    options: dict[str, Any]
    folder: str
    versions: dict[str, str]
    formulations: tuple[str, ...]
    properties: tuple[str, ...]
    profile: str
    examples: int
    seed: int
    format: int = FORMAT


@dataclass(frozen=True, slots=True)
class Notes:
    """The place in a journal where the outcomes of some cases go. It travels to the process that judges them.

    Attributes
    ----------
    folder : str
        The folder of the journal; empty if there is none.
    session : str
        A word for the process that began or resumed the run.
    row, first : int
        The numbers of the row, and of the first of the cases.
    """

    folder: str
    session: str
    row: int
    first: int

    def add(self, place: int, outcome: Outcome) -> None:
        """Append the outcome of the case at a place behind the first."""
        if self.folder:
            _writer(self.folder, self.session).add_outcome(self.row, self.first + place, outcome)

    @property
    def trouble(self) -> str:
        """The reason why this process could not write; empty if it could."""
        return _writer(self.folder, self.session).trouble if self.folder else ""


_writers: dict[tuple[str, str, int], RecordWriter] = {}


def _writer(folder: str, session: str) -> RecordWriter:
    """Return the file of this process. A process that was forked has another one than its parent."""
    key = folder, session, os.getpid()
    if key not in _writers:
        while len(_writers) >= _MOST_WRITERS:
            _writers.pop(next(iter(_writers))).close()
        _writers[key] = RecordWriter(Path(folder))
    return _writers[key]


class Journal:
    """The journal of a run that is going on: what is known from earlier processes, and the place for what comes.

    Parameters
    ----------
    plan : Plan
        The plan.
    folder : Path | None
        The folder that is written to; None to write nothing.
    sources : Sequence[Path]
        The folders that are read.

    Attributes
    ----------
    plan : Plan
        The plan.
    folder : Path | None
        The folder that is written to.
    trouble : str
        What kept a process from writing; empty if nothing did.
    """

    def __init__(self, plan: Plan, folder: Path | None = None, sources: Sequence[Path] = ()) -> None:
        self.plan, self.folder = plan, folder
        self.trouble = ""
        self._session = token_hex(4)
        names = [(name, id_) for name in plan.formulations for id_ in plan.properties]
        self._rows = {key: number for number, key in enumerate(names)}
        self._known = KnownOutcomes(sources, len(names), max(_LEAST_ROOM, 2 * plan.examples))

    @property
    def known(self) -> KnownOutcomes:
        """The outcomes of earlier processes."""
        return self._known

    def notes(self, formulation: str, property_id: str, first: int) -> Notes:
        """Return the place for the outcomes of some cases of a row; `WITNESS` is the number of its witness."""
        folder = "" if self.folder is None else str(self.folder)
        return Notes(folder, self._session, self._rows[formulation, property_id], first)

    def outcomes(self, formulation: str, property_id: str, first: int, count: int) -> dict[int, Outcome]:
        """Return {place behind the first: outcome} of those of some cases of a row that are judged already."""
        row = self._rows[formulation, property_id]
        earlier = ((place, self._known.outcome(row, first + place)) for place in range(count))
        return {place: outcome for place, outcome in earlier if outcome is not None}

    def block(self, group: str, number: int) -> BlockRecord | None:
        """Return what is known of a block of cases; None if it was not drawn."""
        return self._known.blocks.get((group, number))

    def add_block(self, block: BlockRecord) -> None:
        """Note that a block was drawn."""
        if self.folder is not None and (block.group, block.number) not in self._known.blocks:
            writer = _writer(str(self.folder), self._session)
            writer.add_block(block)
            self.note_trouble(writer.trouble)

    def note_trouble(self, trouble: str) -> None:
        """Keep the first reason why something could not be written."""
        self.trouble = self.trouble or trouble

    def close(self) -> None:
        """Close all files, and let the operating system write that of this process to the disk."""
        self._known.close()
        if self.folder is not None and (writer := _writers.pop((str(self.folder), self._session, os.getpid()), None)):
            writer.sync()
            self.note_trouble(writer.trouble)
            writer.close()


NO_PLAN = Plan(
    command="", options={}, folder="", versions={}, formulations=(), properties=(), profile="", examples=0, seed=0
)


class NoJournal(Journal):
    """The journal of a run that keeps none."""

    def __init__(self) -> None:
        super().__init__(NO_PLAN)

    def notes(self, formulation: str, property_id: str, first: int) -> Notes:
        """Return a place where nothing is written."""
        return Notes("", "", 0, first)

    def outcomes(self, formulation: str, property_id: str, first: int, count: int) -> dict[int, Outcome]:
        """Return nothing: no case is judged already."""
        return {}
