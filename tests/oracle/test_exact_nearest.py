"""The exact nearest segments against a plain loop in fractions, and by hand."""

from fractions import Fraction

import numpy as np
import pytest

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.oracle import nearest_segments

SEGMENTS = np.array([[0, 1], [1, 2]])


def plain_squared_distances(nodes: FloatArray, segments: IntArray, point: tuple[float, float]) -> list[Fraction]:
    """Return the squared distance to each segment, with nothing left out and no lattice."""
    distances = []
    px, py = map(Fraction, point)
    for first, second in segments.tolist():
        (ax, ay), (bx, by) = (map(Fraction, nodes[node].tolist()) for node in (first, second))
        dx, dy = bx - ax, by - ay
        share = min(max(((px - ax) * dx + (py - ay) * dy) / (dx * dx + dy * dy), Fraction(0)), Fraction(1))
        distances.append((px - ax - share * dx) ** 2 + (py - ay - share * dy) ** 2)
    return distances


@pytest.mark.parametrize("seed", range(20))
def test_no_nearest_segment_is_left_out(seed: int) -> None:
    random = np.random.default_rng(seed)
    scale, offset = 2.0 ** random.integers(-60, 60), random.choice([0, 1e3, 1e8])
    lattice = random.choice([0, 1])
    nodes = np.cumsum(random.integers(1, 4, (30, 2)) + (1 - lattice) * random.random((30, 2)), axis=0) * [
        1,
        (-1) ** seed,
    ]
    nodes = (nodes + offset) * scale
    segments = np.column_stack([np.arange(29), np.arange(1, 30)])
    for _ in range(20):
        x, y = ((nodes[random.integers(30)] / scale + random.integers(-6, 7, 2) / 2) * scale).tolist()
        nearest = nearest_segments(nodes, segments, (x, y))
        distances = plain_squared_distances(nodes, segments, (x, y))
        assert nearest.squared_distance == min(distances)
        assert sorted(near.segment for near in nearest.segments) == [
            number for number, distance in enumerate(distances) if distance == min(distances)
        ]


def test_at_a_sharp_tip_the_smaller_overshoot_says_on_which_side_the_point_is() -> None:
    tip = np.array([[-4.0, -1.0], [0.0, 0.0], [-4.0, 1.0]])  # The body is between the two segments.
    nearest = nearest_segments(tip, SEGMENTS, (4.0, 2.0))
    assert [near.segment for near in nearest.segments] == [1, 0]
    upper, lower = nearest.segments
    assert upper.signed_squared_gap > 0 > lower.signed_squared_gap
    assert nearest.signed_squared_gap_at(lower) == nearest.signed_squared_gap_at(upper) == upper.signed_squared_gap
    assert nearest.n_undecided == 1


def test_a_foot_exactly_at_a_node_passes_by_nothing() -> None:
    corner = np.array([[3.0, 0.0], [0.0, 0.0], [0.0, -3.0]])
    nearest = nearest_segments(corner, SEGMENTS, (0.0, 2.0))
    assert [(near.segment, near.xi, near.squared_overshoot) for near in nearest.segments] == [
        (0, 1, 0),
        (1, Fraction(-2, 3), 4),
    ]
    assert {near.foot for near in nearest.segments} == {("node", 1)}
    assert nearest.signed_squared_gap_at(nearest.segments[1]) == 4


def test_two_places_at_one_distance_have_gaps_of_their_own() -> None:
    sheets = np.array([[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])  # Both bodies are below their segment.
    nearest = nearest_segments(sheets, np.array([[0, 1], [2, 3]]), (0.5, 0.0))
    assert [(near.segment, nearest.signed_squared_gap_at(near)) for near in nearest.segments] == [(0, -1), (1, 1)]
    assert nearest.n_undecided == 2
