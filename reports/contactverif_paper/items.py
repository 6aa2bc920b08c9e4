"""The registry: the items of the paper, in the order of the page.

A new item is one new file and one line in `ORDER`.
"""

from __future__ import annotations

from importlib import import_module

from contactverif_paper.paper_item import Item

ORDER = (
    "pass_table",
    "case_a1",
    "case_a2",
    "case_b",
    "section_5_1_3",
    "case_c",
    "fig30_convergence",
    "section_6_2",
    "section_6_3",
    "inf_sup_condition",
    "locking",
    "lagrange_multipliers",
    "example_1",
    "example_1bis",
    "section_7_1",
    "example_2",
    "fig39_difference",
    "example_2_peak",
    "appendix_a",
    "defect_tilt",
    "defect_jump",
    "free_ends",
)


def load_item(name: str) -> Item:
    """Return the item of a file of this package."""
    item: Item = import_module(f"contactverif_paper.{name}").ITEM
    return item


ITEMS: tuple[Item, ...] = tuple(load_item(name) for name in ORDER)
