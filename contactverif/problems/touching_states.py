"""Flat surfaces that touch at about 1000 angles: the gap is exactly 0, or 1e-16 either way before it is stored.

The angles are those of integer directions, so that nodes on a line are on it to the last bit.

Four pairs of surfaces lie in a row, each within 1° of the direction of the row. So no surface is above or below another
pair, and a formulation without a search, which takes all that its slave's normal meets for its master, is asked about
touch alone. A second body behind the first is the question of `hard.search`.

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

_ANGLES_IN_A_CASE = 4
_CASES = 250  # They make 1000 angles.
_SINGLE_ANGLES = 24
_PENALTY = 16.0
# Places along a flat surface; one node meets one. Few segments stand for each of the many angles.
_SLAVE, _MASTER = (0.25, 1.0, 1.375), (1.75, 1.0, 0.5, 0.0)
_SHORT_SLAVE, _SHORT_MASTER = (0.25, 1.0), (1.75, 1.0, 0.0)
_SPACING = 4.0  # From one pair of surfaces to the next, more than twice the length of either.
_FINENESS = 2.0**20


@cache
def touching_states() -> tuple[Case, ...]:
    """Return states that touch exactly, four angles each, and states near the origin with a gap of ±1e-16."""
    step = 360 / (_CASES * _ANGLES_IN_A_CASE)
    cases = []
    for number in range(_CASES):
        angles = [step * (number * _ANGLES_IN_A_CASE + index) for index in range(_ANGLES_IN_A_CASE)]
        name = f"gap 0, {angles[0]:.2f}° to {angles[-1]:.2f}°"
        cases.append(_touching(name, angles, 0.0, slave=_SHORT_SLAVE, master=_SHORT_MASTER))
    for shift, number in ((shift, number) for shift in (1e-16, -1e-16) for number in range(_SINGLE_ANGLES)):
        angle = 360 / _SINGLE_ANGLES * number + 1
        cases.append(_touching(f"gap {shift:g}, {angle:g}°", [angle], shift))
    return tuple(cases)


def _touching(
    name: str,
    angles: list[float],
    shift: float,
    *,
    slave: tuple[float, ...] = _SLAVE,
    master: tuple[float, ...] = _MASTER,
) -> Case:
    """Return one pair of surfaces for each angle, in a row along the angle in the middle."""
    sides: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    directions: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    middle = len(angles) // 2
    for number, angle in enumerate(angles):
        along = _direction(angle)
        origin = _SPACING * (number - middle) * _direction(angles[middle])
        normal = np.array([-along[1], along[0]])
        for side, places, lift in ((0, slave, shift), (1, master, 0.0)):
            sides[side].append(origin + np.multiply.outer(np.array(places), along) + lift * normal)
            directions[side].append(np.tile(along, (len(places), 1)))
    nodes = np.vstack([*sides[0], *sides[1]])
    slave_chains = _chains(len(slave), len(angles), 0)
    master_chains = _chains(len(master), len(angles), len(slave) * len(angles))
    interface = Interface(nodes, Surface(np.array(slave_chains)), Surface(np.array(master_chains)))
    parameters = {"directions": np.vstack([*directions[0], *directions[1]]), "shift": np.array(shift)}
    return Case(interface, nodes.reshape(-1), _PENALTY, parameters, name=name)


def _direction(angle: float) -> FloatArray:
    """Return the integer direction (2,) nearest to an angle in degrees, over a power of two; its length is near 1."""
    direction: FloatArray = np.round(np.array([cos(radians(angle)), sin(radians(angle))]) * _FINENESS) / _FINENESS
    return direction


def _chains(length: int, count: int, first: int) -> list[tuple[int, int]]:
    """Return the segments of `count` chains of `length` nodes, whose nodes are numbered from `first`."""
    starts = [first + length * number for number in range(count)]
    return [(start + node, start + node + 1) for start in starts for node in range(length - 1)]
