"""Formulations whose pressure is no multiple of the gap: three that are right, and three that are wrong."""

import numpy as np

from zoo.making import add
from zoo.on_strips import SegmentPenalty

TRANSMISSION = "patch.flat.transmission"


class Quadratic(SegmentPenalty):
    """The pressure is ε̂ g²."""

    traits = SegmentPenalty.traits.revise(
        law="own", penalty_power=-2.0, integrates_linear_gap=None, converges=None, kinked=None
    )
    contact_points = None

    def pull(self, interface, gap):
        return -self.penalty * gap**2


class Exponential(Quadratic):
    """The pressure is ε̂ d (exp(1 − g/d) − 1) from a gap d on; deeper than 6 d its slope stays, as in some codes."""

    traits = Quadratic.traits.revise(penalty_power=-1.0, law_distance=0.125)

    def begins(self, interface):
        return 0.125 * min(side.lengths(interface.nodes).min() for side in (interface.slave, interface.master))

    def pull(self, interface, gap):
        begins = self.begins(interface)
        depth = 1 - gap / begins
        growth = np.exp(np.where(depth.real < 7, depth, 7))
        return self.penalty * begins * (1 - growth * np.where(depth.real < 7, 1, depth - 6))


class Constant(Quadratic):
    """The pressure is ε̂ where surfaces penetrate: forces are the derivative of ε̂ times the area of overlap.

    A strip that is open at one end alone is cut where its gap is 0. Parallel segments begin to touch with all of it, so
    that forces may jump.
    """

    traits = Quadratic.traits.revise(penalty_power=0.0, continuity=None)
    places, weights = np.array([0.0, 1.0]), np.array([0.5, 0.5])  # The ends of a strip.

    def _forces(self, interface, active, corners):
        gap, s, t, weight, normal = self._at_points(corners)
        first, second = active.T
        zero = gap[..., 0] / np.where(first != second, gap[..., 0] - gap[..., 1], 1)
        low, high = np.where(first, 0, zero), np.where(second, 1, zero)
        length = np.where(first | second, high - low, 0) * weight.sum(axis=-1)
        s, t = (ends[..., 0] + (low + high) / 2 * (ends[..., 1] - ends[..., 0]) for ends in (s, t))
        pull = -self.penalty * length[..., None] * normal[..., 0, :]
        return np.stack([share[..., None] * pull for share in (1 - s, s, t - 1, -t)], axis=-2)


class HalfAtEnds(Quadratic):
    """The nodes at free ends of the slave get half of their forces."""

    def residual(self, interface, pairing, z):
        forces, slave = super().residual(interface, pairing, z), interface.slave
        ends = slave.segments[slave.neighbours < 0]
        forces.reshape(*z.shape[:-1], -1, 2)[..., ends, :] /= 2
        return forces

    def tangent(self, interface, pairing, z):
        matrix, slave = super().tangent(interface, pairing, z).toarray(), interface.slave
        ends = slave.segments[slave.neighbours < 0]
        matrix.reshape(-1, 2, z.size)[ends] /= 2
        return matrix


class SquaredShares(Quadratic):
    """A strip that is part of a slave segment counts by the square of its share, so matching meshes are right."""

    def _at_points(self, corners):
        gap, s, t, weight, normal = super()._at_points(corners)
        a, b = corners[..., 0, :], corners[..., 1, :]
        length = np.sqrt(((b - a) ** 2).sum(axis=-1))[..., None]
        return gap, s, t, weight * weight.sum(axis=-1, keepdims=True) / length, normal


class OfTheMesh(Quadratic):
    """The pressure is ε̂ g² over the length of the slave segment."""

    traits = Quadratic.traits.revise(penalty_power=-1.0)

    def _forces(self, interface, active, corners):
        a, b = corners[..., 0, :], corners[..., 1, :]
        length = np.sqrt(((b - a) ** 2).sum(axis=-1))[..., None, None]
        return super()._forces(interface, active, corners) / length


for _name, _make in {
    "half a force at free ends, under a law of its own": HalfAtEnds,
    "squared shares of segments, under a law of its own": SquaredShares,
    "pressure over the length of a segment, said to be a law of its own": OfTheMesh,
}.items():
    add(_name, TRANSMISSION, _make)
