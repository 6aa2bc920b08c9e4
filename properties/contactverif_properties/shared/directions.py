"""Random directions in which a property moves the unknowns of a case, always the same ones for the same seed."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import FloatArray


def random_moves(seed: int, count: int, size: int) -> FloatArray:
    """Draw vectors (count, size) whose entries are uniform in [−1, 1]."""
    return np.random.default_rng(seed).uniform(-1, 1, (count, size))


def random_directions(seed: int, count: int, size: int) -> FloatArray:
    """Draw directions (count, size): random moves, each divided by its largest entry in absolute value.

    Parameters
    ----------
    seed : int
        The seed of the case, so that a case is always judged in the same directions.
    count : int
        The number of directions.
    size : int
        The number of unknowns.

    Returns
    -------
    FloatArray, shape (count, size)
        Entries in [−1, 1]; the largest of each direction is ±1.
    """
    moves = random_moves(seed, count, size)
    directions: FloatArray = moves / np.abs(moves).max(axis=1, keepdims=True)
    return directions
