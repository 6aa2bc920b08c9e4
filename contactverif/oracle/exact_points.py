"""Points of slave segments in exact arithmetic, and what they see of a master segment by two rules.

All numbers are integers: the nodes stand on a lattice of one power of two, and a point is (X, Y)/W on it. A length
needs a root, which is taken to 2^-128 of the lattice; that is the only rounding. So an error of a float is exact to
far below its own last bit.

Rule for the next editor: a point is formed from the stored nodes and its c. The position that a formulation reports is
rounded, and nothing here reads it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface
from contactverif.oracle.exact_distance import integers

Integers = NDArray[Any]  # An array of Python integers of any size.

ROOT_SHIFT = 128  # The bits of a root behind the lattice's own.


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """The nodes of a state as integers."""

    nodes: Integers  # (n_nodes, 2) Positions × `scale`.
    scale: int  # A power of two.
    slave: IntArray  # (n_segments, 2) The nodes of the segments.
    master: IntArray

    @classmethod
    def from_state(cls, interface: Interface, z: FloatArray) -> Lattice:
        """Return the lattice of a state z (n_unknowns + …,), whose numbers count as the rationals that they are."""
        values, scale = integers(np.asarray(z, dtype=np.float64)[: interface.n_unknowns])
        nodes = np.array(values, dtype=object).reshape(-1, 2)
        return cls(nodes, scale, interface.slave.segments, interface.master.segments)


@dataclass(frozen=True, slots=True, eq=False)
class ExactPoints:
    """Points of slave segments: (X, Y)/W on the lattice."""

    place: Integers  # (n_points, 2) X and Y.
    weight: Integers  # (n_points,) W > 0.
    along: Integers  # (n_points, 2) The vector from the first to the second node of the slave segment of each point.

    @classmethod
    def at(cls, lattice: Lattice, slave_segment: IntArray, c: FloatArray) -> ExactPoints:
        """Return the points at c (n_points,), from −1 at the first to +1 at the second node of a slave segment."""
        ratios = [value.as_integer_ratio() for value in c.tolist()]
        return cls.at_ratios(
            lattice, slave_segment, _objects([above for above, _ in ratios]), _objects([below for _, below in ratios])
        )

    @classmethod
    def at_ratios(cls, lattice: Lattice, slave_segment: IntArray, above: Integers, below: Integers) -> ExactPoints:
        """Return the points at c = above/below, with below > 0."""
        first, second = (lattice.nodes[lattice.slave[slave_segment, end]] for end in (0, 1))
        place = (below - above)[:, None] * first + (below + above)[:, None] * second
        return cls(place, 2 * below, second - first)

    def select(self, numbers: IntArray) -> ExactPoints:
        """Return some of the points, by number."""
        return ExactPoints(self.place[numbers], self.weight[numbers], self.along[numbers])


@dataclass(frozen=True, slots=True, eq=False)
class Ratios:
    """Exact numbers above/below, with below > 0; arrays of any shape that broadcast."""

    above: Integers
    below: Integers

    def errors(self, values: FloatArray) -> FloatArray:
        """Return values − above/below in their shape, each rounded once; NaN where a value is not finite."""
        above, below = np.broadcast_arrays(self.above, self.below)
        triples = zip(values.reshape(-1).tolist(), above.reshape(-1).tolist(), below.reshape(-1).tolist(), strict=True)
        return np.array([_error(*triple) for triple in triples], dtype=np.float64).reshape(values.shape)

    def floats(self) -> FloatArray:
        """Return the numbers as floats, each rounded once."""
        above, below = np.broadcast_arrays(self.above, self.below)
        pairs = zip(above.reshape(-1).tolist(), below.reshape(-1).tolist(), strict=True)
        return np.array([a / b for a, b in pairs], dtype=np.float64).reshape(above.shape)


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """The numbers that points see of one master segment each, by one of the two rules."""

    # (n_points,) The foot, 0 at the first node of the segment and 1 at its second, unclipped; and the gap, a length,
    # negative in penetration.
    xi: Ratios
    gap: Ratios
    normal: Ratios  # (n_points, 2) The unit normal out of the master.
    # (n_points,) The length of the slave segment, plus that of the master segment, plus the distance of the point from
    # the master segment's first node: the numbers of which a gap is a difference.
    lengths: FloatArray
    slave_length: FloatArray  # (n_points,) The lengths of the slave segment and of the master segment.
    master_length: FloatArray
    # (n_points,) The cosine of the angle between the master segment and the direction that ξ is measured in: 1 for the
    # closest point. Along the slave's normal it is positive where the segments face each other.
    cosine: FloatArray


def closest_view(lattice: Lattice, points: ExactPoints, segments: IntArray) -> View:
    """Return what points see of master segments (n_points,) along the normals of these segments."""
    arm, along = _arm_and_along(lattice, points, segments)
    squared = _dot(along, along)
    length = roots(squared)
    return View(
        xi=Ratios(_dot(arm, along), points.weight * squared),
        gap=Ratios(_cross(arm, along) << ROOT_SHIFT, points.weight * length * lattice.scale),
        normal=Ratios(np.stack([along[:, 1], -along[:, 0]], axis=1) << ROOT_SHIFT, length[:, None]),
        lengths=_lengths(lattice, points, arm, along),
        slave_length=_sizes(points.along, lattice.scale),
        master_length=_sizes(along, lattice.scale),
        cosine=np.ones(len(segments)),
    )


def slave_normal_view(lattice: Lattice, points: ExactPoints, segments: IntArray) -> View:
    """Return what points see of master segments (n_points,) along the normals of the slave segments.

    A segment that is seen edge-on has its ξ and gap divided by 1 in place of 0; its cosine tells.
    """
    arm, along = _arm_and_along(lattice, points, segments)
    advance = -_dot(along, points.along)  # It is positive where the segments face each other.
    sign = np.where(advance < 0, -1, 1).astype(object)
    size = abs(advance) + (advance == 0)
    slave_length = roots(_dot(points.along, points.along))
    master_length, slave_float = _sizes(along, lattice.scale), _sizes(points.along, lattice.scale)
    cosine = Ratios(advance, np.full(len(segments), lattice.scale**2, dtype=object)).floats()
    return View(
        xi=Ratios(-sign * _dot(arm, points.along), points.weight * size),
        gap=Ratios(sign * slave_length * _cross(arm, along), points.weight * size * lattice.scale << ROOT_SHIFT),
        normal=Ratios(np.stack([-points.along[:, 1], points.along[:, 0]], axis=1) << ROOT_SHIFT, slave_length[:, None]),
        lengths=_lengths(lattice, points, arm, along),
        slave_length=slave_float,
        master_length=master_length,
        cosine=cosine / (master_length * slave_float),
    )


def run_against(lattice: Lattice, points: ExactPoints, segments: IntArray) -> BoolArray:
    """Return whether master segments (n_points,) run against the slave segments of points, and so face them."""
    _, along = _arm_and_along(lattice, points, segments)
    return (_dot(along, points.along) < 0).astype(np.bool_)


def positions(lattice: Lattice, points: ExactPoints) -> Ratios:
    """Return the positions (n_points, 2) of the points, lengths."""
    return Ratios(points.place, (points.weight * lattice.scale)[:, None])


def _arm_and_along(lattice: Lattice, points: ExactPoints, segments: IntArray) -> tuple[Integers, Integers]:
    """Return W (P − x_1) and x_2 − x_1 for points P and master segments 1 → 2."""
    first, second = (lattice.nodes[lattice.master[segments, end]] for end in (0, 1))
    return points.place - points.weight[:, None] * first, second - first


def _lengths(lattice: Lattice, points: ExactPoints, arm: Integers, along: Integers) -> FloatArray:
    distance = _sizes(arm, points.weight * lattice.scale)
    return distance + _sizes(along, lattice.scale) + _sizes(points.along, lattice.scale)


def _sizes(vectors: Integers, scale: Any) -> FloatArray:
    """Return the lengths of integer vectors (n, 2) over a scale, as floats."""
    parts = Ratios(vectors, np.broadcast_to(np.asarray(scale, dtype=object), len(vectors))[:, None]).floats()
    return np.hypot(parts[:, 0], parts[:, 1])


def _dot(a: Integers, b: Integers) -> Integers:
    product: Integers = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1]
    return product


def _cross(a: Integers, b: Integers) -> Integers:
    product: Integers = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def roots(squares: Integers) -> Integers:
    """Return 2^128 times the roots of integers, rounded down."""
    return _objects([isqrt(square << 2 * ROOT_SHIFT) for square in squares.tolist()])


def _objects(values: Sequence[int]) -> Integers:
    array = np.empty(len(values), dtype=object)
    array[:] = values
    return array


def _error(value: float, above: int, below: int) -> float:
    if not np.isfinite(value):
        return np.nan
    numerator, denominator = value.as_integer_ratio()
    return (numerator * below - above * denominator) / (denominator * below)
