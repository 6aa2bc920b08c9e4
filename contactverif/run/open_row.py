"""A row of a run while its cases are judged: it puts the outcomes in order, and says what they come to.

Rule for the next editor: pieces may end in any order, and a row does not depend on it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import chain
from math import sqrt

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.result import JUDGED_SHARE, Row
from contactverif.contract.subject import Subject
from contactverif.run.draw import CaseSource
from contactverif.run.judge import badness
from contactverif.run.outcome_store import WHOLE, OutcomeStore
from contactverif.run.packing import CaseChunk
from contactverif.run.pieces import Shrinking

CLEAR_RATIO = 1000.0  # A shrunk case need not fail by more than this many tolerances.


class OpenRow:
    """A formulation and a property whose cases are being judged.

    Parameters
    ----------
    row : Row
        The row, without outcomes.
    subject : Subject
        The formulation.
    question : Property
        The property.
    source : CaseSource
        The source of its cases.
    witness : Case | None
        The case with which the formulation proves that it fails.
    """

    def __init__(
        self, row: Row, subject: Subject, question: Property, source: CaseSource, witness: Case | None
    ) -> None:
        self.row, self.subject, self.question, self.source, self.witness = row, subject, question, source, witness
        self.outcomes = OutcomeStore(len(source) if isinstance(source, tuple) else WHOLE)
        self.planned = 0
        self.n_finished = 0
        self._chunks: dict[int, CaseChunk | None] = {}  # The chunks without outcomes, by number; None if not drawn.
        self._sizes: dict[int, int] = {}  # The numbers of their cases.
        self._n_drawn = self._n_cases = 0
        self._all_drawn = False
        self._flushed = 0
        self._waiting: dict[int, Sequence[Outcome]] = {}
        self._witness_outcome: Outcome | None = None

    @property
    def witness_is_listed(self) -> bool:
        """Return whether the witness is a case of the property's own finite list, which is judged anyway."""
        return isinstance(self.source, tuple) and any(case is self.witness for case in self.source)

    def expect(self, chunks: Sequence[CaseChunk], *, planned: int, last: bool) -> list[tuple[int, int]]:
        """Note the chunks of a block that will be judged.

        Parameters
        ----------
        chunks : Sequence[CaseChunk]
            The chunks in order.
        planned : int
            The number of cases that are planned for the whole row.
        last : bool
            No further block follows.

        Returns
        -------
        list[tuple[int, int]]
            The number of each chunk, and the number of its first case.
        """
        numbers = [self._expect(chunk, chunk.count) for chunk in chunks]
        self._all_drawn, self.planned = last, planned
        return numbers

    def expect_judged(self, count: int, *, planned: int, last: bool) -> int:
        """Note a block of cases that are judged already, none of which stays whole, and return its number."""
        number, _ = self._expect(None, count)
        self._all_drawn, self.planned = last, planned
        return number

    def may_keep_whole(self, first: int, outcomes: Iterable[Outcome]) -> bool:
        """Return whether one of these outcomes may stay whole, if the first of them gets this number."""
        return any(self.outcomes.keeps_whole(first, outcome) for outcome in outcomes)

    def _expect(self, chunk: CaseChunk | None, count: int) -> tuple[int, int]:
        number, first = self._n_drawn, self._n_cases
        self._chunks[number], self._sizes[number] = chunk, count
        self._n_drawn, self._n_cases = number + 1, first + count
        return number, first

    def add(self, number: int, outcomes: Sequence[Outcome]) -> None:
        """Add the outcomes of a chunk; those behind a chunk that is not finished wait.

        Raises
        ------
        RuntimeError
            If there are more or fewer outcomes than cases, which is a mistake of the harness.
        """
        if len(outcomes) != self._sizes.pop(number):
            raise RuntimeError(f"{len(outcomes)} outcomes of a chunk with another number of cases")
        self.n_finished += len(outcomes)
        self._waiting[number] = outcomes
        while self._flushed in self._waiting:
            self._flush(self._flushed)
            self._flushed += 1

    def _flush(self, number: int) -> None:
        chunk, outcomes = self._chunks.pop(number), self._waiting.pop(number)
        wanted = [self.outcomes.keeps_whole(len(self.outcomes) + n, outcome) for n, outcome in enumerate(outcomes)]
        cases: Sequence[Case | None] = [None] * len(outcomes)
        if chunk is not None and any(wanted):
            cases = chunk.cases
        for outcome, case in zip(outcomes, cases, strict=True):
            self.outcomes.append(outcome, case)

    def add_witness(self, outcomes: Sequence[Outcome]) -> None:
        """Add the outcome of the witness."""
        (outcome,) = outcomes
        assert self.witness is not None
        self._witness_outcome = replace(outcome, case_or_summary=self.witness)

    @property
    def complete(self) -> bool:
        """Return whether all cases and the witness are judged."""
        witnessed = self.witness is None or self.witness_is_listed or self._witness_outcome is not None
        return witnessed and self._all_drawn and not self._chunks

    def judge(self, *, on_scene: bool) -> None:
        """Make the row of the outcomes.

        Parameters
        ----------
        on_scene : bool
            The run is about one scene alone.
        """
        witness = self._witness_outcome
        if self.witness_is_listed:
            witness = next(outcome for outcome in self.outcomes if outcome.case_or_summary is self.witness)
        row = replace(
            self.row,
            planned=self.planned,
            outcomes=self.outcomes,
            witness=witness,
            seconds=sum(outcome.seconds for outcome in self.outcomes),
        )
        verdict, reason = _verdict_over_all(row)
        if verdict is Verdict.NOT_JUDGED and self.question.bodies and self._may_stay_undecided(row, on_scene=on_scene):
            verdict = Verdict.UNDECIDED
            reason = row.outcomes[0].reason or reason if on_scene else reason
        self.row = replace(row, verdict=verdict, reason=reason)

    def stop(self, examples: int) -> None:
        """Make the row of a run that was stopped before all cases were judged.

        Parameters
        ----------
        examples : int
            The number of random cases of the run.
        """
        outcomes = tuple(chain(self.outcomes, *(self._waiting[number] for number in sorted(self._waiting))))
        planned = self.planned or (len(self.source) if isinstance(self.source, tuple) else examples)
        self.row = replace(
            self.row,
            planned=planned,
            outcomes=outcomes,
            witness=self._witness_outcome,
            verdict=Verdict.NOT_JUDGED,
            reason=f"stopped: {self.n_finished} of {planned} cases judged"
            + (", the witness not yet" if self.n_finished == planned else ""),
            seconds=sum(outcome.seconds for outcome in outcomes),
        )

    def _may_stay_undecided(self, row: Row, *, on_scene: bool) -> bool:
        """Return whether nobody promised that the scenes of a row can be decided.

        It is so for the one scene that a user names, and for a list of scenes about which the formulation states
        nothing: they may have no solution.
        """
        if on_scene:
            return bool(row.outcomes) and not row.judged
        return row.promise is None and row.undecided > 0 and isinstance(self.source, tuple)

    def goal(self) -> Shrinking | None:
        """Return what to shrink; None if no case failed.

        The smallest case crashes if something crashed, and breaks the contract if something did. Of failures by a
        number it must be a clear one, half-way on a logarithmic scale between the tolerance and the worst value: the
        smallest case that fails at all often fails by a hair, and convinces nobody.
        """
        kind, worst = max((badness(self.row.info, outcome) for outcome in self.outcomes), default=(0, 0.0))
        if kind == 0:
            return None
        least = (kind, min(CLEAR_RATIO, sqrt(worst)) if kind == 1 else worst)
        bad = ((number, badness(self.row.info, outcome)) for number, outcome in enumerate(self.outcomes))
        first = next(number for number, (its_kind, its_worst) in bad if its_kind == kind and (kind, its_worst) >= least)
        return Shrinking(first, kind, least)


