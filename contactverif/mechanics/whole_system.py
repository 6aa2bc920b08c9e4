"""The linear system of a code that does not condense: all free components of all bodies, contact, multipliers.

It is what the size and the pattern of a formulation's tangent cost elsewhere. The harness itself solves condensed ones.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from contactverif.mechanics.bulk import assemble_stiffness
from contactverif.mechanics.scene import Scene


class WholeSystem:
    """The stiffness of the bodies within reach, uncondensed, to which the tangents of formulations are added.

    Attributes
    ----------
    size : int
        The number of free components of all bodies within reach.
    """

    def __init__(self, scene: Scene) -> None:
        blocks, maps = [sparse.csr_array((0, 0))], [sparse.csr_array((0, 0))]
        for index in scene.bodies_in_reach:
            body = scene.bodies[index]
            free = np.flatnonzero(~body.fixed.reshape(-1))
            frame = sparse.kron(sparse.eye_array(len(body.contact_nodes)), body.frame, format="csr")
            of_contact = (2 * body.contact_nodes[:, None] + np.arange(2)).reshape(-1)
            select = sparse.eye_array(2 * len(body.nodes), format="csr")[of_contact]
            maps.append(sparse.csr_array(frame @ select)[:, free])
            stiffness = np.zeros((0, 0)) if body.rigid else assemble_stiffness(body)[0]
            blocks.append(sparse.csr_array(stiffness)[free][:, free])
        self._stiffness = sparse.csr_array(sparse.block_diag(blocks))
        self._map = sparse.csr_array(sparse.block_diag(maps))  # From free components to positions of the interface
        self.size = self._stiffness.shape[0]

    def matrix(self, tangent: Any) -> Any:
        """Return the matrix (n, n), csc, with a tangent of positions and multipliers; the multipliers come last."""
        count = tangent.shape[0] - self._map.shape[0]
        unit, nothing = sparse.eye_array(count), sparse.csr_array((count, count))
        to_positions = sparse.csr_array(sparse.block_diag([self._map, unit]))
        stiffness = sparse.block_diag([self._stiffness, nothing])
        return sparse.csc_array(stiffness + to_positions.T @ sparse.csr_array(tangent) @ to_positions)
