"""The bench: all cells of a plan, in one process of each formulation after another, with a journal that survives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from contactverif.contract.errors import MisuseError
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.isolation.remote import RemoteSubject, places
from contactverif.plugins.provenance import collect_provenance
from contactverif.studies.bench.bench_journal import FinishedCells, Header, open_journal
from contactverif.studies.bench.bench_plan import BenchPlan
from contactverif.studies.bench.cell_runs import CellRecord, RunRecord, SolutionRecord, run_cell
from contactverif_reports.bench.results import COUNTS, ERRORS, BenchResults, Cell, Outcome

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
        cells = stack.enter_context(open_journal(output, header)) if output else None
        records, failures = _run_cells(loaded, plan, cells, progress or _show_nothing)
    measured = _measured_cells(plan, failures)
    not_loaded = {item.formulation: item.reason for item in subjects if isinstance(item, NotLoaded)} | plan.not_loaded
    return collect_results(names, replace(plan, cells=measured), records, not_loaded | failures, provenance)


def _show_nothing(description: str, n_finished: int, n_planned: int) -> None:
    """Take the progress of a bench that nobody looks at."""


def _measured_cells(plan: BenchPlan, failures: dict[str, str]) -> tuple[Cell, ...]:
    """Return the cells of the problems that did not fail; that there are none is a mistake."""
    cells = tuple(cell for cell in plan.cells if cell.scene not in failures)
    if not cells:
        raise MisuseError("--scene", "; ".join(map(": ".join, failures.items())), "a problem that can be posed")
    return cells


def _run_cells(
    loaded: Sequence[Subject], plan: BenchPlan, finished: FinishedCells | None, progress: Progress
) -> tuple[list[dict[Cell, CellRecord]], dict[str, str]]:
    """Return the records of each process by cell, and {problem: its mistake} of those that are not solved further."""
    n_cells = len(plan.cells)
    records: list[dict[Cell, CellRecord]] = []
    failures: dict[str, str] = {}
    for process in range(plan.processes):
        if process:
            _end_processes(loaded)
        records.append({})
        for place, cell in enumerate(plan.cells):
            if cell.scene in failures:
                continue
            number = process * n_cells + place
            words = f"{cell.scene}, mesh {cell.mesh}, instance {cell.instance}, process {process + 1}"
            progress(words, number, n_cells * plan.processes)
            run = partial(
                run_cell, cell, loaded, plan.seed, solve=process == 0, dead=_find_dead(records[0], cell.scene)
            )
            try:
                records[-1][cell] = _run_unless_finished(finished, number, run)
            except MisuseError as error:  # The mistake of a problem.
                failures[cell.scene] = str(error)
    progress("writing", n_cells * plan.processes, n_cells * plan.processes)
    return records, failures


def _find_dead(records: Mapping[Cell, CellRecord], scene: str) -> set[str]:
    """Return the names of the formulations that ended their process in all solutions of a cell of a scene."""
    of_scene = [record for cell, record in records.items() if cell.scene == scene]
    return {name for record in of_scene for name, run in record.runs.items() if run.is_lost}


def _run_unless_finished(finished: FinishedCells | None, number: int, run: Callable[[], CellRecord]) -> CellRecord:
    """Return the record that the journal has under a number; run the cell and note it if there is none."""
    if finished is None:
        return run()
    if number not in finished.records:
        finished.add(number, run())
    return finished.records[number]


def _end_processes(subjects: Sequence[Subject]) -> None:
    """End the processes of plugins; the next question to each starts another one."""
    for subject in subjects:
        if isinstance(subject, RemoteSubject):
            subject.host.end()


def collect_results(
    names: Sequence[str],
    plan: BenchPlan,
    records: Sequence[Mapping[Cell, CellRecord]],
    not_loaded: dict[str, str],
    provenance: dict[str, str],
) -> BenchResults:
    """Return the records of all processes and cells as arrays."""
    first = [*map(records[0].__getitem__, plan.cells)]
    rows = [[record.runs[name] for record in first] for name in names]
    timed = [process[cell] for process in records for cell in plan.cells]
    seconds = _array_of_runs(timed, names, lambda run: run.evaluation)
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
