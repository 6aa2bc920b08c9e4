"""The work of `compare`: formulations against a reference, on the same cases; or an old report and a new one."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import ExitStack, suppress
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from math import isfinite, isnan
from pathlib import Path
from textwrap import shorten

from rich.console import RenderableType
from rich.text import Text

from contactverif.api.report import draw_outcome
from contactverif.api.run_files import PAGE, REPORT, write_run
from contactverif.cli import verify
from contactverif.cli.console import columns, fold, indent_below, line, show, show_verbatim
from contactverif.cli.options import OutputFiles, Screen, with_engines
from contactverif.cli.progress import Bar
from contactverif.cli.run_screen import headline, summary
from contactverif.contract.counterexample import case_id, counterexamples
from contactverif.contract.errors import MisuseError, unknown_name_error
from contactverif.contract.property import Property, Verdict
from contactverif.contract.result import Result
from contactverif.contract.subject import Subject
from contactverif.mechanics.scene import has_bodies
from contactverif.plugins import registry
from contactverif.run.judge import forces_on
from contactverif.run.ranking import by_rank
from contactverif.run.rows import find_missing
from contactverif.run.run_options import ISOLATION, RunOptions, declared_options
from contactverif.run.scheduler import begin_loading
from contactverif.run.worker_pool import worker_pool
from contactverif.studies.comparison import Study, measure_costs, run_comparison
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports import comparisons, regressions
from contactverif_reports.bench_costs import format_seconds
from contactverif_reports.comparisons import Cost
from contactverif_reports.html.comparison_page import Drawing, changes_page, comparison_page
from contactverif_reports.html.pages import write_page
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.plot.text import as_text
from contactverif_reports.tables import PLAIN_STYLE, STYLES, short_number

_MOST_MESHES = 3  # The number of meshes in a terminal; more would bury the tables.
_MOST_ROWS = 7  # The properties with another verdict, and those with the same one, that have a line each.
_ERROR = 7  # Columns of an error over its tolerance.
_ACCURACY = "accuracy"  # The family whose errors are those of the method, and no roundoff.
_DISTANT = 10.0  # The ratio of two errors from which on a property that both fail has a line.
_REASON_LENGTH = 100  # The number of characters of a reason.
_WIDE = 112  # From this many columns on the table of errors has room for the worst number in its own unit.
_NARROW = 76  # With fewer columns the tables leave out counts and parts, so that names stay whole.
_UNASKED = {Result.NOT_APPLICABLE, Result.NOT_PROVIDED, Result.OMITTED}


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
        job = verify.resumed_job(resume, replace(typed, keep_going=False), verify.COMPARE)
    elif not any(names[:1]):
        raise MisuseError("--against", "nothing", "the formulation to compare with, or two reports OLD.nc NEW.nc")
    else:
        job = verify.new_job(typed.with_settings(), command=verify.COMPARE)
    return _compare_formulations(job, screen)


def _reports_among(names: Sequence[str]) -> list[Path]:
    """Return the two reports, if all names end in .nc, or are those of files and of no installed formulation."""
    installed = registry.formulation_names()
    reports = [
        name for name in names if name.lower().endswith(REPORT) or (name not in installed and Path(name).is_file())
    ]
    others = [name for name in names if name not in reports]
    if reports and others:
        raise MisuseError("NAME", f"{others[0]} and the report {reports[0]}", "formulations alone, or two reports")
    if len(reports) not in (0, 2):
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


# Two reports.


def _compare_reports(paths: Sequence[Path], globs: Sequence[str], files: OutputFiles) -> int:
    """Show what changed in a report, and write the page; return 1 if something got worse, else 0."""
    stored = []
    for path, argument in zip(paths, ("OLD.nc", "NEW.nc"), strict=True):
        try:
            stored.append(read_run(path))
        except MisuseError as error:
            raise MisuseError(argument, error.found, error.needed) from None
    every = list(dict.fromkeys(id_ for run in stored for id_ in run.properties))
    for glob in globs:
        if not any(fnmatchcase(id_, glob) for id_ in every):
            raise unknown_name_error("--property", glob, every)
    ids = [id_ for id_ in every if not globs or any(fnmatchcase(id_, glob) for glob in globs)]
    runs = [regressions.NamedRun.from_run(str(path), run.only(ids)) for path, run in zip(paths, stored, strict=True)]
    changes = regressions.Changes.between(*runs)
    if not changes.changes and not changes.no_longer_loaded:
        old, new = stored
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
    show(*changes_screen(changes))
    for example in list(meshes.values())[:_MOST_MESHES]:
        title = f"{example.formulation}, {example.property_id}: {example.row.result}, {example.label}"
        drawing = as_text(example.case).splitlines()
        show_verbatim(indent_below(title, *drawing, example.replay_command(changes.new.path)))
    files.announce()
    show(regressions_text(changes))
    return 1 if changes.regressions else 0


def changes_screen(changes: regressions.Changes) -> Iterator[RenderableType]:
    """Yield a line for each row that both reports have, then what only one of them has."""
    for name, report in (("old", changes.old), ("new", changes.new)):
        origin = report.run.provenance
        yield Text(
            f"{name}: {report.path}, {origin.get('examples')} random cases for each property, "
            f"seed {origin.get('seed')}, commit {origin.get('commit', 'unknown')[:12]}, "
            f"{origin.get('created', 'no date')}"
        )
    if others := sum(not change.same_cases for change in changes.changes):
        rows = "all rows" if others == len(changes.changes) else f"{others} rows (marked *)"
        yield Text(f"{rows} have other cases: their errors are compared as distributions, not case by case")
    yield Text("")
    yield regressions.changes_table(changes.changes).without("median", "worst").terminal()

    def errors(numbers: comparisons.RowNumbers) -> tuple[str, str]:
        return short_number(numbers.median), short_number(numbers.worst)

    changed = [each for each in changes.changes if errors(each.pair.old) != errors(each.pair.new)]
    if changed:
        table = regressions.changes_table(changed).without("result", "better", "equal", "worse", "time")
        table.title = "error over tolerance, old → new, where it changed"
        yield table.terminal()
    if changes.iterations:
        yield regressions.changed_iterations_table(changes).terminal()
    for label, names in (("only in the old", changes.removed), ("only in the new", changes.added)):
        if names:
            yield Text(f"{label}: {'; '.join(names)}")


def regressions_text(changes: regressions.Changes) -> Text:
    """Return what is worth a look, then what got worse, a line for each row; one line if nothing did."""
    looks = "".join(f"worth a look: {line}\n" for line in changes.noteworthy)
    if not changes.regressions:
        return Text.assemble((looks, "yellow"), ("Nothing got worse.", "green"))
    n = len(changes.regressions)
    lines = [f"{n} regression{'s' * (n > 1)}", *(f"  {line}" for line in changes.regressions)]
    return Text.assemble((looks, "yellow"), ("\n".join(lines), "red"))


# Formulations against a reference.


def _load(job: verify.Job, executor: Executor | None) -> verify.Plugins:
    reference, *names = job.options.names
    if not names:
        others = ", ".join(name for name in registry.formulation_names() if name != reference)
        raise MisuseError("NAME", "nothing", f"some of {others}, or two reports OLD.nc NEW.nc")
    load_reference, *loaders = begin_loading(job.options.names, job.limits(), executor)
    properties = registry.load_properties(job.options.properties, engines=True)
    try:
        loaded = registry.that_loads(reference, load_reference())
    except MisuseError as error:
        raise MisuseError("--against", error.found, error.needed) from None
    return verify.Plugins([loaded, *(load() for load in loaders)], properties)


def _compare_formulations(job: verify.Job, screen: Screen) -> int:
    with verify.watch_for_stops(job), ExitStack() as stack:
        with worker_pool(job.jobs) as executor, Bar() as bar:
            plugins, store = stack.enter_context(job.begin(partial(_load, job, executor)))
            options = job.run_options(progress=bar.show_progress, executor=executor, store=store)
            reference = plugins.subject(job.options.names[0])
            study = run_comparison(reference, plugins.subjects[1:], plugins.questions, **options)
        if not screen.quiet:
            _show_verdicts(study, screen)
        is_timed = not screen.quiet or PAGE in job.files.paths  # What nobody reads is not waited for.
        last = summary(study.comparison.candidates, quiet=True)
        costs: tuple[Cost, ...] = ()
        if is_timed:
            with suppress(KeyboardInterrupt), Bar() as bar:
                costs = measure_costs(
                    [item for item in plugins.subjects if isinstance(item, Subject)], progress=bar.update
                )
        missing = partial(find_missing, study.run, *plugins, job.sampling)
        write = partial(_write_file, study, plugins, costs)
        end = verify.end_run(job, store, missing, write, promises_kept=study.comparison.candidates.promises_kept)
        if is_timed and not costs:
            end = end._replace(status=verify.STOPPED)
            last.append("\nStopped before the time of an evaluation was known; all else is above.", "yellow")
    if job.pictures is not None:
        for differing in study.differing:
            _draw_pictures(differing, plugins, job.pictures)
    return verify.show_end(job, screen, end, study.run, partial(_show_costs, study, costs, screen), last)


def _both(differing: comparisons.Differing, plugins: verify.Plugins) -> tuple[Property, Subject, Subject]:
    candidate, reference = (plugins.subject(name) for name, _, _ in differing.sides)
    return plugins.question(differing.info.id), candidate, reference


def _write_file(study: Study, plugins: verify.Plugins, costs: Sequence[Cost], path: Path) -> None:
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
    write_page(path, comparison_page(study.comparison, study.differing, drawings, costs), "--out")


def _draw_pictures(differing: comparisons.Differing, plugins: verify.Plugins, folder: Path) -> None:
    (question, candidate, reference), case = _both(differing, plugins), differing.sides[0][1].case
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


def _show_verdicts(study: Study, screen: Screen) -> None:
    """Show what differs in few lines, or all tables; and the meshes on which they differ, if the user wants them."""
    show(*(_tables if screen.verbose else _few_lines)(study, columns()))
    if study.apart:
        show(
            f"{', '.join(study.apart)} and {study.comparison.reference} are asked on different interfaces, of other "
            "dimension or faces: verdicts and promises can be compared, errors only on cases that both have, and times "
            "cannot."
        )
    if not screen.verbose and screen.show != "all":
        if study.differing:
            show("error: the worst over its tolerance. --show all: the meshes on which they differ; -v: all tables.")
        return
    for differing in study.differing:  # Both verdicts, and a drawing.
        lines = []
        for name, outcome, margin in differing.sides:
            if isfinite(margin):
                words = f"{short_number(margin)} {'of' if margin <= 1 else 'times'} its tolerance"
            else:
                words = shorten(outcome.reason, _REASON_LENGTH, placeholder=" …")
            lines.append(f"{name}: {outcome.verdict}, {words}")
        drawing = as_text(differing.sides[-1][1].case).splitlines()
        show_verbatim(indent_below(f"{differing.info.id}, case {differing.number}", *lines, *drawing))


def _few_lines(study: Study, width: int) -> Iterator[Text]:
    """Yield the results of a study: of one candidate at most 25 lines with all that follows; meshes are on demand."""
    comparison = study.comparison
    yield Text(headline(comparison.provenance))
    for name in comparison.formulations[1:]:
        yield from _candidate(study, name, width)
    for name, reason in comparison.not_loaded.items():
        yield fold(f"{name}: not loaded: {reason}", width, "red", indent=0)


def _candidate(study: Study, name: str, width: int) -> Iterator[Text]:
    comparison, reference = study.comparison, study.comparison.reference
    pairs = [pair for (candidate, _), pair in comparison.pairs.items() if candidate == name]
    others = {id(pair.new.row): pair for pair in pairs if _differ(pair)}
    rows = [others[id(row)] for row in by_rank(pair.new.row for pair in others.values())]
    methods = [pair for pair in pairs if not _differ(pair) and _is_worth_a_line(pair)]
    same = f"the same verdict in {len(pairs) - len(rows)} of {len(pairs)} properties"
    yield Text("")
    yield fold(f"{name} against {reference}: {same}", width, "bold", indent=0)
    yield from _lines(name, reference, [*rows[:_MOST_ROWS], *methods[:_MOST_ROWS]])
    if more := [pair.new.row.property_id for pair in rows[_MOST_ROWS:]]:
        yield fold(f"{len(more)} more differ: {', '.join(more)}", width, indent=2)
    counts = [(item.fewer, item.same, item.more) for item in comparison.iterations if item.formulation == name]
    fewer, equal, more_often = map(sum, zip(*counts, strict=True)) if counts else (0, 0, 0)
    if fewer + equal + more_often:
        words = f"Newton iterations: fewer in {fewer} cases, the same in {equal}, more in {more_often}."
        yield fold(words, width, indent=0)


def _show_costs(study: Study, costs: Sequence[Cost], screen: Screen) -> None:
    width, (reference, *names) = columns(), study.comparison.formulations
    if screen.verbose and costs:
        table = comparisons.cost_table(costs, reference)
        show(table.without(*(comparisons.PARTS if width < _NARROW else ())).terminal())
        return
    totals = {(cost.formulation, cost.n_segments): cost.total for cost in costs}
    for name in names:
        times, of_reference = [], f" {reference}"
        for (other, n), seconds in totals.items():
            if other == name and isfinite(seconds):
                ratio = seconds / totals[reference, n]  # NaN where the reference could not be timed.
                beside = f", {float(f'{ratio:.2g}'):g} times{of_reference}" if isfinite(ratio) else ""
                times.append(f"{format_seconds(seconds)} on {n} segments{beside}")
                of_reference = ""
        if times:
            show(fold(f"{name}: an evaluation takes {'; '.join(times)}.", width, indent=0))


def _differ(pair: comparisons.Pair) -> bool:
    """Return whether the verdicts differ. Where one is not asked there is no comparison."""
    new, old = pair.new.row, pair.old.row
    return new.verdict is not old.verdict and not {new.result, old.result} & _UNASKED


def _is_worth_a_line(pair: comparisons.Pair) -> bool:
    """Return whether the errors of a property with one verdict are compared: those of a method, or far apart."""
    low, high = sorted((pair.new.worst, pair.old.worst))
    if isnan(low) or isnan(high):
        return False
    return pair.new.row.info.family == _ACCURACY or (low > 1 and high > _DISTANT * low)


def _lines(name: str, reference: str, pairs: Sequence[comparisons.Pair]) -> Iterator[Text]:
    if not pairs:
        return
    first = max(len("property"), *(len(pair.new.row.property_id) for pair in pairs))
    sides = {name: [pair.new for pair in pairs], reference: [pair.old for pair in pairs]}
    widths = [max(len(title), *(len(cell.row.result) for cell in side)) + 1 for title, side in sides.items()]
    heads = (f"{title:{width}} {'error':>{_ERROR}}" for title, width in zip(sides, widths, strict=True))
    yield line(f"  {'property':{first}} {' '.join(heads)}", "bold")
    for pair in pairs:
        text = line(f"  {pair.new.row.property_id:{first}} ")
        for cell, width in zip((pair.new, pair.old), widths, strict=True):
            text.append(f"{cell.row.result:{width}}", STYLES.get(cell.row.result, PLAIN_STYLE))
            text.append(f"{short_number(cell.worst):>{_ERROR}} ")
        text.rstrip()
        yield text


def _tables(study: Study, width: int) -> Iterator[RenderableType]:
    """Yield all tables of a study, one below the other; from 80 columns on each has all its columns."""
    comparison = study.comparison
    candidates = ", ".join(comparison.formulations[1:]) or "nothing"
    yield Text(f"{candidates} against {comparison.reference}: {headline(comparison.provenance)}")
    yield Text("")
    narrow, wide = width < _NARROW, width >= _WIDE
    without_counts = ("better", "equal", "worse", "fewer", "same", "more") if narrow else ()
    yield comparisons.results_table(comparison).terminal()
    errors = comparisons.errors_table(comparison).without(*without_counts, *(() if wide else ("worst number",)))
    yield errors.terminal(dense=not wide)
    if comparison.iterations:
        yield comparisons.iterations_table(comparison).without(*without_counts).terminal()
    for name, reason in comparison.not_loaded.items():
        yield Text(f"{name}: not loaded: {reason}", style="red")
