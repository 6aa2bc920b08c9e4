"""The tables of a comparison of formulations: results, errors, Newton iterations and cost, then the meshes."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf, isfinite, isnan
from textwrap import shorten

from rich.console import Console, ConsoleOptions, RenderableType
from rich.table import Table
from rich.text import Text

from contactverif.cli.console import add_groups, indent_below, plain_table, result_text
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
    table = plain_table(f"results ({DIFFERS}: not that of {comparison.reference})", words=("property",))
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
    mark = DIFFERS if reference is not None and cell.row.verdict is not reference.row.verdict else " "
    return result_text(cell.row.result, f"{mark} ")


def errors_table(comparison: Comparison, *, with_worst: bool = True, with_counts: bool = True) -> Table:
    """Return the errors over their tolerances, and each formulation beside the reference case by case.

    The worst number in its own unit has no room in 80 columns.
    """

    def cells(cell: Cell) -> list[str]:
        paired = comparison.paired.get((cell.row.formulation, cell.row.property_id))
        beside = [""] * 4
        if paired is not None:
            beside = [number(paired.ratio), *map(str, (paired.better, paired.equal, paired.worse))]
        worst = f"{number(cell.closest.value)} {cell.closest.quantity.name}" if cell.closest is not None else ""
        numbers = [number(cell.median), number(cell.worst), *beside[: 4 if with_counts else 1]]
        return [f"  {cell.row.formulation}", *numbers, *([worst] if with_worst else [])]

    title = f"error over tolerance, above 1 fails; ratio and numbers of cases beside {comparison.reference}"
    columns = ("median", "worst", "ratio", *(("better", "equal", "worse") if with_counts else ()))
    table = plain_table(title, "", width=NAME_WIDTH, numbers=columns, dense=not with_worst)
    if with_worst:
        table.add_column("worst number", no_wrap=True, overflow="ellipsis")
    keys = [(name, property_id) for property_id in comparison.properties for name in comparison.formulations]
    measured = [comparison.cells[key] for key in keys if key in comparison.cells]
    add_groups(table, [cell for cell in measured if not isnan(cell.worst)], lambda cell: cell.row.property_id, cells)
    return table


def iterations_table(comparison: Comparison, *, with_counts: bool = True) -> Table:
    """Return Newton's iterations for each property that solves, and beside the reference where both converged."""

    def cells(line: Iterations) -> list[str]:
        is_reference = line.formulation == comparison.reference
        counts = [""] * 3 if is_reference else [str(line.fewer), str(line.same), str(line.more)]
        order = "" if isnan(line.order) else number(line.order)
        numbers = [f"{line.converged}/{line.solved}", number(line.median), number(line.most)]
        return [f"  {line.formulation}", *numbers, *(counts if with_counts else []), order]

    title = f"Newton iterations where it converged; numbers of cases beside {comparison.reference}"
    columns = ("converged", "median", "most", *(("fewer", "same", "more") if with_counts else ()), "order")
    table = plain_table(title, "", width=NAME_WIDTH, numbers=columns)
    add_groups(table, comparison.iterations, lambda line: line.title, cells)
    return table


def cost_table(study: Study, *, with_parts: bool = True) -> Table:
    """Return the time of an evaluation on shared states, in turns."""
    parts, reference = PARTS if with_parts else (), study.comparison.reference
    totals = {cost.n_segments: cost.total for cost in study.costs if cost.formulation == reference}

    def cells(cost: Cost) -> list[str]:
        if cost.failed:
            return [f"  {cost.formulation}", *["–"] * (len(parts) + 3)]
        ratio = cost.total / totals[cost.n_segments]
        times = [_microseconds(seconds) for seconds in (*(cost.seconds[part] for part in parts), cost.total)]
        per_segment = f"{1e6 * cost.total / cost.n_segments:.2f}"
        return [f"  {cost.formulation}", *times, per_segment, "–" if isnan(ratio) else f"{ratio:.2f}"]

    title = f"time of one evaluation, µs, in turns on a flat interface; ratio to {reference}"
    table = plain_table(title, "", width=NAME_WIDTH, numbers=(*parts, "all", "a segment", "ratio"))
    add_groups(table, study.costs, lambda cost: f"{cost.n_segments} slave segments", cells)
    return table


def mesh_text(differing: Differing, reference: str) -> Text:
    """Return the case on which a candidate and the reference differ most: both verdicts, and a drawing."""
    return indent_below(
        f"{differing.info.id}, case {differing.number}",
        f"{differing.formulation}: {_outcome(differing.outcome, differing.margin)}",
        f"{reference}: {_outcome(differing.reference_outcome, differing.reference_margin)}",
        *as_text(differing.case).splitlines(),
    )


def _outcome(outcome: Outcome, margin: float) -> str:
    """Return a verdict with the error over its tolerance, or with the reason why it is no pass."""
    if not isfinite(margin):
        return f"{outcome.verdict}, {shorten(outcome.reason, REASON_LENGTH, placeholder=' …')}"
    return f"{outcome.verdict}, {number(margin)} {'of' if margin <= 1 else 'times'} its tolerance"


def last_line(comparison: Comparison) -> Text:
    """Say whether the candidates keep their promises; the reference is not on trial."""
    if comparison.promises_kept:
        return Text(f"Every promise of {', '.join(comparison.formulations[1:])} is kept.", style="green")
    rows = [cell.row for cell in comparison.cells.values() if cell.row.formulation != comparison.reference]
    return conclusion(rows, list(comparison.not_loaded))


def number(value: float) -> str:
    """Return two digits; ∞ for a failure without a number, – where there is none."""
    return "–" if isnan(value) else "∞" if value == inf else f"{value:.2g}"


def _microseconds(seconds: float) -> str:
    return "–" if isnan(seconds) else f"{1e6 * seconds:.1f}"
