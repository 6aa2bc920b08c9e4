"""The comparison of formulations: one run on the same cases, then the screen, meshes, a page and pictures."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from contactverif.api.run_files import PAGE, run_writers
from contactverif.cli.annotations import annotate
from contactverif.cli.comparison_screen import ComparisonScreen
from contactverif.cli.comparison_tables import SideBySide, last_line, mesh_text
from contactverif.cli.console import show, show_as_it_is
from contactverif.cli.counterexample_output import draw_outcome
from contactverif.cli.output_files import PictureFolder
from contactverif.cli.progress import Bar
from contactverif.cli.run_endings import (
    end_run,
    say_how_many_were_stored,
    say_how_to_go_on,
    say_where_plugins_ran,
    show_what_plugins_printed,
    watch_for_stops,
)
from contactverif.cli.shared_options import ScreenOptions
from contactverif.cli.verify_job import Plugins, VerifyJob
from contactverif.contract.counterexample import case_id
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Property
from contactverif.contract.subject import Subject
from contactverif.mechanics.scene import has_bodies
from contactverif.plugins.registry import formulation_names, load_properties, that_loads
from contactverif.run.judge import forces_on
from contactverif.run.rows import find_missing
from contactverif.run.scheduler import begin_loading
from contactverif.run.worker_pool import worker_pool
from contactverif.studies.comparison_study import Study, run_comparison
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.compare.comparison import Differing
from contactverif_reports.html.comparison_page import Drawing, comparison_page
from contactverif_reports.html.pages import write_page


def _load(job: VerifyJob, executor: Executor | None) -> tuple[Subject, Plugins]:
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


def compare_formulations(job: VerifyJob, screen: ScreenOptions) -> int:
    """Run all properties, show what was found and write the files; return the exit status."""
    with watch_for_stops(job), ExitStack() as stack:
        with worker_pool(job.jobs) as executor, Bar() as bar:
            (reference, plugins), store = stack.enter_context(job.begin(partial(_load, job, executor)))
            options = job.run_options(progress=bar.show_progress, executor=executor, store=store)
            study = run_comparison(reference, plugins.subjects[1:], plugins.questions, **options)
        gap = partial(find_missing, study.run, plugins.subjects, plugins.questions, job.sampling)
        end = end_run(job, store, gap, _writers(study, plugins), promises_kept=study.comparison.promises_kept)
    if job.pictures is not None:
        _draw_meshes(study, plugins, job.pictures)
    show_what_plugins_printed()
    annotate(study.run)
    if not screen.quiet:
        _show_study(study, screen)
        say_how_many_were_stored(study.run)
        if job.pictures is not None:
            show(f"pictures: {job.pictures.name}")
        end.files.announce()
    show(f"Not complete: {end.gap}." if end.gap else last_line(study.comparison))
    if not screen.quiet:
        say_where_plugins_ran(study.run.provenance)
    if not end.complete:
        say_how_to_go_on(job)
    return end.status


def _writers(study: Study, plugins: Plugins) -> dict[str, Callable[[Path], None]]:
    """Return the functions that write the files of the run; the page compares."""

    def write_html(path: Path) -> None:
        drawings = [_page_drawing(differing, *_both(differing, study, plugins)) for differing in study.differing]
        write_page(path, comparison_page(study.comparison, study.differing, drawings, study.costs), "--out")

    return run_writers(study.run, None) | {PAGE: write_html}


def _both(differing: Differing, study: Study, plugins: Plugins) -> tuple[Property, Subject, Subject]:
    """Return the property on which a candidate and the reference differ, and these two."""
    names = differing.formulation, study.comparison.reference
    candidate, reference = map(plugins.subject, names)
    return plugins.question(differing.info.id), candidate, reference


def _show_study(study: Study, screen: ScreenOptions) -> None:
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
            show_as_it_is(mesh_text(differing, study.comparison.reference))
    elif study.differing:
        show("error: the worst over its tolerance. --show all: the meshes on which they differ; -v: all tables.")


def _draw_meshes(study: Study, plugins: Plugins, folder: PictureFolder) -> None:
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
    differing: Differing, question: Property, candidate: Subject, reference: Subject, folder: PictureFolder
) -> None:
    """Draw the bodies as both solve them, or the case with the forces of each."""
    if has_bodies(differing.case):
        from contactverif_reports.draw.scene_figures import draw_scene  # importing matplotlib is slow

        scene = solve_scene(differing.case, [candidate, reference])
        name = f"{case_id(candidate.name, differing.info.id)}.png"
        if scene.solutions:
            draw_scene(scene, folder.path / name, title=f"{differing.info.id}, case {differing.number}")
        return
    for subject, outcome in ((candidate, differing.outcome), (reference, differing.reference_outcome)):
        name = f"{case_id(subject.name, differing.info.id)}.png"
        draw_outcome(subject, question, outcome, folder.path / name, argument="--pictures")
