"""A scene of which nothing is condensed: the linear systems of other codes, and of interfaces of a thousand segments.

All free components of all bodies within reach are unknowns, so matrices are large and sparse. Condensing takes longer
than one such system where a surface has more than some hundred nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import FloatArray, IntArray, dense
from contactverif.mechanics.bulk import DENSE_LIMIT, assemble_stiffness
from contactverif.mechanics.scene import Scene


@dataclass(frozen=True, eq=False)
class WholeScene(Scene):
    """A scene whose unknowns are all free components of its bodies. `solve` takes it like any other scene."""

    @classmethod
    def of_scene(cls, scene: Scene) -> WholeScene:
        """Return the same scene, uncondensed."""
        return cls(scene.bodies, scene.slave, scene.master, scene.penalty, scene.facts, scene.name)

    @cached_property
    def unknowns(self) -> tuple[IntArray, ...]:
        """The unknowns of each body within reach: 2 × node + component of all that is free."""
        return tuple(np.flatnonzero(~self.bodies[index].fixed.reshape(-1)) for index in self.bodies_in_reach)

    @cached_property
    def stiffness(self) -> FloatArray | sparse.csr_array:
        """The stiffness (n_free, n_free) of all bodies within reach: dense if it is small, else sparse."""
        blocks = [rows[:, free] for rows, free in zip(self._rows, self.unknowns, strict=True)]
        matrix = sparse.csr_array(sparse.block_diag(blocks))
        return dense(matrix) if self.n_free <= DENSE_LIMIT else matrix

    @cached_property
    def load(self) -> FloatArray:
        """The load (n_free,), a force: that of nodal forces and of imposed displacements."""
        bodies = (self.bodies[index] for index in self.bodies_in_reach)
        parts = zip(bodies, self._rows, self.unknowns, strict=True)
        return np.concatenate(
            [body.load.reshape(-1)[free] - rows @ body.imposed.reshape(-1) for body, rows, free in parts]
        )

    @cached_property
    def _rows(self) -> tuple[Any, ...]:
        """The rows (n_unknowns, 2 n_nodes) of the stiffness of each body within reach."""
        rows = []
        for index, free in zip(self.bodies_in_reach, self.unknowns, strict=True):
            body = self.bodies[index]
            nothing = (2 * len(body.nodes),) * 2
            rows.append(sparse.csr_array(nothing if body.rigid else assemble_stiffness(body)[0])[free])
        return tuple(rows)
