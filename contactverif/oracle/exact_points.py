"""Points of slave segments and triangles in exact arithmetic: what they see of the master, and whether that is right.

All numbers are integers: the nodes stand on a lattice of one power of two, and a point is (X, Y)/W on it. A length
needs a root, which is taken to 2^-128 of the lattice; that is the only rounding.

Rule for the next editor: a point is formed from the stored nodes and its c or shape functions. The position that a
formulation reports is rounded, and nothing here reads it.
"""

from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from itertools import pairwise
from math import isqrt
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from contactverif.contract.arrays import UNIT_ROUNDOFF, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface, measure_heights
from contactverif.oracle.flat_answers import cross, cut_polygon, turn
from contactverif.oracle.nearest import integers, nearest_of, reach

Integers = NDArray[Any]  # An array of Python integers of any size.

ROOT_SHIFT = 128  # The bits of a root behind the lattice's own.


class Lattice(NamedTuple):
    """The nodes of a state as integers."""

    nodes: Integers  # (n_nodes, dim) Positions × `scale`.
    scale: int  # A power of two.
    slave: IntArray  # (n_segments, 2) The nodes of the segments, or (n_faces, 3) the corners of the triangles.
    master: IntArray

    @classmethod
    def from_state(cls, interface: Interface, z: FloatArray) -> Self:
        """Return the lattice of a state z (n_unknowns + …,), whose numbers count as the rationals that they are."""
        values, scale = integers(np.asarray(z, dtype=np.float64)[: interface.n_unknowns])
        nodes = as_integers(values).reshape(-1, interface.dim)
        return cls(nodes, scale, interface.slave.faces, interface.master.faces)


class ExactPoints(NamedTuple):
    """Points of slave segments: (X, Y)/W on the lattice."""

    place: Integers  # (n_points, 2) X and Y.
    weight: Integers  # (n_points,) W > 0.
    along: Integers  # (n_points, 2) The vector from the first to the second node of the slave segment of each point.

    @classmethod
    def at(cls, lattice: Lattice, slave_segment: IntArray, c: FloatArray) -> Self:
        """Return the points at c (n_points,), from −1 at the first to +1 at the second node of a slave segment."""
        ratios = [value.as_integer_ratio() for value in c.tolist()]
        above, below = (as_integers([ratio[end] for ratio in ratios]) for end in (0, 1))
        return cls.at_ratios(lattice, slave_segment, above, below)

    @classmethod
    def at_ratios(cls, lattice: Lattice, slave_segment: IntArray, above: Integers, below: Integers) -> Self:
        """Return the points at c = above/below, with below > 0."""
        first, second = (lattice.nodes[lattice.slave[slave_segment, end]] for end in (0, 1))
        place = (below - above)[:, None] * first + (below + above)[:, None] * second
        return cls(place, 2 * below, second - first)

    def select(self, numbers: IntArray) -> Self:
        """Return some of the points, by number."""
        return type(self)(self.place[numbers], self.weight[numbers], self.along[numbers])


class Ratios(NamedTuple):
    """Exact numbers above/below, with below > 0; arrays of any shape that broadcast."""

    above: Integers
    below: Integers

    def errors(self, values: FloatArray) -> FloatArray:
        """Return values − above/below in their shape, each rounded once; NaN where a value is not finite."""
        above, below = np.broadcast_arrays(self.above, self.below)
        triples = zip(values.reshape(-1).tolist(), above.reshape(-1).tolist(), below.reshape(-1).tolist(), strict=True)
        errors = []
        for value, a, b in triples:
            n, d = value.as_integer_ratio() if np.isfinite(value) else (0, 0)
            errors.append((n * b - a * d) / (d * b) if d else np.nan)
        return np.array(errors, dtype=np.float64).reshape(values.shape)

    def floats(self) -> FloatArray:
        """Return the numbers as floats, each rounded once."""
        above, below = np.broadcast_arrays(self.above, self.below)
        pairs = zip(above.reshape(-1).tolist(), below.reshape(-1).tolist(), strict=True)
        return np.array([a / b for a, b in pairs], dtype=np.float64).reshape(above.shape)


class View(NamedTuple):
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


