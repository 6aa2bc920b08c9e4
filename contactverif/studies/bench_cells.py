"""The bench: all formulations solve each cell of a plan in all variants, and are timed in turns; a journal survives.

Errors, counts and nonzeros come from solutions that no clock looks at; they are the same in every run. An evaluation is
timed at the near start, where all formulations see the same positions, and again in further processes of the plugins.
Who begins a turn changes, so that whatever disturbs the machine disturbs all, and the least time counts. Counts are of
what the harness asks, so that no plugin tells them. Seconds are those of the plugin's own process, which times each
call itself, without the checks of the harness and without the way there.
"""

import gc
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from math import nan
from pathlib import Path
from time import perf_counter
from typing import Any

import msgspec
import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from contactverif.contract.arrays import Array
from contactverif.contract.case import Case
from contactverif.contract.errors import ContractError, MisuseError, PluginError
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import CheckedFormulation, Subject
from contactverif.isolation.remote import RemoteFormulation, RemoteSubject, places
from contactverif.isolation.worker import MethodCalls
from contactverif.mechanics.accuracy import solution_of, solve_in_tries
from contactverif.mechanics.newton import Trace
from contactverif.mechanics.scene import WholeScene, forget_bodies
from contactverif.mechanics.system import System
from contactverif.plugins.provenance import collect_provenance
from contactverif.problems.problem import ProblemInstance
from contactverif.run import journal
from contactverif.studies.bench_plan import BenchPlan, is_solved, largest_errors, match_dimension, pose
from contactverif_reports.bench_results import COUNTS, ERRORS, RULE, VARIANTS, BenchResults, Cell, Outcome

TURNS = 5  # The number of timed evaluations in each process, and the largest of timed factorisations.
_LONG = 0.25  # Seconds. Factorisations of a matrix are timed no further once they have taken so long together.
_COUNTS_OF_VERB = {
    "pair": ("pairs",),
    "residual": ("residuals",),
    "tangent": ("tangents",),
    "residual_and_tangent": ("residuals", "tangents"),
}


@dataclass(slots=True)
class Meter:
    """The counts of one solution by name, and the seconds, or the methods that run, of all calls where wanted."""

    timed: bool = False
    counted: bool = False
    seconds: float = 0.0
    calls: int = 0
    counts: dict[str, int] = field(default_factory=lambda: dict.fromkeys(tuple(COUNTS)[1:], 0))  # Not the iterations
    differencing: bool = False

    def call(self, verb: str, plugin: Any, method: Callable[..., Any], *arguments: Any) -> Any:
        """Call a method of the plugin, and count its states and its seconds."""
        with MethodCalls() if self.counted else nullcontext() as counter:
            start = perf_counter()
            answer = method(*arguments)
            seconds = perf_counter() - start
        calls = 0 if counter is None else counter.count
        if isinstance(plugin, RemoteFormulation) and (self.timed or self.counted):
            seconds, calls = plugin.seconds(), plugin.calls()
        self.seconds += seconds
        self.calls += calls
        n_states = int(np.prod(np.shape(arguments[-1])[:-1]))  # Forces may be wanted at a batch z (..., n_unknowns).
        for name in ("differences",) if self.differencing else _COUNTS_OF_VERB[verb]:
            self.counts[name] += n_states
        return answer


class _MeteredPlugin:
    """A plugin whose verbs are counted; everything else is the plugin's own."""

    def __init__(self, plugin: Any, meter: Meter) -> None:
        self._plugin, self._meter = plugin, meter

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._plugin, name)
        is_counted = name in _COUNTS_OF_VERB and callable(value)
        return partial(self._meter.call, name, self._plugin, value) if is_counted else value


