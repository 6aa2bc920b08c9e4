"""The rows of a run while their cases are judged, the jobs that judge and shrink them, and what their outcomes come to.

Jobs may end in any order, and a row does not depend on it. A row may have a million outcomes: the first stay whole, and
so do the first failures. Of all others the numbers stay, in one long array and without their meshes: all that a report
stores. An outcome is made of them again when it is read.
"""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, product
from math import sqrt

from contactverif.contract.case import Case
from contactverif.contract.cases import needs_of_place
from contactverif.contract.errors import MisuseError
from contactverif.contract.outcomes import Outcomes
from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.result import NOT_HERE, OF_TRAITS, OMITTED, NotLoaded, Row, Run
from contactverif.contract.subject import STATED_PARTS, Subject
from contactverif.contract.traits import traits_behind
from contactverif.isolation.lockstep import in_lockstep
from contactverif.isolation.remote_formulation import RemoteSubject, count_ends
from contactverif.journals.outcome_records import OutcomeForm, decode_outcome, encode_outcome
from contactverif.journals.run_journal import Notes
from contactverif.problems.named_states import named_case
from contactverif.run import judge
from contactverif.run.judge import badness, verdict_over_all
from contactverif.run.scheduler import CaseChunk
from contactverif.sampling.blas_threads import one_thread
from contactverif.sampling.draw import CaseSource, Sampling, draw_cases, shrink

WHOLE = 100  # The first outcomes of a row that stay as they are.
FAILURES = 100  # The failures behind them that stay as they are.
SHRINK_ENDS = 8  # A case that ends the process of the plugin is made smaller until it has ended so often.
CLEAR_RATIO = 1000.0  # A shrunk case need not fail by more than this many tolerances.


class OutcomeStore(Outcomes):
    """The outcomes of a row in order, of which the first `whole` stay as they are. `append` adds one."""

    def __init__(self, whole: int = WHOLE) -> None:
        self._n_whole = whole
        self._whole: dict[int, Outcome] = {}
        self._forms: list[OutcomeForm] = []
        self._numbers_of_forms: dict[OutcomeForm, int] = {}
        self._form_of = array("l")
        self._starts = array("q")
        self._numbers = array("d")
        self._n_failures = 0

    def keeps_whole(self, number: int, outcome: Outcome) -> bool:
        """Return whether an outcome stays as it is if it gets this number; of failures the first few do."""
        failed = outcome.verdict in (Verdict.FAIL, Verdict.CRASHED)
        return number < self._n_whole or (failed and self._n_failures < FAILURES)

    def append(self, outcome: Outcome, case: Case | None) -> None:
        """Add an outcome with the summary of its case; the case, if there is one, stays with one that stays whole."""
        number = len(self)
        if self.keeps_whole(number, outcome):
            self._n_failures += number >= self._n_whole
            self._whole[number] = outcome if case is None else replace(outcome, case_or_summary=case)
            self._form_of.append(-1)
            self._starts.append(len(self._numbers))
            return
        form, numbers = encode_outcome(outcome)
        place = self._numbers_of_forms.setdefault(form, len(self._forms))
        if place == len(self._forms):
            self._forms.append(form)
        self._form_of.append(place)
        self._starts.append(len(self._numbers))
        self._numbers.extend(numbers)

    def __len__(self) -> int:
        return len(self._form_of)

    def at(self, number: int) -> Outcome:
        """Return an outcome, which is made of its numbers if it did not stay whole."""
        if number in self._whole:
            return self._whole[number]
        start = self._starts[number]
        end = self._starts[number + 1] if number + 1 < len(self) else len(self._numbers)
        return decode_outcome(self._forms[self._form_of[number]], self._numbers[start:end].tolist())


@dataclass(frozen=True, slots=True)
class Shrinking:
    """The goal of a search for the smallest case."""

    first: int  # The number of the first case that is bad enough.
    kind: int  # The kind of badness that the smallest case must have.
    least: tuple[int, float]  # The least badness that it must have.


