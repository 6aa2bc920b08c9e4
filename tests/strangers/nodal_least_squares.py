"""Pressures between the slave's nodes that fit those of the springs best, in the sense of least squares.

After Puso and Laursen, "A mortar segment-to-segment contact method" (2004), with the consistent mass of a projection in
L2 in place of gaps that each node weighs by itself: of all pressures p = ΣN_j p_j with p_j ≥ 0, the formulation takes
the one for which ∫(p + ε̂ g)² over what is covered is least. Its active nodes A solve Σ_A M_ij p_j = −ε̂ ∫N_i g, with M =
∫N_i N_j. Nodes whose weighted gap is open are never active, since no entry of M is negative.
"""

from typing import Any

import numpy as np
from scipy.optimize import nnls

from contactverif import Abilities, PatchPromises, Promises, Rules, Traits
from strangers.strips import add_at, dot, share_of, visible_strips

PLACES, WEIGHTS = np.array([0.5 - 12**-0.5, 0.5 + 12**-0.5]), np.array([0.5, 0.5])


class NodalLeastSquares:
    """Springs with projected pressures, in batches of real or complex states; no tangent, and no contact points."""

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
        sums, mass = self._integrals(interface, strips, self._at_points(interface, strips, x))
        covered = np.flatnonzero(mass.diagonal() > 0)
        active = np.zeros(interface.n_slave_nodes, bool)
        if (sums < 0).any():
            # Shapes of one size, however little of a node is covered, and forces of one size in any unit.
            scale, size = np.sqrt(mass.diagonal()[covered]), np.abs(sums).max()
            factor = np.linalg.cholesky(mass[np.ix_(covered, covered)] / np.outer(scale, scale))
            fit, _ = nnls(factor.T, np.linalg.solve(factor, -sums[covered] / size / scale))
            active[covered] = fit > 0
        return {"strips": strips, "active": active}

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

    def _integrals(self, interface: Any, strips: Any, points: Any) -> Any:
        """Return ∫N g (..., n_slave_nodes) and M (..., n_slave_nodes, n_slave_nodes)."""
        gap, s, _, weight, _ = points
        n, ends = interface.n_slave_nodes, interface.slave.segments[strips[:, 0]]
        mass = np.zeros((*gap.shape[:-2], n, n), gap.dtype)
        sums = np.zeros((*gap.shape[:-2], n), gap.dtype)
        shapes = 1 - s, s
        for i in range(2):
            np.add.at(sums, (..., ends[:, i]), (shapes[i] * weight * gap).sum(axis=-1))
            for j in range(2):
                np.add.at(mass, (..., ends[:, i], ends[:, j]), (shapes[i] * shapes[j] * weight).sum(axis=-1))
        return sums, mass

    def _pressures(self, interface: Any, pairing: Any, points: Any) -> Any:
        """Return the nodal pressures (..., n_slave_nodes), 0 where a node is not active."""
        sums, mass = self._integrals(interface, pairing["strips"], points)
        nodes = np.flatnonzero(pairing["active"])
        pressures = np.zeros_like(sums)
        size = np.abs(np.diagonal(mass, axis1=-2, axis2=-1).real[..., nodes])
        scale = np.sqrt(np.where(size > 0, size, 1))  # It cancels, and keeps digits where little is covered.
        scaled = mass[..., nodes[:, None], nodes] / (scale[..., None] * scale[..., None, :])
        fit = np.linalg.solve(scaled, (-sums[..., nodes] / scale)[..., None])[..., 0]
        pressures[..., nodes] = self.penalty * fit / scale
        return pressures

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, strips = z.reshape(*z.shape[:-1], -1, 2), pairing["strips"]
        points = self._at_points(interface, strips, x)
        nodal = -self._pressures(interface, pairing, points)
        _, s, t, weight, normal = points
        slave, master = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        pull = (1 - s) * nodal[..., slave[:, 0], None] + s * nodal[..., slave[:, 1], None]
        forces = np.zeros_like(x)
        for nodes, share in ((slave[:, 0], 1 - s), (slave[:, 1], s), (master[:, 0], t - 1), (master[:, 1], -t)):
            add_at(forces, nodes, (pull * share * weight).sum(axis=-1)[..., None] * normal)
        return forces.reshape(z.shape)
