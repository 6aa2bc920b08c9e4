"""Right formulations as a stranger writes them from a textbook: springs at points, in loops.

No code of a plugin is used. All parts of the contract are there: pairing, residual, a tangent by a complex step, and
contact points. Each subclass is right in another way: where it rounds, what law its springs have, which of two tied
segments it takes, how far past a free end it looks.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from contactverif import Abilities, ContactPoints, Promises, Rules, Traits

STEP = 1e-40  # The complex step: no difference is formed, so any step will do.


def cross(p: Any, q: Any) -> Any:
    return p[0] * q[1] - p[1] * q[0]


def dot(p: Any, q: Any) -> Any:
    return p[0] * q[0] + p[1] * q[1]


def length(p: Any) -> Any:
    return np.sqrt(dot(p, p))  # A complex vector has no `hypot`.


class Textbook:
    """A formulation whose tangent is computed by a complex step."""

    traits = Traits(
        promises=Promises(conserves_force=True, conserves_moment=True, tangent="exact", translation_stable=True),
        rules=Rules(gap="closest point", area="current", penalty="distributed"),
        abilities=Abilities(takes_complex=True),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        moved = z + 1j * STEP * np.eye(z.size)
        return np.column_stack([self.residual(interface, pairing, state).imag / STEP for state in moved])

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        raise NotImplementedError


def report(rows: list[tuple[Any, ...]], **flags: Any) -> ContactPoints:
    """Return contact points from rows in the order of the fields; the areas have no ends."""
    whole, real, vector = np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 2))
    empty = (whole, real, whole, real, vector, vector, real, real, real, np.zeros(0, bool))
    columns = [np.array(column) for column in zip(*rows, strict=True)] or list(empty)
    nothing = np.full(len(rows), np.nan)
    return ContactPoints(*columns, nothing, nothing, **flags)


class CentredSprings(Textbook):
    """Springs at two Gauss points of each slave segment; the mean of all nodes is subtracted first.

    Points are formed before a node is subtracted. The last of tied segments is taken, and a point past a free end
    counts up to 0.3 segments.
    """

    c = (-1 / np.sqrt(3), 1 / np.sqrt(3))
    tau = 0.3

    def law(self, gap: Any) -> Any:
        return self.penalty * gap

    def points(self, interface: Any) -> Iterator[tuple[int, int, int, float]]:
        """Yield the slave segment, its two nodes and c of each point."""
        for segment, (a, b) in enumerate(interface.slave.segments):
            for c in self.c:
                yield segment, a, b, c

    def look(self, x: Any, a: int, b: int, c: float, master: Any) -> tuple[Any, Any, Any, float]:
        """Return gap, ξ, normal and distance of a point and a master segment."""
        x = x - x.mean(axis=0)
        first, second = x[master[0]], x[master[1]]
        arm = (1 - c) / 2 * x[a] + (1 + c) / 2 * x[b] - first
        along = second - first
        size = length(along)
        normal = np.array([along[1], -along[0]]) / size
        xi = dot(arm, along) / size**2
        over = arm if xi.real <= 0 else arm - along
        gap = dot(arm, normal)
        return gap, xi, normal, abs(gap) if 0 < xi.real < 1 else abs(length(over))

    def pair(self, interface: Any, z: Any) -> Any:
        x = z[: interface.n_unknowns].reshape(-1, 2)
        masters, active = [], []
        for _, a, b, c in self.points(interface):
            views = [self.look(x, a, b, c, master) for master in interface.master.segments]
            distances = [view[3] for view in views]
            best = len(views) - 1 - int(np.argmin(distances[::-1]))
            gap, xi, *_ = views[best]
            free = interface.master.neighbours[best] < 0
            masters.append(best)
            active.append(gap < 0 and not (free[0] and xi < -self.tau) and not (free[1] and xi > 1 + self.tau))
        return {"master": np.array(masters), "active": np.array(active)}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        forces = np.zeros_like(x)
        for number, (_, a, b, c) in enumerate(self.points(interface)):
            if pairing["active"][number]:
                first, second = master = interface.master.segments[pairing["master"][number]]
                gap, xi, normal, _ = self.look(x, a, b, c, master)
                force = self.law(gap) * length(x[b] - x[a]) / len(self.c) * normal
                forces[a] += (1 - c) / 2 * force
                forces[b] += (1 + c) / 2 * force
                forces[first] -= (1 - xi) * force
                forces[second] -= xi * force
        return forces.reshape(-1)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x, rows = z[: interface.n_unknowns].reshape(-1, 2), []
        for number, (segment, a, b, c) in enumerate(self.points(interface)):
            master, active = pairing["master"][number], pairing["active"][number]
            gap, xi, normal, _ = self.look(x, a, b, c, interface.master.segments[master])
            place, weight = (1 - c) / 2 * x[a] + (1 + c) / 2 * x[b], length(x[b] - x[a]) / len(self.c)
            pressure = -self.law(gap) if active else 0.0
            rows.append((segment, c, master, xi, place, normal, gap, pressure, weight, active))
        return report(rows)


class QuadraticSprings(CentredSprings):
    """Springs whose force grows with the square of the penetration, so that no patch test is promised."""

    tau = 0.0
    traits = Textbook.traits.revise(area=None, penalty=None)

    def law(self, gap: Any) -> Any:
        return -self.penalty * gap**2


class NodalMultipliers(CentredSprings):
    """A multiplier on each slave node, the force that closes its gap."""

    traits = Textbook.traits.revise(area=None, penalty="nodal", enforcement="multiplier")
    tau = 0.0

    def n_multipliers(self, interface: Any) -> int:
        return int(interface.n_slave_nodes)

    def points(self, interface: Any) -> Iterator[tuple[int, int, int, float]]:
        for node in range(interface.n_slave_nodes):
            segment, end = np.argwhere(interface.slave.segments == node)[-1]
            yield int(segment), *interface.slave.segments[segment], -1.0 if end == 0 else 1.0

    def pair(self, interface: Any, z: Any) -> Any:
        x, n = z[: interface.n_unknowns].reshape(-1, 2), interface.n_unknowns
        pairing = super().pair(interface, z)
        active = []
        for number, (_, a, b, c) in enumerate(self.points(interface)):
            master = pairing["master"][number]
            gap, xi, *_ = self.look(x, a, b, c, interface.master.segments[master])
            free = interface.master.neighbours[master] < 0
            faces = not (free[0] and xi < 0) and not (free[1] and xi > 1)
            active.append(faces and z[n + number] - self.penalty * gap > 0)
        return {"master": pairing["master"], "active": np.array(active)}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        n = interface.n_unknowns
        x, multipliers = z[:n].reshape(-1, 2), z[n:]
        forces, rows = np.zeros_like(x), np.array(multipliers)
        for number, (_, a, b, c) in enumerate(self.points(interface)):
            if pairing["active"][number]:
                first, second = master = interface.master.segments[pairing["master"][number]]
                gap, xi, normal, _ = self.look(x, a, b, c, master)
                rows[number] = -gap
                force = -multipliers[number] * normal
                forces[a if c < 0 else b] += force
                forces[first] -= (1 - xi) * force
                forces[second] -= xi * force
        return np.concatenate([forces.reshape(-1), rows])

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        points = super().contact_points(interface, pairing, z)
        forces = np.where(pairing["active"], z[interface.n_unknowns :], 0.0)
        return replace(points, pressure=forces, weight=np.ones(len(forces)))
