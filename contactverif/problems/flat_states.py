"""Flat interfaces, exact in binary: turned, far away, deep, with tiny segments, in touch, or misleading a search.

A state is laid out in a frame of its own, along the interface and across it. It is turned by the angle of a Pythagorean
triple and moved. All of this is exact as long as the coordinates have few enough bits. The exact forces are those of a
uniform pressure, whatever the rule by which a formulation finds its master segment.

What a case says is read off the stored nodes in rationals, never taken from the arguments: near 1e8 the stored
penetration is another one than the penetration that was asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import accumulate, product
from math import cos, radians, sin

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface, Surface
from contactverif.oracle import uniform_pressure_weights

Turn = tuple[int, int, int]  # Legs p, q and hypotenuse r: a unit of the frame along the interface becomes (p, q).
UPRIGHT, TURNED, STEEP = (1, 0, 1), (4, 3, 5), (-5, 12, 13)


@dataclass(frozen=True, slots=True)
class Master:
    """The master in the frame: all its chains, of which one has the flat part that the slave penetrates."""

    points: Sequence[tuple[float, float]]  # The nodes: their places along the flat part and their heights above it.
    segments: Sequence[tuple[int, int]]  # The segments as pairs of nodes, the body on the left.
    flat: Sequence[int]  # The nodes of the flat part, from right to left.


def flat_master(places: Sequence[float]) -> Master:
    """Return a master that is flat from end to end, with nodes at these ascending places."""
    count = len(places)
    points = [(place, 0.0) for place in reversed(places)]
    return Master(points, [(node, node + 1) for node in range(count - 1)], range(count))


def flat_state(
    name: str,
    slave: Sequence[float],
    master: Master,
    depth: float,
    *,
    turn: Turn = UPRIGHT,
    offset: tuple[float, float] = (0.0, 0.0),
    penalty: float = 16.0,
) -> Case:
    """Return a straight slave that penetrates the flat part of a master by the same depth everywhere.

    Places of the slave's nodes ascend in the frame, whose origin lies at the offset; its lengths become r times as long
    by the turn. The parameters of the case are `penetration`, `along` (n_nodes,), `direction` (2,) and `weights`
    (n_nodes,). A weight is the length that a uniform pressure on the node acts on; it is 0 off the flat part.
    """
    slave_nodes = _place([(place, -depth) for place in slave], turn, offset)
    master_nodes = _place(master.points, turn, offset)
    count = len(slave_nodes)
    slave_segments = np.array([(node, node + 1) for node in range(count - 1)])
    master_segments = np.array(master.segments) + count
    reference = np.vstack([_place([(place, 0.0) for place in slave], turn, offset), master_nodes])
    interface = Interface(reference, Surface(slave_segments), Surface(master_segments))
    nodes = np.vstack([slave_nodes, master_nodes])
    along, heights = read_frame(nodes, turn, nodes[count + master.flat[0]])
    flat = [*range(count), *(count + node for node in master.flat)]
    weights = np.zeros(len(nodes))
    weights[flat] = _weights(count, [along[node] for node in flat])
    parameters = {
        "penetration": np.array(float(-heights[0])),
        "along": np.array([float(place) for place in along]),
        "direction": np.array(turn[:2]) / turn[2],
        "weights": weights,
    }
    return Case(interface, nodes.reshape(-1), penalty, parameters, name=name)


def read_frame(nodes: FloatArray, turn: Turn, origin: FloatArray) -> tuple[list[Fraction], list[Fraction]]:
    """Return the exact places of nodes along the interface and across it, as lengths from a point of it."""
    p, q, r = turn
    steps = [[Fraction(float(a)) - Fraction(float(b)) for a, b in zip(node, origin, strict=True)] for node in nodes]
    return [(x * p + y * q) / r for x, y in steps], [(y * p - x * q) / r for x, y in steps]


def _place(points: Sequence[tuple[float, float]], turn: Turn, offset: tuple[float, float]) -> FloatArray:
    p, q, _ = turn
    places, heights = np.array(points, dtype=np.float64).T
    return np.column_stack([offset[0] + (places * p - heights * q), offset[1] + (places * q + heights * p)])


def _weights(n_slave: int, along: Sequence[Fraction]) -> FloatArray:
    """Return the weights (n_nodes,) of the nodes of a slave and of a flat master, from places along both."""
    points = np.column_stack([np.array([float(place) for place in along]), np.zeros(len(along))])
    interface = Interface.from_chains(points[:n_slave], points[n_slave:])
    return uniform_pressure_weights(interface, points[:, 0])


_TURNS = {"": UPRIGHT, ", turned 3-4-5": TURNED, ", turned 5-12-13": STEEP}
_TWO_TURNS = {"": UPRIGHT, ", turned 3-4-5": TURNED}
_TINY = 1.2e-5  # The length of the shortest segment in an interface of length 12.
TINY_MESHES: dict[str, tuple[list[float], list[float]]] = {
    "slave": ([0, 2, 4, 4 + _TINY, 8, 12], [0, 3, 6, 9, 12]),
    "master": ([0, 2, 4, 8, 12], [0, 3, 6, 6 + _TINY, 9, 12]),
    "both": ([0, 2, 6, 6 + _TINY, 12], [0, 3, 6 - _TINY / 2, 6 + _TINY / 2, 12]),
    "end": ([_TINY, 2 * _TINY, 4, 8, 12], [0, _TINY, 5, 12]),
}
TINY_PENALTIES = (1.0, 1e4, 1e8)


@cache
def tiny_segment_states() -> tuple[Case, ...]:
    """Return flat states of length 12 with a segment of 1.2e-5 on a side or both, at three penalties."""
    return tuple(
        flat_state(f"{side}, ε̂ = {penalty:g}", slave, flat_master(master), 2.0**-4, penalty=penalty)
        for (side, (slave, master)), penalty in product(TINY_MESHES.items(), TINY_PENALTIES)
    )


@cache
def offset_states() -> tuple[Case, ...]:
    """Return flat states whose distance from the origin is 1e9 to 1e15 times their penetration.

    Lengths are near 1. Near 1e8 neighbouring doubles are 1.5e-8 apart, so that the smallest penetration there is one
    such step.
    """
    slave, master = [0.25, 1.375, 1.625, 3.0], flat_master([-0.5, 0.875, 1.75, 2.5, 3.5])
    cases = []
    for (label, offset, depth), (turn_label, turn), (side, ratio) in product(
        (("1e6, gap 1e-6", 1e6, 2.0**-20), ("2^10, gap 1e-9", 2.0**10, 2.0**-30), ("1e8, gap 1e-6", 1e8, 2.0**-20)),
        _TURNS.items(),
        (("", 1.0), (", below", -0.5)),
    ):
        depth = depth if turn is UPRIGHT else depth / 4
        name = f"{label}{turn_label}{side}"
        cases.append(flat_state(name, slave, master, depth, turn=turn, offset=(offset, ratio * offset)))
    # The stored gap is one step of the doubles there, 1.49e-8, and not the 2e-8 that is asked for.
    cases.append(flat_state("1e8, gap of one step", slave, master, 2e-8, offset=(1e8, 1e8)))
    cases.append(flat_state("1e6, gap 1e-6 in decimals", slave, master, 1e-6, offset=(1e6, 1e6)))
    return tuple(cases)


@cache
def deep_states() -> tuple[Case, ...]:
    """Return flat states that penetrate by half a segment and by two segments."""
    slave, master = [2.0, 3.0, 4.25, 5.0], flat_master([-1.0, 0.0, 1.0, 2.5, 3.0, 4.0, 5.5, 6.0, 7.0, 8.0])
    return tuple(
        flat_state(f"{depth}{label}", slave, master, share, turn=turn)
        for (depth, share), (label, turn) in product({"h/2": 0.5, "2h": 2.0}.items(), _TURNS.items())
    )


@cache
def node_hit_states() -> tuple[Case, ...]:
    """Return flat states in which a slave node or a quarter point is over a master node, or beside it by a rounding.

    So ξ is 0, 1, −u or 1 + u of the master segments there.
    """
    cases = []
    steps = {"on it": 0.0, "one rounding left": -1.0, "one rounding right": 1.0}
    for (place, x), (label, step), (turn_label, turn) in product(
        {"slave node": 1.0, "quarter point": 1.25, "middle": 1.5}.items(), steps.items(), _TWO_TURNS.items()
    ):
        rounding = 2.0**-52 if turn is UPRIGHT else 2.0**-50  # Turned nodes have two bits more.
        master = flat_master([-1.0, x + step * rounding, 3.0])
        cases.append(flat_state(f"{place} {label}{turn_label}", [0.0, 1.0, 2.0], master, 2.0**-4, turn=turn))
    return tuple(cases)


_EIGHT = (1.0, 0.75, 1.25, 1.0, 0.5, 1.5, 1.25, 0.75), (0.75, 1.25, 1.5, 0.875, 1.25, 0.875, 0.5, 1.0)
MANY_EIGHTS = 38  # So many of these make more segments than a number of one byte tells apart.


@cache
def equal_length_states() -> tuple[Case, ...]:
    """Return flat states whose slave and master are equally long, with as many segments of the mean length 1.

    No segment at an end is longer than that, and inner nodes do not face each other. One spring more at each node, or
    one less at an end, is then no more than 1/n of all springs, whatever the unit of the penalty.
    """
    slave, master = _EIGHT
    sixteen, many = (
        (slave * count, (master[0] - 0.125, *master[1:], *master * (count - 2), master[0] + 0.125, *master[1:]))
        for count in (2, MANY_EIGHTS)
    )
    return tuple(
        flat_state(name, _ends(lengths), flat_master(_ends(opposite)), depth, turn=turn, penalty=penalty)
        for name, (lengths, opposite), depth, turn, penalty in (
            ("8 segments", _EIGHT, 2.0**-4, UPRIGHT, 16.0),
            ("8 segments, upright, soft and shallow", _EIGHT, 2.0**-12, (0, 1, 1), 2.0**-4),
            ("16 segments, stiff", sixteen, 2.0**-4, UPRIGHT, 2.0**20),
            (f"{8 * MANY_EIGHTS} segments", many, 2.0**-4, UPRIGHT, 16.0),
        )
    )


def _ends(lengths: Sequence[float]) -> list[float]:
    """Return 0 and the places where segments of these lengths end, one behind the other."""
    return [*accumulate(lengths, initial=0.0)]


@cache
def search_states() -> tuple[Case, ...]:
    """Return states on which a search is known to go wrong: the flat part is right, and something else is near."""
    masters = {
        "nearest node not on the nearest segment": ([3.0, 3.5, 4.0], _plate([8.0, 0.0], [0.0, 3.5, 8.0], 0.5)),
        "a thin plate": ([2.0, 3.0, 4.5], _plate([8.0, 5.0, 2.5, 0.0], [0.0, 3.0, 8.0], 0.125)),
        "master angle of 37°": ([0.5, 1.0, 2.0, 3.0], _wedge(0.75)),
        "master angle of 14°": ([1.0, 2.0, 3.0, 3.5], _wedge(0.25)),
        "a second body behind the first": ([2.0, 3.0, 4.5], _two_bodies()),
        "a seam under a segment": ([2.0, 3.0, 6.0], _turn_round(_plate([8.0, 5.0, 2.5, 0.0], [0.0, 8.0], 2.0), 2)),
        "a seam at a node": ([2.0, 5.0, 6.0], _turn_round(_plate([8.0, 5.0, 2.5, 0.0], [0.0, 8.0], 2.0), 1)),
    }
    return tuple(
        flat_state(f"{name}{label}", slave, master, 2.0**-5, turn=turn)
        for (name, (slave, master)), (label, turn) in product(masters.items(), _TWO_TURNS.items())
    )


def _plate(top: list[float], bottom: list[float], thickness: float) -> Master:
    """Return a closed chain: the top from right to left, then the bottom from left to right."""
    points = [(x, 0.0) for x in top] + [(x, -thickness) for x in bottom]
    count = len(points)
    return Master(points, [(node, (node + 1) % count) for node in range(count)], range(len(top)))


def _turn_round(plate: Master, first: int) -> Master:
    """Return the same closed chain, numbered from another node: its last segment joins the last node to that one."""
    count = len(plate.points)
    points = [plate.points[(first + node) % count] for node in range(count)]
    return Master(points, plate.segments, [(node - first) % count for node in plate.flat])


def _wedge(slope: float) -> Master:
    """Return a wedge that points to the left: its upper side is flat, its lower side falls by `slope`."""
    points = [(8.0, 0.0), (4.0, 0.0), (0.0, 0.0), (4.0, -4 * slope), (8.0, -8 * slope)]
    return Master(points, [(node, node + 1) for node in range(4)], range(3))


def _two_bodies() -> Master:
    """Return a plate of thickness 1/2 and, 1/4 below it, the upper side of another body."""
    plate = _plate([8.0, 5.0, 2.5, 0.0], [0.0, 3.0, 8.0], 0.5)
    count = len(plate.points)
    behind = [(9.0, -0.75), (3.5, -0.75), (-1.0, -0.75)]
    segments = [*plate.segments, (count, count + 1), (count + 1, count + 2)]
    return Master([*plate.points, *behind], segments, plate.flat)


_ANGLES_IN_A_CASE = 4
_CASES = 250  # They make 1000 angles.
_SINGLE_ANGLES = 24
_PENALTY = 16.0
# Four pairs of surfaces lie in a row, each within 1° of the direction of the row. So no surface is above or below
# another pair, and a formulation without a search, which takes all that its slave's normal meets for its master, is
# asked about touch alone. Angles are those of integer directions, so that nodes on a line are on it to the last bit.
# Places along a flat surface; one node meets one. Few segments stand for each of the many angles.
_SLAVE, _MASTER = (0.25, 1.0, 1.375), (1.75, 1.0, 0.5, 0.0)
_SHORT_SLAVE, _SHORT_MASTER = (0.25, 1.0), (1.75, 1.0, 0.0)
_SPACING = 4.0  # From one pair of surfaces to the next, more than twice the length of either.
_FINENESS = 2.0**20


@cache
def touching_states() -> tuple[Case, ...]:
    """Return states that touch exactly at about 1000 angles, four each, and states with a gap of ±1e-16.

    The parameters are `directions` (n_nodes, 2), that of the flat surface of each node, and `shift`, the gap before it
    is stored, a length.
    """
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
    return np.round(np.array([cos(radians(angle)), sin(radians(angle))]) * _FINENESS) / _FINENESS


def _chains(length: int, count: int, first: int) -> list[tuple[int, int]]:
    """Return the segments of `count` chains of `length` nodes, whose nodes are numbered from `first`."""
    starts = [first + length * number for number in range(count)]
    return [(start + node, start + node + 1) for start in starts for node in range(length - 1)]
