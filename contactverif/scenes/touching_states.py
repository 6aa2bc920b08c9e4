"""Flat surfaces that touch at about 1000 angles: the gap is exactly 0, or 1e-16 either way before it is stored.

The angles are those of integer directions, so that nodes on a line are on it to the last bit.

Parameters of a case: `directions` (n_nodes, 2), the direction of the flat surface that each node belongs to, and
`shift`, the gap before it is stored, a length.
"""

from __future__ import annotations

from functools import cache
from math import cos, radians, sin

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface, Surface

_ANGLES_IN_A_CASE = 20
_CASES = 51  # They make 1020 angles.
_SINGLE_ANGLES = 24
_PENALTY = 16.0
_SLAVE, _MASTER = (0.25, 1.0, 1.375), (1.75, 1.0, 0.5, 0.0)  # Places along the flat surface; one node meets one.
_FINENESS = 2.0**20


@cache
def touching_states() -> tuple[Case, ...]:
    """Return states that touch exactly, twenty angles each, and states near the origin with a gap of ±1e-16."""
    step = 360 / (_CASES * _ANGLES_IN_A_CASE)
    cases = []
    for number in range(_CASES):
        angles = [step * (number * _ANGLES_IN_A_CASE + index) for index in range(_ANGLES_IN_A_CASE)]
        cases.append(_touching(f"gap 0, {angles[0]:.1f}° to {angles[-1]:.1f}°", angles, 0.0))
    for shift, number in ((shift, number) for shift in (1e-16, -1e-16) for number in range(_SINGLE_ANGLES)):
        angle = 360 / _SINGLE_ANGLES * number + 1
        cases.append(_touching(f"gap {shift:g}, {angle:g}°", [angle], shift))
    return tuple(cases)


def _touching(name: str, angles: list[float], shift: float) -> Case:
    """Return one pair of surfaces for each angle, beside one another if there are several."""
    sides: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    directions: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    for number, angle in enumerate(angles):
        along = np.round(np.array([cos(radians(angle)), sin(radians(angle))]) * _FINENESS) / _FINENESS
        origin = np.array([4.0 * (number % 5 - 2), 4.0 * (number // 5 - 2)]) * (len(angles) > 1)
        normal = np.array([-along[1], along[0]])
        for side, places, lift in ((0, _SLAVE, shift), (1, _MASTER, 0.0)):
            sides[side].append(origin + np.multiply.outer(np.array(places), along) + lift * normal)
            directions[side].append(np.tile(along, (len(places), 1)))
    nodes = np.vstack([*sides[0], *sides[1]])
    n_slave = len(_SLAVE) * len(angles)
    slave, master = _chains(len(_SLAVE), len(angles), 0), _chains(len(_MASTER), len(angles), n_slave)
    interface = Interface(nodes, Surface(np.array(slave)), Surface(np.array(master)))
    parameters = {"directions": np.vstack([*directions[0], *directions[1]]), "shift": np.array(shift)}
    return Case(interface, nodes.reshape(-1), _PENALTY, parameters, name=name)


def _chains(length: int, count: int, first: int) -> list[tuple[int, int]]:
    """Return the segments of `count` chains of `length` nodes, whose nodes are numbered from `first`."""
    starts = [first + length * number for number in range(count)]
    return [(start + node, start + node + 1) for start in starts for node in range(length - 1)]
