"""What a state z holds: the positions of the nodes, and behind them the multipliers of a formulation that has some."""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array, FloatArray
from contactverif.contract.interface import Interface


def parted(interface: Interface, z: Array) -> tuple[Array, Array]:
    """Copies of the positions (n_states, n_nodes, 2) and multipliers (n_states, n_multipliers) of states z (..., n)."""
    states = z.reshape(-1, z.shape[-1])
    n_unknowns = interface.n_unknowns
    return np.array(states[:, :n_unknowns]).reshape(len(states), -1, 2), np.array(states[:, n_unknowns:])


def one_parted(interface: Interface, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Copies of the positions (n_nodes, 2) and multipliers (n_multipliers,) of one state z (n,)."""
    x, multipliers = parted(interface, z)
    return x[0], multipliers[0]


def joined(forces: Array, constraints: Array, z: Array) -> Array:
    """The residual of the states z, in their shape: forces (n_states, n_nodes, 2), behind them the constraint rows."""
    if not constraints.size:
        return forces.reshape(z.shape)
    return np.concatenate([forces.reshape(len(forces), -1), constraints], axis=1).reshape(z.shape)
