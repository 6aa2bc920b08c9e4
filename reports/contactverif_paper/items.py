"""The registry: the items of the paper, in the order of the page, and how they are computed.

A new item is one new line in `ITEMS`. An item computes the same data in every process, and needs nothing that another
item left behind.
"""

from concurrent.futures import Executor
from functools import partial
from typing import Any

from contactverif.plugins.provenance import collect_repeatable_facts
from contactverif.run.scheduler import Job, Scheduler
from contactverif_paper import appendix_a, example_2, lagrange_multipliers, pass_table, patch_tests, tangents
from contactverif_paper.paper_item import Item, ItemResult, Paper, Progress

ITEMS: tuple[Item, ...] = (
    pass_table.ITEM,
    patch_tests.CASE_A1,
    patch_tests.CASE_A2,
    patch_tests.CASE_B,
    patch_tests.SECTION_5_1_3,
    patch_tests.CASE_C,
    tangents.FIG_30,
    tangents.SECTION_6_2,
    tangents.SECTION_6_3,
    lagrange_multipliers.INF_SUP,
    lagrange_multipliers.LAGRANGE_MULTIPLIERS,
    patch_tests.EXAMPLE_1,
    patch_tests.EXAMPLE_1BIS,
    patch_tests.SECTION_7_1,
    example_2.EXAMPLE_2,
    example_2.FIG_39,
    example_2.PEAK,
    appendix_a.ITEM,
)


def compute(
    report_progress: Progress = lambda _: None, *, items: tuple[Item, ...] = ITEMS, executor: Executor | None = None
) -> Paper:
    """Compute the items; the slow ones are begun first where processes share the work."""
    data: dict[int, Any] = {}

    def keep(number: int, answer: Any) -> tuple[()]:
        report_progress(items[number].title)
        data[number] = answer
        return ()

    if executor is None:
        for number, item in enumerate(items):
            report_progress(item.title)
            data[number] = item.compute()
    else:
        numbers = sorted(range(len(items)), key=lambda number: not items[number].slow)
        Scheduler(executor).work(Job(items[n].compute, (), partial(keep, n)) for n in numbers)
    results = [
        ItemResult(item, data[n], tuple(item.statements(data[n])), tuple(item.tables(data[n])))
        for n, item in enumerate(items)
    ]
    return Paper(tuple(results), collect_repeatable_facts())


def steps(items: tuple[Item, ...] = ITEMS) -> int:
    """Return how many times `compute` and `write` together report progress."""
    return sum(1 + len(item.figures) for item in items)
