"""The order in which the pieces of a run are done, and the report of its progress.

Each formulation is called once before anything else. Then the cases of a strategy are drawn, once for all formulations
and all properties that have this strategy, they are judged, and what failed is shrunk. Many cases are drawn block by
block. Follow-ups come first, so that few drawn cases wait at a time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, Property
from contactverif.contract.result import Row
from contactverif.contract.subject import Subject
from contactverif.run.driver import BLOCK, SHRINK_CALLS, draw_case, draw_cases
from contactverif.run.open_row import OpenRow
from contactverif.run.outcome_store import WHOLE
from contactverif.run.packing import CaseChunk
from contactverif.run.pieces import (
    CHUNK,
    LIST_CHUNK,
    DrawnCases,
    call_first,
    draw_chunks,
    in_chunks,
    judge_chunk,
    needed_parts,
    shrink_case,
)
from contactverif.run.sampling import Sampling
from contactverif.run.workers import Team

Phase = Literal["first call (compiles)", "drawing", "judging", "shrinking"]


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of a run with one property of one formulation.

    Attributes
    ----------
    formulation, property_id : str
        The names on the command line; no property in the first call of a formulation.
    phase : Phase
        The kind of work.
    count, planned : int
        The numbers of finished cases and of all cases; shrinking may end early.
    """

    formulation: str
    property_id: str
    phase: Phase
    count: int
    planned: int


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """A piece that waits: the function and its arguments, what to do with its result, and how to report it."""

    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    then: Callable[[Any], None]
    count: Callable[[int], None] | None = None

    @property
    def here(self) -> dict[str, Any]:
        return {} if self.count is None else {"count": self.count}


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

    Attributes
    ----------
    opposite_signs : set[str]
        The formulations whose forces have the opposite sign.
    """

    def __init__(self, sampling: Sampling, team: Team, report: Callable[[Progress], None]) -> None:
        self._sampling, self._team, self._report = sampling, team, report
        self._tasks: deque[_Task] = deque()
        self._shrunk: dict[tuple[str, str], Outcome] = {}
        self.opposite_signs: set[str] = set()

    def check_signs(self, subjects: Sequence[Subject], questions: Mapping[str, Property]) -> None:
        """Call each formulation for the first time."""
        for subject in subjects:
            report = self._reporter(subject.name, "", "first call (compiles)", 1)
            report(0)
            then = partial(self._note_sign, subject.name, report)
            self._tasks.append(_Task(call_first, (subject, needed_parts(questions, subject)), then))
        self._work()

    def _note_sign(self, name: str, report: Callable[[int], None], opposite: bool) -> None:
        if opposite:
            self.opposite_signs.add(name)
        report(1)

    def judge(self, rows: Sequence[OpenRow]) -> None:
        """Judge all cases of all rows, and shrink what fails."""
        groups: dict[tuple[str, bool], list[OpenRow]] = {}
        for row in rows:
            groups.setdefault(self._sampling.group(row.question), []).append(row)
            if row.witness is not None and not row.witness_is_listed:
                piece = row.question, row.subject, CaseChunk([row.witness])
                self._tasks.append(_Task(judge_chunk, piece, partial(self._add_witness, row)))
        for group in groups.values():
            source = group[0].source
            if isinstance(source, tuple):
                self._plan_list(group, source)
            else:
                self._tasks.append(self._drawing(group, 0))
        self._work()

    def close(self, row: OpenRow) -> Row:
        """Return a row with its smallest case."""
        return replace(row.row, shrunk=self._shrunk.get((row.subject.name, row.question.id)))

    def _plan_list(self, group: Sequence[OpenRow], source: tuple[Case, ...]) -> None:
        draw_cases(source, seed="", examples=0)  # It checks the names.
        for row in group:
            self._tasks.extend(self._judge_tasks(row, in_chunks(source, LIST_CHUNK), planned=len(source), last=True))

    def _drawing(self, group: Sequence[OpenRow], number: int) -> _Task:
        """Return the task to draw a block of the cases of a strategy, once for all rows that have it."""
        row = group[0]
        report = self._reporter(row.subject.name, row.question.id, "drawing", self._sampling.examples)
        piece = self._sampling, row.question, number
        return _Task(draw_chunks, piece, partial(self._add_drawn, group, number), report)

    def _add_drawn(self, group: Sequence[OpenRow], number: int, answer: DrawnCases) -> None:
        """Plan the judging of a block, then the next block."""
        if number == 0:
            for chunk in answer.chunks[: -(-WHOLE // CHUNK)]:
                chunk.keep()
        planned = number * BLOCK + answer.count if answer.exhausted else self._sampling.examples
        tasks = [
            task for row in group for task in self._judge_tasks(row, answer.chunks, planned=planned, last=answer.last)
        ]
        if not answer.last:
            tasks.append(self._drawing(group, number + 1))
        self._tasks.extendleft(reversed(tasks))

    def _judge_tasks(self, row: OpenRow, chunks: Sequence[CaseChunk], *, planned: int, last: bool) -> Iterable[_Task]:
        numbers = row.expect(chunks, planned=planned, last=last)
        if row.complete:  # There is no case at all.
            self._finish(row)
        report = self._reporter(row.subject.name, row.question.id, "judging", planned)
        for number, chunk in zip(numbers, chunks, strict=True):
            then = partial(self._add_outcomes, row, number)
            piece = row.question, row.subject, chunk
            yield _Task(judge_chunk, piece, then, lambda count: report(row.n_finished + count))

    def _add_outcomes(self, row: OpenRow, number: int, outcomes: Sequence[Outcome]) -> None:
        row.add(number, outcomes)
        self._reporter(row.subject.name, row.question.id, "judging", row.planned)(row.n_finished)
        if row.complete:
            self._finish(row)

    def _add_witness(self, row: OpenRow, outcomes: Sequence[Outcome]) -> None:
        row.add_witness(outcomes)
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
        task = _Task(
            shrink_case,
            (self._sampling, row.question, row.subject, goal),
            partial(self._add_shrunk, row, goal.first),
            self._reporter(row.subject.name, row.question.id, "shrinking", SHRINK_CALLS),
        )
        self._tasks.appendleft(task)

    def _add_shrunk(self, row: OpenRow, first: int, smallest: Outcome | None) -> None:
        if smallest is None:  # The formulation answers differently each time.
            smallest = with_case(self._sampling, row.question, first, row.outcomes[first])
        self._shrunk[row.subject.name, row.question.id] = smallest

    def _reporter(self, formulation: str, property_id: str, phase: Phase, planned: int) -> Callable[[int], None]:
        """Return a function that reports how many cases are finished, each number once."""
        return lambda count: self._report_once(Progress(formulation, property_id, phase, count, planned))

    _last: Progress | None = None

    def _report_once(self, step: Progress) -> None:
        if step != self._last:
            self._last = step
            self._report(step)

    def _work(self) -> None:
        """Hand out tasks until none is left."""
        running: dict[Future[Any], _Task] = {}
        while self._tasks or running:
            while self._tasks and len(running) < self._team.limit:
                task = self._tasks.popleft()
                running[self._team.submit(task.function, task.arguments, **task.here)] = task
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                task = running.pop(future)
                task.then(self._team.result(future, task.function, task.arguments, **task.here))


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
