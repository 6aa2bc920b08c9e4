"""Searches that answer queries in floats: a plain right one, and some that are wrong on purpose."""

from collections.abc import Callable
from typing import Any

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.studies.queries.answers import Answer, Answers
from contactverif.studies.queries.query_file import Queries
from contactverif.studies.queries.surfaces import Shape

Search = Callable[[Shape, FloatArray], Answer]


def answer_all(queries: Queries, search: Search) -> Answers:
    """Return the answers of a search."""
    points = [np.array(query.point) for query in queries.queries]
    with np.errstate(all="ignore"):  # A wrong search may overflow, and that is its answer.
        answers = [search(queries.surfaces[query.surface], p) for query, p in zip(queries.queries, points, strict=True)]
    return Answers(answers, {})


def plain_search(shape: Shape, p: FloatArray) -> Answer:
    """Look at every segment, differences first."""
    return search_among(shape, p, np.arange(len(shape.segments)))


def search_at_nearest_node(shape: Shape, p: FloatArray) -> Answer:
    """Look at the segments of the nearest node alone, as much code does."""
    node = np.argmin(np.hypot(*(shape.nodes - p).T))
    return search_among(shape, p, np.flatnonzero((shape.segments == node).any(axis=1)))


def search_from_origin(shape: Shape, p: FloatArray) -> Answer:
    """Form the gap from absolute coordinates, n · x − n · a."""
    right = plain_search(shape, p)
    a, b = shape.nodes[shape.segments[right.segment]]
    n = np.array([b[1] - a[1], a[0] - b[0]]) / np.hypot(*(b - a))
    gap = n @ p - n @ a
    return Answer(right.segment, int(np.sign(gap)), right.xi, abs(gap))


def search_in_single_precision(shape: Shape, p: FloatArray) -> Answer:
    """Round all coordinates to 32 bits."""
    return plain_search(Shape(shape.nodes.astype(np.float32).astype(float), shape.surface), p.astype(np.float32))


def search_with_epsilon(shape: Shape, p: FloatArray) -> Answer:
    """Take every gap below 1e-10 for none."""
    right = plain_search(shape, p)
    return Answer(right.segment, 0 if (right.distance or 0.0) < 1e-10 else right.sign, right.xi, right.distance)


def search_with_clipped_xi(shape: Shape, p: FloatArray) -> Answer:
    """Report the nearest place of the segment instead of the foot on its line."""
    right = plain_search(shape, p)
    return Answer(right.segment, right.sign, min(max(right.xi or 0.0, 0.0), 1.0), right.distance)


def search_without_overshoot(shape: Shape, p: FloatArray) -> Answer:
    """Take the segment with the highest number in a tie, and the side of its line."""
    return search_among(shape, p, np.arange(len(shape.segments))[::-1], overshoot_counts=False)


def search_among(shape: Shape, p: FloatArray, numbers: Any, *, overshoot_counts: bool = True) -> Answer:
    """Return the nearest of some segments; in a tie the one with the smallest overshoot, then the first."""
    a, b = (shape.nodes[shape.segments[numbers, end]] for end in range(2))
    d, r, q = b - a, p - a, p - b
    squared, along, across = (d * d).sum(1), (r * d).sum(1), r[:, 0] * d[:, 1] - r[:, 1] * d[:, 0]
    before, behind = along <= 0, along >= squared
    distance = np.where(before, (r * r).sum(1), np.where(behind, (q * q).sum(1), across**2 / squared))
    past = np.where(before, -along, np.where(behind, along - squared, 0.0)) / np.sqrt(squared)
    best = np.lexsort((past * overshoot_counts, distance))[0]
    return Answer(
        int(numbers[best]), int(np.sign(across[best])), along[best] / squared[best], float(np.sqrt(distance[best]))
    )
