"""States of surfaces in space with a name: witnesses of what a formulation in three dimensions says it does not do."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface

_SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
_FIRST_DIAGONAL, _SECOND_DIAGONAL = [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]
_FROM_BELOW = [face[::-1] for face in _FIRST_DIAGONAL]  # The slave's faces are seen from below.
_PENETRATION = 2.0**-4


def _cross_diagonals() -> Case:
    """Return a square over a square, cut along the other diagonal, with a penetration of 1/16 everywhere.

    All nodes meet, and yet the consistent forces of slave and master are different: 1/3 and 1/6 of the pressure.
    """
    interface = Interface.from_faces(_SQUARE, _FROM_BELOW, _SQUARE, _SECOND_DIAGONAL)
    parameters = {
        "penetration": np.array(_PENETRATION),
        "plane": np.vstack([_SQUARE, _SQUARE])[:, :2],
        "domain": _SQUARE[:, :2],
        "normal": np.array([0.0, 0.0, 1.0]),
    }
    z = _state(_SQUARE - [0, 0, _PENETRATION], _SQUARE)
    return Case(interface, z, 1 / _PENETRATION, parameters, name="crossed-diagonals")


def _tilt_faces() -> Case:
    """Return a tilted square that penetrates a square and overhangs it, seen along its own normal.

    It has a slope of 1/4 along x and 1/8 along y.
    """
    slave = _SQUARE + np.column_stack([np.zeros((4, 2)), _SQUARE[:, :2] @ [0.25, 0.125] - 0.5])
    interface = Interface.from_faces(_SQUARE, _FROM_BELOW, _SQUARE, _SECOND_DIAGONAL)
    return Case(interface, _state(slave, _SQUARE), 16.0, name="tilted-faces")


def _state(slave: FloatArray, master: FloatArray) -> FloatArray:
    return np.vstack([slave, master]).reshape(-1)


SURFACE_STATES: dict[str, Callable[[], Case]] = {
    "crossed-diagonals": _cross_diagonals,
    "tilted-faces": _tilt_faces,
}
