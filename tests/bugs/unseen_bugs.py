"""Eight more mistakes, one at a time, put into the right formulation `Springs`.

They were written without knowledge of the rules of the diagnosis. The words were added when rules for them were.
"""

from typing import Any

import numpy as np
from springs_with_bugs import PLACES, Springs


class Parts(Springs):
    """Springs again, right, with some more places where mistakes are put."""

    def unit(self, vector: Any, length: Any) -> Any:
        return vector / length[:, None]

    def part(self, s_c: Any, s_d: Any) -> tuple[Any, Any]:
        return np.where(s_d.real > 0, s_d, 0), np.where(s_c.real < 1, s_c, 1)

    def points(self, start: Any, end: Any) -> Any:
        """Yield the places of the points on the slave segment, and the share of the segment that they stand for."""
        for place in PLACES:
            yield start + place * (end - start), end - start

    def master_direction(self, normal: Any, c: Any, d: Any) -> Any:
        return -normal

    def forces(self, x: Any, slave_segment: Any, n_segments: int) -> Any:
        a, b, c, d = np.moveaxis(x, 1, 0)
        along = b - a
        square = (along * along).sum(1)
        length = np.sqrt(square)
        normal = self.unit(np.stack([along[:, 1], -along[:, 0]], 1), length)
        direction = self.master_direction(normal, c, d)
        s_c, s_d = ((c - a) * along).sum(1) / square, ((d - a) * along).sum(1) / square
        forces = np.zeros_like(x)
        for s, share in self.points(*self.part(s_c, s_d)):
            t = (s - s_c) / (s_d - s_c)
            on_slave = (1 - s)[:, None] * a + s[:, None] * b
            on_master = (1 - t)[:, None] * c + t[:, None] * d
            gap = ((on_master - on_slave) * normal).sum(1)
            size = self.pressure(gap) * share * self.weights(length, slave_segment, n_segments)
            forces[:, :2] += np.stack([1 - s, s], 1)[:, :, None] * (size[:, None] * normal)[:, None]
            forces[:, 2:] += np.stack([1 - t, t], 1)[:, :, None] * (size[:, None] * direction)[:, None]
        return forces


class OwnNormal(Parts):
    """The force on a master segment acts along the master's own normal, so it is not opposite to that on the slave."""

    def master_direction(self, normal: Any, c: Any, d: Any) -> Any:
        along = d - c
        return np.stack([along[:, 1], -along[:, 0]], 1) / np.sqrt((along * along).sum(1))[:, None]


class WholeSegment(Parts):
    """The Gauss points are those of the whole slave segment, which is not cut at the nodes of the master."""

    def points(self, start: Any, end: Any) -> Any:
        for place in PLACES:
            yield np.full_like(start, place), (start.real <= place) & (place < end.real)


class LastPairOnly(Springs):
    """The residual is assembled with `+=`, so a node that several pairs share gets the force of the last one only."""

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        i, nodes = self.pairs(interface, x)
        residual = np.zeros_like(x)
        residual[nodes] += self.forces(x[nodes], i, len(interface.slave.segments))
        return residual.reshape(-1)


class FixedPoints(Parts):
    """The tangent lacks the change of the places of the Gauss points on the slave: only the lengths of parts vary."""

    def points(self, start: Any, end: Any) -> Any:
        for s, share in super().points(start, end):
            yield s.real, share


class Transposed(Springs):
    """The tangent is transposed: rows are unknowns, and columns are forces."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return super().tangent(interface, pairing, z).T


class NodeOnSlave(Springs):
    """A master segment is found by its nodes: one that has none on the slave segment, but covers it, is missed."""

    def pairs(self, interface: Any, x: Any) -> tuple[Any, Any]:
        i, nodes = super().pairs(interface, x)
        a, b, c, d = np.moveaxis(x[nodes], 1, 0)
        along = b - a
        s_c, s_d = (((node - a) * along).sum(1) / (along * along).sum(1) for node in (c, d))
        is_near = ((s_c >= 0) & (s_c < 1)) | ((s_d >= 0) & (s_d < 1))
        return i[is_near], nodes[is_near]


class PairsKept(Springs):
    """The search runs at the first call for a mesh, and later calls take its pairs wherever the nodes have gone."""

    first_pairs: Any = None

    def pairs(self, interface: Any, x: Any) -> tuple[Any, Any]:
        mesh = interface.slave.segments.tolist(), interface.master.segments.tolist()
        if self.first_pairs is None or self.first_pairs[0] != mesh:
            self.first_pairs = mesh, super().pairs(interface, x)
        return self.first_pairs[1]  # type: ignore[no-any-return]


class NeverZero(Parts):
    """The normal is divided by the length plus 1e-8, against division by zero, whatever the unit of length."""

    def unit(self, vector: Any, length: Any) -> Any:
        return vector / (length[:, None] + 1e-8)


UNSEEN = {  # {name on the command line: (factory, words of the diagnosis that say place and kind)}.
    "own-normal": (OwnNormal, r"along the master's normal on the master"),
    "whole-segment": (WholeSegment, r"whole slave segments, not cut"),
    "last-pair": (LastPairOnly, r"overwritten, and not added"),
    "fixed-points": (FixedPoints, r"the part of the places of points"),
    "transposed": (Transposed, r"the transposed derivative"),
    "node-on-slave": (NodeOnSlave, r"finer than its master: slave segments .* left out"),
    "pairs-kept": (PairsKept, r"kept between calls: .* face other segments"),
    "never-zero": (NeverZero, r"look for an absolute length"),
}
