"""A right formulation as a user writes it with NumPy, and twelve mistakes that are put into it one at a time.

Two Gauss points lie on each part of a slave segment that faces a master segment. Forces are computed of all such pairs
of segments at once. The tangent of a pair is the derivative of its forces by complex steps in its eight unknowns.
"""

from typing import Any, ClassVar

import numpy as np

from contactverif import PatchPromises, Promises, Rules, Traits

PLACES = np.array([0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)])


class Springs:
    """A bed of springs along the slave, right in forces and tangent."""

    traits = Traits(
        promises=Promises(patch=PatchPromises(flat=True), conserves_force=True, conserves_moment=True, tangent="exact"),
        rules=Rules(area="current", penalty="distributed"),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    # Where mistakes are put.

    def along_master(self, t: Any) -> Any:
        return t

    def slave_shapes(self, s: Any) -> Any:
        return 1 - s, s

    def master_shapes(self, t: Any) -> Any:
        return 1 - t, t

    def normals(self, normal: Any) -> Any:
        return normal

    def facing(self, share: Any) -> Any:
        return np.nonzero(share > 0)

    def pressure(self, gap: Any) -> Any:
        return np.where(gap.real < 0, -self.penalty * gap, 0)

    def weights(self, length: Any, slave_segment: Any, n_segments: int) -> Any:
        return length / 2

    # The formulation.

    def pairs(self, interface: Any, x: Any) -> tuple[Any, Any]:
        """Return the slave segments that face master segments, and their four nodes (n_pairs, 4)."""
        slave, master = interface.slave.segments, interface.master.segments
        along = x[slave[:, 1]] - x[slave[:, 0]]
        places = (x[None] - x[slave[:, 0], None]) @ along[:, :, None] / (along**2).sum(1)[:, None, None]
        first, second = (np.clip(places[:, master[:, end], 0], 0, 1) for end in (0, 1))
        i, j = self.facing(first - second)  # The master runs the other way.
        lengths = [np.linalg.norm(x[ends[:, 1]] - x[ends[:, 0]], axis=1).max() for ends in (slave, master)]
        apart = x[slave[i]].mean(axis=1) - x[master[j]].mean(axis=1)
        near = np.linalg.norm(apart, axis=1) < 2 * sum(lengths)  # What is further away belongs to another body.
        return i[near], np.hstack([slave[i], master[j]])[near]

    def forces(self, x: Any, slave_segment: Any, n_segments: int) -> Any:
        """Return the forces (n_pairs, 4, 2) on the nodes of pairs at positions of that shape."""
        a, b, c, d = np.moveaxis(x, 1, 0)
        along = b - a
        square = (along * along).sum(1)
        length = np.sqrt(square)
        normal = self.normals(np.stack([along[:, 1], -along[:, 0]], 1) / length[:, None])
        s_c, s_d = ((c - a) * along).sum(1) / square, ((d - a) * along).sum(1) / square
        start, end = np.where(s_d.real > 0, s_d, 0), np.where(s_c.real < 1, s_c, 1)
        forces = np.zeros_like(x)
        for place in PLACES:
            s = start + place * (end - start)
            t = self.along_master((s - s_c) / (s_d - s_c))
            on_slave = (1 - s)[:, None] * a + s[:, None] * b
            on_master = (1 - t)[:, None] * c + t[:, None] * d
            gap = ((on_master - on_slave) * normal).sum(1)
            size = self.pressure(gap) * (end - start) * self.weights(length, slave_segment, n_segments)
            shapes = np.stack([*self.slave_shapes(s), *(-shape for shape in self.master_shapes(t))], 1)
            forces += shapes[:, :, None] * (size[:, None] * normal)[:, None]
        return forces

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        i, nodes = self.pairs(interface, x)
        residual = np.zeros_like(x)
        np.add.at(residual, nodes, self.forces(x[nodes], i, len(interface.slave.segments)))
        return residual.reshape(-1)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, h = z.reshape(-1, 2), 2.0**-100 * np.ptp(z)
        i, nodes = self.pairs(interface, x)
        unknowns = (2 * nodes[:, :, None] + [0, 1]).reshape(-1, 8)
        tangent = np.zeros((z.size, z.size))
        for column, step in enumerate(1j * h * np.eye(8).reshape(8, 4, 2)):
            change = self.forces(x[nodes] + step, i, len(interface.slave.segments)).imag / h
            np.add.at(tangent, (unknowns, unknowns[:, [column]]), change.reshape(-1, 8))
        return tangent


class HalfAtFreeEnds(Springs):
    """Half the length counts for the first and the last slave segment."""

    def weights(self, length: Any, slave_segment: Any, n_segments: int) -> Any:
        at_end = (slave_segment == 0) | (slave_segment == n_segments - 1)
        return super().weights(length, slave_segment, n_segments) * np.where(at_end, 0.5, 1)


class SignOfXi(Springs):
    """The derivative of the place on the master segment has the opposite sign in the tangent."""

    def along_master(self, t: Any) -> Any:
        return np.conj(t)


class ShapesExchanged(Springs):
    """The two shape functions of the slave segment are exchanged."""

    def slave_shapes(self, s: Any) -> Any:
        return s, 1 - s


class PreviousNormal(Springs):
    """The normals are those of the call before."""

    last: ClassVar[Any] = None

    def normals(self, normal: Any) -> Any:
        before, self.last = self.last, normal.real  # type: ignore[misc]
        return normal if before is None or before.shape != normal.shape else before


class SignOfGap(Springs):
    """The gap has the opposite sign: springs pull where surfaces are apart."""

    def pressure(self, gap: Any) -> Any:
        return super().pressure(-gap)


class Twice(Springs):
    """Each point has the weight of two."""

    def pressure(self, gap: Any) -> Any:
        return 2 * super().pressure(gap)


class LastMasterMissed(Springs):
    """The loop over master segments ends one too early."""

    def facing(self, share: Any) -> Any:
        return np.nonzero(share[:, :-1] > 0)


class AbsoluteGap(Springs):
    """A gap counts as closed from 1e-8 on, whatever the unit of length."""

    def pressure(self, gap: Any) -> Any:
        return np.where(gap.real < -1e-8, super().pressure(gap), 0)


class ColumnMissing(Springs):
    """The tangent's last column is missing."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        matrix = super().tangent(interface, pairing, z)
        matrix[:, -1] = 0
        return matrix


class LengthNotVaried(Springs):
    """The tangent lacks the change of the slave segment's length."""

    def weights(self, length: Any, slave_segment: Any, n_segments: int) -> Any:
        return length.real / 2


class MasterHalved(Springs):
    """Each node of a master segment takes half of the force, wherever it acts."""

    def master_shapes(self, t: Any) -> Any:
        return np.full(t.shape, 0.5), np.full(t.shape, 0.5)


class LengthForgotten(Springs):
    """The springs are not multiplied by the length of the segment."""

    def weights(self, length: Any, slave_segment: Any, n_segments: int) -> Any:
        return 0.5


BUGS = {  # {name on the command line: (factory, words of the diagnosis that say place and kind)}.
    "half-ends": (HalfAtFreeEnds, r"slave segment 0 0\.5 times, slave segment \d 0\.5 times"),
    "sign-of-xi": (SignOfXi, r"the part of δξ, .* on the master's rows"),
    "shapes": (ShapesExchanged, r"two shape functions of each slave segment are exchanged"),
    "old-normal": (PreviousNormal, r"kept between calls"),
    "sign-of-gap": (SignOfGap, r"no force at all|opposite sign"),
    "factor-2": (Twice, r"every node has 2 times"),
    "last-master": (LastMasterMissed, r"master segment \d is left out"),
    "absolute": (AbsoluteGap, r"look for an absolute length|do not scale"),
    "column": (ColumnMissing, r"column \d+ \(.*\) is missing"),
    "length-part": (LengthNotVaried, r"the part of the length of the slave's segments"),
    "master-half": (MasterHalved, r"master"),
    "no-length": (LengthForgotten, r"length"),
}
