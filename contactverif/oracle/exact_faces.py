"""Points of triangles in space in exact arithmetic, and what they see of a master triangle by two rules.

As in `exact_points`, all numbers are integers: nodes stand on a lattice of one power of two, and a point is a vector
over its own denominator. A length needs a root, which is the only rounding.

Rule for the next editor: a point is formed from the stored nodes and its shape functions. The position that a
formulation reports is rounded, and nothing here reads it.
"""

from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Self

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.interface import measure_heights
from contactverif.oracle.exact_points import ROOT_SHIFT, Integers, Lattice, Ratios, as_integers, dot, roots
from contactverif.oracle.flat_answers import cut_polygon, turn
from contactverif.oracle.nearest import integers

_UNIT_TRIANGLE = [(Fraction(0), Fraction(0)), (Fraction(1), Fraction(0)), (Fraction(0), Fraction(1))]


@dataclass(frozen=True, slots=True, eq=False)
class ExactFacePoints:
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
        return cls(place, np.full(len(face), below, dtype=object), _cross(*arms))

    @property
    def positions(self) -> Ratios:
        """The places (n_points, 3) on the lattice."""
        return Ratios(self.place, self.weight[:, None])


@dataclass(frozen=True, slots=True, eq=False)
class FaceView:
    """The numbers that points see of one master triangle each.

    They look along the normal of their slave triangle, or, by the closest point, along that of the master triangle.
    """

    shape: Ratios  # (n_points, 3) The shape functions of the corners at the foot, unclipped.
    gap: Ratios  # (n_points,) A length, negative in penetration.
    normal: Ratios  # (n_points, 3) The unit normal out of the master.
    cosine: FloatArray  # (n_points,) Of the angle between both normals that face each other; 1 for the closest point.
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
            [dot(direction, _cross(arms[:, k - 2], arms[:, k - 1])) for k in range(3)], axis=1
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
    def faces_it(self) -> BoolArray:
        """True for points (n_points,) that look at the front of their master face."""
        return self.cosine > 0

    @property
    def heights(self) -> FloatArray:
        """The least heights (n_points,) of the master triangles."""
        return measure_heights(self.corners)


def _outward(corners: Integers) -> Integers:
    """Return normals (n, 3), of any length, of triangles with corners (n, 3, 3)."""
    return _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _cross(a: Integers, b: Integers) -> Integers:
    x = a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1]
    y = a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2]
    z = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return np.stack([x, y, z], axis=-1)


def covered_shares(lattice: Lattice) -> list[Fraction]:
    """Return the share of each slave triangle's area (n_faces,) that sees the front of the master along its normal.

    Master triangles behind one another count as often as they are there, so a share may be above 1.
    """
    shares, front = [], _outward(lattice.nodes[lattice.master])
    for face, normal in zip(lattice.slave, _outward(lattice.nodes[lattice.slave]), strict=True):
        first, second, third = lattice.nodes[face]
        arms, whole = lattice.nodes[lattice.master] - first, dot(normal, normal)
        # The corners of the master in the plane of the triangle: 0 to `whole` along its first and its last edge.
        along, up = dot(_cross(arms, third - first), normal), dot(_cross(second - first, arms), normal)
        near = dot(front, normal) < 0
        near &= (along.min(axis=1) < whole) & (up.min(axis=1) < whole) & (along.max(axis=1) > 0) & (up.max(axis=1) > 0)
        share = Fraction(0)
        for corners in np.stack([along, up], axis=-1)[near][:, ::-1].tolist():
            places = [(Fraction(int(x), int(whole)), Fraction(int(y), int(whole))) for x, y in corners]
            part = cut_polygon(places, _UNIT_TRIANGLE)
            share += sum((turn(part[0], *pair) for pair in pairwise(part[1:])), Fraction(0))
        shares.append(share)
    return shares
