"""The forces of nodal springs on a flat interface that penetrates uniformly, exact.

A nodal method has a spring at each slave node, and knows no areas. Its forces are no consistent forces of a pressure,
but they are known: a unit on each slave node, shared between the nodes of the master segment below by the lever rule.

Rule for the next editor: all arithmetic is rational on the stored floats; the only rounding is the last one.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface, Surface
from contactverif.oracle.rationals import integers


def nodal_spring_weights(interface: Interface, along: ArrayLike, *, both_surfaces: bool = False) -> FloatArray:
    """Return the forces (n_nodes,) of springs of unit force at the nodes of the slave.

    Parameters
    ----------
    interface : Interface
        A flat interface. A node beside the other surface has no spring.
    along : ArrayLike, shape (n_nodes,)
        The coordinate of each node along the straight interface, a length. Floats count as the rationals that they are.
    both_surfaces : bool
        There are springs at the nodes of the master too.

    Returns
    -------
    FloatArray, shape (n_nodes,)
        The force that pushes each node away from the other body, over that of one spring.
    """
    places, _ = integers(np.asarray(along, dtype=np.float64))
    forces = [Fraction(0)] * len(places)
    passes = [(interface.slave, interface.master), (interface.master, interface.slave)]
    for surface, other in passes if both_surfaces else passes[:1]:
        for node in np.unique(surface.segments).tolist():
            _add_spring(forces, node, other, places)
    return np.array([float(force) for force in forces])


def _add_spring(forces: list[Fraction], node: int, other: Surface, places: list[int]) -> None:
    """Add the unit force of a spring at a node, and its shares on the first segment that is opposite."""
    for first, second in other.segments.tolist():
        span, arm = places[second] - places[first], places[node] - places[first]
        if 0 <= Fraction(arm, span) <= 1:
            forces[node] += 1
            forces[second] += Fraction(arm, span)
            forces[first] += 1 - Fraction(arm, span)
            return
