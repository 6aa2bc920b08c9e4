"""The contact points of a formulation by pass: those of the slave, and those of a second pass with exchanged roles.

Rule for the next editor: whoever judges contact points takes them from here, so that no point of a second pass is held
against the wrong surface.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.formulation import ContactPoints
from contactverif.contract.interface import Interface


@dataclass(frozen=True, slots=True, eq=False)
class Pass:
    """The points of one pass, with the interface and the positions in the roles of that pass."""

    interface: Interface  # The interface in which the points lie on the slave.
    z: FloatArray  # (n_unknowns,) The current positions, flat, in the order of its nodes; no multipliers.
    points: ContactPoints  # The points.
    numbers: IntArray  # (n_nodes,) The number that each node of `interface` has in the interface of the case.
    second: bool  # True for the second pass, in which the roles are exchanged.

    @property
    def positions(self) -> FloatArray:
        """The current positions (n_nodes, dim)."""
        return self.z.reshape(self.interface.nodes.shape)


def split_passes(case: Case, points: ContactPoints) -> Iterator[Pass]:
    """Yield the points of the slave, and those of a second pass if there are any."""
    interface, numbers = case.interface, np.arange(case.interface.n_nodes)
    for second in (False, True):
        mask = points.on_master == second
        if second:
            if not mask.any():
                return
            interface, numbers = interface.swap_roles(), np.roll(numbers, -interface.n_slave_nodes)
        z = case.positions[numbers].reshape(-1)
        yield Pass(interface, z, points if mask.all() else points.select(mask), numbers, second)


def nearest_sum(points: ContactPoints, force: float) -> float:
    """Return the sum of pressure × weight over active points that is nearer to a force on the slave.

    In two passes the points of both surfaces push both bodies. In half passes those of the slave push the slave alone.
    """
    pushes = np.where(points.active, points.pressure * points.weight, 0.0)
    sums = float(pushes[~points.on_master].sum()), float(pushes.sum())
    return min(sums, key=lambda total: abs(total - force))
