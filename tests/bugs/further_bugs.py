"""Fourteen further mistakes, one at a time, put into the right formulation `Springs`.

They were written by somebody who knew neither the rules of the diagnosis nor the properties. The words were added when
rules for them were.
"""

from typing import Any

import numpy as np
from springs_with_bugs import PLACES, Springs
from unseen_bugs import Parts


class SinglePrecision(Springs):
    """Positions are rounded to single precision before the forces are computed of them."""

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return super().residual(interface, pairing, z.astype(np.float32).astype(float))


class QuadratureAtStarts(Parts):
    """Each part is cut into four cells, and each cell's point lies at the cell's start instead of its middle."""

    def points(self, start: Any, end: Any) -> Any:
        for cell in range(4):
            yield start + cell / 4 * (end - start), (end - start) / 2


class CoarseDifferences(Springs):
    """The tangent is of forward differences with a step far too large, a thousandth of the model's size."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        h = 1e-3 * np.ptp(z)
        still = self.residual(interface, pairing, z)
        return np.stack([(self.residual(interface, pairing, z + step) - still) / h for step in h * np.eye(z.size)], 1)


class BreakAtFirstOpen(Springs):
    """The loop over the pairs breaks at the first open pair instead of going on to the next."""

    def forces(self, x: Any, slave_segment: Any, n_segments: int) -> Any:
        forces = super().forces(x, slave_segment, n_segments)
        for pair, force in enumerate(forces):
            if not force.real.any():
                forces[pair:] = 0
                break
        return forces


class ArctanOfSlope(Springs):
    """The normal comes of the arctan of the slope instead of arctan2, so it flips where the slave runs leftwards."""

    def normals(self, normal: Any) -> Any:
        angle = np.arctan(normal[:, 0] / (-normal[:, 1] + 1e-15))
        return np.stack([np.sin(angle), -np.cos(angle)], 1)


class TangentSymmetrised(Springs):
    """The tangent is symmetrised, half the sum of itself and its transpose."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        tangent = super().tangent(interface, pairing, z)
        return (tangent + tangent.T) / 2


class MixedProjections(Springs):
    """Points are projected at right angles to the master, but the gap and the force are along the slave's normal."""

    def forces(self, x: Any, slave_segment: Any, n_segments: int) -> Any:
        a, b, c, d = np.moveaxis(x, 1, 0)
        along, master = b - a, d - c
        square = (along * along).sum(1)
        length = np.sqrt(square)
        normal = np.stack([along[:, 1], -along[:, 0]], 1) / length[:, None]
        s_c, s_d = ((c - a) * along).sum(1) / square, ((d - a) * along).sum(1) / square
        start, end = np.where(s_d.real > 0, s_d, 0), np.where(s_c.real < 1, s_c, 1)
        forces = np.zeros_like(x)
        for place in PLACES:
            s = start + place * (end - start)
            on_slave = (1 - s)[:, None] * a + s[:, None] * b
            t = ((on_slave - c) * master).sum(1) / (master * master).sum(1)
            on_master = (1 - t)[:, None] * c + t[:, None] * d
            gap = ((on_master - on_slave) * normal).sum(1)
            size = self.pressure(gap) * (end - start) * length / 2
            forces += np.stack([1 - s, s, t - 1, -t], 1)[:, :, None] * (size[:, None] * normal)[:, None]
        return forces


class MasterOwnNormal(Parts):
    """The master is pushed along its own normal, the slave along the slave's, so the two forces are not opposite."""

    def master_direction(self, normal: Any, c: Any, d: Any) -> Any:
        along = d - c
        return np.stack([along[:, 1], -along[:, 0]], 1) / np.sqrt((along * along).sum(1))[:, None]


class TangentLimitsFixed(Parts):
    """The tangent does not vary the limits of the parts, though they move with the nodes of the master."""

    def part(self, s_c: Any, s_d: Any) -> Any:
        start, end = super().part(s_c, s_d)
        return start.real, end.real


