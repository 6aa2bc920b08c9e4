"""The consistent forces of flat interfaces, forces of nodal springs, and classes of meshes: by hand and by symmetry."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from planned_cases import draw_cases

from contactverif import Interface
from contactverif.oracle.flat_answers import (
    is_of_class,
    nodal_spring_weights,
    nodal_surface_weights,
    uniform_surface_weights,
    uniform_surface_weights_exact,
)
from contactverif.strategies.surfaces import flat_surface_cases

SQUARE = [[0.0, 0], [1, 0], [1, 1], [0, 1]]
Polygon = list[tuple[Fraction, Fraction]]


def interface(
    slave: list[list[float]], faces: list[list[int]], master: list[list[float]], others: list[list[int]]
) -> Interface:
    points = (np.column_stack([side, np.zeros(len(side))]) for side in (slave, master))
    return Interface.from_faces(next(points), faces, next(points), others)


def test_two_diagonals_of_a_square() -> None:
    meshes = interface(SQUARE, [[0, 2, 1], [0, 3, 2]], SQUARE, [[0, 1, 3], [1, 2, 3]])
    weights = uniform_surface_weights_exact(meshes, meshes.nodes[:, :2], SQUARE)
    third, sixth = Fraction(1, 3), Fraction(1, 6)
    assert weights == [third, sixth, third, sixth, sixth, third, sixth, third]


def test_a_larger_master_is_loaded_where_the_domain_covers_it() -> None:
    """The square is the quarter of a triangle at its right angle and two corners of it are cut: ∫ x = ∫ y = 1/2."""
    large = [[0.0, 0], [4, 0], [0, 4]]
    meshes = interface(SQUARE, [[0, 3, 2, 1]], large, [[0, 1, 2]])
    weights = uniform_surface_weights_exact(meshes, meshes.nodes[:, :2], SQUARE)
    assert weights[:4] == [Fraction(1, 4)] * 4
    assert weights[4:] == [Fraction(3, 4), Fraction(1, 8), Fraction(1, 8)]


def test_a_quadrilateral_of_any_shape_has_the_moments_of_its_area() -> None:
    """Shape functions add up to 1, and Σ N_i x_i are coordinates: so weights give the area and its first moments."""
    kite = [[0.0, 0], [3, 1], [4, 4], [1, 3.5]]
    meshes = interface(kite, [[0, 3, 2, 1]], kite, [[0, 1, 3], [1, 2, 3]])
    box = [[-1.0, -1], [9, -1], [9, 9], [-1, 9]]
    weights = uniform_surface_weights_exact(meshes, meshes.nodes[:, :2], box)
    places = [(Fraction(x), Fraction(y)) for x, y in kite]
    for moment in (lambda x, y: 1, lambda x, y: x, lambda x, y: y):
        quadrilateral, triangles = (
            sum(weight * moment(*place) for weight, place in zip(part, places, strict=True))
            for part in (weights[:4], weights[4:])
        )
        assert quadrilateral == triangles


def test_a_parallelogram_is_cut_exactly_and_another_quadrilateral_nearly_so() -> None:
    meshes = interface(SQUARE, [[0, 2, 1], [0, 3, 2]], [[0, 0], [2, 0], [2, 1], [0, 1]], [[0, 1, 2, 3]])
    weights = uniform_surface_weights_exact(meshes, meshes.nodes[:, :2], SQUARE)
    assert weights[4:] == [Fraction(3, 8), Fraction(1, 8), Fraction(1, 8), Fraction(3, 8)]
    meshes = interface(SQUARE, [[0, 2, 1], [0, 3, 2]], [[0, 0], [2, 0], [2, 1], [0, 2]], [[0, 1, 2, 3]])
    weights = uniform_surface_weights(meshes, meshes.nodes[:, :2], SQUARE)
    assert [weights[4:].sum(), *(weights[4:] @ meshes.nodes[4:, :2])] == pytest.approx([1, 0.5, 0.5], rel=1e-14)
    exact, nearly = (
        uniform_surface_weights(meshes, meshes.nodes[:, :2], domain)[4:]
        for domain in ([[-1, -1], [3, -1], [3, 3], [-1, 3]], [[1e-12, -1], [3, -1], [3, 3], [1e-12, 3]])
    )
    assert nearly == pytest.approx(exact, rel=1e-6)


def cut(polygon: Polygon, edges: Polygon) -> Polygon:
    """Return the overlap of a convex polygon and a counter-clockwise one, edge by edge."""
    for (ax, ay), (bx, by) in zip(edges, edges[1:] + edges[:1], strict=True):
        sides = [(bx - ax) * (y - ay) - (by - ay) * (x - ax) for x, y in polygon]
        part = []
        for k, (place, side) in enumerate(zip(polygon, sides, strict=True)):
            other, there = polygon[(k + 1) % len(polygon)], sides[(k + 1) % len(polygon)]
            part += [place] if side >= 0 else []
            if side * there < 0:
                share = side / (side - there)
                part.append((place[0] + share * (other[0] - place[0]), place[1] + share * (other[1] - place[1])))
        polygon = part
    return polygon


def integrate(face: Polygon, part: Polygon) -> list[Fraction]:
    """Return ∫ of the shape functions of a triangle over a polygon, by the middles of the edges of its fan."""
    (ax, ay), (bx, by), (cx, cy) = face
    det = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    sums = [Fraction(0)] * 3
    for k in range(1, len(part) - 1):
        p, q, r = part[0], part[k], part[k + 1]
        area = ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])) / 2
        for u, v in ((p, q), (q, r), (r, p)):
            x, y = (u[0] + v[0]) / 2 - ax, (u[1] + v[1]) / 2 - ay
            s, t = (x * (cy - ay) - y * (cx - ax)) / det, (y * (bx - ax) - x * (by - ay)) / det
            for i, value in enumerate((1 - s - t, s, t)):
                sums[i] += area / 3 * value
    return sums


def test_the_cuts_of_all_pairs_of_faces_give_the_same_rationals() -> None:
    cases = draw_cases(flat_surface_cases(), seed="cuts", examples=12).cases
    small = [case for case in cases if len(case.interface.slave) * len(case.interface.master) <= 400]
    assert len(small) >= 3
    for case in small:
        meshes, plane = case.interface, case.parameters["plane"]
        places = [(Fraction(x), Fraction(y)) for x, y in plane.tolist()]
        expected = [Fraction(0)] * len(places)
        for above in meshes.slave.faces.tolist():
            slave = [places[node] for node in above[::-1]]
            for below in meshes.master.faces.tolist():
                master = [places[node] for node in below]
                part = cut(master, slave)
                for nodes, face in ((above[::-1], slave), (below, master)):
                    for node, weight in zip(nodes, integrate(face, part), strict=True):
                        expected[node] += weight
        assert uniform_surface_weights_exact(meshes, plane, case.parameters["domain"]) == expected


def test_a_spring_is_shared_by_the_triangle_below_and_one_beside_the_master_has_no_force() -> None:
    meshes = interface([[1, 1], [0, 2], [5, 5]], [[0, 1, 2]], [[0.0, 0], [4, 0], [0, 4]], [[0, 1, 2]])
    weights = nodal_surface_weights(meshes, meshes.nodes[:, :2])
    assert weights.tolist() == [1, 1, 0, 0.5 + 0.5, 0.25, 0.25 + 0.5]
    both = nodal_surface_weights(meshes, meshes.nodes[:, :2], both_surfaces=True)
    assert both[3:].tolist() == weights[3:].tolist()  # No node of the master lies under the slave.


def make_flat(slave: list[float], master: list[float]) -> Interface:
    return Interface.from_chains([[x, 0] for x in slave], [[x, 0] for x in reversed(master)])


def test_each_slave_node_has_a_unit_and_the_lever_rule_shares_it() -> None:
    interface = make_flat([0, 2, 4, 8], [0, 3, 8])
    weights = nodal_spring_weights(interface, interface.nodes[:, 0])
    assert weights.tolist() == pytest.approx([1, 1, 1, 1, 1 + 1 / 5, 2 / 3 + 4 / 5, 1 + 1 / 3], abs=1e-15)


def test_springs_of_both_surfaces_add_up_and_a_node_beside_the_other_surface_has_none() -> None:
    interface = make_flat([0, 2], [-1, 1, 4])
    weights = nodal_spring_weights(interface, interface.nodes[:, 0], both_surfaces=True)
    assert weights.tolist() == pytest.approx([1.5, 1.5, 1 / 3, 1 + 1 / 2 + 2 / 3, 1 / 2], abs=1e-15)


@pytest.mark.parametrize(
    ("slave", "master", "normal", "single"),
    [
        ([0, 2, 4], [0, 4], True, True),
        ([0, 2, 4], [0, 2, 4], True, True),
        ([0, 2, 4], [-1, 0, 5], True, True),
        ([0, 2, 4], [0, 1, 4], False, True),
        ([0, 2, 4], [0, 1, 2, 3, 4], False, True),
        ([0, 2, 4], [0, 1.5, 4], False, False),
        ([0, 2, 4], [-2, -1, 4], False, False),
    ],
)
def test_the_class_of_a_mesh(slave: list[float], master: list[float], normal: bool, single: bool) -> None:
    interface = make_flat(slave, master)
    along = interface.nodes[:, 0]
    assert is_of_class(interface, along, midpoints=False) is normal
    assert is_of_class(interface, along, midpoints=True) is single
