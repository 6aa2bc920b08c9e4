"""The files that hold a run: a report, a page, and what other programs read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from contactverif.contract.result import Run

REPORT = ".nc"
PAGE = ".html"
JSON = ".json"
JUNIT = ".xml"
RUN_FILES = (REPORT, PAGE, JSON, JUNIT)


def run_writers(run: Run, report: Path | None) -> dict[str, Callable[[Path], None]]:
    """Return the function that writes a run to a path for each suffix. `report` is the report that a page names."""

    def write_report(path: Path) -> None:
        from contactverif_reports.netcdf.write import write

        write(run, path)

    def write_html(path: Path) -> None:
        from contactverif_reports.html.pages import write_page
        from contactverif_reports.html.report_page import report_page

        write_page(path, report_page(run, report or Path("FILE.nc")), "--out")

    def write_document(path: Path) -> None:
        from contactverif_reports.exchange.run_document import write_json

        write_json(run, path)

    def write_suites(path: Path) -> None:
        from contactverif_reports.exchange.junit import write_junit

        write_junit(run, path)

    return {REPORT: write_report, PAGE: write_html, JSON: write_document, JUNIT: write_suites}


def either(suffixes: Sequence[str]) -> str:
    """Return the suffixes in words: `.png, .svg or .vtu`."""
    *others, last = suffixes
    return f"{', '.join(others)} or {last}" if others else last
