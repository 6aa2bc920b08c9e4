"""The comparison of an old report with a new one: tables of the changes, and the meshes of what got worse."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from contactverif.cli.changes_tables import ChangesTable, regressions_text, stored_mesh
from contactverif.cli.comparison_tables import MOST_MESHES
from contactverif.cli.console import show, show_as_it_is
from contactverif.cli.output_files import PAGE, OutputFiles
from contactverif.contract.counterexample import Counterexample, counterexamples
from contactverif.contract.errors import MisuseError
from contactverif.contract.names import unknown_name_error
from contactverif.contract.result import Run
from contactverif_reports.compare.regression import Changes, NamedRun
from contactverif_reports.html.comparison_page import changes_page
from contactverif_reports.html.pages import write_page
from contactverif_reports.netcdf.read import read_run


def compare_reports(paths: Sequence[Path], globs: Sequence[str], files: OutputFiles) -> bool:
    """Show what changed from an old report to a new one, and write the page; return whether nothing got worse."""
    old, new = (_read(path, argument) for path, argument in zip(paths, ("OLD.nc", "NEW.nc"), strict=True))
    every = dict.fromkeys([*old.properties, *new.properties])
    ids = _select(every, globs)
    runs = [NamedRun.from_run(str(path), run.only(ids)) for path, run in zip(paths, (old, new), strict=True)]
    changes = Changes.between(*runs)
    if not changes.changes and not changes.no_longer_loaded:
        kind = "property" if set(old.formulations) & set(new.formulations) else "formulation"
        names = " and ".join(", ".join(_names(run.run, kind)) or "nothing" for run in runs)
        raise MisuseError("NEW.nc", f"no {kind} that OLD.nc has too ({names})", "two reports with something in common")
    meshes = _smallest_failing(changes)
    if PAGE in files.paths:
        write_page(files.paths[PAGE], changes_page(changes, meshes), "--out")
    show(ChangesTable(changes))
    for example in list(meshes.values())[:MOST_MESHES]:
        show_as_it_is(stored_mesh(example, changes.new.path))
    files.announce()
    show(regressions_text(changes))
    return not changes.regressions


def _smallest_failing(changes: Changes) -> dict[str, Counterexample]:
    """Return {id: counterexample} of the new report, for what got worse and fails."""
    cells = [change.new for change in changes.changes if change.regressions]
    worse = {(cell.formulation, cell.property_id) for cell in cells}
    return {
        id_: example
        for id_, example in counterexamples(changes.new.run).items()
        if (example.formulation, example.property_id) in worse and not example.is_witness
    }


def _select(every: Iterable[str], globs: Sequence[str]) -> list[str]:
    """Return the properties that some pattern names; all of them without a pattern."""
    for glob in globs:
        if not any(fnmatchcase(id_, glob) for id_ in every):
            raise unknown_name_error("--property", glob, every)
    return [id_ for id_ in every if not globs or any(fnmatchcase(id_, glob) for glob in globs)]


def _names(run: Run, kind: str) -> Sequence[str]:
    return run.formulations if kind == "formulation" else list(run.properties)


def _read(path: Path, argument: str) -> Run:
    """Read a report; an error names the argument of the command line."""
    try:
        return read_run(path)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None
