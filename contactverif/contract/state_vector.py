"""The layout of a state z: the positions of all nodes, and behind them the multipliers of a formulation that has some.

This layout is known here and in `Case` alone. Plugins split a state with these functions and
join the rows of their residual with `join_rows`.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.interface import Interface


def split_states(interface: Interface, z: Array) -> tuple[Array, Array]:
    """Return contiguous copies of the positions (n_states, n_nodes, dim) and the multipliers (n_states, n_multipliers).

    The states z (..., n_unknowns + n_multipliers) are real or complex; their leading axes become one.
    """
    states = z.reshape(-1, z.shape[-1])
    n_unknowns = interface.n_unknowns
    positions = np.array(states[:, :n_unknowns]).reshape(len(states), *interface.nodes.shape)
    return positions, np.array(states[:, n_unknowns:])


def split_state(interface: Interface, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return copies of the positions (n_nodes, dim) and the multipliers of one state (n_unknowns + n_multipliers,)."""
    n_unknowns = interface.n_unknowns
    return np.array(z[:n_unknowns]).reshape(interface.nodes.shape), np.array(z[n_unknowns:])


def join_rows(forces: Array, constraints: Array, z: Array) -> Array:
    """Join forces (n_states, n_nodes, dim) and constraint rows (n_states, n_multipliers) to a residual of z's shape."""
    if not constraints.size:
        return forces.reshape(z.shape)
    return np.concatenate([forces.reshape(len(forces), -1), constraints], axis=1).reshape(z.shape)
