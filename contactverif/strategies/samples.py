"""The small samples that all cases are made of: lengths, depths of penetration, rigid motions, penalties, seeds.

Lengths are small integers × 2^k, so that coordinates are exact in binary. Each strategy shrinks to the simplest thing:
length 1, a quarter of a segment of penetration, no motion, scale 1. Strategies are cached because hypothesis validates
each new one anew, which takes longer than drawing from it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache, wraps
from itertools import accumulate, cycle, islice
from math import ldexp

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface

SEVENTHS = st.integers(0, 6)
# Numerators of offsets from the lattice, dealt out in turn and never 0: over 7 along the slave, over 11 across it,
# over 13 for the master. All are coprime to the powers of two, and to each other, so that none undoes another.
OFFSETS = st.lists(st.integers(1, 6), min_size=1, max_size=7)
_QUARTER_TURNS = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}  # exact (cos, sin)


def on_own_meshes(draw_case: Callable[[DrawFn], Case]) -> Callable[..., SearchStrategy[Case] | None]:
    """Return the cases of a function that draws one on a mesh of its own; there are none on a mesh of the user."""
    cases = st.composite(draw_case)

    @wraps(draw_case)
    def make(interface: Interface | None = None) -> SearchStrategy[Case] | None:
        return cases() if interface is None else None

    return make


@cache
def lengths(*, most: int = 6, graded: bool = True) -> SearchStrategy[list[float]]:
    """Return lengths of 1 to `most` consecutive segments: 1 to 8.

    One list in five has neighbours' ratios up to 7 × 2^20.
    """
    if most < 1:
        raise MisuseError("most", f"{most}", "at least one segment")
    plain = st.lists(st.integers(1, 8).map(float), min_size=1, max_size=most)
    if not graded:
        return plain
    wide = st.lists(st.builds(ldexp, st.integers(1, 7).map(float), st.integers(-10, 10)), min_size=1, max_size=most)
    return st.one_of(plain, plain, plain, plain, wide)


@cache
def depths(*, lowest: int = 1, most: int = 4) -> SearchStrategy[list[int]]:
    """Return penetrations in quarters of some unit, to be dealt out in turn to the nodes.

    A negative penetration is an opening.
    """
    return st.lists(st.integers(lowest, 8), min_size=1, max_size=most)


@cache
def depth_units(*, finest: int = 8) -> SearchStrategy[float]:
    """Return 2^-e, e = 0 … `finest`: the factor of the depths, besides the shortest segment."""
    return st.integers(0, finest).map(lambda e: 2.0**-e)


@cache
def penalties() -> SearchStrategy[float]:
    """Return penalties, distributed stiffnesses: a small integer × 2^k."""
    return st.builds(ldexp, st.integers(1, 8).map(float), st.integers(-8, 24))


@cache
def seeds() -> SearchStrategy[int]:
    """Return seeds of what a property draws at random for a case."""
    return st.integers(0, 2**16)


@dataclass(frozen=True, slots=True)
class Motion:
    """A rigid motion after a scaling: x → 2^k (Q x + shift)."""

    degrees: int = 0  # The angle of the rotation Q, counter-clockwise; quarter turns are exact.
    shift: tuple[int, int] = (0, 0)  # In units of the lattice.
    exponent: int = 0

    @property
    def scale(self) -> float:
        """The factor 2^k of all lengths."""
        return ldexp(1.0, self.exponent)

    @property
    def cos_sin(self) -> tuple[np.longdouble, np.longdouble]:
        """Cosine and sine of the angle, in extended precision if the machine has it."""
        if self.degrees in _QUARTER_TURNS:
            cos, sin = _QUARTER_TURNS[self.degrees]
            return np.longdouble(cos), np.longdouble(sin)
        angle = np.longdouble(self.degrees) * np.arccos(np.longdouble(-1)) / 180
        return np.cos(angle), np.sin(angle)

    @property
    def direction(self) -> FloatArray:
        """The unit vector (2,) that the lattice's x-axis becomes."""
        return np.array(self.cos_sin, dtype=np.float64)

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the points (n, 2), moved; each coordinate is rounded once, from extended precision."""
        cos, sin = self.cos_sin
        x, y = points.astype(np.longdouble).T
        moved = np.column_stack([cos * x - sin * y + self.shift[0], sin * x + cos * y + self.shift[1]])
        return (moved * self.scale).astype(np.float64)


REST = Motion()


@cache
def motions(*, exact: bool = False, furthest: int = 64, exponents: int = 20) -> SearchStrategy[Motion]:
    """Return rest or any rigid motion; only quarter turns if `exact`.

    Translations up to `furthest`, scales 2^±`exponents`.
    """
    degrees = st.sampled_from([0, 90, 180, 270]) if exact else st.integers(0, 359)
    place = st.integers(-furthest, furthest)
    exponent = st.one_of(st.just(0), st.integers(-exponents, exponents))
    return st.one_of(st.just(REST), st.builds(Motion, degrees, st.tuples(place, place), exponent))


def shifts(offsets: Sequence[int], count: int) -> FloatArray:
    """Return shifts (count, 2) of slave nodes, along and across, of 0 to 1/16."""
    return repeat_cyclically(offsets, 2 * count).reshape(-1, 2) / [7.0, 11.0] / 16


def repeat_cyclically(values: Sequence[float], count: int) -> FloatArray:
    """Return `count` floats, the values in turn."""
    return np.array([*islice(cycle(values), count)], dtype=np.float64)


def ends_of(lengths: Iterable[float]) -> FloatArray:
    """Return 0 and the places (n + 1,) where segments of these lengths end, one behind the other."""
    return np.array([*accumulate(lengths, initial=0.0)])


@cache
def shuffles() -> SearchStrategy[int]:
    """Return shuffles: every other mesh is numbered in walking order, 0; the others at random."""
    return st.one_of(st.just(0), st.integers(0, 255))


def draw_others(draw: DrawFn) -> tuple[Motion, float, int, int]:
    """Draw what a case needs besides its meshes: the motion, the penalty, the seed, and the shuffle of the numbers."""
    return draw(motions()), draw(penalties()), draw(seeds()), draw(shuffles())