class TangentNormalSign(Springs):
    """The normal's variation enters the tangent with the wrong sign."""

    def normals(self, normal: Any) -> Any:
        return normal.conj()


class MeanLength(Springs):
    """Every slave segment counts with the mean length, as if the slave's mesh were uniform."""

    def weights(self, length: Any, slave_segment: Any, n_segments: int) -> Any:
        _, first = np.unique(slave_segment, return_index=True)
        return length[first].mean() / 2 if len(first) else length / 2

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, h = z.reshape(-1, 2), 2.0**-100 * np.ptp(z)
        i, nodes = self.pairs(interface, x)
        tangent = np.zeros((z.size, z.size))
        for column in range(z.size):
            step = np.zeros(z.size, complex)
            step[column] = 1j * h
            change = self.forces((z + step).reshape(-1, 2)[nodes], i, len(interface.slave.segments)).imag / h
            np.add.at(tangent[:, column].reshape(-1, 2), nodes, change)
        return tangent


class TangentOfFirstState(Springs):
    """The tangent is computed in the first state only and returned again in all later ones."""

    def __init__(self, *, penalty: float) -> None:
        super().__init__(penalty=penalty)
        self.first_tangents = {}

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        if z.size not in self.first_tangents:
            self.first_tangents[z.size] = super().tangent(interface, pairing, z)
        return self.first_tangents[z.size].copy()


class SearchDoneOnce(Parts):
    """The search runs in the first call only, and its pairs are kept however far the bodies slide later."""

    def __init__(self, *, penalty: float) -> None:
        super().__init__(penalty=penalty)
        self.first_pairs = {}

    def pairs(self, interface: Any, x: Any) -> Any:
        key = len(x), len(interface.slave.segments), len(interface.master.segments)
        if key not in self.first_pairs:
            self.first_pairs[key] = super().pairs(interface, x)
        return self.first_pairs[key]

    def part(self, s_c: Any, s_d: Any) -> Any:
        start, end = super().part(s_c, s_d)
        return start, np.where(end.real > start.real, end, start)


class TangentMasterRigid(Springs):
    """The tangent takes the master for rigid: no derivatives in the master's nodes, though these move as well."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        tangent = super().tangent(interface, pairing, z)
        columns = 2 * np.unique(interface.master.segments)[:, None] + [0, 1]
        tangent[:, columns.ravel()] = 0
        return tangent


FURTHER: dict[str, tuple[Any, str]] = {
    "single-precision": (SinglePrecision, r"numbers have single precision"),
    "quadrature-at-starts": (QuadratureAtStarts, r"0.125 of its length nearer to the part's start"),
    "coarse-differences": (CoarseDifferences, r"one-sided differences with a step of about 0.00"),
    "break-at-first-open": (BreakAtFirstOpen, r"where slave segment 0 is open, nothing pushes slave nodes 2, 3"),
    "arctan-of-slope": (ArctanOfSlope, r"turned by 180° the forces"),
    "tangent-symmetrised": (TangentSymmetrised, r"the symmetric part of the derivative"),
    "mixed-projections": (MixedProjections, r"their moments do not: .* look at the projection"),
    "master-own-normal": (MasterOwnNormal, r"the slave's normal on the slave, along the master's normal on the master"),
    "tangent-limits-fixed": (TangentLimitsFixed, r"the derivative of the limits"),
    "tangent-normal-sign": (TangentNormalSign, r"part of δn, .* has the opposite sign"),
    "mean-length": (MeanLength, r"the same length, 1.042, the mean"),
    "tangent-of-first-state": (TangentOfFirstState, r"`tangent` answers otherwise after `tangent`"),
    "search-done-once": (SearchDoneOnce, r"at which nodes face other segments"),
    "tangent-master-rigid": (TangentMasterRigid, r"takes the master for rigid"),
}
