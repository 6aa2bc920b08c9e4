"""The reference paper, computed again: each of its items in one file, which computes, draws and states it.

`items.py` lists the items, `paper_item.py` says what an item is. Everything else works on any list of items.
"""

from __future__ import annotations

from contactverif_paper.paper_run import compute, steps

__all__ = ["compute", "steps"]
