"""Eight fresh mistakes, one at a time, put into the right formulation `Springs`.

They were written by somebody who knew neither the rules of the diagnosis nor the properties. The words were added when
rules for them were.
"""

from typing import Any

import numpy as np
from springs_with_bugs import PLACES, Springs
from unseen_bugs import Parts

NOT_NAMED = r"(?!)"  # No rule knows the mistake.


class NearestMasterNode(Springs):
    """The whole force of a Gauss point goes to the nearer node of the master segment."""

    def master_shapes(self, t: Any) -> Any:
        first = np.where(t.real < 0.5, 1.0, 0.0)
        return first, 1 - first


class AveragedNodalGaps(Parts):
    """Averages of the gap weighted by shape functions are interpolated as if they were the gap at the slave nodes."""

    def forces(self, x: Any, slave_segment: Any, n_segments: Any) -> Any:
        a, b, c, d = np.moveaxis(x, 1, 0)
        along = b - a
        square = (along * along).sum(1)
        length = np.sqrt(square)
        normal = np.stack([along[:, 1], -along[:, 0]], 1) / length[:, None]
        s_c, s_d = ((c - a) * along).sum(1) / square, ((d - a) * along).sum(1) / square
        start, end = self.part(s_c, s_d)
        s = start + PLACES[:, None] * (end - start)
        t = (s - s_c) / (s_d - s_c)
        on_slave = (1 - s)[..., None] * a + s[..., None] * b
        on_master = (1 - t)[..., None] * c + t[..., None] * d
        gap = ((on_master - on_slave) * normal).sum(-1)
        first, second = (1 - s) * gap, s * gap
        nodal = first.sum(0) / (1 - s).sum(0), second.sum(0) / s.sum(0)
        size = self.pressure((1 - s) * nodal[0] + s * nodal[1]) * (end - start) * length / 2
        shapes = np.stack([1 - s, s, t - 1, -t], -1)
        return np.einsum("gpn,gp,pk->pnk", shapes, size, normal)


class DeepIsBehind(Springs):
    """Pairs that overlap by more than a thousandth of the slave segment are taken for hits from behind and dropped."""

    def pairs(self, interface: Any, x: Any) -> Any:
        i, nodes = super().pairs(interface, x)
        a, b, c, d = np.moveaxis(x[nodes], 1, 0)
        along = b - a
        square = (along**2).sum(1)
        depth = (along[:, 1] * (a + b - c - d)[:, 0] - along[:, 0] * (a + b - c - d)[:, 1]) / 2
        keep = depth < 0.001 * square  # Both sides times the length.
        return i[keep], nodes[keep]


class EndSegmentsSkipped(Springs):
    """Slave segments with a node at a free end are skipped, as they lack a neighbour."""

    def pairs(self, interface: Any, x: Any) -> Any:
        i, nodes = super().pairs(interface, x)
        neighbours = np.bincount(interface.slave.segments.ravel(), minlength=len(x))
        inner = (neighbours[nodes[:, :2]] == 2).all(axis=1)
        return i[inner], nodes[inner]


class QuadraticPressure(Springs):
    """The pressure is the penalty times the square of the penetration."""

    def pressure(self, gap: Any) -> Any:
        return np.where(gap.real < 0, self.penalty * gap**2, 0)


class TangentByComponents(Springs):
    """The tangent numbers all x before all y, but the residual has x and y of each node side by side."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        tangent = super().tangent(interface, pairing, z)
        order = np.arange(z.size).reshape(-1, 2).T.ravel()
        return tangent[np.ix_(order, order)]


class StepsPileUp(Springs):
    """The step in one unknown is not taken back before the step in the next unknown of the pair."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, h = z.reshape(-1, 2), 2.0**-100 * np.ptp(z)
        i, nodes = self.pairs(interface, x)
        unknowns = (2 * nodes[:, :, None] + [0, 1]).reshape(-1, 8)
        tangent = np.zeros((z.size, z.size))
        moved = x[nodes].astype(complex)
        for column in range(8):
            moved[:, column // 2, column % 2] += 1j * h
            change = self.forces(moved, i, len(interface.slave.segments)).imag / h
            np.add.at(tangent, (unknowns, unknowns[:, [column]]), change.reshape(-1, 8))
        return tangent


class LumpedTangent(Springs):
    """The tangent's blocks of slave with slave and of master with master are lumped to each node by sums of rows."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        tangent = super().tangent(interface, pairing, z)
        blocks = tangent.reshape(len(z) // 2, 2, len(z) // 2, 2)
        for side in (interface.slave, interface.master):
            nodes = np.unique(side.segments)
            sums = blocks[nodes][:, :, nodes].sum(axis=2)
            blocks[np.ix_(nodes, [0, 1], nodes, [0, 1])] = 0
            blocks[nodes, :, nodes] = sums
        return tangent


FRESH: dict[str, tuple[Any, str]] = {
    "force-to-nearest-master-node": (NearestMasterNode, r"goes to the nearer node of the master"),
    "averaged-gaps-as-nodal": (AveragedNodalGaps, NOT_NAMED),
    "deep-overlap-dropped": (DeepIsBehind, r"look for a limit of depths"),
    "end-slave-segments-skipped": (EndSegmentsSkipped, r"slave segments 0, 2 are left out"),
    "quadratic-pressure": (QuadraticPressure, r"to the power 2"),
    "tangent-by-components": (TangentByComponents, r"all x before all y"),
    "steps-pile-up": (StepsPileUp, NOT_NAMED),
    "lumped-tangent": (LumpedTangent, r"as if it were lumped"),
}
