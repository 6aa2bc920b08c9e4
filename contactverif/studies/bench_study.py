"""The bench: all cells of a plan, in one process of each formulation after another, with a journal that survives."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from contactverif.contract.errors import MisuseError
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.isolation.remote import RemoteSubject, places
from contactverif.plugins.provenance import collect_provenance
from contactverif.run import journal
from contactverif.studies.bench_cells import CellRecord, SolutionRecord, run_cell
from contactverif.studies.bench_plan import BenchPlan
from contactverif_reports.bench_results import COUNTS, ERRORS, BenchResults, Cell, Outcome


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
    return _collect_results(names, replace(plan, cells=cells), records, not_loaded | failures, provenance)


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
