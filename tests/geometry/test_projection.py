"""The tree search against rational answers, near the origin and far from it, and the search that starts elsewhere."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from exact_projection import project_point

from contactverif import Interface
from contactverif.geometry.projection import (
    NO_PLACE,
    PointOnSegment,
    arm,
    is_next,
    nearest_place,
    nearest_place_from,
    nearest_segment,
    search_tree,
)


def find_nearest(interface: Interface, x: np.ndarray, p: np.ndarray) -> int:
    order, boxes = search_tree(interface.master, x)
    node = (p[0], p[1])
    return int(nearest_segment(PointOnSegment(node, node, -1.0), x, interface.master.segments, order, boxes))


@pytest.mark.parametrize("seed", range(40))
def test_the_nearest_segment_is_the_rational_one(seed: int) -> None:
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 40))
    master = np.column_stack([np.cumsum(random.integers(1, 5, n + 1)), random.integers(-3, 4, n + 1)])[::-1] / 4
    slave = np.column_stack([np.arange(12) * 3 / 4 + random.integers(0, 8) / 8, random.integers(-16, 16, 12) / 8])
    interface = Interface.from_chains(slave, master)
    x = interface.nodes.copy()
    for node in range(11):
        expected = project_point(interface, x.ravel(), node, -1)
        here = find_nearest(interface, x, x[node])
        assert here in expected.tied
        if len(expected.tied) == 1:
            assert here == expected.segment


def test_ties_at_a_vertex_go_by_the_foot_and_then_by_number() -> None:
    corner = Interface.from_chains([[0, 5], [1, 5]], [[2, 2], [0, 0], [-2, 2]])  # re-entrant seen from above
    x = corner.nodes.copy()
    for p, expected in (([0.5, -1.0], 0), ([-0.5, -1.0], 1), ([0.0, -1.0], 0)):
        assert find_nearest(corner, x, np.array(p)) == expected


@pytest.mark.parametrize("offset", [0.0, 2.0**20, -(2.0**17)])
def test_a_point_of_a_segment_keeps_its_nearest_segment_far_from_the_origin(offset: float) -> None:
    """Both segments of the corner are equally near to the origin's vertical; points lie 2⁻⁴⁰ on either side of it."""
    corner = Interface.from_chains([[-0.75, -1], [0.75, -1]], [[2, 2], [0, 0], [-2, 2]])
    x, segments = corner.nodes + offset, corner.master.segments
    order, boxes = search_tree(corner.master, x)
    a, b = tuple(x[0]), tuple(x[1])
    for c, expected in ((2.0**-40, 0), (-(2.0**-40), 1), (0.0, 0)):
        assert nearest_segment(PointOnSegment(a, b, c), x, segments, order, boxes) == expected


def test_the_arm_to_a_point_is_right_in_its_own_last_bits() -> None:
    random = np.random.default_rng(3)
    for _ in range(200):
        a, b, origin = 1e6 * random.uniform(0.5, 1.5, 2) + random.uniform(-1, 1, (3, 2))
        c = random.uniform(-1, 1)
        exact = [
            (1 - Fraction(c)) / 2 * (Fraction(p) - Fraction(o)) + (1 + Fraction(c)) / 2 * (Fraction(q) - Fraction(o))
            for p, q, o in zip(a, b, origin, strict=True)
        ]
        computed = arm(tuple(origin), PointOnSegment(tuple(a), tuple(b), c))
        assert max(abs(Fraction(value) - truth) for value, truth in zip(computed, exact, strict=True)) <= 4 * 2.0**-52


def spiral() -> Any:
    angle = np.linspace(0, 6 * np.pi, 90)
    return np.column_stack([(1 + 0.05 * angle) * np.cos(angle), (1 + 0.05 * angle) * np.sin(angle)])


def crossing() -> Any:
    """Visit the points of a lattice in a random order, so that segments cross and many points are level."""
    lattice = np.array([(i, j) for i in range(7) for j in range(7)], dtype=float)
    return lattice[np.random.default_rng(5).permutation(len(lattice))]


CURVES = {
    "spiral": spiral(),
    "zigzag": np.column_stack([np.arange(40) / 4, np.arange(40) % 2 / 4]),
    "line": np.column_stack([np.arange(37.0), np.zeros(37)]),
    "ring": np.array([(np.cos(a), np.sin(a)) for a in np.linspace(0, 2 * np.pi, 24, endpoint=False)]),
    "crossing": crossing(),
    "one segment": np.array([[0.0, 0.0], [1.0, 0.0]]),
}


@pytest.mark.parametrize("name", CURVES)
@pytest.mark.parametrize("scale", [1.0, 1e6 / 3])
def test_any_start_leads_to_the_answer_of_the_search_from_the_root(name: str, scale: float) -> None:
    random, curve = np.random.default_rng(1), CURVES[name]
    low, high = curve.min(axis=0) - 1, curve.max(axis=0) + 1
    middles = (curve[1:] + curve[:-1]) / 2
    points = np.vstack(
        [
            *(curve, middles, np.nextafter(curve, 9), np.nextafter(middles, -9)),
            *(random.uniform(low, high, (40, 2)), np.round(random.uniform(low, high, (60, 2)) * 2) / 2),
        ]
    )
    interface = Interface.from_chains([[0, 0], [scale, 0]], curve * scale)
    x, segments = interface.nodes, interface.master.segments
    order, boxes = search_tree(interface.master, x)
    for p in points * scale:
        here = PointOnSegment((p[0], p[1]), (p[0], p[1]), -1.0)
        expected = nearest_place(here, x, segments, order, boxes)
        for last in (NO_PLACE, *random.integers(0, len(segments), 4)):
            assert nearest_place_from(int(last), here, x, segments, order, boxes) == expected


def test_several_chains_with_one_node_in_the_same_place_as_another_of_the_slave() -> None:
    """Two sheets at the same distance from the point: equal distances, no common node."""
    sheets = np.array([[0.0, 1], [2, 1], [2, -1], [0, -1]])
    interface = Interface.from_chains([[0, 0], [2, 0]], sheets)
    order, boxes = search_tree(interface.master, interface.nodes)
    v = PointOnSegment((0.0, 0.0), (2.0, 0.0), 0.0)
    arguments = v, interface.nodes, interface.master.segments, order, boxes
    assert {nearest_place_from(last, *arguments) for last in range(3)} == {nearest_place(*arguments)}


def test_a_search_goes_on_along_a_chain_only() -> None:
    slave = np.array([[0, 1], [1, 2], [5, 6]])
    follows = [is_next(slave, *pair) for pair in ((0, 0), (0, 1), (1, 2), (1, 0))]
    assert follows == [True, True, False, False]
