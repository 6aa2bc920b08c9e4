"""The exact test of the kind of a projection: whether a slave point faces the master in the way that a name says.

Rule for the next editor: all arithmetic is rational on the stored floats, and every kind is defined here by what can be
measured, not by how a strategy makes it. The one exception is 89.9°, which has no rational cosine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import cos, isclose, radians, sqrt

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface

TAU = Fraction(1e-2)  # Formulations may still see contact past a free end by this share of the segment.
Vector = tuple[Fraction, Fraction]


def is_of_kind(interface: Interface, z: FloatArray, kind: str, slave_segment: int, c: float) -> bool:
    """Return whether the projection of the point at c ∈ [−1, 1] of a slave segment is of a kind of `KIND_TESTS`."""
    return KIND_TESTS[kind](_Probe(interface, z, slave_segment, c))


def kind_of(interface: Interface, z: FloatArray, slave_segment: int, c: float) -> str:
    """Return the most special kind of the projection of a slave point, ``"other"`` if it has none.

    The arguments are those of `is_of_kind`.
    """
    probe = _Probe(interface, z, slave_segment, c)
    return next((kind for kind, test in KIND_TESTS.items() if test(probe)), "other")


@dataclass(frozen=True, slots=True)
class _Foot:
    """The projection of a point onto one segment."""

    segment: int
    xi: Fraction  # Unclipped.
    squared: Fraction  # The squared distance to the closed segment.

    @property
    def is_inside(self) -> bool:
        return 0 < self.xi < 1


class _Probe:
    """A slave point, and what the master looks like from there."""

    def __init__(self, interface: Interface, z: FloatArray, slave_segment: int, c: float) -> None:
        values = [Fraction(value) for value in np.asarray(z)[: interface.n_unknowns].tolist()]
        self.nodes: list[Vector] = list(zip(values[::2], values[1::2], strict=True))
        self.slave: list[list[int]] = interface.slave.segments.tolist()
        self.master: list[list[int]] = interface.master.segments.tolist()
        self.neighbours: list[list[int]] = interface.master.neighbours.tolist()
        self.carrier, self.c = self.slave[slave_segment], c
        share = (1 + Fraction(c)) / 2
        first, second = (self.nodes[node] for node in self.carrier)
        self.point = _interpolate(first, second, share)

    @cached_property
    def feet(self) -> list[_Foot]:
        """The feet on all segments, the nearest first, of equally near ones that with the least overshoot."""
        return self.feet_of(self.point)

    @cached_property
    def home(self) -> _Foot:
        """The foot on the nearest segment."""
        return self.feet[0]

    @property
    def tied(self) -> list[_Foot]:
        """The feet on all segments that are equally near."""
        return [foot for foot in self.feet if foot.squared == self.home.squared]

    def feet_of(self, point: Vector) -> list[_Foot]:
        ranked = []
        for segment in range(len(self.master)):
            first, second = self.ends(segment)
            along, away = _minus(second, first), _minus(point, first)
            xi = _dot(away, along) / _dot(along, along)
            inside = min(max(xi, Fraction(0)), Fraction(1))
            distance = _minus(point, _interpolate(first, second, inside))
            squared = _dot(distance, distance)
            overshoot = (xi - inside) ** 2 * _dot(along, along)
            ranked.append((squared, overshoot, segment, _Foot(segment, xi, squared)))
        return [foot for *_, foot in sorted(ranked, key=lambda entry: entry[:3])]

    def ends(self, segment: int) -> tuple[Vector, Vector]:
        return self.nodes[self.master[segment][0]], self.nodes[self.master[segment][1]]

    def direction(self, segment: int) -> Vector:
        return _minus(*reversed(self.ends(segment)))

    def chain(self, segment: int) -> list[int]:
        """Return the segments of a master chain, from the first one of an open chain."""
        start = segment
        while (previous := self.neighbours[start][0]) >= 0 and previous != segment:
            start = previous
        chain = [start]
        while (following := self.neighbours[chain[-1]][1]) >= 0 and following != start:
            chain.append(following)
        return chain

    def turn(self) -> tuple[Fraction, Fraction] | None:
        """Return cross and dot product of the two nearest segments, in chain order; None if they share no node."""
        if len(self.feet) < 2:
            return None
        pair = self.feet[0].segment, self.feet[1].segment
        for first, second in (pair, pair[::-1]):
            if self.neighbours[first][1] == second:
                u, v = self.direction(first), self.direction(second)
                return u[0] * v[1] - u[1] * v[0], _dot(u, v)
        return None

    def past(self) -> Fraction | None:
        """Return how far the foot is past a free end, in lengths of the segment; None if it is past none."""
        side = int(self.home.xi > Fraction(1, 2))
        if self.neighbours[self.home.segment][side] >= 0:
            return None
        return self.home.xi - 1 if side else -self.home.xi


def _inside(probe: _Probe) -> bool:
    return probe.home.is_inside and len(probe.tied) == 1


def _role(probe: _Probe, role: str) -> bool:
    """Return whether the nearest segment has a role among the three or more that lie under the slave segment."""
    chain = probe.chain(probe.home.segment)
    a, b = (probe.feet_of(probe.nodes[node])[0].segment for node in probe.carrier)
    if not _inside(probe) or a not in chain or b not in chain:
        return False
    covered = chain[chain.index(b) : chain.index(a) + 1]  # The master runs against the slave.
    if len(covered) < 3:
        return False
    place = {covered[0]: "first", covered[-1]: "last"}.get(probe.home.segment, "intermediate")
    return place == role


def _at_node(probe: _Probe, *, free: bool) -> bool:
    """Return whether the foot is exactly a node, at a free end or between two segments."""
    home = probe.home
    return home.xi in (0, 1) and (probe.neighbours[home.segment][int(home.xi)] < 0) == free


def _coincident(probe: _Probe) -> bool:
    """Return whether the foot of every node of the slave's chain is a master node, and the point is a slave node."""
    nodes, size = set(probe.carrier), 0
    while len(nodes) > size:
        size = len(nodes)
        nodes.update(node for ends in probe.slave if nodes.intersection(ends) for node in ends)
    feet = [probe.feet_of(probe.nodes[node])[0] for node in nodes]
    return abs(probe.c) == 1 and all(foot.xi in (0, 1) for foot in feet)


