"""The work of `compare`: formulations against a reference, on the same cases; or an old report and a new one."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from contextlib import ExitStack
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path

from contactverif.api.drawing import draw_outcome
from contactverif.api.run_files import PAGE, REPORT, write_run
from contactverif.cli import comparison_screen as screens
from contactverif.cli.console import columns, show, show_verbatim
from contactverif.cli.options import OutputFiles, Screen, with_engines
from contactverif.cli.progress import Bar
from contactverif.cli.verify import COMPARE, Job, Plugins, end_run, new_job, resumed_job, show_end, watch_for_stops
from contactverif.contract.counterexample import case_id, counterexamples
from contactverif.contract.errors import MisuseError, unknown_name_error
from contactverif.contract.property import Property, Verdict
from contactverif.contract.result import Run
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
from contactverif_reports.html.comparison_page import Drawing, changes_page, comparison_page
from contactverif_reports.html.pages import write_page
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.regressions import Changes, NamedRun


def compare(options: RunOptions, against: Sequence[str], screen: Screen, resume: Path | None) -> int:
    """Compare two reports if the names are those of reports, else formulations; return the exit status."""
    if len(against) > 1:
        raise MisuseError("--against", f"{len(against)}: {', '.join(against)}", "one")
    names = with_engines(options.names, options.engines)
    if reports := _reports_among(names):
        _check_no_run_options(options, screen, against, resume)
        return _compare_reports(reports, options.properties, OutputFiles.check(options.out, (PAGE,)))
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


def _compare_reports(paths: Sequence[Path], globs: Sequence[str], files: OutputFiles) -> int:
    """Show what changed in a report, and write the page; return 1 if something got worse, else 0."""
    old, new = (_read(path, argument) for path, argument in zip(paths, ("OLD.nc", "NEW.nc"), strict=True))
    every = list(dict.fromkeys([*old.properties, *new.properties]))
    for glob in globs:
        if not any(fnmatchcase(id_, glob) for id_ in every):
            raise unknown_name_error("--property", glob, every)
    ids = [id_ for id_ in every if not globs or any(fnmatchcase(id_, glob) for glob in globs)]
    runs = [NamedRun.from_run(str(path), run.only(ids)) for path, run in zip(paths, (old, new), strict=True)]
    changes = Changes.between(*runs)
    if not changes.changes and not changes.no_longer_loaded:
        kind = "property" if set(old.formulations) & set(new.formulations) else "formulation"
        lists = [run.run.formulations if kind == "formulation" else list(run.run.properties) for run in runs]
        names = " and ".join(", ".join(each) or "nothing" for each in lists)
        raise MisuseError("NEW.nc", f"no {kind} that OLD.nc has too ({names})", "two reports with something in common")
    rows = [change.pair.new.row for change in changes.changes if change.regressions]
    worse = {(row.formulation, row.property_id) for row in rows}
    meshes = {
        id_: example
        for id_, example in counterexamples(changes.new.run).items()
        if (example.formulation, example.property_id) in worse and example.verdict is not Verdict.PASS
    }
    if PAGE in files.paths:
        write_page(files.paths[PAGE], changes_page(changes, meshes), "--out")
    show(*screens.changes_screen(changes))
    for example in list(meshes.values())[: screens.MOST_MESHES]:
        show_verbatim(screens.stored_mesh_text(example, changes.new.path))
    files.announce()
    show(screens.regressions_text(changes))
    return 1 if changes.regressions else 0


def _read(path: Path, argument: str) -> Run:
    try:
        return read_run(path)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None


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
        for differing in study.differing:
            _draw_pictures(differing, *_both(differing, plugins), job.pictures)
    return show_end(
        job, screen, end, study.run, partial(_show_study, study, screen), screens.last_line(study.comparison)
    )


def _write_file(study: Study, plugins: Plugins, path: Path) -> None:
    if path.suffix.lower() != PAGE:
        write_run(study.run, path)
        return
    drawings = []  # What the page's picture of a case needs: its scene solved by both, or the forces of both.
    for differing in study.differing:
        question, candidate, reference = _both(differing, plugins)
        case = differing.sides[0][1].case
        if has_bodies(case):
            drawings.append(Drawing(solved=solve_scene(case, [candidate, reference])))
        else:
            exact = None if question.exact is None else question.exact(case)
            drawings.append(Drawing(forces_on(case, candidate), forces_on(case, reference), exact))
    write_page(path, comparison_page(study.comparison, study.differing, drawings, study.costs), "--out")


def _both(differing: Differing, plugins: Plugins) -> tuple[Property, Subject, Subject]:
    candidate, reference = (plugins.subject(name) for name, _, _ in differing.sides)
    return plugins.question(differing.info.id), candidate, reference


def _show_study(study: Study, screen: Screen) -> None:
    """Show what differs in few lines, or all tables; and the meshes on which they differ, if the user wants them."""
    show(*(screens.comparison_tables if screen.verbose else screens.comparison_screen)(study, columns()))
    if study.apart:
        show(
            f"{', '.join(study.apart)} and {study.comparison.reference} are asked on different interfaces, of other "
            "dimension or faces: verdicts and promises can be compared, errors only on cases that both have, and times "
            "cannot."
        )
    if screen.verbose or screen.show == "all":
        for differing in study.differing:
            show_verbatim(screens.mesh_text(differing))
    elif study.differing:
        show("error: the worst over its tolerance. --show all: the meshes on which they differ; -v: all tables.")


def _draw_pictures(
    differing: Differing, question: Property, candidate: Subject, reference: Subject, folder: Path
) -> None:
    case = differing.sides[0][1].case
    if has_bodies(case):
        from contactverif_reports.plot.scene_figures import plot_scene  # importing matplotlib is slow

        scene = solve_scene(case, [candidate, reference])
        if scene.solutions:
            path = folder / f"{case_id(candidate.name, question.id)}.png"
            plot_scene(scene, path, title=f"{question.id}, case {differing.number}")
        return
    for subject, (name, outcome, _) in zip((candidate, reference), differing.sides, strict=True):
        path = folder / f"{case_id(name, question.id)}.png"
        draw_outcome(subject, question, outcome, path, argument="--pictures")