def _view(lattice: Lattice, points: ExactPoints, segments: IntArray, *, closest: bool) -> View:
    """Return what points see of master segments (n_points,), along the normals of these or of the slave segments.

    A segment that is seen edge-on has its ξ and gap divided by 1 in place of 0; its cosine tells.
    """
    arm, along = _arm_and_along(lattice, points, segments)
    carrier = -along if closest else points.along
    advance = -dot(along, carrier)  # It is positive where the segments face each other.
    sign = np.where(advance < 0, -1, 1).astype(object)
    size = abs(advance) + (advance == 0)
    root = roots(dot(carrier, carrier))
    distance = _sizes(arm, points.weight * lattice.scale)
    master, slave = _sizes(along, lattice.scale), _sizes(points.along, lattice.scale)
    above = Ratios(advance, np.full(len(arm), lattice.scale**2, dtype=object)).floats()
    return View(
        xi=Ratios(-sign * dot(arm, carrier), points.weight * size),
        gap=Ratios(sign * root * cross(arm, along), points.weight * size * lattice.scale << ROOT_SHIFT),
        normal=Ratios(np.stack([-carrier[:, 1], carrier[:, 0]], axis=1) << ROOT_SHIFT, root[:, None]),
        lengths=distance + master + slave,
        slave_length=slave,
        master_length=master,
        cosine=np.ones(len(arm)) if closest else above / (master * slave),
    )


closest_view, slave_normal_view = (partial(_view, closest=closest) for closest in (True, False))


def run_against(lattice: Lattice, points: ExactPoints, segments: IntArray) -> BoolArray:
    """Return whether master segments (n_points,) run against the slave segments of points, and so face them."""
    _, along = _arm_and_along(lattice, points, segments)
    return (dot(along, points.along) < 0).astype(np.bool_)


def positions(lattice: Lattice, points: "ExactPoints | ExactFacePoints") -> Ratios:
    """Return the positions (n_points, dim) of the points, lengths."""
    return Ratios(points.place, (points.weight * lattice.scale)[:, None])


def _arm_and_along(lattice: Lattice, points: ExactPoints, segments: IntArray) -> tuple[Integers, Integers]:
    """Return W (P − x_1) and x_2 − x_1 for points P and master segments 1 → 2."""
    first, second = (lattice.nodes[lattice.master[segments, end]] for end in (0, 1))
    return points.place - points.weight[:, None] * first, second - first


def _sizes(vectors: Integers, scale: Any) -> FloatArray:
    parts = Ratios(vectors, np.broadcast_to(np.asarray(scale, dtype=object), len(vectors))[:, None]).floats()
    return np.hypot(parts[:, 0], parts[:, 1])


def dot(a: Integers, b: Integers) -> Integers:
    """Return the products (n,) of vectors (n, dim)."""
    product: Integers = (a * b).sum(axis=-1)
    return product


def roots(squares: Integers) -> Integers:
    """Return 2^128 times the roots of integers, rounded down."""
    return as_integers([isqrt(square << 2 * ROOT_SHIFT) for square in squares.tolist()])


def as_integers(values: Sequence[int]) -> Integers:
    """Return an array (n,) of Python integers."""
    array = np.empty(len(values), dtype=object)
    array[:] = values
    return array


_SAFE = 2.0**-20  # Floats err by less than this share of a distance, wherever a state makes sense.
DEEP = 2.0  # Segments that penetrate by more than this many lengths of both need not be in contact.


