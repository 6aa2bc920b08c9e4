"""The derivative of contact forces by central differences, with few calls of a formulation where that can be shown.

A difference for each unknown takes hundreds of calls. Two matrices are cheaper: the formulation's own tangent, and
differences along which all nodes move at once that are too far apart to act on the same node. Neither can be trusted.
But one more difference, along a direction in which all unknowns move, tells them from a wrong matrix: an error in any
entry shows, since the direction is random.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray, IntArray
from contactverif.contract.lazy import lazy

# An error of a matrix by this share of its rows makes each iterate of Newton's method a million times better.
AGREEMENT = 1e-6
# Forces that change by as much either way, but for this share, have no kink in between.
KINK = 1e-3
ROUNDOFF_FACTOR = 8.0  # Forces are rounded by at most this many units of roundoff of their largest terms.
_SEED = 2009


@dataclass(frozen=True, eq=False)
class Differences:
    """Central differences of contact forces in one state."""

    forces: Callable[[FloatArray], FloatArray]  # The contact forces (..., n) in states (..., n).
    z: FloatArray  # (n,) The state: positions, then multipliers.
    steps: FloatArray  # (n,) The step of each unknown, in its own unit.
    sizes: FloatArray  # (n,) What each unknown is rounded like, in its own unit: the largest one of its kind.
    n_positions: int  # The number of unknowns that are positions, two for each node.

    def away_from_kinks(self) -> Differences:
        """Return differences with smaller steps, if forces have a kink within these: where contact begins, for one.

        With ρ the roundoff of positions over the step, the steps are ρ^¼ or √ρ times as large. Where these have kinks,
        too, the steps stay.
        """
        forces, rounding = self.forces(self.z), UNIT_ROUNDOFF * float((self.sizes / self.steps)[0])
        for power in (0.0, 0.25, 0.5):
            smaller = replace(self, steps=self.steps * rounding**power)
            if not smaller._has_kink(forces):
                return smaller
        return self

    def by_unknown(self) -> FloatArray:
        """Return the derivative (n, n), by a difference for each unknown."""
        derivative: FloatArray = (self._along(np.diag(self.steps)) / self.steps[:, None]).T
        return derivative

    def by_groups(self, reach: float) -> FloatArray | None:
        """Return the derivative (n, n) of a state without multipliers, if forces reach no farther than a length.

        Nodes move at once if no node is within `reach` of two of them. None if that is no less work than `by_unknown`.
        """
        positions = self.z.reshape(-1, 2)
        distances = np.linalg.norm(positions[:, None] - positions[None], axis=-1)
        groups = _colours(distances <= 2 * reach)
        n_groups, n_nodes = int(groups.max()) + 1, len(positions)
        if 2 * n_groups > n_nodes:
            return None
        shifts = np.zeros((n_groups, 2, n_nodes, 2))
        for component in (0, 1):
            shifts[groups, component, np.arange(n_nodes), component] = self.steps.reshape(-1, 2)[:, component]
        changes = self._along(shifts.reshape(2 * n_groups, -1)).reshape(n_groups, 2, n_nodes, 2)
        rows, columns = np.nonzero(distances <= reach)
        derivative = np.zeros((n_nodes, 2, n_nodes, 2))
        derivative[rows, :, columns, :] = changes[groups[columns], :, rows, :].transpose(0, 2, 1)
        return derivative.reshape(len(self.z), -1) / self.steps

    def confirm(self, matrix: Any) -> bool:
        """Return whether a matrix (n, n), dense or sparse, is the derivative, by one difference in a random direction.

        The change of a force may differ from that of the matrix by `AGREEMENT` of its terms, and by roundoff. A force
        along an inclined normal is rounded in both of its components.
        """
        (before, after), terms = self._ends, abs(matrix)
        rounded = terms @ self.sizes + np.maximum(np.abs(before), np.abs(after))
        allowed = AGREEMENT * (terms @ np.abs(self._direction)) + ROUNDOFF_FACTOR * UNIT_ROUNDOFF * rounded
        allowed[: self.n_positions] = allowed[: self.n_positions].reshape(-1, 2).max(axis=1).repeat(2)
        return bool((np.abs(matrix @ self._direction - (after - before) / 2) <= allowed).all())

    def _has_kink(self, forces: FloatArray) -> bool:
        """Return whether forces, given (n,) at z, change otherwise along the random direction than against it."""
        before, after = self._ends
        change = np.abs(after - before).max(initial=0.0)
        rounded = float((self.sizes / self.steps)[0]) * change + np.abs(forces).max(initial=0.0)
        bend = np.abs(before - 2 * forces + after).max(initial=0.0)  # Four forces, each of which is rounded.
        return bool(bend > KINK * change + 4 * ROUNDOFF_FACTOR * UNIT_ROUNDOFF * rounded)

    @cached_property
    def _direction(self) -> FloatArray:
        """A direction (n,) in which every unknown moves, by half a step to a step."""
        random = np.random.default_rng(_SEED)
        return np.asarray(self.steps * random.uniform(0.5, 1.0, len(self.z)) * random.choice([-1.0, 1.0], len(self.z)))

    @lazy
    def _ends(self) -> FloatArray:
        """Return the forces (2, n) at z less the direction, and at z plus it."""
        return self.forces(np.stack([self.z - self._direction, self.z + self._direction]))

    def _along(self, shifts: FloatArray) -> FloatArray:
        """Return half the change (k, n) of the forces from z − shift to z + shift, for each shift of (k, n)."""
        forces = self.forces(np.concatenate([self.z + shifts, self.z - shifts]))
        return np.asarray((forces[: len(shifts)] - forces[len(shifts) :]) / 2)


def _colours(neighbours: BoolArray) -> IntArray:
    """Return a number (n,) for each node, so that two neighbours never have the same; low ones are taken first."""
    colours = np.full(len(neighbours), -1)
    for node, near in enumerate(neighbours):
        others = colours[near]
        colours[node] = np.setdiff1d(np.arange(len(others) + 1), others)[0]
    return colours
