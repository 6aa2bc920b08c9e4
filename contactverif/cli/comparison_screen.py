"""The screens of a comparison: formulations beside a reference in few lines or in full, and two reports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite, isnan
from textwrap import shorten

from rich.console import RenderableType
from rich.text import Text

from contactverif.cli.console import fold, indent_below, line
from contactverif.cli.run_screen import conclusion, headline
from contactverif.contract.counterexample import Counterexample
from contactverif.contract.result import Result
from contactverif.run.ranking import by_rank
from contactverif.studies.comparison import Study
from contactverif_reports.comparisons import (
    PARTS,
    Comparison,
    Differing,
    Pair,
    RowNumbers,
    cost_table,
    errors_table,
    iterations_table,
    results_table,
)
from contactverif_reports.plot.text import as_text
from contactverif_reports.regressions import Changes, changed_iterations_table, changes_table
from contactverif_reports.tables import PLAIN_STYLE, STYLES, short_number

MOST_MESHES = 3  # The number of meshes in a terminal; more would bury the tables.
_MOST_ROWS = 7  # The properties with another verdict, and those with the same one, that have a line each.
_ERROR = 7  # Columns of an error over its tolerance.
_ACCURACY = "accuracy"  # The family whose errors are those of the method, and no roundoff.
_DISTANT = 10.0  # The ratio of two errors from which on a property that both fail has a line.
_REASON_LENGTH = 100  # The number of characters of a reason.
_WIDE = 112  # From this many columns on the table of errors has room for the worst number in its own unit.
_NARROW = 76  # With fewer columns the tables leave out counts and parts, so that names stay whole.
_UNASKED = {Result.NOT_APPLICABLE, Result.NOT_PROVIDED, Result.OMITTED}


def comparison_screen(study: Study, width: int) -> Iterator[Text]:
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
    totals = {(cost.formulation, cost.n_segments): cost.total for cost in study.costs}
    times, of_reference = [], f" of {reference}"
    for (other, n), seconds in totals.items():
        if other == name and isfinite(seconds):
            ratio = seconds / totals[reference, n]  # NaN where the reference could not be timed.
            times.append(f"{1e6 * seconds:.0f} µs on {n} segments ({short_number(ratio)}{of_reference})")
            of_reference = ""
    if times:
        yield fold(f"An evaluation takes {', '.join(times)}.", width, indent=0)


def _differ(pair: Pair) -> bool:
    """Return whether the verdicts differ. Where one is not asked there is no comparison."""
    new, old = pair.new.row, pair.old.row
    return new.verdict is not old.verdict and not {new.result, old.result} & _UNASKED


def _is_worth_a_line(pair: Pair) -> bool:
    """Return whether the errors of a property with one verdict are compared: those of a method, or far apart."""
    low, high = sorted((pair.new.worst, pair.old.worst))
    if isnan(low) or isnan(high):
        return False
    return pair.new.row.info.family == _ACCURACY or (low > 1 and high > _DISTANT * low)


def _lines(name: str, reference: str, pairs: Sequence[Pair]) -> Iterator[Text]:
    if not pairs:
        return
    first = max(len("property"), *(len(pair.new.row.property_id) for pair in pairs))
    columns = [[pair.new for pair in pairs], [pair.old for pair in pairs]]
    widths = [
        max(len(title), *(len(cell.row.result) for cell in column)) + 1
        for title, column in zip((name, reference), columns, strict=True)
    ]
    yield line(
        f"  {'property':{first}} {name:{widths[0]}} {'error':>{_ERROR}} {reference:{widths[1]}} {'error':>{_ERROR}}",
        "bold",
    )
    for pair in pairs:
        text = line(f"  {pair.new.row.property_id:{first}} ")
        for cell, width in zip((pair.new, pair.old), widths, strict=True):
            text.append(f"{cell.row.result:{width}}", STYLES.get(cell.row.result, PLAIN_STYLE))
            text.append(f"{short_number(cell.worst):>{_ERROR}} ")
        text.rstrip()
        yield text


def comparison_tables(study: Study, width: int) -> Iterator[RenderableType]:
    """Yield all tables of a study, one below the other; from 80 columns on each has all its columns."""
    comparison = study.comparison
    candidates = ", ".join(comparison.formulations[1:]) or "nothing"
    yield Text(f"{candidates} against {comparison.reference}: {headline(comparison.provenance)}")
    yield Text("")
    narrow, wide = width < _NARROW, width >= _WIDE
    without_counts = ("better", "equal", "worse", "fewer", "same", "more") if narrow else ()
    yield results_table(comparison).terminal()
    errors = errors_table(comparison).without(*without_counts, *(() if wide else ("worst number",)))
    yield errors.terminal(dense=not wide)
    if comparison.iterations:
        yield iterations_table(comparison).without(*without_counts).terminal()
    yield cost_table(study.costs, comparison.reference).without(*(PARTS if narrow else ())).terminal()
    for name, reason in comparison.not_loaded.items():
        yield Text(f"{name}: not loaded: {reason}", style="red")


def mesh_text(differing: Differing) -> Text:
    """Return the case on which a candidate and the reference differ most: both verdicts, and a drawing."""
    lines = []
    for name, outcome, margin in differing.sides:
        if isfinite(margin):
            words = f"{short_number(margin)} {'of' if margin <= 1 else 'times'} its tolerance"
        else:
            words = shorten(outcome.reason, _REASON_LENGTH, placeholder=" …")
        lines.append(f"{name}: {outcome.verdict}, {words}")
        drawing = as_text(outcome.case).splitlines()
    return indent_below(f"{differing.info.id}, case {differing.number}", *lines, *drawing)


def last_line(comparison: Comparison) -> Text:
    """Say whether the candidates keep their promises; the reference is not on trial."""
    if comparison.promises_kept:
        return Text(f"Every promise of {', '.join(comparison.formulations[1:])} is kept.", style="green")
    rows = [cell.row for cell in comparison.cells.values() if cell.row.formulation != comparison.reference]
    return conclusion(rows, list(comparison.not_loaded))


def changes_screen(changes: Changes) -> Iterator[RenderableType]:
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
    yield changes_table(changes.changes).without("median", "worst").terminal()
    changed = [each for each in changes.changes if _errors(each.pair.old) != _errors(each.pair.new)]
    if changed:
        errors = changes_table(changed).without("result", "better", "equal", "worse", "time")
        errors.title = "error over tolerance, old → new, where it changed"
        yield errors.terminal()
    if changes.iterations:
        yield changed_iterations_table(changes).terminal()
    for label, names in (("only in the old", changes.removed), ("only in the new", changes.added)):
        if names:
            yield Text(f"{label}: {'; '.join(names)}")


def _errors(cell: RowNumbers) -> tuple[str, str]:
    return short_number(cell.median), short_number(cell.worst)


def regressions_text(changes: Changes) -> Text:
    """Return what is worth a look, then what got worse, a line for each row; one line if nothing did."""
    looks = "".join(f"worth a look: {line}\n" for line in changes.noteworthy)
    if not changes.regressions:
        return Text.assemble((looks, "yellow"), ("Nothing got worse.", "green"))
    n = len(changes.regressions)
    lines = [f"{n} regression{'s' * (n > 1)}", *(f"  {line}" for line in changes.regressions)]
    return Text.assemble((looks, "yellow"), ("\n".join(lines), "red"))


def stored_mesh_text(example: Counterexample, report: str) -> Text:
    """Return the case on which a row that got worse fails, and the line that replays it."""
    title = f"{example.formulation}, {example.property_id}: {example.row.result}, {example.label}"
    return indent_below(title, *as_text(example.case).splitlines(), example.replay_command(report))
