"""Flat interfaces that are exact in binary: turned, far from the origin, among other surfaces, and still flat.

A state is laid out in a frame of its own, along the interface and across it. It is turned by the angle of a Pythagorean
triple and moved. All of this is exact as long as the coordinates have few enough bits.

Rule for the next editor: what a case says is read off the stored nodes in rationals, never taken from the arguments.
Near 1e8 the stored penetration is another one than the penetration that was asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

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
