"""The option `--last-failed`: what failed in earlier runs is asked again, and nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.cli.verify_job import VerifyJob


def ask_what_failed(job: VerifyJob) -> int:
    """Judge what a job remembers, show what became of it, and return 1 if a promise is not kept, else 0."""
    from contactverif.cli.console import show
    from contactverif.cli.run_endings import show_what_plugins_printed
    from contactverif.cli.run_screen import RunScreen
    from contactverif.run.failure_memory import FailureMemory
    from contactverif.run.run import run_failures

    options = {
        "--out": job.files.names and not job.resumes,
        "--resume": job.resumes,
        "a mesh or a scene": job.place is not None,
    }
    if others := [option for option, is_there in options.items() if is_there]:
        raise MisuseError("--last-failed", f"{' and '.join(others)} beside it", "--last-failed alone")
    names, memory = (job.options.names, job.options.properties), FailureMemory()
    failures = memory.recall(*names)
    if not failures:
        words = f"no failure of {', '.join(map(repr, job.options.names))} in .contactverif"
        raise MisuseError("--last-failed", words, "a run of `verify` here in which something fails")
    plugins = job.load()
    provenance = {"asked": "what failed in earlier runs"}
    result = run_failures((*plugins.subjects, *plugins.questions), failures, provenance)
    memory.update(result.rows)
    show_what_plugins_printed()
    show(RunScreen(result))
    left = len(memory.recall(*names))  # What cannot be judged now is left, too.
    show(f"{left} of {len(failures)} failures of earlier runs are left.")
    return 0 if result.promises_kept else 1
