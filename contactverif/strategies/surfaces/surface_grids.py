"""Grids of faces on a square: nodes moved inside their cells, cells cut along either diagonal, or left whole.

The square is [0, 1]², and every coordinate is a multiple of 2^-20, so that oracles in rationals see the numbers that a
formulation sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.faces import TRIANGLE
from contactverif.strategies.panels import on_lattice
from contactverif.strategies.parts import repeat_cyclically

MOST_CELLS = 6  # The most cells along a side.
FURTHEST_MOVE = 14  # The largest move in 64ths of a cell; at 16 a triangle could lose its area.


@dataclass(frozen=True, slots=True)
class SurfaceGrid:
    """A grid on the unit square."""

    columns: int
    rows: int
    moves: Sequence[int]  # The moves of the nodes along and across in 64ths of a cell, dealt out in turn.
    diagonals: Sequence[int]  # The diagonal of each cell, 0 or 1, dealt out in turn.
    corners: int = TRIANGLE  # The corners of a face: 4 leaves the cells whole.
    straight: bool = False  # Whole lines of nodes move, so that all cells are rectangles.

    def points(self) -> FloatArray:
        """Return the nodes (n, 2); those on the border stay on it."""
        shape = (self.columns + 1, self.rows + 1)
        move = repeat_cyclically(self.moves, 2 * shape[0] * shape[1]).reshape(*shape, 2) / 64
        if self.straight:
            move[..., 0], move[..., 1] = move[:, :1, 0], move[:1, :, 1]
        move[[0, -1], :, 0] = move[:, [0, -1], 1] = 0.0
        place = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1) + move
        return on_lattice((place / [self.columns, self.rows]).reshape(-1, 2))

    @property
    def choices(self) -> IntArray:
        """The diagonal of each cell (n_cells,)."""
        return repeat_cyclically(self.diagonals, self.columns * self.rows).astype(np.int64)

    def with_ring(self) -> SurfaceGrid:
        """Return a grid with one more cell on each side, in which the cells of this grid keep their diagonals."""
        choices = np.pad(self.choices.reshape(self.columns, self.rows), 1).reshape(-1)
        return replace(self, columns=self.columns + 2, rows=self.rows + 2, diagonals=choices.tolist())

    def faces(self) -> IntArray:
        """Return the faces (n_faces, corners), counter-clockwise in the plane."""
        return self.triangles() if self.corners == TRIANGLE else self.quadrilaterals()

    def triangles(self) -> IntArray:
        """Return the faces (2 · n_cells, 3), counter-clockwise in the plane."""
        a, b, c, d = self.quadrilaterals().T
        choice = self.choices[:, None] == 0
        first = np.where(choice, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
        second = np.where(choice, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
        return np.stack([first, second], axis=1).reshape(-1, 3)

    def quadrilaterals(self) -> IntArray:
        """Return the cells (n_cells, 4), counter-clockwise in the plane."""
        n = np.arange((self.columns + 1) * (self.rows + 1)).reshape(self.columns + 1, -1)
        return np.stack([n[:-1, :-1], n[1:, :-1], n[1:, 1:], n[:-1, 1:]], axis=-1).reshape(-1, 4)


@cache
def surface_grids(
    *, most: int = MOST_CELLS, faces: tuple[int, ...] = (TRIANGLE,), straight: bool = False
) -> SearchStrategy[SurfaceGrid]:
    """Return grids of 1 × 1 to `most` × `most` cells; they shrink to one cell that is cut along its first diagonal.

    `faces` are the numbers of corners that a face may have. Quadrilaterals are rectangles if they are `straight`.
    """
    cells = st.integers(1, most)
    moves = st.lists(st.integers(-FURTHEST_MOVE, FURTHEST_MOVE), min_size=1, max_size=12)
    diagonals = st.lists(st.integers(0, 1), min_size=1, max_size=8)
    if faces == (TRIANGLE,):
        return st.builds(SurfaceGrid, cells, cells, moves, diagonals)
    kinds = st.sampled_from([(corners, straight and corners != TRIANGLE) for corners in faces])
    return st.builds(
        lambda kind, columns, rows, moves, diagonals: SurfaceGrid(columns, rows, moves, diagonals, *kind),
        *(kinds, cells, cells, moves, diagonals),
    )
