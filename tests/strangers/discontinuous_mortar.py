"""A mortar method whose pressures are quadratic on each slave segment and jump between them.

After Wohlmuth, "Discretization methods and iterative solvers based on domain decomposition" (2001), with discontinuous
multipliers. The shapes are Lagrange's at the three Gauss points of what is covered without a break, so that their mass
is diagonal, with the weights of these points.
"""

from typing import Any

import numpy as np

from contactverif import Abilities, ContactPoints, PatchPromises, Promises, Rules, Traits
from strangers.strips import add_at, cross, dot, share_of, visible_strips

KNOTS = np.sqrt(0.6) * np.array([-1.0, 0.0, 1.0])
SHARES = np.array([5.0, 8.0, 5.0]) / 18
TWO = np.array([-1.0, 1.0]) / np.sqrt(3.0)  # Exact for cubics


def shapes_at(c: Any) -> Any:
    """Return the three quadratic shapes (..., 3) at places from −1 to 1."""
    k = KNOTS[2]
    return np.stack([c * (c - k) / (2 * k * k), 1 - c * c / (k * k), c * (c + k) / (2 * k * k)], axis=-1)


class DiscontinuousMortar:
    """Springs of gaps that are projected on quadratic polynomials of each covered part of a slave segment.

    Contact points are the Gauss points of the covered parts, with the projected gaps.
    """

    traits = Traits(
        promises=Promises(
            patch=PatchPromises(flat=True, kinked=True, overhang=True),
            converges=True,
            integrates_linear_gap=True,
            conserves_force=True,
            conserves_moment=True,
            local=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed", area="current", force_along="slave normal"),
        abilities=Abilities(batched=True, takes_complex=True),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        strips = visible_strips(interface.slave.segments, interface.master.segments, x)
        begins = np.ones(len(strips), dtype=bool)
        same = strips[1:, 0] == strips[:-1, 0]
        begins[1:] = ~(same & (strips[1:, 2] == strips[:-1, 3]))  # A part begins where no strip ends.
        first, part = np.flatnonzero(begins), np.cumsum(begins) - 1
        last = np.append(first[1:], len(strips))[: len(first)] - 1
        parts = np.column_stack([strips[first, 0], strips[first, 2], strips[last, 3]]).reshape(-1, 3)
        pairing = {"strips": strips, "part": part.astype(np.int64), "parts": parts}
        return {**pairing, "active": self._project(interface, pairing, x)[0] < 0}

    def _project(self, interface: Any, pairing: Any, x: Any) -> Any:
        """Return the projected gaps (..., n_parts, 3), ranges of parts, and what the points of strips have."""
        strips, part, parts = pairing["strips"], pairing["part"], pairing["parts"]
        slave, master = interface.slave.segments[strips[:, 0]], interface.master.segments[strips[:, 1]]
        carrier = interface.slave.segments[parts[:, 0]]
        low, high = share_of(parts[:, 1], 0, carrier, x), share_of(parts[:, 2], 1, carrier, x)
        start, end = share_of(strips[:, 2], 0, slave, x), share_of(strips[:, 3], 1, slave, x)
        s = ((start + end)[..., None] + (end - start)[..., None] * TWO) / 2
        middle, half = ((low + high) / 2)[..., part, None], ((high - low) / 2)[..., part, None]
        shapes = shapes_at((s - middle) / half)
        a = x[..., slave[:, 0], :]
        along = x[..., slave[:, 1], :] - a
        to_first, to_second = x[..., master[:, 0], :] - a, x[..., master[:, 1], :] - a
        square = dot(along, along)
        run = x[..., master[:, 1], :] - x[..., master[:, 0], :]
        t = (s * square[..., None] - dot(to_first, along)[..., None]) / dot(run, along)[..., None]
        size = np.sqrt(square)
        gap = -((1 - t) * cross(along, to_first)[..., None] + t * cross(along, to_second)[..., None]) / size[..., None]
        share = ((end - start) / (high - low)[..., part] / 2)[..., None]  # Of the part's length, for each point
        sums = np.zeros((*gap.shape[:-2], len(parts), 3), gap.dtype)
        add = ((share * gap)[..., None] * shapes).sum(axis=-2)
        np.add.at(sums, (..., part, slice(None)), add)
        normal = np.stack([-along[..., 1], along[..., 0]], axis=-1) / size[..., None]
        weight = ((end - start) * size / 2)[..., None]
        return sums / SHARES, (low, high), (shapes, s, t, weight, normal)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(*z.shape[:-1], -1, 2)
        gaps, _, (shapes, s, t, weight, normal) = self._project(interface, pairing, x)
        nodal = self.penalty * np.where(pairing["active"], gaps, 0)
        pull = (nodal[..., pairing["part"], None, :] * shapes).sum(axis=-1) * weight
        slave = interface.slave.segments[pairing["strips"][:, 0]].T
        master = interface.master.segments[pairing["strips"][:, 1]].T
        forces = np.zeros_like(x)
        for nodes, share in zip((*slave, *master), (1 - s, s, t - 1, -t), strict=True):
            add_at(forces, nodes, (pull * share).sum(axis=-1)[..., None] * normal)
        return forces.reshape(z.shape)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x = z.reshape(-1, 2)
        gaps, (low, high), _ = self._project(interface, pairing, x)
        slave = pairing["parts"][:, 0]
        a, b = (x[interface.slave.segments[slave, end]] for end in (0, 1))
        c = ((low + high - 1)[:, None] + (high - low)[:, None] * KNOTS).ravel()
        carrier, active = np.repeat(slave, 3), pairing["active"].ravel()
        position = ((1 - c) / 2)[:, None] * np.repeat(a, 3, axis=0) + ((1 + c) / 2)[:, None] * np.repeat(b, 3, axis=0)
        along = b - a
        size = np.hypot(*along.T)
        normal = np.repeat(np.column_stack([-along[:, 1], along[:, 0]]) / size[:, None], 3, axis=0)
        weight = (((high - low) * size)[:, None] * SHARES).ravel()
        nothing, unknown = np.full(len(c), -1), np.full(len(c), np.nan)
        pressure = np.where(active, -self.penalty * gaps.ravel(), 0.0)
        places = (carrier, c, nothing, unknown, position, normal)
        return ContactPoints(*places, gaps.ravel(), pressure, weight, active, unknown, unknown)
