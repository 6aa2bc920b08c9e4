"""The command `stability`: error against condition number on states that get harder and harder."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.table import Table
from rich.text import Text

from contactverif.api.run_files import REPORT
from contactverif.cli.options import MARKDOWN, PICTURES, OutputFiles, select_names
from contactverif.run.run_options import RunOptions

if TYPE_CHECKING:
    from contactverif.contract.result import Run
    from contactverif_reports.stability.sweep_points import SweepPanel

_MOST_IDS = 3  # Cases of a formulation whose command is printed.


def stability(options: RunOptions, out: Sequence[Path]) -> int:
    """Run the study, write its files and show it; return the exit status."""
    from contactverif.cli.progress import Bar
    from contactverif.plugins.registry import load_formulation
    from contactverif.studies.stability_study import run_stability

    limits = options.limits()
    all_names = select_names(options)
    files = OutputFiles.check(out, (REPORT, *PICTURES, MARKDOWN))
    subjects = [load_formulation(name, limits) for name in all_names]
    with Bar() as bar:
        outputs = [str(name) for name in files.names.values()]
        result = run_stability(subjects, progress=bar.show_progress, outputs=outputs)
    _write(result, files)
    _show(result, files)
    return 0 if result.promises_kept else 1


def _write(result: Run, files: OutputFiles) -> None:
    """Write the files that the user wants, before anything is shown."""
    from contactverif_reports.stability.sweep_points import sweep_panels

    if REPORT in files.paths:
        from contactverif_reports.netcdf.write import write

        write(result, files.paths[REPORT], with_named_cases=True)
    for picture in (path for suffix, path in files.paths.items() if suffix in PICTURES):
        from contactverif_reports.draw.stability_figure import draw_stability  # importing matplotlib is slow

        draw_stability(sweep_panels(result), picture)
    if MARKDOWN in files.paths:
        from contactverif_reports.files import whole
        from contactverif_reports.stability.stability_page import stability_page

        page = stability_page(result, {suffix: name.name for suffix, name in files.names.items()})
        with whole(files.paths[MARKDOWN]) as part:
            part.write_text(page, encoding="utf-8")


def _show(result: Run, files: OutputFiles) -> None:
    """Print the table, a sentence for each formulation with commands to replay its worst cases, and the files."""
    from contactverif.cli.console import show, show_verbatim
    from contactverif.cli.run_tables import summary
    from contactverif_reports.stability.stability_page import sentence_of
    from contactverif_reports.stability.sweep_points import sweep_panels

    panels = sweep_panels(result)
    show(_roundings_table(panels))
    show("* relative, at offset 1e6 and gap 1e-6; –: no number")
    typer.echo()
    for panel in panels:
        sentence = f"{panel.formulation} {sentence_of(panel).replace('`', '')}"
        show(Text(sentence, style="magenta" if panel.above else ""))
        failing = [point for point in panel.above if point.fails]
        for point in failing[:_MOST_IDS] if REPORT in files.names else ():
            report = shlex.quote(str(files.names[REPORT]))
            show_verbatim(Text(f"    contactverif replay {report} --case {shlex.quote(point.case_id)}"))
    files.announce()
    show(summary(result))


def _roundings_table(panels: Sequence[SweepPanel]) -> Table:
    """Return ω by formulation and state; the last column is the relative error of the forces."""
    from contactverif.cli.console import plain_table
    from contactverif_reports.stability.sweep_points import COLUMNS, FAR_AND_CLOSE, LINE_FACTOR, short_number

    def rounding(number: float) -> Text:
        style = "dim" if isnan(number) else "magenta" if number > LINE_FACTOR else "green"
        return Text(short_number(number), style=style)

    title = f"ω: the error over u × condition number (stable: at most {LINE_FACTOR:g})"
    headings = [heading.replace(" ", "\n").replace(",", "") for heading in COLUMNS]
    table = plain_table(title, "formulation", numbers=(*headings, "error of\nforces*"), dense=True)
    for panel in panels:
        numbers = [rounding(panel.roundings_at(stem)) for stem in COLUMNS.values()]
        table.add_row(panel.formulation, *numbers, short_number(panel.force_error_at(FAR_AND_CLOSE)))
    return table
