"""The tables of a comparison of formulations: results, errors, Newton iterations and cost, then the meshes."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from textwrap import shorten

from rich.console import Console, ConsoleOptions, RenderableType
from rich.text import Text

from contactverif.cli.console import indent_below
from contactverif.cli.run_tables import conclusion, headline
from contactverif.contract.property import Outcome
from contactverif.studies.comparison import Study
from contactverif_reports.comparisons import (
    PARTS,
    Comparison,
    Differing,
    cost_table,
    errors_table,
    iterations_table,
    results_table,
)
from contactverif_reports.plot.text import as_text
from contactverif_reports.tables import short_number

REASON_LENGTH = 100  # The number of characters of a reason.
WIDE = 112  # From this many columns on the table of errors has room for the worst number in its own unit.
NARROW = 76  # With fewer columns the tables leave out counts and parts, so that names stay whole.
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
        narrow, wide = options.max_width < NARROW, options.max_width >= WIDE
        without_counts = ("better", "equal", "worse", "fewer", "same", "more") if narrow else ()
        yield results_table(comparison).terminal()
        errors = errors_table(comparison).without(*without_counts, *(() if wide else ("worst number",)))
        yield errors.terminal(dense=not wide)
        if comparison.iterations:
            yield iterations_table(comparison).without(*without_counts).terminal()
        yield cost_table(self._study.costs, comparison.reference).without(*(PARTS if narrow else ())).terminal()
        for name, reason in comparison.not_loaded.items():
            yield Text(f"{name}: not loaded: {reason}", style="red")


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
    return f"{outcome.verdict}, {short_number(margin)} {'of' if margin <= 1 else 'times'} its tolerance"


def last_line(comparison: Comparison) -> Text:
    """Say whether the candidates keep their promises; the reference is not on trial."""
    if comparison.promises_kept:
        return Text(f"Every promise of {', '.join(comparison.formulations[1:])} is kept.", style="green")
    rows = [cell.row for cell in comparison.cells.values() if cell.row.formulation != comparison.reference]
    return conclusion(rows, list(comparison.not_loaded))
