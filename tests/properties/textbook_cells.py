"""Right formulations as a stranger writes them from a textbook: integrals over cells.

A cell is the part of a master segment that the strip of a slave segment cuts out, as a polygon is clipped.
"""

from typing import Any

import numpy as np
from textbook_springs import Textbook, cross, dot, length, report

from contactverif.contract.formulation import ContactPoints


class ClippedCells(Textbook):
    """Springs at five Gauss points of each cell, along the slave's normal; they are reported in the order of gaps."""

    traits = Textbook.traits.revise(gap="cells", flat=True, overhang=True)
    gauss, shares = np.polynomial.legendre.leggauss(5)

    def pair(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        cells = [cell for segment in range(len(interface.slave)) for cell in self._cells(interface, x, segment)]
        table = np.array(cells, np.int64).reshape(-1, 4)
        pairing = {"slave": table[:, 0], "master": table[:, 1], "cut": table[:, 2:].astype(bool)}
        return {**pairing, "active": self._decide(interface, pairing, x)}

    def _decide(self, interface: Any, pairing: Any, x: Any) -> Any:
        return np.array([row[3] < 0 for row in self.points(interface, pairing, x)], bool)

    def _cells(self, interface: Any, x: Any, segment: int) -> list[tuple[int, int, bool, bool]]:
        """Return the cells of a slave segment: the nearest ones, where several lie behind one another."""
        a, b = x[interface.slave.segments[segment]]
        along, cells = b - a, []
        square = dot(along, along)
        for number, (first, second) in enumerate(interface.master.segments):
            start, end = dot(x[second] - a, along), dot(x[first] - a, along)
            low, high = max(start, 0.0), min(end, square)
            if start < end and low < high:
                share = ((low + high) / 2 - end) / (start - end)
                depth = cross(along, (1 - share) * (x[first] - a) + share * (x[second] - a))
                cells.append((abs(depth), low, high, (segment, number, start > 0, end < square)))
        return [
            cell
            for depth, low, high, cell in cells
            if all(other >= depth for other, start, end, _ in cells if start <= (low + high) / 2 <= end)
        ]

    def points(self, interface: Any, pairing: Any, x: Any) -> list[tuple[Any, ...]]:
        """Return (cell, s, t, gap, normal, weight) of each point: s on the slave, t on the master, both from 0 to 1."""
        rows = []
        for cell, (slave, master, cut) in enumerate(
            zip(*(pairing[k] for k in ("slave", "master", "cut")), strict=True)
        ):
            (a, b), (first, second) = (x[interface.slave.segments[slave]], x[interface.master.segments[master]])
            along = b - a
            size = length(along)
            start, end = dot(second - a, along) / size**2, dot(first - a, along) / size**2
            low, high = start if cut[0] else 0.0, end if cut[1] else 1.0
            normal = np.array([-along[1], along[0]]) / size
            for place, share in zip(self.gauss, self.shares, strict=True):
                s = (low + high) / 2 + place * (high - low) / 2
                t = (s - end) / (start - end)
                gap = -dot((1 - t) * (first - a) + t * (second - a), normal)
                rows.append((cell, s, t, gap, normal, (high - low) * size * share / 2))
        return rows

    def pressures(self, interface: Any, pairing: Any, rows: Any) -> list[Any]:
        """Return the pressure at each point times −1."""
        return [self.penalty * row[3] * active for row, active in zip(rows, pairing["active"], strict=True)]

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        forces, rows = np.zeros_like(x), self.points(interface, pairing, x)
        for row, pull in zip(rows, self.pressures(interface, pairing, rows), strict=True):
            cell, s, t, _, normal, weight = row
            force = pull * weight * normal
            slave = interface.slave.segments[pairing["slave"][cell]]
            master = interface.master.segments[pairing["master"][cell]]
            for node, share in ((slave[0], 1 - s), (slave[1], s), (master[0], t - 1), (master[1], -t)):
                forces[node] += share * force
        return forces.reshape(-1)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x, rows = z.reshape(-1, 2), []
        points = self.points(interface, pairing, x)
        for row, pull, active in zip(
            points, self.pressures(interface, pairing, points), pairing["active"], strict=True
        ):
            cell, s, t, gap, normal, weight = row
            slave, master = pairing["slave"][cell], pairing["master"][cell]
            a, b = x[interface.slave.segments[slave]]
            rows.append((slave, 2 * s - 1, master, t, (1 - s) * a + s * b, normal, gap, -pull, weight, active))
        return report(sorted(rows, key=lambda row: row[6]))


class WeightedGaps(ClippedCells):
    """A mortar method: nodal gaps ∫N g / ∫N over the cells, and pressures between the nodes."""

    gauss, shares = np.polynomial.legendre.leggauss(3)

    def _decide(self, interface: Any, pairing: Any, x: Any) -> Any:
        gaps, weights = self._gaps(interface, pairing, self.points(interface, pairing, x))
        return (weights > 0) & (gaps < 0)

    def _gaps(self, interface: Any, pairing: Any, rows: Any) -> tuple[Any, Any]:
        sums, weights = np.zeros((2, interface.n_slave_nodes), np.result_type(float, *(row[3] for row in rows)))
        for cell, s, _, gap, _, weight in rows:
            for node, share in zip(interface.slave.segments[pairing["slave"][cell]], (1 - s, s), strict=True):
                sums[node] += share * weight * gap
                weights[node] += share * weight
        return sums / np.where(weights == 0, 1, weights), weights

    def pressures(self, interface: Any, pairing: Any, rows: Any) -> list[Any]:
        nodal = self._gaps(interface, pairing, rows)[0] * self.penalty * pairing["active"]
        ends = interface.slave.segments[pairing["slave"]]
        return [(1 - row[1]) * nodal[ends[row[0], 0]] + row[1] * nodal[ends[row[0], 1]] for row in rows]

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x, rows = z.reshape(-1, 2), []
        gaps, weights = self._gaps(interface, pairing, self.points(interface, pairing, x))
        for node in range(interface.n_slave_nodes):
            segment, end = np.argwhere(interface.slave.segments == node)[0]
            along = np.subtract(*x[interface.slave.segments[segment]][::-1])
            normal, active = np.array([-along[1], along[0]]) / length(along), pairing["active"][node]
            gap = gaps[node] if weights[node] > 0 else np.nan
            pressure = -self.penalty * gap if active else 0.0
            rows.append((segment, 2.0 * end - 1, -1, np.nan, x[node], normal, gap, pressure, weights[node], active))
        return report(rows, weighted=np.array(True))
