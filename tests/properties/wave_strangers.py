"""Right formulations of another kind for nearly flat surfaces, as a stranger might write them; no plugin's code.

Gaps are heights, seen straight down. Each slave segment is cut at the master's nodes, and pressures are linear there or
constant on the whole segment.
"""

from typing import Any

import numpy as np

from contactverif import ContactPoints, Promises, Rules, Traits

POINTS, WEIGHTS = np.polynomial.legendre.leggauss(2)


class Heights:
    """Springs between heights on the pieces of a common mesh.

    `constant` takes the mean gap of each slave segment for the whole of it; `reports` adds contact points. There is no
    pairing and no tangent.
    """

    traits = Traits(promises=Promises(converges=True), rules=Rules(penalty="distributed"))

    def __init__(self, penalty: float, constant: bool, reports: str = "") -> None:
        self.penalty, self.constant = penalty, constant
        if reports:
            self.contact_points = self._contact_points
            self.reports = reports

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        slave, master, share, place, weight, pressure = self._pieces(interface, x)
        forces = np.zeros_like(x)
        upwards = np.sign(x[interface.slave.segments[0], 0] @ [-1, 1])  # The slave is on top if it runs in +x.
        load = upwards * weight * pressure
        for nodes, shares, sign in ((slave, share, -1), (master, place, 1)):
            np.add.at(forces[:, 1], nodes[:, 0], sign * (1 - shares) * load)
            np.add.at(forces[:, 1], nodes[:, 1], sign * shares * load)
        return forces.reshape(-1)

    def _pieces(self, interface: Any, x: Any) -> Any:
        """Return slave and master nodes (n, 2), places on both, weights and pressures of the points."""
        ends = {side: x[getattr(interface, side).segments][:, :, 0] for side in ("slave", "master")}
        cuts = np.unique(np.concatenate([ends["slave"].ravel(), ends["master"].ravel()]))
        low, high = cuts[:-1], cuts[1:]
        at = ((low + high) / 2 + np.multiply.outer(POINTS, high - low) / 2).ravel()
        weight = np.multiply.outer(WEIGHTS, (high - low) / 2).ravel()
        nodes, shares, heights, numbers = [], [], [], []
        for side in ("slave", "master"):
            sorted_ends = np.sort(ends[side], axis=1)
            number = np.argmax((sorted_ends[:, :1] <= at) & (at <= sorted_ends[:, 1:]), axis=0)
            pair = getattr(interface, side).segments[number]
            place = (at - x[pair[:, 0], 0]) / (x[pair[:, 1], 0] - x[pair[:, 0], 0])
            heights.append((1 - place) * x[pair[:, 0], 1] + place * x[pair[:, 1], 1])
            nodes.append(pair)
            shares.append(place)
            numbers.append(number)
        upwards = np.sign(x[interface.slave.segments[0], 0] @ [-1, 1])
        gap = upwards * (heights[0] - heights[1])
        if self.constant:
            sums = [np.bincount(numbers[0], weights=weight * values) for values in (gap, np.ones_like(gap))]
            gap = (sums[0] / sums[1])[numbers[0]]
        return nodes[0], nodes[1], shares[0], shares[1], weight, self.penalty * np.maximum(-gap, 0.0)

    def _contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x = z.reshape(-1, 2)
        slave, _, share, _, weight, pressure = self._pieces(interface, x)
        position = (1 - share)[:, None] * x[slave[:, 0]] + share[:, None] * x[slave[:, 1]]
        first = interface.slave.segments[:, 0]
        segment = np.argmax(slave[:, :1] == first, axis=1)
        if self.reports == "segments":  # One point in the middle of each slave segment
            ends = x[interface.slave.segments]
            load = np.bincount(segment, weights=weight * pressure)
            weight = np.bincount(segment, weights=weight)
            segment, share = np.arange(len(weight)), np.full(len(weight), 0.5)
            position, pressure = ends.mean(axis=1), load / weight
        master, nothing = np.full(len(weight), -1), np.full(len(weight), np.nan)
        normal, gap = np.tile([0.0, 1.0], (len(weight), 1)), -pressure / self.penalty
        places = (segment, 2 * share - 1, master, nothing, position, normal)
        return ContactPoints(*places, gap, pressure, weight, pressure > 0, nothing, nothing)
