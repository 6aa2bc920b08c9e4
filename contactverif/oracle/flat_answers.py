"""Exact answers on flat interfaces: the consistent forces of a uniform pressure, and the forces of nodal springs.

All arithmetic is rational on the stored floats; the only rounding is the last one. In 3-D what both surfaces have in
common is a convex domain, which is given: a face is cut with the edges of the domain, never with other faces.
"""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.contract.interface import Interface, Surface
from contactverif.oracle.nearest import integers

_ROUNDING = 64 * UNIT_ROUNDOFF  # Nodes this close, over the largest coordinate, coincide.


def uniform_pressure_weights_exact(interface: Interface, along: ArrayLike) -> list[Fraction]:
    """Return the lengths that turn a uniform pressure into consistent nodal forces, as exact rationals.

    The weight of a node is ∫ N over the part of its surface that faces chains of the other surface. What lies beside
    the other surface has no weight, whichever of the two is wider. `along` (n_nodes,) are coordinates along the
    straight interface; floats count as the rationals that they are. Chains of one surface are open and do not overlap.
    """
    places, scale = integers(np.asarray(along, dtype=np.float64))
    weights = [Fraction(0)] * len(places)
    halves = [0] * len(places)  # The lengths of the segments that are covered as a whole: half of each is a weight.
    for surface, other in ((interface.slave, interface.master), (interface.master, interface.slave)):
        ordered = sorted(sorted(ends, key=places.__getitem__) for ends in surface.segments.tolist())
        ordered.sort(key=lambda ends: places[ends[0]])
        starts = [places[low] for low, _ in ordered]
        for chain in chain_ends(other):
            low, high = sorted(places[node] for node in chain)
            for first, second in ordered[max(bisect_right(starts, low) - 1, 0) : bisect_right(starts, high)]:
                begin, end = places[first], places[second]
                if low <= begin and end <= high:
                    halves[first] += end - begin
                    halves[second] += end - begin
                elif (a := max(low, begin) - begin) < (b := min(high, end) - begin):  # From the first node.
                    towards_second = Fraction(b * b - a * a, 2 * (end - begin))
                    weights[second] += towards_second
                    weights[first] += b - a - towards_second
    return [weight / scale + Fraction(half, 2 * scale) for weight, half in zip(weights, halves, strict=True)]


def uniform_pressure_weights(interface: Interface, along: ArrayLike) -> FloatArray:
    """Return the weights of `uniform_pressure_weights_exact` as floats (n_nodes,), each rounded once."""
    return np.array([float(weight) for weight in uniform_pressure_weights_exact(interface, along)])


def chain_ends(surface: Surface) -> list[tuple[int, int]]:
    """Return the first and the last node of each open chain."""
    order = surface.chain_order
    previous, following = surface.neighbours[order].T
    ends = surface.segments[order[previous < 0], 0], surface.segments[order[following < 0], 1]
    return list(zip(*(side.tolist() for side in ends), strict=True))


def nodal_spring_weights(interface: Interface, along: ArrayLike, *, both_surfaces: bool = False) -> FloatArray:
    """Return the forces (n_nodes,) away from the other body of springs of unit force at the nodes of the slave.

    A nodal method knows no areas. Its forces are a unit on each slave node, shared between the nodes of the master
    segment below by the lever rule.

    The interface is flat, with coordinates `along` (n_nodes,); floats count as the rationals that they are. A node
    beside the other surface has no spring. With `both_surfaces` there are springs at the nodes of the master too.
    """
    places, _ = integers(np.asarray(along, dtype=np.float64))

    def parts(node: int, ends: list[int]) -> list[Fraction]:
        return [Fraction(places[ends[1]] - places[node]), Fraction(places[node] - places[ends[0]])]

    return _spring_weights(interface, parts, both_surfaces)


def _spring_weights(
    interface: Interface, parts_at: Callable[[int, list[int]], list[Fraction]], both_surfaces: bool
) -> FloatArray:
    """Return the forces (n_nodes,) of springs. The parts of an element at a node add up to its own size.

    Each is opposite one of its nodes, and all have the same sign where the node lies over the element.
    """
    forces = [Fraction(0)] * interface.n_nodes
    passes = [(interface.slave, interface.master), (interface.master, interface.slave)]
    for surface, other in passes if both_surfaces else passes[:1]:
        for node in surface.nodes.tolist():
            for corners in other.faces.tolist():
                parts = parts_at(node, corners)
                if min(parts) >= 0 or max(parts) <= 0:
                    forces[node] += 1
                    for corner, part in zip(corners, parts, strict=True):
                        forces[corner] += part / sum(parts)
                    break
    return np.array([float(force) for force in forces])


