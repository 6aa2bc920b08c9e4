"""The rows of a run while their cases are judged, the jobs that judge and shrink them, and what their outcomes come to.

Jobs may end in any order, and a row does not depend on it. A row may have a million outcomes: the first stay whole, and
so do the first failures. Of all others the numbers stay, in one long array and without their meshes: all that a report
stores. An outcome is made of them again when it is read.
"""

from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, product
from math import sqrt

from contactverif.contract.case import Case, needs_of_place
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE
from contactverif.contract.property import FAILED, Outcome, Outcomes, Property, Verdict
from contactverif.contract.result import NOT_HERE, OF_TRAITS, OMITTED, NotLoaded, Row, Run
from contactverif.contract.subject import STATED_PARTS, Subject
from contactverif.contract.traits import RULES, traits_behind
from contactverif.isolation.lockstep import in_lockstep
from contactverif.isolation.remote import RemoteSubject, count_ends
from contactverif.problems.named_states import named_case
from contactverif.run import judge
from contactverif.run.judge import badness
from contactverif.run.scheduler import CaseChunk
from contactverif.run.store import Writer, decode_outcome, encode_outcome
from contactverif.sampling import draw
from contactverif.sampling.draw import CaseSource, PlannedCases, Sampling
from contactverif.sampling.hypothesis_draws import one_thread

WHOLE = 100  # The first outcomes of a row that stay as they are.
FAILURES = 100  # The failures behind them that stay as they are.
SHRINK_ENDS = 8  # A case that ends the process of the plugin is made smaller until it has ended so often.
CLEAR_RATIO = 1000.0  # A shrunk case need not fail by more than this many tolerances.


class RowOutcomes(Outcomes):
    """The outcomes of a row in order, of which the first `whole` stay as they are. `append` adds one."""

    def __init__(self, whole: int = WHOLE) -> None:
        self._n_whole = whole
        self._whole: dict[int, Outcome] = {}
        self._n_failures = 0
        self._forms: list[bytes] = []
        self._numbers_of_forms: dict[bytes, int] = {}
        self._form_of = array("l")
        self._starts = array("q", [0])
        self._numbers = array("d")

    def keeps_whole(self, number: int, outcome: Outcome) -> bool:
        """Return whether an outcome stays as it is if it gets this number; of failures the first few do."""
        failed = outcome.verdict in FAILED
        return number < self._n_whole or (failed and self._n_failures < FAILURES)

    def may_keep_whole(self, first: int, outcomes: Iterable[Outcome]) -> bool:
        """Return whether one of these outcomes may stay whole, if the first of them gets this number."""
        return any(self.keeps_whole(first, outcome) for outcome in outcomes)

    def append(self, outcome: Outcome, case: Case | None) -> None:
        """Add an outcome with the summary of its case; the case, if there is one, stays with one that stays whole."""
        number, form_number = len(self), -1
        if self.keeps_whole(number, outcome):
            self._n_failures += number >= self._n_whole
            self._whole[number] = outcome if case is None else replace(outcome, case_or_summary=case)
        else:
            form, numbers = encode_outcome(outcome)
            form_number = self._numbers_of_forms.setdefault(form, len(self._forms))
            if form_number == len(self._forms):
                self._forms.append(form)
            self._numbers.extend(numbers)
        self._form_of.append(form_number)
        self._starts.append(len(self._numbers))

    def __len__(self) -> int:
        return len(self._form_of)

    def __iter__(self) -> Iterator[Outcome]:
        return map(self.at, range(len(self)))  # That of a sequence asks for the length at each outcome.

    def at(self, number: int) -> Outcome:
        """Return an outcome, which is made of its numbers if it did not stay whole."""
        if number in self._whole:
            return self._whole[number]
        numbers = self._numbers[self._starts[number] : self._starts[number + 1]]
        return decode_outcome(self._forms[self._form_of[number]], numbers)


@dataclass(frozen=True, slots=True)
class Shrinking:
    """The goal of a search for the smallest case."""

    first: int  # The number of the first case that is bad enough.
    least: tuple[int, float]  # The badness that the smallest case must have: its kind, and the least size.


