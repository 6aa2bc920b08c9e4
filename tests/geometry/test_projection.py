"""The tree search against rational answers, ties and all."""

from __future__ import annotations

import numpy as np
import pytest

from contactverif import Interface, oracle
from contactverif.geometry.projection import PointOnSegment, nearest_segment, search_tree


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
        expected = oracle.project_point(interface, x.ravel(), node, -1)
        here = find_nearest(interface, x, x[node])
        assert here in expected.tied
        if len(expected.tied) == 1:
            assert here == expected.segment


def test_ties_at_a_vertex_go_by_the_foot_and_then_by_number() -> None:
    corner = Interface.from_chains([[0, 5], [1, 5]], [[2, 2], [0, 0], [-2, 2]])  # re-entrant seen from above
    x = corner.nodes.copy()
    for p, expected in (([0.5, -1.0], 0), ([-0.5, -1.0], 1), ([0.0, -1.0], 0)):
        assert find_nearest(corner, x, np.array(p)) == expected
