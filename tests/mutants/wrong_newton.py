"""Mutants that are wrong in solving: numbers with a hidden unit, and points that are rounded far from the origin."""

from typing import Any

import numpy as np
from mutate import Mutant, replaces, wrap

import contactverif_nts
from contactverif import Pairing

UNITS, ATTAINABLE = "newton.units", "newton.attainable"


@replaces("tangent")
def _safe_tangent(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Add a small stiffness to the diagonal, so that no matrix is singular."""
    return right(interface, pairing, z).toarray() + 1e-9 * np.eye(z.size)


def _least_pressure(*, penalty: float) -> Any:
    """Count a point as active only above a small pressure; lengths alone do not change a pressure."""
    inner = contactverif_nts.vts_me(penalty=penalty)

    def pair(right: Any, interface: Any, z: Any) -> Any:
        pairing = right(interface, z)
        pressed = inner.contact_points(interface, pairing, z).pressure > 1e-9
        return Pairing({**pairing, "active": pairing["active"] & pressed})

    return wrap(penalty, contactverif_nts.vts_me, pair=pair)


@replaces("tangent")
def _drops_entries(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Drop entries that are small in newtons and millimetres, to save places in the matrix."""
    matrix = right(interface, pairing, z).toarray()
    return np.where(np.abs(matrix) < 1e-3, 0.0, matrix)


class PointsFirst:
    """VTS-ME whose virtual slave nodes are rounded where they lie, before a master node is subtracted."""

    def __init__(self, *, penalty: float) -> None:
        self._inner = contactverif_nts.vts_me(penalty=penalty)
        self.penalty = penalty
        self.traits = self._inner.traits.revise(translation_stable=True, batched=False, takes_complex=False)

    def pair(self, interface: Any, z: Any) -> Any:
        return self._inner.pair(interface, z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.tangent(interface, pairing, z)

    def distance(self, point: Any, node: Any, direction: Any) -> Any:
        return (point - node) @ direction

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, forces = z.reshape(-1, 2), np.zeros_like(z).reshape(-1, 2)
        for point in np.flatnonzero(pairing["active"]):
            a, b = interface.slave.segments[pairing["segment"][point]]
            node_1, node_2 = interface.master.segments[pairing["master"][point]]
            share, slot = (1 + self._inner.c[pairing["slot"][point]]) / 2, pairing["slot"][point]
            area = self._inner.weight[slot] * np.linalg.norm(x[b] - x[a])
            length = np.linalg.norm(x[node_2] - x[node_1])
            t = (x[node_2] - x[node_1]) / length
            normal = np.array([t[1], -t[0]])
            x_v = (1 - share) * x[a] + share * x[b]
            xi = self.distance(x_v, x[node_1], t) / length
            force = self.penalty * self.distance(x_v, x[node_1], normal) * area * normal
            for node, part in ((a, 1 - share), (b, share), (node_1, xi - 1), (node_2, -xi)):
                forces[node] += part * force
        return forces.reshape(-1)


class AbsoluteCoordinates(PointsFirst):
    """VTS-ME whose gaps are differences of products of absolute coordinates with the normal."""

    def distance(self, point: Any, node: Any, direction: Any) -> Any:
        return point @ direction - node @ direction


MUTANTS = (
    Mutant("small stiffness on the diagonal of the tangent", UNITS, _safe_tangent),
    Mutant("active above an absolute pressure", UNITS, _least_pressure),
    Mutant("small entries of the tangent dropped", UNITS, _drops_entries),
    Mutant("point rounded before the difference, in a scene", ATTAINABLE, PointsFirst),
    Mutant("gap from absolute coordinates, in a scene", ATTAINABLE, AbsoluteCoordinates),
)
