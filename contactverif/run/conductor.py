"""The order in which the pieces of a run are done.

Each formulation is called once before anything else. Then the cases of a strategy are drawn, once for all formulations
and all properties that have this strategy, they are judged, and what failed is shrunk. Many cases are drawn block by
block. Follow-ups come first, so that few drawn cases wait at a time. What the journal knows is not judged again, and a
block of which it knows all is not drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, Property
from contactverif.contract.result import Row
from contactverif.contract.subject import Subject
from contactverif.run.draw import BLOCK, SHRINK_CALLS, Sampling, draw_case, draw_cases
from contactverif.run.judge import call_first
from contactverif.run.open_row import OpenRow
from contactverif.run.outcome_store import WHOLE
from contactverif.run.packing import CaseChunk
from contactverif.run.pieces import (
    CHUNK,
    LIST_CHUNK,
    DrawnCases,
    JudgedCases,
    draw_chunks,
    in_chunks,
    judge_and_note,
    needed_parts,
    shrink_case,
)
from contactverif.run.run_journal import WITNESS, BlockRecord, Journal
from contactverif.run.tasks import Progress, Reporter, Task, TaskQueue
from contactverif.run.workers import Team


class Conductor:
    """Hands out the pieces of a run.

    Parameters
    ----------
    sampling : Sampling
        The size and the seed of the run.
    team : Team
        Those who do the pieces.
    report : Callable[[Progress], None]
        A function that is called as the run advances.
    journal : Journal
        What is judged already, and where outcomes are noted.

    Attributes
    ----------
    opposite_signs : set[str]
        The formulations whose forces have the opposite sign.
    """

    def __init__(self, sampling: Sampling, team: Team, report: Callable[[Progress], None], journal: Journal) -> None:
        self._sampling, self._journal = sampling, journal
        self._tasks, self._reporter = TaskQueue(team), Reporter(report)
        self._shrunk: dict[tuple[str, str], Outcome] = {}
        self.opposite_signs: set[str] = set()

    def check_signs(self, subjects: Sequence[Subject], questions: Mapping[str, Property]) -> None:
        """Call each formulation for the first time."""
        for subject in subjects:
            report = self._reporter.counter(subject.name, "", "first call (compiles)", 1)
            report(0)
            then = partial(self._note_sign, subject.name, report)
            self._tasks.add(Task(call_first, (subject, needed_parts(questions, subject)), then))
        self._tasks.work()

    def _note_sign(self, name: str, report: Callable[[int], None], opposite: bool) -> None:
        if opposite:
            self.opposite_signs.add(name)
        report(1)

    def judge(self, rows: Sequence[OpenRow]) -> None:
        """Judge all cases of all rows, and shrink what fails."""
        for row in rows:
            if row.witness is not None and not row.witness_is_listed:
                self._plan_witness(row, row.witness)
        for group in groups_of(self._sampling, rows).values():
            source = group[0].source
            if isinstance(source, tuple):
                self._plan_list(group, source)
            else:
                self._tasks.add(self._block(group, 0))
        self._tasks.work()

    def close(self, row: OpenRow) -> Row:
        """Return a row with its smallest case; one that is not complete says so."""
        if not row.complete:
            row.stop(self._sampling.examples)
        return replace(row.row, shrunk=self._shrunk.get((row.subject.name, row.question.id)))

    def _plan_witness(self, row: OpenRow, witness: Case) -> None:
        task = self._judge_task(row, CaseChunk([witness]), WITNESS, partial(self._add_witness, row))
        self._tasks.add(task)

    def _plan_list(self, group: Sequence[OpenRow], source: tuple[Case, ...]) -> None:
        draw_cases(source, seed="", examples=0)  # It checks the names.
        for row in group:
            for task in self._judge_tasks(row, in_chunks(source, LIST_CHUNK), planned=len(source), last=True):
                self._tasks.add(task)

    def _block(self, group: Sequence[OpenRow], number: int) -> Task:
        """Return the task to begin with a block of the cases of a strategy."""
        return Task(None, (), lambda _: self._begin_block(group, number))

    def _begin_block(self, group: Sequence[OpenRow], number: int) -> None:
        """Take a block from the journal, or plan to draw it."""
        block = self._journal.block(self._sampling.block_name(group[0].question), number)
        if block is None or not self._add_judged_block(group, block):
            self._tasks.add_first([self._drawing(group, number)])
        elif not block.last:
            self._tasks.add_first([self._block(group, number + 1)])

    def _add_judged_block(self, group: Sequence[OpenRow], block: BlockRecord) -> bool:
        """Add the outcomes of a block that needs no drawing; return whether it is so.

        It is so if the journal has all outcomes of all rows, and no row keeps one of these cases whole.
        """
        first = block.number * BLOCK
        parts = []
        for row in group:
            earlier = self._journal.outcomes(row.subject.name, row.question.id, first, block.count)
            if len(earlier) < block.count or row.may_keep_whole(first, earlier.values()):
                return False
            parts.append(tuple(earlier[place] for place in range(block.count)))
        for row, outcomes in zip(group, parts, strict=True):
            number = row.expect_judged(block.count, planned=self._count_planned(block), last=block.last)
            self._add_outcomes(row, number, JudgedCases(outcomes))
        return True

    def _count_planned(self, block: BlockRecord) -> int:
        """Return the number of cases of a row, once a block is drawn."""
        return block.number * BLOCK + block.count if block.exhausted else self._sampling.examples

    def _drawing(self, group: Sequence[OpenRow], number: int) -> Task:
        """Return the task to draw a block of the cases of a strategy, once for all rows that have it."""
        row = group[0]
        report = self._reporter.counter(row.subject.name, row.question.id, "drawing", self._sampling.examples)
        piece = self._sampling, row.question, number
        return Task(draw_chunks, piece, partial(self._add_drawn, group, number), report)

    def _add_drawn(self, group: Sequence[OpenRow], number: int, answer: DrawnCases) -> None:
        """Plan the judging of a block, then the next block."""
        if number == 0:
            for chunk in answer.chunks[: -(-WHOLE // CHUNK)]:
                chunk.keep()
        name = self._sampling.block_name(group[0].question)
        block = BlockRecord(name, number, answer.count, answer.exhausted, answer.last)
        self._journal.add_block(block)
        planned = self._count_planned(block)
        tasks = [
            task for row in group for task in self._judge_tasks(row, answer.chunks, planned=planned, last=answer.last)
        ]
        if not answer.last:
            tasks.append(self._block(group, number + 1))
        self._tasks.add_first(tasks)

    def _judge_tasks(self, row: OpenRow, chunks: Sequence[CaseChunk], *, planned: int, last: bool) -> Iterable[Task]:
        numbers = row.expect(chunks, planned=planned, last=last)
        if row.complete:  # There is no case at all.
            self._finish(row)
        for (number, first), chunk in zip(numbers, chunks, strict=True):
            yield self._judge_task(row, chunk, first, partial(self._add_outcomes, row, number))

    def _judge_task(self, row: OpenRow, chunk: CaseChunk, first: int, then: Callable[[JudgedCases], None]) -> Task:
        """Return the task to judge the cases of a chunk that are not judged yet."""
        name, property_id = row.subject.name, row.question.id
        earlier = self._journal.outcomes(name, property_id, first, chunk.count)
        if len(earlier) == chunk.count:
            outcomes = tuple(earlier[place] for place in range(chunk.count))
            return Task(None, (), lambda _: then(JudgedCases(outcomes)))
        report = self._reporter.counter(name, property_id, "judging", row.planned)
        piece = row.question, row.subject, chunk, self._journal.notes(name, property_id, first), earlier
        return Task(judge_and_note, piece, then, lambda count: report(row.n_finished + count))

    def _add_outcomes(self, row: OpenRow, number: int, judged: JudgedCases) -> None:
        self._journal.note_trouble(judged.trouble)
        row.add(number, judged.outcomes)
        self._reporter.counter(row.subject.name, row.question.id, "judging", row.planned)(row.n_finished)
        if row.complete:
            self._finish(row)

    def _add_witness(self, row: OpenRow, judged: JudgedCases) -> None:
        self._journal.note_trouble(judged.trouble)
        row.add_witness(judged.outcomes)
        if row.complete:
            self._finish(row)

    def _finish(self, row: OpenRow) -> None:
        """Make the row, and plan the shrinking of what failed. Of a finite list nothing is smaller."""
        row.judge(on_scene=self._sampling.scene is not None)
        goal = row.goal()
        if goal is None:
            return
        if isinstance(row.source, tuple):
            self._shrunk[row.subject.name, row.question.id] = row.outcomes[goal.first]
            return
        task = Task(
            shrink_case,
            (self._sampling, row.question, row.subject, goal),
            partial(self._add_shrunk, row, goal.first),
            self._reporter.counter(row.subject.name, row.question.id, "shrinking", SHRINK_CALLS),
        )
        self._tasks.add_first([task])

    def _add_shrunk(self, row: OpenRow, first: int, smallest: Outcome | None) -> None:
        if smallest is None:  # The formulation answers differently each time.
            smallest = with_case(self._sampling, row.question, first, row.outcomes[first])
        self._shrunk[row.subject.name, row.question.id] = smallest


def groups_of(sampling: Sampling, rows: Sequence[OpenRow]) -> dict[tuple[str, bool], list[OpenRow]]:
    """Return the rows by what they have in common if their cases are the same, in their order."""
    groups: dict[tuple[str, bool], list[OpenRow]] = {}
    for row in rows:
        groups.setdefault(sampling.group(row.question), []).append(row)
    return groups


def with_case(sampling: Sampling, question: Property, number: int, outcome: Outcome) -> Outcome:
    """Return an outcome with its case, which is drawn once more if only its summary was kept.

    Parameters
    ----------
    sampling : Sampling
        The size and the seed of the run.
    question : Property
        The property.
    number : int
        The number of the outcome in its row.
    outcome : Outcome
        The outcome.
    """
    if isinstance(outcome.case_or_summary, Case):
        return outcome
    source = sampling.source(question)
    assert source is not None
    case = draw_case(source, seed=sampling.key(question), examples=sampling.examples, number=number)
    return replace(outcome, case_or_summary=case)
