"""The comparison of an old report with a new one: tables of the changes, and the meshes of what got worse."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from rich.console import Console, ConsoleOptions, RenderableType
from rich.text import Text

from contactverif.api.run_files import PAGE
from contactverif.cli.comparison_tables import MOST_MESHES
from contactverif.cli.console import indent_below, show, show_verbatim
from contactverif.cli.options import OutputFiles
from contactverif.contract.counterexample import Counterexample, counterexamples
from contactverif.contract.errors import MisuseError, unknown_name_error
from contactverif.contract.property import Verdict
from contactverif.contract.result import Run
from contactverif_reports.comparisons import RowNumbers
from contactverif_reports.html.comparison_page import changes_page
from contactverif_reports.html.pages import write_page
from contactverif_reports.netcdf.read import read_run
from contactverif_reports.plot.text import as_text
from contactverif_reports.regressions import Changes, NamedRun, changed_iterations_table, changes_table
from contactverif_reports.tables import short_number


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
        yield changes_table(changes.changes).without("median", "worst").terminal()
        if changed := [change for change in changes.changes if _errors(change.old) != _errors(change.new)]:
            errors = changes_table(changed).without("result", "better", "equal", "worse", "time")
            errors.title = "error over tolerance, old → new, where it changed"
            yield errors.terminal()
        if changes.iterations:
            yield changed_iterations_table(changes).terminal()
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


def _stored_mesh(example: Counterexample, report: str) -> Text:
    """Return the case on which a row that got worse fails, and the line that replays it."""
    title = f"{example.formulation}, {example.property_id}: {example.row.result}, {example.label}"
    return indent_below(title, *as_text(example.case).splitlines(), example.replay_command(report))


def _errors(cell: RowNumbers) -> tuple[str, str]:
    return short_number(cell.median), short_number(cell.worst)
