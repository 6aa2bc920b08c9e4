"""A contact formulation of one's own, written in three steps."""

import numpy as np

from contactverif import Abilities, PatchPromises, Promises, Rules, Traits


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
            xi = ((x[node] - x[first]) * along).sum(axis=1) / length**2  # foot on each master segment, 0 to 1
            gap = ((x[node] - x[first]) * normal).sum(axis=1)  # negative in penetration
            beyond = np.maximum(0, np.maximum(-xi, xi - 1)) * length
            m = np.argmin(np.hypot(gap, beyond))  # the nearest
            if gap[m] < 0 and beyond[m] == 0:
                force = self.penalty * gap[m] * normal[m]
                forces[node] += force
                forces[first[m]] -= (1 - xi[m]) * force
                forces[second[m]] -= xi[m] * force
        return forces.reshape(z.shape)


class SegmentToSegment:
    """A bed of springs on every piece of a slave segment that faces a master segment; two Gauss points each."""

    def __init__(self, *, penalty):
        self.penalty = penalty

    def residual(self, interface, pairing, z):
        x = z.reshape(-1, 2)
        forces = np.zeros_like(x)
        first, second = interface.master.segments.T
        for a, b in interface.slave.segments:
            along = x[b] - x[a]
            square = along @ along
            length = np.sqrt(square)
            normal = np.array([along[1], -along[0]]) / length  # out of the slave body
            s_first = (x[first] - x[a]) @ along / square  # master nodes on the slave segment, 0 at a, 1 at b
            s_second = (x[second] - x[a]) @ along / square
            start, end = np.clip(s_second, 0, 1), np.clip(s_first, 0, 1)  # the master runs the other way
            m = np.flatnonzero(start.real < end.real)  # the master segments that face this slave segment
            start, share = start[m], (end - start)[m]
            for place in (0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)):
                s = (start + place * share)[:, None]  # on the slave
                t = (s - s_first[m, None]) / (s_second - s_first)[m, None]  # on the master, 0 at its first node
                gap = ((1 - t) * x[first[m]] + t * x[second[m]] - (1 - s) * x[a] - s * x[b]) @ normal
                pressure = np.where(gap.real < 0, -self.penalty * gap, 0)
                force = (pressure * share * length / 2)[:, None] * normal
                forces[a] += ((1 - s) * force).sum(axis=0)
                forces[b] += (s * force).sum(axis=0)
                np.add.at(forces, first[m], (t - 1) * force)
                np.add.at(forces, second[m], -t * force)
        return forces.reshape(z.shape)


class Exact(SegmentToSegment):
    """The segment-to-segment residual, with promises and an exact tangent."""

    traits = Traits(
        promises=Promises(patch=PatchPromises(flat=True), conserves_force=True, conserves_moment=True, tangent="exact"),
        rules=Rules(area="current", penalty="distributed"),
        abilities=Abilities(takes_complex=True),
    )

    def tangent(self, interface, pairing, z):
        h = 2.0**-100 * np.ptp(z)  # any step below roundoff will do, but it must be a length like the others
        columns = [self.residual(interface, pairing, z + 1j * h * unit).imag / h for unit in np.eye(z.size)]
        return np.column_stack(columns)
