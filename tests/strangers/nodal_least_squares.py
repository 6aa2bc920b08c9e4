"""Pressures between the slave's nodes that fit the gaps best in the sense of least squares, with a consistent mass.

After Puso and Laursen, "A mortar segment-to-segment contact method" (2004), with the projection of L2 in place of gaps
that each node weighs by itself: the nodal gaps solve M ĝ = ∫N g, with M = ∫N Nᵀ over what is covered.
"""

from typing import Any

import numpy as np

from contactverif import Abilities, PatchPromises, Promises, Rules, Traits
from strangers.strips import add_at, dot, share_of, visible_strips

PLACES, WEIGHTS = np.array([0.5 - 12**-0.5, 0.5 + 12**-0.5]), np.array([0.5, 0.5])


class NodalLeastSquares:
    """Nodal springs of a projected gap, in batches of real or complex states; no tangent, and no contact points.

    A node is in contact if its projected gap and its weighted gap are both closed, so that a projection which swings
    past zero beside a deep penetration begins no contact.
    """

    traits = Traits(
        promises=Promises(
            patch=PatchPromises(flat=True, kinked=True, overhang=True),
            converges=True,
            locks=False,
            conserves_force=True,
            conserves_moment=True,
            nodes_push=True,
            local=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed", area="current", force_along="slave normal"),
        abilities=Abilities(batched=True, takes_complex=True),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        strips = visible_strips(interface.slave.segments, interface.master.segments, x)
        sums, gaps = self._project(interface, strips, self._at_points(interface, strips, x))
        return {"strips": strips, "active": (gaps < 0) & (sums < 0)}

    def _at_points(self, interface: Any, strips: Any, x: Any) -> Any:
        """Return gap, s, t, weight (..., n, 2) and normal (..., n, 2) of the points of each strip."""
        slave, master = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        low, high = share_of(strips[:, 2], 0, slave, x), share_of(strips[:, 3], 1, slave, x)
        a, first, second = x[..., slave[:, 0], :], x[..., master[:, 0], :], x[..., master[:, 1], :]
        along = x[..., slave[:, 1], :] - a
        s = low[..., None] + (high - low)[..., None] * PLACES
        foot, run = dot(first - a, along)[..., None], dot(second - first, along)[..., None]
        t = (s * dot(along, along)[..., None] - foot) / run
        size = np.sqrt(dot(along, along))
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
        gap = -(dot(first - a, normal)[..., None] + t * dot(second - first, normal)[..., None])
        return gap, s, t, ((high - low) * size)[..., None] * WEIGHTS, normal

    def _project(self, interface: Any, strips: Any, points: Any) -> Any:
        """Return ∫N g and the projected gaps (..., n_slave_nodes); 0 at nodes that see nothing."""
        gap, s, _, weight, _ = points
        n, ends = interface.n_slave_nodes, interface.slave.segments[strips[:, 0]]
        mass = np.zeros((*gap.shape[:-2], n, n), gap.dtype)
        sums = np.zeros((*gap.shape[:-2], n), gap.dtype)
        shapes = 1 - s, s
        for i in range(2):
            np.add.at(sums, (..., ends[:, i]), (shapes[i] * weight * gap).sum(axis=-1))
            for j in range(2):
                np.add.at(mass, (..., ends[:, i], ends[:, j]), (shapes[i] * shapes[j] * weight).sum(axis=-1))
        diagonal = np.diagonal(mass, axis1=-2, axis2=-1)
        covered = (diagonal.real > 0).all(axis=tuple(range(diagonal.ndim - 1)))
        scale = np.sqrt(np.where(covered, diagonal, 1))  # Shapes of one size, however little of a node is covered.
        scaled = np.where(covered[:, None] | covered, mass / scale[..., None] / scale[..., None, :], 0) + np.diag(
            (~covered).astype(float)
        )
        return sums, np.linalg.solve(scaled, (sums / scale)[..., None])[..., 0] / scale

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, strips = z.reshape(*z.shape[:-1], -1, 2), pairing["strips"]
        points = self._at_points(interface, strips, x)
        nodal = self.penalty * np.where(pairing["active"], self._project(interface, strips, points)[1], 0)
        _, s, t, weight, normal = points
        slave, master = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        pull = (1 - s) * nodal[..., slave[:, 0], None] + s * nodal[..., slave[:, 1], None]
        forces = np.zeros_like(x)
        for nodes, share in ((slave[:, 0], 1 - s), (slave[:, 1], s), (master[:, 0], t - 1), (master[:, 1], -t)):
            add_at(forces, nodes, (pull * share * weight).sum(axis=-1)[..., None] * normal)
        return forces.reshape(z.shape)
