"""The command `compare`: formulations against a reference, or an old report and a new one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import Annotated, Any

import typer

from contactverif.api.run_files import PAGE, REPORT
from contactverif.api.settings import read_settings
from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.output_files import OutputFiles
from contactverif.cli.shared_options import (
    RESULT_FILES,
    EngineNames,
    PlaceOptions,
    PropertyGlobs,
    SamplingOptions,
    ScreenOptions,
    WorkerOptions,
    formulation_argument,
    formulation_option,
    with_engines,
)
from contactverif.cli.verify_job import COMPARE, VerifyOptions, new_job, resumed_job
from contactverif.contract.errors import MisuseError


def compare(
    *,
    names: Annotated[list[str] | None, formulation_argument("Formulations; or two reports, OLD.nc NEW.nc.")] = None,
    engines: EngineNames = None,
    against: Annotated[list[str] | None, formulation_option("The one formulation to compare with.")] = None,
    properties: PropertyGlobs = None,
    sampling: SamplingOptions,
    out: Annotated[list[Path] | None, RESULT_FILES] = None,
    pictures: Annotated[
        Path | None, typer.Option(help="Draw the meshes on which they differ into this folder.", metavar="FOLDER")
    ] = None,
    place: PlaceOptions,
    workers: WorkerOptions,
    isolation: IsolationOptions,
    screen: ScreenOptions,
    resume: Annotated[
        Path | None,
        typer.Option(help="Go on with the comparison that was to write FILE and was stopped.", metavar="FILE"),
    ] = None,
) -> None:
    """Compare formulations with a reference, on the same cases; or two reports.

    Few lines say which verdicts differ, the errors and the time; -v shows all
    tables and the meshes on which they differ most.

    With --out, every outcome goes to the folder FILE.journal as soon as it is
    there, and --resume FILE goes on with a comparison that was stopped.

    A name that ends in .nc is a report. So is the name of any other file,
    unless an installed formulation has the same name.

    \bExit status, for formulations
      0  compared, and every candidate keeps its promises
      1  a candidate breaks a promise, cannot be judged or does not load.
         A candidate that is worse than the reference is a result and no
         error; promises of the reference do not count
    \bExit status, for two reports
      0  nothing got worse; being slower does not count as worse
      1  a property passed and fails now; a promise was kept and is broken
         now; an error beyond the tolerance has more than doubled; or more
         cases are undecided, or do not converge, than roundoff explains.
         Smaller changes are printed and do not count
    \bFor both
      2  the command line is wrong, or a file cannot be written; one line
         says what is needed
      130  stopped by Ctrl-C, after the table of what was judged

    \bExamples
      contactverif compare mine --against vts-ppt
      contactverif compare mine nts-ar --against vts-ppt --seed 7 --out mine.html
      contactverif compare --engine calculix --against engine/control
      contactverif compare --resume mine.nc
      contactverif compare old.nc new.nc
    """
    reference = _only_one("--against", against or [])
    names = with_engines(names, engines)
    reports = _reports_among(names)
    if reports:
        _check_no_run_options(sampling, place, workers, screen, against=reference, pictures=pictures, resume=resume)
        nothing_worse = _compare_reports(reports, properties or [], out)
        raise typer.Exit(0 if nothing_worse else 1)
    options = VerifyOptions(
        tuple([reference or "", *names] if reference or names else ()),
        tuple(properties or ()),
        sampling,
        tuple(out or ()),
        pictures,
        keep_going=True,
        place=place,
        workers=workers,
        isolation=isolation,
    )
    raise typer.Exit(_compare_formulations(options, resume, screen))


def _compare_formulations(typed: VerifyOptions, resume: Path | None, screen: ScreenOptions) -> int:
    """Compare formulations, the reference being the first name; return the exit status."""
    if resume is None and not any(typed.names[:1]):
        raise MisuseError("--against", "nothing", "the formulation to compare with, or two reports OLD.nc NEW.nc")
    if resume is None:
        job = new_job(typed.with_settings(read_settings()), command=COMPARE)
    else:
        job = resumed_job(resume, typed, COMPARE)
    from contactverif.cli.formulation_comparison import compare_formulations

    return compare_formulations(job, screen)


def _compare_reports(reports: Sequence[Path], globs: Sequence[str], out: Sequence[Path] | None) -> bool:
    """Compare two reports; return whether nothing got worse."""
    files = OutputFiles.check(out, (PAGE,))
    from contactverif.cli.report_comparison import compare_reports

    return compare_reports(reports, globs, files)


def _only_one(option: str, values: Sequence[str]) -> str | None:
    """Return the value of an option that typer would take several times, None without one."""
    if len(values) > 1:
        raise MisuseError(option, f"{len(values)}: {', '.join(values)}", "one")
    return values[0] if values else None


def _reports_among(names: Sequence[str]) -> list[Path]:
    """Return the two reports, if the names are those of reports; nothing if they are those of formulations."""
    reports = [name for name in names if _is_report(name)]
    if not reports:
        return []
    others = [name for name in names if name not in reports]
    if others:
        raise MisuseError("NAME", f"{others[0]} and the report {reports[0]}", "formulations alone, or two reports")
    if len(reports) != 2:
        raise MisuseError("NAME", f"{len(reports)} report{'s' * (len(reports) > 1)}", "two, OLD.nc NEW.nc")
    return [Path(name) for name in reports]


def _is_report(name: str) -> bool:
    """Return whether a name is that of a report: it ends in .nc, or is a file and no installed formulation."""
    from contactverif.plugins.registry import formulation_names

    return name.lower().endswith(REPORT) or (name not in formulation_names() and Path(name).is_file())


def _check_no_run_options(*groups: Any, **options: Any) -> None:
    """Refuse the options of a run beside two reports, which have been judged already."""
    for group in groups:
        values = {field.name: getattr(group, field.name) for field in fields(group)}
        options |= {field.name: values[field.name] for field in fields(group) if values[field.name] != field.default}
    for option, value in options.items():
        if value not in (None, False):
            raise MisuseError(f"--{option}", "two reports beside it", "formulations: a report has been judged already")
