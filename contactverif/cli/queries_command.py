"""The command `queries`: a file of projection queries, and the file of their exact answers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from contactverif.cli.output_files import OutputFiles

_TEXT = ".txt"


def queries(
    out: Annotated[
        Path, typer.Option(help="Write the queries to FILE.txt, their exact answers to FILE.exact.txt.", metavar="FILE")
    ],
    seed: Annotated[int, typer.Option(help="The same seed gives the same files, bit for bit.", metavar="N")] = 0,
    number: Annotated[int, typer.Option("-n", "--number", help="Number of queries.", metavar="N")] = 10_000,
) -> None:
    """Write projection queries to score a search by, and their exact answers.

    A query is a point and a surface: which segment is nearest, where is the
    foot, and on which side is the point? There are about as many queries of
    each kind: inside a segment, past a free end, at a vertex, in a tie or
    next to one, far from the origin, in a chain of a thousand segments. The
    answers are rational numbers. Both files are plain text, which a few lines
    of C or Fortran read; score compares the answers of a program with them.

    \bExit status
      0  written
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif queries --out queries.txt
      contactverif queries --out more.txt --seed 7 -n 100000
    """
    files = OutputFiles.check([out], (_TEXT,))
    path = files.paths[_TEXT]
    from contactverif.cli.console import say
    from contactverif.studies.queries.query_making import exact_path, write_queries

    kinds = write_queries(path, seed, number)
    say(f"queries: {out}, {number} of {kinds} kinds")
    say(f"exact answers: {exact_path(out)}")
