"""The tables of a comparison of formulations: results, errors, Newton iterations and cost, then the meshes.

Rule for the next editor: where a table is too wide, only its first column gives way. A number that is cut off is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf, isfinite, isnan
from textwrap import shorten

from rich.console import Console, ConsoleOptions, RenderableType
from rich.table import Table
from rich.text import Text

from contactverif.cli.console import plain_table, result_text
from contactverif.cli.run_tables import conclusion, headline
from contactverif.contract.property import Outcome
from contactverif.studies.comparison_study import Study
from contactverif_reports.compare.cells import Cell
from contactverif_reports.compare.comparison import PARTS, Comparison, Cost, Differing, Iterations
from contactverif_reports.draw import as_text

DIFFERS = "≠"
REASON_LENGTH = 100  # The number of characters of a reason.
WIDE = 112  # From this many columns on the table of errors has room for the worst number in its own unit.
NARROW = 76  # With fewer columns the tables leave out counts and parts, so that names stay whole.
NAME_WIDTH = 18  # The least width of a column of names.
MOST_MESHES = 3  # The number of meshes in a terminal; more would bury the tables.


class SideBySide:
    """All tables of a study, one below the other; from 80 columns on each has all its columns."""

    def __init__(self, study: Study) -> None:
        self._study = study

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        comparison = self._study.comparison
        candidates = ", ".join(comparison.formulations[1:]) or "nothing"
        yield Text(f"{candidates} against {comparison.reference}: {headline(comparison.provenance)}")
        yield Text("")
        yield results_table(comparison)
        narrow = options.max_width < NARROW
        yield errors_table(comparison, with_worst=options.max_width >= WIDE, with_counts=not narrow)
        if comparison.iterations:
            yield iterations_table(comparison, with_counts=not narrow)
        yield cost_table(self._study, with_parts=not narrow)
        for name, reason in comparison.not_loaded.items():
            yield Text(f"{name}: not loaded: {reason}", style="red")


def results_table(comparison: Comparison) -> Table:
    """Return a line for each property and a column for each formulation, with a mark where verdicts differ."""
    table = plain_table(f"results ({DIFFERS}: not that of {comparison.reference})")
    table.add_column("property", no_wrap=True)
    for name in comparison.formulations:
        table.add_column(name, overflow="fold")
    for property_id in comparison.properties:
        reference = comparison.cells.get((comparison.reference, property_id))
        cells = [comparison.cells.get((name, property_id)) for name in comparison.formulations]
        table.add_row(property_id, *(_result(cell, reference) for cell in cells))
    return table


def _result(cell: Cell | None, reference: Cell | None) -> Text:
    if cell is None:
        return Text("  –", style="dim")
    mark = DIFFERS if reference is not None and cell.verdict is not reference.verdict else " "
    return result_text(cell.result, f"{mark} ")


def errors_table(comparison: Comparison, *, with_worst: bool = True, with_counts: bool = True) -> Table:
    """Return the errors over their tolerances, and each formulation beside the reference case by case.

    Parameters
    ----------
    comparison : Comparison
        The numbers.
    with_worst : bool
        Add the worst number in its own unit, for which there is no room in 80 columns.
    with_counts : bool
        Add the numbers of cases that are better, equal and worse.
    """
    title = f"error over tolerance, above 1 fails; ratio and numbers of cases beside {comparison.reference}"
    columns = ("median", "worst", "ratio", *(("better", "equal", "worse") if with_counts else ()))
    table = _numbers_table(title, columns)
    if with_worst:
        table.add_column("worst number", no_wrap=True, overflow="ellipsis")
    else:
        table.padding = (0, 1, 0, 0)
    for property_id in comparison.properties:
        keys = [(name, property_id) for name in comparison.formulations]
        cells = [comparison.cells[key] for key in keys if key in comparison.cells]
        measured = [cell for cell in cells if not isnan(cell.worst)]
        if measured:
            table.add_row(Text(property_id, style="bold"))
        for cell in measured:
            table.add_row(*_errors(cell, comparison, with_counts=with_counts), *([_worst(cell)] if with_worst else []))
    return table


def _errors(cell: Cell, comparison: Comparison, *, with_counts: bool) -> list[str]:
    """Return name, median, worst, ratio and counts of one formulation."""
    paired = comparison.paired.get((cell.formulation, cell.property_id))
    beside = [""] * 4
    if paired is not None:
        beside = [number(paired.ratio), str(paired.better), str(paired.equal), str(paired.worse)]
    return [f"  {cell.formulation}", number(cell.median), number(cell.worst), *beside[: 4 if with_counts else 1]]


def _worst(cell: Cell) -> str:
    return f"{number(cell.closest.value)} {cell.closest.quantity.name}" if cell.closest is not None else ""


def iterations_table(comparison: Comparison, *, with_counts: bool = True) -> Table:
    """Return Newton's iterations for each property that solves, and beside the reference where both converged."""
    title = f"Newton iterations where it converged; numbers of cases beside {comparison.reference}"
    columns = ("converged", "median", "most", *(("fewer", "same", "more") if with_counts else ()), "order")
    table = _numbers_table(title, columns)
    before = None
    for line in comparison.iterations:
        if line.title != before:
            table.add_row(Text(line.title, style="bold"))
        before = line.title
        counts = _counts(line, comparison.reference) if with_counts else []
        order = "" if isnan(line.order) else number(line.order)
        converged = f"{line.converged}/{line.solved}"
        table.add_row(f"  {line.formulation}", converged, number(line.median), number(line.most), *counts, order)
    return table


