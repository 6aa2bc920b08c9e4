"""The registry: the items of the paper, in the order of the page, and how they are computed.

A new item is one new line in `ITEMS`. An item computes the same data in every process, and needs nothing that another
item left behind.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from typing import Any

from contactverif.plugins.provenance import collect_repeatable_facts
from contactverif.run.scheduler import Job, Scheduler
from contactverif_paper import (
    appendix_a,
    disk_studies,
    example_2,
    fig30_convergence,
    lagrange_multipliers,
    pass_table,
    patch_cases,
    tangents,
)
from contactverif_paper.paper_item import Item, ItemResult, Paper, Progress

ITEMS: tuple[Item, ...] = (
    pass_table.ITEM,
    patch_cases.CASE_A1,
    patch_cases.CASE_A2,
    patch_cases.CASE_B,
    patch_cases.SECTION_5_1_3,
    patch_cases.CASE_C,
    fig30_convergence.ITEM,
    tangents.SECTION_6_2,
    tangents.SECTION_6_3,
    lagrange_multipliers.INF_SUP,
    lagrange_multipliers.LAGRANGE_MULTIPLIERS,
    patch_cases.EXAMPLE_1,
    patch_cases.EXAMPLE_1BIS,
    patch_cases.SECTION_7_1,
    example_2.ITEM,
    disk_studies.FIG_39,
    disk_studies.PEAK,
    appendix_a.ITEM,
)


def compute(
    report_progress: Progress = lambda _: None,
    *,
    with_study: bool = True,
    items: tuple[Item, ...] = ITEMS,
    executor: Executor | None = None,
) -> Paper:
    """Compute the items, without the slow ones unless `with_study`."""
    selection = _select(items, with_study=with_study)
    data = _compute_all(selection, report_progress, executor)
    results = [ItemResult(item, each, tuple(item.statements(each)), tuple(item.tables(each))) for item, each in data]
    return Paper(tuple(results), collect_repeatable_facts())


def steps(*, with_study: bool = True, items: tuple[Item, ...] = ITEMS) -> int:
    """Return how many times `compute` and `write` together report progress."""
    return sum(item.n_steps + len(item.figures) for item in _select(items, with_study=with_study))


def _select(items: tuple[Item, ...], *, with_study: bool) -> tuple[Item, ...]:
    return tuple(item for item in items if with_study or not item.slow)


def _compute_all(
    items: tuple[Item, ...], report_progress: Progress, executor: Executor | None
) -> list[tuple[Item, Any]]:
    """Return each item with its data, in their order; the slow ones are begun first where processes share the work."""
    if executor is None:
        return [(item, item.compute(report_progress)) for item in items]
    data: dict[int, Any] = {}

    def keep(number: int, answer: Any) -> tuple[()]:
        data[number] = answer
        for _ in range(items[number].n_steps):
            report_progress(items[number].title)
        return ()

    numbers = sorted(range(len(items)), key=lambda number: not items[number].slow)
    Scheduler(executor).work(Job(_data_of, (items[n].compute,), partial(keep, n)) for n in numbers)
    return [(item, data[number]) for number, item in enumerate(items)]


def _data_of(compute_item: Callable[[Progress], Any]) -> Any:
    return compute_item(lambda _: None)  # A worker has nobody to report to.
