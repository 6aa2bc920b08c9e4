"""The command `replay`: one stored counterexample, judged again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.output_files import PICTURES, SOLVED_SCENE, OutputFiles
from contactverif.cli.shared_options import CaseId, ReportPath, formulation_option, output_option, with_engines


def replay(
    *,
    report: ReportPath,
    case: CaseId = None,
    formulation: Annotated[
        str | None, formulation_option("Judge this formulation instead of the one that failed.")
    ] = None,
    engine: Annotated[
        str | None, typer.Option(help="Judge this engine instead of the one that failed.", metavar="NAME[:OPTIONS]")
    ] = None,
    out: Annotated[
        list[Path] | None,
        output_option(
            "Draw the case to FILE.png or FILE.svg, or write one in space for ParaView to FILE.vtu. Repeatable."
        ),
    ] = None,
    isolation: IsolationOptions,
) -> None:
    """Judge one stored counterexample again; without --case, list the ids.

    A report names the formulation that failed, and this runs it. It says which
    one, with which options, before it does.

    \bExit status
      0  the case does not fail any more
      1  the case fails again
      2  the command line is wrong; one line says what is needed

    \bExamples
      contactverif replay ppt.nc
      contactverif replay ppt.nc --case vts-ppt.balance.force
      contactverif replay ppt.nc --case vts-ppt.balance.force --out case.svg
      contactverif replay ppt.nc --case vts-ppt.balance.force --formulation mine
    """
    from contactverif.cli.console import say, show
    from contactverif.cli.counterexample_output import (
        announce_stored,
        check_surfaces,
        draw_outcome,
        ending_lines,
        replay_table,
    )
    from contactverif.contract.property import Verdict
    from contactverif.plugins.registry import the_property, the_subject
    from contactverif.run.judge import judge_if_applicable
    from contactverif_reports.draw import as_text
    from contactverif_reports.netcdf.read import case_ids, read_case

    files = OutputFiles.check(out, (*PICTURES, SOLVED_SCENE))
    if case is None:
        ids = case_ids(report)
        say("\n".join(ids) if ids else "no counterexamples: nothing failed")
        return
    example = read_case(report, case)
    check_surfaces(example.case, files)
    instead = formulation if engine is None else with_engines(None, [engine])[0]
    subject = the_subject(instead or announce_stored(example.formulation), isolation.limits())
    question = the_property(example.property_id)
    outcome = judge_if_applicable(question, example.case, subject)
    for picture in files.drawings():  # before anything is printed, in case a file cannot be written
        draw_outcome(subject, question, outcome, picture, argument="--out")
    say(as_text(example.case))
    show(replay_table(example, subject.name, outcome))
    for line in ending_lines(outcome):
        say(line)
    files.announce()
    raise typer.Exit(1 if outcome.verdict in (Verdict.FAIL, Verdict.CRASHED) else 0)
