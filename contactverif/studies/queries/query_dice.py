"""Random numbers that are the same bit for bit on every machine and with every version of numpy.

Rules for the next editor: only the raw words of a bit generator are used. Numpy promises that they never change, and
does not promise it of its distributions. Only + − × ÷ and square roots follow, which IEEE 754 fixes; sines and powers
of a mathematical library differ from machine to machine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeVar

import numpy as np

Vector = tuple[float, float]
_Item = TypeVar("_Item")


class Dice:
    """A stream of random numbers."""

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
