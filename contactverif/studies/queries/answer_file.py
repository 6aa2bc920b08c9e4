"""The file of answers that a program under test writes, in any language: one line for each query.

`docs/how-to/score-your-search.md` describes it. Rule for the next editor: whatever is wrong with a line is one error
that names the line, what is there and what is needed. A number that is NaN or infinite is an answer, and a bad one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from contactverif.contract.errors import MisuseError
from contactverif.studies.queries.query_file import Queries
from contactverif.studies.queries.text_lines import Line, TextLines

UNKNOWN = "?"
_FORM = "QUERY SEGMENT SIGN XI DISTANCE, or QUERY ?"


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer of a program to a query; None where the program says that it does not know."""

    segment: int | None  # The nearest segment.
    sign: int | None = None  # The sign of the gap: −1 inside the body, 0 on the surface, +1 outside.
    xi: float | None = None  # The foot on the segment's line, unclipped.
    distance: float | None = None  # The distance to the closed segment, a length.


@dataclass(frozen=True, slots=True)
class Answers:
    """The answers of a program to all queries, in their order."""

    answers: list[Answer]  # One for each query.
    # {kind: the seconds that its queries took}, as far as the program says so; "" stands for all kinds together.
    seconds: Mapping[str, float]


def read_answers(lines: TextLines, queries: Queries) -> Answers:
    """Read the answers of a program.

    Returns
    -------
    Answers
        One answer for each query, and the seconds that comments `# seconds [KIND] S` state.
    """
    count = len(queries.queries)
    by_query: dict[int, Answer] = {}
    for line in lines.rest():
        number = line.integer(0, low=0, high=count - 1)
        if number in by_query:
            raise MisuseError(line.place, f"a second answer to query {number}", "one answer to each query")
        by_query[number] = _read_answer(line, len(queries.surfaces[queries.queries[number].surface].segments))
    if len(by_query) < count:
        missing = next(number for number in range(count) if number not in by_query)
        raise MisuseError(
            lines.name, f"{len(by_query)} answers and none to query {missing}", f"answers to all {count} queries"
        )
    return Answers([by_query[number] for number in range(count)], _read_seconds(lines.comments, queries))


def _read_answer(line: Line, n_segments: int) -> Answer:
    """Read what follows the number of the query."""
    words = line.words
    if words[1:] == [UNKNOWN]:
        return Answer(None)
    if len(words) != 5:
        raise line.error(_FORM)
    if words[1] == UNKNOWN:
        return Answer(None)
    sign = None if words[2] == UNKNOWN else line.integer(2, low=-1, high=1)
    xi, distance = (None if words[place] == UNKNOWN else line.real(place) for place in (3, 4))
    if distance is not None and distance < 0:
        raise MisuseError(line.place, repr(words[4]), "a distance of at least 0; SIGN says on which side")
    return Answer(line.integer(1, low=0, high=n_segments - 1), sign, xi, distance)


def _read_seconds(comments: list[Line], queries: Queries) -> dict[str, float]:
    """Return the seconds that comments state."""
    kinds = {query.kind for query in queries.queries}
    seconds: dict[str, float] = {}
    for line in comments:
        match line.words:
            case ["seconds", _]:
                seconds[""] = _read_time(line, 1)
            case ["seconds", kind, _] if kind in kinds:
                seconds[kind] = _read_time(line, 2)
            case ["seconds", *_]:
                raise line.error("# seconds S, or # seconds KIND S with a kind of the queries")
    return seconds


def _read_time(line: Line, place: int) -> float:
    """Return a word as a time."""
    value = line.finite(place)
    if value < 0:
        raise MisuseError(line.place, repr(line.words[place]), "a time of at least 0 s")
    return value