class _MeteredFormulation:
    """A checked formulation of which the meter knows when forces are computed for differences."""

    def __init__(self, formulation: CheckedFormulation, meter: Meter) -> None:
        self._formulation, self._meter = formulation, meter

    def __getattr__(self, name: str) -> Any:
        return getattr(self._formulation, name)

    def residual(self, interface: Interface, pairing: Pairing | None, z: Array) -> Array:
        """Return the forces (..., n_unknowns) at z (..., n_unknowns); a batch of states is for differences."""
        self._meter.differencing = z.ndim > 1
        try:
            return self._formulation.residual(interface, pairing, z)
        finally:
            self._meter.differencing = False


def _add_meter(subject: Subject, case: Case, meter: Meter) -> Any:
    """Return the formulation with the penalty of a case, as Newton's method needs it, with the meter around it."""
    plugin = subject.for_case(case).plugin
    if isinstance(plugin, RemoteFormulation):
        plugin.timed, plugin.counted = meter.timed, meter.counted
    metered = _MeteredPlugin(plugin, meter)
    return _MeteredFormulation(CheckedFormulation(metered, subject.traits, subject.provides), meter)


@dataclass(slots=True)
class SolutionRecord:
    """One formulation in one cell and one variant."""

    outcome: int = int(Outcome.CRASHED)  # The outcome, see `Outcome`.
    remark: str = ""  # How it ended, if it is no solution.
    errors: dict[str, float] = field(default_factory=dict)  # The errors by kind; empty without a solution.
    counts: dict[str, int] = field(default_factory=dict)  # The counts by name; empty after a crash.
    ended: bool = False  # The plugin ended its process.


_NOT_RUN = [
    SolutionRecord(remark="not asked: the plugin ended its process in all solutions of an earlier mesh", ended=True)
    for _ in VARIANTS
]


@dataclass(slots=True)
class RunRecord:
    """One formulation in one cell."""

    solutions: list[SolutionRecord] = field(default_factory=list)  # By variant; none in further processes
    nonzeros: tuple[int, int] = (0, 0)  # Those of the tangent and of the factors, 0 without a solution
    calls: int = 0  # Methods that run in one evaluation; 0 in further processes
    factorisation: float = nan  # The least seconds of one factorisation
    evaluation: float = nan  # The least seconds of one evaluation in this process; NaN if it crashed

    @property
    def is_lost(self) -> bool:
        """The plugin ended its process in all variants."""
        return bool(self.solutions) and all(solution.ended for solution in self.solutions)


@dataclass(slots=True)
class CellRecord:
    """All formulations in one cell and one process of each, as the journal keeps it."""

    segments: int  # The number of slave segments
    unknowns: int  # The number of free components of all bodies; 0 in further processes
    runs: dict[str, RunRecord]  # The runs by formulation
    best_pressure: float = 0.0  # The error of the best linear pressure on the slave's mesh; 0 in further processes


def run_cell(
    cell: Cell, subjects: Sequence[Subject], seed: int, *, solve: bool = True, dead: Collection[str] = ()
) -> CellRecord:
    """Solve a cell with all formulations but the `dead` ones, unless that is done, and time evaluations in turns."""
    instances = [pose(cell, RULE.penalty, subject.traits, seed) for subject in subjects]
    whole = WholeScene.of_scene(instances[0].scene) if solve else None
    runs = [RunRecord(_NOT_RUN[:] if subject.name in dead else []) for subject in subjects]
    for subject, instance, run in zip(subjects, instances, runs, strict=True):
        if whole is not None and not run.is_lost:
            _solve_variants(cell, subject, instance, seed, whole, run)
    forget_bodies()
    running = [number for number, run in enumerate(runs) if not run.is_lost]
    gc.collect()
    was_enabled = gc.isenabled()
    gc.disable()  # Python's collector of garbage stays out of the times, as in `timeit`.
    try:
        for turn in range(TURNS):
            for place in range(len(running)):
                number = running[(place + turn) % len(running)]
                seconds = evaluate(subjects[number], instances[number], timed=True).seconds
                runs[number].evaluation = float(np.fmin(runs[number].evaluation, seconds))
    finally:
        if was_enabled:
            gc.enable()
    by_name = {subject.name: run for subject, run in zip(subjects, runs, strict=True)}
    size, best = (0, 0.0) if whole is None else (whole.n_free, instances[0].best_pressure)
    return CellRecord(len(instances[0].scene.interface.slave), size, by_name, best)


