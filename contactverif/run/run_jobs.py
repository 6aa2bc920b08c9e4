"""The jobs of a run, in the order in which they are handed out.

Each formulation is called once before anything else; properties that state a turn are asked first. The cases of a
strategy are drawn, once for all formulations and all properties that have this strategy, they are judged, and what
failed is shrunk. Properties that solve bodies come last. All planned cases of a row are judged before one is shrunk, so
that a failure ends nothing early. What the journal knows is not judged again, and a block of which it knows all is not
drawn.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, islice, product
from operator import attrgetter

from contactverif.contract.case import Case
from contactverif.contract.counterexample import counterexample_of
from contactverif.contract.engine_subject import EngineSubject
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import PLANE, SEGMENT, Interface
from contactverif.contract.property import Outcome, Property, Verdict
from contactverif.contract.result import NodalForces, NotLoaded, Result, Row, Run
from contactverif.contract.subject import OPTIONAL_PARTS, Subject
from contactverif.diagnosis.diagnose import diagnose
from contactverif.isolation.remote_formulation import places
from contactverif.journals.outcome_records import WITNESS, BlockRecord
from contactverif.journals.run_journal import Journal
from contactverif.plugins.provenance import collect_provenance
from contactverif.run import judge
from contactverif.run.profiles import Shrink
from contactverif.run.ranking import first_failure, wrong_rows
from contactverif.run.rows import (
    WHOLE,
    JudgedCases,
    OpenRow,
    Shrinking,
    judge_cases,
    lacks_witness,
    open_row,
    row_of_case,
    shrink_case,
)
from contactverif.run.run_meter import RunMeter
from contactverif.run.scheduler import CaseChunk, Job, Progress, Scheduler
from contactverif.run.second_look import look_at_journal
from contactverif.sampling import draw
from contactverif.sampling.draw import BLOCK, SHRINK_CALLS, Sampling

CHUNK = 25  # The number of drawn cases that are judged in one job.
LIST_CHUNK = 5  # The same for named cases, which are often slower.
_FACE_NAMES = {2: "segments in the plane", 3: "triangles in space", 4: "quadrilaterals in space"}


class RunJobs:
    """The jobs of a run, in the order that all shares of it have in common.

    The parts of a run are numbered: each witness, each chunk of a finite list, each block of drawn cases. Of `share`
    (I, N) are every N-th of them. A share fills no rows and shrinks nothing: its outcomes are in the journal.
    """

    def __init__(
        self,
        subjects: Sequence[Subject],
        questions: Sequence[Property],
        sampling: Sampling,
        journal: Journal,
        report: Callable[[Progress], None],
        known: Mapping[str, str],
        share: tuple[int, int] | None = None,
        shrink: Shrink = "new",
        keep_going: bool = True,
    ) -> None:
        _check_once("formulation", map(attrgetter("name"), subjects))
        _check_once("property", map(attrgetter("id"), questions))
        for subject in subjects:
            _check_place(subject, sampling.interface)
        self._subjects, self._sampling, self._journal, self._report = subjects, sampling, journal, report
        self._questions, self._known = questions, known
        self._share, self._shrink, self._keep_going = share, shrink, keep_going
        self._fail_again: dict[tuple[str, str], Outcome] = {}
        self._needs: frozenset[str] = frozenset().union(*(question.needs for question in questions))
        self._rows: dict[tuple[str, str], OpenRow | Row] = {}
        # Properties with the same cases. Those that solve bodies take long, and a person waits for the first row.
        self._groups: dict[tuple[str, bool], list[Property]] = {}
        # The property that each formulation is asked: with cases in the plane, or in space.
        self._variants: dict[tuple[str, str], Property] = {}
        for question in sorted(questions, key=_turn):
            variants = {(subject.name, question.id): question.for_traits(subject.traits) for subject in subjects}
            self._variants |= variants
            for variant in dict.fromkeys(variants.values()):
                self._groups.setdefault(sampling.group(variant), []).append(variant)
        self._meter = RunMeter(subjects, questions, sampling)
        self._opposite_signs: set[str] = set()
        self._diagnoses: dict[str, str] = {}
        self._stopped: dict[str, str] = {}  # {formulation: why it is asked nothing more}

    def work(self, scheduler: Scheduler) -> None:
        """Do all jobs; before anything is believed of a journal without a proof, a share of it is judged again."""
        scheduler.work(self.first_calls())  # Jobs that follow carry the first answers to other processes.
        look_at_journal(self._journal, self._subjects, self._questions, self._sampling, scheduler)
        if not self._keep_going:
            self._stopped |= dict.fromkeys(self._opposite_signs, "the forces have the opposite sign")
            self._stopped |= self._without_witnesses()
        scheduler.work(self._earlier_failures())
        if not self._keep_going:
            # All jobs of these properties end before it is known who is asked more, so that it does not depend on time.
            if any(question.role == "foundation" for question in self._questions):
                scheduler.work(chain.from_iterable(self._parts_of_next()))
            self._stop_wrong()
        scheduler.work(self)
        if self._share is None:
            scheduler.work(self._explain_first_failure())
            scheduler.work(self._measure_forces())

    def _without_witnesses(self) -> dict[str, str]:
        """Return why formulations are not asked that state a failure and name no case that shows it."""
        pairs = product(self._subjects, self._questions)
        lacking = [subject.name for subject, question in pairs if lacks_witness(subject, question, self._sampling)]
        return dict.fromkeys(lacking, "the traits state a failure without a witness")

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

    def first_calls(self) -> Iterator[Job]:
        """Yield the jobs to call each formulation for the first time."""
        for subject in self._subjects:
            before = Progress(subject.name, "", "first call (compiles)", 0, 1)
            self._report(before)
            yield Job(
                judge.call_first, (subject, self._needs & subject.provides), partial(self._note_first, before, subject)
            )

    def _note_first(self, before: Progress, subject: Subject, first: judge.FirstCall) -> Iterable[Job]:
        subject.first_answers = subject.first_answers or first.answers  # In a second run the process is warm.
        self._opposite_signs |= {before.formulation} if first.opposite_sign else set()
        self._report(replace(before, count=1, first_seconds=first.seconds))
        return ()

    def __iter__(self) -> Iterator[Job]:
        number, count = self._share or (0, 1)
        return chain.from_iterable(islice(self._parts(), number, None, count))

    def result(self, not_loaded: tuple[NotLoaded, ...], profile: str) -> Run:
        """Return the run with all rows as far as they are judged; one that is not complete says so."""
        sampling = self._sampling
        provenance = collect_provenance(profile=profile, examples=sampling.examples, seed=sampling.seed)
        provenance |= places(self._subjects)
        if reason := draw.why_the_engine_draws():
            provenance["drawing"] = reason
        provenance |= self._journal.provenance()
        while self._groups:
            self._open_next()
        pairs = product(self._subjects, self._questions)
        return Run(
            rows=tuple(self._close(self._rows[subject.name, question.id]) for subject, question in pairs),
            not_loaded=not_loaded,
            provided=self.provided,
            opposite_signs=self.opposite_names,
            diagnoses=self._diagnoses,
            provenance=provenance,
        )

    @property
    def provided(self) -> dict[str, dict[str, bool]]:
        """The optional parts that each formulation has, or has not."""
        return {subject.name: {part: part in subject.provides for part in OPTIONAL_PARTS} for subject in self._subjects}

    @property
    def opposite_names(self) -> tuple[str, ...]:
        """The formulations with forces of the opposite sign, once all are called."""
        return tuple(subject.name for subject in self._subjects if subject.name in self._opposite_signs)

    def _close(self, row: OpenRow | Row) -> Row:
        """Return a row as far as it is judged."""
        if isinstance(row, Row):
            return row
        if not row.complete:
            row.stop(self._sampling.examples)
        return row.row

    def check_written(self) -> None:
        """Check that all outcomes are kept."""
        if self._journal.trouble and self._journal.folder is not None:
            trouble = f"{self._journal.folder.name}: {self._journal.trouble}"
            raise MisuseError("--out", trouble, "a disk with room")

    def _open_next(self) -> list[OpenRow]:
        """Open the rows of the next properties with the same cases, and return those whose cases are to be judged."""
        group, questions = next(iter(self._groups.items()))
        source = self._sampling.source(questions[0])
        if isinstance(source, tuple):
            draw.check_names(source)
        rows = {
            (subject.name, question.id): open_row(
                subject,
                question,
                source,
                self._known.get(question.id, ""),
                self._sampling,
                self._stopped.get(subject.name, ""),
            )
            for subject, question in product(self._subjects, questions)
            if question is self._variants[subject.name, question.id]
        }
        self._rows |= rows
        del self._groups[group]
        opened = [row for row in rows.values() if isinstance(row, OpenRow)]
        for row in opened:
            if (outcome := self._fail_again.get((row.subject.name, row.question.id))) is not None:
                row.add_earlier_failure(outcome)
        return opened

    def _earlier_failures(self) -> Iterator[Job]:
        """Yield the jobs to judge what failed in earlier runs; none of them counts among the planned cases."""
        questions = chain.from_iterable(self._groups.values())
        for question, subject in product(questions, self._subjects):
            case = self._journal.earlier_failures.get((subject.name, question.id))
            if (
                case is None
                or question is not self._variants[subject.name, question.id]
                or subject.name in self._stopped
                or question.promise(subject.traits) is False
            ):
                continue
            before = Progress(subject.name, question.id, "asking again", 0, 1)
            self._report(before)
            note = partial(self._note_earlier_failure, subject, question)
            yield Job(judge.judge_if_applicable, (question, case, subject), note)

    def _note_earlier_failure(self, subject: Subject, question: Property, outcome: Outcome) -> Iterable[Job]:
        """Note a case that failed in an earlier run and fails again, and report it."""
        if outcome.verdict not in (Verdict.FAIL, Verdict.CRASHED):
            return ()
        self._fail_again[subject.name, question.id] = outcome
        before = Progress(subject.name, question.id, "asking again", 1, 1)
        self._report(replace(before, row=row_of_case(question, subject, outcome)))
        return ()

    def _parts(self) -> Iterator[Iterable[Job]]:
        """Yield the jobs of each part; those of a part are made when they are wanted."""
        while self._groups:
            yield from self._parts_of_next()

    def _parts_of_next(self) -> Iterator[Iterable[Job]]:
        """Yield the parts of the next properties with the same cases."""
        group = self._open_next()
        for row in group:
            if row.witness is not None and not row.witnessed:
                yield self._judge(row, CaseChunk([row.witness], WITNESS))
        if not group:
            return
        if group[0].listed is not None:
            for row in group:
                yield from self._judge_list(row, group[0].listed)
        elif self._share is None:
            yield self._blocks(group, 0)
        else:
            yield from (self._blocks(group, n) for n in range(draw.number_of_blocks(self._sampling.examples)))

    def _judge_list(self, row: OpenRow, cases: tuple[Case, ...]) -> Iterator[Iterable[Job]]:
        chunks = in_chunks(cases, LIST_CHUNK)
        yield from [self._expect(row, chunks, len(cases), last=True)] if self._share is None else []
        yield from (self._judge(row, chunk) for chunk in chunks)

    def _blocks(self, group: Sequence[OpenRow], number: int) -> Iterator[Job]:
        """Yield the jobs of a block and, but for a share, of all blocks behind it: the rows have the same cases."""
        question = group[0].question
        block = self._journal.block(self._sampling.block_name(question), number)
        while block is not None and (known := self._known_block(group, block)) is not None:
            yield from known
            if block.last or self._share is not None:
                return
            number += 1
            block = self._journal.block(self._sampling.block_name(question), number)
        if block is None and number > 0 and self._share is not None and not self._draws_blocks(question):
            return  # Where a strategy runs out of cases, the first block has all of them.
        before = Progress(group[0].subject.name, question.id, "drawing", 0, self._sampling.examples)
        yield Job(draw_chunks, (self._sampling, question, number), partial(self._add_drawn, group, number), before)

    def _draws_blocks(self, question: Property) -> bool:
        source, sampling = self._sampling.source(question), self._sampling
        assert source is not None
        return draw.draws_blocks(source, seed=sampling.key(question), examples=sampling.examples)

    def _known_block(self, group: Sequence[OpenRow], block: BlockRecord) -> Iterable[Job] | None:
        """Return the jobs that follow from the outcomes of a block, if it need not be drawn.

        It need not if the journal has all outcomes of all rows, and no row keeps one of these cases whole.
        """
        first, parts = block.number * BLOCK, []
        for row in group:
            earlier = self._journal.outcomes(row.subject.name, row.question.info, first, block.count)
            if len(earlier) < block.count or (self._share is None and row.may_keep_whole(first, earlier.values())):
                return None
            parts.append(tuple(earlier[place] for place in range(block.count)))
        if self._share is not None:
            return ()
        jobs: list[Job] = []
        for row, outcomes in zip(group, parts, strict=True):
            row.expect_judged(first, block.count, planned=self._count_planned(block), last=block.last)
            jobs += self._add(row, first, JudgedCases(outcomes))
        return jobs

    def _count_planned(self, block: BlockRecord) -> int:
        """Return the number of cases of a row, once a block is drawn."""
        return block.number * BLOCK + block.count if block.exhausted else self._sampling.examples

    def _add_drawn(self, group: Sequence[OpenRow], number: int, cases: DrawnCases) -> Iterable[Job]:
        """Return the jobs to judge a block, then those of the next block."""
        if number == 0:
            for chunk in cases.chunks[: -(-WHOLE // CHUNK)]:
                chunk.keep()
        count = sum(chunk.count for chunk in cases.chunks)
        block = BlockRecord(self._sampling.block_name(group[0].question), number, count, cases.exhausted, cases.last)
        self._journal.add_block(block)
        judging = chain.from_iterable(self._judge(row, chunk) for row in group for chunk in cases.chunks)
        if self._share is not None:
            return judging
        planned = self._count_planned(block)
        finished = [self._expect(row, cases.chunks, planned, last=cases.last) for row in group]
        return chain(*finished, judging, () if cases.last else self._blocks(group, number + 1))

    def _expect(self, row: OpenRow, chunks: Sequence[CaseChunk], planned: int, *, last: bool) -> Iterable[Job]:
        """Let a row expect the outcomes of chunks; one without any case is complete."""
        row.expect(chunks, planned=planned, last=last)
        return self._finish(row)

    def _judge(self, row: OpenRow, chunk: CaseChunk) -> Iterator[Job]:
        """Yield the job to judge the cases of a chunk that are not judged yet."""
        name, property_id = row.subject.name, row.question.id
        earlier = self._journal.outcomes(name, row.question.info, chunk.first, chunk.count)
        if len(earlier) == chunk.count:
            outcomes = tuple(earlier[place] for place in range(chunk.count))
            yield from self._add(row, chunk.first, JudgedCases(outcomes))
            return
        notes = self._journal.notes(name, property_id, chunk.first)
        arguments = row.question, row.subject, chunk, notes, earlier
        yield Job(judge_cases, arguments, partial(self._add_judged, row, chunk.first), self._judging(row))

    def _judging(self, row: OpenRow) -> Progress:
        of_run = self._meter.read(self._rows)
        return Progress(row.subject.name, row.question.id, "judging", row.n_finished, row.planned, of_run=of_run)

    def _add_judged(self, row: OpenRow, first: int, judged: JudgedCases) -> Iterable[Job]:
        """Add the outcomes of a chunk that was judged now."""
        self._meter.measure(row.question.id, judged.outcomes)
        return self._add(row, first, judged)

    def _add(self, row: OpenRow, first: int, judged: JudgedCases) -> Iterable[Job]:
        """Add the outcomes of a chunk to its row, and return the job to shrink what failed once it is complete."""
        self._journal.note_trouble(judged.trouble)
        if self._share is not None:
            self.check_written()
            return ()
        if first == WITNESS:
            row.add_witness(*judged.outcomes)
        else:
            row.add(first, judged.outcomes)
            self._report(self._judging(row))
        return self._finish(row)

    def _finish(self, row: OpenRow) -> Iterable[Job]:
        """Make the row if it is complete, and return the job to shrink what failed, if that is wanted."""
        if not row.complete:
            return ()
        row.judge(on_scene=self._sampling.scene is not None)
        self._report(replace(self._judging(row), row=row.row))
        goal = row.goal()
        if goal is None:
            return ()
        shrinks = self._shrink == "all" or (self._shrink == "new" and row.row.result is not Result.FAILS_AS_STATED)
        return self._shrink_row(row, goal) if shrinks else self._add_shrunk(row, goal.first, None)

    def _explain_first_failure(self) -> Iterator[Job]:
        """Yield the jobs to diagnose, and to shrink, the failure of each formulation with the lowest rank."""
        for row in filter(None, map(self._find_first_failure, self._subjects)):
            name, property_id = row.subject.name, row.question.id
            self._report(Progress(name, property_id, "diagnosis", 0, 1))
            others = [wrong.property_id for wrong in wrong_rows(each.row for each in self._rows_of(row.subject))]
            if row.subject.traits.abilities.in_plane:  # The rules look at plane states.
                yield Job(diagnose, (row.subject, property_id, others), partial(self._add_diagnosis, name))
            if self._shrink == "one" and (goal := row.goal()) is not None:
                yield from self._shrink_row(row, goal)

    def _measure_forces(self) -> Iterator[Job]:
        """Yield the jobs to ask for the forces on each counterexample in space, which no text can show."""
        for row in self._rows.values():
            if not isinstance(row, OpenRow) or (outcome := counterexample_of(row.row)) is None:
                continue
            if outcome.case.interface.dim != PLANE and outcome.verdict is Verdict.FAIL:
                arguments = row.question, outcome.case, row.subject
                yield Job(judge.forces_to_draw, arguments, partial(self._add_forces, row))

    def _add_forces(self, row: OpenRow, forces: NodalForces | None) -> Iterable[Job]:
        """Add the forces on the counterexample of a row."""
        row.row = replace(row.row, forces=forces)
        return ()

    def _find_first_failure(self, subject: Subject) -> OpenRow | None:
        """Return the row of a formulation whose failure a person wants to see first; crashes explain themselves."""
        rows = {id(row.row): row for row in self._rows_of(subject)}
        failure = first_failure(row.row for row in rows.values())
        if failure is None or failure.verdict is not Verdict.FAIL:
            return None
        row = rows[id(failure)]
        return None if failure.breach and row.question.role != "foundation" else row

    def _rows_of(self, subject: Subject) -> list[OpenRow]:
        return [row for row in self._rows.values() if isinstance(row, OpenRow) and row.subject is subject]

    def _add_diagnosis(self, name: str, text: str) -> Iterable[Job]:
        """Add what is known of the mistake of a formulation."""
        if text:
            self._diagnoses[name] = text
        return ()

    def _shrink_row(self, row: OpenRow, goal: Shrinking) -> Iterable[Job]:
        """Return the job to shrink what failed in a row; of a list of cases nothing is smaller."""
        if row.listed is not None:
            return self._add_shrunk(row, goal.first, None)
        before = Progress(row.subject.name, row.question.id, "shrinking", 0, SHRINK_CALLS)
        arguments = self._sampling, row.question, row.subject, goal
        return (Job(shrink_case, arguments, partial(self._add_shrunk, row, goal.first), before),)

    def _add_shrunk(self, row: OpenRow, first: int, smallest: Outcome | None) -> Iterable[Job]:
        """Add the smallest case. Without one the witness shows the failure, or the first case that clearly fails."""
        row.row = replace(row.row, shrunk=smallest, first=None)
        if counterexample_of(row.row) is None:
            case = draw.with_case(self._sampling, row.question, first, row.outcomes[first])
            row.row = replace(row.row, first=case)
        return ()


@dataclass(frozen=True, slots=True)
class DrawnCases:
    """A block of the cases of a strategy, in order."""

    chunks: tuple[CaseChunk, ...]
    exhausted: bool  # The strategy has no other cases.
    last: bool  # No further block follows.


def draw_chunks(
    sampling: Sampling, question: Property, number: int, count: Callable[[int], None] | None = None
) -> DrawnCases:
    """Draw a block of the cases of a property, and of all properties with the same strategy."""
    source, seed = sampling.source(question), sampling.key(question)
    assert source is not None
    block = draw.draw_block(source, seed=seed, examples=sampling.examples, number=number, progress=count)
    return DrawnCases(in_chunks(block.cases, CHUNK, number * BLOCK), block.exhausted, block.last)


def in_chunks(cases: tuple[Case, ...], size: int, first: int = 0) -> tuple[CaseChunk, ...]:
    """Return cases, of which the first has a number in its row, in chunks of a size."""
    return tuple(CaseChunk(cases[n : n + size], first + n) for n in range(0, len(cases), size))


def _turn(question: Property) -> tuple[bool, int]:
    """Return the key by which properties are asked: those that solve bodies last, since they take long."""
    return question.bodies, question.turn


def _check_place(subject: Subject, interface: Interface | None) -> None:
    """Refuse the interface of a user if a formulation does not take such faces."""
    if interface is None or isinstance(subject, EngineSubject):
        return
    abilities = subject.traits.abilities
    corners = {side.faces.shape[1] for side in (interface.slave, interface.master)}
    takes = {SEGMENT} if abilities.in_plane else set(abilities.faces)  # A formulation of both is asked in the plane.
    if not corners <= takes:
        place, faces = (" and ".join(_FACE_NAMES[count] for count in sorted(each)) for each in (corners, takes))
        raise MisuseError("place", f"an interface of {place}", f"one of {faces}, on which {subject.name} is asked")


def _check_once(argument: str, names: Iterable[str]) -> None:
    """Check that no name stands there twice."""
    for name, times in Counter(names).items():
        if times > 1:
            raise MisuseError(argument, f"{name} {times} times", "each of them once")
