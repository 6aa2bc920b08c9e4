"""Half passes in both directions: each body is pushed by what its own surface sees, and hands no force to the other.

After Sauer and De Lorenzis, "A computational contact formulation based on surface potentials" (2013), Section 5: both
surfaces are slaves, and each pass keeps only the forces on its own nodes. Plain loops, and a pairing that hides all
decisions in a handle.
"""

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from contactverif import ContactPoints, Handle, PatchPromises, Promises, Rules, Traits
from strangers.strips import visible_strips

PLACES = (0.5 - sqrt(3 / 20), 0.5, 0.5 + sqrt(3 / 20))
WEIGHTS = (5 / 18, 8 / 18, 5 / 18)


class Point(NamedTuple):
    """A point of a half pass: places on both segments, gap along the carrier's normal, normal, weight, position."""

    carrier: int
    opposite: int
    s: float
    t: float
    gap: float
    normal: Any  # Into the body of the carrier
    weight: float
    position: Any


class HalfPasses:
    """Springs on the strips of either surface, three Gauss points each; each surface has its own points."""

    traits = Traits(
        promises=Promises(
            patch=PatchPromises(flat=True, kinked=True, overhang=True),
            converges=True,
            unbiased=True,
            nodes_push=True,
            local=True,
            translation_stable=True,
        ),
        rules=Rules(penalty="distributed", area="current"),
    )

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def pair(self, interface: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        sides = interface.slave.segments, interface.master.segments
        return {"strips": Handle(tuple(visible_strips(*each, x) for each in (sides, sides[::-1])))}

    def _points(self, carrier: Any, opposite: Any, strips: Any, x: Any) -> list[Point]:
        points = []
        for number, other, low, high in strips.tolist():
            a, b = x[carrier[number]]
            first, second = x[opposite[other]]
            along = b - a
            square = float(along @ along)
            start = 0.0 if low < 0 else float((x[low] - a) @ along) / square
            end = 1.0 if high < 0 else float((x[high] - a) @ along) / square
            size = sqrt(square)
            normal = np.array([-along[1], along[0]]) / size
            from_first, run = first - a, second - first
            for place, weight in zip(PLACES, WEIGHTS, strict=True):
                s = start + place * (end - start)
                t = (s * square - float(from_first @ along)) / float(run @ along)
                gap = -float((from_first + t * run) @ normal)
                position = (1 - s) * a + s * b
                points.append(Point(number, other, s, t, gap, normal, weight * (end - start) * size, position))
        return points

    def _passes(self, interface: Any, pairing: Any, x: Any) -> Any:
        sides = interface.slave.segments, interface.master.segments
        for carrier, opposite, strips in zip(sides, sides[::-1], pairing.handle, strict=True):
            yield carrier, self._points(carrier, opposite, strips, x)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        forces = np.zeros_like(x)
        for carrier, points in self._passes(interface, pairing, x):
            for point in points:
                if point.gap < 0:
                    first, second = carrier[point.carrier]
                    pull = self.penalty * point.gap * point.weight * point.normal
                    forces[first] += (1 - point.s) * pull
                    forces[second] += point.s * pull
        return forces.reshape(-1)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> ContactPoints:
        rows = [
            (point, number == 1)
            for number, (_, points) in enumerate(self._passes(interface, pairing, z.reshape(-1, 2)))
            for point in points
        ]
        points = [point for point, _ in rows]
        gap, unknown = np.array([point.gap for point in points]), np.full(len(points), np.nan)
        return ContactPoints(
            slave_segment=np.array([point.carrier for point in points], np.int64),
            c=2 * np.array([point.s for point in points]) - 1,
            master_segment=np.array([point.opposite for point in points], np.int64),
            xi=np.array([point.t for point in points]),
            position=np.array([point.position for point in points]).reshape(-1, 2),
            normal=np.array([point.normal for point in points]).reshape(-1, 2),
            gap=gap,
            pressure=np.where(gap < 0, -self.penalty * gap, 0.0),
            weight=np.array([point.weight for point in points]),
            active=gap < 0,
            area_from=unknown,
            area_to=unknown,
            on_master=np.array([is_second for _, is_second in rows], bool),
        )
