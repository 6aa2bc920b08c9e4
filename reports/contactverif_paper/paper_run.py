"""Computes the items of the paper, one after the other. This file knows the registry and no item."""

from __future__ import annotations

from contactverif.run.provenance import collect_provenance
from contactverif_paper.items import ITEMS
from contactverif_paper.paper_item import Item, ItemResult, Paper, Progress, steps_of


def compute(
    report_progress: Progress = lambda _: None, *, with_study: bool = True, items: tuple[Item, ...] = ITEMS
) -> Paper:
    """Compute the items.

    Parameters
    ----------
    report_progress : Progress
        Is called with a few words before each step.
    with_study : bool
        False leaves out the items that take most of the time: Example 2 on finer meshes.
    items : tuple[Item, ...]
        The items, in the order of the page.

    Returns
    -------
    Paper
        The data of each item, its statements and its tables.
    """
    results = tuple(_result(item, report_progress) for item in _select(items, with_study=with_study))
    return Paper(results, _provenance())


def steps(*, with_study: bool = True, items: tuple[Item, ...] = ITEMS) -> int:
    """Return how many times `compute` and `write` together report progress."""
    return steps_of(_select(items, with_study=with_study))


def _select(items: tuple[Item, ...], *, with_study: bool) -> tuple[Item, ...]:
    return tuple(item for item in items if with_study or not item.slow)


def _result(item: Item, report_progress: Progress) -> ItemResult:
    data = item.compute(report_progress)
    return ItemResult(item, data, item.statements(data), item.tables(data))


def _provenance() -> dict[str, str]:
    """Return the versions and the commit: only what a second run repeats."""
    facts = collect_provenance(profile="", examples=0, seed=0)
    return {name: value for name, value in facts.items() if name.endswith("_version") or name == "commit"}
