"""A slave segment that is tilted into a flat master, and the forces that a formulation puts on its nodes.

`defect_tilt` and `defect_jump` show with it what the printed VTS-PPT loses.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface
from contactverif_paper.paper_formulations import PaperFormulation, subject_of

TILTS = np.array([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4])  # Radians.
DEPTH = 1.0 / 8  # The penetration of the slave's first node over its length.
_PENALTY = 8.0


def tilted_pair(theta: float, master: Sequence[float]) -> tuple[Interface, FloatArray]:
    """Return the interface and its positions (n_nodes, 2).

    Parameters
    ----------
    theta : float
        The tilt, rad.
    master : Sequence[float]
        The x of the master's nodes, ascending. The slave has unit length and begins at x = 0.
    """
    chain = np.column_stack([master[::-1], np.zeros(len(master))])
    reference = np.array([[0.0, 0.0], [1.0, 0.0]])
    slave = np.array([[0.0, -DEPTH], [np.cos(theta), -DEPTH - np.sin(theta)]])
    return Interface.from_chains(reference, chain), np.vstack([slave, chain])


def nodal_forces(formulation: PaperFormulation, theta: float, master: Sequence[float]) -> tuple[FloatArray, FloatArray]:
    """Return positions and forces, both (n_nodes, 2), slave nodes first."""
    interface, x = tilted_pair(theta, master)
    plugin = subject_of(formulation).with_penalty(_PENALTY)
    z = x.reshape(-1)
    forces: FloatArray = -plugin.residual(interface, plugin.pair(interface, z), z).reshape(-1, 2)
    return x, forces
