"""The shards of a campaign: each judges a part of a run in a process of its own, and has a journal and nothing else.

The pieces of a run are numbered: each witness, each piece of a finite list, each block of drawn cases. Shard I of N has
each N-th of them. The union of the journals of all shards is the journal of a run, with which `merge` goes on.

Rule for the next editor: the number of a case is that of a run without shards. Where a strategy runs out of cases, the
first block has all of them, more than a block may have. So a shard looks whether there are later blocks before it draws
one.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.run.conductor import Conductor, groups_of
from contactverif.run.draw import BLOCK, Sampling, draws_blocks, number_of_blocks
from contactverif.run.journal import begin_journal, read_record, write_record
from contactverif.run.open_row import OpenRow
from contactverif.run.packing import CaseChunk
from contactverif.run.pieces import LIST_CHUNK, DrawnCases, JudgedCases, in_chunks
from contactverif.run.run_journal import WITNESS, BlockRecord, Journal, Plan, check_versions, read_plan
from contactverif.run.runner import check_once, open_rows
from contactverif.run.tasks import Progress, Task
from contactverif.run.workers import Team

_MARK = "done"
_SHARD = "shard"  # The option in a plan that differs from shard to shard.
_MOST_NAMES = 3  # The most missing shards that a message names.


@dataclass(frozen=True, slots=True, order=True)
class Shard:
    """The name of a shard.

    Attributes
    ----------
    count, number : int
        The number of all shards, and that of this one, from 1.
    """

    count: int
    number: int

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Return the shard of a text I/N.

        Raises
        ------
        MisuseError
            If it is none.
        """
        match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
        shard = cls(int(match[2]), int(match[1])) if match else None
        if shard is None or not 1 <= shard.number <= shard.count:
            raise MisuseError("--shard", repr(text), "I/N, the number of a shard from 1 and the number of all shards")
        return shard

    @property
    def folder(self) -> str:
        """The name of its journal's folder."""
        return f"shard-{self.number}-of-{self.count}"

    @property
    def text(self) -> str:
        """The shard as the command line has it."""
        return f"{self.number}/{self.count}"

    def plan(self, plan: Plan) -> Plan:
        """Return the plan of this shard of a run."""
        return msgspec.structs.replace(plan, options=plan.options | {_SHARD: self.text})


class EndMark(msgspec.Struct, frozen=True):
    """The record of a shard that is done.

    Attributes
    ----------
    n_outcomes : int
        The number of outcomes in its journal.
    """

    n_outcomes: int


