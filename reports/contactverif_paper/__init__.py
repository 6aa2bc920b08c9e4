"""The reference paper, computed again: `items` lists the items, and `paper_item` says what an item is."""

from contactverif_paper.items import compute, steps

__all__ = ["compute", "steps"]
