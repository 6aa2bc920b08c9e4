"""The exact test of the kind of a projection: whether a slave point faces the master in the way that a name says.

Rule for the next editor: all arithmetic is rational on the stored floats, and every kind is defined here by what can be
measured, not by how a strategy makes it. The one exception is 89.9°, which has no rational cosine.
"""

from collections.abc import Callable
from fractions import Fraction
from itertools import permutations
from math import cos, isclose, radians, sqrt
from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface
from contactverif.oracle.exact_points import Integers, as_integers
from contactverif.oracle.nearest import integers, reach

TAU = Fraction(1e-2)  # Formulations may still see contact past a free end by this share of the segment.


def is_of_kind(interface: Interface, z: FloatArray, kind: str, slave_segment: int, c: float) -> bool:
    """Return whether the projection of the point at c ∈ [−1, 1] of a slave segment is of a kind of `KIND_TESTS`."""
    return KIND_TESTS[kind](_Probe(interface, z, slave_segment, c))


def kind_of(interface: Interface, z: FloatArray, slave_segment: int, c: float) -> str:
    """Return the most special kind of the projection of a slave point, ``"other"`` if it has none.

    The arguments are those of `is_of_kind`.
    """
    probe = _Probe(interface, z, slave_segment, c)
    return next((kind for kind, test in KIND_TESTS.items() if test(probe)), "other")


class _Foot(NamedTuple):
    """The projection of a point onto one segment. Feet sort by distance, then by overshoot."""

    squared: Fraction  # The squared distance to the closed segment, in units of the lattice, and the squared overshoot.
    squared_overshoot: Fraction
    segment: int
    xi: Fraction  # Unclipped.

    @property
    def is_inside(self) -> bool:
        return 0 < self.xi < 1


class _Probe:
    """A slave point, and what the master looks like from there, in integers on one lattice."""

    def __init__(self, interface: Interface, z: FloatArray, slave_segment: int, c: float) -> None:
        nodes = as_integers(integers(np.asarray(z)[: interface.n_unknowns])[0]).reshape(-1, 2)
        self.slave: list[list[int]] = interface.slave.segments.tolist()
        self.master: list[list[int]] = interface.master.segments.tolist()
        self.neighbours: list[list[int]] = interface.master.neighbours.tolist()
        self.carrier, self.c = self.slave[slave_segment], c
        first, second = nodes[self.carrier]
        above, below = float(c).as_integer_ratio()
        self.point: Integers = (below - above) * first + (below + above) * second
        self.nodes: Integers = 2 * below * nodes
        self.feet = self.feet_of(self.point)
        self.home = self.feet[0]
        self.tied = [foot for foot in self.feet if foot.squared == self.home.squared]

    def feet_of(self, point: Integers) -> list[_Foot]:
        """Return the feet on all segments, the nearest first, of equally near ones that with the least overshoot."""
        feet, (x, y) = [], point
        for segment, ends in enumerate(self.master):
            first, second = self.nodes[ends]
            near = reach(segment, first, second, (x, y))
            distance, overshoot = Fraction(near.above, near.squared), Fraction(near.past**2, near.squared)
            feet.append(_Foot(distance, overshoot, segment, Fraction(near.along, near.squared)))
        return sorted(feet)

    def direction(self, segment: int) -> Integers:
        first, second = self.nodes[self.master[segment]]
        return np.asarray(second - first)

    def chain(self, segment: int) -> list[int]:
        """Return the segments of a master chain, from the first one of an open chain."""
        start = segment
        while (previous := self.neighbours[start][0]) >= 0 and previous != segment:
            start = previous
        chain = [start]
        while (following := self.neighbours[chain[-1]][1]) >= 0 and following != start:
            chain.append(following)
        return chain

    @property
    def past(self) -> Fraction | None:
        """The way of the foot past a free end, in lengths of the segment; None where the nearer end is not free."""
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
    return {covered[0]: "first", covered[-1]: "last"}.get(probe.home.segment, "intermediate") == role


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
    return abs(probe.c) == 1 and all(probe.feet_of(probe.nodes[node])[0].xi in (0, 1) for node in nodes)


def _vertex(probe: _Probe, sign: int, *, sharp: bool = False) -> bool:
    """Return whether the two nearest segments meet at a vertex that sticks out (sign 1) or in (−1), or is sharp."""
    for first, second in permutations([foot.segment for foot in probe.feet[:2]], 2):
        if probe.neighbours[first][1] == second:
            u, v = probe.direction(first), probe.direction(second)
            cross = int(u[0] * v[1] - u[1] * v[0])
            return _dot(u, v) < 0 and cross != 0 if sharp else cross * sign > 0
    return False


def _past_end(probe: _Probe, *, inside: bool) -> bool:
    return probe.past is not None and (0 < probe.past <= TAU if inside else probe.past > TAU)


def _small_overlap(probe: _Probe) -> bool:
    """Return whether the point is a slave node over the end of a chain, and its segment goes on past that end."""
    other = probe.nodes[probe.carrier[0 if probe.c == 1 else 1]]
    first, along = probe.nodes[probe.master[probe.home.segment][0]], probe.direction(probe.home.segment)
    xi = Fraction(_dot(other - first, along), _dot(along, along))
    outside = xi > 1 if probe.home.xi > Fraction(1, 2) else xi < 0
    return abs(probe.c) == 1 and probe.past is not None and Fraction(-1, 2) <= probe.past < 0 and outside


def _angle(probe: _Probe, degrees: float) -> bool:
    """Return whether the point is over the inside of a segment and its slave segment turned by an angle against it."""
    first, second = probe.nodes[probe.carrier]
    slave, master = second - first, probe.direction(probe.home.segment)
    if not probe.home.is_inside:
        return False
    facing = -_dot(slave, master)  # Zero degrees is antiparallel.
    if degrees == 90:
        return facing == 0
    if degrees == 180:
        return facing < 0 and bool(slave[0] * master[1] == slave[1] * master[0])
    cosine = sqrt(Fraction(facing**2, _dot(slave, slave) * _dot(master, master)))
    return facing > 0 and isclose(cosine, cos(radians(degrees)), rel_tol=1e-4)


def _second_body(probe: _Probe) -> bool:
    """Return whether the line through the point along the normal of the nearest segment meets two chains."""
    along, chains = probe.direction(probe.home.segment), set()
    for segment, ends in enumerate(probe.master):
        first, second = (probe.nodes[ends] - probe.point) @ along
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
    arms = {node: probe.nodes[node] - probe.point for ends in probe.master for node in ends}
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


def _dot(a: Integers, b: Integers) -> int:
    return int(a @ b)
