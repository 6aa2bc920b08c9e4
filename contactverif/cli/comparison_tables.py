"""How a comparison reads in a terminal: verdicts, errors, Newton iterations and cost side by side, then the meshes.

Where a table is too wide only its first column gives way: a number that is cut off is a wrong number.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from math import inf, isfinite, isnan
from textwrap import shorten

from rich.console import Console, ConsoleOptions, RenderableType
from rich.table import Table
from rich.text import Text

from contactverif.cli.run_tables import PLAIN_STYLE, STYLES, conclusion, headline, plain_table
from contactverif.contract.property import Outcome
from contactverif.contract.result import result_of
from contactverif.studies.comparison_study import Study
from contactverif_reports.compare.cells import Cell
from contactverif_reports.compare.comparison import PARTS, Comparison, Differing
from contactverif_reports.compare.regression import Change, Changes
from contactverif_reports.draw import as_text
from contactverif_reports.netcdf.read import StoredCase

DIFFERS = "≠"
REASON = 100  # characters of a reason
WIDE = 112  # columns in which the table of errors has room for what went furthest
NARROW = 76  # columns below which tables leave out what can be done without, so that names stay whole
NAMES = 18  # columns that a name has at least
DRAWN = 3  # meshes in a terminal; more would bury the tables


class SideBySide:
    """All tables of a study, one below the other; each has all its columns from 80 on."""

    def __init__(self, study: Study) -> None:
        self._study = study

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        found = self._study.comparison
        about = found.provenance
        yield Text(f"{', '.join(found.formulations[1:]) or 'nothing'} against {found.reference}: {headline(about)}")
        yield Text("")
        yield verdicts_table(found)
        narrow = options.max_width < NARROW
        yield errors_table(found, with_worst=options.max_width >= WIDE, with_counts=not narrow)
        if found.iterations:
            yield iterations_table(found, with_counts=not narrow)
        yield cost_table(self._study, with_parts=not narrow)
        for name, reason in found.not_loaded.items():
            yield Text(f"{name}: not loaded: {reason}", style="red")


def verdicts_table(found: Comparison) -> Table:
    """A line a property, a column a formulation; what differs from the reference is marked."""
    table = plain_table(f"verdicts ({DIFFERS}: not that of {found.reference})")
    table.add_column("property", no_wrap=True)
    for name in found.formulations:
        table.add_column(name, overflow="fold")
    for property_id in found.properties:
        reference = found.cells.get((found.reference, property_id))
        cells = [found.cells.get((name, property_id)) for name in found.formulations]
        table.add_row(property_id, *(_verdict(cell, reference) for cell in cells))
    return table


def _verdict(cell: Cell | None, reference: Cell | None) -> Text:
    if cell is None:
        return Text("  –", style="dim")
    mark = DIFFERS if reference is not None and cell.verdict is not reference.verdict else " "
    result = result_of(cell.verdict, cell.promise, "", cell.unexpected)
    return Text(f"{mark} {result}", style=STYLES.get(result, PLAIN_STYLE))


def errors_table(found: Comparison, *, with_worst: bool = True, with_counts: bool = True) -> Table:
    """For each property how far each formulation went towards its tolerance, and beside the reference case by case.

    Parameters
    ----------
    with_worst : bool
        The number that went furthest too, for which there is no room in 80 columns.
    with_counts : bool
        Numbers of cases that are better, equal and worse.
    """
    table = plain_table(f"error over tolerance, above 1 fails; ratio and numbers of cases beside {found.reference}")
    table.add_column("", overflow="fold", min_width=NAMES)
    for column in ("median", "worst", "ratio", *(("better", "equal", "worse") if with_counts else ())):
        table.add_column(column, justify="right", no_wrap=True)
    if not with_worst:
        table.padding = (0, 1, 0, 0)
    else:
        table.add_column("worst number", no_wrap=True, overflow="ellipsis")
    for property_id in found.properties:
        cells = [found.cells[name, property_id] for name in found.formulations if (name, property_id) in found.cells]
        if all(isnan(cell.worst) for cell in cells):
            continue
        table.add_row(Text(property_id, style="bold"))
        for cell in cells:
            if isnan(cell.worst):
                continue
            paired = found.paired.get((cell.formulation, property_id))
            beside = [""] * (4 if with_counts else 1)
            if paired is not None:
                counts = map(str, (paired.better, paired.equal, paired.worse))
                beside = [number(paired.ratio), *(counts if with_counts else ())]
            worst = f"{number(cell.worst_value)} {cell.worst_quantity}" if cell.worst_quantity else ""
            errors = (number(cell.median), number(cell.worst))
            table.add_row(f"  {cell.formulation}", *errors, *beside, *([worst] if with_worst else []))
    return table


def iterations_table(found: Comparison, *, with_counts: bool = True) -> Table:
    """For each property that solves: how many iterations, and beside the reference where both converged."""
    table = plain_table(f"Newton iterations where it converged; numbers of cases beside {found.reference}")
    table.add_column("", overflow="fold", min_width=NAMES)
    for column in ("converged", "median", "most", *(("fewer", "same", "more") if with_counts else ()), "order"):
        table.add_column(column, justify="right", no_wrap=True)
    before = None
    for line in found.iterations:
        if line.title != before:
            table.add_row(Text(line.title, style="bold"))
        before = line.title
        beside: Sequence[str] = ("", "", "")
        if line.formulation != found.reference:
            beside = [str(count) for count in (line.fewer, line.same, line.more)]
        table.add_row(
            f"  {line.formulation}",
            f"{line.converged}/{line.solved}",
            number(line.median),
            number(line.most),
            *(beside if with_counts else ()),
            "" if isnan(line.order) else number(line.order),
        )
    return table


def cost_table(study: Study, *, with_parts: bool = True) -> Table:
    """Time of an evaluation on shared states, in turns."""
    parts = PARTS if with_parts else ()
    table = plain_table(f"time of one evaluation, µs, in turns on a flat interface; ratio to {_of(study)}")
    table.add_column("", overflow="fold", min_width=NAMES)
    for column in (*parts, "all", "a segment", "ratio"):
        table.add_column(column, justify="right", no_wrap=True)
    reference = {cost.n_segments: cost.total for cost in study.costs if cost.formulation == _of(study)}
    before = 0
    for cost in study.costs:
        if cost.n_segments != before:
            table.add_row(Text(f"{cost.n_segments} slave segments", style="bold"))
        before = cost.n_segments
        if cost.failed:
            table.add_row(f"  {cost.formulation}", *["–"] * (len(parts) + 3))
            continue
        total = cost.total
        table.add_row(
            f"  {cost.formulation}",
            *(_micro(cost.seconds[part]) for part in parts),
            _micro(total),
            f"{1e6 * total / cost.n_segments:.2f}",
            _ratio(total, reference[cost.n_segments]),
        )
    return table


def mesh(one: Differing, reference: str) -> Text:
    """The case on which a candidate and the reference differ most: who does what, and a drawing."""
    lines = [
        f"{one.question.id}, case {one.number}",
        f"    {one.formulation}: {said(one.outcome, one.margin)}",
        f"    {reference}: {said(one.reference_outcome, one.reference_margin)}",
        *(f"    {line}" for line in as_text(one.case).splitlines()),
    ]
    return Text("\n".join(["", *lines]))


def stored_mesh(id_: str, stored: StoredCase, report: str) -> Text:
    """A counterexample of a report: the smallest case on which what got worse fails, and the line that replays it."""
    lines = [
        f"{stored.formulation}, {stored.property_id}: {stored.verdict}",
        *(f"    {line}" for line in as_text(stored.case).splitlines()),
        f"    contactverif replay {shlex.quote(report)} --case {shlex.quote(id_)}",
    ]
    return Text("\n".join(["", *lines]))


def said(outcome: Outcome, margin: float) -> str:
    """A verdict, and how far from its tolerance the case was, or why it is no pass."""
    if not isfinite(margin):
        return f"{outcome.verdict}, {shorten(outcome.reason, REASON, placeholder=' …')}"
    return f"{outcome.verdict}, {number(margin)} {'of' if margin <= 1 else 'times'} its tolerance"


class ChangesTable:
    """An old report and a new one: a line for each row that both have, then what only one of them asked."""

    def __init__(self, changes: Changes) -> None:
        self._changes = changes

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        found = self._changes
        for name, report in (("old", found.old), ("new", found.new)):
            about = report.provenance
            yield Text(
                f"{name}: {report.path}, {about.get('examples')} examples a property, seed {about.get('seed')}, "
                f"commit {about.get('commit', 'unknown')[:12]}, {about.get('created', 'no date')}"
            )
        others = sum(change.paired is None for change in found.changes)
        if others:
            rows = "all rows" if others == len(found.changes) else f"{others} rows (marked *)"
            yield Text(f"{rows} asked other cases: their errors are compared as distributions, not case by case")
        yield Text("")
        yield moved_verdicts(found)
        if any(_has_moved(change) for change in found.changes):
            yield moved_errors(found)
        if found.iterations:
            yield moved_iterations(found)
        for what, names in (("only in the old", found.gone), ("only in the new", found.added)):
            if names:
                yield Text(f"{what}: {'; '.join(names)}")


def moved_verdicts(found: Changes) -> Table:
    """Verdicts, numbers of cases, time: a line for each row that both have."""
    table = plain_table("verdict, old → new; cases better, equal, worse; time of a case, new/old (decides nothing)")
    table.add_column("", overflow="fold", min_width=NAMES)
    table.add_column("verdict", no_wrap=True)
    for column in ("better", "equal", "worse", "time"):
        table.add_column(column, justify="right", no_wrap=True)
    for change in found.changes:
        _group(table, change, found.changes)
        table.add_row(*_change(change))
    return table


def moved_errors(found: Changes) -> Table:
    """Errors where they are not what they were."""
    table = plain_table("error over tolerance, old → new, where it changed")
    table.add_column("", overflow="fold", min_width=NAMES)
    for column in ("median", "worst"):
        table.add_column(column, no_wrap=True)
    moved = [change for change in found.changes if _has_moved(change)]
    for change in moved:
        _group(table, change, moved)
        old, new = change.old, change.new
        errors = (_moved(number(old.median), number(new.median)), _moved(number(old.worst), number(new.worst)))
        table.add_row(_indented(change), *errors)
    return table


def _group(table: Table, change: Change, among: Sequence[Change]) -> None:
    """The name of the formulation, above its first line."""
    first = next(other for other in among if other.new.formulation == change.new.formulation)
    if change is first:
        table.add_row(Text(change.new.formulation, style="bold"))


def _has_moved(change: Change) -> bool:
    old, new = change.old, change.new
    return (number(old.median), number(old.worst)) != (number(new.median), number(new.worst))


def _indented(change: Change) -> str:
    return f"  {change.new.property_id}{'' if change.paired else ' *'}"


def moved_iterations(found: Changes) -> Table:
    """Newton iterations where they are not what they were."""
    table = plain_table("Newton iterations that changed, old → new, where it converged")
    table.add_column("", overflow="fold", min_width=NAMES)
    for column in ("converged", "median", "most"):
        table.add_column(column, no_wrap=True)
    for column in ("fewer", "same", "more"):
        table.add_column(column, justify="right", no_wrap=True)
    for old, new in found.iterations:
        table.add_row(
            f"{new.formulation}, {new.title}",
            _moved(f"{old.converged}/{old.solved}", f"{new.converged}/{new.solved}"),
            _moved(number(old.median), number(new.median)),
            _moved(number(old.most), number(new.most)),
            *map(str, (new.fewer, new.same, new.more)),
        )
    return table


def _change(change: Change) -> list[str | Text]:
    old, new, paired = change.old, change.new, change.paired
    style = "red" if change.regressions else "green" if change.better else ""
    counted = paired is not None and paired.n
    counts = [str(count) for count in (paired.better, paired.equal, paired.worse)] if paired and counted else [""] * 3
    time = f"{change.slower:.2f}" if isfinite(change.slower) else "–"
    return [
        _indented(change),
        Text(_moved(str(old.verdict), str(new.verdict)), style=style),
        *counts,
        time,
    ]


def _moved(old: str, new: str) -> str:
    return old if old == new else f"{old} → {new}"


def outcome_of(changes: Changes) -> Text:
    """What is worth a look, then what got worse, a line for each row; one line if nothing did."""
    looks = [f"worth a look: {words}\n" for words in changes.noteworthy]
    if not changes.regressions:
        return Text.assemble(("".join(looks), "yellow"), ("nothing got worse", "green"))
    n = len(changes.regressions)
    lines = [f"{n} regression{'s' * (n > 1)}", *(f"  {words}" for words in changes.regressions)]
    return Text.assemble(("".join(looks), "yellow"), ("\n".join(lines), "red"))


def last_line(found: Comparison) -> Text:
    """Say whether the candidates keep their promises; the reference is not on trial."""
    cells = [cell for cell in found.cells.values() if cell.formulation != found.reference]
    if found.kept:
        return Text(f"Every promise of {', '.join(found.formulations[1:])} is kept.", style="green")
    rows = []
    for cell in cells:
        result = result_of(cell.verdict, cell.promise, "", cell.unexpected)
        rows.append((result, f"{cell.formulation} {cell.property_id}", cell.unexpected))
    return conclusion(rows, list(found.not_loaded))


def number(value: float) -> str:
    """Two digits; ∞ for a failure without a number, – where there is none."""
    return "–" if isnan(value) else "∞" if value == inf else f"{value:.2g}"


def _of(study: Study) -> str:
    return study.comparison.reference


def _ratio(one: float, other: float) -> str:
    return "–" if isnan(one) or isnan(other) else f"{one / other:.2f}"


def _micro(seconds: float) -> str:
    return "–" if isnan(seconds) else f"{1e6 * seconds:.1f}"
