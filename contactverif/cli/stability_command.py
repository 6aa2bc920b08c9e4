"""The command `stability`: error against condition number on states that get harder and harder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from contactverif.cli.output_files import MARKDOWN, PICTURES, REPORT, OutputFiles
from contactverif.cli.shared_options import IsolationOptions, complete_formulation
from contactverif.cli.verify_command import select_names

if TYPE_CHECKING:
    from contactverif.contract.result import Run


def stability(
    *,
    names: Annotated[
        list[str] | None,
        typer.Argument(
            help="Formulations, with options: vts-ppt, vts-me:n=4, nts-ar:area=reference.",
            metavar="NAME",
            autocompletion=complete_formulation,
        ),
    ] = None,
    all_: Annotated[bool, typer.Option("--all", help="Take every installed formulation that wraps no other.")] = False,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            "--out",
            help="Write the results: FILE.nc the numbers, FILE.svg or FILE.png the figure, FILE.md a page. Repeatable.",
            metavar="FILE",
        ),
    ] = None,
    isolation: IsolationOptions,
) -> None:
    """Draw error against condition number, to tell bad conditioning from bad rounding.

    The states have gaps down to 1e-12, segments down to 1e-9, offsets up
    to 1e9 and penalties up to 1e12 E/h. The error of a stable formulation
    is at most 16 u × condition number. The error of one that rounds
    positions far from the origin is above that line.

    \bExit status
      0  no promise is broken: what says that it is stable under
         translations is below the line in all states
      1  a promise is broken, a property could not be judged, or a plugin
         does not load
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif stability vts-ppt mortar --out stability.svg
      contactverif stability mine --out mine.nc --out mine.png
      contactverif replay mine.nc --case mine.stability.sweep.offset-1e6-a
    """
    from contactverif.cli.progress import Bar
    from contactverif.run.registry import load_formulation
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
        from contactverif_reports.stability.markdown_page import stability_page

        page = stability_page(result, {suffix: name.name for suffix, name in files.names.items()})
        with whole(files.paths[MARKDOWN]) as part:
            part.write_text(page, encoding="utf-8")


def _show(result: Run, files: OutputFiles) -> None:
    """Print the table, a sentence for each formulation, and the names of the files."""
    from contactverif.cli.console import show, show_as_it_is
    from contactverif.cli.run_tables import summary
    from contactverif.cli.stability_tables import replay_lines, roundings_table, sentence_text
    from contactverif_reports.stability.sweep_points import sweep_panels

    panels = sweep_panels(result)
    show(roundings_table(panels))
    show("* relative, at offset 1e6 and gap 1e-6; –: no number")
    typer.echo()
    for panel in panels:
        show(sentence_text(panel))
        for line in replay_lines(panel, files.names[REPORT]) if REPORT in files.names else []:
            show_as_it_is(line)
    files.announce()
    show(summary(result))
