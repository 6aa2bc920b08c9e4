"""The bench: all cells of a plan, one after the other, with a journal that survives a kill."""

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
from contactverif.run.provenance import collect_provenance
from contactverif.studies.bench.bench_journal import Header, Journal
from contactverif.studies.bench.bench_plan import BenchPlan
from contactverif.studies.bench.cell_runs import CellRecord, RunRecord, run_cell
from contactverif_reports.bench.results import COUNTS, ERRORS, PARTS, BenchResults, Outcome

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
) -> list[CellRecord]:
    """Return the records of all cells, those of the journal without running them again."""
    records = []
    for number, cell in enumerate(plan.cells):
        progress(f"{cell.scene}, mesh {cell.mesh}, penalty {cell.stiffness:g}", number, len(plan.cells))
        if journal is not None and number in journal.finished:
            records.append(journal.finished[number])
            continue
        records.append(run_cell(cell, loaded, plan.repeats, plan.seed))
        if journal is not None:
            journal.add(number, records[-1])
    progress("writing", len(plan.cells), len(plan.cells))
    return records


def collect_results(
    names: Sequence[str],
    plan: BenchPlan,
    records: Sequence[CellRecord],
    not_loaded: dict[str, str],
    provenance: dict[str, str],
) -> BenchResults:
    """Return the records of all cells as arrays."""
    rows = [[record.runs[name] for record in records] for name in names]
    nothing = [nan] * plan.repeats
    return BenchResults(
        formulations=tuple(names),
        cells=plan.cells,
        labels=plan.labels,
        units=plan.units,
        segments=np.array([record.segments for record in records], np.int64),
        unknowns=np.array([record.unknowns for record in records], np.int64),
        outcomes=_array(rows, lambda run: run.outcome, np.int64),
        errors=_array(rows, lambda run: [run.errors.get(kind, nan) for kind in ERRORS], np.float64),
        counts=_array(rows, lambda run: [run.counts.get(name, 0) for name in COUNTS], np.int64),
        seconds=_array(rows, lambda run: [run.seconds.get(part, nothing) for part in PARTS], np.float64),
        wall=_array(rows, lambda run: run.wall or nothing, np.float64),
        yardstick=np.array([record.yardstick for record in records], np.float64),
        remarks=_list_remarks(names, rows),
        not_loaded=not_loaded,
        provenance=provenance,
    )


def _list_remarks(names: Sequence[str], rows: list[list[RunRecord]]) -> dict[tuple[str, int], str]:
    """Return {(formulation, number of the cell): how it ended} of the runs without a solution."""
    return {
        (name, number): run.remark
        for name, row in zip(names, rows, strict=True)
        for number, run in enumerate(row)
        if run.outcome != Outcome.SOLVED
    }


def _array(rows: list[list[RunRecord]], entry: Callable[[RunRecord], Any], dtype: type) -> Any:
    """Return an array (n_formulations, n_cells, …) of what `entry` gives for each run."""
    return np.array([[entry(run) for run in row] for row in rows], dtype)