def _verdict_over_all(row: Row) -> tuple[Verdict, str]:
    """Return verdict and reason of a row from its outcomes."""
    everything = chain(row.outcomes, [row.witness] if row.witness else [])
    worst = max(everything, key=lambda outcome: badness(row.info, outcome), default=None)
    if worst is not None and worst.verdict in (Verdict.CRASHED, Verdict.FAIL):
        return worst.verdict, _reason_with_name(row, worst)
    if row.judged < JUDGED_SHARE * row.planned:
        cause = next((f"most often because {reason}" for reason in row.tally.reasons), "no more cases could be made")
        return Verdict.NOT_JUDGED, f"{row.judged} of {row.planned} cases judged; {cause}"
    if reason := _too_idle(row):
        return Verdict.NOT_JUDGED, reason
    return Verdict.PASS, ""


def _too_idle(row: Row) -> str:
    """Return why too few cases were in contact, or an empty string. One idle case may be chance; all of them is not."""
    counts, least = row.tally.counts, row.info.least_contact
    if not counts.idle or counts.contact_share >= least or (counts.idle == 1 and counts.judged > 1):
        return ""
    if counts.idle == counts.judged:
        return "nothing was in contact in any case: nothing was judged"
    return f"{counts.judged - counts.idle} of {counts.judged} judged cases in contact, needed {least:.0%}"


def _reason_with_name(row: Row, outcome: Outcome) -> str:
    """Return the reason of an outcome, with the name of its case before it where a finite list has named it."""
    name = outcome.case_or_summary.name
    return f"{name}: {outcome.reason}" if name and outcome is not row.witness else outcome.reason
