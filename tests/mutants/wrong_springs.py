"""A right segment-to-segment formulation, and mistakes that are put into it one at a time."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from contactverif import Abilities, PatchPromises, Promises, Rules, Traits


class Right:
    """A bed of springs, two Gauss points on each piece of a slave segment that faces a master segment."""

    traits = Traits(
        promises=Promises(patch=PatchPromises(flat=True), conserves_force=True, conserves_moment=True, tangent="exact"),
        rules=Rules(area="current", penalty="distributed"),
        abilities=Abilities(takes_complex=True),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def factor(self, interface: Any, a: int, b: int) -> float:
        """Return the factor of the springs of a slave segment."""
        return 1.0

    def shapes(self, s: Any) -> Any:
        """Return the two shape functions of a slave segment."""
        return 1 - s, s

    def master_shapes(self, t: Any) -> Any:
        """Return the two shape functions of a master segment."""
        return 1 - t, t

    def is_closed(self, gap: Any) -> Any:
        """Return where a gap is closed."""
        return gap.real < 0

    def facing(self, start: Any, end: Any) -> Any:
        """Return the master segments that face a slave segment."""
        return np.flatnonzero(start.real < end.real)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        forces = np.zeros_like(x)
        first, second = interface.master.segments.T
        for a, b in interface.slave.segments:
            along = x[b] - x[a]
            square = along @ along
            length = np.sqrt(square)
            normal = np.array([along[1], -along[0]]) / length
            s_first = (x[first] - x[a]) @ along / square
            s_second = (x[second] - x[a]) @ along / square
            start, end = np.clip(s_second, 0, 1), np.clip(s_first, 0, 1)
            m = self.facing(start, end)
            start, share = start[m], (end - start)[m]
            for place in (0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)):
                s = (start + place * share)[:, None]
                t = (s - s_first[m, None]) / (s_second - s_first)[m, None]
                gap = ((1 - t) * x[first[m]] + t * x[second[m]] - (1 - s) * x[a] - s * x[b]) @ normal
                stiffness = self.penalty * self.factor(interface, a, b)
                pressure = np.where(self.is_closed(gap), -stiffness * gap, 0)
                force = (pressure * share * length / 2)[:, None] * normal
                for nodes, shapes, sign in (((a, b), self.shapes(s), 1), ((first[m], second[m]), None, -1)):
                    for node, shape in zip(nodes, shapes or self.master_shapes(t), strict=True):
                        np.add.at(forces, np.broadcast_to(node, len(m)), sign * shape * force)
        return forces.reshape(z.shape)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        h = 2.0**-100 * np.ptp(z)
        columns = [self.residual(interface, pairing, z + 1j * h * unit).imag / h for unit in np.eye(z.size)]
        return np.column_stack(columns)


class OppositeSign(Right):
    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return -super().residual(interface, pairing, z)


class Twice(Right):
    def factor(self, interface: Any, a: int, b: int) -> float:
        return 2.0


class HalfAtEndSegments(Right):
    def factor(self, interface: Any, a: int, b: int) -> float:
        ends = {interface.slave.segments[0][0], interface.slave.segments[-1][1]}
        return 0.5 if {a, b} & ends else 1.0


class HalfAtEndNodes(Right):
    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = super().residual(interface, pairing, z).reshape(-1, 2).copy()
        forces[[0, interface.n_slave_nodes - 1]] *= 0.5
        return forces.reshape(z.shape)


class SlaveShapesExchanged(Right):
    def shapes(self, s: Any) -> Any:
        return s, 1 - s


class MasterShapesExchanged(Right):
    def master_shapes(self, t: Any) -> Any:
        return t, 1 - t


class NoForce(Right):
    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return 0 * super().residual(interface, pairing, z)


class LastMasterMissed(Right):
    def facing(self, start: Any, end: Any) -> Any:
        m = super().facing(start, end)
        return m[m < len(start) - 1]


class AbsoluteGap(Right):
    def is_closed(self, gap: Any) -> Any:
        return gap.real < -1e-8


class WholeSprings(Right):
    """Springs at slave nodes, where springs per length are stated."""

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = super().residual(interface, pairing, z).reshape(-1, 2).copy()
        n = interface.n_slave_nodes
        forces[:n] = 0
        forces[:n, 1] = np.minimum(0, z.reshape(-1, 2)[:n, 1]) * self.penalty
        return forces.reshape(z.shape)


class TangentTurned(Right):
    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return -super().tangent(interface, pairing, z)


class TangentTwice(Right):
    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return 2 * super().tangent(interface, pairing, z)


class ColumnMissing(Right):
    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        matrix = super().tangent(interface, pairing, z)
        matrix[:, 1] = 0
        return matrix


class DeepTangentWrong(Right):
    """The material part of the tangent is wrong in deep penetration alone, and so grows by no power of it."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        matrix = super().tangent(interface, pairing, z)
        if z[1] < -(2.0**-6):
            matrix[1::2, 1::2] *= 2
        return matrix


FORCES: Mapping[str, tuple[Callable[..., Any], str]] = {
    "opposite sign": (OppositeSign, "every node has -1 times the exact force: the sign"),
    "twice": (Twice, "every node has 2 times the exact force: two passes"),
    "half at end segments": (HalfAtEndSegments, "slave segment 0 0.5 times, slave segment 2 0.5 times the exact one"),
    "half at end nodes": (HalfAtEndNodes, "only free ends are wrong: 0.5 times at slave node 0 and 0.5 times at slave"),
    "slave shapes exchanged": (SlaveShapesExchanged, "the two shape functions of each slave segment are exchanged"),
    "master shapes exchanged": (MasterShapesExchanged, "the two shape functions of each master segment are exchanged"),
    "no force": (NoForce, "there is no force at all"),
    "last master missed": (LastMasterMissed, "master segment 3 is left out"),
    "absolute gap": (AbsoluteGap, "forces do not scale with a mesh 2^20 times smaller"),
    "whole springs": (WholeSprings, "each slave node has a whole spring"),
}
TANGENTS: Mapping[str, tuple[Callable[..., Any], str]] = {
    "turned": (TangentTurned, "the tangent has the opposite sign"),
    "twice": (TangentTwice, "the tangent has a factor 2"),
    "deep": (DeepTangentWrong, "entries in n–n are wrong"),
    "column": (ColumnMissing, "column 1 (y of slave node 0) is missing, all others are right"),
}
