"""The search that starts at the last answer against the one from the root, on curves made to mislead it."""

from typing import Any

import numpy as np
import pytest

from contactverif import Interface
from contactverif.geometry.projection import (
    NO_PLACE,
    PointOnSegment,
    is_next,
    nearest_place,
    nearest_place_from,
    search_tree,
)


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