class OpenRow:
    """A formulation and a property whose cases are being judged: those of a strategy, or a finite list (`listed`).

    `row` is a row without outcomes until `judge` or `stop`.
    """

    def __init__(self, row: Row, subject: Subject, question: Property, listed: tuple[Case, ...] | None) -> None:
        self.row, self.subject, self.question, self.listed = row, subject, question, listed
        self.witness: Case | None = None  # The case with which the formulation proves that it fails.
        self.outcomes = RowOutcomes(WHOLE if listed is None else len(listed))
        self.planned = 0
        self.n_finished = 0
        self._expected: dict[int, CaseChunk | int] = {}
        self._all_drawn = False
        self._next = 0
        self._waiting: dict[int, Sequence[Outcome]] = {}
        self._witness_outcome: Outcome | None = None

    def expect(self, chunks: Mapping[int, CaseChunk | int], *, planned: int, last: bool) -> None:
        """Note chunks {first number: chunk} of a row with so many planned cases; `last` if no others follow.

        Of cases that are not drawn, since none of them stays whole, it is their number.
        """
        self._expected |= chunks
        self._all_drawn, self.planned = last, planned

    def add(self, first: int, outcomes: Sequence[Outcome]) -> None:
        """Add the outcomes of a chunk; those behind a chunk that is not finished wait."""
        chunk = self._expected[first]
        if len(outcomes) != (chunk if isinstance(chunk, int) else chunk.count):
            raise RuntimeError(f"{len(outcomes)} outcomes of a chunk with another number of cases")
        self.n_finished += len(outcomes)
        self._waiting[first] = outcomes
        while self._next in self._waiting:
            chunk, outcomes = self._expected.pop(self._next), self._waiting.pop(self._next)
            cases: Sequence[Case | None] = [None] * len(outcomes)
            if isinstance(chunk, CaseChunk) and self.outcomes.may_keep_whole(self._next, outcomes):
                cases = chunk.cases
            for outcome, case in zip(outcomes, cases, strict=True):
                self.outcomes.append(outcome, case)
            self._next += len(outcomes)

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
        """Return whether the witness is judged, or is among the planned cases; true without one, too."""
        return self.witness is None or self._witness_outcome is not None or self._place_of_witness is not None

    @property
    def _place_of_witness(self) -> int | None:
        return next((place for place, case in enumerate(self.listed or ()) if case is self.witness), None)

    @property
    def complete(self) -> bool:
        """Return whether all cases and the witness are judged."""
        return self._all_drawn and not self._expected and self.witnessed

    def judge(self, sampling: Sampling) -> None:
        """Make the row of the outcomes."""
        place = self._place_of_witness
        witness = self._witness_outcome if place is None else self.outcomes[place]
        self.row = judge_row(self._row_of(self.outcomes, self.planned, witness), self, sampling)

    def stop(self, examples: int, early: "OpenRow | None") -> None:
        """Make the row of a run, with so many random cases, that was stopped before all cases were judged.

        Those of the first round, which are in an `early` row, count as long as they are not judged again.
        """
        if early is not None and not len(self.outcomes):
            self.outcomes, self.n_finished = early.outcomes, self.n_finished + early.n_finished
        outcomes = tuple(chain(self.outcomes, *(self._waiting[first] for first in sorted(self._waiting))))
        planned = self.planned or (examples if self.listed is None else len(self.listed))
        stopped = f"stopped: {self.n_finished} of {planned} cases judged"
        stopped += ", the witness not yet" if self.n_finished == planned else ""
        row = self._row_of(outcomes, planned, self._witness_outcome)
        verdict, reason = judge.verdict_over_all(row)
        if verdict not in FAILED:
            verdict, reason = Verdict.NOT_JUDGED, stopped
        self.row = replace(row, verdict=verdict, reason=reason)

    def _row_of(self, outcomes: Sequence[Outcome], planned: int, witness: Outcome | None) -> Row:
        seconds = sum(outcome.seconds for outcome in outcomes)
        return replace(self.row, planned=planned, outcomes=outcomes, witness=witness, seconds=seconds)

    def goal(self) -> Shrinking | None:
        """Return what to shrink; None if no case failed.

        The smallest case crashes if something crashed, and breaks the contract if something did. Of failures by a
        number it must be a clear one, half-way on a logarithmic scale between the tolerance and the worst value: the
        smallest case that fails at all often fails by a hair, which convinces no reader.
        """
        badnesses = [badness(self.row.info, outcome) for outcome in self.outcomes]
        kind, worst = max(badnesses, default=(0, 0.0))
        if kind == 0:
            return None
        least = (kind, min(CLEAR_RATIO, sqrt(worst)) if kind == 1 else worst)  # No other kind is worse than the worst.
        return Shrinking(next(number for number, bad in enumerate(badnesses) if bad >= least), least)


def judge_row(row: Row, opened: OpenRow, sampling: Sampling) -> Row:
    """Return a row of which all cases are judged with its verdict and its reason."""
    verdict, reason = judge.verdict_over_all(row)
    if verdict is Verdict.PASS and row.promise is False and sampling.interface is not None:
        row = replace(row, promise=None)  # It states that it fails somewhere, not that it does so here.
    is_open = (
        verdict in (Verdict.NOT_JUDGED, Verdict.UNDECIDED) and not reason.startswith(judge.RAISED) and not row.judged
    )
    if is_open and opened.question.bodies and sampling.scene is not None and len(row.outcomes) > 0:
        # No formulation promises that the one scene of a user can be decided: it may have no solution.
        verdict, reason = Verdict.UNDECIDED, row.outcomes[0].reason or reason
    return replace(row, verdict=verdict, reason=reason)


