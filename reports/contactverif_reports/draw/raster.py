"""The small picture, made of characters, of an interface that is not flat."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif_reports.draw.case_geometry import Course, Gaps

_HEIGHT = 17  # The largest number of rows.
_ASPECT = 2.0  # A character is twice as high as wide.
_DISTANCE = 2  # Rows between surfaces that would be nearer to each other.
_LABELLED = 12  # The nodes get their numbers if a side has at most so many.


def draw_raster(case: Case, course: Course, gaps: Gaps, width: int) -> tuple[list[str], str]:
    """Draw an interface to scale in so many columns; surfaces that nearly touch are drawn apart."""
    n_slave = case.interface.n_slave_nodes
    positions, is_apart = _positions_to_draw(case, course, gaps, width)
    cells = _cells(positions, _rows_per_length(positions, width))
    canvas = [[" "] * width for _ in range(cells[:, 1].max() + 1)]
    for surface, pen in ((case.interface.master, ""), (case.interface.slave, "·")):
        for first, second in surface.segments.tolist():
            _line(canvas, cells[first], cells[second], pen)
    _draw_nodes(canvas, cells, n_slave)
    rows = ["".join(row).rstrip() for row in canvas]
    return rows, "slave ●··● drawn apart from master o──o" if is_apart else "slave ●··●, master o──o"


def _positions_to_draw(case: Case, course: Course, gaps: Gaps, width: int) -> tuple[FloatArray, bool]:
    """Return positions (n_nodes, 2), and whether the slave is moved away from the master."""
    positions = case.positions - case.positions.mean(axis=0)
    if not course.straight:
        return positions, False
    rows_per_length = _rows_per_length(positions, width)
    if np.abs(gaps.gap).max() * rows_per_length >= _DISTANCE:
        return positions, False
    left = np.array([-course.direction[1], course.direction[0]])
    is_slave = np.arange(len(positions)) < case.interface.n_slave_nodes
    return positions + is_slave[:, None] * _DISTANCE / rows_per_length * left, True


def _draw_nodes(canvas: list[list[str]], cells: IntArray, n_slave: int) -> None:
    """Draw the nodes and, if there are few, their numbers."""
    for node, (column, row) in reversed(list(enumerate(cells.tolist()))):
        canvas[row][column] = "●" if node < n_slave else "o"
    if max(n_slave, len(cells) - n_slave) <= _LABELLED:
        for node, (column, row) in enumerate(cells.tolist()):
            _label(canvas, str(node), column, row, above=node < n_slave)


def _rows_per_length(positions: FloatArray, width: int) -> float:
    """Return how many rows a unit of length takes, so that the picture fits with room for node numbers."""
    across, high = np.maximum(np.ptp(positions, axis=0), np.finfo(float).tiny)
    return float(min((width - 9) / _ASPECT / across, (_HEIGHT - 3) / high))


def _cells(positions: FloatArray, rows_per_length: float) -> IntArray:
    """Return (n_nodes, 2) column and row of each node, the top row first."""
    offsets = positions - [positions[:, 0].min(), positions[:, 1].max()]
    columns = np.round(offsets[:, 0] * rows_per_length * _ASPECT).astype(np.int64) + 4
    rows = np.round(-offsets[:, 1] * rows_per_length).astype(np.int64) + 1
    return np.column_stack([columns, rows])


def _line(canvas: list[list[str]], start: IntArray, end: IntArray, pen: str) -> None:
    """Draw a straight line; without a pen, of characters that lean as the line does."""
    columns, rows = (int(step) for step in end - start)
    steps = max(abs(columns), abs(rows), 1)
    if not pen:
        lean = abs(rows) * _ASPECT / max(abs(columns), 1)
        pen = "─" if lean < 0.5 else "│" if lean > 4 else "╲" if rows * columns > 0 else "╱"
    for step in range(steps + 1):
        column = int(start[0]) + round(step * columns / steps)
        row = int(start[1]) + round(step * rows / steps)
        canvas[row][column] = pen


def _label(canvas: list[list[str]], words: str, column: int, row: int, *, above: bool) -> None:
    """Write a node number at the first free place beside the node, if there is one."""
    vertical = [(column, row - 1), (column, row + 1)] if above else [(column, row + 1), (column, row - 1)]
    for at, line in [*vertical, (column + 2, row), (column - 1 - len(words), row)]:
        if line == len(canvas):
            canvas.append([" "] * len(canvas[0]))
        place = canvas[line][max(at - 1, 0) : at + len(words) + 1] if line >= 0 else ["x"]
        if at >= 0 and len(place) >= len(words) and all(cell == " " for cell in place):
            canvas[line][at : at + len(words)] = words
            return
