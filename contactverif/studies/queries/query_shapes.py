"""The surfaces of queries: chains of random or whole numbers, turned and moved.

A chain is walked with the body on its left. Points are pairs of floats; all arithmetic is that of `query_dice`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.interface import Surface
from contactverif.studies.queries.query_dice import Dice, Vector, rational_direction

# Pairs of whole numbers with a whole length: a turn by such a pair, times its length, is exact.
PYTHAGOREAN = ((3, 4), (4, 3), (5, 12), (12, 5), (8, 15), (7, 24), (20, 21))
Chain = list[Vector]


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """A surface with positions, to which queries are put."""

    nodes: FloatArray  # (n_nodes, 2) The positions.
    surface: Surface

    @property
    def segments(self) -> IntArray:
        """The numbers of the nodes of each segment, shape (n_segments, 2)."""
        return self.surface.segments

    def ends(self, segment: int) -> tuple[Vector, Vector]:
        """Return the positions of the two nodes of a segment."""
        first, second = self.nodes[self.segments[segment]].tolist()
        return (first[0], first[1]), (second[0], second[1])


def make_shape(*chains: Chain, closed: Sequence[int] = (), order: Sequence[int] | None = None) -> Shape:
    """Return the surface of some chains, with the segments numbered in this order (by default that of the walk)."""
    points: Chain = []
    pairs: list[tuple[int, int]] = []
    for place, chain in enumerate(chains):
        numbers = range(len(points), len(points) + len(chain))
        pairs += pairwise(numbers)
        if place in closed:
            pairs.append((numbers[-1], numbers[0]))
        points += chain
    listed = pairs if order is None else [pairs[number] for number in order]
    return Shape(np.array(points, dtype=np.float64), Surface(np.array(listed, dtype=np.int64)))


def rough_chain(dice: Dice, n_segments: int, *, largest_slope: float = 0.3) -> Chain:
    """Return a chain that runs to the left over its body, no segment steeper than 2 atan(largest_slope)."""
    points = [(0.0, 0.0)]
    for _ in range(n_segments):
        c, s = dice.slope(largest_slope)
        length = dice.real(0.25, 1.5)
        points.append((points[-1][0] - length * c, points[-1][1] - length * s))
    return points


def lattice_chain(dice: Dice, n_segments: int, *, spacing: int = 1) -> Chain:
    """Return a chain of whole numbers that runs to the left over its body."""
    points = [(0.0, 0.0)]
    for _ in range(n_segments):
        x, y = points[-1]
        points.append((x - spacing * dice.integer(1, 4), y + spacing * dice.integer(-2, 2)))
    return points


def polygon(dice: Dice, n_nodes: int, *, flatten: float = 1.0) -> Chain:
    """Return a convex closed chain around the origin, counterclockwise, of size 1 × flatten."""
    corners: Chain = []
    for number in range(n_nodes):
        place = 4 * (number + dice.real(0.1, 0.9)) / n_nodes
        quarter = int(place)
        c, s = rational_direction(place - quarter)  # A quarter of the circle is t = 0 … 1.
        c, s = ((c, s), (-s, c), (-c, -s), (s, -c))[quarter]
        corners.append((c, flatten * s))
    return corners


def turn(points: Sequence[Vector], by: Vector) -> Chain:
    """Return the points turned by the direction of a vector and stretched by its length."""
    return [(x * by[0] - y * by[1], x * by[1] + y * by[0]) for x, y in points]


def move(points: Sequence[Vector], by: Vector) -> Chain:
    """Return the points moved by a vector."""
    return [(x + by[0], y + by[1]) for x, y in points]


def stretch(points: Sequence[Vector], by: float) -> Chain:
    """Return the points with both coordinates multiplied by a number."""
    return [(x * by, y * by) for x, y in points]


def exact_motion(dice: Dice, points: Sequence[Vector]) -> Chain:
    """Return points of whole numbers turned, moved and scaled by a power of two, without any rounding."""
    a, b = dice.choice(PYTHAGOREAN)
    turned = turn(points, dice.choice(((1, 0), (0, 1), (a, b), (-a, b), (-b, -a))))
    reach = 2 ** dice.integer(0, 20)
    moved = move(turned, (float(dice.integer(-reach, reach)), float(dice.integer(-reach, reach))))
    return stretch(moved, math.ldexp(1, dice.integer(-12, 4)))


def rounded_motion(dice: Dice, points: Sequence[Vector]) -> Chain:
    """Return points turned by any angle and moved by some lengths; each coordinate fills its mantissa."""
    return move(turn(points, dice.direction()), (dice.real(-8, 8), dice.real(-8, 8)))


def frame(first: Vector, second: Vector) -> tuple[float, Vector, Vector]:
    """Return length, tangent and outward normal of a segment."""
    dx, dy = second[0] - first[0], second[1] - first[1]
    length = math.sqrt(dx * dx + dy * dy)
    t = (dx / length, dy / length)
    return length, t, (t[1], -t[0])


def add(point: Vector, *terms: tuple[float, Vector]) -> Vector:
    """Return a point plus some multiples of vectors."""
    x, y = point
    for factor, vector in terms:
        x, y = x + factor * vector[0], y + factor * vector[1]
    return x, y
