"""The command `bench`: speed against error, on scenes whose exact solution is known."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from contactverif.api.run_files import PAGE, REPORT
from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.output_files import MARKDOWN, OutputFiles, PictureFolder
from contactverif.cli.run_endings import show_what_plugins_printed
from contactverif.cli.shared_options import EveryFormulation, formulation_argument, output_option
from contactverif.cli.verify_command import select_names
from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.isolation.limits import Limits
    from contactverif.studies.bench.bench_plan import BenchPlan
    from contactverif_reports.bench.changes import Change
    from contactverif_reports.bench.results import BenchResults

_LONG_CALLS = 10  # A state of a large mesh, or all states of differences, may take so many times the limit of a call.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def bench(
    *,
    names: Annotated[
        list[str] | None,
        formulation_argument("Formulations, with options; or one file of a bench, FILE.nc, to show it again."),
    ] = None,
    all_: EveryFormulation = False,
    scene: Annotated[
        list[str] | None,
        typer.Option(help="Only this scene, a problem such as wavy. Repeatable.", metavar="NAME"),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Take the two coarsest meshes, five instances, two processes.")
    ] = False,
    instances: Annotated[
        int | None, typer.Option(help="Instances of each mesh, 15 by default.", metavar="N", show_default=False)
    ] = None,
    processes: Annotated[
        int | None,
        typer.Option(help="Processes of each formulation, 5 by default.", metavar="N", show_default=False),
    ] = None,
    against: Annotated[
        Path | None, typer.Option(help="Say what changed since this file of a bench.", metavar="OLD.nc")
    ] = None,
    out: Annotated[
        list[Path] | None,
        output_option("Write the results: FILE.nc all instances, FILE.html or FILE.md a page. Repeatable."),
    ] = None,
    pictures: Annotated[Path | None, typer.Option(help="Draw the figures into this folder.", metavar="FOLDER")] = None,
    jobs: Annotated[
        int, typer.Option("--jobs", "-j", help="1: solutions side by side would disturb their times.", metavar="N")
    ] = 1,
    isolation: IsolationOptions,
) -> None:
    """Measure speed against error, on scenes whose exact solution is known.

    All formulations solve the same instances of each mesh, from the same
    start. What an error costs is three numbers: the seconds of one
    evaluation in the plugin's process, linear systems, and the seconds of
    one factorisation. Runs without a solution never get there. A plugin
    may take ten times --time-limit for a call. While it runs,
    FILE.nc.journal keeps what is finished: the same command goes on where
    it was stopped.

    \bExit status
      0  measured; with --against, no count grew and nothing is slower
      1  a count grew, an evaluation is slower by its interval, or a plugin
         crashes, does not load, or poses a problem wrongly
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif bench mine vts-ppt --out mine.html
      contactverif bench --all --out bench.nc --pictures figures
      contactverif bench vts-ppt --quick --against bench.nc
      contactverif bench bench.nc --out bench.html
    """
    if jobs != 1:
        raise MisuseError("--jobs", str(jobs), "1: solutions side by side would disturb their times")
    pinned = pin_threads()
    files = OutputFiles.check(out, (REPORT, PAGE, MARKDOWN))
    folder = PictureFolder.make(pictures)
    from contactverif.studies.bench.bench_plan import make_plan
    from contactverif_reports.bench.changes import changes
    from contactverif_reports.netcdf.bench_file import read_bench

    old = read_bench(against) if against else None
    if file := _only_file(names or [], all_):
        results = read_bench(file)
    else:
        limits = isolation.limits()
        plan = make_plan(scene or [], quick=quick, instances=instances, processes=processes)
        results = _run(select_names(names or [], all_, limits), plan, limits, files)
        results = _with_facts(results, pinned)
    since = () if old is None else changes(results, old)
    _write(results, since, files, folder, file)
    _show(results, since, files, folder, compared=old is not None)
    raise typer.Exit(_exit_status(results, since))


def _exit_status(results: BenchResults, changes: Sequence[Change]) -> int:
    """Return 1 if something became worse, crashed or did not load."""
    from contactverif_reports.bench.results import Outcome

    crashed = bool((results.outcomes == Outcome.CRASHED).any())
    return int(crashed or bool(results.not_loaded) or any(change.worse for change in changes))


def _with_facts(results: BenchResults, pinned: bool) -> BenchResults:
    """Return the results with the command as it was typed, and the number of threads."""
    facts = {"command": shlex.join(["contactverif", *sys.argv[1:]]), "threads": "1" if pinned else "not set"}
    return replace(results, provenance={**results.provenance, **facts})


def _only_file(names: list[str], every: bool) -> str:
    """Return the file of a bench if it is named instead of formulations; empty if formulations are."""
    if not names or not names[0].lower().endswith(REPORT):
        return ""
    if len(names) > 1 or every:
        raise MisuseError("NAME", f"{names[0]} and more", "formulations alone, or one file of a bench")
    return names[0]


def pin_threads() -> bool:
    """Keep numerical libraries to one thread; return False if they are loaded already, so that it is too late."""
    if "numpy" in sys.modules:
        return all(os.environ.get(name) == "1" for name in _THREADS)
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    return True


def _run(names: list[str], plan: BenchPlan, limits: Limits | None, files: OutputFiles) -> BenchResults:
    """Run the bench with a progress bar."""
    from contactverif.cli.progress import Bar
    from contactverif.plugins.registry import load_formulation
    from contactverif.studies.bench.bench_study import run_bench

    of_solution = None if limits is None else replace(limits, seconds=_LONG_CALLS * limits.seconds)
    subjects = [load_formulation(name, of_solution) for name in names]
    with Bar() as bar:
        results = run_bench(subjects, plan, output=files.paths.get(REPORT), progress=bar.update)
    show_what_plugins_printed()
    return results


def _write(
    results: BenchResults, changes: tuple[Change, ...], files: OutputFiles, folder: PictureFolder | None, file: str
) -> None:
    """Write the files that the user wants, before anything is shown; `file` is the one that was read, if one was."""
    if REPORT in files.paths:
        from contactverif.run.journal import journal_folder, remove_journal
        from contactverif_reports.netcdf.bench_file import write_bench

        write_bench(results, files.paths[REPORT])
        remove_journal(journal_folder(files.paths[REPORT]))
    if folder is not None:
        from contactverif_reports.draw.bench_figures import draw_bench

        draw_bench(results, folder.path)
    if PAGE in files.paths:
        from contactverif_reports.html.bench_page import bench_page
        from contactverif_reports.html.pages import write_page

        write_page(files.paths[PAGE], bench_page(results, changes))
    if MARKDOWN in files.paths:
        from contactverif_reports.bench.bench_text import bench_markdown
        from contactverif_reports.files import whole

        report = (files.names.get(REPORT) or Path(file)).name
        with whole(files.paths[MARKDOWN]) as part:
            part.write_text(bench_markdown(results, report, folder is not None), encoding="utf-8")


def _show(
    results: BenchResults,
    changes: tuple[Change, ...],
    files: OutputFiles,
    folder: PictureFolder | None,
    *,
    compared: bool,
) -> None:
    """Print a table for each scene, the sentences, and the names of the files."""
    from contactverif.cli.console import say, show

    _show_costs(results)
    for name, reason in results.not_loaded.items():
        show(f"{name} is not measured: {reason}")
    if compared:
        sentences = [change.sentence for change in changes]
        show("\n".join(sentences) or "The earlier bench has none of these formulations and cells.")
    files.announce()
    if folder is not None:
        say(f"pictures: {folder.name}")


def _show_costs(results: BenchResults) -> None:
    """Print a table for each scene, and the sentences."""
    from contactverif.cli.bench_tables import costs_table
    from contactverif.cli.console import show
    from contactverif_reports.bench.cost_tables import cost_sentences

    for scene in results.scenes:
        show(costs_table(results, scene))
    if any(results.uses_differences(name, scene) for name in results.formulations for scene in results.scenes):
        show("* with differences of forces where there is no tangent, or it did not help")
    for scene in results.scenes:
        show("\n".join(cost_sentences(results, scene, results.targets[scene][0])))
