"""The command `score`: how often, and by how much, a search for the nearest segment is wrong."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table
from rich.text import Text

from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.studies.queries.answers import Answers
    from contactverif.studies.queries.query_file import Queries
    from contactverif.studies.queries.query_scores import Score, Scores

_COLUMNS = {
    "wrong": "decisions with a segment that is not nearest, or a wrong sign of the gap",
    "sign": "wrong decisions about the sign alone: the gap exceeds 4u(L + |P − A|)",
    "mistakes": "wrong decisions that roundoff does not explain",
    "undecided": "queries to which the program says that it does not know",
    "ξ, distance": "worst errors over right segments, in units of u(L + |P − A|)/L and u(L + |P − A|)",
    "µs": "time of one decision",
}


def score(
    queries: Annotated[Path, typer.Argument(help="A file that queries --out FILE wrote.", metavar="QUERIES")],
    program: Annotated[
        list[str] | None,
        typer.Argument(
            help="Behind --, a program and its arguments: it reads queries from standard input and writes answers.",
            metavar="PROGRAM",
        ),
    ] = None,
    answers: Annotated[
        Path | None, typer.Option(help="Answers that a program wrote, instead of a program.", metavar="FILE")
    ] = None,
    built_in: Annotated[
        bool, typer.Option("--built-in", help="Score the search that plugins may use, instead of a program.")
    ] = False,
    exact: Annotated[
        Path | None, typer.Option(help="The exact answers. (default: QUERIES.exact.txt)", metavar="FILE")
    ] = None,
    at_most: Annotated[
        float | None, typer.Option(help="Exit with status 1 if more decisions a million are wrong.", metavar="N", min=0)
    ] = None,
) -> None:
    """Score the answers of a program, in any language, to projection queries.

    Prints for each kind of query the wrong decisions, the worst errors in
    units of roundoff, and the time of a decision. The time is what the program
    states in a line "# seconds S". If it states none, it is run with queries
    and without; the difference is the time, so its start does not count.

    \bExit status
      0  scored
      1  more decisions are wrong than --at-most allows
      2  the command line or a file is wrong; one line says what is needed

    \bExamples
      contactverif score queries.txt -- ./nearest_segment
      contactverif score queries.txt --answers mine.txt
      contactverif score queries.txt --built-in --at-most 20000
    """
    _check_one_source(program, answers, built_in)
    from contactverif.cli.console import say, show
    from contactverif.studies.queries.query_file import read_exact, read_queries
    from contactverif.studies.queries.query_making import exact_path
    from contactverif.studies.queries.query_scores import score_answers

    questions, fingerprint = read_queries(queries)
    truth = read_exact(exact or exact_path(queries), fingerprint, len(questions.queries))
    scores = score_answers(questions, truth, _answers(queries, questions, program, answers))
    show(_table(scores))
    show(_legend(scores))
    if at_most is not None and scores.total.wrong_per_million > at_most:
        say(f"wrong decisions a million: {scores.total.wrong_per_million:.0f}, but --at-most {at_most:g}")
        raise typer.Exit(1)


def _check_one_source(program: Sequence[str] | None, answers: Path | None, built_in: bool) -> None:
    """Refuse none or several of a program, a file of answers and the built-in search."""
    sources = [
        *([" ".join(program)] if program else []),
        *([f"--answers {answers}"] if answers is not None else []),
        *(["--built-in"] if built_in else []),
    ]
    if len(sources) != 1:
        needed = "one of -- PROGRAM, --answers FILE and --built-in"
        raise MisuseError("PROGRAM", " and ".join(sources) or "nothing", needed)


def _answers(path: Path, questions: Queries, program: Sequence[str] | None, answers: Path | None) -> Answers:
    """Return the answers of a file, of a program, or of the built-in search."""
    if answers is not None:
        from contactverif.studies.queries.answers import read_answers
        from contactverif.studies.queries.text_lines import TextLines

        return read_answers(TextLines.read(answers), questions)
    if program:
        from contactverif.studies.queries.answers import ask_program

        return ask_program(program, path)
    from contactverif.studies.queries.built_in_search import search_built_in

    return search_built_in(questions)


def _table(scores: Scores) -> Table:
    from contactverif.cli.console import plain_table

    numbers = ("queries", "wrong", "a million", "sign", "mistakes", "undecided", "ξ", "distance", "µs")
    table = plain_table(words=("kind",), numbers=numbers)
    for score in scores.kinds:
        table.add_row(*_cells(score))
    table.add_section()
    table.add_row(*_cells(scores.total), style="bold")
    return table


def _cells(score: Score) -> list[str]:
    counts = (score.wrong_signs, score.beyond_roundoff, score.undecided)
    return [
        score.kind,
        *map(str, (score.queries, score.wrong, f"{score.wrong_per_million:.0f}", *counts)),
        f"{score.worst_xi:.3g}",
        f"{score.worst_distance:.3g}",
        "–" if score.seconds_each is None else f"{1e6 * score.seconds_each:.3g}",
    ]


def _legend(scores: Scores) -> Text:
    """Return what the columns mean, and the first wrong decision of each kind."""
    width = max(map(len, _COLUMNS)) + 2
    lines = [f"  {name:{width}}{meaning}" for name, meaning in _COLUMNS.items()]
    if scores.total.other_rule:
        lines += ["", f"In {scores.total.other_rule} ties another segment was chosen than that of smallest overshoot."]
    if scores.first_wrong:
        lines += ["", "the first wrong decision of each kind", *(f"  {words}" for words in scores.first_wrong)]
    return Text("\n".join(lines))
