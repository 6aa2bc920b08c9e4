"""The files that hold a run (a report, a page, what other programs read) or the picture of a case."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contactverif.contract.result import Run

REPORT = ".nc"
PAGE = ".html"
JSON = ".json"
JUNIT = ".xml"
RUN_FILES = (REPORT, PAGE, JSON, JUNIT)
PICTURES = (".png", ".svg")
PARAVIEW = ".vtu"  # A case in space, or a solved scene.


def write_run(run: Run, path: Path, report: Path | None = None) -> None:
    """Write a run to a file, whose suffix says what is written. `report` is the report that a page names."""
    match path.suffix.lower():
        case ".nc":
            from contactverif_reports.netcdf.write import write

            write(run, path)
        case ".html":
            from contactverif_reports.html.pages import write_page
            from contactverif_reports.html.report_page import report_page

            write_page(path, report_page(run, report or Path("FILE.nc")), "--out")
        case ".json":
            from contactverif_reports.exchange.run_document import write_json

            write_json(run, path)
        case _:
            from contactverif_reports.exchange.junit import write_junit

            write_junit(run, path)


def either(suffixes: Sequence[str]) -> str:
    """Return the suffixes in words: `.png, .svg or .vtu`."""
    *others, last = suffixes
    return f"{', '.join(others)} or {last}" if others else last
