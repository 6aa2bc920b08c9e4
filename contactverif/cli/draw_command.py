"""The command `draw`: a scene, solved and drawn. What it does stands in `scene_drawing`, which is slow to import."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.output_files import PICTURES, SOLVED_SCENE, OutputFiles
from contactverif.cli.run_endings import show_what_plugins_printed
from contactverif.cli.shared_options import CaseId, formulation_option, output_option


def draw(
    *,
    report: Annotated[
        Path | None, typer.Argument(help="A report that verify --out FILE.nc wrote.", metavar="REPORT")
    ] = None,
    case: CaseId = None,
    scene: Annotated[
        str | None,
        typer.Option(help="A scene instead of a report; contactverif scenes lists them.", metavar="NAME[:OPTIONS]"),
    ] = None,
    formulation: Annotated[
        list[str] | None,
        formulation_option(
            "Solve with this formulation. Repeatable. For a counterexample, by default the one that failed.",
            "--formulation",
            "-f",
        ),
    ] = None,
    out: Annotated[
        list[Path] | None,
        output_option("Draw to FILE.png or FILE.svg, or write the solved scene for ParaView to FILE.vtu. Repeatable."),
    ] = None,
    isolation: IsolationOptions,
) -> None:
    """Solve a scene and draw it: deformed bodies, contact pressure, residuals.

    Displacements and penetration are magnified; the figure says how much.
    Several formulations are drawn side by side, also those for which
    Newton's method did not converge. A counterexample without bodies is not
    solved: its forces are drawn.

    \bExit status
      0  drawn
      1  a formulation does not load or breaks its contract; the others are
         drawn
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif draw --scene c -f vts-ppt --out c.png --out c.vtu
      contactverif draw --scene c:degrees=30 -f nts -f vts-ppt --out both.svg
      contactverif draw ppt.nc --case vts-ppt.balance.force --out case.png
    """
    files = OutputFiles.check(out, (*PICTURES, SOLVED_SCENE))
    from contactverif.cli.scene_drawing import draw_scene_or_case

    complete = draw_scene_or_case(report, case, scene, formulation or [], files, isolation.limits())
    show_what_plugins_printed()
    raise typer.Exit(0 if complete else 1)
