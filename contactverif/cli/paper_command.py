"""The command `paper`: the reference paper's tables and figures, computed again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from contactverif.contract.errors import MisuseError


def paper(
    out: Annotated[str, typer.Option(help="Write to this folder; it is made if needed.", metavar="FOLDER")] = "paper",
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            "-j",
            help="Number of processes that share the work; the results are the same. (default: at most 2)",
            metavar="N",
        ),
    ] = None,
) -> None:
    """Compute the reference paper's tables and figures again.

    The paper is Zavarise & De Lorenzis, Int. J. Numer. Meth. Engng 79 (2009)
    379–416. The command writes paper.html, one page with all results beside
    what the paper says; paper.nc, the numbers; and each figure as SVG. It
    takes a minute or two; one item takes half of it, so that more than two
    processes gain nothing.

    \bExit status
      0  written; the page says where the results agree with the paper
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif paper
      contactverif paper --out reports/paper
    """
    from contactverif_paper.paper_page import check_folder, summary, write

    if not out:  # as an unset variable of the shell gives it
        raise MisuseError("--out", "''", "the name of a folder")
    folder = Path(out).absolute()  # a plugin may change the working folder
    check_folder(folder)  # before the slow import of what computes
    from contactverif.cli.console import say
    from contactverif.cli.progress import Bar
    from contactverif.run.worker_pool import CASES_A_WORKER, check_jobs, default_jobs, worker_pool
    from contactverif_paper import compute, steps

    n_jobs = default_jobs(2 * CASES_A_WORKER) if jobs is None else check_jobs(jobs)
    n_finished, n_planned = 0, steps()
    with worker_pool(n_jobs) as executor, Bar() as bar:

        def report_step(description: str) -> None:
            nonlocal n_finished
            bar.update(description, n_finished, max(n_planned, n_finished))
            n_finished += 1

        results = compute(report_step, executor=executor)
        paths = write(results, folder, report_step)
    say(summary(results))
    say(f"{len(paths)} files in {out}, to begin with: {Path(out) / paths[-1].name}")
