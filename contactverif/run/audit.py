"""The audit of a stored run: each verdict follows again from its numbers, and a share of the cases is judged again."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cache
from time import perf_counter

from contactverif.contract.case import Case
from contactverif.contract.counterexample import Counterexample, Origin, counterexamples
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Outcome, Outcomes, Property, PropertyInfo, judge_stored
from contactverif.contract.result import OMITTED, Row, Run
from contactverif.contract.subject import Subject
from contactverif.plugins.provenance import CODE, code_digests, collect_versions, machine
from contactverif.plugins.registry import files_within
from contactverif.run.recheck import Sample, choose_share, judge_again, judge_samples
from contactverif.run.rows import OpenRow, find_missing_cases, find_missing_row, judge_row, open_row
from contactverif.run.run import Driver
from contactverif.run.scheduler import Scheduler
from contactverif.run.store import WITNESS, Store
from contactverif.sampling.draw import Sampling


@dataclass(frozen=True, slots=True, eq=False)
class Audit:
    """The result of an audit."""

    derived: Run  # The run as it follows from the stored numbers and from what the formulations state today.
    changes: tuple[str, ...]  # Versions, digests of code and parts of the machine that are others than in the run.
    differences: tuple[str, ...]  # What disagrees with the stored run, a line each.
    n_outcomes: int  # The number of stored outcomes, and of those that were judged again.
    n_judged: int
    n_examples: int  # The number of witnesses and counterexamples, all of which were judged again.
    seconds: float

    def chance(self, n_forged: int) -> float:
        """Return the probability that the audit met one of so many outcomes at random places."""
        missed, n_rest = 1.0, self.n_outcomes - self.n_judged
        for number in range(n_forged):
            missed *= max(n_rest - number, 0) / (self.n_outcomes - number)
        return 1.0 - missed


def audit(
    run: Run, subjects: Sequence[Subject], questions: Sequence[Property], sampling: Sampling, share: float
) -> Audit:
    """Derive all verdicts of a stored run again, and judge a share of each row and all counterexamples again.

    The formulations and the properties are those of its rows, and the sampling has its size, its seed and its place.
    """
    start = perf_counter()
    digests = code_digests(run.formulations, list(run.properties))
    today = collect_versions() | machine() | {name.replace(" ", "_"): digest for name, digest in digests.items()}
    recorded = {name: run.provenance.get(name, "unknown") for name in today}
    changed = [name for name in today if recorded[name] != today[name]]
    changes = tuple(f"{name}: {recorded[name]} in the report, {today[name]} here" for name in changed)
    subject_of = {subject.name: subject for subject in subjects}
    question_of = {question.id: question for question in questions}
    source_of = cache(sampling.source)
    rows: list[OpenRow | Row] = []
    derived, samples = [], []
    for row in run.rows:
        subject = subject_of[row.formulation]
        question = question_of[row.property_id].for_traits(subject.traits)
        stopped = row.reason.removeprefix(OMITTED) if row.omitted else ""
        opened = open_row(subject, question, source_of(question), row.known, sampling, stopped)
        rows.append(opened)
        derived.append(_derive(row, opened, sampling))
        if isinstance(opened, OpenRow):
            numbers = choose_share(range(len(row.outcomes)), share)
            outcomes = {number: derived[-1].outcomes[number] for number in numbers}
            # A failure of an earlier run is judged as a counterexample: nothing but the report says what its case is.
            if opened.witness is not None and derived[-1].witness is not None:
                outcomes[WITNESS] = derived[-1].witness
            samples.append(Sample(opened, outcomes))
    scheduler = Scheduler()
    driver = Driver(subjects, questions, sampling, scheduler, Store())
    driver.call_first()
    judge_samples(samples, sampling, scheduler, exact=not changes)
    differences = [find_missing_row(run, subject_of, question_of)]
    differences += [_other_property(row, opened, bool(changes)) for row, opened in zip(run.rows, rows, strict=True)]
    for row, opened in zip(derived, rows, strict=True):
        if isinstance(opened, OpenRow):
            differences.append(find_missing_cases(row, opened.listed, opened.question, sampling))
    for sample in samples:
        differences += [f"{sample.row.subject.name} {sample.row.question.id}: {words}" for words in sample.differences]
    examples = list(counterexamples(run).values())
    for example in examples:
        subject, question = subject_of[example.formulation], question_of[example.property_id]
        words = "the property is not asked of the formulation"
        if not question.refusal_of(subject) and not question.needs - subject.provides:
            (words,) = judge_again(question, subject, [(example.case, example.outcome)], not changes)
        differences.append(f"{example.id}: {words}" if words else "")
    opened_of = dict(zip(run.rows, rows, strict=True))
    if not changes:
        differences += [_other_case(example, opened_of[example.row]) for example in examples]
    n_witnesses = sum(WITNESS in sample.outcomes for sample in samples)
    return Audit(
        derived=replace(run, rows=tuple(derived), provided=driver.provided, opposite_signs=driver.opposite_signs),
        changes=changes,
        differences=tuple(filter(None, differences)),
        n_outcomes=sum(len(row.outcomes) for row in run.rows),
        n_judged=sum(len(sample.words) for sample in samples) - n_witnesses,
        n_examples=len(examples) + n_witnesses,
        seconds=perf_counter() - start,
    )


def check_libraries(run: Run) -> None:
    """Check that the libraries that a run names are those with which it was judged; no other one is loaded."""
    today = code_digests(run.formulations, ())
    for name in sorted({f"{CODE}{path.name}" for text in run.formulations for path in files_within(text)}):
        stored = run.provenance.get(name.replace(" ", "_"), today[name])
        if stored != today[name]:
            needed = "the library with which it was judged"
            raise MisuseError("REPORT", f"{name}: {stored} in the report and {today[name]} here", needed)


class DerivedOutcomes(Outcomes):
    """The outcomes of a row with the verdicts that follow from their numbers."""

    def __init__(self, info: PropertyInfo, outcomes: Sequence[Outcome]) -> None:
        self._info, self._outcomes = info, outcomes

    def __len__(self) -> int:
        return len(self._outcomes)

    def at(self, number: int) -> Outcome:
        """Return an outcome with the verdict of today."""
        return judge_stored(self._info, self._outcomes[number])


def _derive(row: Row, opened: OpenRow | Row, sampling: Sampling) -> Row:
    if isinstance(opened, Row):
        return replace(opened, info=row.info, seconds=row.seconds)
    outcomes = DerivedOutcomes(row.info, row.outcomes)
    witness, shrunk, first = (each and judge_stored(row.info, each) for each in (row.witness, row.shrunk, row.first))
    derived = replace(row, promise=opened.row.promise, outcomes=outcomes, planned=len(outcomes))
    return judge_row(replace(derived, witness=witness, shrunk=shrunk, first=first), opened, sampling)


def _other_property(row: Row, opened: OpenRow | Row, other_version: bool) -> str:
    info = (opened if isinstance(opened, Row) else opened.row).info
    judged = ("id", "needs", "least_contact", "usual_undecided", "quantities")
    for name in judged if other_version else tuple(part.name for part in fields(PropertyInfo)):
        stored, today = getattr(row.info, name), getattr(info, name)
        if name == "quantities" and other_version:
            stored, today = ([(each.name, each.unit, each.sense) for each in every] for every in (stored, today))
        if stored != today:
            return f"{row.formulation} {row.property_id}: {name} of the property are others than those of today"
    return ""


def _other_case(example: Counterexample, opened: OpenRow | Row) -> str:
    """Return whether a stored case with a name is another one than that of today, which measures what it measured."""

    def bytes_of(case: Case) -> dict[str, tuple[str, bytes]]:
        return {name: (str(array.shape), array.tobytes()) for name, array in case.to_arrays().items()}

    if isinstance(opened, Row):
        return ""
    named = [opened.witness] if example.origin is Origin.WITNESS else list(opened.listed or ())
    today = next((each for each in named if each is not None and each.name == example.case.name), None)
    same = today is None or bytes_of(example.case) == bytes_of(today)
    return "" if same else f"{example.id}: its mesh is not that of {example.case.name} today"
