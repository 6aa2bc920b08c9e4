"""Sketches: a few segments drawn by hand, with one slave point that projects onto the master in a certain way.

A sketch stands on a lattice so coarse that `ExactTurn` moves it without rounding, even to an
offset of 2^20. Coordinates are below 2^8 and multiples of 2^-32, so what a sketch shows exactly (a tie, a hit node)
stays exact. Only a sketch whose kind survives rounding may set `exact` to False.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import hypot, ldexp

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.strategies.panels import Chain, assemble_chains
from contactverif.strategies.parts import Motion, motions, penalties, seeds, shuffles

FURTHEST = 2**20  # The largest offset, in units of the lattice.
NODES_AND_OTHERS = (-1.0, 1.0, -0.5, 0.5, 0.0, -1.0, 1.0)  # Places c; every other one is a node.
ROUND_PLACES = (*NODES_AND_OTHERS, -(3**-0.5), 3**-0.5, 0.75)  # Gauss points too, which are not on the lattice.
TILTS = st.sampled_from([0.0, 0.125, -0.125, 0.375, -0.375, 1.0, -1.0])  # The slope of a slave segment.
_SIZES = st.integers(1, 28), st.sampled_from([1.0, 0.75])  # The draws e and part of a gap 2^-e × part.
_TURNS = [(1, 0), (0, 1), (-1, 0), (0, -1), (3, 4), (-4, 3), (-5, -12), (12, -5), (8, 15)]
_STRETCHES = st.sampled_from([1.0, 2.0, 0.5, 0.75])  # The slave's reference over its present length.
_COUNTS = st.integers(0, 2)
# Whether a second pair of chains is in contact. Hypothesis draws the simplest value more often than others, so two
# draws decide.
_COMPANY = st.tuples(*[st.sampled_from([False, True, True, True])] * 2).map(any)
_LENGTHS = st.sampled_from([1.0, 2.0, 0.5, 0.25, 4.0])


@dataclass(frozen=True, slots=True)
class ExactTurn:
    """A similarity x → 2^k (W x + shift), whose turn W is a Pythagorean one, so that lattice points are not rounded."""

    turn: tuple[int, int] = (1, 0)  # The first column of W = [[a, −b], [b, a]]; a² + b² is a square.
    shift: tuple[int, int] = (0, 0)  # In units of the lattice.
    exponent: int = 0

    @property
    def scale(self) -> float:
        """The factor of all lengths, an integer × 2^k."""
        return ldexp(hypot(*self.turn), self.exponent)

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the points (n, 2), moved."""
        (a, b), (x, y) = self.turn, points.T
        moved: FloatArray = np.column_stack([a * x - b * y, b * x + a * y]) + self.shift
        return np.ldexp(moved, self.exponent)


@cache
def exact_turns() -> SearchStrategy[ExactTurn | Motion]:
    """Return rest, or exact similarities with offsets up to 2^20."""
    place = st.one_of(st.integers(-64, 64), st.integers(-FURTHEST + 2**12, FURTHEST - 2**12))
    exponent = st.one_of(st.just(0), st.integers(-20, 20))
    turns = st.builds(ExactTurn, st.sampled_from(_TURNS), st.tuples(place, place), exponent)
    return st.one_of(st.just(ExactTurn()), turns, turns)


@cache
def _any_motions() -> SearchStrategy[ExactTurn | Motion]:
    return st.one_of(exact_turns(), motions(), motions(furthest=FURTHEST))


@dataclass(frozen=True, slots=True)
class Sketch:
    """Slave and master chains, and the slave point that they are about."""

    kind: str  # The kind of projection.
    # The master's chains, the body on the left: a master on the x-axis runs in −x, a slave above it in +x.
    masters: Sequence[Chain]
    slave: Chain
    segment: int  # The number of the slave segment that carries the point, on the walk.
    c: float  # The place of the point on its segment, from −1 to 1.
    exact: bool = False  # Rounding would spoil the kind.
    ordered: bool = False  # The numbers of nodes on the walk matter.
    mirrored: bool = True  # The mirror image is of the same kind.

    def mirror(self) -> Sketch:
        """Return the mirror image in the y-axis, every chain walked the other way."""
        n_segments = len(self.slave.points) - (not self.slave.closed)
        # A closed chain keeps its joint between the last node and the first.
        segment = n_segments - 1 if self.slave.closed else n_segments - 1 - self.segment
        masters = [_mirror(chain) for chain in self.masters]
        return replace(self, masters=masters, slave=_mirror(self.slave), segment=segment, c=-self.c)