def closest_excess(lattice: Lattice, points: ExactPoints, segments: IntArray) -> tuple[FloatArray, IntArray]:
    """Return how much farther than the nearest closed segment the chosen ones are, and how many are nearest.

    Both are (n_points,): a length ≥ 0, and the exact number of segments at the least distance. `segments` (n_points,)
    are the master segments that were chosen.
    """
    # Floats with a safe bound only leave out segments that cannot be nearest.
    corners, places = Ratios(lattice.nodes, as_integers([lattice.scale])).floats(), positions(lattice, points).floats()
    first, second = corners[lattice.master[:, 0]], corners[lattice.master[:, 1]]
    along = second - first
    share = ((places[:, None] - first) * along).sum(axis=-1) / (along**2).sum(axis=-1)
    foot = first + np.clip(share, 0, 1)[..., None] * along
    distance = np.hypot(*np.moveaxis(places[:, None] - foot, -1, 0))
    doubt = 64 * UNIT_ROUNDOFF * np.abs(corners).max()
    near = distance <= distance.min(axis=1, keepdims=True) * (1 + _SAFE) + doubt
    near[np.arange(len(segments)), segments] = True
    nodes, master = lattice.nodes.tolist(), lattice.master.tolist()
    excess, ties = np.zeros(len(segments)), np.empty(len(segments), dtype=np.int64)
    for number, (place, weight) in enumerate(zip(points.place.tolist(), points.weight.tolist(), strict=True)):
        reaches = {
            segment: reach(segment, nodes[master[segment][0]], nodes[master[segment][1]], place, weight)
            for segment in np.flatnonzero(near[number]).tolist()
        }
        choice, (nearest, *others) = reaches[int(segments[number])], nearest_of(reaches.values())
        ties[number] = 1 + len(others)
        a, b, c, d = choice.above, choice.squared, nearest.above, nearest.squared
        if a * d > c * b:  # Squared distances still carry unit².
            unit = weight * lattice.scale
            total = np.sqrt(a / (b * unit**2)) + np.sqrt(c / (d * unit**2))
            excess[number] = float((a * d - c * b) / (b * d * unit**2) / total)
    return excess, ties


def seen_excess(
    lattice: Lattice, points: ExactPoints, slave_segment: IntArray, segments: IntArray, cells: bool
) -> FloatArray:
    """Return how far the chosen segments are from being the nearest that the slave sees along its normal.

    That is a length ≥ 0 (n_points,): how much farther the chosen segment is than the nearest, or how far the foot lies
    past its end; infinite where it does not face the slave. With `cells` the choice may also be made in the middle of
    the overlap of the two segments, once for all points of a cell.
    """
    view = slave_normal_view(lattice, points, segments)
    past = np.maximum(np.maximum(-view.xi.floats(), view.xi.floats() - 1), 0.0) * view.master_length
    farther = _farther_than_nearest(lattice, points, segments, view)
    if cells and farther.any():
        low, high, squared = overlaps(lattice, slave_segment, segments)
        middle = ExactPoints.at_ratios(lattice, slave_segment, low + high, 2 * squared)
        in_middle = slave_normal_view(lattice, middle, segments)
        farther = np.minimum(farther, _farther_than_nearest(lattice, middle, segments, in_middle))
    return np.where(view.cosine > 0, np.maximum(past, farther), np.inf)


def _farther_than_nearest(lattice: Lattice, points: ExactPoints, choice: IntArray, view: View) -> FloatArray:
    """Return how much larger |gap| is on the chosen segments than on the nearest ones that are seen, a length ≥ 0.

    Segments deeper or farther than two lengths of both need not count as contact, and so are no rivals.
    """
    n_master = len(lattice.master)
    point, candidate = np.divmod(np.arange(len(choice) * n_master), n_master)
    other = slave_normal_view(lattice, points.select(point), candidate)
    xi, gap = other.xi.floats(), np.abs(other.gap.floats())
    near = gap <= DEEP * (other.slave_length + other.master_length)
    rival = (other.cosine > 0) & (xi > 0) & (xi < 1) & near
    gaps = np.where(rival, gap, np.inf).reshape(len(choice), n_master).min(axis=1, initial=np.inf)
    return np.asarray(np.maximum(np.abs(view.gap.floats()) - gaps, 0.0))


def overlaps(lattice: Lattice, slave_segment: IntArray, segments: IntArray) -> tuple[Integers, Integers, Integers]:
    """Return the overlaps of slave segments with master segments that face them, seen along the slave's normal.

    They are low, high and `squared` (n_pairs,): the ends c on the slave segment times `squared`, cut to the segment,
    with high ≤ low where there is none; and the square of the slave segment's length on the lattice.
    """
    x_a, x_b = (lattice.nodes[lattice.slave[slave_segment, end]] for end in (0, 1))
    x_1, x_2 = (lattice.nodes[lattice.master[segments, end]] for end in (0, 1))
    along = x_b - x_a
    squared = (along**2).sum(axis=1)
    low, high = (((2 * end - x_a - x_b) * along).sum(axis=1) for end in (x_2, x_1))
    return np.maximum(low, -squared), np.minimum(high, squared), squared


