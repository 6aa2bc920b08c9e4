"""The two files of queries: the questions for a program, and the exact answers that score it.

Both are plain text, so that a few lines of C or Fortran read them. Decimal numbers are the shortest that read back as
the same double; exact numbers are `p/q`. `docs/how-to/score-your-search.md` describes every line.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Surface
from contactverif.oracle.exact_nearest import Nearest
from contactverif.studies.queries.surfaces import Shape, Vector
from contactverif.studies.queries.text_lines import Line, TextLines

FORMAT = 1  # The number of the format in the first line of both files.
_QUERIES, _EXACT = "contactverif-queries", "contactverif-exact"


@dataclass(frozen=True, slots=True)
class Query:
    """A point whose nearest segment is asked for."""

    surface: int
    point: Vector
    kind: str


@dataclass(frozen=True, slots=True, eq=False)
class Queries:
    """Surfaces, and points to project onto them. The number of a query is its place."""

    surfaces: tuple[Shape, ...]
    queries: tuple[Query, ...]


@dataclass(frozen=True, slots=True)
class ExactSegment:
    """A nearest segment of a query."""

    segment: int
    xi: Fraction  # The foot on the segment's line, unclipped: 0 at its first node, 1 at its second.
    # The square of the gap at the nearest point, negative inside the body. At a node it belongs to the segment with
    # the smaller overshoot of the two that meet there.
    signed_squared_gap: Fraction


@dataclass(frozen=True, slots=True)
class ExactAnswer:
    """The exact answer to a query."""

    squared_distance: Fraction  # The square of the distance.
    # All segments at this distance, the one with the smallest overshoot first, then by number.
    segments: tuple[ExactSegment, ...]
    n_first: int  # The number of segments that have the smallest overshoot; more than one is a tie by any rule.

    @classmethod
    def from_nearest(cls, nearest: Nearest) -> ExactAnswer:
        """Return what the file says of the nearest segments."""
        segments = (
            ExactSegment(near.segment, near.xi, nearest.signed_squared_gap_at(near)) for near in nearest.segments
        )
        return cls(nearest.squared_distance, tuple(segments), nearest.n_undecided)


def queries_text(queries: Queries, *comments: str) -> str:
    """Return the text of the file of questions, with comments below its first line."""
    lines = [f"{_QUERIES} {FORMAT} {len(queries.surfaces)} {len(queries.queries)}", *(f"# {text}" for text in comments)]
    for number, shape in enumerate(queries.surfaces):
        lines.append(f"surface {number} {len(shape.nodes)} {len(shape.segments)}")
        lines += [f"{x!r} {y!r}" for x, y in shape.nodes.tolist()]
        lines += [f"{first} {second}" for first, second in shape.segments.tolist()]
    for number, query in enumerate(queries.queries):
        lines.append(f"query {number} {query.surface} {query.point[0]!r} {query.point[1]!r} {query.kind}")
    return "\n".join(lines) + "\n"


def exact_text(answers: Sequence[ExactAnswer], questions: str, *comments: str) -> str:
    """Return the text of the file of exact answers to the questions in a text."""
    fingerprint = _fingerprint(TextLines("", questions))
    lines = [f"{_EXACT} {FORMAT} {len(answers)} {fingerprint}", *(f"# {text}" for text in comments)]
    for number, answer in enumerate(answers):
        words = [str(number), str(len(answer.segments)), str(answer.n_first), str(answer.squared_distance)]
        for near in answer.segments:
            words += [str(near.segment), str(near.xi), str(near.signed_squared_gap)]
        lines.append(" ".join(words))
    return "\n".join(lines) + "\n"


def read_queries(path: Path) -> tuple[Queries, str]:
    """Return the questions, and the fingerprint by which exact answers say that they belong to them."""
    lines = TextLines.read(path)
    n_surfaces, n_queries = _counts(lines, _QUERIES, 2)
    surfaces = tuple(_read_surface(lines, number) for number in range(n_surfaces))
    queries = tuple(_read_query(lines, number, n_surfaces) for number in range(n_queries))
    lines.expect_end()
    return Queries(surfaces, queries), _fingerprint(TextLines.read(path))


def read_exact(path: Path, fingerprint: str, number: int) -> list[ExactAnswer]:
    """Read the exact answers to the questions with this fingerprint and number."""
    lines = TextLines.read(path)
    first = lines.next(f"{_EXACT} {FORMAT} {number} {fingerprint}")
    if first.words != [_EXACT, str(FORMAT), str(number), fingerprint]:
        raise first.error(f"the line {_EXACT} {FORMAT} {number} {fingerprint} of the answers to these queries")
    answers = [_read_answer(lines, place) for place in range(number)]
    lines.expect_end()
    return answers


def _counts(lines: TextLines, title: str, n_counts: int) -> list[int]:
    """Return the numbers in the first line of a file."""
    needed = f"{title} {FORMAT} and {n_counts} numbers"
    line = lines.next(needed)
    if line.words[:2] != [title, str(FORMAT)] or len(line.words) != 2 + n_counts:
        raise line.error(needed)
    return [line.integer(2 + place, low=0) for place in range(n_counts)]


def _read_surface(lines: TextLines, number: int) -> Shape:
    """Read a surface: its line, its nodes, its segments."""
    head = lines.next(f"surface {number} NODES SEGMENTS")
    if head.words[:2] != ["surface", str(number)] or len(head.words) != 4:
        raise head.error(f"surface {number} NODES SEGMENTS")
    n_nodes, n_segments = head.integer(2, low=2), head.integer(3, low=1)
    nodes, segments = np.empty((n_nodes, 2)), np.empty((n_segments, 2), dtype=np.int64)
    for node in range(n_nodes):
        line = lines.next("X Y", length=2)
        nodes[node] = line.finite(0), line.finite(1)
    for segment in range(n_segments):
        line = lines.next("FIRST SECOND, the nodes of a segment", length=2)
        segments[segment] = line.integer(0, low=0, high=n_nodes - 1), line.integer(1, low=0, high=n_nodes - 1)
    try:
        return Shape(nodes, Surface(segments))
    except MisuseError as error:
        raise MisuseError(head.place, error.found, error.needed) from error


def _read_query(lines: TextLines, number: int, n_surfaces: int) -> Query:
    """Read a query."""
    form = f"query {number} SURFACE X Y KIND"
    line = lines.next(form, length=6)
    if line.words[:2] != ["query", str(number)]:
        raise line.error(form)
    return Query(line.integer(2, low=0, high=n_surfaces - 1), (line.finite(3), line.finite(4)), line.words[5])


def _read_answer(lines: TextLines, number: int) -> ExactAnswer:
    """Read an exact answer."""
    form = f"{number} TIED FIRST SQUARED_DISTANCE and SEGMENT XI SIGNED_SQUARED_GAP for each tied segment"
    line = lines.next(form)
    if line.words[0] != str(number) or len(line.words) < 7 or len(line.words) != 4 + 3 * line.integer(1, low=1):
        raise line.error(form)
    segments = tuple(_exact_segments(line))
    return ExactAnswer(line.fraction(3), segments, line.integer(2, low=1, high=len(segments)))


def _exact_segments(line: Line) -> Iterator[ExactSegment]:
    """Yield the segments of a line of exact answers."""
    for place in range(4, len(line.words), 3):
        yield ExactSegment(line.integer(place, low=0), line.fraction(place + 1), line.fraction(place + 2))


def _fingerprint(lines: TextLines) -> str:
    """Return the SHA-256 of the words of a file, so that comments and ends of lines do not count."""
    digest = hashlib.sha256()
    for line in lines.rest():
        digest.update(" ".join(line.words).encode() + b"\n")
    return digest.hexdigest()
