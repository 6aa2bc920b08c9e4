"""The driver of a run: it checks every property of some formulations.

Each formulation is called once before anything else. A first round asks cheap properties about a few cases, so that a
person who waits sees what is wrong within seconds. Then the cases of a strategy are drawn once for all formulations and
all properties that have it, they are judged, and what failed is shrunk. Properties that solve bodies come last. All
planned cases of a row are judged before one is shrunk, so that a failure ends nothing early. What the store or the
first round has is not judged again, and a block is not drawn if the store has all of it.
"""

from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import chain, islice, product
from operator import attrgetter
from time import perf_counter
from typing import Literal, TypeVar, get_args

from contactverif.contract.case import Case
from contactverif.contract.counterexample import counterexample_of
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE, SEGMENT, Interface
from contactverif.contract.property import LAST_TURN, Outcome, Property, Verdict
from contactverif.contract.result import OPPOSITE_SIGN, NodalForces, NotLoaded, Result, Row, Run
from contactverif.contract.subject import OPTIONAL_PARTS, EngineSubject, Subject
from contactverif.contract.traits import Traits
from contactverif.diagnosis.diagnose import diagnose
from contactverif.isolation.remote import has_process, in_one_process, places
from contactverif.plugins.provenance import collect_provenance
from contactverif.plugins.registry import files_within, unknown_property_error
from contactverif.run import judge
from contactverif.run.failure_memory import Failures
from contactverif.run.ranking import first_failure, wrong_rows
from contactverif.run.recheck import recheck_store
from contactverif.run.rows import (
    WHOLE,
    OpenRow,
    draw_planned,
    judge_cases,
    lacks_witness,
    open_row,
    row_of_case,
    shrink_case,
)
from contactverif.run.run_options import FIRST_CASES, Profile, Shrink, profile_named
from contactverif.run.scheduler import CaseChunk, Job, Phase, Progress, RunProgress, Scheduler, in_words
from contactverif.run.store import WITNESS, Store
from contactverif.sampling import draw
from contactverif.sampling.draw import BLOCK, SHRINK_CALLS, PlannedCases, Sampling

CHUNK = 25  # The number of drawn cases that are judged in one job.
LIST_CHUNK = 5  # The same for named cases, which are often slower.
_FACE_NAMES = {2: "segments in the plane", 3: "triangles in space", 4: "quadrilaterals in space"}
_Kind = TypeVar("_Kind")
Stop = Literal["never", "foundation", "failure"]
_Key = tuple[str, str]  # A formulation, and the id of a property.


class RunStopped(KeyboardInterrupt):
    """The user has stopped a run: a row that is not complete is not judged, unless one of its cases fails."""

    def __init__(self, run: Run) -> None:
        super().__init__("the run was stopped")
        self.run = run


def run(
    subjects: Sequence[Subject | NotLoaded],
    properties: Sequence[Property | NotLoaded],
    *,
    profile: Profile | str = "dev",
    examples: int | None = None,
    seed: int | None = None,
    place: Interface | Case | None = None,
    known: Mapping[str, str] | None = None,
    shrink: Shrink = "new",
    progress: Callable[[Progress], None] | None = None,
    executor: Executor | None = None,
    store: Store | None = None,
    stop: Stop = "never",
) -> Run:
    """Check every property of every formulation, and return a row for each of both.

    Subjects and properties are as the registry loads them: one that did not load is reported and fails the run.
    `examples` and `seed` overrule those of the profile. A formulation is asked nothing more if the first rows show that
    it is wrong altogether (`stop` "foundation"), or all are once any row is wrong ("failure"). The other options are
    those of `contactverif.verify`.
    `progress` is called after every case, with an executor after every job. The executor may be any whose workers are
    processes, such as one of loky or dask; None for this process. The results are the same but for seconds.

    A MisuseError says that a known failure names no property of this run, a name stands there twice, or `shrink` is
    another word, and a WorkerError that a worker process died. If the user presses Ctrl-C, it is a `RunStopped`: a
    `KeyboardInterrupt` with the rows as far as they are judged.
    """
    check_known(known or {}, properties)
    if shrink not in get_args(Shrink):
        raise MisuseError("shrink", repr(shrink), "one, new, all or none")
    resolved = (profile_named(profile) if isinstance(profile, str) else profile).resolve(examples=examples, seed=seed)
    assert resolved.seed is not None
    loaded = _of_kind(Subject, subjects)
    alone = loaded[0] if len(loaded) == 1 and has_process(loaded[0]) else None
    driver = Driver(
        loaded,
        _of_kind(Property, properties),
        Sampling.at(place, resolved.examples, resolved.seed),
        Scheduler(executor, progress, subject=alone),
        store or Store(),
        known=known,
        shrink=shrink,
        stop=stop,
    )
    not_loaded = tuple(_of_kind(NotLoaded, (*subjects, *properties)))
    try:
        driver.work()
    except KeyboardInterrupt:
        raise RunStopped(driver.result(not_loaded, resolved.name)) from None
    return driver.result(not_loaded, resolved.name)


