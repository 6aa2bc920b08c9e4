"""Slave nodes against the closest master segment, with the tangent of the textbook.

After Wriggers, "Computational Contact Mechanics" (2006), Section 9.1: the vectors N, T, N₀ and T₀ of a node and its
segment. A node has the area of half of each of its slave segments; in the reference configuration the springs have a
potential, and multipliers in place of springs are nodal forces.
"""

from typing import Any

import numpy as np

from contactverif import Handle, Promises, Rules, Traits
from strangers.closest import closest_segments


class NodeVectors:
    """The active nodes (n,) with their gaps, places ξ and the four vectors (n, 6) of node, first and second node."""

    def __init__(self, interface: Any, pairing: Any, x: Any) -> None:
        self.number = np.flatnonzero(pairing["active"])
        ends = interface.master.segments[pairing["master"][self.number]]
        nodes = np.column_stack([interface.slave.nodes[self.number], ends])
        self.unknowns = (2 * nodes[..., None] + np.arange(2)).reshape(-1, 6)
        point, first, second = (x[nodes[:, number]] for number in range(3))
        run = second - first
        self.length = np.hypot(*run.T)
        t = run / self.length[:, None]
        n = np.column_stack([t[:, 1], -t[:, 0]])
        self.gap = np.einsum("pi,pi->p", point - first, n)
        self.xi = np.einsum("pi,pi->p", point - first, t) / self.length
        shares, ones = np.array([np.ones_like(self.xi), self.xi - 1, -self.xi]), np.array([0.0, -1.0, 1.0])
        self.n, self.t = (np.einsum("kp,pi->pki", shares, each).reshape(-1, 6) for each in (n, t))
        self.n0 = np.einsum("k,pi->pki", ones, n).reshape(-1, 6)

    def turn(self) -> Any:
        """Return the derivative (n, 6, 6) of the vectors N."""
        mixed = np.einsum("pi,pj->pij", self.t, self.n0)
        curved = (self.gap / self.length**2)[:, None, None] * np.einsum("pi,pj->pij", self.n0, self.n0)
        return -(mixed + mixed.transpose(0, 2, 1)) / self.length[:, None, None] - curved


def pair_nodes(interface: Any, x: Any) -> tuple[Any, Any, Any]:
    """Return the master segment and the gap of each slave node, and whether its foot is on the master."""
    points = x[interface.slave.nodes]
    master, over = closest_segments(points, interface.master, x)
    first, second = (x[interface.master.segments[master, end]] for end in (0, 1))
    run = second - first
    across = (points - first)[:, 0] * run[:, 1] - (points - first)[:, 1] * run[:, 0]
    return master.astype(np.int64), across / np.hypot(*run.T), over


def add_matrices(total: Any, rows: Any, columns: Any, parts: Any) -> None:
    np.add.at(total, (rows[:, :, None], columns[:, None, :]), parts)


class NodesWithAreas:
    """Springs at slave nodes with current tributary areas, whose change the tangent knows; dense matrices."""

    area = "current"
    traits = Traits(
        promises=Promises(
            tangent="exact",
            conserves_force=True,
            conserves_moment=True,
            nodes_push=True,
            local=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed", area="current", gap="closest point", force_along="master normal"),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        master, gap, over = pair_nodes(interface, z.reshape(-1, 2))
        return {"master": master, "active": over & (gap < 0)}

    def _areas(self, interface: Any, x: Any) -> Any:
        places = x if self.area == "current" else interface.nodes
        a, b = (places[interface.slave.segments[:, end]] for end in (0, 1))
        return np.bincount(interface.slave.segments.ravel(), np.repeat(np.hypot(*(b - a).T) / 2, 2))

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        vectors, forces = NodeVectors(interface, pairing, x), np.zeros_like(z)
        size = self.penalty * self._areas(interface, x)[vectors.number] * vectors.gap
        np.add.at(forces, vectors.unknowns, size[:, None] * vectors.n)
        return forces

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, matrix = z.reshape(-1, 2), np.zeros((z.size, z.size))
        vectors = NodeVectors(interface, pairing, x)
        area = self.penalty * self._areas(interface, x)[vectors.number]
        parts = np.einsum("pi,pj->pij", vectors.n, vectors.n) + vectors.gap[:, None, None] * vectors.turn()
        add_matrices(matrix, vectors.unknowns, vectors.unknowns, area[:, None, None] * parts)
        if self.area == "current":
            self._add_change_of_areas(interface, vectors, x, matrix)
        return matrix

    def _add_change_of_areas(self, interface: Any, vectors: NodeVectors, x: Any, matrix: Any) -> None:
        row = np.full(interface.n_slave_nodes, -1)
        row[vectors.number] = np.arange(len(vectors.number))
        for a, b in interface.slave.segments:
            along = (x[b] - x[a]) / np.hypot(*(x[b] - x[a]))
            columns = np.array([2 * a, 2 * a + 1, 2 * b, 2 * b + 1])
            change = np.concatenate([-along, along]) / 2
            for at in (row[a], row[b]):
                if at >= 0:
                    force = self.penalty * vectors.gap[at] * vectors.n[at]
                    matrix[np.ix_(vectors.unknowns[at], columns)] += np.outer(force, change)


class NodesWithPotential(NodesWithAreas):
    """Springs with areas of the reference: forces are the gradient of Σ ε̂ A g²/2, so the tangent is symmetric.

    All decisions are in a handle, as those of a library are.
    """

    area = "reference"
    traits = NodesWithAreas.traits.revise(area="reference", symmetric=True)

    def pair(self, interface: Any, z: Any) -> Any:
        return {"contacts": Handle(super().pair(interface, z))}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return super().residual(interface, pairing.handle, z)

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return super().tangent(interface, pairing.handle, z)


class NodesWithMultipliers:
    """A nodal force in place of each spring; rows −g where a node is in contact, and λ where it is not."""

    traits = Traits(
        promises=Promises(
            tangent="exact",
            symmetric=True,
            conserves_force=True,
            conserves_moment=True,
            nodes_push=True,
            local=True,
            translation_stable=True,
            independent_multipliers=True,
        ),
        rules=Rules(enforcement="multiplier", penalty="nodal", gap="closest point", force_along="master normal"),
    )

    def __init__(self, *, penalty: float) -> None:
        self.scale = penalty

    def n_multipliers(self, interface: Any) -> int:
        return int(interface.n_slave_nodes)

    def pair(self, interface: Any, z: Any) -> Any:
        positions, multipliers = z[: interface.n_unknowns], z[interface.n_unknowns :]
        master, gap, over = pair_nodes(interface, positions.reshape(-1, 2))
        return {"master": master, "active": over & (multipliers - self.scale * gap > 0)}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        n, answer = interface.n_unknowns, z.copy()
        answer[:n] = 0
        vectors = NodeVectors(interface, pairing, z[:n].reshape(-1, 2))
        np.add.at(answer, vectors.unknowns, -z[n + vectors.number, None] * vectors.n)
        answer[n + vectors.number] = -vectors.gap
        return answer

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        n, matrix = interface.n_unknowns, np.zeros((z.size, z.size))
        vectors = NodeVectors(interface, pairing, z[:n].reshape(-1, 2))
        rows = n + vectors.number
        add_matrices(matrix, vectors.unknowns, vectors.unknowns, -z[rows][:, None, None] * vectors.turn())
        matrix[vectors.unknowns, rows[:, None]] = matrix[rows[:, None], vectors.unknowns] = -vectors.n
        idle = np.setdiff1d(np.arange(n, z.size), rows)
        matrix[idle, idle] = 1
        return matrix
