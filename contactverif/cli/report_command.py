"""The command `report`: a stored report in the terminal or as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from contactverif.api.run_files import REPORT, RUN_FILES, run_writers
from contactverif.cli.output_files import OutputFiles
from contactverif.cli.shared_options import ReportPath, ScreenOptions, output_option


def report(
    path: ReportPath,
    out: Annotated[list[Path] | None, output_option("Write FILE.html, a page; or FILE.json, FILE.xml (JUnit).")] = None,
    *,
    screen: ScreenOptions,
) -> None:
    """Show a stored report: its results here, or all of it as a page.

    The page is one file without links to other files. It can be read on a
    phone and printed. Other programs read JSON and JUnit's XML.
    Nothing is judged or solved again.

    \bExit status
      0  shown, whatever the report says
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif report vts-ppt.nc
      contactverif report vts-ppt.nc --out vts-ppt.html --out vts-ppt.xml
    """
    from contactverif.cli.console import show
    from contactverif.cli.run_tables import summary
    from contactverif.cli.verify_command import show_run
    from contactverif_reports.netcdf.read import read_run

    files = OutputFiles.check(out, [suffix for suffix in RUN_FILES if suffix != REPORT])
    run = read_run(path)
    if not files.paths:
        if not screen.quiet:
            show_run(run, screen, path)
        show(summary(run, quiet=screen.quiet))
        return
    writers = run_writers(run, path)
    for suffix, target in files.paths.items():
        writers[suffix](target)
    files.announce()