def _solve_variants(
    cell: Cell, subject: Subject, instance: ProblemInstance, seed: int, whole: WholeScene, run: RunRecord
) -> None:
    for variant in VARIANTS:
        is_rule = variant.penalty == RULE.penalty
        varied = instance if is_rule else pose(cell, variant.penalty, subject.traits, seed)
        record = SolutionRecord()
        run.solutions.append(record)
        try:
            trace = _solve(subject, varied, variant.start, record)
            if variant == RULE and record.outcome == Outcome.SOLVED:
                _measure_system(subject, varied, trace, whole, run)
        except ContractError as error:
            record.remark, record.ended = str(error), isinstance(error, PluginError) and error.ended
    if not run.is_lost:
        run.calls = evaluate(subject, instance, counted=True).calls


def _solve(subject: Subject, instance: ProblemInstance, start: str, record: SolutionRecord) -> Trace:
    meter = Meter()
    formulation = _add_meter(subject, instance.first_guess, meter)
    with np.errstate(all="ignore"):  # A diverging iteration overflows; its end says so.
        tries = solve_in_tries(instance.scene, formulation, instance.starts[start], instance.step)
    # The scene keeps stiffness and load. The factors of its bodies may take gigabytes, and are of no further use.
    vars(instance.scene).pop("condensed_bodies", None)
    counts = {"iterations": sum(trace.n_iterations for trace in tries), **meter.counts}
    plain = subject.for_case(instance.first_guess)
    solution = solution_of(tries[-1], plain, nodal=subject.traits.rules.penalty == "nodal")
    solved = is_solved(solution)
    record.errors = largest_errors(instance, solution) if solved else {}
    record.counts, record.remark = counts, "" if solved else tries[-1].end.label
    record.outcome = int(Outcome.SOLVED if solved else Outcome.NOT_SOLVED)
    return tries[-1]


def _measure_system(
    subject: Subject, instance: ProblemInstance, trace: Trace, whole: WholeScene, run: RunRecord
) -> None:
    formulation: CheckedFormulation = subject.for_case(instance.first_guess)
    system = System(instance.scene, formulation, difference_step=instance.step)
    u = trace.u[-1]
    tangent = system.tangent(u, system.pair(u))
    whole_system = System(whole, formulation)
    matrix = sparse.csc_array(whole_system.stiffness + whole_system.contact_stiffness(u, None, tangent))
    n_tangent = int(np.count_nonzero(tangent)) if isinstance(tangent, np.ndarray) else int(tangent.nnz)
    seconds: list[float] = []
    while len(seconds) < TURNS and sum(seconds) < _LONG:
        start = perf_counter()
        try:
            factors = splu(matrix)
        except RuntimeError:  # The matrix is exactly singular: multipliers that are not unique.
            run.nonzeros = n_tangent, 0
            return
        seconds.append(perf_counter() - start)
    run.factorisation = min(seconds)
    run.nonzeros = n_tangent, int(factors.L.nnz + factors.U.nnz)


def evaluate(subject: Subject, instance: ProblemInstance, *, timed: bool = False, counted: bool = False) -> Meter:
    """Return the meter of one evaluation, search, forces and tangent or differences; its seconds are NaN after a crash.

    It is timed or counted, since an interpreter that counts is slower.
    """
    meter = Meter(timed=timed, counted=counted)
    formulation: Any = _add_meter(subject, instance.first_guess, meter)
    interface = instance.scene.interface
    try:
        z = np.concatenate([instance.first_guess.z, np.zeros(formulation.n_multipliers(interface))])
        pairing = formulation.pair(interface, z)
        if "tangent" in subject.provides:
            formulation.residual_and_tangent(interface, pairing, z)
        else:
            formulation.residual(interface, pairing, z)
            steps = np.diag(np.full(z.size, 1e-6 if instance.step is None else instance.step))
            formulation.residual(interface, pairing, np.concatenate([z + steps, z - steps]))
    except ContractError:
        meter.seconds = nan
    return meter


