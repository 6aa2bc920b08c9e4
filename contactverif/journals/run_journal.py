"""The journal of a run: its plan and every outcome as it comes, so that no case is judged twice.

Nothing in a journal is believed before it is checked. Records that do not fit its key are named, and are judged again
like those that cannot be read. Without a proof, outcomes count once a share of their row is judged again
(`second_look`). Verdicts are never read: they follow from the numbers.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from secrets import token_hex

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, PropertyInfo, judge_stored
from contactverif.journals.journal import JournalKey
from contactverif.journals.known_outcomes import KnownOutcomes
from contactverif.journals.outcome_records import ENCODER, WITNESS, BlockRecord, DistrustRecord, OutcomeFile
from contactverif.journals.run_plan import Plan
from contactverif.plugins.provenance import CODE

UNPROVEN = "unproven_outcomes"  # The attribute of a report that says how many outcomes had no proof.
_MOST_WRITERS = 4  # The most journals that a process has open for writing.
_LEAST_ROOM = 10_000  # A finite list may have this many cases.


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
        # {(formulation, property id): case} of what failed in other runs. It is asked first, and not written down.
        self.earlier_failures: Mapping[tuple[str, str], Case] = {}
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
        row = self._rows[formulation, property_id]
        self._distrusted.add(row)
        self.remarks.append(remark)
        if self.folder is not None:  # A run that is killed now does not believe them either when it goes on.
            writer = _file_of(str(self.folder), self._session, self._key)
            writer.file.append(ENCODER.encode(DistrustRecord(row, self.known.files)))

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
