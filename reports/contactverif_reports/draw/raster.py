"""The small picture, made of characters, of an interface that is not flat."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif_reports.draw.case_geometry import Course, Gaps

_HEIGHT = 17  # rows at most
_ASPECT = 2.0  # a character is twice as high as wide
_APART = 2  # rows between surfaces that lie closer than that
_LABELLED = 12  # nodes a side that get their numbers


def raster(case: Case, course: Course, gaps: Gaps, width: int) -> tuple[list[str], str]:
    """Rows of the picture, and what is to be said of it: surfaces that nearly touch are drawn apart."""
    n_slave = case.interface.n_slave_nodes
    positions = case.positions - case.positions.mean(axis=0)
    apart = np.array([-course.direction[1], course.direction[0]]) if course.straight else np.zeros(2)
    rows_of, shift = _fitted(positions, width), 0.0
    if course.straight and np.abs(gaps.gap).max() * rows_of < _APART:
        shift = _APART / rows_of
        moved = positions + (np.arange(len(positions)) < n_slave)[:, None] * shift * apart
        positions, rows_of = moved, _fitted(moved, width)
    cells = _cells(positions, rows_of)
    canvas = [[" "] * width for _ in range(cells[:, 1].max() + 1)]
    for surface, pen in ((case.interface.master, ""), (case.interface.slave, "·")):
        for first, second in surface.segments.tolist():
            _line(canvas, cells[first], cells[second], pen)
    for node, (column, row) in reversed(list(enumerate(cells.tolist()))):
        canvas[row][column] = "●" if node < n_slave else "o"
    if max(n_slave, len(cells) - n_slave) <= _LABELLED:
        for node, (column, row) in enumerate(cells.tolist()):
            _label(canvas, str(node), column, row, above=node < n_slave)
    rows = ["".join(row).rstrip() for row in canvas]
    note = "slave ●··● drawn apart from master o──o" if shift else "slave ●··●, master o──o"
    return rows, note


def _fitted(positions: FloatArray, width: int) -> float:
    """Rows a length, so that the picture fits with room for node numbers."""
    wide, high = np.maximum(np.ptp(positions, axis=0), np.finfo(float).tiny)
    return float(min((width - 9) / _ASPECT / wide, (_HEIGHT - 3) / high))


def _cells(positions: FloatArray, rows_of: float) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    """(n_nodes, 2) column and row of each node, the top row first."""
    moved = positions - [positions[:, 0].min(), positions[:, 1].max()]
    columns = np.round(moved[:, 0] * rows_of * _ASPECT).astype(np.int64) + 4
    rows = np.round(-moved[:, 1] * rows_of).astype(np.int64) + 1
    return np.column_stack([columns, rows])


def _line(canvas: list[list[str]], start: FloatArray, end: FloatArray, pen: str) -> None:
    """A straight line; without a pen, of the characters that lean the way it does."""
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
    """The node number in the first free place around the node; nowhere where none is free."""
    vertical = [(column, row - 1), (column, row + 1)] if above else [(column, row + 1), (column, row - 1)]
    for at, line in [*vertical, (column + 2, row), (column - 1 - len(words), row)]:
        if line == len(canvas):
            canvas.append([" "] * len(canvas[0]))
        place = canvas[line][max(at - 1, 0) : at + len(words) + 1] if line >= 0 else ["x"]
        if at >= 0 and len(place) >= len(words) and all(cell == " " for cell in place):
            canvas[line][at : at + len(words)] = words
            return
