"""Exact answers on flat interfaces in space: the consistent forces of a uniform pressure, in rationals.

Both surfaces lie in one plane. What they have in common is a convex domain, which is given. A face is cut with the
edges of the domain, never with faces of the other surface, so that nothing here is a formulation's own algorithm. The
only rounding is the last one.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface

Point = tuple[Fraction, Fraction]
Polygon = list[Point]  # Corners, counter-clockwise.
_TRIANGLE = 3


def uniform_surface_weights_exact(interface: Interface, plane: ArrayLike, domain: ArrayLike) -> list[Fraction]:
    """Return the areas that turn a uniform pressure into consistent nodal forces, as exact rationals.

    The weight of a node is ∫ N over the part of its surface that lies in the domain.

    Parameters
    ----------
    interface : Interface
        Surfaces of triangles, or of quadrilaterals that lie in the domain as a whole.
    plane : ArrayLike, shape (n_nodes, 2)
        The coordinates of the nodes in the plane; floats count as the rationals that they are.
    domain : ArrayLike, shape (n_corners, 2)
        The corners of the convex domain, counter-clockwise.

    Raises
    ------
    MisuseError
        If a quadrilateral lies partly outside of the domain: there no polynomial is integrated.
    """
    places, border = _as_points(plane), _as_points(domain)
    weights = [Fraction(0)] * len(places)
    for surface in (interface.slave, interface.master):
        for face in surface.faces.tolist():
            corners = [places[node] for node in face]
            if _turn(corners[0], corners[1], corners[2]) < 0:
                face, corners = face[::-1], corners[::-1]
            for node, weight in zip(face, _integrate_shapes(corners, border), strict=True):
                weights[node] += weight
    return weights


def uniform_surface_weights(interface: Interface, plane: ArrayLike, domain: ArrayLike) -> FloatArray:
    """Return the weights of `uniform_surface_weights_exact` as floats (n_nodes,), each rounded once."""
    return np.array([float(weight) for weight in uniform_surface_weights_exact(interface, plane, domain)])


def nodal_surface_weights(interface: Interface, plane: ArrayLike, *, both_surfaces: bool = False) -> FloatArray:
    """Return the forces (n_nodes,) away from the other body of springs of unit force at the nodes of the slave.

    The force of a spring is shared by the shape functions of the triangle below. The surfaces are triangles in one
    plane, where their nodes have the coordinates `plane` (n_nodes, 2). A node beside the other surface has no spring.
    With `both_surfaces` there are springs at the nodes of the master too.
    """
    places = _as_points(plane)
    forces = [Fraction(0)] * len(places)
    passes = [(interface.slave, interface.master), (interface.master, interface.slave)]
    for surface, other in passes if both_surfaces else passes[:1]:
        for node in np.unique(surface.faces).tolist():
            for face in other.faces.tolist():
                parts = [_turn(places[node], places[face[i - 2]], places[face[i - 1]]) for i in range(3)]
                if min(parts) >= 0 or max(parts) <= 0:
                    forces[node] += 1
                    for corner, part in zip(face, parts, strict=True):
                        forces[corner] += part / sum(parts)
                    break
    return np.array([float(force) for force in forces])


def _as_points(values: ArrayLike) -> Polygon:
    return [(Fraction(x), Fraction(y)) for x, y in np.asarray(values, dtype=np.float64).tolist()]


def _turn(a: Point, b: Point, c: Point) -> Fraction:
    """Return twice the area of a triangle, positive if its corners run counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _integrate_shapes(corners: Polygon, border: Polygon) -> Sequence[Fraction]:
    """Return ∫ of each shape function of a face over its part in the domain."""
    edges = list(zip(border, border[1:] + border[:1], strict=True))
    if all(_turn(start, end, corner) >= 0 for start, end in edges for corner in corners):
        return _whole_triangle(corners) if len(corners) == _TRIANGLE else _whole_quadrilateral(corners)
    if len(corners) != _TRIANGLE:
        raise MisuseError(
            "plane", "a quadrilateral partly outside of the domain", "triangles, or none cut by the border"
        )
    return _triangle_over(corners, cut_polygon(corners, border))


def cut_polygon(polygon: Polygon, border: Polygon) -> Polygon:
    """Return the part of a convex polygon in another one, at most empty."""
    for start, end in zip(border, border[1:] + border[:1], strict=True):
        polygon = _cut(polygon, start, end)
    return polygon


def area_of(polygon: Polygon) -> Fraction:
    """Return the area of a polygon."""
    corners = polygon[1:]
    return sum((_turn(polygon[0], *pair) for pair in pairwise(corners)), Fraction(0)) / 2


def _cut(polygon: Polygon, start: Point, end: Point) -> Polygon:
    """Return the part of a convex polygon to the left of a line."""
    part: Polygon = []
    sides = [_turn(start, end, corner) for corner in polygon]
    for k, (corner, side) in enumerate(zip(polygon, sides, strict=True)):
        following, there = polygon[(k + 1) % len(polygon)], sides[(k + 1) % len(polygon)]
        if side >= 0:
            part.append(corner)
        if side * there < 0:
            share = side / (side - there)
            x, y = (now + share * (then - now) for now, then in zip(corner, following, strict=True))
            part.append((x, y))
    return part


def _whole_triangle(corners: Polygon) -> Sequence[Fraction]:
    return [_turn(*corners) / 6] * 3


def _triangle_over(corners: Polygon, part: Polygon) -> Sequence[Fraction]:
    """Return ∫ of the linear shape functions of a triangle over a convex polygon in it, at most empty.

    A linear function over a triangle is its value at the centroid times the area.
    """
    whole, weights = _turn(*corners), [Fraction(0)] * 3
    for k in range(1, len(part) - 1):
        fan = (part[0], part[k], part[k + 1])
        area = _turn(*fan) / 2
        centroid = (sum((x for x, _ in fan), Fraction(0)) / 3, sum((y for _, y in fan), Fraction(0)) / 3)
        for i in range(3):
            weights[i] += area * _turn(corners[(i + 1) % 3], corners[(i + 2) % 3], centroid) / whole
    return weights


def _whole_quadrilateral(corners: Polygon) -> Sequence[Fraction]:
    """Return ∫ of the bilinear shape functions, with the Jacobian a₀ + a₁ s + a₂ t on [−1, 1]²."""
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    along, up, twist = (
        [sum((sign * corner[axis] for sign, corner in zip(row, corners, strict=True)), Fraction(0)) for axis in (0, 1)]
        for row in (tuple(s for s, _ in signs), tuple(t for _, t in signs), tuple(s * t for s, t in signs))
    )
    origin: Point = (Fraction(0), Fraction(0))
    middle, by_s, by_t = (
        _turn(origin, (first[0], first[1]), (second[0], second[1])) / 16
        for first, second in ((along, up), (along, twist), (twist, up))
    )
    return [middle + s * by_s / 3 + t * by_t / 3 for s, t in signs]
