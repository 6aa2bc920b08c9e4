"""The work of `paper`: the reference paper's tables and figures, computed again."""

from pathlib import Path

from contactverif.cli.console import echo
from contactverif.cli.progress import Bar
from contactverif.contract.errors import MisuseError
from contactverif.run.worker_pool import CASES_A_WORKER, check_jobs, default_jobs, worker_pool
from contactverif_paper import compute, steps
from contactverif_paper.paper_page import check_folder, summary, write


def paper(out: str, jobs: int | None) -> None:
    """Compute everything and write it to a folder."""
    if not out:  # as an unset variable of the shell gives it
        raise MisuseError("--out", "''", "the name of a folder")
    folder = Path(out).absolute()  # a plugin may change the working folder
    check_folder(folder)
    n_jobs = default_jobs(2 * CASES_A_WORKER) if jobs is None else check_jobs(jobs)
    n_finished, n_planned = 0, steps()
    with worker_pool(n_jobs) as executor, Bar() as bar:

        def report_step(description: str) -> None:
            nonlocal n_finished
            bar.update(description, n_finished, max(n_planned, n_finished))
            n_finished += 1

        results = compute(report_step, executor=executor)
        paths = write(results, folder, report_step)
    echo(summary(results))
    echo(f"{len(paths)} files in {out}, to begin with: {Path(out) / paths[-1].name}")
