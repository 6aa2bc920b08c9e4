"""The recheck of stored outcomes: a random share of each row is judged again and compared with what is stored.

It tells how far a store, or the report of a stranger, can be believed. The share is drawn anew each time, not from the
seed of the run, so that it cannot be known beforehand.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import product
from math import ceil, isfinite
from random import SystemRandom

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.subject import Subject
from contactverif.run import judge
from contactverif.run.rows import OpenRow, draw_planned, open_row
from contactverif.run.scheduler import Job, Scheduler
from contactverif.run.store import WITNESS, Store
from contactverif.sampling import draw
from contactverif.sampling.draw import PlannedCases, Sampling

SHARE = 0.01  # The share of the cases of a row that is judged again, at least one case.
# On another machine two values agree that differ by at most their tolerance, or by this share of the larger one.
ROUNDOFF = 1e-6
_CHUNK = 25  # The number of cases that are judged in one job.


def choose_share(numbers: Sequence[int], share: float = SHARE) -> list[int]:
    """Return a random share of numbers, at least one of them."""
    return sorted(SystemRandom().sample(numbers, min(len(numbers), max(1, ceil(share * len(numbers))))))


@dataclass(frozen=True, slots=True)
class Sample:
    """The stored outcomes of a row that are judged again, by the number of the case; `WITNESS` is the witness."""

    row: OpenRow
    outcomes: Mapping[int, Outcome]
    words: dict[int, str] = field(default_factory=dict)  # How each differs that was judged again; empty if it does not.

    @property
    def differences(self) -> list[str]:
        """The cases that differ, and how; an outcome of a case that the run does not have is one of them."""
        names = {number: "the witness" if number == WITNESS else f"case {number}" for number in sorted(self.outcomes)}
        words = {number: self.words.get(number, "the run has no such case") for number in names}
        return [f"{name}: {words[number]}" for number, name in names.items() if words[number]]

    def note(self, numbers: Sequence[int], words: Sequence[str]) -> None:
        """Note how the outcomes of some cases differ."""
        self.words.update(zip(numbers, words, strict=True))


def judge_samples(samples: Sequence[Sample], sampling: Sampling, scheduler: Scheduler, *, exact: bool) -> None:
    """Judge samples again, and note in what they differ: bit for bit on the same machine, else up to roundoff."""

    def jobs() -> Iterator[Job]:
        groups: dict[tuple[str, bool], list[Sample]] = {}
        for sample in samples:
            named = dict(enumerate(sample.row.listed or ())) | {WITNESS: sample.row.witness}
            yield from judge_cases(sample, {n: case for n in sample.outcomes if (case := named.get(n)) is not None})
            if sample.row.listed is None and max(sample.outcomes, default=-1) >= 0:
                groups.setdefault(sampling.group(sample.row.question), []).append(sample)
        for group in groups.values():  # The first block comes first: where the engine draws, it has all cases.
            yield draw_block(group, 0)

    def draw_block(group: Sequence[Sample], number: int) -> Job:
        return Job(draw_planned, (sampling, group[0].row.question, number), partial(add_block, group, number))

    def add_block(group: Sequence[Sample], number: int, block: PlannedCases) -> Iterator[Job]:
        """Yield the jobs to judge cases of a block, and to draw all other blocks behind the first."""
        cases = dict(enumerate(block.cases, number * draw.BLOCK))
        for sample in group:
            yield from judge_cases(sample, {n: cases[n] for n in sample.outcomes if n in cases})
        if number == 0 and not block.last:
            others = {n // draw.BLOCK for sample in group for n in sample.outcomes if n >= len(cases)}
            yield from (draw_block(group, other) for other in sorted(others))

    def judge_cases(sample: Sample, cases: Mapping[int, Case]) -> Iterator[Job]:
        numbers = sorted(cases)
        for part in (numbers[first : first + _CHUNK] for first in range(0, len(numbers), _CHUNK)):
            pairs = [(cases[number], sample.outcomes[number]) for number in part]
            arguments = sample.row.question, sample.row.subject, pairs, exact
            yield Job(judge_again, arguments, partial(sample.note, part))

    scheduler.work(jobs())


def recheck_store(
    store: Store, subjects: Sequence[Subject], questions: Sequence[Property], sampling: Sampling, scheduler: Scheduler
) -> None:
    """Judge a share of the outcomes of a store again; where one differs, no stored outcome of its row counts."""
    if not store.n_outcomes:
        return
    samples: dict[tuple[str, str], Sample] = {}
    for subject, plain in product(subjects, questions):
        question, numbers = plain.for_traits(subject.traits), store.numbers(subject.name, plain.id)
        row = open_row(subject, question, sampling.source(question), "", sampling) if numbers else None
        if isinstance(row, OpenRow):
            stored = ((n, store.outcomes(subject.name, question.info, n, 1)) for n in choose_share(numbers))
            samples[subject.name, question.id] = Sample(row, {n: each[0] for n, each in stored if each})
    judge_samples([*samples.values()], sampling, scheduler, exact=store.same_machine)
    counts = {key: len(store.numbers(*key)) for key in samples}
    store.n_stored = sum(counts.values())
    store.n_rechecked = sum(len(sample.outcomes) for sample in samples.values())
    for key in sorted(key for key, sample in samples.items() if sample.differences):
        differences, n_again = samples[key].differences, len(samples[key].outcomes)
        store.n_rechecked += counts[key] - n_again
        words = f"{len(differences)} of {n_again} stored outcomes that were judged again differ, {differences[0]}"
        store.reject(*key, f"{' '.join(key)}: {words}; all {counts[key]} are judged again")


def judge_again(
    question: Property, subject: Subject, pairs: Sequence[tuple[Case, Outcome]], exact: bool
) -> tuple[str, ...]:
    """Judge cases again, and return in what each stored outcome differs; an empty string if it does not."""
    return tuple(find_difference(stored, judge.judge_case(question, case, subject), exact) for case, stored in pairs)


def find_difference(stored: Outcome, today: Outcome, exact: bool) -> str:
    """Return in what a stored outcome differs from one of today, in words; an empty string if in nothing.

    Without `exact` only verdicts, values, tolerances and the sizes of the case are compared, up to roundoff.
    """
    if stored.verdict is not today.verdict:
        return f"the verdict is {stored.verdict}, and again {today.verdict}"
    before, again = _facts_of(stored, words=exact), _facts_of(today, words=exact)
    numbers = today.measurement.numbers if today.measurement is not None else ()
    # Of a value that is at most so large, the tolerance bounds the roundoff.
    bounded = (number for number in numbers if number.quantity.sense == "at most" and isfinite(number.tolerance))
    bounds = {number.quantity.name: number.tolerance for number in bounded}
    for name in {**before, **again}:
        a, b = before.get(name), again.get(name)
        if exact or not (isinstance(a, float) and isinstance(b, float) and isfinite(a) and isfinite(b)):
            agrees = repr(a) == repr(b)
        else:
            agrees = abs(a - b) <= max(bounds.get(name, 0.0), ROUNDOFF * max(abs(a), abs(b)))
        if not agrees:
            return f"{name} is {a!r}, and again {b!r}"
    return ""


def _facts_of(outcome: Outcome, *, words: bool) -> dict[str, object]:
    """Return the judged numbers of an outcome; with `words` also its words, and the numbers that are not judged."""
    summary, measured = outcome.summary, outcome.measurement
    facts: dict[str, object] = {
        "number of slave segments": float(summary.n_slave_segments),
        "number of master segments": float(summary.n_master_segments),
        "penalty": summary.penalty,
        "largest coordinate": summary.largest_coordinate,
        "shortest segment": summary.shortest_segment,
    }
    facts |= {f"parameter {name}": float(value) for name, value in summary.parameters.items()}
    for number in measured.numbers if measured is not None else ():
        name = number.quantity.name
        facts |= {name: float(number.value), f"tolerance of {name}": float(number.tolerance)}
    if not words:
        return facts
    facts |= {"the case": f"{summary.name} {summary.kind}", "breach": str(outcome.breach)}
    if measured is not None or outcome.verdict is not Verdict.CRASHED:  # The words of a crash may have an address.
        facts["the reason"] = outcome.reason
    if measured is not None:
        facts |= {"undecided": measured.undecided, "broken": measured.broken}
        facts |= {"contact": str(not measured.idle), "the place": repr(measured.finding)}
        facts |= {f"detail {name}": repr(float(value)) for name, value in measured.details.items()}
        facts |= {f"series {name}": repr(list(map(float, values))) for name, values in measured.series.items()}
    return facts
