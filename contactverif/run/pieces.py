"""The pieces that a run is made of: draw a block of cases, judge some, shrink one, call a formulation first.

A piece is a plain function of data that can be pickled. It runs in the parent or in a worker process, with the same
result. Rule for the next editor: a piece knows nothing of other pieces, and it changes nothing outside but the journal.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, Property
from contactverif.contract.subject import Subject
from contactverif.run import draw, judge
from contactverif.run.draw import Sampling
from contactverif.run.packing import CaseChunk
from contactverif.run.run_journal import Notes

CHUNK = 25  # The number of drawn cases that are judged in one piece.
SHRINK_ENDS = 8  # A case that ends the process of the plugin is made smaller until it has ended so often.
LIST_CHUNK = 5  # The same for named cases, which are often slower.

Count = Callable[[int], None]  # It is called with the number of finished cases.
Badness = tuple[int, float]


@dataclass(frozen=True, slots=True)
class DrawnCases:
    """A block of the cases of a strategy.

    Attributes
    ----------
    chunks : tuple[CaseChunk, ...]
        The cases in order.
    exhausted : bool
        The strategy has no other cases.
    last : bool
        No further block follows.
    """

    chunks: tuple[CaseChunk, ...]
    exhausted: bool
    last: bool

    @property
    def count(self) -> int:
        """The number of cases."""
        return sum(chunk.count for chunk in self.chunks)


def draw_chunks(sampling: Sampling, question: Property, number: int, count: Count | None = None) -> DrawnCases:
    """Draw a block of the cases of a property, and of all properties with the same strategy."""
    source = sampling.source(question)
    assert source is not None
    block = draw.draw_block(
        source, seed=sampling.key(question), examples=sampling.examples, number=number, progress=count
    )
    return DrawnCases(in_chunks(block.cases, CHUNK), block.exhausted, block.last)


def in_chunks(cases: tuple[Case, ...], size: int) -> tuple[CaseChunk, ...]:
    """Return cases in chunks of a size."""
    return tuple(CaseChunk(cases[first : first + size]) for first in range(0, len(cases), size))


@dataclass(frozen=True, slots=True)
class JudgedCases:
    """The outcomes of some cases.

    Attributes
    ----------
    outcomes : tuple[Outcome, ...]
        The outcomes in the order of the cases.
    trouble : str
        What kept the process from noting them in the journal; empty if nothing did.
    """

    outcomes: tuple[Outcome, ...]
    trouble: str = ""


def judge_and_note(
    question: Property,
    subject: Subject,
    chunk: CaseChunk,
    notes: Notes,
    earlier: Mapping[int, Outcome],
    count: Count | None = None,
) -> JudgedCases:
    """Judge some cases, and note each outcome at once.

    Parameters
    ----------
    question : Property
        The property.
    subject : Subject
        The formulation.
    chunk : CaseChunk
        The cases.
    notes : Notes
        The place in the journal.
    earlier : Mapping[int, Outcome]
        {place in the chunk: outcome} of the cases that are judged already. They are not judged again.
    count : Callable[[int], None] | None
        A function that is called with the number of finished cases.

    Returns
    -------
    JudgedCases
        All outcomes, those from earlier too.
    """
    return JudgedCases(judge_chunk(question, subject, chunk, count, earlier=earlier, note=notes.add), notes.trouble)


def judge_chunk(
    question: Property,
    subject: Subject,
    chunk: CaseChunk,
    count: Count | None = None,
    *,
    earlier: Mapping[int, Outcome] = MappingProxyType({}),
    note: Callable[[int, Outcome], None] = lambda place, outcome: None,
) -> tuple[Outcome, ...]:
    """Judge some cases; the outcomes hold summaries, because the parent has the cases."""
    outcomes: list[Outcome] = []
    for place, case in enumerate(chunk.cases):
        if place in earlier:
            outcomes.append(earlier[place])
            continue
        outcome = judge.judge_case(question, case, subject)
        outcomes.append(replace(outcome, case_or_summary=outcome.summary))
        note(place, outcomes[-1])
        if count is not None:
            count(place + 1)
    return tuple(outcomes)


@dataclass(frozen=True, slots=True)
class Shrinking:
    """The goal of a search for the smallest case.

    Attributes
    ----------
    first : int
        The number of the first case that is bad enough.
    kind : int
        The kind of badness that the smallest case must have.
    least : tuple[int, float]
        The least badness that it must have.
    """

    first: int
    kind: int
    least: Badness


def shrink_case(
    sampling: Sampling, question: Property, subject: Subject, goal: Shrinking, count: Count | None = None
) -> Outcome | None:
    """Return the outcome of the smallest case that is bad enough; None if the search judged none."""
    source = sampling.source(question)
    assert source is not None
    smallest: Outcome | None = None
    calls, ended = 0, subject.n_ended

    def fails(case: Case) -> bool:
        nonlocal smallest, calls
        if subject.n_ended - ended >= SHRINK_ENDS:
            return False
        calls += 1
        if count is not None:
            count(calls)
        outcome = judge.judge_case(question, case, subject)
        bad = judge.badness(question.info, outcome)
        if bad[0] != goal.kind or bad < goal.least:
            return False
        smallest = outcome
        return True

    draw.shrink(source, seed=sampling.key(question), examples=sampling.examples, first=goal.first, fails=fails)
    return smallest


def needed_parts(questions: Mapping[str, Property], subject: Subject) -> frozenset[str]:
    """Return the optional parts of a formulation that some property needs."""
    return frozenset().union(*(question.needs for question in questions.values())) & subject.provides