class Coverage(NamedTuple):
    """The part of each slave segment that sees the master along the slave's normal."""

    share: Ratios  # (n_slave_segments,) The covered share of the segment's length, from 0 to 1 where it is clear.
    # (n_slave_segments,) False where formulations may differ: master segments lie behind one another, or deeper or
    # farther than two lengths of both.
    clear: BoolArray

    @classmethod
    def along_slave_normals(cls, lattice: Lattice) -> Self:
        """Return the coverage of a state by all master segments that face the slave."""
        n_slave, n_master = len(lattice.slave), len(lattice.master)
        carrier, segment = np.divmod(np.arange(n_slave * n_master), n_master)
        low, high, squared = overlaps(lattice, carrier, segment)
        pairs = np.flatnonzero(high > low)
        carrier, segment, low, high = carrier[pairs], segment[pairs], low[pairs], high[pairs]
        middle = ExactPoints.at_ratios(lattice, carrier, low + high, 2 * squared[pairs])
        view = slave_normal_view(lattice, middle, segment)
        facing = view.cosine > 0
        deep = facing & (np.abs(view.gap.floats()) > DEEP * (view.slave_length + view.master_length))
        above, below, clear = np.zeros(n_slave, dtype=object), np.ones(n_slave, dtype=object), np.ones(n_slave, bool)
        clear[carrier[deep]] = False
        for number in np.unique(carrier[facing]).tolist():
            here = np.flatnonzero(facing & (carrier == number))
            above[number], below[number] = sum((high - low)[here].tolist()), 2 * squared[pairs][here[0]]
            order = sorted(here.tolist(), key=lambda pair: (low[pair], high[pair]))
            clear[number] &= all(high[now] <= low[following] for now, following in pairwise(order))
        return cls(Ratios(above, below), clear)


def lies_in_shadow(lattice: Lattice, interface: Interface) -> bool:
    """Return whether the whole slave faces one open master chain, between its ends along the normal of each segment.

    Then nothing overhangs by whatever normal of the master it is measured, and no segment of one side is seen edge-on.
    """
    master, order = interface.master, interface.master.chain_order
    if (master.neighbours[order[1:], 0] != order[:-1]).any() or master.neighbours[order[0], 0] >= 0:
        return False
    nodes = lattice.nodes
    along = nodes[master.segments[:, 1]] - nodes[master.segments[:, 0]]
    against = nodes[interface.slave.segments[:, 1]] - nodes[interface.slave.segments[:, 0]]
    points = nodes[: interface.n_slave_nodes]
    before = points - nodes[master.segments[order[0], 0]]
    behind = nodes[master.segments[order[-1], 1]] - points
    return bool(
        (along.dot(along.T) > 0).all()
        and (along.dot(against.T) < 0).all()
        and (before.dot(along.T) > 0).all()
        and (behind.dot(along.T) > 0).all()
    )


# Triangles in space.

_UNIT_TRIANGLE = [(Fraction(0), Fraction(0)), (Fraction(1), Fraction(0)), (Fraction(0), Fraction(1))]


class ExactFacePoints(NamedTuple):
    """Points of slave triangles: place/weight on the lattice, with the outward normals of these triangles."""

    place: Integers  # (n_points, 3)
    weight: Integers  # (n_points,) Each is > 0.
    outward: Integers  # (n_points, 3) A normal of any length.

    @classmethod
    def at(cls, lattice: Lattice, face: IntArray, shape: FloatArray) -> Self:
        """Return the points with shape functions (n_points, 3) on slave faces (n_points,).

        The first shape function is what the others leave of 1, so that a point is on its face.
        """
        values, below = integers(shape[:, 1:].reshape(-1))
        shares = as_integers(values).reshape(-1, 2)
        first, second, third = np.moveaxis(lattice.nodes[lattice.slave[face]], 1, 0)
        arms = second - first, third - first
        place = below * first + shares[:, :1] * arms[0] + shares[:, 1:] * arms[1]
        return cls(place, np.full(len(face), below, dtype=object), np.cross(*arms))


