"""Queries of every kind with their exact answers: the same seed and number give the same queries, bit for bit."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from contactverif.contract.errors import MisuseError
from contactverif.oracle.exact_nearest import Nearest, nearest_segments
from contactverif.studies.queries.hard_kinds import HARD_KINDS
from contactverif.studies.queries.kinds import PLAIN_KINDS, Kind
from contactverif.studies.queries.query_file import ExactAnswer, Queries, Query, exact_text, queries_text
from contactverif.studies.queries.surfaces import RandomNumbers, Shape, Vector
from contactverif_reports.files import whole

KINDS = (*PLAIN_KINDS, *HARD_KINDS)
_MOST_QUERIES = 10**6
_MOST_DRAWS = 1000  # Surfaces drawn in a row without a point of the kind; more is a mistake in the kind.


def make_queries(seed: int, number: int) -> tuple[Queries, list[ExactAnswer]]:
    """Draw queries, about as many of each kind, and find the exact answer of each."""
    if not 0 <= seed < 2**63:
        raise MisuseError("seed", str(seed), "a number of at least 0, below 2^63")
    if not len(KINDS) <= number <= _MOST_QUERIES:
        needed = f"at least {len(KINDS)}, one query of each kind, and at most {_MOST_QUERIES}"
        raise MisuseError("-n", str(number), needed)
    surfaces: list[Shape] = []
    queries: list[Query] = []
    answers: list[ExactAnswer] = []
    for place, kind in enumerate(KINDS):
        share = number // len(KINDS) + (place < number % len(KINDS))
        for shape, points in _draw_kind(kind, RandomNumbers(seed, place), share):
            for point, nearest in points:
                queries.append(Query(len(surfaces), point, kind.name))
                answers.append(ExactAnswer.from_nearest(nearest))
            surfaces.append(shape)
    return Queries(tuple(surfaces), tuple(queries)), answers


def exact_path(path: Path) -> Path:
    """Return the name of the file of exact answers to a file of queries."""
    return path.with_suffix(f".exact{path.suffix}")


def write_queries(path: Path, seed: int, number: int) -> int:
    """Write the queries and, at `exact_path`, their exact answers; return the number of kinds."""
    queries, answers = make_queries(seed, number)
    meanings = [f"{kind.name}: {kind.meaning}" for kind in KINDS]
    questions = queries_text(queries, f"{number} queries of contactverif, seed {seed}, of these kinds:", *meanings)
    about = f"exact answers to {number} queries of contactverif, seed {seed}"
    for file, text in ((path, questions), (exact_path(path), exact_text(answers, questions, about))):
        with whole(file) as part:
            part.write_text(text, encoding="utf-8")
    return len(KINDS)


def _draw_kind(kind: Kind, random: RandomNumbers, number: int) -> Iterator[tuple[Shape, list[tuple[Vector, Nearest]]]]:
    """Yield surfaces with points of one kind and their exact answers, that many points in all."""
    missing, failures = number, 0
    while missing:
        shape, points = kind.draw(random)
        answers = [(point, nearest_segments(shape.nodes, shape.segments, point)) for point in points]
        suitable = [(point, nearest) for point, nearest in answers if kind.holds(shape, point, nearest)][:missing]
        if suitable:
            yield shape, suitable
            missing -= len(suitable)
        failures = 0 if suitable else failures + 1
        if failures > _MOST_DRAWS:
            raise RuntimeError(f"the kind {kind.name} draws surfaces without a point of its kind")
