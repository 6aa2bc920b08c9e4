"""Springs on the lines halfway between slave and master segments, which treat both surfaces alike.

After McDevitt and Laursen, "A mortar-finite element formulation for frictional contact problems" (2000): both segments
of a pair are projected on a line between them, gaps and pressures act along its normal, and lengths are its own.
"""

from typing import Any

import numpy as np

from contactverif import Abilities, PatchPromises, Promises, Rules, Traits
from strangers.strips import add_at, cross, dot, visible_strips

PLACES = np.array([0.5 - 12**-0.5, 0.5 + 12**-0.5])


class MiddleLine:
    """Springs at two Gauss points of each overlap on a middle line, with a decision of its own; batches."""

    traits = Traits(
        promises=Promises(
            patch=PatchPromises(flat=True, kinked=True, overhang=True),
            converges=True,
            conserves_force=True,
            conserves_moment=True,
            unbiased=True,
            nodes_push=True,
            local=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed"),
        abilities=Abilities(batched=True, takes_complex=True),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        """Return the pairs that one side or the other sees, and which of their ends bound the overlap."""
        x = z.reshape(-1, 2)
        sides = interface.slave.segments, interface.master.segments
        pairs = {(int(i), int(j)) for i, j in visible_strips(*sides, x)[:, :2]}
        pairs |= {(int(i), int(j)) for j, i in visible_strips(*sides[::-1], x)[:, :2]}
        table = np.array(sorted(pairs), np.int64).reshape(-1, 2)
        a, b, first, second = self._places(*self._line(interface, table, x)[:2])
        by_slave = np.stack([a >= second, b <= first], axis=-1)
        pairing = {"pairs": table, "cut by slave": by_slave, "overlaps": np.maximum(a, second) < np.minimum(b, first)}
        return {**pairing, "active": self._at_points(interface, pairing, x)[0] < 0}

    def _line(self, interface: Any, pairs: Any, x: Any) -> Any:
        """Return the corners (..., n, 4, 2) relative to the slave's first node, and the middle line's direction."""
        nodes = np.hstack([interface.slave.segments[pairs[:, 0]], interface.master.segments[pairs[:, 1]]])
        corners = x[..., nodes, :] - x[..., nodes[:, :1], :]
        u, v = corners[..., 1, :] - corners[..., 0, :], corners[..., 2, :] - corners[..., 3, :]
        line = u / np.sqrt(dot(u, u))[..., None] + v / np.sqrt(dot(v, v))[..., None]
        return corners, line / np.sqrt(dot(line, line))[..., None], nodes

    @staticmethod
    def _places(corners: Any, line: Any) -> Any:
        """Return the places (4, ..., n) of the corners along the line."""
        return np.moveaxis(dot(corners, line[..., None, :]), -1, 0)

    def _at_points(self, interface: Any, pairing: Any, x: Any) -> Any:
        corners, line, nodes = self._line(interface, pairing["pairs"], x)
        a, b, first, second = self._places(corners, line)
        heights = cross(line[..., None, :], corners)
        by_slave = pairing["cut by slave"]
        low, high = np.where(by_slave[:, 0], a, second), np.where(by_slave[:, 1], b, first)
        at = low[..., None] + (high - low)[..., None] * PLACES
        s = (at - a[..., None]) / (b - a)[..., None]
        t = (at - first[..., None]) / (second - first)[..., None]
        gap = (1 - s) * heights[..., 0, None] + s * heights[..., 1, None]
        gap = gap - (1 - t) * heights[..., 2, None] - t * heights[..., 3, None]
        normal = np.stack([-line[..., 1], line[..., 0]], axis=-1)
        weight = np.where(pairing["overlaps"], high - low, 0)[..., None] / 2
        return gap, s, t, weight, normal, nodes

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(*z.shape[:-1], -1, 2)
        gap, s, t, weight, normal, nodes = self._at_points(interface, pairing, x)
        pull = self.penalty * np.where(pairing["active"], gap, 0) * weight
        forces = np.zeros_like(x)
        for number, share in enumerate((1 - s, s, t - 1, -t)):
            add_at(forces, nodes[:, number], (pull * share).sum(axis=-1)[..., None] * normal)
        return forces.reshape(z.shape)