def _counts(line: Iterations, reference: str) -> list[str]:
    """Return the counts against the reference; nothing for the reference itself."""
    if line.formulation == reference:
        return ["", "", ""]
    return [str(line.fewer), str(line.same), str(line.more)]


def cost_table(study: Study, *, with_parts: bool = True) -> Table:
    """Return the time of an evaluation on shared states, in turns."""
    parts, reference = PARTS if with_parts else (), study.comparison.reference
    title = f"time of one evaluation, µs, in turns on a flat interface; ratio to {reference}"
    table = _numbers_table(title, (*parts, "all", "a segment", "ratio"))
    totals = {cost.n_segments: cost.total for cost in study.costs if cost.formulation == reference}
    before = 0
    for cost in study.costs:
        if cost.n_segments != before:
            table.add_row(Text(f"{cost.n_segments} slave segments", style="bold"))
        before = cost.n_segments
        times = ["–"] * (len(parts) + 3) if cost.failed else _times(cost, parts, totals[cost.n_segments])
        table.add_row(f"  {cost.formulation}", *times)
    return table


def _times(cost: Cost, parts: tuple[str, ...], reference: float) -> list[str]:
    total = cost.total
    ratio = "–" if isnan(total) or isnan(reference) else f"{total / reference:.2f}"
    per_segment = f"{1e6 * total / cost.n_segments:.2f}"
    return [*(_microseconds(cost.seconds[part]) for part in parts), _microseconds(total), per_segment, ratio]


def _numbers_table(title: str, columns: tuple[str, ...]) -> Table:
    """Return a table with a column of names and columns of numbers."""
    table = plain_table(title)
    table.add_column("", overflow="fold", min_width=NAME_WIDTH)
    for column in columns:
        table.add_column(column, justify="right", no_wrap=True)
    return table


def mesh_text(differing: Differing, reference: str) -> Text:
    """Return the case on which a candidate and the reference differ most: both verdicts, and a drawing."""
    outcome, reference_outcome = (
        outcome_words(differing.outcome, differing.margin),
        outcome_words(differing.reference_outcome, differing.reference_margin),
    )
    lines = [
        f"{differing.info.id}, case {differing.number}",
        f"    {differing.formulation}: {outcome}",
        f"    {reference}: {reference_outcome}",
        *(f"    {line}" for line in as_text(differing.case).splitlines()),
    ]
    return Text("\n".join(["", *lines]))


def outcome_words(outcome: Outcome, margin: float) -> str:
    """Return a verdict with the error over its tolerance, or with the reason why it is no pass."""
    if not isfinite(margin):
        return f"{outcome.verdict}, {shorten(outcome.reason, REASON_LENGTH, placeholder=' …')}"
    return f"{outcome.verdict}, {number(margin)} {'of' if margin <= 1 else 'times'} its tolerance"


def last_line(comparison: Comparison) -> Text:
    """Say whether the candidates keep their promises; the reference is not on trial."""
    if comparison.promises_kept:
        return Text(f"Every promise of {', '.join(comparison.formulations[1:])} is kept.", style="green")
    rows = [cell.row for cell in comparison.cells.values() if cell.formulation != comparison.reference]
    return conclusion(rows, list(comparison.not_loaded))


def number(value: float) -> str:
    """Return two digits; ∞ for a failure without a number, – where there is none."""
    return "–" if isnan(value) else "∞" if value == inf else f"{value:.2g}"


def _microseconds(seconds: float) -> str:
    return "–" if isnan(seconds) else f"{1e6 * seconds:.1f}"