def is_of_class(interface: Interface, along: ArrayLike, *, midpoints: bool) -> bool:
    """Return whether all inner master nodes of a flat interface lie on slave nodes, or in the middle of slave segments.

    Zavarise & De Lorenzis (2009), Sections 4 and 5.1.2, order their cases by that:

    | class | inner master nodes lie | cases | passes the patch test |
    |---|---|---|---|
    | normal | on slave nodes | A1, A2 | NTS-AR, VTS-G, VTS-ME, and all that pass the next class |
    | single | there or, with `midpoints`, in the middle of segments | B | VTS-ME with an even n, VTS-PPT, mortar, … |

    In the normal class the shape functions of the master are linear along each slave segment, so the trapezoidal rule,
    and any better one, transmits a uniform pressure exactly. In the single class they may have a bend in the middle.
    `along` (n_nodes,) are coordinates along the interface.
    """
    places = np.asarray(along, dtype=np.float64)
    slave, master = interface.slave.segments, interface.master.segments
    inner = places[np.intersect1d(master[:, 0], master[:, 1])]
    allowed = places[np.unique(slave)]
    if midpoints:
        allowed = np.append(allowed, places[slave].mean(axis=1))
    distances = np.abs(inner[:, None] - allowed).min(axis=1)
    return bool((distances <= _ROUNDING * np.abs(places).max()).all())


Point = tuple[Fraction, Fraction]
Polygon = list[Point]  # Corners, counter-clockwise.
_TRIANGLE = 3


def uniform_surface_weights_exact(interface: Interface, plane: ArrayLike, domain: ArrayLike) -> list[Fraction]:
    """Return the areas that turn a uniform pressure into consistent nodal forces, as exact rationals.

    The weight of a node is ∫ N over the part of its surface that lies in the convex domain, whose corners (n_corners,
    2) run counter-clockwise. `plane` (n_nodes, 2) are the coordinates of the nodes; floats count as the rationals that
    they are. On a quadrilateral that is no parallelogram shape functions are no polynomials of the place: if it is
    partly outside of the domain, its weights are approximate, to some 1e-6.
    """
    places, border = _as_points(plane), _as_points(domain)
    weights = [Fraction(0)] * len(places)
    for surface in (interface.slave, interface.master):
        for face in surface.faces.tolist():
            corners = [places[node] for node in face]
            if turn(corners[0], corners[1], corners[2]) < 0:
                face, corners = face[::-1], corners[::-1]
            for node, weight in zip(face, _integrate_shapes(corners, border), strict=True):
                weights[node] += weight
    return weights


def uniform_surface_weights(interface: Interface, plane: ArrayLike, domain: ArrayLike) -> FloatArray:
    """Return the weights of `uniform_surface_weights_exact` as floats (n_nodes,), each rounded once."""
    return np.array([float(weight) for weight in uniform_surface_weights_exact(interface, plane, domain)])


def nodal_surface_weights(interface: Interface, plane: ArrayLike, *, both_surfaces: bool = False) -> FloatArray:
    """Return the forces (n_nodes,) away from the other body of springs of unit force at the nodes of the slave.

    The force of a spring is shared by the shape functions of the face below. The surfaces are triangles or
    parallelograms in one plane, where their nodes have the coordinates `plane` (n_nodes, 2). A node beside the other
    surface has no spring. With `both_surfaces` there are springs at the nodes of the master too.
    """
    places = _as_points(plane)

    def parts(node: int, face: list[int]) -> list[Fraction]:
        return _shapes([places[corner] for corner in face], places[node])

    return _spring_weights(interface, parts, both_surfaces)


def _as_points(values: ArrayLike) -> Polygon:
    return [(Fraction(x), Fraction(y)) for x, y in np.asarray(values, dtype=np.float64).tolist()]