def open_row(
    subject: Subject, question: Property, source: CaseSource | None, known: str, sampling: Sampling, stopped: str = ""
) -> OpenRow | Row:
    """Return a row whose cases are to be judged, or the row itself if there is nothing to judge.

    `stopped` says why the formulation is asked nothing more; it is empty if all is asked. Then only a missing witness
    is reported.
    """
    promise = question.promise(subject.traits)
    traits = traits_behind(question.promise, subject.traits) if promise else {}
    # Of a table, its name says enough.
    stated = {name: value for name, value in traits.items() if value is not False} or traits
    words = ", ".join(name if isinstance(value, Mapping) else f"{name}={value!r}" for name, value in stated.items())
    if stated and stated.keys() <= RULES:  # No author calls a rule a promise, and a question may follow from it.
        words = f"the rule{'s' * (len(stated) > 1)} {words}"
    row = Row(subject.name, question.info, Verdict.PASS, promise=promise, promised_by=words, known=known)
    if reason := question.refusal_of(subject):
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason=reason)
    if missing := question.needs - subject.provides:
        reason = f"{', '.join(sorted(missing))}: not provided"
        promise = promise if missing & STATED_PARTS else None
        return replace(row, verdict=Verdict.NOT_PROVIDED, promise=promise, reason=reason)
    if source is None:
        needs = "elastic bodies" if question.bodies and sampling.scene is None else needs_of_place(question.cases)
        return replace(row, verdict=Verdict.NOT_APPLICABLE, reason=f"{NOT_HERE}{needs}")
    if promise is False and question.shown_by - subject.provides:  # It fails where it reports what shows it.
        row = replace(row, promise=None)
    opened = OpenRow(row, subject, question, source if isinstance(source, tuple) else None)
    try:
        # On the user's mesh or scene every number is of that.
        if row.promise is False and sampling.interface is None:
            opened.witness = find_witness(subject, question, opened.listed or ())
    except MisuseError as error:
        return replace(row, verdict=Verdict.CRASHED, reason=f"{OF_TRAITS}{error}")
    return replace(row, verdict=Verdict.NOT_JUDGED, reason=f"{OMITTED}{stopped}") if stopped else opened


def lacks_witness(subject: Subject, question: Property, sampling: Sampling) -> bool:
    """Return whether a formulation states that it fails, and names no case that shows so, where it is asked for one."""
    if question.refusal_of(subject) or (question.needs | question.shown_by) - subject.provides:
        return False
    stated = question.promise(subject.traits) is False and sampling.interface is None
    return stated and subject.traits.witness(question.id) is None


def row_of_case(question: Property, subject: Subject, outcome: Outcome) -> Row:
    """Return the row of a case that failed in an earlier run, alone."""
    promise = question.promise(subject.traits)
    return Row(subject.name, question.info, outcome.verdict, promise, reason=outcome.reason, witness=outcome)


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
        if question.bodies:
            # The catalogue imports bodies and Newton's method, so it is imported only where it is needed.
            from contactverif.problems.catalogue import load_scene_case

            return load_scene_case(name)
        case = named_case(name)
        if case.interface.dim not in subject.traits.abilities.dimensions:
            words = f"{name!r}, whose interface has {case.interface.dim} coordinates"
            raise MisuseError("name", words, f"one that {subject.name} takes by its trait dimensions")
        corners = {side.faces.shape[1] for side in (case.interface.slave, case.interface.master)}
        if case.interface.dim != PLANE and not corners <= {*subject.traits.abilities.faces}:
            words = f"{name!r}, whose faces have {max(corners)} corners"
            raise MisuseError("name", words, f"one that {subject.name} takes by its trait faces")
    except MisuseError as error:
        listed_names = f"a case of {question.id} ({'; '.join(case.name for case in listed)}), or " if listed else ""
        raise MisuseError(f"witness of {question.id}", error.found, f"{listed_names}{error.needed}") from None
    return case


def judge_cases(
    question: Property,
    subject: Subject,
    chunk: CaseChunk,
    writer: Writer | None,
    stored: Mapping[int, Outcome],
    count: Callable[[int], None] | None = None,
) -> tuple[tuple[Outcome, ...], str]:
    """Judge the cases of a chunk but for those at the places of `stored`, and store each outcome at once.

    Return all outcomes, which hold summaries because the parent has the cases, and what kept this process from storing.
    """
    outcomes: list[Outcome] = []
    cases = dict(enumerate(chunk.cases))
    together = _judge_together(question, subject, {n: case for n, case in cases.items() if n not in stored})
    for place, case in cases.items():
        if place in stored:
            outcomes.append(stored[place])
            continue
        outcome = together.get(place) or judge.judge_case(question, case, subject)
        outcomes.append(replace(outcome, case_or_summary=outcome.summary))
        if writer is not None:
            writer.add(place, outcomes[-1])
        if count is not None:
            count(place + 1)
    return tuple(outcomes), writer.file.write_error if writer is not None else ""


