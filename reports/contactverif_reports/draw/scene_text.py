"""The drawing of two bodies in a few lines of text: blocks with their contact sides to scale, others as silhouettes."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray
from contactverif.contract.body import Body
from contactverif.contract.case import Case
from contactverif_reports.draw.case_geometry import Course, segment_lengths
from contactverif_reports.draw.lengths import unit_of
from contactverif_reports.draw.strips import MASTER_NODE, SLAVE_NODE, draw_strips

_LABEL = 8  # `draw_strips` writes the names of the sides in so many columns.
_HEIGHT = 20  # The largest number of rows of silhouettes.
_ASPECT = 2.0  # A character is twice as high as wide.
_INKS = {"slave": "▒", "master": "░"}


def blocks_as_text(case: Case, slave: Body, master: Body, width: int = 72) -> str:
    """Draw two blocks, whose interface runs straight or nearly so, as text of at most `width` columns, 40 or more.

    Loads on the slave, and on the master beside it, are a row of arrows; a rigid master is hatched.
    """
    course = Course.from_case(case)
    unit, _ = unit_of(np.concatenate(segment_lengths(case)))
    rows, note = draw_strips(case, course, unit, max(width, 40))
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
    """Return the far side of a body and a row with its name, as wide as the nodes of its contact side."""
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


def silhouettes_as_text(case: Case, slave: Body, master: Body, width: int = 72) -> str:
    """Draw two bodies of any shape as text: filled, to scale, with the loads on the slave."""
    inked = [(_INKS["master"], master), (_INKS["slave"], slave)]
    nodes = np.vstack([slave.nodes, master.nodes])
    (left, low), (right, high) = nodes.min(axis=0), nodes.max(axis=0)
    row = max((high - low) / _HEIGHT, (right - left) * _ASPECT / width)  # The height of a row, a length.
    columns, rows = (max(int(np.ceil(size)), 1) for size in ((right - left) * _ASPECT / row, (high - low) / row))
    x = left + (np.arange(columns) + 0.5) * row / _ASPECT
    y = high - (np.arange(rows) + 0.5) * row
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    canvas = np.full(len(places), " ")
    for ink, body in inked:
        canvas[_inside(body, places)] = ink
    lines = ["".join(line) for line in canvas.reshape(rows, columns).tolist()]
    arrows = [" "] * columns
    for place in slave.nodes[(slave.load != 0).any(axis=1)]:
        arrows[min(int((place[0] - left) / row * _ASPECT), columns - 1)] = "↓"
    sides = zip(_INKS, (case.interface.slave, case.interface.master), strict=True)
    legend = [
        f"{_INKS[name]} {name}, {len(side)} segments of {side.lengths(case.positions).min():.3g} or more"
        for name, side in sides
    ]
    return "\n".join(line.rstrip() for line in ["".join(arrows), *lines, *legend])


def _inside(body: Body, places: FloatArray) -> BoolArray:
    """Return (n_places,) whether a place lies in a body: a ray from it crosses the boundary an odd number of times."""
    following = np.roll(body.cells, -1, axis=1)
    edges = {(a, b) for a, b in np.stack([body.cells, following], axis=-1).reshape(-1, 2).tolist()}
    outer = body.nodes[np.array([edge for edge in edges if edge[::-1] not in edges])]  # (n_edges, 2, 2)
    (x1, y1), (x2, y2) = outer[:, 0].T, outer[:, 1].T
    x, y = places.T[:, :, None]
    crosses = (y1 > y) != (y2 > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        right = x < x1 + (y - y1) * (x2 - x1) / (y2 - y1)
    odd: BoolArray = (crosses & right).sum(axis=1) % 2 == 1
    return odd
