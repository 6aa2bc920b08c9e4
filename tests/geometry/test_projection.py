"""The tree search against rational answers, ties and all, near the origin and far from it."""

from fractions import Fraction

import numpy as np
import pytest
from exact_projection import project_point

from contactverif import Interface
from contactverif.geometry.projection import PointOnSegment, arm, nearest_segment, search_tree


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
