"""The answers of a program under test, in any language: one line for each query, read from a file or from the program.

`docs/how-to/score-your-search.md` describes the lines. Whatever is wrong with one is one error that names the line. A
number that is NaN or infinite is an answer, and a bad one. A clock is read here, and no decision depends on it.
"""

from __future__ import annotations

import resource
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import perf_counter

from contactverif.contract.errors import MisuseError
from contactverif.studies.queries.query_file import Queries, queries_text, read_queries
from contactverif.studies.queries.text_lines import Line, TextLines

UNKNOWN = "?"
_FORM = "QUERY SEGMENT SIGN XI DISTANCE, or QUERY ?"
_LONGEST = 600  # Seconds that a program may run.
_MOST_BYTES = 10_000_000  # A program may write so many besides a hundred times the length of its questions.
_RUNS = 5  # The fastest of these runs counts, with and without queries: what disturbs a machine only adds time.


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
    """Read the answer to each query, and the seconds that comments `# seconds [KIND] S` state."""
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


def ask_program(command: Sequence[str], path: Path) -> Answers:
    """Run a program on a file of queries.

    If the program states no seconds, it is run several times more: on the file, and on its surfaces without any query.
    The difference of the fastest runs is the time of all decisions, with the reading and writing of their lines. So the
    start of the program, and whatever it prepares for the surfaces, does not count.
    """
    text = path.read_bytes()
    queries, _ = read_queries(path)
    answers = read_answers(TextLines(f"the output of {command[0]}", _run(command, text)), queries)
    if answers.seconds:
        return answers
    bare = queries_text(Queries(queries.surfaces, ())).encode()
    with_queries, without = (min(_time(command, part) for _ in range(_RUNS)) for part in (text, bare))
    return replace(answers, seconds={"": max(0.0, with_queries - without)})


def _run(command: Sequence[str], text: bytes) -> str:
    """Return what the program writes for a text."""
    most_bytes = _MOST_BYTES + 100 * len(text)
    try:
        with tempfile.TemporaryFile() as answers:
            finished = subprocess.run(
                command,
                input=text,
                stdout=answers,
                stderr=subprocess.PIPE,
                check=False,
                timeout=_LONGEST,
                # A program that writes without end is stopped by the largest size of its file.
                preexec_fn=partial(resource.setrlimit, resource.RLIMIT_FSIZE, (most_bytes, most_bytes)),
            )
            answers.seek(0)
            output = answers.read().decode(errors="replace")
    except OSError as error:
        raise MisuseError("PROGRAM", f"{command[0]}: {error.strerror}", "a program that can be started") from error
    except subprocess.TimeoutExpired:
        raise MisuseError("PROGRAM", f"{command[0]}, which does not end within {_LONGEST} s", "one that ends") from None
    if finished.returncode == -signal.SIGXFSZ:
        raise MisuseError("PROGRAM", f"{command[0]}, which does not stop to write", "one answer for each query")
    if finished.returncode:
        last = finished.stderr.decode(errors="replace").strip().splitlines()[-1:]
        words = f"{command[0]}, which ends with status {finished.returncode}" + "".join(f": {line}" for line in last)
        raise MisuseError("PROGRAM", words, "a program that answers all queries and ends with status 0")
    return output


def _time(command: Sequence[str], text: bytes) -> float:
    """Return the seconds that a program runs."""
    start = perf_counter()
    _run(command, text)
    return perf_counter() - start