class FaceView(NamedTuple):
    """The numbers that points see of one master triangle each.

    They look along the normal of their slave triangle, or, by the closest point, along that of the master triangle.
    """

    shape: Ratios  # (n_points, 3) The shape functions of the corners at the foot, unclipped.
    gap: Ratios  # (n_points,) A length, negative in penetration.
    normal: Ratios  # (n_points, 3) The unit normal out of the master.
    # (n_points,) Of the angle between both normals that face each other; 1 for the closest point. Where it is above 0,
    # a point looks at the front of its master face.
    cosine: FloatArray
    corners: FloatArray  # (n_points, 3, 3) The corners of the master triangle, from the point.

    @classmethod
    def of_faces(cls, lattice: Lattice, points: ExactFacePoints, faces: IntArray, *, closest: bool) -> Self:
        """Return what points see of master faces (n_points,). One that is seen edge-on has infinite numbers."""
        nodes = lattice.nodes[lattice.master[faces]]
        outward = _outward(nodes)
        direction = -outward if closest else points.outward
        weight = points.weight
        arms = weight[:, None, None] * nodes - points.place[:, None, :]  # (n_points, 3, 3), from the points.
        facing = dot(outward, direction)  # Negative where the faces look at each other.
        sign = np.where(facing < 0, -1, 1).astype(object)
        below = sign * facing + (facing == 0)
        parts = np.stack(
            [dot(direction, np.cross(arms[:, k - 2], arms[:, k - 1])) for k in range(3)], axis=1
        )  # Twice the areas under the foot, seen along the direction.
        length = roots(dot(direction, direction))
        height = sign * dot(outward, arms[:, 0])
        # Lengths may be beyond floats.
        cosine = Ratios(-facing << ROOT_SHIFT, roots(dot(outward, outward) * dot(direction, direction)))
        return cls(
            shape=Ratios(sign[:, None] * parts, (weight**2 * below)[:, None]),
            gap=Ratios(height * length, weight * below * lattice.scale << ROOT_SHIFT),
            normal=Ratios(-direction << ROOT_SHIFT, length[:, None]),
            cosine=np.ones(len(faces)) if closest else cosine.floats(),
            corners=Ratios(arms, (weight * lattice.scale)[:, None, None]).floats(),
        )

    @property
    def heights(self) -> FloatArray:
        """The least heights (n_points,) of the master triangles."""
        return measure_heights(self.corners)


def _outward(corners: Integers) -> Integers:
    """Return normals (n, 3), of any length, of triangles with corners (n, 3, 3)."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def covered_shares(lattice: Lattice) -> list[Fraction]:
    """Return the share of each slave triangle's area (n_faces,) that sees the front of the master along its normal.

    Master triangles behind one another count as often as they are there, so a share may be above 1.
    """
    shares, front = [], _outward(lattice.nodes[lattice.master])
    for face, normal in zip(lattice.slave, _outward(lattice.nodes[lattice.slave]), strict=True):
        first, second, third = lattice.nodes[face]
        arms, whole = lattice.nodes[lattice.master] - first, dot(normal, normal)
        # The corners of the master in the plane of the triangle: 0 to `whole` along its first and its last edge.
        along, up = (
            dot(np.cross(arms, third - first), normal),
            dot(np.cross(second - first, arms), normal),
        )
        near = dot(front, normal) < 0
        near &= (along.min(axis=1) < whole) & (up.min(axis=1) < whole) & (along.max(axis=1) > 0) & (up.max(axis=1) > 0)
        share = Fraction(0)
        for corners in np.stack([along, up], axis=-1)[near][:, ::-1].tolist():
            places = [(Fraction(int(x), int(whole)), Fraction(int(y), int(whole))) for x, y in corners]
            part = cut_polygon(places, _UNIT_TRIANGLE)
            share += sum((turn(part[0], *pair) for pair in pairwise(part[1:])), Fraction(0))
        shares.append(share)
    return shares
