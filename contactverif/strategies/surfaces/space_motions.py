"""Rigid motions of space after a scaling, x → 2^k (Q x + shift), whose rotation is rational before it is rounded."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import ldexp

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.problems.flat_faces import rotation


@dataclass(frozen=True, slots=True)
class SpaceMotion:
    """A rigid motion after a scaling. The rotation is that of a quaternion of integers."""

    quaternion: tuple[int, int, int, int] = (1, 0, 0, 0)
    shift: tuple[int, int, int] = (0, 0, 0)  # In units of the lattice.
    exponent: int = 0

    @property
    def scale(self) -> float:
        """The factor 2^k of all lengths."""
        return ldexp(1.0, self.exponent)

    @property
    def matrix(self) -> FloatArray:
        """The rotation Q (3, 3), each entry a rational rounded once."""
        rows, size = rotation(self.quaternion)
        return np.array(rows) / size

    @property
    def normal(self) -> FloatArray:
        """The unit vector (3,) that the z-axis becomes."""
        return self.matrix[:, 2].copy()

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the points (n, 3), moved; each coordinate is rounded once, from extended precision."""
        rows, size = rotation(self.quaternion)
        turned = points.astype(np.longdouble) @ np.array(rows, dtype=np.longdouble).T
        moved = turned / np.longdouble(size) + np.array(self.shift, dtype=np.longdouble)
        return (moved * self.scale).astype(np.float64)


REST = SpaceMotion()


@cache
def space_motions(*, furthest: int = 64, exponents: int = 20) -> SearchStrategy[SpaceMotion]:
    """Return rest or any rigid motion, with translations up to `furthest` and scales 2^±`exponents`."""
    part, place = st.integers(-4, 4), st.integers(-furthest, furthest)
    quaternion = st.tuples(st.integers(1, 5), part, part, part)
    exponent = st.one_of(st.just(0), st.integers(-exponents, exponents))
    return st.one_of(st.just(REST), st.builds(SpaceMotion, quaternion, st.tuples(place, place, place), exponent))
