"""The changes from an old report to a new one that are worth a look, though nothing got worse by them.

- Newton needs more than 2 n_old + 2 iterations in the median: an active set may take a few more or fewer.
- A median or worst margin m = value/tolerance within its tolerance is more than 100 times what it was and above 1/10.
  Margins below that may be one roundoff (0.05 where a tolerance is 20 of them), which comes and goes.
"""

from __future__ import annotations

from collections.abc import Sequence

from contactverif_reports.compare.cells import Cell, statistics
from contactverif_reports.compare.comparison import Iterations, count_iterations

ITERATIONS_FACTOR, ITERATIONS_MORE = 2.0, 2.0  # Iterations that grow by no more than factor · n + more are no news.
LEAP = 100.0  # The factor by which a margin within the tolerance must grow to be worth a look.
LEAST_MARGIN = 0.1  # A margin that stays below this is roundoff.


def noteworthy_changes(old: Cell, new: Cell) -> Sequence[str]:
    """Return what is worth a look, in words; both cells are over the same cases."""
    lines = [
        f"{name} error grew within its tolerance, {m_old:.2g} → {m_new:.2g} of it"
        for name, m_old, m_new in statistics(old, new)
        if LEAST_MARGIN < m_new <= 1 and m_new > LEAP * m_old
    ]
    for before, after in paired_iterations(old, new):
        if after.median > ITERATIONS_FACTOR * before.median + ITERATIONS_MORE:
            solution = f" ({after.solution})" if after.solution else ""
            lines.append(f"Newton iterations{solution}, median {before.median:g} → {after.median:g}")
    return lines


def paired_iterations(old: Cell, new: Cell) -> Sequence[tuple[Iterations, Iterations]]:
    """Return the Newton iterations (before, after) of each solution that both kept."""
    by_title: dict[str, list[Iterations]] = {}
    for line in count_iterations([old, new]):
        by_title.setdefault(line.title, []).append(line)
    return [(lines[0], lines[1]) for lines in by_title.values() if len(lines) == 2]
