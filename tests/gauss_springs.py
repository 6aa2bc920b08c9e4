"""One formulation, springs at two Gauss points of each slave segment, written in several right and several wrong ways.

All ways are the same in exact arithmetic. They differ in where they round: before or after positions are subtracted.
No code of a plugin is used, so that the judges of rounding meet formulations that somebody else might write.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from contactverif import Abilities, Promises, Rules, Subject, Traits

C = np.array([-1.0, 1.0]) / np.sqrt(3.0)  # The places of the Gauss points on a slave segment
TRAITS = Traits(
    promises=Promises(tangent="exact"),
    rules=Rules(area="current", penalty="distributed"),
    abilities=Abilities(batched=True, takes_longdouble=True),
)


@dataclass
class Segments:
    """The ends of the slave and the master segment of each point, (..., n_points, 2), and the shares of the slave's."""

    slave_1: Any
    slave_2: Any
    master_1: Any
    master_2: Any
    share_1: Any
    share_2: Any


def dot(p, q):
    return p[..., 0] * q[..., 0] + p[..., 1] * q[..., 1]


def frame(s):
    """Return length, tangent and normal of the master segments."""
    along = s.master_2 - s.master_1
    length = np.sqrt(dot(along, along))
    t = along / length[..., None]
    return length, t, np.stack([t[..., 1], -t[..., 0]], axis=-1)


def arm(s):
    """Return the vector from the master's first node to the point, differences first."""
    return s.share_1[..., None] * (s.slave_1 - s.master_1) + s.share_2[..., None] * (s.slave_2 - s.master_1)


def point(s):
    return s.share_1[..., None] * s.slave_1 + s.share_2[..., None] * s.slave_2


def by_differences(s):
    length, t, n = frame(s)
    return dot(arm(s), n), dot(arm(s), t) / length, n


def by_einsum(s):
    length, t, n = frame(s)
    shares = np.stack([s.share_1, s.share_2])
    vectors = np.stack([s.slave_1 - s.master_1, s.slave_2 - s.master_1])
    gap = np.einsum("kp,k...pi,...pi->...p", shares, vectors, n)
    return gap, np.einsum("kp,k...pi,...pi->...p", shares, vectors, t) / length, n


def by_cross_product(s):
    """Return the gap as a cross product, seen from the master's second node."""
    along = s.master_2 - s.master_1
    d = point(replace(s, slave_1=s.slave_1 - s.master_2, slave_2=s.slave_2 - s.master_2))
    squared = dot(along, along)
    length = np.sqrt(squared)
    gap = (along[..., 1] * d[..., 0] - along[..., 0] * d[..., 1]) / length
    return gap, 1 + dot(d, along) / squared, np.stack([along[..., 1], -along[..., 0]], axis=-1) / length[..., None]


def by_angle(s):
    along = s.master_2 - s.master_1
    angle = np.arctan2(along[..., 1], along[..., 0])
    n, t = np.stack([np.sin(angle), -np.cos(angle)], axis=-1), np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return dot(arm(s), n), dot(arm(s), t) / np.hypot(along[..., 0], along[..., 1]), n


def by_points_first(s):
    length, t, n = frame(s)
    d = point(s) - s.master_1
    return dot(d, n), dot(d, t) / length, n


def by_two_heights(s):
    """Return the gap as n·x_s − n·x_m."""
    _, xi, n = by_differences(s)
    return dot(n, point(s)) - dot(n, s.master_1), xi, n


def by_absolute_shapes(s):
    """Return the gap from Σ N_i x_i of both sides."""
    _, xi, n = by_differences(s)
    foot = (1 - xi)[..., None] * s.master_1 + xi[..., None] * s.master_2
    return dot(point(s) - foot, n), xi, n


def by_implicit_line(s):
    """Return the gap as a x + b y + c."""
    length, t, n = frame(s)
    constant = (s.master_1[..., 1] * s.master_2[..., 0] - s.master_1[..., 0] * s.master_2[..., 1]) / length
    x = point(s)
    return n[..., 0] * x[..., 0] + n[..., 1] * x[..., 1] + constant, dot(arm(s), t) / length, n


Way = Callable[[Segments], tuple[Any, Any, Any]]


def keep(z):
    return z


