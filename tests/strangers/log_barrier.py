"""A logarithmic barrier between nodes and the nearest points of the other surface, on both sides.

After Li et al., "Incremental Potential Contact" (2020), Eq. 6: b(d) = −(d − d̂)² ln(d/d̂), here of the distance and with
the reference length of a node as its weight, so that the sum does not depend on how many nodes there are. The nearest
point lies inside a segment or at a vertex; which of both is a decision of the pairing.
"""

from typing import Any

import numpy as np

from contactverif import Promises, Rules, Traits

SHARE = 0.5  # The activation distance over the shortest segment.


class LogBarrier:
    """Potential κ Σ w b(d) over all nodes nearer than d̂, with its exact gradient and Hessian."""

    traits = Traits(
        promises=Promises(tangent="exact", symmetric=True, conserves_force=True, conserves_moment=True, unbiased=True),
        rules=Rules(enforcement="barrier", activation=SHARE, penalty_power=0.0),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        x, rows = z.reshape(-1, 2), []
        for points, side in ((interface.slave, interface.master), (interface.master, interface.slave)):
            first, run = x[side.segments[:, 0]], np.diff(x[side.segments], axis=1)[:, 0]
            way = x[points.nodes][:, None] - first
            share = (way * run).sum(axis=2) / (run**2).sum(axis=1)
            distance = np.linalg.norm(way - np.clip(share, 0, 1)[..., None] * run, axis=2)
            number, near = np.arange(len(points.nodes)), distance.argmin(axis=1)
            share, ends = share[number, near], side.segments[near]
            vertex = (share <= 0) | (share >= 1)
            ends = np.where(vertex[:, None], np.where(share <= 0, *ends.T)[:, None], ends)
            pairs = np.column_stack([vertex, points.nodes, ends])
            rows.append(pairs[distance[number, near] < self._range(interface)])
        return {"pairs": np.vstack(rows).astype(np.int64)}

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        total = np.zeros_like(z)
        weight, unknowns, distance, gradient, _ = self._terms(interface, pairing, z)
        slope, _ = self._derivatives(distance, interface)
        np.add.at(total, unknowns, self.penalty * (weight * slope)[:, None] * gradient)
        return total

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        total = np.zeros((z.size, z.size))
        weight, unknowns, distance, gradient, hessian = self._terms(interface, pairing, z)
        slope, curvature = self._derivatives(distance, interface)
        blocks = curvature[:, None, None] * _outer(gradient, gradient) + slope[:, None, None] * hessian
        np.add.at(total, (unknowns[:, :, None], unknowns[:, None, :]), self.penalty * weight[:, None, None] * blocks)
        return total

    def _terms(self, interface: Any, pairing: Any, z: Any) -> Any:
        """Return weights (n,), unknowns (n, 6), distances (n,), their gradients (n, 6) and Hessians (n, 6, 6)."""
        x, (vertex, *nodes) = z.reshape(-1, 2), pairing["pairs"].T
        node, start, end = (x[each] for each in nodes)
        way, ones = node - start, np.ones(len(node))
        run = np.where(vertex[:, None] == 1, np.column_stack([way[:, 1], -way[:, 0]]), end - start)
        length = np.linalg.norm(run, axis=1)
        tangent = run / length[:, None]
        normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
        height = (way * normal).sum(axis=1)
        normal, distance = np.sign(height)[:, None] * normal, np.abs(height)
        xi = np.where(vertex == 1, 0.0, (way * tangent).sum(axis=1) / length)
        shares = np.column_stack([ones, xi - 1, -xi])
        gradient, along = (_outer(shares, each).reshape(-1, 6) for each in (normal, tangent))
        turned = _outer(np.column_stack([0 * ones, -ones, ones]), normal).reshape(-1, 6)
        mixed = _outer(along, turned)
        across = -(mixed + mixed.transpose(0, 2, 1)) / length[:, None, None]
        across = across - (distance / length**2)[:, None, None] * _outer(turned, turned)
        around = _outer(along, along) / distance[:, None, None]
        hessian = np.where(vertex[:, None, None] == 1, around, across)
        unknowns = (2 * np.column_stack(nodes)[..., None] + [0, 1]).reshape(-1, 6)
        return self._weights(interface)[nodes[0]], unknowns, distance, gradient, hessian

    def _range(self, interface: Any) -> float:
        """Return the activation distance."""
        sides = (interface.slave, interface.master)
        return SHARE * min(float(side.lengths(interface.nodes).min()) for side in sides)

    def _weights(self, interface: Any) -> Any:
        """Return half of the reference length of each node's segments."""
        weights = np.zeros(interface.n_nodes)
        for side in (interface.slave, interface.master):
            for end in (0, 1):
                np.add.at(weights, side.segments[:, end], side.lengths(interface.nodes) / 2)
        return weights

    def _derivatives(self, distance: Any, interface: Any) -> Any:
        """Return b'(d) and b''(d) over d̂, so that κ is a pressure."""
        range_ = self._range(interface)
        past, logarithm = np.minimum(distance - range_, 0.0), np.log(distance / range_)
        ratio = past / distance
        curvature = np.where(past < 0, -2 * logarithm - 4 * ratio + ratio**2, 0.0)
        return (-2 * past * logarithm - past * ratio) / range_, curvature / range_


def _outer(first: Any, second: Any) -> Any:
    return first[:, :, None] * second[:, None, :]