def _judge_together(question: Property, subject: Subject, cases: Mapping[int, Case]) -> dict[int, Outcome]:
    """Return {place: outcome} of cases in lockstep, which saves messages; a failure nobody stated is judged alone."""
    if not isinstance(subject, RemoteSubject) or len(cases) < 2 or count_ends(subject):
        return {}
    stated = question.promise(subject.traits) is False

    def counts(outcome: Outcome) -> bool:
        return outcome.measurement is not None and (stated or outcome.verdict is not Verdict.FAIL)

    (first, case), *others = cases.items()
    judged_here = {first: judge.judge_case(question, case, subject)}
    if counts(judged_here[first]):
        with one_thread():  # It ends behind all cases: one that ends before another must not let BLAS have more.
            judged = in_lockstep([partial(judge.judge_case, question, case, subject) for _, case in others])
        for (place, _), (outcome, seconds) in zip(others, judged or (), strict=judged is not None):
            if counts(outcome):
                judged_here[place] = replace(outcome, seconds=seconds)
    return judged_here


def shrink_case(
    sampling: Sampling,
    question: Property,
    subject: Subject,
    goal: Shrinking,
    count: Callable[[int], None] | None = None,
) -> Outcome | None:
    """Return the outcome of the smallest case that is bad enough; None if the search judged none."""
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
        if bad[0] != goal.least[0] or bad < goal.least:
            return False
        smallest = outcome
        return True

    draw.shrink(*sampling.plan(question), first=goal.first, fails=fails)
    return smallest


# What is planned, and what is missing of it


def draw_planned(
    sampling: Sampling, question: Property, number: int, count: Callable[[int], None] | None = None
) -> PlannedCases:
    """Draw a block of the cases of a property, and of all properties with the same strategy."""
    return draw.draw_block(*sampling.plan(question), number=number, progress=count)


def find_missing_cases(row: Row, listed: Sequence[Case] | None, question: Property, sampling: Sampling) -> str:
    """Return which outcomes a row lacks, or has beyond the plan; no more than one block of cases is drawn for it."""
    count = len(row.outcomes)
    planned = count if listed is None else len(listed)
    if listed is None and count != sampling.examples:  # A strategy may have fewer cases than were wanted.
        number = min(count, sampling.examples - 1) // draw.BLOCK
        number = number if draw.draws_blocks(*sampling.plan(question)) else 0
        block = draw_planned(sampling, question, number)
        planned = number * draw.BLOCK + len(block.cases) if block.last else sampling.examples
    missing = "" if count == planned > 0 else f"outcomes of {count} of {planned} cases"
    if not missing and row.promise is False and row.witness is None and sampling.interface is None:
        missing = "no outcome of its witness"
    return f"{row.formulation} {row.property_id}: {missing}" if missing else ""


def find_missing(
    result: Run, subjects: Sequence[Subject | NotLoaded], questions: Sequence[Property | NotLoaded], sampling: Sampling
) -> str:
    """Return what a run lacks, in words; empty if it has an outcome of every planned case.

    All is counted anew from the plan: a mistake of the jobs or of a row makes no run green that lacks an outcome.
    """
    names = {subject.name: subject for subject in subjects if isinstance(subject, Subject)}
    properties = {question.id: question for question in questions if isinstance(question, Property)}
    missing = find_missing_row(result, names, properties)
    for row in () if missing else result.rows:
        subject = names[row.formulation]
        question = properties[row.property_id].for_traits(subject.traits)
        source = sampling.source(question)
        if question.refusal_of(subject) or question.needs - subject.provides or source is None:
            if row.verdict not in (Verdict.NOT_APPLICABLE, Verdict.NOT_PROVIDED):
                missing = f"{row.formulation} {row.property_id}: {row.verdict}"
        else:
            missing = find_missing_cases(row, source if isinstance(source, tuple) else None, question, sampling)
        if missing:
            break
    return missing


def find_missing_row(result: Run, names: Iterable[str], property_ids: Iterable[str]) -> str:
    """Return which row is missing, or there without a plan."""
    planned = Counter(product(names, property_ids))
    rows = Counter((row.formulation, row.property_id) for row in result.rows)
    wrong = next((key for key in planned | rows if rows[key] != planned[key]), None)
    return "" if wrong is None else f"{' '.join(wrong)}: {rows[wrong]} rows instead of {planned[wrong]}"
