"""The pieces of all cases: lengths, depths of penetration, rigid motions, penalties, seeds, and chains of points.

Lengths are small integers × 2^k, so that coordinates are exact in binary. Each strategy shrinks to the simplest thing:
length 1, a quarter of a segment of penetration, no motion, scale 1. Strategies are cached because hypothesis validates
each new one anew, which takes longer than drawing from it.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache, wraps
from itertools import accumulate, cycle, islice, pairwise
from math import ceil, hypot, ldexp, log2
from typing import TypeVar

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface, Surface

_Item = TypeVar("_Item")

PENALTIES = st.builds(ldexp, st.integers(1, 8).map(float), st.integers(-8, 24))  # A small integer × 2^k.
SEEDS = st.integers(0, 2**16)  # The seed of what a property draws at random for a case.
SHUFFLES = st.one_of(st.just(0), st.integers(0, 255))  # Every other mesh is numbered in walking order, 0.
SEVENTHS = st.integers(0, 6)
# Numerators of offsets from the lattice, dealt out in turn and never 0: over 7 along the slave, over 11 across it,
# over 13 for the master. All are coprime to the powers of two, and to each other, so that none undoes another.
OFFSETS = st.lists(st.integers(1, 6), min_size=1, max_size=7)
_QUARTER_TURNS = {0: (1, 0), 90: (0, 1), 180: (-1, 0), 270: (0, -1)}  # exact (cos, sin)
FURTHEST = 2**20  # The largest offset of an exact turn, in units of the lattice.
_EXACT_TURNS = [(1, 0), (0, 1), (-1, 0), (0, -1), (3, 4), (-4, 3), (-5, -12), (12, -5), (8, 15)]


def on_own_meshes(draw_case: Callable[..., Case]) -> Callable[..., SearchStrategy[Case] | None]:
    """Return the cases of a function that draws one on a mesh of its own; there are none on a mesh of the user.

    A function that draws in space takes the numbers of corners that a face may have, too.
    """
    cases = st.composite(draw_case)

    @wraps(draw_case)
    def make(interface: Interface | None = None, *faces: tuple[int, ...]) -> SearchStrategy[Case] | None:
        return cases(*faces) if interface is None else None

    return make


@cache
def lengths(*, graded: bool = True) -> SearchStrategy[list[float]]:
    """Return lengths of 1 to 6 consecutive segments: 1 to 8.

    If they are graded, one list in five has neighbours' ratios up to 7 × 2^20.
    """
    plain = st.lists(st.integers(1, 8).map(float), min_size=1, max_size=6)
    if not graded:
        return plain
    wide = st.lists(st.builds(ldexp, st.integers(1, 7).map(float), st.integers(-10, 10)), min_size=1, max_size=6)
    return st.one_of(plain, plain, plain, plain, wide)


@cache
def depths(*, lowest: int = 1) -> SearchStrategy[list[int]]:
    """Return penetrations in quarters of some unit, to be dealt out in turn to the nodes; below 0 are openings."""
    return st.lists(st.integers(lowest, 8), min_size=1, max_size=4)


@cache
def depth_units(*, finest: int = 8) -> SearchStrategy[float]:
    """Return 2^-e, e = 0 … `finest`: the factor of the depths, besides the shortest segment."""
    return st.integers(0, finest).map(lambda e: 2.0**-e)


def one_or_two(panels: SearchStrategy[_Item]) -> SearchStrategy[list[_Item]]:
    """Return lists of one or two."""
    return st.one_of(st.lists(panels, min_size=1, max_size=1), st.lists(panels, min_size=1, max_size=2))


@dataclass(frozen=True, slots=True)
class Motion:
    """A similarity x → 2^k (Q x + shift), in 2-D.

    Q is a rotation. Or it is a Pythagorean matrix of integers [[a, −b], [b, a]], which stretches too: it rounds no
    point of a lattice.
    """

    degrees: int = 0  # The angle of the rotation, counter-clockwise; quarter turns are exact.
    shift: tuple[int, int] = (0, 0)  # In units of the lattice.
    exponent: int = 0
    legs: tuple[int, int] | None = None  # (a, b), in place of the angle.

    @property
    def scale(self) -> float:
        """The factor of all lengths: 2^k, or an integer × 2^k."""
        return ldexp(hypot(*self.legs) if self.legs else 1.0, self.exponent)

    @property
    def column(self) -> tuple[np.longdouble, np.longdouble]:
        """The first column of Q, in extended precision if the machine has it."""
        if exact := self.legs or _QUARTER_TURNS.get(self.degrees):
            return np.longdouble(exact[0]), np.longdouble(exact[1])
        angle = np.longdouble(self.degrees) * np.arccos(np.longdouble(-1)) / 180
        return np.cos(angle), np.sin(angle)

    @property
    def direction(self) -> FloatArray:
        """The vector (2,) that the unit vector along the lattice's x-axis becomes before the scaling."""
        return np.array(self.column, dtype=np.float64)

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the points (n, 2), moved; each coordinate is rounded once, from extended precision.

        A matrix of integers needs none: off its lattice each operation is rounded.
        """
        real = np.float64 if self.legs else np.longdouble
        cos, sin = map(real, self.column)
        x, y = points.astype(real).T
        moved = np.column_stack([cos * x - sin * y + self.shift[0], sin * x + cos * y + self.shift[1]])
        return (moved * ldexp(1.0, self.exponent)).astype(np.float64)


@cache
def motions(*, exact: bool = False, furthest: int = 64) -> SearchStrategy[Motion]:
    """Return rest or any rigid motion, only quarter turns if `exact`; translations up to `furthest`, scales 2^±20."""
    degrees = st.sampled_from([0, 90, 180, 270]) if exact else st.integers(0, 359)
    place = st.integers(-furthest, furthest)
    exponent = st.one_of(st.just(0), st.integers(-20, 20))
    return st.one_of(st.just(Motion()), st.builds(Motion, degrees, st.tuples(place, place), exponent))


@cache
def exact_turns() -> SearchStrategy[Motion]:
    """Return rest, or Pythagorean similarities with offsets up to 2^20."""
    place = st.one_of(st.integers(-64, 64), st.integers(-FURTHEST + 2**12, FURTHEST - 2**12))
    exponent = st.one_of(st.just(0), st.integers(-20, 20))

    def turn(legs: tuple[int, int], shift: tuple[int, int], exponent: int) -> Motion:
        return Motion(0, shift, exponent, legs)

    turns = st.builds(turn, st.sampled_from(_EXACT_TURNS), st.tuples(place, place), exponent)
    return st.one_of(st.just(Motion()), turns, turns)


def shifts(offsets: Sequence[int], count: int) -> FloatArray:
    """Return shifts (count, 2) of slave nodes, along and across, of 0 to 1/16."""
    return repeat_cyclically(offsets, 2 * count).reshape(-1, 2) / [7.0, 11.0] / 16


def repeat_cyclically(values: Sequence[float], count: int) -> FloatArray:
    """Return `count` floats, the values in turn."""
    return np.array([*islice(cycle(values), count)], dtype=np.float64)


def ends_of(lengths: Iterable[float]) -> FloatArray:
    """Return 0 and the places (n + 1,) where segments of these lengths end, one behind the other."""
    return np.array([*accumulate(lengths, initial=0.0)])


def draw_others(draw: DrawFn) -> tuple[Motion, float, int, int]:
    """Draw what a case needs besides its meshes: the motion, the penalty, the seed, and the shuffle of the numbers."""
    return draw(motions()), draw(PENALTIES), draw(SEEDS), draw(SHUFFLES)


@dataclass(frozen=True, slots=True)
class Chain:
    """Points that segments join one after the other."""

    points: FloatArray  # (n, 2) The points in walking order, the body on the left.
    closed: bool = False  # The last point is joined to the first.


@dataclass(frozen=True, slots=True)
class Panel:
    """One slave chain and one master chain, at rest on the lattice."""

    # (n, 2) Current positions in walking order, the body on the left: in +x and in −x if they are open and the slave
    # is on top.
    slave: FloatArray
    master: FloatArray
    reference: FloatArray  # (n, 2) Reference positions of the slave; the master is where it was.
    closed: bool = False  # Each chain's last point is joined to its first.


def on_lattice(values: FloatArray, bits: int = 20) -> FloatArray:
    """Return the nearest multiples of 2^-bits."""
    return np.round(values * 2.0**bits) * 2.0**-bits


def shortest(points: FloatArray) -> float:
    """Return the length of the shortest of the segments between consecutive points (n, 2)."""
    return float(np.hypot(*(points[1:] - points[:-1]).T).min())


def assemble_panels(
    panels: Sequence[Panel], motion: Motion, shuffle: int = 0
) -> tuple[Interface, FloatArray, FloatArray]:
    """Assemble panels in a row, far apart: the interface, scaled; its state z, scaled and moved; and x before that.

    The shuffle 0 numbers nodes and segments as one walks along them; any other number is a shuffle of its own.
    """
    offsets, reached = [np.zeros(2)], 0.0  # Panels are apart by four widths or more, powers of two.
    for before, panel in pairwise(panels):
        width = max(np.ptp(np.vstack([side.slave, side.master])[:, 0]) for side in (before, panel))
        reached += 8 * 2.0 ** ceil(log2(width))
        offsets.append(np.array([reached, 0.0]))
    slaves, masters, references = (
        [Chain(getattr(panel, side) + offset, panel.closed) for panel, offset in zip(panels, offsets, strict=True)]
        for side in ("slave", "master", "reference")
    )
    interface, order = assemble_chains(slaves, masters, references, motion.scale, shuffle)
    current = np.vstack([chain.points for chain in (*slaves, *masters)])[order]
    return interface, motion(current).reshape(-1), current[:, 0] * motion.scale


def assemble_chains(
    slaves: Sequence[Chain], masters: Sequence[Chain], references: Sequence[Chain], scale: float, shuffle: int = 0
) -> tuple[Interface, IntArray]:
    """Return the scaled interface of these chains, and the place (n_nodes,) of each node on the walk along them.

    The walk goes along the slave's chains, then the master's. The master is where it was.
    """
    n_slave, n_master = (sum(len(chain.points) for chain in side) for side in (slaves, masters))
    slave, master = _segments(slaves, 0), _segments(masters, n_slave)
    order: IntArray = np.arange(n_slave + n_master)
    if shuffle:
        random = np.random.default_rng(shuffle)
        order = np.concatenate([random.permutation(n_slave), n_slave + random.permutation(n_master)])
        number = np.argsort(order)  # the number of each node on the walk
        slave, master = (random.permutation(number[side]) for side in (slave, master))
    nodes = np.vstack([chain.points for chain in (*references, *masters)])[order]
    return Interface(nodes * scale, Surface(slave), Surface(master)), order


def _segments(chains: Sequence[Chain], start: int) -> IntArray:
    """Return the segments (n, 2) of chains whose nodes are numbered on the walk, from `start`."""
    segments: list[tuple[int, int]] = []
    for chain in chains:
        numbers = [*range(start, start + len(chain.points))]
        segments += pairwise([*numbers, start] if chain.closed else numbers)
        start += len(numbers)
    return np.array(segments)
