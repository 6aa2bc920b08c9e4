"""A program under test: it reads queries from standard input and writes answers to standard output.

Rule for the next editor: a clock is read here and nowhere else in this folder, and no decision depends on it.
"""

from __future__ import annotations

import resource
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import perf_counter

from contactverif.contract.errors import MisuseError
from contactverif.studies.queries.answer_file import Answers, read_answers
from contactverif.studies.queries.query_file import Queries, queries_text, read_queries
from contactverif.studies.queries.text_lines import TextLines

_LONGEST = 600  # Seconds that a program may run.
_MOST_BYTES = 10_000_000  # A program may write so many besides a hundred times the length of its questions.
_RUNS = 5  # The fastest of these runs counts, with and without queries: what disturbs a machine only adds time.


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
    try:
        with tempfile.TemporaryFile() as answers:
            finished = subprocess.run(
                command,
                input=text,
                stdout=answers,
                stderr=subprocess.PIPE,
                check=False,
                timeout=_LONGEST,
                preexec_fn=partial(_limit_output, _MOST_BYTES + 100 * len(text)),
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


def _limit_output(n_bytes: int) -> None:
    """Limit the size of a file that this process writes, so that a program that writes without end is stopped."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (n_bytes, n_bytes))


def _time(command: Sequence[str], text: bytes) -> float:
    """Return the seconds that a program runs."""
    start = perf_counter()
    _run(command, text)
    return perf_counter() - start
