"""Right formulations as a stranger might write them, with contact points: no code of a plugin is used.

Each is right by the rule that its traits state, and differs from the built-in ones in the way of writing, in what
roundoff and ties decide, and in what it leaves out of its report.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from contactverif import ContactPoints, Promises, Rules, Traits

GAUSS = np.array([-1.0, 1.0]) / np.sqrt(3.0)


def _unit(vectors: Any) -> Any:
    return vectors / np.sqrt((vectors**2).sum(axis=-1))[..., None]


class PointsFirst:
    """Springs at the slave nodes, each node once for each of its segments; points are formed first, at full size.

    Of tied segments the last one is taken, there is no tolerance past a free end, and the normal comes from an angle.
    """

    traits = Traits(
        promises=Promises(conserves_force=True), rules=Rules(gap="closest point", penalty="distributed", area="current")
    )
    places = np.array([-1.0, 1.0])

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def _points(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        first, second = (x[interface.slave.segments[:, end]] for end in (0, 1))
        c = np.tile(self.places, len(first))
        carrier = np.repeat(np.arange(len(first)), len(self.places))
        point = np.einsum("p,pi->pi", (1 - c) / 2, first[carrier]) + np.einsum("p,pi->pi", (1 + c) / 2, second[carrier])
        weight = np.hypot(*(second - first)[carrier].T) / len(self.places)
        return x, carrier, c, point, weight

    def _look(self, interface: Any, x: Any, point: Any) -> Any:
        """Return for each point and master segment ξ, distance, normal and gap."""
        first, second = (x[interface.master.segments[:, end]] for end in (0, 1))
        along = second - first
        angle = np.arctan2(along[:, 1], along[:, 0])
        normal = np.stack([np.sin(angle), -np.cos(angle)], axis=1)
        offset, beyond = point[:, None] - first, point[:, None] - second
        xi = np.einsum("pmi,mi->pm", offset, along) / np.einsum("mi,mi->m", along, along)
        nearest = point[:, None] - (first + np.clip(xi, 0, 1)[..., None] * along)
        nearest = np.where((xi <= 0)[..., None], offset, np.where((xi >= 1)[..., None], beyond, nearest))
        distance = np.hypot(nearest[..., 0], nearest[..., 1])
        return xi, distance, normal, np.einsum("pmi,mi->pm", offset, normal)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x, carrier, c, point, weight = self._points(interface, z)
        xi, distance, normals, gaps = self._look(interface, x, point)
        rows = np.arange(len(c))
        master = distance.shape[1] - 1 - np.argmin(distance[:, ::-1], axis=1)
        place, gap = xi[rows, master], gaps[rows, master]
        free = interface.master.neighbours[master] < 0
        active = (gap <= 0) & ~(free[:, 0] & (place < 0)) & ~(free[:, 1] & (place > 1))
        pressure, ends = np.where(active, -self.penalty * gap, 0.0), np.full((2, len(c)), np.nan)
        return ContactPoints(carrier, c, master, place, point, normals[master], gap, pressure, weight, active, *ends)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        points, forces = self.contact_points(interface, pairing, z), np.zeros((interface.n_nodes, 2))
        at = points.active
        force = (points.pressure[at] * points.weight[at])[:, None] * points.normal[at]
        ends, c = interface.slave.segments[points.slave_segment[at]], points.c[at]
        segment, xi = interface.master.segments[points.master_segment[at]], points.xi[at]
        nodes, shares = np.hstack([ends, segment]), np.stack([(c - 1) / 2, -(1 + c) / 2, 1 - xi, xi], axis=1)
        np.add.at(forces, nodes, shares[..., None] * force[:, None])
        return forces.reshape(-1)


class TurnedFrame(PointsFirst):
    """Springs at two points of each slave segment, computed in a frame along the first one, and turned back."""

    traits = PointsFirst.traits.revise(translation_stable=True)
    places = np.array([-0.5, 0.5])

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x = z.reshape(-1, 2)
        along = _unit(x[1] - x[0])
        frame = np.array([along, [-along[1], along[0]]])
        points = super().contact_points(interface, pairing, ((x - x[0]) @ frame.T).reshape(-1))
        return replace(points, position=self._points(interface, z)[3], normal=points.normal @ frame)


class SlaveNormalAtGaussPoints(PointsFirst):
    """Springs at two Gauss points of each slave segment, along its normal; a point that sees nothing is not reported.

    There are no cells: each point looks for the nearest segment on its own line, differences first.
    """

    traits = Traits(
        promises=Promises(conserves_force=True, translation_stable=True),
        rules=Rules(gap="slave normal", penalty="distributed", area="current"),
    )
    places = GAUSS

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        x, carrier, c, point, weight = self._points(interface, z)
        a, b = (x[interface.slave.segments[carrier, end]] for end in (0, 1))
        first, second = (x[interface.master.segments[:, end]] for end in (0, 1))
        tau = _unit(b - a)
        normal = np.stack([-tau[:, 1], tau[:, 0]], axis=1)  # Into the slave, out of the master
        along = second - first
        offset = ((1 - c) / 2)[:, None, None] * (a[:, None] - first) + ((1 + c) / 2)[:, None, None] * (
            b[:, None] - first
        )
        advance = np.einsum("pi,mi->pm", tau, along)
        with np.errstate(divide="ignore", invalid="ignore"):
            xi = np.einsum("pmi,pi->pm", offset, tau) / advance
            foot = xi[..., None] * along
            gap = np.einsum("pmi,pi->pm", offset - foot, normal)
        sees = (advance < 0) & (xi >= 0) & (xi <= 1)
        master = np.where(sees, np.abs(gap), np.inf).argmin(axis=1)
        here = np.flatnonzero(sees.any(axis=1))
        m = master[here]
        gaps = gap[here, m]
        active = gaps < 0
        pressure, ends = np.where(active, -self.penalty * gaps, 0.0), np.full((2, len(here)), np.nan)
        places = (carrier[here], c[here], m, xi[here, m], point[here], normal[here])
        return ContactPoints(*places, gaps, pressure, weight[here], active, *ends)


class NearbyOnly(PointsFirst):
    """Springs at four points of each slave segment, which look no farther than one segment and turn the index of ties.

    Points that find nothing name no master segment and leave all numbers NaN.
    """

    traits = PointsFirst.traits.revise(overhang=False)
    places = np.array([-0.75, -0.25, 0.25, 0.75])

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        points = super().contact_points(interface, pairing, z)
        lengths = interface.slave.lengths(z.reshape(-1, 2))[points.slave_segment]
        far = (points.gap > lengths) & ~points.active
        numbers = {name: np.where(far, np.nan, getattr(points, name)) for name in ("xi", "gap")}
        normal = np.where(far[:, None], np.nan, points.normal)
        master = np.where(far, -1, points.master_segment)
        arrays = {name: getattr(points, name) for name in ("slave_segment", "c", "position", "pressure", "weight")}
        ends = {"area_from": points.c - 0.25, "area_to": points.c + 0.25}
        return ContactPoints(**arrays, **numbers, **ends, active=points.active, master_segment=master, normal=normal)
