"""Points and surfaces for a search: exact answers that a plain loop confirms, and mistakes that are found."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from math import nan, sqrt
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, find, given, settings
from hypothesis import strategies as st

from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Surface
from contactverif.geometry.projection import PointOnSegment, nearest_segment, search_tree
from contactverif.strategies import Projection, projections
from contactverif.strategies.point_projections import KINDS

Answer = tuple[int, float, int, float]  # Segment, ξ, side and distance.
EACH = settings(max_examples=20, deadline=None, database=None, derandomize=True)


def search_among(case: Projection, numbers: Any, *, overshoot_counts: bool = True) -> Answer:
    """Return the nearest of some segments; in a tie the one with the smallest overshoot, then the first."""
    point = np.array(case.point)
    a, b = (case.nodes[case.segments[numbers, end]] for end in range(2))
    d, r, q = b - a, point - a, point - b
    squared, along, across = (d * d).sum(1), (r * d).sum(1), r[:, 0] * d[:, 1] - r[:, 1] * d[:, 0]
    before, behind = along <= 0, along >= squared
    distance = np.where(before, (r * r).sum(1), np.where(behind, (q * q).sum(1), across**2 / squared))
    past = np.where(before, -along, np.where(behind, along - squared, 0.0)) / np.sqrt(squared)
    best = np.lexsort((past * overshoot_counts, distance))[0]
    return int(numbers[best]), along[best] / squared[best], int(np.sign(across[best])), float(np.sqrt(distance[best]))


def plain_search(case: Projection) -> Answer:
    return search_among(case, np.arange(len(case.segments)))


def search_tree_of_boxes(case: Projection) -> Answer:
    """Search as the plugins do."""
    order, boxes = search_tree(Surface(case.segments), case.nodes)
    point = PointOnSegment(case.point, case.point, -1.0)
    return search_among(case, np.array([nearest_segment(point, case.nodes, case.segments, order, boxes)]))


def search_at_nearest_node(case: Projection) -> Answer:
    """Look at the segments of the nearest node alone, as much code does."""
    node = np.argmin(np.hypot(*(case.nodes - np.array(case.point)).T))
    return search_among(case, np.flatnonzero((case.segments == node).any(axis=1)))


def search_from_origin(case: Projection) -> Answer:
    """Form the gap from absolute coordinates, n · x − n · a."""
    segment, xi, _, _ = plain_search(case)
    a, b = case.nodes[case.segments[segment]]
    n = np.array([b[1] - a[1], a[0] - b[0]]) / np.hypot(*(b - a))
    gap = n @ np.array(case.point) - n @ a
    return segment, xi, int(np.sign(gap)), float(abs(gap))


def search_in_single_precision(case: Projection) -> Answer:
    x, y = np.array(case.point, dtype=np.float32).tolist()
    return plain_search(replace(case, nodes=case.nodes.astype(np.float32).astype(float), point=(x, y)))


def search_with_epsilon(case: Projection) -> Answer:
    """Take every gap below 1e-10 for none."""
    segment, xi, side, distance = plain_search(case)
    return segment, xi, side if distance >= 1e-10 else 0, distance


def search_with_clipped_xi(case: Projection) -> Answer:
    segment, xi, side, distance = plain_search(case)
    return segment, min(max(xi, 0.0), 1.0), side, distance


def search_without_overshoot(case: Projection) -> Answer:
    """Take the segment with the highest number in a tie, and the side of its line."""
    return search_among(case, np.arange(len(case.segments))[::-1], overshoot_counts=False)


def mistake(case: Projection, search: Callable[[Projection], Answer]) -> str:
    segment, xi, side, distance = search(case)
    return case.find_mistake(segment, xi=xi, side=side, distance=distance)


@given(projections())
@settings(EACH, max_examples=150)
def test_right_searches_make_no_mistake(projection: Projection) -> None:
    for search in (plain_search, search_tree_of_boxes):
        assert not mistake(projection, search)


@pytest.mark.parametrize(
    ("search", "kind", "words"),
    [
        (search_at_nearest_node, "node-elsewhere", "farther than segment 0"),
        (search_at_nearest_node, "thin-body", "farther than segment"),
        (search_from_origin, "offset-1e8", "but for roundoff"),
        (search_in_single_precision, "inside", "ξ = "),
        (search_with_epsilon, "other-units", "side 0, where the gap is "),
        (search_with_clipped_xi, "free-end", "ξ = "),
        (search_without_overshoot, "sharp-tip", "side -1, where the gap is "),
    ],
)
def test_a_wrong_search_is_found_out(search: Callable[[Projection], Answer], kind: str, words: str) -> None:
    quick = settings(EACH, max_examples=500, derandomize=False, phases=[Phase.generate])
    example = find(
        projections(kinds=[kind]), lambda case: bool(mistake(case, search)), settings=quick, random=Random(1)
    )
    assert words in mistake(example, search)


@pytest.mark.parametrize("kind", KINDS)
@settings(EACH)
@given(data=st.data())
def test_every_answer_is_that_of_a_plain_loop_in_fractions(kind: str, data: st.DataObject) -> None:
    case = data.draw(projections(kinds=[kind]))
    px, py = map(Fraction, case.point)
    ranked = []
    for number, ends in enumerate(case.segments.tolist() if kind != "long-chain" else []):
        (ax, ay), (bx, by) = (map(Fraction, case.nodes[node].tolist()) for node in ends)
        dx, dy = bx - ax, by - ay
        squared = dx * dx + dy * dy
        xi = ((px - ax) * dx + (py - ay) * dy) / squared
        clipped = min(max(xi, Fraction(0)), Fraction(1))
        distance = (px - ax - clipped * dx) ** 2 + (py - ay - clipped * dy) ** 2
        gap = (px - ax) * dy - (py - ay) * dx
        ranked.append((distance, (xi - clipped) ** 2 * squared, number, xi, (gap > 0) - (gap < 0)))
    nearest = sorted(entry for entry in ranked if entry[0] == min(ranked)[0])
    if nearest:  # A thousand segments take a plain loop too long.
        assert case.tied == tuple(number for _, _, number, _, _ in nearest)
        assert (case.squared_distance, case.xi, case.side) == (nearest[0][0], *nearest[0][3:])
    assert case.kind == kind
    assert not case.find_mistake(case.tied[-1])


def test_only_what_exceeds_roundoff_is_a_mistake() -> None:
    nodes, segments = np.array([[0.0, 0.0], [-1.0, 0.0], [-2.0, 0.0]]), np.array([[0, 1], [1, 2]])
    case = Projection.exact("by hand", (-0.5, 2.0**-52), nodes, segments)
    assert (case.tied, case.xi, case.side, case.squared_distance) == ((0,), Fraction(1, 2), 1, Fraction(1, 2**104))
    assert not case.find_mistake(0, xi=0.5 + 2**-53, side=-1, distance=2.0**-52)
    assert case.find_mistake(0, xi=0.5 + 2**-50).startswith("ξ = 0.5000000000000009, which is 0.5 ")
    assert case.find_mistake(0, xi=nan).startswith("ξ = nan")
    assert case.find_mistake(0, distance=-1.0).startswith("distance -1.0")
    assert case.find_mistake(1) == "segment 1, which is 0.5 farther than segment 0"
    assert case.find_mistake(-1) == "segment -1 of 2"
    high = Projection.exact("by hand", (-0.5, 0.25), nodes, segments)
    assert high.find_mistake(0, side=-1) == "side -1, where the gap is 0.25"
    assert not high.find_mistake(0, xi=0.5, side=1, distance=sqrt(high.squared_distance))


@pytest.mark.parametrize("kinds", [[], ["outer"]])
def test_kinds_that_do_not_exist_are_refused(kinds: list[str]) -> None:
    with pytest.raises(MisuseError, match=r"kinds: found .*; needed some of inside, free-end"):
        projections(kinds=kinds)