def _of_kind(kind: type[_Kind], items: Iterable[object]) -> list[_Kind]:
    return [item for item in items if isinstance(item, kind)]


def check_known(known: Mapping[str, str], properties: Sequence[Property | NotLoaded]) -> None:
    """Check that each known failure is that of a property of the run."""
    ids = [item.id if isinstance(item, Property) else item.formulation for item in properties]
    for property_id in known:
        if property_id not in ids:
            raise unknown_property_error("known failure", property_id, ids)


def run_failures(
    items: Sequence[Subject | Property | NotLoaded], failures: Failures, provenance: Mapping[str, str]
) -> Run:
    """Judge the cases that failed in earlier runs, and nothing else: return a row for each."""
    subjects = {subject.name: subject for subject in _of_kind(Subject, items)}
    questions = {question.id: question for question in _of_kind(Property, items)}
    triples = (
        (questions[property_id], case, subjects[name])
        for (name, property_id), case in failures.items()
        if name in subjects and property_id in questions
    )
    rows = (row_of_case(triple[0], triple[2], judge.judge_if_applicable(*triple)) for triple in triples)
    return Run(tuple(rows), tuple(_of_kind(NotLoaded, items)), provenance=provenance)


class Driver:
    """The jobs of a run, in the order that all shares of it have in common.

    The parts of a run are numbered: each witness, each chunk of a finite list, each block of drawn cases. Of `share`
    (I, N) are every N-th of them. A share fills no rows and shrinks nothing: its outcomes are in the store.
    """

    def __init__(
        self,
        subjects: Sequence[Subject],
        questions: Sequence[Property],
        sampling: Sampling,
        scheduler: Scheduler,
        store: Store,
        *,
        known: Mapping[str, str] | None = None,
        share: tuple[int, int] | None = None,
        shrink: Shrink = "new",
        stop: Stop = "never",
    ) -> None:
        _check_once("formulation", map(attrgetter("name"), subjects))
        _check_once("property", map(attrgetter("id"), questions))
        for subject in subjects:
            _check_place(subject, sampling.interface)
        self._subjects, self._questions, self._sampling, self._store = subjects, questions, sampling, store
        self._scheduler, self._report = scheduler, scheduler.report
        self._known = known or {}
        self._share, self._shrink, self._stop = share, shrink, stop
        self._rows: dict[_Key, OpenRow | Row] = {}
        self._first_calls: dict[str, float] = {}  # {formulation: seconds of a pairing and a residual}
        self._first: dict[_Key, OpenRow] = {}  # The rows of the first round, with a few of their cases.
        self._first_wrong: dict[_Key, Row] = {}  # What fails in it, or again.
        self._whole = set[_Key]()  # The rows that are judged although their formulation is asked nothing more.
        # Properties with the same cases. Those that state a turn come first, and those that solve bodies last: they
        # take long.
        self._groups: dict[tuple[str, bool], list[Property]] = {}
        self._variants: dict[_Key, Property] = {}  # What each formulation is asked: with cases in the plane or space.
        for question in sorted(questions, key=attrgetter("bodies", "turn")):
            variants = {(subject.name, question.id): question.for_traits(subject.traits) for subject in subjects}
            self._variants |= variants
            for variant in dict.fromkeys(variants.values()):
                self._groups.setdefault(sampling.group(variant), []).append(variant)
        self._meter = RunMeter(self._variants, subjects, sampling)
        self._fail_again: dict[_Key, Outcome] = {}
        self._mistakes: dict[str, str] = {}  # {formulation: the mistake that its first call shows}
        self._diagnoses: dict[str, str] = {}
        self._stopped: dict[str, str] = {}  # {formulation: why it is asked nothing more}

    def work(self) -> None:
        """Do all jobs. Before any outcome of the store counts, a share of them is judged again."""
        sampling, work = self._sampling, self._scheduler.work
        with closing(self._store):
            self.call_first()
            recheck_store(self._store, self._subjects, self._questions, sampling, self._scheduler)
            if self._stop == "foundation":
                reasons = {OPPOSITE_SIGN: "the forces have the opposite sign"}
                self._stopped |= {name: reasons.get(words, words) for name, words in self._mistakes.items()}
                pairs = product(self._subjects, self._questions)
                lacking = (subject.name for subject, question in pairs if lacks_witness(subject, question, sampling))
                self._stopped |= dict.fromkeys(lacking, "the traits state a failure without a witness")
            work(self._earlier_failures())
            if self._share is None and (self._stop == "failure" or self._scheduler.is_watched):
                self._ask_first_round()
            if self._stop == "failure":
                self._work_to_first_failure()
            elif self._stop == "foundation":
                # All jobs of these properties end before it is known who is asked more, so that it depends on no clock.
                if any(question.role == "foundation" for question in self._variants.values()):
                    work(chain.from_iterable(self._parts_of_next()))
                self._stop_wrong()
            number, count = self._share or (0, 1)
            work(chain.from_iterable(islice(self._parts(), number, None, count)))
            if self._share is None:
                work(self._explain_first_failure())
                work(self._measure_forces())

    def call_first(self) -> None:
        """Call each formulation for the first time. Jobs that follow carry the answers to other processes."""
        self._scheduler.work(self._call_each())

    def _call_each(self) -> Iterator[Job]:
        needs: frozenset[str] = frozenset().union(*(question.needs for question in self._questions))
        for subject in self._subjects:
            # A library is compiled, and its first call may be an endless loop.
            phase: Phase = "first call" if files_within(subject.name) else "first call (compiles)"
            before = Progress(subject.name, "", phase, 0, 1, remark=_describe_no_traits(subject, self._stop))
            self._report(before)
            yield Job(judge.call_first, (subject, needs & subject.provides), partial(self._note_first, before, subject))

    def _note_first(self, before: Progress, subject: Subject, first: judge.FirstCall) -> None:
        subject.first_answers = subject.first_answers or first.answers  # In a second run the process is warm.
        self._mistakes |= {subject.name: first.mistake} if first.mistake else {}
        self._first_calls[subject.name] = first.seconds or 0.0
        remark = f"{subject.name}: {first.mistake}" if first.mistake else ""
        self._report(replace(before, count=1, remark=remark))

    def _ask_first_round(self) -> None:
        """Ask the cheap properties that state a turn about their first cases, and show at once what is wrong."""
        cases: dict[str, tuple[Case, ...]] = {}
        self._scheduler.work(self._first_round(cases))
        kinds = {kind for question in self._questions if question.id in cases for kind in question.kinds}
        of_cases = {case.kind for each in cases.values() for case in each if case.kind}
        words = f"first round: {len(cases)} of {len(self._questions)} properties, {FIRST_CASES} cases each"
        words += f", of {len(of_cases)} of {len(kinds)} kinds" if kinds else ""
        n_wrong = sum(not row.is_trait for row in self._first_wrong.values())
        words += f"; {n_wrong or 'none'} wrong{self._meter.price(self._first_calls)}"
        if cases:
            self._report(Progress("", "", "first round", 1, 1, remark=words))
        crashing = [] if self._stop != "foundation" else filter(_always_crashes, self._first.values())
        for row in sorted(crashing, key=lambda row: row.question.turn):
            if row.subject.name not in self._stopped:
                self._stopped[row.subject.name] = f"the plugin crashes in {row.question.id}"
                self._whole.add((row.subject.name, row.question.id))

    def _first_round(self, cases_of: dict[str, tuple[Case, ...]]) -> Iterator[Job]:
        """Yield the jobs of the first round, and note the cases that each property is asked about."""
        variants = [each for each in dict.fromkeys(self._variants.values()) if each.turn < LAST_TURN]
        for question, subject in product(sorted(variants, key=attrgetter("turn")), self._subjects):
            key, source = (subject.name, question.id), self._sampling.source(question)
            if question is not self._variants[key] or subject.name in self._stopped or source is None:
                continue
            if any(early.subject is subject and _always_crashes(early) for early in self._first.values()):
                continue
            row = open_row(subject, question, source, self._known.get(question.id, ""), self._sampling)
            # A tangent takes a hundred calls.
            count = min(1 if "tangent" in question.needs else FIRST_CASES, self._sampling.examples)
            cases = draw.draw_first(source, self._sampling.key(question), count)
            if isinstance(row, Row) or not cases or self._store.outcomes(subject.name, question.info, 0, count):
                continue
            cases_of[question.id], chunk = cases, CaseChunk(cases, 0)
            row.expect({0: chunk}, planned=self._sampling.examples, last=True)
            before = Progress(*key, "first round", 0, count)
            note = partial(self._note_first_cases, row, before)
            if question.restarts:  # The second process takes a second to start: the whole row has it.
                yield Job(judge_cases, (question, in_one_process(subject), chunk, None, {}), note, before)
            else:
                yield Job(judge_cases, (question, subject, chunk, self._store.writer(*key, 0), {}), note, before)

    def _note_first_cases(self, row: OpenRow, before: Progress, judged: tuple[Sequence[Outcome], str]) -> None:
        key, (outcomes, write_error) = (row.subject.name, row.question.id), judged
        self._store.write_error = self._store.write_error or write_error
        self._meter.measure(row.question.id, outcomes)
        self._first[key] = row
        row.add(0, outcomes)
        row.judge(self._sampling)
        if row.row.verdict in (Verdict.FAIL, Verdict.CRASHED) and row.row.result is not Result.FAILS_AS_STATED:
            self._first_wrong[key] = row.row
            self._report(replace(before, count=before.planned, row=row.row))

    def _work_to_first_failure(self) -> None:
        """Judge until a row is wrong. All jobs of some properties end before it is chosen, so that no clock decides."""
        rows = [row for row in self._first_wrong.values() if row.unexpected]
        rows.sort(key=lambda row: next(each.turn for each in self._questions if each.id == row.property_id))
        while self._groups and not rows:
            self._scheduler.work(chain.from_iterable(self._parts_of_next()))
            rows = wrong_rows(row.row for row in self._open_rows())
        for row in rows[:1]:
            self._whole = {(row.formulation, row.property_id)}
            reason = f"{row.formulation} {row.property_id} is wrong (-x)"
            self._stopped |= {subject.name: reason for subject in self._subjects}

    def _earlier_failures(self) -> Iterator[Job]:
        for question, subject in product(chain.from_iterable(self._groups.values()), self._subjects):
            key = subject.name, question.id
            case = self._store.failures.get(key)
            is_open = question is self._variants[key] and subject.name not in self._stopped
            if case is not None and is_open and question.promise(subject.traits) is not False:
                before = Progress(*key, "asking again", 0, 1)
                self._report(before)
                note = partial(self._note_earlier_failure, before, subject, question)
                yield Job(judge.judge_if_applicable, (question, case, subject), note)

    def _note_earlier_failure(self, before: Progress, subject: Subject, question: Property, outcome: Outcome) -> None:
        if outcome.verdict in (Verdict.FAIL, Verdict.CRASHED):
            key = subject.name, question.id
            self._fail_again[key], self._first_wrong[key] = outcome, row_of_case(question, subject, outcome)
            self._report(replace(before, count=1, row=self._first_wrong[key]))

    def _stop_wrong(self) -> None:
        """Note the formulations of which the first properties have shown what may explain every failure to come."""
        for (name, property_id), row in self._rows.items():
            if not isinstance(row, OpenRow) or not row.row.unexpected or name in self._stopped:
                continue
            if row.row.verdict is Verdict.CRASHED:
                self._stopped[name] = f"the plugin crashes in {property_id}"
            elif row.row.breach:
                self._stopped[name] = f"the contract is broken in {property_id}"
            elif row.question.role == "foundation" and row.row.verdict is Verdict.FAIL:
                self._stopped[name] = f"{property_id} fails"

    def result(self, not_loaded: tuple[NotLoaded, ...], profile: str) -> Run:
        """Return the run with all rows as far as they are judged."""
        sampling = self._sampling
        provenance = collect_provenance(profile=profile, examples=sampling.examples, seed=sampling.seed)
        provenance |= places(self._subjects)
        if reason := draw.why_the_engine_draws():
            provenance["drawing"] = reason
        provenance |= self._store.provenance()
        while self._groups:
            self._open_next()
        for key, row in self._rows.items():
            if isinstance(row, OpenRow) and not row.complete:
                row.stop(sampling.examples, self._first.get(key))
                self._shrink_row(row, shrinks=False)
        rows = [self._rows[subject.name, question.id] for subject, question in product(self._subjects, self._questions)]
        return Run(
            rows=tuple(row.row if isinstance(row, OpenRow) else row for row in rows),
            not_loaded=not_loaded,
            provided=self.provided,
            opposite_signs=self.opposite_signs,
            diagnoses={name: text for name, text in self._diagnoses.items() if text},
            provenance=provenance,
        )

    @property
    def provided(self) -> dict[str, dict[str, bool]]:
        """The optional parts that each formulation has, or has not."""
        return {subject.name: {part: part in subject.provides for part in OPTIONAL_PARTS} for subject in self._subjects}

    @property
    def opposite_signs(self) -> tuple[str, ...]:
        """The formulations with forces of the opposite sign, once all are called."""
        return tuple(subject.name for subject in self._subjects if self._mistakes.get(subject.name) == OPPOSITE_SIGN)

    def check_written(self) -> None:
        """Check that all outcomes are kept."""
        if self._store.write_error and self._store.folder is not None:
            error = f"{self._store.folder.name}: {self._store.write_error}"
            raise MisuseError("--out", error, "a disk with room")

    def _parts(self) -> Iterator[Iterable[Job]]:
        while self._groups:
            yield from self._parts_of_next()

    def _parts_of_next(self) -> Iterator[Iterable[Job]]:
        rows = self._open_next()
        for row in rows:
            if row.witness is not None and not row.witnessed:
                yield self._judge(row, CaseChunk([row.witness], WITNESS))
        if rows and (listed := rows[0].listed) is not None:
            for row in rows:
                chunks = _in_chunks(listed, LIST_CHUNK)
                if self._share is None:
                    row.expect({chunk.first: chunk for chunk in chunks}, planned=len(listed), last=True)
                    yield self._finish(row)
                yield from (self._judge(row, chunk) for chunk in chunks)
        elif rows:
            n_blocks = 1 if self._share is None else draw.number_of_blocks(self._sampling.examples)
            yield from (self._blocks(rows, number) for number in range(n_blocks))

    def _open_next(self) -> list[OpenRow]:
        group, questions = next(iter(self._groups.items()))
        source = self._sampling.source(questions[0])
        if isinstance(source, tuple):
            draw.check_names(source)
        del self._groups[group]
        opened = []
        for subject, question in product(self._subjects, questions):
            key = subject.name, question.id
            if question is not self._variants[key]:
                continue
            known = self._known.get(question.id, "")
            stopped = self._stopped.get(subject.name, "") if key not in self._whole else ""
            self._rows[key] = row = open_row(subject, question, source, known, self._sampling, stopped)
            if isinstance(row, OpenRow):
                opened.append(row)
                if key in self._fail_again:
                    row.add_earlier_failure(self._fail_again[key])
        return opened

    def _blocks(self, rows: Sequence[OpenRow], number: int) -> Iterator[Job]:
        """Yield the jobs of a block and, but for a share, of all blocks behind it: the rows have the same cases."""
        question, sampling = rows[0].question, self._sampling
        # The first block is drawn: rows keep its cases whole, and only what draws it tells whether it has all cases.
        while number and (known := self._known_block(rows, number)) is not None:
            yield from known
            number += 1
            if self._share is not None or number * BLOCK >= sampling.examples:
                return
        if number and self._share is not None and not draw.draws_blocks(*sampling.plan(question)):
            return  # Where a strategy runs out of cases, the first block has all of them.
        before = Progress(rows[0].subject.name, question.id, "drawing", 0, sampling.examples)
        yield Job(draw_chunks, (sampling, question, number), partial(self._add_drawn, rows, number), before)

    def _known_block(self, rows: Sequence[OpenRow], number: int) -> Iterable[Job] | None:
        """Return a block's jobs; None if it is to be drawn: the store lacks an outcome, or a row keeps a case whole."""
        first, examples = number * BLOCK, self._sampling.examples
        count, parts = min(BLOCK, examples - first), []
        for row in rows:
            stored = self._store.outcomes(row.subject.name, row.question.info, first, count)
            if len(stored) < count or (self._share is None and row.outcomes.may_keep_whole(first, stored.values())):
                return None
            parts.append([stored[place] for place in range(count)])
        if self._share is not None:
            return ()
        jobs: list[Job] = []
        for row, outcomes in zip(rows, parts, strict=True):
            row.expect({first: count}, planned=examples, last=first + count == examples)
            jobs += self._add(row, first, outcomes)
        return jobs

    def _add_drawn(
        self, rows: Sequence[OpenRow], number: int, block_in_chunks: tuple[Sequence[CaseChunk], PlannedCases]
    ) -> Iterable[Job]:
        chunks, block = block_in_chunks
        if number == 0:
            for chunk in chunks[: -(-WHOLE // CHUNK)]:
                chunk.keep()
        judging = chain.from_iterable(self._judge(row, chunk) for row in rows for chunk in chunks)
        if self._share is not None:
            return judging
        count = number * BLOCK + sum(chunk.count for chunk in chunks)
        for row in rows:
            planned = count if block.exhausted else self._sampling.examples
            row.expect({chunk.first: chunk for chunk in chunks}, planned=planned, last=block.last)
        # A row without any case is complete.
        return chain(*map(self._finish, rows), judging, () if block.last else self._blocks(rows, number + 1))

    def _judge(self, row: OpenRow, chunk: CaseChunk) -> Iterator[Job]:
        name, question = row.subject.name, row.question
        stored = self._store.outcomes(name, question.info, chunk.first, chunk.count)
        if chunk.first == 0 and not question.restarts and (early := self._first.get((name, question.id))):
            stored |= dict(enumerate(early.outcomes))
        if len(stored) == chunk.count:
            yield from self._add(row, chunk.first, [stored[place] for place in range(chunk.count)])
        else:
            arguments = question, row.subject, chunk, self._store.writer(name, question.id, chunk.first), stored
            then = partial(self._add_judged, row, chunk.first)
            yield Job(judge_cases, arguments, then, self._judging(row), is_local=question.restarts)

    def _judging(self, row: OpenRow) -> Progress:
        of_run = self._meter.read(self._rows)
        return Progress(row.subject.name, row.question.id, "judging", row.n_finished, row.planned, of_run=of_run)

    def _add_judged(self, row: OpenRow, first: int, judged: tuple[Sequence[Outcome], str]) -> Iterable[Job]:
        outcomes, write_error = judged
        self._meter.measure(row.question.id, outcomes)
        self._store.write_error = self._store.write_error or write_error
        return self._add(row, first, outcomes)

    def _add(self, row: OpenRow, first: int, outcomes: Sequence[Outcome]) -> Iterable[Job]:
        if self._share is not None:
            self.check_written()
            return ()
        if first == WITNESS:
            row.add_witness(*outcomes)
        else:
            row.add(first, outcomes)
            self._report(self._judging(row))
        return self._finish(row)

    def _finish(self, row: OpenRow) -> Iterable[Job]:
        """Make the row if it is complete, and return the job to shrink what failed, if that is wanted."""
        if not row.complete:
            return ()
        row.judge(self._sampling)
        self._report(replace(self._judging(row), row=row.row))
        shrinks = self._shrink == "all" or (self._shrink == "new" and row.row.result is not Result.FAILS_AS_STATED)
        return self._shrink_row(row, shrinks=shrinks)

    def _shrink_row(self, row: OpenRow, *, shrinks: bool) -> Iterable[Job]:
        if (goal := row.goal()) is None:
            return ()
        add = partial(self._add_shrunk, row, goal.first)
        if row.listed is not None or not shrinks:
            add(None)
            return ()
        before = Progress(row.subject.name, row.question.id, "shrinking", 0, SHRINK_CALLS)
        return (Job(shrink_case, (self._sampling, row.question, row.subject, goal), add, before),)

    def _add_shrunk(self, row: OpenRow, first: int, smallest: Outcome | None) -> None:
        """Add the smallest case. Without one the witness shows the failure, or the first case that clearly fails."""
        row.row = replace(row.row, shrunk=smallest, first=None)
        if counterexample_of(row.row) is None:
            case = draw.with_case(self._sampling, row.question, first, row.outcomes[first])
            row.row = replace(row.row, first=case)

    def _explain_first_failure(self) -> Iterator[Job]:
        """Yield the jobs to diagnose, and to shrink, the failure of each formulation with the lowest rank."""
        for subject in self._subjects:
            rows = {id(row.row): row for row in self._open_rows() if row.subject is subject}
            news = [
                row.row for row in rows.values() if row.row.result is Result.FAIL and "tangent" in row.question.needs
            ]
            # A wrong tangent is news where nothing is stated of it.
            failure = first_failure(row.row for row in rows.values()) or next(iter(news), None)
            if failure is None or failure.verdict not in (Verdict.FAIL, Verdict.CRASHED):
                continue
            row, crashed = rows[id(failure)], failure.verdict is Verdict.CRASHED
            explains = failure.breach and row.question.role != "foundation" and "not finite" not in failure.reason
            # Crashes and most breaches of the contract explain themselves.
            if not (crashed or explains):
                others = [wrong.property_id for wrong in wrong_rows(each.row for each in rows.values())]
                self._report(Progress(subject.name, failure.property_id, "diagnosis", 0, 1))
                note = partial(self._diagnoses.__setitem__, subject.name)
                yield Job(diagnose, (subject, failure.property_id, others), note)
            # A process that ends or hangs takes long to ask again.
            if self._shrink == "one" and (not crashed or failure.reason.startswith("exception")):
                yield from self._shrink_row(row, shrinks=True)

    def _measure_forces(self) -> Iterator[Job]:
        for row in self._open_rows():
            outcome = counterexample_of(row.row)
            if outcome is None or outcome.verdict is not Verdict.FAIL:
                continue
            # Bodies in the plane are drawn without forces.
            if outcome.case.interface.dim != PLANE or not outcome.case.packed_bodies:
                arguments = row.question, outcome.case, row.subject
                yield Job(judge.forces_to_draw, arguments, partial(self._add_forces, row))

    def _add_forces(self, row: OpenRow, forces: NodalForces | None) -> None:
        row.row = replace(row.row, forces=forces)

    def _open_rows(self) -> list[OpenRow]:
        return [row for row in self._rows.values() if isinstance(row, OpenRow)]


def _check_place(subject: Subject, interface: Interface | None) -> None:
    if interface is None or isinstance(subject, EngineSubject):
        return
    abilities = subject.traits.abilities
    corners = {side.faces.shape[1] for side in (interface.slave, interface.master)}
    takes = {SEGMENT} if abilities.in_plane else set(abilities.faces)  # A formulation of both is asked in the plane.
    if not corners <= takes:
        place, faces = (" and ".join(_FACE_NAMES[count] for count in sorted(each)) for each in (corners, takes))
        raise MisuseError("place", f"an interface of {place}", f"one of {faces}, on which {subject.name} is asked")


def _always_crashes(row: OpenRow) -> bool:
    n_crashed = row.row.tally.verdicts.get(Verdict.CRASHED, 0)
    return len(row.outcomes) > 1 and row.row.judged == n_crashed > 0 and bool(row.row.unexpected)


def _describe_no_traits(subject: Subject, stop: Stop) -> str:
    if isinstance(subject, EngineSubject) or subject.traits != Traits():
        return ""
    looked = ""
    if files := files_within(subject.name):
        looked = f" (looked for {files[0].stem}.toml and [tool.contactverif.traits.{files[0].stem}] in pyproject.toml)"
    words = f"no traits found{looked}: nothing but the basic laws is held against it"
    words += ", and -x stops at nothing else" if stop == "failure" else ""
    return f'{subject.name}: {words}. To begin: tangent = "exact" and penalty = "nodal" or "distributed"'


def _check_once(argument: str, names: Iterable[str]) -> None:
    for name, times in Counter(names).items():
        if times > 1:
            raise MisuseError(argument, f"{name} {times} times", "each of them once")


def draw_chunks(
    sampling: Sampling, question: Property, number: int, count: Callable[[int], None] | None = None
) -> tuple[Sequence[CaseChunk], PlannedCases]:
    """Draw a block of the cases of a property in chunks, so that they travel between processes, and the block's end."""
    block = draw_planned(sampling, question, number, count)
    return _in_chunks(block.cases, CHUNK, number * BLOCK), replace(block, cases=())


def _in_chunks(cases: tuple[Case, ...], size: int, first: int = 0) -> tuple[CaseChunk, ...]:
    return tuple(CaseChunk(cases[n : n + size], first + n) for n in range(0, len(cases), size))


# How far the run is

_LIST = 8  # Cases of a list that is not made yet: making all of them takes a second.
_PATIENCE = 60.0  # Seconds of a run for which a person waits without a word.
_FEW = 10  # Cases of a property in a short run.
# Seconds of a case over those of a drawn one that solves no bodies, of VTS-PPT: {(solves bodies, is in a list): ratio}.
# They count only until the first cases of that kind are measured.
_COSTS = {(False, False): 1.0, (False, True): 0.7, (True, False): 2.7, (True, True): 8.6}


class RunMeter:
    """A meter of a run. A kind of cases is whether they solve bodies, and whether they stand in a list."""

    def __init__(self, variants: Mapping[_Key, Property], subjects: Sequence[Subject], sampling: Sampling) -> None:
        self._kinds: dict[str, tuple[bool, bool]] = {}
        self._planned: dict[_Key, int] = {}
        self._cases, self._seconds = Counter[str](), defaultdict[str, float](float)  # Of each property.
        self._started: float | None = None
        subject_of = {subject.name: subject for subject in subjects}
        for (name, id_), question in variants.items():
            if sampling.interface is not None and sampling.source(question) is None:
                continue  # It has no cases on this mesh.
            is_list = sampling.interface is None and getattr(question.cases, "is_list", False)
            self._kinds[id_] = question.bodies, is_list
            if not (question.refusal_of(subject_of[name]) or question.needs - subject_of[name].provides):
                self._planned[name, id_] = _LIST if is_list else sampling.examples

    def measure(self, property_id: str, outcomes: Sequence[Outcome]) -> None:
        """Note what cases have cost that were judged just now."""
        if self._started is None:  # First calls, which may compile, say nothing about the cases.
            self._started = perf_counter() - sum(outcome.seconds for outcome in outcomes)
        self._cases[property_id] += len(outcomes)
        self._seconds[property_id] += sum(outcome.seconds for outcome in outcomes)

    def read(self, rows: Mapping[_Key, OpenRow | Row]) -> RunProgress:
        """Return how far a run with these rows is, in which others may still be missing."""
        finished, planned, left = 0, 0, Counter[str]()
        for key, count in self._planned.items():
            row = rows.get(key)
            if isinstance(row, Row):
                continue
            n_finished, n_cases = (0, count) if row is None else (row.n_finished, row.planned or count)
            finished, planned = finished + n_finished, planned + n_cases
            left[key[1]] += n_cases - n_finished
        return RunProgress(finished, planned, self._seconds_of(left))

    def price(self, calls: Mapping[str, float]) -> str:
        """Return what a run costs in which an evaluation, {formulation: its seconds}, is slow; empty if none is."""
        whole, few = Counter[str](), Counter[str]()
        for (_, id_), count in self._planned.items():
            whole[id_] += count
            few[id_] += count if self._kinds[id_][1] else min(count, _FEW)
        slowest, times = max(calls, key=calls.__getitem__, default=""), (self._seconds_of(whole), self._seconds_of(few))
        if calls.get(slowest, 0.0) < judge.SLOW_CALL or times[0] is None or times[1] is None or times[0] < _PATIENCE:
            return ""
        words = f". An evaluation of {slowest} takes {calls[slowest]:.2g} s: the whole takes {in_words(times[0])}"
        return f"{words}, with --examples {_FEW} {in_words(times[1])}" if whole != few else words

    def _seconds_of(self, cases: Mapping[str, int]) -> float | None:
        """Return the seconds that cases of each property will take, which is a guess; None if nothing is measured."""
        measured = sum(self._seconds.values())
        if not measured or self._started is None:
            return None
        counts, seconds = Counter[tuple[bool, bool]](), defaultdict[tuple[bool, bool], float](float)
        for id_, count in self._cases.items():
            counts[self._kinds[id_]] += count
            seconds[self._kinds[id_]] += self._seconds[id_]
        unit = measured / sum(_COSTS[kind] * count for kind, count in counts.items())
        costs = {kind: seconds[kind] / counts[kind] if counts[kind] else cost * unit for kind, cost in _COSTS.items()}
        of_each = {id_: self._seconds[id_] / count for id_, count in self._cases.items() if count}
        ahead = sum(count * of_each.get(id_, costs[self._kinds[id_]]) for id_, count in cases.items())
        return ahead * (perf_counter() - self._started) / measured
