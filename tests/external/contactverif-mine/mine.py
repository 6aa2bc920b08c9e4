"""A contact formulation of one's own, in three steps: the tutorial of contactverif's README is this file."""

import numpy as np

from contactverif import Traits


class NodeToSegment:
    """A spring at each slave node, against the nearest master segment."""

    def __init__(self, *, penalty):
        self.penalty = penalty

    def residual(self, interface, pairing, z):
        x = z.reshape(-1, 2)  # current positions, slave nodes first
        forces = np.zeros_like(x)
        first, second = interface.master.segments.T
        along = x[second] - x[first]
        length = np.sqrt((along**2).sum(axis=1))
        normal = np.column_stack([along[:, 1], -along[:, 0]]) / length[:, None]  # out of the master body
        for node in range(interface.n_slave_nodes):
            xi = ((x[node] - x[first]) * along).sum(axis=1) / length**2
            gap = ((x[node] - x[first]) * normal).sum(axis=1)  # negative in penetration
            beyond = np.maximum(0, np.maximum(-xi, xi - 1)) * length
            m = np.argmin(np.hypot(gap, beyond))
            if gap[m] < 0 and beyond[m] == 0:
                force = self.penalty * gap[m] * normal[m]
                forces[node] += force
                forces[first[m]] -= (1 - xi[m]) * force
                forces[second[m]] -= xi[m] * force
        return forces.reshape(z.shape)


class SegmentToSegment:
    """A bed of springs on every piece of a slave segment that faces a piece of a master segment."""

    def __init__(self, *, penalty):
        self.penalty = penalty

    def residual(self, interface, pairing, z):
        x = z.reshape(-1, 2)
        forces = np.zeros_like(x)
        slave, master = interface.slave.segments, interface.master.segments
        a, b = x[slave[:, 0], None], x[slave[:, 1], None]  # (n_slave, 1, 2)
        c, d = x[master[:, 0]], x[master[:, 1]]  # (n_master, 2): it runs the other way, so d is nearer a
        along = b - a
        length = np.sqrt((along * along).sum(axis=-1))
        normal = np.stack([along[..., 1], -along[..., 0]], axis=-1) / length[..., None]  # out of the slave body
        s_c = ((c - a) * along).sum(axis=-1) / length**2  # where the master's nodes project on the slave, 0 at a
        s_d = ((d - a) * along).sum(axis=-1) / length**2
        low, high = np.where(s_d.real > 0, s_d, 0), np.where(s_c.real < 1, s_c, 1)
        facing = low.real < high.real
        for place in (-np.sqrt(3 / 5), 0, np.sqrt(3 / 5)):  # three Gauss points on each piece
            weight = (8 / 9 if place == 0 else 5 / 9) / 2
            s = (low + high) / 2 + place * (high - low) / 2
            t = (s - s_d) / np.where(facing, s_c - s_d, 1)  # on the master: 0 at d, 1 at c
            gap = ((d - a + t[..., None] * (c - d) - s[..., None] * along) * normal).sum(axis=-1)
            pressure = np.where(facing & (gap.real < 0), -self.penalty * gap, 0)
            force = (pressure * weight * (high - low) * length)[..., None] * normal
            i, j = np.indices(facing.shape)
            for nodes, shape in ((slave[i, 0], 1 - s), (slave[i, 1], s), (master[j, 0], -t), (master[j, 1], t - 1)):
                np.add.at(forces, nodes, shape[..., None] * force)
        return forces.reshape(z.shape)


class Exact:
    """The same, with promises and an exact tangent: a complex step has no truncation error."""

    traits = Traits(
        passes_flat_patch=True,
        conserves_force=True,
        conserves_moment=True,
        tangent="exact",
        penalty="distributed",
        takes_complex=True,
    )

    def __init__(self, *, penalty):
        self.residual = SegmentToSegment(penalty=penalty).residual

    def tangent(self, interface, pairing, z):
        h = 2.0**-100
        columns = [self.residual(interface, pairing, z + 1j * h * unit).imag / h for unit in np.eye(z.size)]
        return np.column_stack(columns)
