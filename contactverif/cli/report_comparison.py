"""The comparison of an old report with a new one: tables of the changes, and the meshes of what got worse."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from contactverif.cli.comparison_tables import DRAWN, ChangesTable, outcome_of, stored_mesh
from contactverif.cli.output_files import PAGE, OutputFiles
from contactverif.cli.run_tables import show, show_as_it_is
from contactverif.contract.errors import MisuseError
from contactverif.contract.names import unknown_name_error
from contactverif_reports.compare.regression import Changes
from contactverif_reports.html.comparison_page import changes_page
from contactverif_reports.html.pages import write_page
from contactverif_reports.netcdf.read import StoredCase, case_ids, read_case
from contactverif_reports.netcdf.schema import case_id
from contactverif_reports.netcdf.stored_cells import StoredCells, read_cells


def compare_reports(paths: Sequence[Path], globs: Sequence[str], files: OutputFiles) -> bool:
    """Show what changed from an old report to a new one, and write the page.

    Parameters
    ----------
    paths : Sequence[Path]
        The old report and the new one.
    globs : Sequence[str]
        Patterns of property ids; none means all.
    files : OutputFiles
        At most a page.

    Returns
    -------
    bool
        Whether nothing got worse.

    Raises
    ------
    MisuseError
        If a file is no report of this schema, or the two have nothing in common.
    """
    old, new = (_read(path, argument) for path, argument in zip(paths, ("OLD.nc", "NEW.nc"), strict=True))
    changes = Changes.of(*(_select(report, globs, [old, new]) for report in (old, new)))
    if not changes.changes and not changes.lost:
        kind = "formulation" if not set(old.formulations) & set(new.formulations) else "property"
        names = " and ".join(", ".join(_names(report, kind)) or "nothing" for report in (old, new))
        raise MisuseError("NEW.nc", f"no {kind} that OLD.nc has too ({names})", "two reports with something in common")
    meshes = _smallest_failing(changes)
    if PAGE in files.paths:
        write_page(files.paths[PAGE], changes_page(changes, meshes), "--out")
    show(ChangesTable(changes))
    for id_, stored in list(meshes.items())[:DRAWN]:
        show_as_it_is(stored_mesh(id_, stored, new.path))
    files.announce()
    show(outcome_of(changes))
    return not changes.regressions


def _smallest_failing(changes: Changes) -> dict[str, StoredCase]:
    """Return {id: counterexample} of the new report, for what got worse and fails."""
    stored = case_ids(changes.new.path)
    cells = [change.new for change in changes.changes if change.regressions]
    ids = [case_id(cell.formulation, cell.property_id) for cell in cells]
    return {id_: read_case(changes.new.path, id_) for id_ in ids if id_ in stored}


def _select(report: StoredCells, globs: Sequence[str], both: Sequence[StoredCells]) -> StoredCells:
    """Return the report without the properties that no pattern names."""
    every = dict.fromkeys(id_ for report_ in both for id_ in report_.properties)
    for glob in globs:
        if not any(fnmatchcase(id_, glob) for id_ in every):
            raise unknown_name_error("--property", glob, every)
    return report.only([id_ for id_ in every if not globs or any(fnmatchcase(id_, glob) for glob in globs)])


def _names(report: StoredCells, kind: str) -> Sequence[str]:
    return report.formulations if kind == "formulation" else report.properties


def _read(path: Path, argument: str) -> StoredCells:
    """Read a report; an error names the argument of the command line."""
    try:
        return read_cells(path)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None