def turn(a: Point, b: Point, c: Point) -> Fraction:
    """Return twice the area of a triangle, positive if its corners run counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _shapes(corners: Polygon, place: Point) -> list[Fraction]:
    """Return the shape functions of a triangle or a parallelogram at a place; one is negative outside of it."""
    first, second, last = corners[0], corners[1], corners[-1]
    size = turn(first, second, last)
    s, t = turn(first, place, last) / size, turn(first, second, place) / size
    return [1 - s - t, s, t] if len(corners) == _TRIANGLE else [(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t]


def _integrate_shapes(corners: Polygon, border: Polygon) -> Sequence[Fraction]:
    """Return ∫ of each shape function of a face over its part in the domain.

    Over a triangle a linear function is its value at the centroid times the area. One of degree 2 is the mean of its
    values in the middle of the edges times the area.
    """
    edges, is_triangle = list(zip(border, border[1:] + border[:1], strict=True)), len(corners) == _TRIANGLE
    if all(turn(start, end, corner) >= 0 for start, end in edges for corner in corners):
        return [turn(corners[0], corners[1], corners[2]) / 6] * 3 if is_triangle else _whole_quadrilateral(corners)
    part, weights = cut_polygon(corners, border), [Fraction(0)] * len(corners)
    if part and not is_triangle and any(a + c != b + d for a, b, c, d in zip(*corners, strict=True)):
        return [*map(Fraction, _integrate_part(np.array(corners, np.float64), np.array(part, np.float64)).tolist())]
    for second, third in pairwise(part[1:]):
        fan = part[0], second, third
        places = [_mean(fan)] if is_triangle else [_mean((fan[i - 1], fan[i])) for i in range(3)]
        share = turn(*fan) / 2 / len(places)
        for place in places:
            weights = [weight + share * shape for weight, shape in zip(weights, _shapes(corners, place), strict=True)]
    return weights


def _integrate_part(corners: FloatArray, part: FloatArray) -> FloatArray:
    """Return ∫ of the shape functions (4,) of a quadrilateral (4, 2) over a convex part (n, 2) of it, nearly exact."""
    points, shares = np.polynomial.legendre.leggauss(12)
    u, v = np.meshgrid((1 + points) / 2, (1 + points) / 2, indexing="ij")
    b, c = part[1:-1] - part[0], part[2:] - part[0]  # (n_triangles, 2) Each has its points along rays from a corner.
    r = part[0] - corners[0] + u[..., None, None] * (b + v[..., None, None] * (c - b))
    weights = np.outer(shares * (1 + points) / 2, shares)[..., None] / 4 * cross(b, c)
    first, last = corners[1] - corners[0], corners[3] - corners[0]
    twist = corners[2] - corners[1] - last
    # A place is s first + t last + s t twist. Without s, that is a quadratic equation in t.
    constant, linear = cross(r, first), cross(r, twist) + cross(first, last)
    root = np.sqrt(np.maximum(linear**2 + 4 * constant * cross(last, twist), 0.0))
    t = -2 * constant / (linear + root)
    edge = first + t[..., None] * twist
    s = ((r - t[..., None] * last) * edge).sum(axis=-1) / (edge**2).sum(axis=-1)
    shapes = np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t])
    return np.asarray((shapes * weights).sum(axis=(1, 2, 3)))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the products (...) of vectors (..., 2): the area of their parallelogram, positive to the left of a."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _mean(points: Sequence[Point]) -> Point:
    x, y = (sum(values, Fraction(0)) / len(points) for values in zip(*points, strict=True))
    return x, y


def cut_polygon(polygon: Polygon, border: Polygon) -> Polygon:
    """Return the part of a convex polygon in another one, at most empty."""
    for start, end in zip(border, border[1:] + border[:1], strict=True):  # Keep what is to the left of each edge.
        part: Polygon = []
        sides = [turn(start, end, corner) for corner in polygon]
        for k, (corner, side) in enumerate(zip(polygon, sides, strict=True)):
            following, there = polygon[(k + 1) % len(polygon)], sides[(k + 1) % len(polygon)]
            if side >= 0:
                part.append(corner)
            if side * there < 0:
                share = side / (side - there)
                x, y = (now + share * (then - now) for now, then in zip(corner, following, strict=True))
                part.append((x, y))
        polygon = part
    return polygon


def _whole_quadrilateral(corners: Polygon) -> Sequence[Fraction]:
    """Return ∫ of the bilinear shape functions, with the Jacobian a₀ + a₁ s + a₂ t on [−1, 1]²."""
    signs = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    along, up, twist = (
        [sum((sign * corner[axis] for sign, corner in zip(row, corners, strict=True)), Fraction(0)) for axis in (0, 1)]
        for row in (tuple(s for s, _ in signs), tuple(t for _, t in signs), tuple(s * t for s, t in signs))
    )
    origin: Point = (Fraction(0), Fraction(0))
    middle, by_s, by_t = (
        turn(origin, (first[0], first[1]), (second[0], second[1])) / 16
        for first, second in ((along, up), (along, twist), (twist, up))
    )
    return [middle + s * by_s / 3 + t * by_t / 3 for s, t in signs]