class OpenRow:
    """A formulation and a property whose cases are being judged: those of a strategy, or a finite list (`listed`).

    `row` is a row without outcomes until `judge` or `stop`.
    """

    def __init__(
        self,
        row: Row,
        subject: Subject,
        question: Property,
        listed: tuple[Case, ...] | None,
    ) -> None:
        self.row, self.subject, self.question, self.listed = row, subject, question, listed
        self.witness: Case | None = None
        self.witness_is_listed = False  # It is judged anyway.
        self.outcomes = OutcomeStore(WHOLE if listed is None else len(listed))
        self.planned = 0
        self.n_finished = 0
        self._expected: dict[int, CaseChunk | int] = {}  # By the first number; an int if not drawn.
        self._all_drawn = False
        self._next = 0
        self._waiting: dict[int, Sequence[Outcome]] = {}
        self._witness_outcome: Outcome | None = None

    def set_witness(self, witness: Case | None) -> None:
        """Set the case with which the formulation proves that it fails."""
        self.witness = witness
        self.witness_is_listed = any(case is witness for case in self.listed or ())

    def expect(self, chunks: Iterable[CaseChunk], *, planned: int, last: bool) -> None:
        """Note chunks that will be judged, of a row with so many planned cases; `last` if no others follow."""
        self._expected |= {chunk.first: chunk for chunk in chunks}
        self._all_drawn, self.planned = last, planned

    def expect_judged(self, first: int, count: int, *, planned: int, last: bool) -> None:
        """Note cases that are judged already, none of which stays whole."""
        self._expected[first] = count
        self._all_drawn, self.planned = last, planned

    def may_keep_whole(self, first: int, outcomes: Iterable[Outcome]) -> bool:
        """Return whether one of these outcomes may stay whole, if the first of them gets this number."""
        return any(self.outcomes.keeps_whole(first, outcome) for outcome in outcomes)

    def add(self, first: int, outcomes: Sequence[Outcome]) -> None:
        """Add the outcomes of a chunk; those behind a chunk that is not finished wait."""
        chunk = self._expected[first]
        if len(outcomes) != (chunk if isinstance(chunk, int) else chunk.count):
            raise RuntimeError(f"{len(outcomes)} outcomes of a chunk with another number of cases")
        self.n_finished += len(outcomes)
        self._waiting[first] = outcomes
        while self._next in self._waiting:
            self._next += self._flush(self._next)

    def _flush(self, first: int) -> int:
        """Move the outcomes of a chunk into the store, and return how many they are."""
        chunk, outcomes = self._expected.pop(first), self._waiting.pop(first)
        cases: Sequence[Case | None] = [None] * len(outcomes)
        if isinstance(chunk, CaseChunk) and any(
            self.outcomes.keeps_whole(len(self.outcomes) + n, outcome) for n, outcome in enumerate(outcomes)
        ):
            cases = chunk.cases
        for outcome, case in zip(outcomes, cases, strict=True):
            self.outcomes.append(outcome, case)
        return len(outcomes)

    def add_witness(self, outcome: Outcome) -> None:
        """Add the outcome of the witness."""
        assert self.witness is not None
        self._witness_outcome = replace(outcome, case_or_summary=self.witness)

    def add_earlier_failure(self, outcome: Outcome) -> None:
        """Add the outcome of a case that failed in an earlier run, and fails again; a list has its cases anyway."""
        if self.witness is None and self.listed is None:
            self.witness, self._witness_outcome = outcome.case, outcome

    @property
    def witnessed(self) -> bool:
        """Return whether the witness is judged, or is among the planned cases; without one too."""
        return self.witness is None or self.witness_is_listed or self._witness_outcome is not None

    @property
    def complete(self) -> bool:
        """Return whether all cases and the witness are judged."""
        return self.witnessed and self._all_drawn and not self._expected

    def judge(self, *, on_scene: bool) -> None:
        """Make the row of the outcomes; `on_scene` if the run is about one scene alone."""
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
        verdict, reason = verdict_of_row(row, self, on_scene=on_scene)
        self.row = replace(row, verdict=verdict, reason=reason)

    def stop(self, examples: int) -> None:
        """Make the row of a run, with so many random cases, that was stopped before all cases were judged."""
        outcomes = tuple(chain(self.outcomes, *(self._waiting[first] for first in sorted(self._waiting))))
        planned = self.planned or (examples if self.listed is None else len(self.listed))
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

    def may_stay_undecided(self, row: Row, *, on_scene: bool) -> bool:
        """Return whether it is not promised that the scenes of a row can be decided.

        It is so for the one scene that a user names, and for a list of scenes about which the formulation states
        nothing: they may have no solution.
        """
        if on_scene:
            return bool(row.outcomes) and not row.judged
        return row.promise is None and row.undecided > 0 and self.listed is not None

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


