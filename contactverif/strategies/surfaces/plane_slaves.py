"""A plane slave in space that penetrates a larger flat master with all of itself: tilted, so that its gap is linear.

Everything stands on a lattice of 2^-23, and the turns are matrices of integers, so that no coordinate is rounded: a
plane stays a plane, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from math import ldexp

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.strategies.parts import on_own_meshes, penalties, seeds
from contactverif.strategies.surfaces.surface_pairs import surface_pairs

# The slopes of a slave. Seen along its own normal, all of it then lies over the master, whatever the turn of that.
_SLOPES = st.sampled_from([0.0, 0.125, -0.125, 0.25, -0.25])
_QUARTERS = st.integers(1, 4)  # The least depth, in sixteenths of the square.
_PARTS = st.integers(-2, 2)
# Heights of the lower side of a plate that is 1 thick. No depth reaches 1, so the master stays the nearest surface.
_HEIGHTS = st.sampled_from([-3.0, 1.0, -5.0, 3.0])


@dataclass(frozen=True, slots=True)
class ExactSpaceTurn:
    """A similarity x → 2^k (W x + shift) with a turn W of integers, so that lattice points are not rounded."""

    quaternion: tuple[int, int, int, int] = (1, 0, 0, 0)
    shift: tuple[int, int, int] = (0, 0, 0)
    exponent: int = 0

    @property
    def scale(self) -> float:
        """The factor of all lengths, an integer × 2^k."""
        return ldexp(float(sum(part * part for part in self.quaternion)), self.exponent)

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the points (n, 3), moved."""
        a, b, c, d = self.quaternion
        turn = np.array(
            [
                [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
                [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
                [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
            ],
            dtype=np.float64,
        )
        return np.ldexp(points @ turn.T + self.shift, self.exponent)


@cache
def exact_space_turns() -> SearchStrategy[ExactSpaceTurn]:
    """Return rest, or exact similarities with offsets up to 2^16 and scales 2^±20."""
    place = st.one_of(st.integers(-64, 64), st.integers(-(2**16), 2**16))
    exponent = st.one_of(st.just(0), st.integers(-20, 20))
    quaternion = st.tuples(st.integers(1, 3), _PARTS, _PARTS, _PARTS)
    turns = st.builds(ExactSpaceTurn, quaternion, st.tuples(place, place, place), exponent)
    return st.one_of(st.just(ExactSpaceTurn()), turns, turns)


@random_source("contactverif.strategies.surfaces.plane_slaves.tilted_plane_cases")
@on_own_meshes
def tilted_plane_cases(draw: DrawFn) -> Case:
    """Return states of a plane slave that is tilted by up to 19° against a flat master, and wholly in contact."""
    return _tilted_plane(draw)[0]


@on_own_meshes
def plane_cases_by_a_plate(draw: DrawFn) -> Case:
    """Return states as `tilted_plane_cases` does, with a place for a plate behind the master or at the slave's back.

    The parameter "behind" (8, 3) holds its corners, those of the lower side first, counter-clockwise from above.
    """
    case, turn = _tilted_plane(draw)
    low = draw(_HEIGHTS)
    square = np.array([[-1.0, -1], [2, -1], [2, 2], [-1, 2]])
    plate = np.column_stack([np.vstack([square, square]), np.repeat([low, low + 1], 4)])
    return replace(case, parameters={"behind": turn(plate)})


def _tilted_plane(draw: DrawFn) -> tuple[Case, ExactSpaceTurn]:
    """Return a case, and the similarity that took it where it is."""
    pair = draw(surface_pairs(same_domain=False, stretched=False, most=4))
    slopes, quarters = (draw(_SLOPES), draw(_SLOPES)), draw(_QUARTERS)
    turn, penalty, seed = draw(exact_space_turns()), draw(penalties()), draw(seeds())
    interface, plane, domain = pair.lay_out()
    n_slave, current = interface.n_slave_nodes, interface.nodes.copy()
    depth = (abs(slopes[0]) + abs(slopes[1])) / 2 + quarters / 16
    current[:n_slave, 2] = (plane[:n_slave] - domain.mean(axis=0)) @ slopes - depth
    reference = interface.at(interface.nodes * turn.scale)
    return Case(reference, turn(current).reshape(-1), penalty, {}, seed), turn
