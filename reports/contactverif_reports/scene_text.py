"""Draws two blocks, one on the other, in a few lines of text: their meeting sides to scale, the bodies as boxes."""

from __future__ import annotations

import numpy as np

from contactverif.body import Body
from contactverif.case import Case
from contactverif_reports.geometry import Course
from contactverif_reports.lengths import unit_of
from contactverif_reports.strips import MASTER_NODE, SLAVE_NODE, strips

_LABEL = 8  # columns that `strips` writes the sides' names in


def blocks_as_text(case: Case, slave: Body, master: Body, width: int = 72) -> str:
    """The blocks of a case as text of at most `width` columns (at least 40), lines separated by newlines.

    The interface has to run straight, or nearly so. What presses on the slave, and on the master beside it, is a row of
    arrows; a rigid master is hatched.
    """
    course = Course.of(case)
    lengths = [side.lengths(case.positions) for side in (case.interface.slave, case.interface.master)]
    rows, note = strips(case, course, unit_of(np.concatenate(lengths))[0], max(width, 40))
    upper, lower = (row[_LABEL:] for row in rows[1:3])
    top = _box(upper, SLAVE_NODE, "slave", ("┌", "┐"))
    if (slave.load != 0).any() or (slave.imposed != 0).any():
        top.insert(0, _arrows(upper, SLAVE_NODE))
    if (master.load[master.contact_nodes] != 0).any():
        beside = _arrows(lower, MASTER_NODE).ljust(len(lower))
        first, last = upper.index(SLAVE_NODE), upper.rindex(SLAVE_NODE)
        upper = f"{beside[: first - 1]} {upper[first : last + 1]} {beside[last + 2 :]}"
    bottom = _rigid(lower) if master.rigid else _box(lower, MASTER_NODE, "master", ("└", "┘"))[::-1]
    return "\n".join(line.rstrip() for line in [*top, upper, lower, *bottom, *([note] if note else [])])


def _box(side: str, node: str, name: str, corners: tuple[str, str]) -> list[str]:
    """The far side of a body and a row with its name, as wide as the nodes of its meeting side."""
    first, last = side.index(node), side.rindex(node)
    inner = last - first - 1
    left, right = corners
    return [f"{' ' * first}{left}{'─' * inner}{right}", f"{' ' * first}│{name.center(inner)}│"]


def _arrows(side: str, node: str) -> str:
    first, last = side.index(node), side.rindex(node)
    marks = ["↓" if (column - first) % 4 == (last - first) % 4 // 2 else " " for column in range(first, last + 1)]
    return " " * first + "".join(marks)


def _rigid(side: str) -> list[str]:
    first, last = side.index(MASTER_NODE), side.rindex(MASTER_NODE)
    return [f"{' ' * first}{'/' * (last - first + 1)}"]
