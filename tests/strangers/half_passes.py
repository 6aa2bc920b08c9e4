"""Half passes in both directions: each body is pushed by what its own surface sees, and hands no force to the other.

After Sauer and De Lorenzis, "A computational contact formulation based on surface potentials" (2013), Section 5: both
surfaces are slaves, and each pass keeps only the forces on its own nodes.
"""

from typing import Any

import numpy as np

from contactverif import Abilities, ContactPoints, PatchPromises, Promises, Rules, Traits
from strangers.strips import add_at, cross, dot, share_of, visible_strips

PLACES = 0.5 + np.sqrt(0.15) * np.array([-1.0, 0.0, 1.0])
WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18


class HalfPasses:
    """Springs at three Gauss points of each strip of either surface, in batches."""

    traits = Traits(
        promises=Promises(
            patch=PatchPromises(flat=True, kinked=True, overhang=True),
            converges=True,
            unbiased=True,
            nodes_push=True,
            local=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed", area="current"),
        abilities=Abilities(batched=True, takes_complex=True),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        sides = interface.slave.segments, interface.master.segments
        strips = [visible_strips(*each, x) for each in (sides, sides[::-1])]
        on_master = np.repeat([False, True], [len(each) for each in strips])
        pairing = {"strips": np.vstack(strips), "on_master": on_master}
        return {**pairing, "active": self._points(interface, pairing, x)[0] < 0}

    def _points(self, interface: Any, pairing: Any, x: Any) -> Any:
        """Return gap, s, t and weight of the points (..., n, 3), and normals (..., n, 2) into the body of the strip."""
        carrier, opposite = self._nodes(interface, pairing)
        a, first = x[..., carrier[:, 0], :], x[..., opposite[:, 0], :]
        along, run = x[..., carrier[:, 1], :] - a, x[..., opposite[:, 1], :] - first
        low, high = (share_of(pairing["strips"][:, 2 + end], end, carrier, x)[..., None] for end in (0, 1))
        square = dot(along, along)[..., None]
        size = np.sqrt(square)
        s = low + PLACES * (high - low)
        t = (s * square - dot(first - a, along)[..., None]) / dot(run, along)[..., None]
        gap = -(cross(along, first - a)[..., None] + t * cross(along, run)[..., None]) / size
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size
        return gap, s, t, WEIGHTS * (high - low) * size, normal

    @staticmethod
    def _nodes(interface: Any, pairing: Any) -> Any:
        """Return the nodes (n, 2) of the segments that carry the strips, and of those opposite."""
        number, other = pairing["strips"][:, 0], pairing["strips"][:, 1]
        nodes = np.empty((2, len(number), 2), np.int64)
        for second in (False, True):
            these = pairing["on_master"] == second
            sides = (interface.slave.segments, interface.master.segments)[:: -1 if second else 1]
            nodes[0, these], nodes[1, these] = sides[0][number[these]], sides[1][other[these]]
        return nodes

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(*z.shape[:-1], -1, 2)
        gap, s, _, weight, normal = self._points(interface, pairing, x)
        pull = self.penalty * np.where(pairing["active"], gap, 0) * weight
        forces, carrier = np.zeros_like(x), self._nodes(interface, pairing)[0]
        for end, share in enumerate((1 - s, s)):
            add_at(forces, carrier[:, end], (pull * share).sum(axis=-1)[..., None] * normal)
        return forces.reshape(z.shape)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x, strips = z.reshape(-1, 2), pairing["strips"]
        gap, s, t, weight, normal = self._points(interface, pairing, x)
        a, b = (x[self._nodes(interface, pairing)[0][:, end]][:, None] for end in (0, 1))
        position = ((1 - s)[..., None] * a + s[..., None] * b).reshape(-1, 2)
        normals, active, unknown = np.repeat(normal, 3, axis=0), pairing["active"].ravel(), np.full(gap.size, np.nan)
        pressure = np.where(active, -self.penalty * gap.ravel(), 0.0)
        carrier, opposite = (np.repeat(strips[:, column], 3) for column in (0, 1))
        places = (carrier, 2 * s.ravel() - 1, opposite, t.ravel(), position, normals, gap.ravel())
        on_master = np.repeat(pairing["on_master"], 3)
        return ContactPoints(*places, pressure, weight.ravel(), active, unknown, unknown, on_master=on_master)
