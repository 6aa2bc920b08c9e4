"""A bed of springs on exact segments, three Gauss points each, and the same from both sides with half the stiffness.

After Zavarise and Wriggers, "A segment-to-segment contact strategy" (1998), with a penalty in place of multipliers: gap
and pressure act along the slave's normal at both facing points. The tangent takes complex steps of each strip alone.
"""

from typing import Any

import numpy as np
from scipy import sparse

from contactverif import Abilities, ContactPoints, Interface, PatchPromises, Promises, Rules, Traits
from strangers.strips import add_at, cross, dot, visible_strips

GAUSS = (np.polynomial.legendre.leggauss(3)[0] + 1) / 2, np.polynomial.legendre.leggauss(3)[1] / 2
STEP = 2.0**-200


class SegmentPenalty:
    """Springs at three Gauss points of each strip, each with a decision of its own; batches, and an exact tangent."""

    traits = Traits(
        promises=Promises(
            patch=PatchPromises(flat=True, kinked=True, overhang=True),
            converges=True,
            integrates_linear_gap=True,
            tangent="exact",
            conserves_force=True,
            conserves_moment=True,
            continuity="C0",
            local=True,
            nodes_push=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed", area="current", force_along="slave normal"),
        abilities=Abilities(batched=True, takes_complex=True),
    )

    places, weights = GAUSS
    snap = 0.0  # The share of a segment within which a node of the master lies on its end.

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        strips = visible_strips(interface.slave.segments, interface.master.segments, x, self.snap)
        return {"strips": strips, "active": self._at_points(self._corners(interface, strips, x))[0] < 0}

    def _corners(self, interface: Any, strips: Any, x: Any) -> Any:
        """Return the nodes (..., n, 6, 2) that a strip depends on: two of each segment, and those that cut it."""
        return x[..., self._nodes(interface, strips), :]

    def _nodes(self, interface: Any, strips: Any) -> Any:
        segments = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        ends = np.where(strips[:, 2:] < 0, segments[0], strips[:, 2:])  # An end cuts at itself: its share is exact.
        return np.hstack([*segments, ends])

    def _at_points(self, corners: Any) -> Any:
        """Return gap, s, t, weight of the points (..., n, n_places), and the normal into the slave (..., n, 1, 2)."""
        a, b, first, second, low, high = (corners[..., number, :] for number in range(6))
        along = b - a
        square = dot(along, along)
        start, end = dot(low - a, along) / square, dot(high - a, along) / square
        s = start[..., None] + (end - start)[..., None] * self.places
        s_first, s_second = dot(first - a, along) / square, dot(second - a, along) / square
        t = (s - s_first[..., None]) / (s_second - s_first)[..., None]
        size = np.sqrt(square)
        heights = cross(along, first - a) / size, cross(along, second - a) / size
        gap = -((1 - t) * heights[0][..., None] + t * heights[1][..., None])
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
        return gap, s, t, ((end - start) * size)[..., None] * self.weights, normal[..., None, :]

    def _forces(self, active: Any, corners: Any) -> Any:
        """Return the forces (..., n, 4, 2) on both nodes of the slave segment, and of the master's."""
        gap, s, t, weight, normal = self._at_points(corners)
        pull = (self.penalty * np.where(active, gap, 0) * weight)[..., None] * normal
        return np.stack([(share[..., None] * pull).sum(axis=-2) for share in (1 - s, s, t - 1, -t)], axis=-2)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(*z.shape[:-1], -1, 2)
        parts = self._forces(pairing["active"], self._corners(interface, pairing["strips"], x))
        forces, nodes = np.zeros_like(x), self._nodes(interface, pairing["strips"])
        for number in range(4):
            add_at(forces, nodes[:, number], parts[..., number, :])
        return forces.reshape(z.shape)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        corners = self._corners(interface, pairing["strips"], z.reshape(-1, 2))
        moves = STEP * np.eye(12).reshape(12, 1, 6, 2)
        slopes = self._forces(pairing["active"], corners + 1j * moves).imag / STEP  # (12, n, 4, 2)
        nodes = self._nodes(interface, pairing["strips"])
        unknowns = 2 * nodes[..., None] + np.arange(2)
        columns = np.broadcast_to(unknowns.reshape(-1, 12).T[:, :, None, None], slopes.shape)
        rows = np.broadcast_to(unknowns[:, :4], slopes.shape)
        entries = slopes.ravel(), (rows.ravel(), columns.ravel())
        return sparse.coo_array(entries, shape=(z.size, z.size)).tocsr()

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x, strips = z.reshape(-1, 2), pairing["strips"]
        gap, s, t, weight, normal = self._at_points(self._corners(interface, strips, x))
        a, b = (x[interface.slave.segments[strips[:, 0], end]][:, None] for end in (0, 1))
        position = (1 - s)[..., None] * a + s[..., None] * b
        slave, master = (np.repeat(strips[:, column], len(self.places)) for column in (0, 1))
        active = pairing["active"].ravel()
        gap, normals = gap.ravel(), np.broadcast_to(normal, position.shape).reshape(-1, 2)
        pressure, unknown = np.where(active, -self.penalty * gap, 0.0), np.full(gap.size, np.nan)
        places = (slave, 2 * s.ravel() - 1, master, t.ravel(), position.reshape(-1, 2), normals)
        return ContactPoints(*places, gap, pressure, weight.ravel(), active, unknown, unknown)


class SimpsonPoints(SegmentPenalty):
    """Springs at the points of Simpson's rule: at the ends of strips a shape is 0, or what roundoff leaves."""

    places, weights = np.array([0.0, 0.5, 1.0]), np.array([1.0, 4.0, 1.0]) / 6


class TabulatedPoints(SegmentPenalty):
    """Springs at three Gauss points from a table of 14 digits, whose weights add up to 1 + 45u."""

    places = (np.array([-0.77459666924148, 0.0, 0.77459666924148]) + 1) / 2
    weights = np.array([0.55555555555556, 0.88888888888889, 0.55555555555556]) / 2


class ComputedPoints(SegmentPenalty):
    """Springs at the five Gauss points that the library NGSolve 6.2.2608 computes; the weights add up to 1 − 71u."""

    places = np.array([0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415, 0.9530899229693319])
    weights = np.array(
        [0.11846344252809062, 0.23931433524968324, 0.28444444444444444, 0.23931433524968324, 0.11846344252809062]
    )


class BothSidesHalved:
    """The mean of both choices of the slave, without bias: the symmetric form of Nitsche's method without stresses.

    After Mlika, Renard and Chouly, "An unbiased Nitsche's formulation" (2017), whose terms of stress are left out.
    Areas are means of both surfaces, so the traits state none.
    """

    traits = SegmentPenalty.traits.revise(
        area=None, force_along=None, integrates_linear_gap=None, unbiased=True, tangent=None
    )

    def __init__(self, *, penalty: float) -> None:
        self.inner = SegmentPenalty(penalty=penalty / 2)

    def _sides(self, interface: Interface) -> Any:
        """Yield both choices of the slave: a prefix, the interface, and by how much the state is rolled."""
        yield "slave ", interface, 0
        yield "master ", interface.swap_roles(), 2 * interface.n_slave_nodes

    def pair(self, interface: Interface, z: Any) -> Any:
        return {
            prefix + name: values
            for prefix, each, shift in self._sides(interface)
            for name, values in self.inner.pair(each, np.roll(z, -shift)).items()
        }

    def residual(self, interface: Interface, pairing: Any, z: Any) -> Any:
        total = np.zeros_like(z)
        for prefix, each, shift in self._sides(interface):
            decisions = {name: pairing[prefix + name] for name in ("strips", "active")}
            total += np.roll(self.inner.residual(each, decisions, np.roll(z, -shift, axis=-1)), shift, axis=-1)
        return total
