"""Right formulations as a stranger would write them: points first, gaps from absolute coordinates, other tie-breaks.

Each is a few lines of numpy without any code of a plugin. They pass no patch test, but they are right in what they
promise, so that no hard case may accuse them.
"""

from typing import Any

import numpy as np

from contactverif.contract.traits import Evidence, PatchPromises, Promises, Rules, Traits


class PointSprings:
    """Springs at points of each slave segment, against the nearest closed master segment."""

    def __init__(
        self,
        penalty: float,
        places: tuple[float, ...] = (0.25, 0.75),  # On a segment, from 0 to 1
        weights: tuple[float, ...] = (0.5, 0.5),  # The share of its length that each place stands for
        last: bool = False,  # Take the last of equally near segments, not the first.
        tau: float = 0.0,  # How far past a free end a point still counts, in lengths of the segment
        stated: bool = True,  # A newcomer states no traits.
    ) -> None:
        self.penalty, self.places, self.weights, self.last, self.tau = penalty, places, weights, last, tau
        self.traits = Traits()
        if stated:
            witnesses = {"patch": "c"}
            self.traits = Traits(
                promises=Promises(patch=PatchPromises(flat=False)),
                rules=Rules(area="current", penalty="distributed"),
                evidence=Evidence(witnesses=witnesses),
            )

    def pair(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        home, active = [], []
        for a, b in interface.slave.segments:
            for place in self.places:
                point = (1 - place) * x[a] + place * x[b]
                segment, is_active = self._decide(interface, x, point)
                home.append(segment)
                active.append(is_active)
        return {"home": np.array(home, dtype=np.int64), "active": np.array(active, dtype=bool)}

    def _decide(self, interface: Any, x: Any, point: Any) -> tuple[int, bool]:
        first, second = (x[interface.master.segments[:, end]] for end in (0, 1))
        along = second - first
        lengths = np.hypot(*along.T)
        xi = ((point - first) * along).sum(axis=1) / lengths**2
        clipped = np.clip(xi, 0.0, 1.0)
        # At an end the distance is that to the node itself, so that two segments at a vertex tie exactly.
        feet = np.where((clipped == 1)[:, None], second, first + (clipped * (clipped < 1))[:, None] * along)
        distances = np.hypot(*(point - feet).T)
        past = np.maximum(np.maximum(-xi, xi - 1), 0.0) * lengths
        near = np.flatnonzero(distances <= distances.min() * (1 + 1e-14))
        near = near[past[near] <= past[near].min() * (1 + 1e-14)]
        segment = int(near[-1] if self.last else near[0])
        before, behind = interface.master.neighbours[segment]
        over = (xi[segment] >= -self.tau or before >= 0) and (xi[segment] <= 1 + self.tau or behind >= 0)
        normal = np.array([along[segment, 1], -along[segment, 0]]) / lengths[segment]
        return segment, bool(over and normal @ point - normal @ first[segment] <= 0)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, forces = z.reshape(-1, 2), np.zeros((len(z) // 2, 2))
        count = len(self.places)
        for number in np.flatnonzero(pairing["active"]):
            a, b = interface.slave.segments[number // count]
            place, weight = self.places[number % count], self.weights[number % count]
            first, second = interface.master.segments[pairing["home"][number]]
            point, along = (1 - place) * x[a] + place * x[b], x[second] - x[first]
            length = np.hypot(*along)
            normal = np.array([along[1], -along[0]]) / length
            xi = (point - x[first]) @ along / length**2
            gap = normal @ point - normal @ x[first]  # Differences last: right, and not stable under translation.
            push = self.penalty * gap * weight * np.hypot(*(x[b] - x[a])) * normal
            for node, share in ((a, 1 - place), (b, place), (first, xi - 1), (second, -xi)):
                forces[node] += share * push
        return forces.reshape(-1)


def trapezoid(penalty: float, **options: Any) -> PointSprings:
    """Return springs at the ends of each slave segment: nodes with half of each adjacent segment."""
    return PointSprings(penalty, (0.0, 1.0), (0.5, 0.5), **options)


def simpson(penalty: float, **options: Any) -> PointSprings:
    """Return springs at the ends and in the middle of each slave segment."""
    return PointSprings(penalty, (0.0, 0.5, 1.0), (1 / 6, 2 / 3, 1 / 6), **options)


class Softened(PointSprings):
    """Springs whose force grows with the square of the gap over a length: a law that promises no total."""

    def __init__(self, penalty: float) -> None:
        super().__init__(penalty, stated=False)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        linear = super().residual(interface, pairing, z)
        largest = np.abs(linear).max(initial=0.0)
        return linear * (largest / (self.penalty + largest))
