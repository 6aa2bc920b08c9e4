"""The tables of an old report and a new one: results, errors and Newton iterations that changed.

Rule for the next editor: where a table is too wide, only its first column gives way. A number that is cut off is wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite

from rich.console import Console, ConsoleOptions, RenderableType
from rich.table import Table
from rich.text import Text

from contactverif.cli.comparison_tables import NAME_WIDTH, number
from contactverif.cli.console import plain_table
from contactverif.contract.counterexample import Counterexample
from contactverif_reports.compare.regression import Change, Changes
from contactverif_reports.draw import as_text


class ChangesTable:
    """A line for each row that both reports have, then what only one of them has."""

    def __init__(self, changes: Changes) -> None:
        self._changes = changes

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[RenderableType]:
        changes = self._changes
        for name, report in (("old", changes.old), ("new", changes.new)):
            origin = report.run.provenance
            yield Text(
                f"{name}: {report.path}, {origin.get('examples')} random cases for each property, "
                f"seed {origin.get('seed')}, commit {origin.get('commit', 'unknown')[:12]}, "
                f"{origin.get('created', 'no date')}"
            )
        others = sum(change.paired is None for change in changes.changes)
        if others:
            rows = "all rows" if others == len(changes.changes) else f"{others} rows (marked *)"
            yield Text(f"{rows} have other cases: their errors are compared as distributions, not case by case")
        yield Text("")
        yield changed_results(changes)
        if any(_errors_changed(change) for change in changes.changes):
            yield changed_errors(changes)
        if changes.iterations:
            yield changed_iterations(changes)
        for label, names in (("only in the old", changes.removed), ("only in the new", changes.added)):
            if names:
                yield Text(f"{label}: {'; '.join(names)}")


def changed_results(changes: Changes) -> Table:
    """Return results, numbers of cases and time: a line for each row that both have."""
    table = plain_table("result, old → new; cases better, equal, worse; time of a case, new/old (decides nothing)")
    table.add_column("", overflow="fold", min_width=NAME_WIDTH)
    table.add_column("result", no_wrap=True)
    for column in ("better", "equal", "worse", "time"):
        table.add_column(column, justify="right", no_wrap=True)
    for change in changes.changes:
        _add_formulation(table, change, changes.changes)
        table.add_row(*_result_line(change))
    return table


def changed_errors(changes: Changes) -> Table:
    """Return the errors that changed."""
    table = plain_table("error over tolerance, old → new, where it changed")
    table.add_column("", overflow="fold", min_width=NAME_WIDTH)
    for column in ("median", "worst"):
        table.add_column(column, no_wrap=True)
    lines = [change for change in changes.changes if _errors_changed(change)]
    for change in lines:
        _add_formulation(table, change, lines)
        old, new = change.old, change.new
        errors = (_arrow(number(old.median), number(new.median)), _arrow(number(old.worst), number(new.worst)))
        table.add_row(_indent(change), *errors)
    return table


def changed_iterations(changes: Changes) -> Table:
    """Return the Newton iterations that changed."""
    table = plain_table("Newton iterations that changed, old → new, where it converged")
    table.add_column("", overflow="fold", min_width=NAME_WIDTH)
    for column in ("converged", "median", "most"):
        table.add_column(column, no_wrap=True)
    for column in ("fewer", "same", "more"):
        table.add_column(column, justify="right", no_wrap=True)
    for old, new in changes.iterations:
        table.add_row(
            f"{new.formulation}, {new.title}",
            _arrow(f"{old.converged}/{old.solved}", f"{new.converged}/{new.solved}"),
            _arrow(number(old.median), number(new.median)),
            _arrow(number(old.most), number(new.most)),
            *map(str, (new.fewer, new.same, new.more)),
        )
    return table


def stored_mesh(example: Counterexample, report: str) -> Text:
    """Return the smallest case on which a row that got worse fails, and the line that replays it."""
    lines = [
        f"{example.formulation}, {example.property_id}: {example.row.result}",
        *(f"    {line}" for line in as_text(example.case).splitlines()),
        f"    {example.replay_command(report)}",
    ]
    return Text("\n".join(["", *lines]))


def regressions_text(changes: Changes) -> Text:
    """Return what is worth a look, then what got worse, a line for each row; one line if nothing did."""
    looks = [f"worth a look: {line}\n" for line in changes.noteworthy]
    if not changes.regressions:
        return Text.assemble(("".join(looks), "yellow"), ("Nothing got worse.", "green"))
    n = len(changes.regressions)
    lines = [f"{n} regression{'s' * (n > 1)}", *(f"  {line}" for line in changes.regressions)]
    return Text.assemble(("".join(looks), "yellow"), ("\n".join(lines), "red"))


def _add_formulation(table: Table, change: Change, lines: Sequence[Change]) -> None:
    """Add the name of the formulation above its first line."""
    first = next(other for other in lines if other.new.formulation == change.new.formulation)
    if change is first:
        table.add_row(Text(change.new.formulation, style="bold"))


def _errors_changed(change: Change) -> bool:
    old, new = change.old, change.new
    return (number(old.median), number(old.worst)) != (number(new.median), number(new.worst))


def _indent(change: Change) -> str:
    return f"  {change.new.property_id}{'' if change.paired else ' *'}"


def _result_line(change: Change) -> list[str | Text]:
    """Return name, result, counts and time of one row."""
    paired = change.paired
    style = "red" if change.regressions else "green" if change.better else ""
    counts = ["", "", ""]
    if paired is not None and paired.n:
        counts = [str(paired.better), str(paired.equal), str(paired.worse)]
    time = f"{change.slower:.2f}" if isfinite(change.slower) else "–"
    return [_indent(change), Text(_arrow(str(change.old.result), str(change.new.result)), style=style), *counts, time]


def _arrow(old: str, new: str) -> str:
    return old if old == new else f"{old} → {new}"
