"""The comparison of an old report with a new one: tables of the changes, and the meshes of what got worse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from math import isfinite
from pathlib import Path

from rich.console import Console, ConsoleOptions, RenderableType
from rich.table import Table
from rich.text import Text

from contactverif.api.run_files import PAGE
from contactverif.cli.comparison_tables import MOST_MESHES, NAME_WIDTH, number
from contactverif.cli.console import add_groups, indent_below, plain_table, show, show_verbatim
from contactverif.cli.options import OutputFiles
from contactverif.contract.counterexample import Counterexample, counterexamples
from contactverif.contract.errors import MisuseError
from contactverif.contract.names import unknown_name_error
from contactverif.contract.property import Verdict
from contactverif.contract.result import Run
from contactverif_reports.compare.cells import Cell
from contactverif_reports.compare.regression import Change, Changes, NamedRun
from contactverif_reports.draw import as_text
from contactverif_reports.html.comparison_page import changes_page
from contactverif_reports.html.pages import write_page
from contactverif_reports.netcdf.read import read_run


def compare_reports(paths: Sequence[Path], globs: Sequence[str], files: OutputFiles) -> bool:
    """Show what changed from an old report to a new one, and write the page; return whether nothing got worse."""
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
        names = " and ".join(", ".join(_names(run.run, kind)) or "nothing" for run in runs)
        raise MisuseError("NEW.nc", f"no {kind} that OLD.nc has too ({names})", "two reports with something in common")
    meshes = _failing(changes)
    if PAGE in files.paths:
        write_page(files.paths[PAGE], changes_page(changes, meshes), "--out")
    show(ChangesTable(changes))
    for example in list(meshes.values())[:MOST_MESHES]:
        show_verbatim(_stored_mesh(example, changes.new.path))
    files.announce()
    show(regressions_text(changes))
    return not changes.regressions


def _read(path: Path, argument: str) -> Run:
    """Read a report; an error names the argument of the command line."""
    try:
        return read_run(path)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None


def _names(run: Run, kind: str) -> Sequence[str]:
    return run.formulations if kind == "formulation" else list(run.properties)


def _failing(changes: Changes) -> dict[str, Counterexample]:
    """Return {id: counterexample} of the new report, for what got worse and fails."""
    rows = [change.new.row for change in changes.changes if change.regressions]
    worse = {(row.formulation, row.property_id) for row in rows}
    return {
        id_: example
        for id_, example in counterexamples(changes.new.run).items()
        if (example.formulation, example.property_id) in worse and example.verdict is not Verdict.PASS
    }


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
        yield _results(changes.changes)
        if changed := [change for change in changes.changes if _errors(change.old) != _errors(change.new)]:
            yield _changed_errors(changed)
        if changes.iterations:
            yield _iterations(changes)
        for label, names in (("only in the old", changes.removed), ("only in the new", changes.added)):
            if names:
                yield Text(f"{label}: {'; '.join(names)}")


def regressions_text(changes: Changes) -> Text:
    """Return what is worth a look, then what got worse, a line for each row; one line if nothing did."""
    looks = "".join(f"worth a look: {line}\n" for line in changes.noteworthy)
    if not changes.regressions:
        return Text.assemble((looks, "yellow"), ("Nothing got worse.", "green"))
    n = len(changes.regressions)
    lines = [f"{n} regression{'s' * (n > 1)}", *(f"  {line}" for line in changes.regressions)]
    return Text.assemble((looks, "yellow"), ("\n".join(lines), "red"))


def _results(changes: Sequence[Change]) -> Table:
    """Return results, numbers of cases and time: a line for each row that both have."""

    def cells(change: Change) -> list[str | Text]:
        paired = change.paired
        style = "red" if change.regressions else "green" if change.better else ""
        result = Text(_arrow(str(change.old.row.result), str(change.new.row.result)), style=style)
        counts = [paired.better, paired.equal, paired.worse] if paired is not None and paired.n else [""] * 3
        return [_name(change), result, *map(str, counts), f"{change.slower:.2f}" if isfinite(change.slower) else "–"]

    title = "result, old → new; cases better, equal, worse; time of a case, new/old (decides nothing)"
    numbers = ("better", "equal", "worse", "time")
    table = plain_table(title, "", width=NAME_WIDTH, words=("result",), numbers=numbers)
    add_groups(table, changes, _formulation, cells)
    return table


def _changed_errors(changes: Sequence[Change]) -> Table:
    title = "error over tolerance, old → new, where it changed"
    table = plain_table(title, "", width=NAME_WIDTH, words=("median", "worst"))
    add_groups(
        table,
        changes,
        _formulation,
        lambda change: [_name(change), *map(_arrow, _errors(change.old), _errors(change.new))],
    )
    return table


def _iterations(changes: Changes) -> Table:
    title, words = "Newton iterations that changed, old → new, where it converged", ("converged", "median", "most")
    table = plain_table(title, "", width=NAME_WIDTH, words=words, numbers=("fewer", "same", "more"))
    for old, new in changes.iterations:
        table.add_row(
            f"{new.formulation}, {new.title}",
            _arrow(f"{old.converged}/{old.solved}", f"{new.converged}/{new.solved}"),
            _arrow(number(old.median), number(new.median)),
            _arrow(number(old.most), number(new.most)),
            *map(str, (new.fewer, new.same, new.more)),
        )
    return table


def _stored_mesh(example: Counterexample, report: str) -> Text:
    """Return the case on which a row that got worse fails, and the line that replays it."""
    title = f"{example.formulation}, {example.property_id}: {example.row.result}, {example.label}"
    return indent_below(title, *as_text(example.case).splitlines(), example.replay_command(report))


def _formulation(change: Change) -> str:
    return change.new.row.formulation


def _name(change: Change) -> str:
    return f"  {change.new.row.property_id}{'' if change.paired else ' *'}"


def _errors(cell: Cell) -> tuple[str, str]:
    return number(cell.median), number(cell.worst)


def _arrow(old: str, new: str) -> str:
    return old if old == new else f"{old} → {new}"
