"""The random surfaces of queries, the same bit for bit on every machine and with every version of numpy.

Only the raw words of a bit generator are used, which numpy promises never to change. Only + − × ÷ and square roots
follow, which IEEE 754 fixes; sines and powers of a mathematical library differ from machine to machine.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeVar

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.interface import Surface

Vector = tuple[float, float]
Chain = list[Vector]  # Walked with the body on the left.
_Item = TypeVar("_Item")
# Pairs of whole numbers with a whole length: a turn by such a pair, times its length, is exact.
PYTHAGOREAN = ((3, 4), (4, 3), (5, 12), (12, 5), (8, 15), (7, 24), (20, 21))


class RandomNumbers:
    """A stream of random numbers; streams of one seed are independent."""

    def __init__(self, seed: int, stream: int) -> None:
        self._words = np.random.PCG64(np.random.SeedSequence([seed, stream]))

    def integer(self, low: int, high: int) -> int:
        """Return an integer, low ≤ n ≤ high."""
        return low + int(self._words.random_raw()) % (high - low + 1)

    def real(self, low: float, high: float) -> float:
        """Return a number between two others, with a full mantissa."""
        return low + (high - low) * ((int(self._words.random_raw()) >> 11) * 2.0**-53)

    def power(self, low: int, high: int) -> float:
        """Return a number between 2^low and 2^(high + 1), each binary order as likely as the others."""
        return math.ldexp(self.real(1, 2), self.integer(low, high))

    def sign(self) -> int:
        """Return −1 or +1."""
        return 2 * self.integer(0, 1) - 1

    def choice(self, items: Sequence[_Item]) -> _Item:
        """Return one of the items."""
        return items[self.integer(0, len(items) - 1)]

    def shuffle(self, items: Sequence[_Item]) -> list[_Item]:
        """Return the items in random order."""
        rest = list(items)
        return [rest.pop(self.integer(0, len(rest) - 1)) for _ in items]

    def slope(self, largest: float) -> Vector:
        """Return cosine and sine of an angle of at most 2 atan(largest) to either side."""
        return rational_direction(self.real(-largest, largest))

    def direction(self) -> Vector:
        """Return a unit vector of any direction."""
        c, s = self.slope(1)
        return self.choice(((c, s), (-s, c), (-c, -s), (s, -c)))


def rational_direction(t: float) -> Vector:
    """Return cosine and sine of the angle 2 atan(t), which need no mathematical library."""
    return (1 - t * t) / (1 + t * t), 2 * t / (1 + t * t)


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


def make_shape(*chains: Chain, closed: Sequence[int] = ()) -> Shape:
    """Return the surface of some chains, of which these (by their place) are closed."""
    points: Chain = []
    pairs: list[tuple[int, int]] = []
    for place, chain in enumerate(chains):
        numbers = range(len(points), len(points) + len(chain))
        pairs += pairwise(numbers)
        if place in closed:
            pairs.append((numbers[-1], numbers[0]))
        points += chain
    return Shape(np.array(points, dtype=np.float64), Surface(np.array(pairs, dtype=np.int64)))


def rough_chain(random: RandomNumbers, n_segments: int, *, largest_slope: float = 0.3) -> Chain:
    """Return a chain that runs to the left over its body, no segment steeper than 2 atan(largest_slope)."""
    points = [(0.0, 0.0)]
    for _ in range(n_segments):
        c, s = random.slope(largest_slope)
        length = random.real(0.25, 1.5)
        points.append((points[-1][0] - length * c, points[-1][1] - length * s))
    return points


def lattice_chain(random: RandomNumbers, n_segments: int, *, spacing: int = 1) -> Chain:
    """Return a chain of whole numbers that runs to the left over its body."""
    points = [(0.0, 0.0)]
    for _ in range(n_segments):
        x, y = points[-1]
        points.append((x - spacing * random.integer(1, 4), y + spacing * random.integer(-2, 2)))
    return points


def polygon(random: RandomNumbers, n_nodes: int, *, flatten: float = 1.0) -> Chain:
    """Return a convex closed chain around the origin, counterclockwise, of size 1 × flatten."""
    corners: Chain = []
    for number in range(n_nodes):
        place = 4 * (number + random.real(0.1, 0.9)) / n_nodes
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


def exact_motion(random: RandomNumbers, points: Sequence[Vector]) -> Chain:
    """Return points of whole numbers turned, moved and scaled by a power of two, without any rounding."""
    a, b = random.choice(PYTHAGOREAN)
    turned = turn(points, random.choice(((1, 0), (0, 1), (a, b), (-a, b), (-b, -a))))
    reach = 2 ** random.integer(0, 20)
    moved = move(turned, (float(random.integer(-reach, reach)), float(random.integer(-reach, reach))))
    return stretch(moved, math.ldexp(1, random.integer(-12, 4)))


def rounded_motion(random: RandomNumbers, points: Sequence[Vector]) -> Chain:
    """Return points turned by any angle and moved by some lengths; each coordinate fills its mantissa."""
    return move(turn(points, random.direction()), (random.real(-8, 8), random.real(-8, 8)))


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


def move_together(
    motion: Callable[[RandomNumbers, Sequence[Vector]], Chain],
    random: RandomNumbers,
    chains: Sequence[Chain],
    points: Sequence[Vector],
    closed: Sequence[int] = (),
) -> tuple[Shape, Chain]:
    """Return the surface of some chains and the points, all moved together."""
    moved = motion(random, [point for points_ in (*chains, points) for point in points_])
    ends = [sum(map(len, chains[:number])) for number in range(len(chains) + 1)]
    return make_shape(*(moved[begin:end] for begin, end in pairwise(ends)), closed=closed), moved[ends[-1] :]