def verdict_of_row(row: Row, opened: OpenRow, *, on_scene: bool) -> tuple[Verdict, str]:
    """Return verdict and reason of a row of which all cases are judged; `on_scene` as in `OpenRow.judge`."""
    verdict, reason = verdict_over_all(row)
    if reason.startswith(judge.RAISED):
        return verdict, reason
    if verdict is Verdict.NOT_JUDGED and opened.question.bodies and opened.may_stay_undecided(row, on_scene=on_scene):
        return Verdict.UNDECIDED, row.outcomes[0].reason or reason if on_scene else reason
    return verdict, reason


def open_row(
    subject: Subject,
    question: Property,
    source: CaseSource | None,
    known: str,
    sampling: Sampling,
    stopped: str = "",
) -> OpenRow | Row:
    """Return a row whose cases are to be judged, or the row itself if there is nothing to judge.

    `stopped` says why the formulation is asked nothing more; it is empty if all is asked.
    """
    promise = question.promise(subject.traits)
    row = Row(
        formulation=subject.name,
        info=question.info,
        verdict=Verdict.PASS,
        promise=promise,
        promised_by=_traits_of_promise(question, subject),
        known=known,
    )
    if reason := question.refusal_of(subject):
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason=reason)
    if missing := question.needs - subject.provides:
        reason = f"{', '.join(sorted(missing))}: not provided"
        return replace(
            row, verdict=Verdict.NOT_PROVIDED, promise=promise if missing & STATED_PARTS else None, reason=reason
        )
    if source is None:
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason=f"{NOT_HERE}{_needs_of(question, sampling)}")
    # The formulation fails on some scene, not on every one, and where it reports what shows it.
    if promise is False and (_is_on_scene(question, sampling) or question.shown_by - subject.provides):
        row = replace(row, promise=None)
    return _with_witness(OpenRow(row, subject, question, source if isinstance(source, tuple) else None), stopped)


def lacks_witness(subject: Subject, question: Property, sampling: Sampling) -> bool:
    """Return whether a formulation states that it fails, and names no case that shows so, where it is asked for one."""
    if question.refusal_of(subject) or (question.needs | question.shown_by) - subject.provides:
        return False
    stated = question.promise(subject.traits) is False and not _is_on_scene(question, sampling)
    return stated and subject.traits.witness(question.id) is None


def _traits_of_promise(question: Property, subject: Subject) -> str:
    """Return the traits from which a promise to pass follows, in words; of a table, as published forces, its name."""
    if not question.promise(subject.traits):
        return ""
    traits = traits_behind(question.promise, subject.traits)
    stated = {name: value for name, value in traits.items() if value is not False}
    return ", ".join(name if isinstance(value, Mapping) else f"{name}={value!r}" for name, value in stated.items())


def row_of_case(question: Property, subject: Subject, outcome: Outcome) -> Row:
    """Return the row of a case that failed in an earlier run, alone."""
    return Row(
        formulation=subject.name,
        info=question.info,
        verdict=outcome.verdict,
        promise=question.promise(subject.traits),
        reason=outcome.reason,
        witness=outcome,
    )


