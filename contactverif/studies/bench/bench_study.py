"""The bench: all cells of a plan, in one process of each formulation after another, with a journal that survives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from contactverif.contract.errors import MisuseError
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.isolation.remote_formulation import RemoteSubject, places
from contactverif.plugins.provenance import collect_provenance
from contactverif.studies.bench.bench_journal import Header, Journal
from contactverif.studies.bench.bench_plan import BenchPlan
from contactverif.studies.bench.cell_runs import CellRecord, RunRecord, SolutionRecord, run_cell
from contactverif_reports.bench.results import COUNTS, ERRORS, BenchResults, Outcome

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
        header = Header.from_plan(plan, names, provenance)
        journal = stack.enter_context(closing(Journal(output, header))) if output else None
        records = _run_cells(loaded, plan, journal, progress or _show_nothing)
    not_loaded = {item.formulation: item.reason for item in subjects if isinstance(item, NotLoaded)} | plan.not_loaded
    return collect_results(names, plan, records, not_loaded, provenance)


def _show_nothing(description: str, n_finished: int, n_planned: int) -> None:
    """Take the progress of a bench that nobody looks at."""


def _run_cells(
    loaded: Sequence[Subject], plan: BenchPlan, journal: Journal | None, progress: Progress
) -> list[list[CellRecord]]:
    """Return the records of all cells in each process, those of the journal without running them again."""
    n_cells = len(plan.cells)
    records: list[list[CellRecord]] = []
    for process in range(plan.processes):
        for subject in loaded if process else ():
            if isinstance(subject, RemoteSubject):
                subject.host.end()  # The next question starts another process.
        records.append([])
        for place, cell in enumerate(plan.cells):
            number = process * n_cells + place
            words = f"{cell.scene}, mesh {cell.mesh}, instance {cell.instance}, process {process + 1}"
            progress(words, number, n_cells * plan.processes)
            record = journal.finished.get(number) if journal is not None else None
            if record is None:
                record = run_cell(cell, loaded, plan.seed, solve=process == 0)
                if journal is not None:
                    journal.add(number, record)
            records[-1].append(record)
    progress("writing", n_cells * plan.processes, n_cells * plan.processes)
    return records


def collect_results(
    names: Sequence[str],
    plan: BenchPlan,
    records: Sequence[Sequence[CellRecord]],
    not_loaded: dict[str, str],
    provenance: dict[str, str],
) -> BenchResults:
    """Return the records of all processes and cells as arrays."""
    first = records[0]
    rows = [[record.runs[name] for record in first] for name in names]
    seconds = _array_of_runs([cell for process in records for cell in process], names, lambda run: run.evaluation)
    return BenchResults(
        formulations=tuple(names),
        cells=plan.cells,
        labels=plan.labels,
        targets=plan.targets,
        segments=np.array([record.segments for record in first], np.int64),
        unknowns=np.array([record.unknowns for record in first], np.int64),
        best_pressure=np.array([record.best_pressure for record in first], np.float64),
        outcomes=_array(rows, lambda solution: solution.outcome, np.int64),
        errors=_array(rows, lambda solution: [solution.errors.get(kind, nan) for kind in ERRORS], np.float64),
        counts=_array(rows, lambda solution: [solution.counts.get(name, 0) for name in COUNTS], np.int64),
        work=_array_of_runs(first, names, lambda run: [run.calls, *run.nonzeros]),
        evaluation=seconds.reshape(len(names), len(records), -1).swapaxes(1, 2),
        factorisation=_array_of_runs(first, names, lambda run: run.factorisation),
        remarks=_list_remarks(names, rows),
        not_loaded=not_loaded,
        provenance=provenance,
    )


def _array_of_runs(records: Sequence[CellRecord], names: Sequence[str], entry: Callable[[RunRecord], Any]) -> Any:
    """Return an array (n_formulations, n_records, …) of what `entry` gives for each run."""
    return np.array([[entry(record.runs[name]) for record in records] for name in names])


def _list_remarks(names: Sequence[str], rows: list[list[RunRecord]]) -> dict[tuple[str, int, int], str]:
    """Return {(formulation, cell, variant): how it ended} of the runs without a solution."""
    return {
        (name, cell, variant): solution.remark
        for name, row in zip(names, rows, strict=True)
        for cell, run in enumerate(row)
        for variant, solution in enumerate(run.solutions)
        if solution.outcome != Outcome.SOLVED
    }


def _array(rows: list[list[RunRecord]], entry: Callable[[SolutionRecord], Any], dtype: type) -> Any:
    """Return an array (n_formulations, n_cells, n_variants, …) of what `entry` gives for each solution."""
    return np.array([[[entry(solution) for solution in run.solutions] for run in row] for row in rows], dtype)