def _vertex(probe: _Probe, sign: int, *, sharp: bool = False) -> bool:
    """Return whether the two nearest segments meet at a vertex that sticks out (sign 1) or in (−1), or is sharp."""
    turn = probe.turn()
    if turn is None:
        return False
    cross, dot = turn
    return dot < 0 and cross != 0 if sharp else cross * sign > 0


def _past_end(probe: _Probe, *, inside: bool) -> bool:
    past = probe.past()
    return past is not None and (0 < past <= TAU if inside else past > TAU)


def _small_overlap(probe: _Probe) -> bool:
    """Return whether the point is a slave node over the end of a chain, and its segment goes on past that end."""
    past = probe.past()
    other = probe.nodes[probe.carrier[0 if probe.c == 1 else 1]]
    first, along = probe.ends(probe.home.segment)[0], probe.direction(probe.home.segment)
    xi = _dot(_minus(other, first), along) / _dot(along, along)
    outside = xi > 1 if probe.home.xi > Fraction(1, 2) else xi < 0
    return abs(probe.c) == 1 and past is not None and Fraction(-1, 2) <= past < 0 and outside


def _angle(probe: _Probe, degrees: float) -> bool:
    """Return whether the point is over the inside of a segment and its slave segment turned by an angle against it."""
    first, second = (probe.nodes[node] for node in probe.carrier)
    slave, master = _minus(second, first), probe.direction(probe.home.segment)
    if not probe.home.is_inside:
        return False
    facing = -_dot(slave, master)  # Zero degrees is antiparallel.
    if degrees == 90:
        return facing == 0
    if degrees == 180:
        return facing < 0 and slave[0] * master[1] == slave[1] * master[0]
    cosine = float(facing) / sqrt(_dot(slave, slave) * _dot(master, master))
    return isclose(cosine, cos(radians(degrees)), rel_tol=1e-4)


def _second_body(probe: _Probe) -> bool:
    """Return whether the line through the point along the normal of the nearest segment meets two chains."""
    along, chains = probe.direction(probe.home.segment), set()
    for segment in range(len(probe.master)):
        first, second = (_dot(_minus(end, probe.point), along) for end in probe.ends(segment))
        if first * second <= 0:
            chains.add(min(probe.chain(segment)))
    return probe.home.is_inside and len(chains) > 1


def _closing(probe: _Probe) -> bool:
    """Return whether the nearest segment joins the last node of a closed chain to the first."""
    chain = probe.chain(probe.home.segment)
    nodes = [node for segment in chain for node in probe.master[segment]]
    is_closed = probe.neighbours[chain[0]][0] >= 0
    return _inside(probe) and is_closed and probe.master[probe.home.segment] == [max(nodes), min(nodes)]


def _other_node(probe: _Probe) -> bool:
    """Return whether some node is nearer than both ends of the nearest segment."""
    arms = {node: _minus(probe.nodes[node], probe.point) for ends in probe.master for node in ends}
    distances = {node: _dot(arm, arm) for node, arm in arms.items()}
    least = min(distances[node] for node in probe.master[probe.home.segment])
    return _inside(probe) and min(distances.values()) < least


# The most special kind first: a coincidence is more special than a direction, and a direction more than a place.
KIND_TESTS: dict[str, Callable[[_Probe], bool]] = {
    "equidistant from three segments": lambda probe: sum(foot.is_inside for foot in probe.tied) >= 3,
    "equidistant from three nodes": lambda probe: (
        len({probe.master[foot.segment][int(foot.xi >= 1)] for foot in probe.tied if not foot.is_inside}) >= 3
    ),
    "coincident nodes": _coincident,
    "node hit exactly": lambda probe: _at_node(probe, free=False),
    "free end hit exactly": lambda probe: _at_node(probe, free=True),
    "edge-on, 90°": lambda probe: _angle(probe, 90),
    "from behind": lambda probe: _angle(probe, 180),
    "edge-on, 89.9°": lambda probe: _angle(probe, 89.9),
    "past a free end, inside τ": lambda probe: _past_end(probe, inside=True),
    "past a free end, outside τ": lambda probe: _past_end(probe, inside=False),
    "overlap going to zero": _small_overlap,
    "nearest node not on nearest segment": _other_node,
    "second body behind": _second_body,
    "closing segment": _closing,
    "first of several segments": lambda probe: _role(probe, "first"),
    "intermediate of several segments": lambda probe: _role(probe, "intermediate"),
    "last of several segments": lambda probe: _role(probe, "last"),
    "inside a segment": _inside,
    "master angle below 90°": lambda probe: _vertex(probe, 0, sharp=True),
    "convex vertex": lambda probe: _vertex(probe, 1),
    "concave vertex": lambda probe: _vertex(probe, -1),
}


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1]


def _dot(a: Vector, b: Vector) -> Fraction:
    return a[0] * b[0] + a[1] * b[1]


def _interpolate(first: Vector, second: Vector, share: Fraction) -> Vector:
    return first[0] + share * (second[0] - first[0]), first[1] + share * (second[1] - first[1])
