"""The work of `report`: a stored report is shown, or written as other files. It imports nothing that judges."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from contactverif.api.run_files import REPORT, RUN_FILES, write_run
from contactverif.cli.console import show
from contactverif.cli.options import OutputFiles, Screen
from contactverif.cli.run_screen import show_run
from contactverif.cli.run_tables import summary
from contactverif_reports.netcdf.read import read_run


def report(path: Path, out: Sequence[Path], screen: Screen) -> None:
    """Show a report, or write it as other files."""
    files = OutputFiles.check(out, [suffix for suffix in RUN_FILES if suffix != REPORT])
    run = read_run(path)
    if not files.paths:
        if not screen.quiet:
            show_run(run, screen, path)
        show(summary(run, quiet=screen.quiet))
        return
    for target in files.paths.values():
        write_run(run, target, path)
    files.announce()
