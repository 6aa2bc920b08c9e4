"""The recheck of stored outcomes: a random share of each row is judged again and compared with what is stored.

It tells how far a store, or the report of a stranger, can be believed. The share is drawn anew each time, not from the
seed of the run, so that it cannot be known beforehand.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain, groupby, product
from math import ceil, isfinite
from random import SystemRandom
from typing import NamedTuple

from contactverif.contract.case import Case
from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.subject import Subject
from contactverif.run import judge
from contactverif.run.rows import OpenRow, open_row
from contactverif.run.scheduler import Job, Scheduler
from contactverif.run.store import WITNESS, Store
from contactverif.sampling import draw
from contactverif.sampling.draw import PlannedCases, Sampling

SHARE = 0.01  # The share of the cases of a row that is judged again, at least one case.
# On another machine two values agree that differ by at most their tolerance, or by this share of the larger one.
ROUNDOFF = 1e-6
_CHUNK = 25  # The number of cases that are judged in one job.
_NO_CASE = "the run has no such case"


def choose_share(numbers: Sequence[int], share: float = SHARE) -> list[int]:
    """Return a random share of numbers, at least one of them."""
    return sorted(SystemRandom().sample(numbers, min(len(numbers), max(1, ceil(share * len(numbers))))))


class Difference(NamedTuple):
    """A stored outcome that is not what is judged today."""

    formulation: str
    property_id: str
    number: int
    words: str  # The case and how it differs.


@dataclass(frozen=True, slots=True)
class Sample:
    """The stored outcomes of a row that are judged again, by the number of the case; `WITNESS` is the witness."""

    subject: Subject
    question: Property
    outcomes: Mapping[int, Outcome]
    cases: Mapping[int, Case]  # Those that need not be drawn: a finite list, and the witness.
    is_random: bool

    @classmethod
    def of_row(cls, row: OpenRow, outcomes: Mapping[int, Outcome]) -> Sample:
        """Return the sample of a row."""
        named = dict(enumerate(row.listed or ())) | ({} if row.witness is None else {WITNESS: row.witness})
        cases = {number: named[number] for number in outcomes if number in named}
        return cls(row.subject, row.question, outcomes, cases, row.listed is None)

    def keys(self, numbers: Iterable[int]) -> list[tuple[str, str, int]]:
        """Return formulation, property and number of some cases."""
        return [(self.subject.name, self.question.id, number) for number in numbers]

    @property
    def missing(self) -> set[int]:
        """The numbers of the cases that are to be drawn."""
        return self.outcomes.keys() - self.cases.keys()


class Recheck:
    """The jobs that judge samples again. `differences` and `n_judged` are complete when all are done.

    Numbers are compared bit for bit on the same machine (`exact`), else up to roundoff.
    """

    def __init__(self, samples: Sequence[Sample], sampling: Sampling, *, exact: bool) -> None:
        self.n_judged = 0
        self._samples, self._sampling, self._exact = samples, sampling, exact
        self._words: dict[tuple[str, str, int], str] = {}  # By formulation, property and case.

    @property
    def differences(self) -> list[Difference]:
        """The outcomes that differ; an outcome of a case that the run does not have is one of them."""
        keys = chain.from_iterable(sample.keys(sorted(sample.outcomes)) for sample in self._samples)
        differences = ((key, self._words.get(key, _NO_CASE)) for key in keys)
        names = ((key, "the witness" if key[2] == WITNESS else f"case {key[2]}", words) for key, words in differences)
        return [Difference(*key, f"{name}: {words}") for key, name, words in names if words]

    def __iter__(self) -> Iterator[Job]:
        groups: dict[tuple[str, bool], list[Sample]] = {}
        for sample in self._samples:
            yield from self._judge(sample, sample.cases)
            if sample.is_random and max(sample.missing, default=-1) >= 0:
                groups.setdefault(self._sampling.group(sample.question), []).append(sample)
        for group in groups.values():  # The first block comes first: where the engine draws, it has all cases.
            yield self._draw(group, 0)

    def _draw(self, group: Sequence[Sample], number: int) -> Job:
        return Job(draw_planned, (self._sampling, group[0].question, number), partial(self._add_drawn, group, number))

    def _add_drawn(self, group: Sequence[Sample], number: int, block: PlannedCases) -> Iterator[Job]:
        """Yield the jobs to judge cases of a block, and to draw all other blocks behind the first."""
        first, count = number * draw.BLOCK, len(block.cases)
        for sample in group:
            yield from self._judge(
                sample, {n: block.cases[n - first] for n in sample.missing if 0 <= n - first < count}
            )
        if number == 0 and not block.last:
            others = {n // draw.BLOCK for sample in group for n in sample.missing if n >= count}
            yield from (self._draw(group, other) for other in sorted(others))

    def _judge(self, sample: Sample, cases: Mapping[int, Case]) -> Iterator[Job]:
        numbers = sorted(cases)
        for first in range(0, len(numbers), _CHUNK):
            part = numbers[first : first + _CHUNK]
            pairs = [(cases[number], sample.outcomes[number]) for number in part]
            arguments = sample.question, sample.subject, pairs, self._exact
            yield Job(judge_again, arguments, partial(self._add_judged, sample, part))

    def _add_judged(self, sample: Sample, numbers: Sequence[int], words: Sequence[str]) -> None:
        self.n_judged += len(numbers)
        self._words |= dict(zip(sample.keys(numbers), words, strict=True))


def recheck_store(
    store: Store, subjects: Sequence[Subject], questions: Sequence[Property], sampling: Sampling, scheduler: Scheduler
) -> None:
    """Judge a share of the outcomes of a store again; where one differs, no stored outcome of its row counts."""
    if not store.n_outcomes:
        return
    samples, counts = [], dict[tuple[str, str], tuple[int, int]]()
    for subject, plain in product(subjects, questions):
        question, numbers = plain.for_traits(subject.traits), store.numbers(subject.name, plain.id)
        row = open_row(subject, question, sampling.source(question), "", sampling) if numbers else None
        if isinstance(row, OpenRow):
            numbers_again = choose_share(numbers)
            stored = (store.outcomes(subject.name, question.info, number, 1) for number in numbers_again)
            outcomes = {number: each[0] for number, each in zip(numbers_again, stored, strict=True) if each}
            samples.append(Sample.of_row(row, outcomes))
            counts[subject.name, question.id] = len(numbers), len(outcomes)
    recheck = Recheck(samples, sampling, exact=store.same_machine)
    scheduler.work(recheck)
    store.n_stored = sum(count for count, _ in counts.values())
    store.n_rechecked = sum(count for _, count in counts.values())
    for (formulation, property_id), differences in groupby(sorted(recheck.differences), key=lambda entry: entry[:2]):
        first, *others = differences
        count, n_again = counts[formulation, property_id]
        store.n_rechecked += count - n_again
        words = f"{1 + len(others)} of {n_again} stored outcomes that were judged again differ, {first.words}"
        store.reject(formulation, property_id, f"{formulation} {property_id}: {words}; all {count} are judged again")


def draw_planned(
    sampling: Sampling, question: Property, number: int, count: Callable[[int], None] | None = None
) -> PlannedCases:
    """Draw a block of the cases of a property, and of all properties with the same strategy."""
    source, seed = sampling.source(question), sampling.key(question)
    assert source is not None
    return draw.draw_block(source, seed=seed, examples=sampling.examples, number=number, progress=count)


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
    before, again = (_numbers_of(each) | (_words_of(each) if exact else {}) for each in (stored, today))
    bounds = {} if exact else _bounds_of(today)
    for name in {**before, **again}:
        a, b = before.get(name), again.get(name)
        if repr(a) != repr(b) and (exact or not _agree(a, b, bounds.get(name, 0.0))):
            return f"{name} is {a!r}, and again {b!r}"
    return ""


def _agree(a: object, b: object, bound: float) -> bool:
    if not (isinstance(a, float) and isinstance(b, float) and isfinite(a) and isfinite(b)):
        return False
    return abs(a - b) <= max(bound, ROUNDOFF * max(abs(a), abs(b)))


def _bounds_of(outcome: Outcome) -> dict[str, float]:
    """Return {name: tolerance} of the values that are at most so large; it bounds the roundoff of the value."""
    numbers = outcome.measurement.numbers if outcome.measurement is not None else ()
    bounded = (number for number in numbers if number.quantity.sense == "at most" and isfinite(number.tolerance))
    return {number.quantity.name: number.tolerance for number in bounded}


def _numbers_of(outcome: Outcome) -> dict[str, object]:
    summary = outcome.summary
    entries: dict[str, object] = {
        "number of slave segments": float(summary.n_slave_segments),
        "number of master segments": float(summary.n_master_segments),
        "penalty": summary.penalty,
        "largest coordinate": summary.largest_coordinate,
        "shortest segment": summary.shortest_segment,
    }
    entries |= {f"parameter {name}": float(value) for name, value in summary.parameters.items()}
    for number in outcome.measurement.numbers if outcome.measurement is not None else ():
        name = number.quantity.name
        entries |= {name: float(number.value), f"tolerance of {name}": float(number.tolerance)}
    return entries


def _words_of(outcome: Outcome) -> dict[str, object]:
    """Return the words of an outcome, and the numbers that are not judged. Those of a crash may have an address."""
    entries: dict[str, object] = {
        "the case": f"{outcome.summary.name} {outcome.summary.kind}",
        "breach": str(outcome.breach),
    }
    measured = outcome.measurement
    if measured is None:
        return entries | ({} if outcome.verdict is Verdict.CRASHED else {"the reason": outcome.reason})
    entries |= {"the reason": outcome.reason, "undecided": measured.undecided, "broken": measured.broken}
    entries |= {"contact": str(not measured.idle), "the place": repr(measured.finding)}
    entries |= {f"detail {name}": repr(float(value)) for name, value in measured.details.items()}
    return entries | {f"series {name}": repr(list(map(float, values))) for name, values in measured.series.items()}