class Header(msgspec.Struct, frozen=True):
    """The facts that must agree before a killed bench goes on."""

    bench: BenchPlan
    formulations: tuple[str, ...]
    versions: dict[str, str]


class FinishedCell(msgspec.Struct, frozen=True):
    """The record of a cell that is finished."""

    number: int  # Process × number of cells + cell
    record: CellRecord


_ENCODER = msgspec.msgpack.Encoder(enc_hook=float)  # Numbers of numpy are numbers of a type of their own.
_DECODER = msgspec.msgpack.Decoder(FinishedCell)


@dataclass(frozen=True, slots=True)
class FinishedCells:
    """The records of the cells that are finished, by number, and the file for the others."""

    records: dict[int, CellRecord]
    file: journal.RecordFile

    def add(self, number: int, record: CellRecord) -> None:
        """Append the record of a cell that is finished."""
        self.file.append(_ENCODER.encode(FinishedCell(number, record)))
        self.file.sync()
        self.records[number] = record


@contextmanager
def open_journal(output: Path, header: Header) -> Iterator[FinishedCells]:
    """Open a block with the finished cells of an output file, in which no other bench uses its journal.

    A journal of another plan is refused, and never overwritten. A cell whose record is damaged is run again.
    """
    folder = journal.journal_folder(output)
    if not folder.exists():
        block = journal.new_journal(folder, header)
    elif journal.read_header(folder, Header, "--out") == header:
        block = journal.hold_journal(folder, "--out")
    else:
        needed = "the same command and version, or another name, or no such folder"
        raise MisuseError("--out", f"{folder}, the journal of another bench", needed)
    with block:
        messages = (message for path in journal.record_files(folder) for _, message in journal.read_messages(path))
        cells = [cell for message in messages if (cell := journal.decode(message, _DECODER)) is not None]
        names = {*header.formulations}
        records = {cell.number: cell.record for cell in cells if cell.record.runs.keys() == names}
        with closing(journal.RecordFile(folder)) as file:
            yield FinishedCells(records, file)


Progress = Callable[[str, int, int], None]  # The next cell in words, the number of finished cells, the number of all


def run_bench(
    subjects: Sequence[Subject | NotLoaded],
    plan: BenchPlan,
    *,
    output: Path | None = None,
    progress: Progress | None = None,
) -> BenchResults:
    """Measure speed and error of formulations on all cells of a plan.

    A journal beside the file `output` keeps what is finished, so that a bench that was killed goes on with the same
    plan. The caller writes the file and removes the journal. `progress` is called before every cell.
    """
    loaded = [subject for subject in subjects if isinstance(subject, Subject)]
    if not loaded:
        raise MisuseError("NAME", "no formulation that loads", "at least one")
    plan, others = match_dimension(plan, loaded)
    loaded = [subject for subject in loaded if subject.name not in others]
    provenance = collect_provenance(profile="", examples=0, seed=plan.seed)
    del provenance["profile"], provenance["examples"]  # A bench has neither.
    provenance |= places(loaded)
    names = [subject.name for subject in loaded]
    with ExitStack() as stack:
        versions = {key: fact for key, fact in provenance.items() if key.endswith("_version") or key == "commit"}
        header = Header(plan, tuple(names), versions)
        finished = stack.enter_context(open_journal(output, header)) if output else None
        records, failures = _run_cells(loaded, plan, finished, progress)
    cells = tuple(cell for cell in plan.cells if cell.scene not in failures)
    if not cells:
        raise MisuseError("--scene", "; ".join(map(": ".join, failures.items())), "a problem that can be posed")
    not_loaded = {item.formulation: item.reason for item in subjects if isinstance(item, NotLoaded)} | plan.not_loaded
    return _collect_results(names, replace(plan, cells=cells), records, not_loaded | failures | others, provenance)


