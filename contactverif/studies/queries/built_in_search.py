"""An adapter that lets our own search answer queries: `contactverif.geometry.projection.nearest_segment`.

It is the one file of this folder that imports the compiled geometry. What is exact here shares no code with it.
"""

from __future__ import annotations

from time import perf_counter

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.geometry.compiled import compile_kernel
from contactverif.geometry.projection import (
    PointOnSegment,
    distance_to_segment,
    minus,
    nearest_segment,
    node,
    search_tree,
)
from contactverif.studies.queries.answers import Answer, Answers
from contactverif.studies.queries.query_file import Queries

_RUNS = 5  # The fastest of these runs counts: what disturbs a machine only adds time.
# The arguments of the kernel.
_Arrays = tuple[IntArray, FloatArray, FloatArray, FloatArray, IntArray, IntArray, FloatArray, IntArray]


@compile_kernel
def _search(
    nearest: IntArray,
    values: FloatArray,
    points: FloatArray,
    x: FloatArray,
    segments: IntArray,
    order: IntArray,
    boxes: FloatArray,
    begins: IntArray,
) -> None:
    """Write the nearest segment (n_points,) of each point, and gap, ξ and distance (n_points, 3).

    The arrays hold one surface behind the other; row s of `begins` (n_surfaces + 1, 5) says where points, nodes,
    segments, places of the order and boxes of surface s begin.
    """
    for surface in range(len(begins) - 1):
        begin, end = begins[surface], begins[surface + 1]
        here, pairs = x[begin[1] : end[1]], segments[begin[2] : end[2]]
        places, tree = order[begin[3] : end[3]], boxes[begin[4] : end[4]]
        for place in range(begin[0], end[0]):
            p = (points[place, 0], points[place, 1])
            segment = nearest_segment(PointOnSegment(p, p, -1.0), here, pairs, places, tree)
            first, second = node(here, pairs[segment, 0]), node(here, pairs[segment, 1])
            along, towards = minus(second, first), minus(p, first)
            squared = along[0] * along[0] + along[1] * along[1]
            nearest[place] = segment
            values[place, 0] = (towards[0] * along[1] - towards[1] * along[0]) / np.sqrt(squared)
            values[place, 1] = (towards[0] * along[0] + towards[1] * along[1]) / squared
            values[place, 2] = np.sqrt(distance_to_segment(p, (0.0, 0.0), first, second)[0])


def search_built_in(queries: Queries) -> Answers:
    """Answer all queries by the search that plugins may use.

    The trees of the surfaces are ready and the kernel is compiled before the clock starts.
    """
    by_kind: dict[str, dict[int, list[int]]] = {}
    for number, query in enumerate(queries.queries):
        by_kind.setdefault(query.kind, {}).setdefault(query.surface, []).append(number)
    answers = [Answer(None)] * len(queries.queries)
    seconds = {}
    for kind, by_surface in by_kind.items():
        arrays = nearest, values, *_ = _arrays(queries, by_surface)
        _search(*arrays)
        seconds[kind] = min(_time(arrays) for _ in range(_RUNS))
        numbers = [number for some in by_surface.values() for number in some]
        for number, segment, (gap, xi, distance) in zip(numbers, nearest.tolist(), values.tolist(), strict=True):
            answers[number] = Answer(segment, (gap > 0) - (gap < 0), xi, distance)
    return Answers(answers, seconds)


def _time(arrays: _Arrays) -> float:
    """Return the seconds of one search."""
    start = perf_counter()
    _search(*arrays)
    return perf_counter() - start


def _arrays(queries: Queries, by_surface: dict[int, list[int]]) -> _Arrays:
    """Return the arguments of the kernel for the queries of each surface."""
    columns = []
    for surface, numbers in by_surface.items():
        shape = queries.surfaces[surface]
        points = np.array([queries.queries[number].point for number in numbers])
        columns.append((points, shape.nodes, shape.segments, *search_tree(shape.surface, shape.nodes)))
    lengths = np.array([[0] * 5, *([len(array) for array in arrays] for arrays in columns)], dtype=np.int64)
    points, x, segments, order, boxes = (np.concatenate(column) for column in zip(*columns, strict=True))
    nearest, values = np.empty(len(points), dtype=np.int64), np.empty((len(points), 3))
    return nearest, values, points, x, segments, order, boxes, lengths.cumsum(axis=0)
