"""The command `report`: a stored report in the terminal or as a page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from contactverif.cli.output_files import PAGE, OutputFiles
from contactverif.cli.shared_options import ReportPath, output_option


def report(
    path: ReportPath,
    out: Annotated[list[Path] | None, output_option("Write FILE.html: tables, distributions, pictures.")] = None,
) -> None:
    """Show a stored report: its table here, or all of it as a page.

    The page is one file without links to other files. It can be read on a
    phone and printed. Nothing is judged or solved again.

    \bExit status
      0  shown, whatever the report says
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif report vts-ppt.nc
      contactverif report vts-ppt.nc --out vts-ppt.html
    """
    from contactverif.cli.console import show
    from contactverif.cli.run_tables import RunTable, summary
    from contactverif_reports.netcdf.read import read_run

    files = OutputFiles.check(out, (PAGE,))
    if not files.paths:
        run = read_run(path)
        show(RunTable(run))
        show(summary(run))
        return
    from contactverif_reports.html.pages import write_page
    from contactverif_reports.html.report_page import report_page

    write_page(files.paths[PAGE], report_page(read_run(path), path), "--out")
    files.announce()