def _run_cells(
    loaded: Sequence[Subject], plan: BenchPlan, finished: FinishedCells | None, progress: Progress | None
) -> tuple[list[dict[Cell, CellRecord]], dict[str, str]]:
    """Return the records of each process by cell, and {problem: its mistake} of those that are not solved further."""
    n_all = len(plan.cells) * plan.processes
    records: list[dict[Cell, CellRecord]] = []
    failures: dict[str, str] = {}
    for process in range(plan.processes):
        for subject in loaded if process else ():
            if isinstance(subject, RemoteSubject):
                subject.host.end()  # The next question starts another process.
        records.append({})
        for place, cell in enumerate(plan.cells):
            if cell.scene in failures:
                continue
            number = process * len(plan.cells) + place
            if progress is not None:
                words = f"{cell.scene}, mesh {cell.mesh}, instance {cell.instance}, process {process + 1}"
                progress(words, number, n_all)
            record = None if finished is None else finished.records.get(number)
            if record is None:
                of_scene = [record for other, record in records[0].items() if other.scene == cell.scene]
                dead = {name for record in of_scene for name, run in record.runs.items() if run.is_lost}
                try:
                    record = run_cell(cell, loaded, plan.seed, solve=process == 0, dead=dead)
                    if finished is not None:
                        finished.add(number, record)
                except MisuseError as error:  # The mistake of a problem.
                    failures[cell.scene] = str(error)
                    continue
            records[-1][cell] = record
    if progress is not None:
        progress("writing", n_all, n_all)
    return records, failures


def _collect_results(
    names: Sequence[str],
    plan: BenchPlan,
    records: Sequence[Mapping[Cell, CellRecord]],
    not_loaded: dict[str, str],
    provenance: dict[str, str],
) -> BenchResults:
    first = [*map(records[0].__getitem__, plan.cells)]
    rows = [[record.runs[name] for record in first] for name in names]
    timed = [process[cell] for process in records for cell in plan.cells]

    def of_solutions(entry: Callable[[SolutionRecord], Any], dtype: type) -> Any:
        """Return an array (n_formulations, n_cells, n_variants, …)."""
        return np.array([[[entry(solution) for solution in run.solutions] for run in row] for row in rows], dtype)

    seconds = np.array([[record.runs[name].evaluation for record in timed] for name in names])
    return BenchResults(
        formulations=tuple(names),
        cells=plan.cells,
        labels={name: problem.label for name, problem in plan.problems.items()},
        targets={name: problem.targets for name, problem in plan.problems.items()},
        segments=np.array([record.segments for record in first], np.int64),
        unknowns=np.array([record.unknowns for record in first], np.int64),
        best_pressure=np.array([record.best_pressure for record in first], np.float64),
        outcomes=of_solutions(lambda solution: solution.outcome, np.int64),
        errors=of_solutions(lambda solution: [solution.errors.get(kind, nan) for kind in ERRORS], np.float64),
        counts=of_solutions(lambda solution: [solution.counts.get(name, 0) for name in COUNTS], np.int64),
        work=np.array([[[run.calls, *run.nonzeros] for run in row] for row in rows]),
        evaluation=seconds.reshape(len(names), len(records), -1).swapaxes(1, 2),
        factorisation=np.array([[run.factorisation for run in row] for row in rows]),
        remarks={
            (name, cell, variant): solution.remark
            for name, row in zip(names, rows, strict=True)
            for cell, run in enumerate(row)
            for variant, solution in enumerate(run.solutions)
            if solution.outcome != Outcome.SOLVED
        },
        not_loaded=not_loaded,
        provenance=provenance,
    )