class ShardConductor(Conductor):
    """Hands out the pieces of one shard. It makes no rows, and shrinks nothing.

    Parameters
    ----------
    shard : Shard
        The shard.
    sampling : Sampling
        The size and the seed of the run.
    report : Callable[[Progress], None]
        A function that is called as the shard advances.
    journal : Journal
        What is judged already, and where outcomes are noted.
    """

    def __init__(self, shard: Shard, sampling: Sampling, report: Callable[[Progress], None], journal: Journal) -> None:
        super().__init__(sampling, Team(None), report, journal)
        self._shard = shard

    def judge(self, rows: Sequence[OpenRow]) -> None:
        """Judge all cases of this shard."""
        for place, task in enumerate(self._all_tasks(rows)):
            if place % self._shard.count == self._shard.number - 1:
                self._tasks.add(task)
        self._tasks.work()

    def _all_tasks(self, rows: Sequence[OpenRow]) -> Iterator[Task]:
        """Yield the tasks of all shards, in the order that all shards have in common."""
        for row in rows:
            if row.witness is not None and not row.witness_is_listed:
                yield self._judge_task(row, CaseChunk([row.witness]), WITNESS, self._note_judged)
        for group in groups_of(self._sampling, rows).values():
            source = group[0].source
            if not isinstance(source, tuple):
                yield from (self._block(group, number) for number in range(number_of_blocks(self._sampling.examples)))
                continue
            for row in group:
                yield from self._judge_chunks(row, in_chunks(source, LIST_CHUNK), 0)

    def _judge_chunks(self, row: OpenRow, chunks: Sequence[CaseChunk], first: int) -> Iterator[Task]:
        """Yield the tasks to judge chunks, the first of whose cases has a number."""
        for chunk in chunks:
            yield self._judge_task(row, chunk, first, self._note_judged)
            first += chunk.count

    def _begin_block(self, group: Sequence[OpenRow], number: int) -> None:
        """Plan to draw a block, unless the journal has all of it, or there is no such block."""
        question = group[0].question
        block = self._journal.block(self._sampling.block_name(question), number)
        if block is not None and all(self._has_all(row, block) for row in group):
            return
        if block is None and number > 0 and not self._draws_blocks(question):
            return
        self._tasks.add_first([self._drawing(group, number)])

    def _has_all(self, row: OpenRow, block: BlockRecord) -> bool:
        first = block.number * BLOCK
        return len(self._journal.outcomes(row.subject.name, row.question.id, first, block.count)) == block.count

    def _draws_blocks(self, question: Property) -> bool:
        source, sampling = self._sampling.source(question), self._sampling
        assert source is not None
        assert not isinstance(source, tuple)
        return draws_blocks(source, seed=sampling.key(question), examples=sampling.examples)

    def _add_drawn(self, group: Sequence[OpenRow], number: int, answer: DrawnCases) -> None:
        """Plan the judging of a block."""
        name = self._sampling.block_name(group[0].question)
        self._journal.add_block(BlockRecord(name, number, answer.count, answer.exhausted, answer.last))
        self._tasks.add_first(
            [task for row in group for task in self._judge_chunks(row, answer.chunks, number * BLOCK)]
        )

    def _note_judged(self, judged: JudgedCases) -> None:
        self._journal.note_trouble(judged.trouble)
        self.check_written()

    def check_written(self) -> None:
        """Check that all outcomes are kept.

        Raises
        ------
        MisuseError
            If the journal could not be written.
        """
        if self._journal.trouble:
            raise MisuseError("--out", f"{self._shard.folder}: {self._journal.trouble}", "a disk with room")


def open_shard(folder: Path, plan: Plan) -> bool:
    """Make the journal of a shard, or check that the one that is there has the same plan.

    Parameters
    ----------
    folder : Path
        The folder of the journal.
    plan : Plan
        The plan of the shard.

    Returns
    -------
    bool
        Whether the shard is done already.

    Raises
    ------
    MisuseError
        If the folder cannot be made, or is the journal of another plan.
    """
    if not folder.exists():
        begin_journal(folder, plan, ())
        return False
    earlier = read_plan(folder, "--out")
    check_versions(earlier.versions, plan.versions, "--out")
    if difference := _difference(earlier, plan, shard_too=True):
        raise MisuseError("--out", f"{folder.name} of another plan ({difference})", "the same plan, or another folder")
    mark = _read_mark(folder)
    return mark is not None and mark.n_outcomes == _count_outcomes(folder, plan)


def judge_shard(
    shard: Shard,
    subjects: Sequence[Subject],
    questions: Sequence[Property],
    sampling: Sampling,
    progress: Callable[[Progress], None],
    folder: Path,
    plan: Plan,
) -> int:
    """Judge what a shard has not judged yet, and mark it as done.

    Parameters
    ----------
    shard : Shard
        The shard.
    subjects : Sequence[Subject]
        The formulations.
    questions : Sequence[Property]
        The properties.
    sampling : Sampling
        The size and the seed of the run.
    progress : Callable[[Progress], None]
        A function that is called as the shard advances.
    folder : Path
        The folder of its journal.
    plan : Plan
        Its plan.

    Returns
    -------
    int
        The number of outcomes of the shard.

    Raises
    ------
    MisuseError
        If a name stands there twice, or the journal cannot be written.
    """
    check_once("formulation", (subject.name for subject in subjects))
    rows = [row for row in open_rows(subjects, questions, sampling, {}) if isinstance(row, OpenRow)]
    journal = Journal(plan, folder, [folder])
    conductor = ShardConductor(shard, sampling, progress, journal)
    try:
        conductor.check_signs(subjects, {question.id: question for question in questions})
        conductor.judge(rows)
    finally:
        journal.close()
    conductor.check_written()
    mark = EndMark(_count_outcomes(folder, plan))
    write_record(folder / _MARK, mark)
    return mark.n_outcomes


