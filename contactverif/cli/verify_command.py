"""The command `verify`: it checks every property of some formulations and shows a table, drawings and files."""

from __future__ import annotations

import gc
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from contactverif.api.run_files import REPORT, run_writers
from contactverif.api.settings import read_settings
from contactverif.cli.annotations import annotate
from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.last_failed import ask_what_failed
from contactverif.cli.output_files import PictureFolder
from contactverif.cli.run_endings import (
    End,
    end_run,
    say_how_many_were_stored,
    say_how_to_go_on,
    say_where_plugins_ran,
    show_what_plugins_printed,
    watch_for_stops,
)
from contactverif.cli.shared_options import (
    RESULT_FILES,
    FailureOptions,
    PlaceOptions,
    PropertyGlobs,
    SamplingOptions,
    ScreenOptions,
    SubjectOptions,
    WorkerOptions,
    with_engines,
)
from contactverif.cli.verify_job import VerifyJob, VerifyOptions, new_job, resumed_job
from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.cli.verify_job import Plugins
    from contactverif.contract.result import Run
    from contactverif.isolation.limits import Limits


def verify(
    *,
    subjects: SubjectOptions,
    properties: PropertyGlobs = None,
    sampling: SamplingOptions,
    out: Annotated[list[Path] | None, RESULT_FILES] = None,
    pictures: Annotated[
        Path | None, typer.Option(help="Draw each counterexample into this folder.", metavar="FOLDER")
    ] = None,
    failures: FailureOptions,
    place: PlaceOptions,
    workers: WorkerOptions,
    isolation: IsolationOptions,
    screen: ScreenOptions,
    resume: Annotated[
        Path | None, typer.Option(help="Go on with the run that was to write FILE and was stopped.", metavar="FILE")
    ] = None,
) -> None:
    """Check every property of a formulation, and draw what fails.

    What is wrong comes first, then what is kept, in few lines. Progress goes
    to standard error.

    With --out, every outcome goes to the folder FILE.journal as soon as it is
    there, and --resume FILE goes on with a run that was stopped or killed.
    The folder goes when FILE is complete.

    What fails is kept in `.contactverif` here, and is asked first in the next
    run; it goes once it passes.

    \bExit status
      0  every promise is kept, and every property was judged
      1  a promise is broken, a property could not be judged, or a plugin
         does not load
      2  the command line is wrong, or a file cannot be written; one line
         says what is needed
      130  stopped by Ctrl-C, after the table of what was judged

    \bExamples
      contactverif verify vts-ppt --out vts-ppt.nc --out vts-ppt.html
      contactverif verify nts -p 'patch.*' --seed 7
      contactverif verify mine --mesh punch.msh --slave punch --master base
      contactverif verify vts-me --scene c -p 'patch.*'
      contactverif verify --engine control -p patch.flat.solve
      contactverif verify --resume vts-ppt.nc
      contactverif verify mine --last-failed
    """
    typed = VerifyOptions(
        tuple(with_engines(subjects.names, subjects.engines)),
        tuple(properties or ()),
        sampling,
        tuple(out or ()),
        pictures,
        tuple(failures.known or ()),
        failures.keep_going,
        place,
        workers,
        isolation,
    )
    workers.prepare(every_property=not properties)
    settings = read_settings()
    if resume is not None:
        job = resumed_job(resume, typed)
    else:
        selected = tuple(select_names([*typed.names], subjects.all_, isolation.limits()))
        job = new_job(replace(typed, names=selected).with_settings(settings))
    if failures.last_failed:
        raise typer.Exit(ask_what_failed(job))
    raise typer.Exit(run_job(job, screen, memory=settings.memory and not failures.no_memory))


