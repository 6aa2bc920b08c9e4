"""The work of `compare`: formulations against a reference, on the same cases; or an old report and a new one."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path

from contactverif.api.drawing import draw_outcome
from contactverif.api.run_files import PAGE, REPORT, write_run
from contactverif.cli.annotations import annotate
from contactverif.cli.comparison_screen import ComparisonScreen
from contactverif.cli.comparison_tables import SideBySide, last_line, mesh_text
from contactverif.cli.console import print_plugin_output, show, show_verbatim
from contactverif.cli.options import OutputFiles, Screen, with_engines
from contactverif.cli.progress import Bar
from contactverif.cli.report_comparison import compare_reports
from contactverif.cli.verify import (
    COMPARE,
    Job,
    Plugins,
    end_run,
    new_job,
    print_isolation,
    print_resume_hint,
    print_stored,
    resumed_job,
    watch_for_stops,
)
from contactverif.contract.counterexample import case_id
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.mechanics.scene import has_bodies
from contactverif.plugins.registry import formulation_names, load_properties, that_loads
from contactverif.run.judge import forces_on
from contactverif.run.rows import find_missing
from contactverif.run.run_options import ISOLATION, RunOptions, declared_options
from contactverif.run.scheduler import begin_loading
from contactverif.run.worker_pool import worker_pool
from contactverif.studies.comparison import Study, run_comparison
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.comparisons import Differing
from contactverif_reports.html.comparison_page import Drawing, comparison_page
from contactverif_reports.html.pages import write_page


def compare(options: RunOptions, against: Sequence[str], screen: Screen, resume: Path | None) -> int:
    """Compare two reports if the names are those of reports, else formulations; return the exit status."""
    if len(against) > 1:
        raise MisuseError("--against", f"{len(against)}: {', '.join(against)}", "one")
    names = with_engines(options.names, options.engines)
    if reports := _reports_among(names):
        _check_no_run_options(options, screen, against, resume)
        return 0 if compare_reports(reports, options.properties, OutputFiles.check(options.out, (PAGE,))) else 1
    # The reference is the first name.
    names = (next(iter(against), ""), *names) if against or names else ()
    typed = replace(options, names=names, engines=(), keep_going=True)
    if resume is not None:
        return _compare_formulations(resumed_job(resume, replace(typed, keep_going=False), COMPARE), screen)
    if not any(names[:1]):
        raise MisuseError("--against", "nothing", "the formulation to compare with, or two reports OLD.nc NEW.nc")
    return _compare_formulations(new_job(typed.with_settings(), command=COMPARE), screen)


def _reports_among(names: Sequence[str]) -> list[Path]:
    """Return the two reports, if the names are those of reports; nothing if they are those of formulations.

    The name of a report ends in .nc, or is that of a file and of no installed formulation.
    """
    installed = formulation_names()
    reports = [
        name for name in names if name.lower().endswith(REPORT) or (name not in installed and Path(name).is_file())
    ]
    if not reports:
        return []
    others = [name for name in names if name not in reports]
    if others:
        raise MisuseError("NAME", f"{others[0]} and the report {reports[0]}", "formulations alone, or two reports")
    if len(reports) != 2:
        raise MisuseError("NAME", f"{len(reports)} report{'s' * (len(reports) > 1)}", "two, OLD.nc NEW.nc")
    return [Path(name) for name in reports]


def _check_no_run_options(options: RunOptions, screen: Screen, against: Sequence[str], resume: Path | None) -> None:
    """Refuse the options of a run beside two reports, which have been judged already."""
    both = {
        name: (getattr(options, name), getattr(RunOptions(), name))
        for name, (_, option) in declared_options(RunOptions).items()
        if name not in ("names", "engines", "properties", "out", "pictures") and option.group != ISOLATION
    }
    both |= {name: (getattr(screen, name), getattr(Screen(), name)) for name in declared_options(Screen)}
    both |= {"against": ([*against], []), "pictures": (options.pictures, None), "resume": (resume, None)}
    for name, (value, default) in both.items():
        if value != default:
            raise MisuseError(f"--{name}", "two reports beside it", "formulations: a report has been judged already")


def _load(job: Job, executor: Executor | None) -> tuple[Subject, Plugins]:
    """Load the reference, which is the first formulation, and all other formulations and the properties."""
    reference_name, *names = job.options.names
    if not names:
        others = ", ".join(name for name in formulation_names() if name != reference_name)
        raise MisuseError("NAME", "nothing", f"some of {others}, or two reports OLD.nc NEW.nc")
    load_reference, *loaders = begin_loading(job.options.names, job.limits(), executor)
    properties = load_properties(job.options.properties, engines=True)
    try:
        reference = that_loads(reference_name, load_reference())
    except MisuseError as error:
        raise MisuseError("--against", error.found, error.needed) from None
    return reference, Plugins([reference, *(load() for load in loaders)], properties)


def _compare_formulations(job: Job, screen: Screen) -> int:
    """Run all properties, show what was found and write the files; return the exit status."""
    with watch_for_stops(job), ExitStack() as stack:
        with worker_pool(job.jobs) as executor, Bar() as bar:
            (reference, plugins), store = stack.enter_context(job.begin(partial(_load, job, executor)))
            options = job.run_options(progress=bar.show_progress, executor=executor, store=store)
            study = run_comparison(reference, plugins.subjects[1:], plugins.questions, **options)
        gap = partial(find_missing, study.run, plugins.subjects, plugins.questions, job.sampling)
        end = end_run(
            job, store, gap, partial(_write_file, study, plugins), promises_kept=study.comparison.promises_kept
        )
    if job.pictures is not None:
        _draw_meshes(study, plugins, job.pictures)
    print_plugin_output()
    annotate(study.run)
    if not screen.quiet:
        _show_study(study, screen)
        print_stored(study.run)
        if job.pictures is not None:
            show(f"pictures: {job.options.pictures}")
        end.files.announce()
    show(f"Not complete: {end.gap}." if end.gap else last_line(study.comparison))
    if not screen.quiet:
        print_isolation(study.run.provenance)
    if not end.complete:
        print_resume_hint(job)
    return end.status


def _write_file(study: Study, plugins: Plugins, path: Path) -> None:
    """Write the run to a file; the page compares."""
    if path.suffix.lower() != PAGE:
        write_run(study.run, path)
        return
    drawings = [_page_drawing(differing, *_both(differing, study, plugins)) for differing in study.differing]
    write_page(path, comparison_page(study.comparison, study.differing, drawings, study.costs), "--out")


def _both(differing: Differing, study: Study, plugins: Plugins) -> tuple[Property, Subject, Subject]:
    """Return the property on which a candidate and the reference differ, and these two."""
    names = differing.formulation, study.comparison.reference
    candidate, reference = map(plugins.subject, names)
    return plugins.question(differing.info.id), candidate, reference


def _show_study(study: Study, screen: Screen) -> None:
    """Show what differs in few lines, or all tables; and the meshes on which they differ, if the user wants them."""
    show(SideBySide(study) if screen.verbose else ComparisonScreen(study))
    if study.apart:
        reference = study.comparison.reference
        show(
            f"{', '.join(study.apart)} and {reference} are asked on different interfaces, of other dimension or faces: "
            "verdicts and promises can be compared, errors only on cases that both have, and times cannot."
        )
    if screen.verbose or screen.show == "all":
        for differing in study.differing:
            show_verbatim(mesh_text(differing, study.comparison.reference))
    elif study.differing:
        show("error: the worst over its tolerance. --show all: the meshes on which they differ; -v: all tables.")


def _draw_meshes(study: Study, plugins: Plugins, folder: Path) -> None:
    """Draw all meshes on which they differ into a folder."""
    for differing in study.differing:
        _draw_pictures(differing, *_both(differing, study, plugins), folder)


def _page_drawing(differing: Differing, question: Property, candidate: Subject, reference: Subject) -> Drawing:
    """Return what the page's picture of a case needs: its scene solved by both, or the forces of both."""
    if has_bodies(differing.case):
        return Drawing(solved=solve_scene(differing.case, [candidate, reference]))
    exact = None if question.exact is None else question.exact(differing.case)
    return Drawing(forces_on(differing.case, candidate), forces_on(differing.case, reference), exact)


def _draw_pictures(
    differing: Differing, question: Property, candidate: Subject, reference: Subject, folder: Path
) -> None:
    """Draw the bodies as both solve them, or the case with the forces of each."""
    if has_bodies(differing.case):
        from contactverif_reports.plot.scene_figures import plot_scene  # importing matplotlib is slow

        scene = solve_scene(differing.case, [candidate, reference])
        name = f"{case_id(candidate.name, differing.info.id)}.png"
        if scene.solutions:
            plot_scene(scene, folder / name, title=f"{differing.info.id}, case {differing.number}")
        return
    for subject, outcome in ((candidate, differing.outcome), (reference, differing.reference_outcome)):
        name = f"{case_id(subject.name, differing.info.id)}.png"
        draw_outcome(subject, question, outcome, folder / name, argument="--pictures")