def _is_on_scene(question: Property, sampling: Sampling) -> bool:
    """Return whether a property is asked on the scene of the run alone."""
    return question.bodies and sampling.scene is not None


def _needs_of(question: Property, sampling: Sampling) -> str:
    """Return what the place of a run lacks for the cases of a property."""
    if question.bodies and sampling.scene is None:
        return "elastic bodies"
    return needs_of_place(question.cases)


def _with_witness(row: OpenRow, stopped: str) -> OpenRow | Row:
    """Return a row with the case that proves what the formulation states, if it states that it fails.

    Where the formulation is asked nothing more, only a missing case is reported.
    """
    try:
        witness = find_witness(row.subject, row.question, row.listed or ()) if row.row.promise is False else None
    except MisuseError as error:
        return replace(row.row, verdict=Verdict.CRASHED, reason=f"{OF_TRAITS}{error}")
    row.set_witness(witness)
    return replace(row.row, verdict=Verdict.NOT_JUDGED, reason=f"{OMITTED}{stopped}") if stopped else row


def find_witness(subject: Subject, question: Property, listed: Sequence[Case]) -> Case:
    """Return the case that the traits name as a proof that the formulation fails.

    It is a case of the property's own finite list, if that has one of this name, else a named state or scene.
    """
    name = subject.traits.witness(question.id)
    if name is None:
        raise MisuseError(
            "witnesses", f"none for {question.id}, which {subject.name} says it does not pass", "the name of a case"
        )
    if matches := [case for case in listed if case.name == name]:
        return matches[0]
    try:
        if not question.bodies:
            return _taken_by(subject, named_case(name))
        # The catalogue imports bodies and Newton's method, so it is imported only where it is needed.
        from contactverif.problems.catalogue import load_scene_case

        return load_scene_case(name)
    except MisuseError as error:
        listed_names = f"a case of {question.id} ({'; '.join(case.name for case in listed)}), or " if listed else ""
        raise MisuseError(f"witness of {question.id}", error.found, f"{listed_names}{error.needed}") from None


def _taken_by(subject: Subject, case: Case) -> Case:
    """Return a case whose interface has as many coordinates as the formulation takes."""
    if case.interface.dim not in subject.traits.abilities.dimensions:
        words = f"{case.name!r}, whose interface has {case.interface.dim} coordinates"
        raise MisuseError("name", words, f"one that {subject.name} takes by its trait dimensions")
    return case


@dataclass(frozen=True, slots=True)
class JudgedCases:
    """The outcomes of some cases, in their order."""

    outcomes: tuple[Outcome, ...]
    trouble: str = ""  # What kept the process from noting them in the journal.


def judge_cases(
    question: Property,
    subject: Subject,
    chunk: CaseChunk,
    notes: Notes,
    earlier: Mapping[int, Outcome],
    count: Callable[[int], None] | None = None,
) -> JudgedCases:
    """Judge the cases of a chunk but for those at the places of `earlier`, and note each outcome at once.

    The outcomes hold summaries, because the parent has the cases.
    """
    outcomes: list[Outcome] = []
    cases = dict(enumerate(chunk.cases))
    together = _judge_together(question, subject, {n: case for n, case in cases.items() if n not in earlier})
    for place, case in cases.items():
        if place in earlier:
            outcomes.append(earlier[place])
            continue
        outcome = together.get(place) or judge.judge_case(question, case, subject)
        outcomes.append(replace(outcome, case_or_summary=outcome.summary))
        notes.add(place, outcomes[-1])
        if count is not None:
            count(place + 1)
    return JudgedCases(tuple(outcomes), notes.trouble)


