"""The command `stability`: error against condition number on states that get harder and harder."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table
from rich.text import Text

from contactverif.api.run_files import REPORT
from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.output_files import MARKDOWN, PICTURES, OutputFiles
from contactverif.cli.shared_options import EveryFormulation, FormulationNames, output_option
from contactverif.cli.verify_command import select_names

if TYPE_CHECKING:
    from contactverif.contract.result import Run
    from contactverif_reports.stability.sweep_points import SweepPanel

_MOST_IDS = 3  # Cases of a formulation whose command is printed.


def stability(
    *,
    names: FormulationNames = None,
    all_: EveryFormulation = False,
    out: Annotated[
        list[Path] | None,
        output_option(
            "Write the results: FILE.nc the numbers, FILE.svg or FILE.png the figure, FILE.md a page. Repeatable."
        ),
    ] = None,
    isolation: IsolationOptions,
) -> None:
    """Draw error against condition number, to tell bad conditioning from bad rounding.

    The states have gaps down to 1e-12, segments down to 1e-9, offsets up
    to 1e9 and penalties up to 1e12 E/h. The error of a stable formulation
    is at most 4 u × condition number, the line of the figure. The error of
    one that rounds positions far from the origin is above that line. The
    properties fail from 16 u × condition number on.

    \bExit status
      0  no promise is broken: what says that it is stable under
         translations stays below 16 u × condition number
      1  a promise is broken, a property could not be judged, or a plugin
         does not load
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif stability vts-ppt mortar --out stability.svg
      contactverif stability mine --out mine.nc --out mine.png
      contactverif replay mine.nc --case mine.stability.sweep.offset-1e6-a
    """
    from contactverif.cli.progress import Bar
    from contactverif.plugins.registry import load_formulation
    from contactverif.studies.stability_study import run_stability

    limits = isolation.limits()
    all_names = select_names(names or [], all_, limits)
    files = OutputFiles.check(out, (REPORT, *PICTURES, MARKDOWN))
    subjects = [load_formulation(name, limits) for name in all_names]
    with Bar() as bar:
        outputs = [str(name) for name in files.names.values()]
        result = run_stability(subjects, progress=bar.show_progress, outputs=outputs)
    _write(result, files)
    _show(result, files)
    raise typer.Exit(0 if result.promises_kept else 1)


def _write(result: Run, files: OutputFiles) -> None:
    """Write the files that the user wants, before anything is shown."""
    from contactverif_reports.stability.sweep_points import sweep_panels

    if REPORT in files.paths:
        from contactverif_reports.netcdf.write import write

        write(result, files.paths[REPORT], with_named_cases=True)
    for picture in files.pictures():
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
    from contactverif.cli.console import show, show_as_it_is
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
            show_as_it_is(Text(f"    contactverif replay {report} --case {shlex.quote(point.case_id)}"))
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
