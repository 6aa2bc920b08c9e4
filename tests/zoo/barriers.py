"""Barriers that promise to let nothing through, and do: each has one fault that uniform gaps do not show."""

import numpy as np

from zoo.at_points import LogBarrier
from zoo.making import add


class SlaveAlone(LogBarrier):
    """Only nodes of the slave are looked at."""

    def pair(self, interface, z):
        pairs = super().pair(interface, z)["pairs"]
        return {"pairs": pairs[pairs[:, 1] < interface.n_slave_nodes]}


class InsidesAlone(LogBarrier):
    """A node whose nearest place is a vertex is not looked at."""

    def pair(self, interface, z):
        pairs = super().pair(interface, z)["pairs"]
        return {"pairs": pairs[pairs[:, 0] == 0]}


class HalfAtVertices(LogBarrier):
    """The force is halved where the nearest place is a vertex."""

    def _terms(self, interface, pairing, z):
        weight, *others = super()._terms(interface, pairing, z)
        return weight * (1 - pairing["pairs"][:, 0] / 2), *others


class Bounded(LogBarrier):
    """The force ends at that of some share of the activation distance."""

    share = 1e-7

    def _derivatives(self, distance, interface):
        return super()._derivatives(np.maximum(distance, self.share * self._range(interface)), interface)


class BoundedWork(LogBarrier):
    """The force has no bound, but goes with the root of the gap."""

    def _derivatives(self, distance, interface):
        slope, curvature = super()._derivatives(distance, interface)
        root = np.sqrt(distance / self._range(interface))
        return slope * root, curvature * root + slope / (2 * root * self._range(interface))


for _name, _make in (
    ("barrier of the slave's nodes alone", SlaveAlone),
    ("barrier of the insides of segments alone", InsidesAlone),
    ("barrier halved at vertices", HalfAtVertices),
    ("barrier that stops growing at 1e-7 of its reach", Bounded),
    ("barrier whose work is bounded", BoundedWork),
):
    add(_name, "intersection-free", _make)