def centre(z):
    x = z.reshape(*z.shape[:-1], -1, 2)
    return (x - x.mean(axis=-2, keepdims=True)).reshape(z.shape)


def move_to_first_node(z):
    return z - np.tile(z[..., :2], z.shape[-1] // 2)


def in_single_precision(z):
    return z.astype(np.complex64 if np.iscomplexobj(z) else np.float32).astype(z.dtype)


def single_precision_at_first_node(z):
    return in_single_precision(move_to_first_node(z))


class GaussSprings:
    """The formulation; `way` computes gap, ξ and normal, after `before` has changed the coordinates."""

    def __init__(self, penalty, way, before=keep, **traits):
        self.penalty, self.way, self.before = penalty, way, before
        self.tangent_way, self.search_before = way, keep
        self.traits = TRAITS.revise(**traits)

    def segments(self, interface, master, z):
        x = z.reshape(*z.shape[:-1], -1, 2)
        slave = np.repeat(interface.slave.segments, 2, axis=0)
        c = np.tile(C, len(interface.slave))
        first, second = interface.master.segments[master].T
        ends = (x[..., nodes, :] for nodes in (slave[:, 0], slave[:, 1], first, second))
        return Segments(*ends, (1 - c) / 2, (1 + c) / 2)

    def pair(self, interface, z):
        z = self.search_before(z)
        n_points, n_master = 2 * len(interface.slave), len(interface.master)
        gaps, distances, places = np.empty((3, n_master, n_points))
        for j in range(n_master):
            s = self.segments(interface, np.full(n_points, j), z)
            gaps[j], places[j], _ = by_differences(s)
            clipped = np.clip(places[j], 0, 1)
            distances[j] = np.linalg.norm(arm(s) - clipped[:, None] * (s.master_2 - s.master_1), axis=1)
        master, points = np.argmin(distances, axis=0), np.arange(n_points)
        inside = (places[master, points] >= 0) & (places[master, points] <= 1)
        return {"master": master, "active": (gaps[master, points] < 0) & inside}

    def residual(self, interface, pairing, z):
        return self._residual(interface, pairing, z, self.way)

    def _residual(self, interface, pairing, z, way):
        z = self.before(z)
        s = self.segments(interface, pairing["master"], z)
        gap, xi, n = way(s)
        ab = s.slave_2 - s.slave_1
        force = (self.penalty * np.where(pairing["active"], gap, 0) * np.sqrt(dot(ab, ab)) / 2)[..., None] * n
        forces = np.zeros_like(z).reshape(*z.shape[:-1], -1, 2)
        slave, master = np.repeat(interface.slave.segments, 2, axis=0), interface.master.segments[pairing["master"]]
        parts = ((slave[:, 0], s.share_1), (slave[:, 1], s.share_2), (master[:, 0], xi - 1), (master[:, 1], -xi))
        for nodes, share in parts:
            part = np.asarray(share)[..., None] * force
            for number, node in enumerate(nodes):
                forces[..., node, :] += part[..., number, :]
        return forces.reshape(z.shape)

    def tangent(self, interface, pairing, z):
        """Return the derivative by a complex step."""
        way = by_differences if self.tangent_way is by_angle else self.tangent_way
        rows = self._residual(interface, pairing, z + 1e-30j * np.eye(z.size), way)
        return np.ascontiguousarray(rows.imag.T / 1e-30)


RIGHT: dict[str, tuple[Way, Callable[[Any], Any]]] = {
    "differences first": (by_differences, keep),
    "einsum": (by_einsum, keep),
    "cross product": (by_cross_product, keep),
    "atan2": (by_angle, keep),
    "points first, about the centroid": (by_points_first, centre),
    "implicit line, about the centroid": (by_implicit_line, centre),
    "points first, about the first node": (by_points_first, move_to_first_node),
}
WRONG: dict[str, tuple[Way, Callable[[Any], Any]]] = {
    "point rounded before the difference": (by_points_first, keep),
    "gap from two heights": (by_two_heights, keep),
    "absolute shape functions": (by_absolute_shapes, keep),
    "implicit line": (by_implicit_line, keep),
    "single precision": (by_differences, in_single_precision),
}


def springs_of(way, before=keep, **traits):
    """Return the formulation written in one way, with these promises."""
    return Subject("gauss springs", lambda *, penalty: GaussSprings(penalty, way, before, **traits))