def _mirror(chain: Chain) -> Chain:
    return replace(chain, points=chain.points[::-1] * [-1, 1] + 0.0)


@st.composite
def sketch_cases(draw: DrawFn, sketches: SearchStrategy[Sketch]) -> Case:
    """Draw a sketch and put it somewhere; parameters "probe_segment" and "probe_c" name the point that it is about.

    Many kinds are open, edge-on or past an end. So most cases have company: beside the sketch stands a slave segment in
    contact with a master segment.
    """
    sketch = draw(sketches)
    if sketch.mirrored and draw(st.booleans()):
        sketch = sketch.mirror()
    motion = draw(exact_turns() if sketch.exact else _any_motions())
    penalty, seed = draw(penalties()), draw(seeds())
    stretch, shuffle = draw(_STRETCHES), 0 if sketch.ordered else draw(shuffles())
    reference = replace(sketch.slave, points=sketch.slave.points * stretch)
    slaves, masters, references = [sketch.slave], list(sketch.masters), [reference]
    if draw(_COMPANY):  # Drawn last, so that it goes first.
        slave, master = _company(np.vstack([chain.points for chain in (*slaves, *masters)]))
        slaves, masters, references = [*slaves, slave], [*masters, master], [*references, slave]
    interface, order = assemble_chains(slaves, masters, references, motion.scale, shuffle)
    current = np.vstack([chain.points for chain in (*slaves, *masters)])[order]
    first = int(np.flatnonzero(order == sketch.segment)[0])
    (segment,) = np.flatnonzero(interface.slave.segments[:, 0] == first)
    parameters = {"probe_segment": np.array(float(segment)), "probe_c": np.array(sketch.c)}
    return Case(interface, motion(current).reshape(-1), penalty, parameters, seed, kind=sketch.kind)


def _company(points: FloatArray) -> tuple[Chain, Chain]:
    """Return a slave segment that penetrates a master segment, to the right of a sketch's points (n, 2).

    They are upside down: the slave is below and runs in −x, the master above in +x. So no slave of a sketch, which runs
    in +x, faces that master, and none is near it.
    """
    low, high = np.floor(points.min(axis=0)), np.ceil(points.max(axis=0))
    x, y = high[0] + (high - low).max(), low[1]
    master = Chain(np.array([[x, y], [x + 2.0, y]]))
    return Chain(np.array([[x + 1.5, y + 0.125], [x + 0.5, y + 0.125]])), master


@cache
def gaps() -> SearchStrategy[float]:
    """Return gaps in units of a segment: 1e-9 to 1/2, half of them in penetration, some exactly zero."""
    return st.builds(_gap, *_SIZES, st.sampled_from([-1, 1, -1, 1, -1, 0]))


@cache
def nonzero_gaps() -> SearchStrategy[float]:
    """Return gaps as `gaps` does, without zero."""
    return st.builds(_gap, *_SIZES, st.sampled_from([-1, 1]))


def _gap(exponent: int, part: float, sign: int) -> float:
    # All gaps take as many draws, or hypothesis would count zero as the simplest one.
    return ldexp(sign * part, -exponent)


def upper_side(left_to_right: Sequence[tuple[float, float]]) -> Chain:
    """Return the chain of a body below these points, which go from left to right."""
    return Chain(np.array(left_to_right, dtype=np.float64)[::-1])


@st.composite
def slave_steps(draw: DrawFn, unit: float) -> tuple[list[tuple[float, float]], int]:
    """Draw the vectors of slave segments from left to right, and the number of the segment that carries the point."""
    before, after = draw(_COUNTS), draw(_COUNTS)
    length = unit * draw(_LENGTHS)
    steps = [(length, length * draw(TILTS)) for _ in range(before + 1 + after)]
    return steps, before


def slave_through(point: tuple[float, float], c: float, steps: Sequence[tuple[float, float]], segment: int) -> Chain:
    """Return the open chain with these vectors whose segment of this number has the point at c."""
    vectors = np.array(steps, dtype=np.float64)
    nodes = np.concatenate([np.zeros((1, 2)), np.cumsum(vectors, axis=0)])
    start = np.array(point) - nodes[segment] - (1 + c) / 2 * vectors[segment]
    return Chain(nodes + start)
