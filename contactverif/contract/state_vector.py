"""The layout of a state z: the positions of all nodes, and behind them the multipliers of a formulation that has some.

Rule for the next editor: this layout is known here and in `Case` alone. Plugins split a state with these functions and
join the rows of their residual with `join_rows`.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.interface import Interface


def split_states(interface: Interface, z: Array) -> tuple[Array, Array]:
    """Split a batch of states into positions and multipliers.

    Parameters
    ----------
    interface : Interface
        The interface whose nodes the states move.
    z : Array, shape (..., n_unknowns + n_multipliers)
        States, real or complex.

    Returns
    -------
    positions : Array, shape (n_states, n_nodes, dim)
        A contiguous copy, with all leading axes of z made one.
    multipliers : Array, shape (n_states, n_multipliers)
        A contiguous copy.
    """
    states = z.reshape(-1, z.shape[-1])
    n_unknowns = interface.n_unknowns
    positions = np.array(states[:, :n_unknowns]).reshape(len(states), *interface.nodes.shape)
    return positions, np.array(states[:, n_unknowns:])


def split_state(interface: Interface, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Split one state, of shape (n_unknowns + n_multipliers,), as `split_states` does without the leading axis."""
    positions, multipliers = split_states(interface, z)
    return positions[0], multipliers[0]


def join_rows(forces: Array, constraints: Array, z: Array) -> Array:
    """Join forces and constraint rows to the residual of the states z.

    Parameters
    ----------
    forces : Array, shape (n_states, n_nodes, dim)
        The rows of the positions.
    constraints : Array, shape (n_states, n_multipliers)
        The rows of the multipliers; n_multipliers may be 0.
    z : Array, shape (..., n_unknowns + n_multipliers)
        The states, for their shape.

    Returns
    -------
    Array, shape (..., n_unknowns + n_multipliers)
        The residual, in the shape of z.
    """
    if not constraints.size:
        return forces.reshape(z.shape)
    return np.concatenate([forces.reshape(len(forces), -1), constraints], axis=1).reshape(z.shape)