def _judge_together(question: Property, subject: Subject, cases: Mapping[int, Case]) -> dict[int, Outcome]:
    """Return {place: outcome} of the cases that pass where all are judged in lockstep; what fails is judged alone.

    Lockstep saves messages to the plugin's process. It is not tried if the first case fails or a process has ended.
    """
    if not isinstance(subject, RemoteSubject) or len(cases) < 2 or count_ends(subject):
        return {}
    (first, case), *others = cases.items()
    passed = {first: judge.judge_case(question, case, subject)}
    if _may_fail(passed[first]):
        return passed
    with one_thread():  # It ends behind all cases: one that ends before another must not let BLAS have more.
        judged = in_lockstep([partial(judge.judge_case, question, case, subject) for _, case in others])
    for (place, _), (outcome, seconds) in zip(others, judged or (), strict=judged is not None):
        if not _may_fail(outcome):
            passed[place] = replace(outcome, seconds=seconds)
    return passed


def _may_fail(outcome: Outcome) -> bool:
    return outcome.measurement is None or outcome.verdict in (Verdict.FAIL, Verdict.CRASHED)


def shrink_case(
    sampling: Sampling,
    question: Property,
    subject: Subject,
    goal: Shrinking,
    count: Callable[[int], None] | None = None,
) -> Outcome | None:
    """Return the outcome of the smallest case that is bad enough; None if the search judged none."""
    source = sampling.source(question)
    assert source is not None
    smallest: Outcome | None = None
    calls, ended = 0, count_ends(subject)

    def fails(case: Case) -> bool:
        nonlocal smallest, calls
        if count_ends(subject) - ended >= SHRINK_ENDS:
            return False
        calls += 1
        if count is not None:
            count(calls)
        outcome = judge.judge_case(question, case, subject)
        bad = badness(question.info, outcome)
        if bad[0] != goal.kind or bad < goal.least:
            return False
        smallest = outcome
        return True

    shrink(source, seed=sampling.key(question), examples=sampling.examples, first=goal.first, fails=fails)
    return smallest


def find_gap(
    result: Run, subjects: Sequence[Subject | NotLoaded], questions: Sequence[Property | NotLoaded], sampling: Sampling
) -> str:
    """Return what a run lacks, in words; empty if it has an outcome of every planned case.

    All is counted anew from the plan: a mistake of the jobs or of a row makes no run green that lacks an outcome.
    """
    names = {subject.name: subject for subject in subjects if isinstance(subject, Subject)}
    properties = {question.id: question for question in questions if isinstance(question, Property)}
    if gap := gap_of_rows(result, names, properties):
        return gap
    gaps = (_gap_of(row, names[row.formulation], properties[row.property_id], sampling) for row in result.rows)
    return next((gap for gap in gaps if gap), "")


def gap_of_rows(result: Run, names: Iterable[str], property_ids: Iterable[str]) -> str:
    """Return which row is missing, or there without a plan."""
    planned = Counter(product(names, property_ids))
    rows = Counter((row.formulation, row.property_id) for row in result.rows)
    wrong = (key for key in planned | rows if rows[key] != planned[key])
    return next((f"{' '.join(key)}: {rows[key]} rows instead of {planned[key]}" for key in wrong), "")


def _gap_of(row: Row, subject: Subject, question: Property, sampling: Sampling) -> str:
    question = question.for_traits(subject.traits)
    source = sampling.source(question)
    if question.refusal_of(subject) or question.needs - subject.provides or source is None:
        without_cases = row.verdict in (Verdict.NOT_APPLICABLE, Verdict.NOT_PROVIDED)
        return "" if without_cases else f"{row.formulation} {row.property_id}: {row.verdict}"
    count = sum(isinstance(outcome, Outcome) for outcome in row.outcomes)
    planned = _count_planned(question, source, sampling, count)
    if count != planned or not planned:
        return f"{row.formulation} {row.property_id}: outcomes of {count} of {planned} cases"
    if row.promise is False and row.witness is None:
        return f"{row.formulation} {row.property_id}: no outcome of its witness"
    return ""


def _count_planned(question: Property, source: CaseSource, sampling: Sampling, count: int) -> int:
    """Return the number of planned cases. A strategy that may have fewer than were wanted is drawn once more."""
    if isinstance(source, tuple):
        return len(source)
    if count == sampling.examples:
        return count
    return len(draw_cases(source, seed=sampling.key(question), examples=sampling.examples).cases)
