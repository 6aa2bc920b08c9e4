"""The option `--last-failed`: what failed in earlier runs is asked again, and nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.cli.verify_job import VerifyJob
    from contactverif.contract.result import Row
    from contactverif.run.failure_memory import FailureMemory


def ask_what_failed(job: VerifyJob) -> int:
    """Judge the remembered failures of a job, show what became of them, and return 1 if one fails again, else 0."""
    from contactverif.cli.console import show
    from contactverif.cli.run_endings import show_what_plugins_printed
    from contactverif.cli.run_screen import RunScreen
    from contactverif.contract.result import Run
    from contactverif.run.failure_memory import FAILED, FailureMemory

    memory = FailureMemory()
    rows = _judge(job, memory)
    memory.update(rows)
    show_what_plugins_printed()
    show(RunScreen(Run(tuple(rows), provenance={"asked": "what failed in earlier runs"})))
    count = sum(row.verdict in FAILED for row in rows)
    show(f"{count} of {len(rows)} cases that failed in earlier runs fail again.")
    return 1 if count else 0


def _judge(job: VerifyJob, memory: FailureMemory) -> list[Row]:
    """Return the row of each remembered failure of a job that is asked of the formulation."""
    from contactverif.contract.property import Property
    from contactverif.contract.subject import Subject
    from contactverif.run.judge import judge_if_applicable
    from contactverif.run.rows import row_of_case

    failures = memory.recall(job.options.names, job.options.properties)
    if not failures:
        needed = "a run of `verify` here in which something fails"
        raise MisuseError(
            "--last-failed", f"no failure of {', '.join(map(repr, job.options.names))} in .contactverif", needed
        )
    plugins = job.load()
    subjects = {item.name: item for item in plugins.subjects if isinstance(item, Subject)}
    questions = {item.id: item for item in plugins.questions if isinstance(item, Property)}
    rows = []
    for (name, property_id), case in failures.items():
        if name in subjects and property_id in questions:
            subject, question = subjects[name], questions[property_id]
            rows.append(row_of_case(question, subject, judge_if_applicable(question, case, subject)))
    return rows