def read_shards(folder: Path, argument: str) -> tuple[Plan, tuple[Path, ...]]:
    """Return the plan of a campaign and the journals of all its shards, once each is found to be whole.

    Parameters
    ----------
    folder : Path
        The folder of the campaign.
    argument : str
        The name of the argument in error messages.

    Raises
    ------
    MisuseError
        If a shard is missing, not finished, damaged, or of another plan.
    """
    shards = _list_shards(folder, argument)
    journals = tuple(folder / shard.folder for shard in shards)
    plans = [read_plan(journal, argument) for journal in journals]
    for shard, plan in zip(shards, plans, strict=True):
        if plan.options.get(_SHARD) != shard.text:
            was = plan.options.get(_SHARD, f"a journal of {plan.command}")
            raise MisuseError(argument, f"{shard.folder}, whose header says {was}", f"shard {shard.text}")
        if difference := _difference(plan, plans[0]):
            others = f"that of {shards[0].folder} ({difference})"
            raise MisuseError(argument, f"{shard.folder} with another plan than {others}", "shards of one campaign")
    for shard, journal, plan in zip(shards, journals, plans, strict=True):
        _check_whole(shard, journal, plan, argument)
    return plans[0], journals


def _list_shards(folder: Path, argument: str) -> list[Shard]:
    """Return the shards of a campaign in order, once none is missing."""
    matches = (re.fullmatch(r"shard-([1-9][0-9]{0,8})-of-([1-9][0-9]{0,8})", path.name) for path in folder.glob("*"))
    shards = sorted(Shard(int(match[2]), int(match[1])) for match in matches if match)
    if not shards:
        raise MisuseError(argument, f"no shard in {folder}", "the folder that campaign --out made")
    count = shards[0].count
    if shards[-1].count != count:
        names = f"{shards[0].folder} and {shards[-1].folder}"
        raise MisuseError(argument, names, "shards of one campaign")
    missing = [Shard(count, number).folder for number in sorted({*range(1, count + 1)} - {s.number for s in shards})]
    if missing:
        more = f" and {len(missing) - _MOST_NAMES} more" if len(missing) > _MOST_NAMES else ""
        raise MisuseError(argument, f"no {', '.join(missing[:_MOST_NAMES])}{more}", f"all {count} shards")
    return shards


def _check_whole(shard: Shard, journal: Path, plan: Plan, argument: str) -> None:
    needed = f"its end: the same campaign with --shard {shard.text} goes on"
    mark = _read_mark(journal)
    if mark is None:
        raise MisuseError(argument, f"{shard.folder}, which is not finished", needed)
    n_readable = _count_outcomes(journal, plan)
    if n_readable != mark.n_outcomes:
        flaw = f"{shard.folder}, damaged: {n_readable} of {mark.n_outcomes} outcomes can be read"
        raise MisuseError(argument, flaw, needed)


def _read_mark(folder: Path) -> EndMark | None:
    """Return the mark of a shard that is done; None if there is none that can be read."""
    try:
        return read_record(folder / _MARK, EndMark)
    except OSError:
        return None


def _count_outcomes(folder: Path, plan: Plan) -> int:
    """Return the number of outcomes in a journal that can be read."""
    journal = Journal(plan, None, [folder])
    journal.close()
    return journal.known.n_outcomes


def _difference(a: Plan, b: Plan, *, shard_too: bool = False) -> str:
    """Return the name of the first thing in which two plans differ; the working folder is none."""
    for name in (field for field in Plan.__struct_fields__ if field not in ("folder", "options")):
        if getattr(a, name) != getattr(b, name):
            return name
    for name in sorted({*a.options, *b.options} - (set() if shard_too else {_SHARD})):
        values = (msgspec.msgpack.encode(plan.options.get(name)) for plan in (a, b))  # A file has lists for tuples.
        if len({*values}) > 1:
            return name
    return ""
