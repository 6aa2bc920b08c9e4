"""The screen of a comparison in few lines: verdicts that differ, errors, Newton iterations and time.

`comparison_tables` has every property and every part of the time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, isnan

from rich.console import Console, ConsoleOptions
from rich.text import Text

from contactverif.cli.console import fold, line
from contactverif.cli.run_tables import headline
from contactverif.contract.result import Result
from contactverif.run.ranking import by_rank
from contactverif.studies.comparison import Study
from contactverif_reports.comparisons import RowNumbers
from contactverif_reports.tables import PLAIN_STYLE, STYLES, short_number

_MOST_ROWS = 7  # The properties with another verdict, and those with the same one, that have a line each.
_ERROR = 7  # Columns of an error over its tolerance.
_ACCURACY = "accuracy"  # The family whose errors are those of the method, and no roundoff.
_DISTANT = 10.0  # The ratio of two errors from which on a property that both fail has a line.


@dataclass(frozen=True, slots=True)
class ComparisonScreen:
    """The results of a study: of one candidate at most 25 lines with all that follows; meshes are on demand."""

    study: Study

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Text]:
        comparison, width = self.study.comparison, options.max_width
        yield Text(headline(comparison.provenance))
        for name in comparison.formulations[1:]:
            yield from self._candidate(name, width)
        for name, reason in comparison.not_loaded.items():
            yield fold(f"{name}: not loaded: {reason}", width, "red", indent=0)

    def _candidate(self, name: str, width: int) -> Iterator[Text]:
        reference, both = self.study.comparison.reference, self._pairs(name)
        others = {id(cell.row): (cell, beside) for cell, beside in both if _differ(cell, beside)}
        rows = [others[id(row)] for row in by_rank(cell.row for cell, _ in others.values())]
        methods = [pair for pair in both if not _differ(*pair) and _is_worth_a_line(*pair)]
        same = f"the same verdict in {len(both) - len(rows)} of {len(both)} properties"
        yield Text("")
        yield fold(f"{name} against {reference}: {same}", width, "bold", indent=0)
        yield from _table(name, reference, [*rows[:_MOST_ROWS], *methods[:_MOST_ROWS]])
        if more := [cell.row.property_id for cell, _ in rows[_MOST_ROWS:]]:
            yield fold(f"{len(more)} more differ: {', '.join(more)}", width, indent=2)
        yield from self._iterations(name, width)
        yield from self._time(name, width)

    def _pairs(self, name: str) -> list[tuple[RowNumbers, RowNumbers]]:
        """Return the cells of a candidate, and of the reference beside them."""
        comparison = self.study.comparison
        keys = [(name, id_) for id_ in comparison.properties if (comparison.reference, id_) in comparison.cells]
        return [
            (comparison.cells[key], comparison.cells[comparison.reference, key[1]])
            for key in keys
            if key in comparison.cells
        ]

    def _iterations(self, name: str, width: int) -> Iterator[Text]:
        """Yield in how many cases Newton's method took fewer iterations than with the reference, or more."""
        lines = [item for item in self.study.comparison.iterations if item.formulation == name]
        fewer, same, more = (sum(getattr(item, part) for item in lines) for part in ("fewer", "same", "more"))
        if fewer + same + more:
            words = f"Newton iterations: fewer in {fewer} cases, the same in {same}, more in {more}."
            yield fold(words, width, indent=0)

    def _time(self, name: str, width: int) -> Iterator[Text]:
        """Yield the time of an evaluation, and its ratio to that of the reference."""
        reference = self.study.comparison.reference
        totals = {(cost.formulation, cost.n_segments): cost.total for cost in self.study.costs}
        words, of_reference = [], f" of {reference}"
        for (other, n), seconds in totals.items():
            if other == name and isfinite(seconds):
                ratio = seconds / totals[reference, n]  # NaN where the reference could not be timed.
                words.append(f"{1e6 * seconds:.0f} µs on {n} segments ({short_number(ratio)}{of_reference})")
                of_reference = ""
        if words:
            yield fold(f"An evaluation takes {', '.join(words)}.", width, indent=0)


def _differ(cell: RowNumbers, reference: RowNumbers) -> bool:
    """Return whether the verdicts differ. Where one is not asked there is no comparison."""
    unasked = {Result.NOT_APPLICABLE, Result.NOT_PROVIDED, Result.OMITTED}
    return cell.row.verdict is not reference.row.verdict and not {cell.row.result, reference.row.result} & unasked


def _is_worth_a_line(cell: RowNumbers, reference: RowNumbers) -> bool:
    """Return whether the errors of a property with one verdict are compared: those of a method, or far apart."""
    if isnan(cell.worst) or isnan(reference.worst):
        return False
    high, low = max(cell.worst, reference.worst), min(cell.worst, reference.worst)
    return cell.row.info.family == _ACCURACY or (low > 1 and high > _DISTANT * low)


def _table(name: str, reference: str, pairs: Sequence[tuple[RowNumbers, RowNumbers]]) -> Iterator[Text]:
    """Yield a line for each property: both verdicts, and beside each its worst error over the tolerance."""
    if not pairs:
        return
    first = max(len("property"), *(len(cell.row.property_id) for cell, _ in pairs))
    words = [[cell.row.result for cell, _ in pairs], [other.row.result for _, other in pairs]]
    widths = [max(len(title), *map(len, column)) + 1 for title, column in zip((name, reference), words, strict=True)]
    yield line(
        f"  {'property':{first}} {name:{widths[0]}} {'error':>{_ERROR}} {reference:{widths[1]}} {'error':>{_ERROR}}",
        "bold",
    )
    for cell, other in pairs:
        text = line(f"  {cell.row.property_id:{first}} ")
        for each, column in zip((cell, other), widths, strict=True):
            text.append(f"{each.row.result:{column}}", STYLES.get(each.row.result, PLAIN_STYLE))
            text.append(f"{short_number(each.worst):>{_ERROR}} ")
        text.rstrip()
        yield text
