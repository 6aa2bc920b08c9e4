"""What is worth a look from an old report to a new one on the same cases, though nothing got worse by it.

- Newton needs more than 2 n_old + 2 iterations in the median: an active set may take a few more or fewer.
- A median or worst margin m = value/tolerance within its tolerance is more than 100 times what it was and above 1/10.
  Margins below that may be one roundoff (0.05 where a tolerance is 20 of them), which comes and goes.
"""

from __future__ import annotations

from collections.abc import Sequence

from contactverif_reports.compare.cells import Cell, statistics
from contactverif_reports.compare.comparison import Iterations, iterations

FACTOR, MORE = 2.0, 2.0  # of iterations, and iterations beside it, that are no news
LEAP, LEAST = 100.0, 0.1  # of a margin within the tolerance, and how large it then is


def noteworthy(old: Cell, new: Cell) -> Sequence[str]:
    """In words, of cells over the same cases; empty where there is nothing to look at."""
    found = [
        f"{name} error grew within its tolerance, {m_old:.2g} → {m_new:.2g} of it"
        for name, m_old, m_new in statistics(old, new)
        if LEAST < m_new <= 1 and m_new > LEAP * m_old
    ]
    for before, after in solves(old, new):
        if after.median > FACTOR * before.median + MORE:
            what = f" ({after.what})" if after.what else ""
            found.append(f"Newton iterations{what}, median {before.median:g} → {after.median:g}")
    return found


def solves(old: Cell, new: Cell) -> Sequence[tuple[Iterations, Iterations]]:
    """Newton iterations, before and after, of each solution that both kept."""
    by_title: dict[str, list[Iterations]] = {}
    for line in iterations([old, new]):
        by_title.setdefault(line.title, []).append(line)
    return [(lines[0], lines[1]) for lines in by_title.values() if len(lines) == 2]