def run_job(job: VerifyJob, screen: ScreenOptions, *, memory: bool = False) -> int:
    """Judge what a job says, show the tables and write the files; return the exit status.

    With a memory, what failed in earlier runs is asked first. On a mesh or a scene of the user's there is none.
    """
    from contactverif.cli.progress import Bar
    from contactverif.run.failure_memory import FailureMemory
    from contactverif.run.rows import find_missing
    from contactverif.run.run import run
    from contactverif.run.worker_pool import worker_pool

    failures = FailureMemory() if memory and job.place is None else None
    with watch_for_stops(job), ExitStack() as stack:
        with worker_pool(job.jobs) as executor, Bar() as bar:
            plugins, store = stack.enter_context(job.begin(partial(job.load, executor)))
            if failures is not None:
                store.failures = failures.recall(job.options.names, job.options.properties)
            gc.freeze()  # What is loaded stays: no collection walks over it again, 2 to 3 % of a run.
            options = job.run_options(progress=bar.show_progress, executor=executor, store=store)
            result = run(plugins.subjects, plugins.questions, **options)
        if failures is not None:
            failures.update(result.rows)
        gap = partial(find_missing, result, plugins.subjects, plugins.questions, job.sampling)
        end = end_run(
            job, store, gap, run_writers(result, job.files.names.get(REPORT)), promises_kept=result.promises_kept
        )
    _show_results(result, plugins, end, job.pictures, screen)
    if not end.complete:
        say_how_to_go_on(job)
    return end.status


def _show_results(result: Run, plugins: Plugins, end: End, folder: PictureFolder | None, screen: ScreenOptions) -> None:
    """Show the results, the names of the files, and the last line; draw the pictures."""
    from contactverif.cli.console import show
    from contactverif.cli.counterexample_output import how_to_keep
    from contactverif.cli.run_tables import summary

    _draw_pictures(result, plugins, folder)
    show_what_plugins_printed()
    annotate(result)
    if not screen.quiet:
        show_run(result, screen, end.files.names.get(REPORT))
        if remark := result.provenance.get("drawing"):
            show(f"{remark}.")
        say_how_many_were_stored(result)
        if folder is not None:
            show(f"pictures: {folder.name}")
        end.files.announce()
        if REPORT not in end.files.names and not result.promises_kept and (advice := how_to_keep(result)):
            show(advice)
    show(f"Not complete: {end.gap}." if end.gap else summary(result, quiet=screen.quiet))
    if not screen.quiet:
        say_where_plugins_ran(result.provenance)


def show_run(result: Run, screen: ScreenOptions, report: Path | None) -> None:
    """Show a run as the user wants it: its few telling lines, or every row, and counterexamples."""
    from contactverif.cli.console import say, show, show_as_it_is
    from contactverif.cli.counterexample_output import counterexample_text, how_to_explain
    from contactverif.cli.run_screen import RunScreen
    from contactverif.cli.run_tables import RunTable
    from contactverif.contract.counterexample import failing_examples

    show(RunTable(result) if screen.verbose else RunScreen(result, report))
    if screen.verbose or screen.show == "all":
        for example in failing_examples(result):
            show_as_it_is(counterexample_text(example, report))
    if advice := how_to_explain(result, report):
        say(advice)


def _draw_pictures(result: Run, plugins: Plugins, folder: PictureFolder | None) -> None:
    """Draw a picture of each counterexample, if the user named a folder."""
    if folder is None:
        return
    from contactverif.cli.counterexample_output import draw_outcome
    from contactverif.contract.counterexample import case_id, failing_examples

    for example in failing_examples(result):
        subject, question = plugins.subject(example.formulation), plugins.question(example.property_id)
        name = f"{case_id(subject.name, question.id)}.png"
        draw_outcome(subject, question, example.outcome, folder.path / name, argument="--pictures")


def select_names(names: list[str], every: bool, limits: Limits | None = None) -> list[str]:
    """Return the formulations that the user named, or all of them."""
    from contactverif.plugins.registry import formulation_names, standalone_names

    if every and names:
        raise MisuseError("NAME", f"{', '.join(names)} and --all", "one of the two")
    if every:
        return list(standalone_names(limits))
    if not names:
        raise MisuseError("NAME", "nothing", f"--all, or some of {', '.join(formulation_names())}")
    return names
