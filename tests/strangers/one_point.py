"""One virtual slave node for each slave segment, which hands its force to all master segments under its area.

After Zavarise and De Lorenzis, "A modified node-to-segment algorithm passing the contact patch test" (2009), with one
virtual slave node. The area of competence is what of the segment faces the master, the node is its middle, and the
force reaches the master by the lengths of the strips, so that forces balance at any tilt.
"""

from typing import Any

import numpy as np

from contactverif import Abilities, PatchPromises, Promises, Rules, Traits
from strangers.closest import closest_segments
from strangers.strips import add_at, dot, share_of, visible_strips


class OnePoint:
    """Springs at the middles of what slave segments see, in batches; no tangent, and no contact points."""

    traits = Traits(
        promises=Promises(
            patch=PatchPromises(flat=True, overhang=True),
            converges=True,
            conserves_force=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed", area="current"),
        abilities=Abilities(batched=True, takes_complex=True),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        strips = visible_strips(interface.slave.segments, interface.master.segments, x)
        numbers, area = np.unique(strips[:, 0], return_inverse=True)
        pairing = {"strips": strips, "area": area.astype(np.int64), "carrier": numbers.astype(np.int64)}
        middle, point, _ = self._areas(interface, pairing, x)
        home, over = closest_segments(point, interface.master, x)
        gap, _, _ = self._gaps(interface, home, middle, pairing["carrier"], x)
        return {**pairing, "home": home.astype(np.int64), "active": over & (gap < 0)}

    def _areas(self, interface: Any, pairing: Any, x: Any) -> Any:
        """Return the middle share, the point and the length of each area, and what a strip has of them."""
        strips, area = pairing["strips"], pairing["area"]
        slave = interface.slave.segments[strips[:, 0]]
        low, high = share_of(strips[:, 2], 0, slave, x), share_of(strips[:, 3], 1, slave, x)
        sums = np.zeros((2, *low.shape[:-1], len(pairing["carrier"])), low.dtype)
        np.add.at(sums[0], (..., area), high - low)
        np.add.at(sums[1], (..., area), (high - low) * (high + low) / 2)
        middle = sums[1] / sums[0]
        a, b = (x[..., interface.slave.segments[pairing["carrier"], end], :] for end in (0, 1))
        point = (1 - middle)[..., None] * a + middle[..., None] * b
        return middle, point, (low, high, sums[0])

    def _gaps(self, interface: Any, home: Any, middle: Any, carrier: Any, x: Any) -> Any:
        """Return gap, normal of the closest segment, and length of the slave segment."""
        a, b = (x[..., interface.slave.segments[carrier, end], :] for end in (0, 1))
        first, second = (x[..., interface.master.segments[home, end], :] for end in (0, 1))
        run = second - first
        normal = np.stack([run[..., 1], -run[..., 0]], axis=-1) / np.sqrt(dot(run, run))[..., None]
        gap = (1 - middle) * dot(a - first, normal) + middle * dot(b - first, normal)
        return gap, normal, np.sqrt(dot(b - a, b - a))

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(*z.shape[:-1], -1, 2)
        strips, area, carrier = pairing["strips"], pairing["area"], pairing["carrier"]
        middle, _, (low, high, covered) = self._areas(interface, pairing, x)
        gap, normal, length = self._gaps(interface, pairing["home"], middle, carrier, x)
        pull = (self.penalty * np.where(pairing["active"], gap * covered * length, 0))[..., None] * normal
        slave, master = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        a, along = x[..., slave[:, 0], :], x[..., slave[:, 1], :] - x[..., slave[:, 0], :]
        first, run = x[..., master[:, 0], :] - a, x[..., master[:, 1], :] - x[..., master[:, 0], :]
        s = (low + high) / 2  # A linear shape has its mean in the middle of the strip.
        t = (s * dot(along, along) - dot(first, along)) / dot(run, along)
        part = ((high - low) / covered[..., area])[..., None] * pull[..., area, :]
        forces = np.zeros_like(x)
        add_at(forces, interface.slave.segments[carrier, 0], (1 - middle)[..., None] * pull)
        add_at(forces, interface.slave.segments[carrier, 1], middle[..., None] * pull)
        add_at(forces, master[:, 0], (t - 1)[..., None] * part)
        add_at(forces, master[:, 1], -t[..., None] * part)
        return forces.reshape(z.shape)
