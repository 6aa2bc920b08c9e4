"""Derivatives of what a cell computes from its own nodes, and the sparse matrices that they add up to.

A cell has a dozen or two of coordinates. One complex step in each of them, for all cells at once, gives its derivatives
without truncation: f(x + ih) = f(x) + ih f′(x) + O(h²), and h² is lost in roundoff for h = 2^-200.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray

STEP = 2.0**-200
CHUNK = 500  # The number of cells that are differentiated together, so that memory stays small.


def differentiate(function: Callable[..., Array], corners: FloatArray, *others: Array) -> FloatArray:
    """Return the derivatives (n_cells, …, n_corners · 3) of a function of each cell's corners.

    Parameters
    ----------
    function : Callable[..., Array]
        Takes corners (..., n_cells, n_corners, 3) and the other arrays, and returns an array (..., n_cells, …).
    corners : FloatArray, shape (n_cells, n_corners, 3)
        The positions at which the derivatives are taken.
    *others : Array
        Arrays (n_cells, …) that the function takes besides, such as codes of corners; they are not differentiated.
    """
    n_cells, n_corners, _ = corners.shape
    directions = 1j * STEP * np.eye(3 * n_corners).reshape(3 * n_corners, 1, n_corners, 3)
    parts = []
    for first in range(0, max(n_cells, 1), CHUNK):
        chunk = slice(first, first + CHUNK)
        moved = function(corners[chunk] + directions, *(values[chunk] for values in others))
        parts.append(np.moveaxis(moved.imag / STEP, 0, -1))
    return np.concatenate(parts)


def unknowns_of(nodes: IntArray) -> IntArray:
    """Return the unknowns (n_cells, n_corners · 3) of nodes (n_cells, n_corners)."""
    unknowns: IntArray = (3 * nodes[..., None] + np.arange(3)).reshape(len(nodes), 3 * nodes.shape[1])
    return unknowns


def add_blocks(blocks: FloatArray, rows: IntArray, columns: IntArray, shape: tuple[int, int]) -> sparse.csr_array:
    """Return the sum of blocks (n_cells, a, b) at rows (n_cells, a) and columns (n_cells, b) of a matrix."""
    places = (
        np.broadcast_to(rows[:, :, None], blocks.shape).reshape(-1),
        np.broadcast_to(columns[:, None, :], blocks.shape).reshape(-1),
    )
    return sparse.coo_array((blocks.reshape(-1), places), shape=shape).tocsr()


def add_rows(values: Array, rows: IntArray, count: int) -> Array:
    """Return the sums (..., count) of values (..., n_cells, a) at rows (n_cells, a)."""
    sums = np.zeros((count, *values.shape[:-2]), values.dtype)
    np.add.at(sums, rows, np.moveaxis(values, (-2, -1), (0, 1)))
    return np.moveaxis(sums, 0, -1)
