"""The command `audit`: each verdict of a report follows again from its numbers, and a share is judged again."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from contactverif.cli.isolation_options import IsolationOptions
from contactverif.cli.shared_options import PlaceOptions, ReportPath
from contactverif.contract.errors import MisuseError

if TYPE_CHECKING:
    from contactverif.contract.result import Run
    from contactverif.run.audit import Audit
    from contactverif.sampling.draw import Sampling

SHARE = 0.01
_MOST_LINES = 20  # The most differences that are listed.
_NAMES = "the report", "what follows from its numbers"
Share = Annotated[float, typer.Option(help="Share of the cases of each row that is judged again.", metavar="SHARE")]


def audit(
    *,
    report: ReportPath,
    share: Share = SHARE,
    place: PlaceOptions,
    isolation: IsolationOptions,
) -> None:
    """Check a report that somebody else may have made.

    All verdicts, counts and sums are derived again from the stored numbers. A
    random share of the cases of each row, at least one, all witnesses and all
    counterexamples are judged again by the formulations that are installed.
    On the same machine, with the same versions and code, numbers agree bit for
    bit. Else a value agrees within its tolerance, or to a millionth of itself.

    A report on a mesh or a scene needs the options that the run had.

    \bExit status
      0  nothing differs
      1  something differs; it is listed
      2  the command line is wrong, or the file is no report

    \bExamples
      contactverif audit vts-ppt.nc
      contactverif audit vts-ppt.nc --share 0.1
    """
    raise typer.Exit(audit_report(report, share, place, isolation))


def check_share(share: float) -> None:
    """Check that a share of cases is one."""
    if not 0 < share <= 1:
        raise MisuseError("--share", f"{share:g}", "a number above 0, and at most 1")


def audit_report(report: Path, share: float, place: PlaceOptions, isolation: IsolationOptions) -> int:
    """Audit a report, and show what differs; return the exit status."""
    from contactverif.cli.run_endings import show_what_plugins_printed
    from contactverif.plugins.registry import the_property, the_subject
    from contactverif.run.audit import audit as audit_run
    from contactverif_reports.netcdf.differences import same_data
    from contactverif_reports.netcdf.read import read_run
    from contactverif_reports.netcdf.write import write

    check_share(share)
    run = read_run(report, consistent=False)
    sampling = _sampling(run, place)
    subjects = [the_subject(name, isolation.limits()) for name in run.formulations]
    questions = [the_property(id_) for id_ in run.properties]
    result = audit_run(run, subjects, questions, sampling, share)
    with TemporaryDirectory() as folder:
        derived = Path(folder) / "derived.nc"
        write(result.derived, derived)
        derivable = same_data(report, derived, names=_NAMES)
    _show(run, result, derivable)
    show_what_plugins_printed()
    return 1 if derivable or result.differences else 0


def _sampling(run: Run, place: PlaceOptions) -> Sampling:
    """Return the size and the seed of a run, and the place where it asked."""
    from contactverif.run.store import place_words
    from contactverif.sampling.draw import Sampling

    stored, typed = run.provenance.get("place", ""), place_words(asdict(place))
    if stored != typed:
        raise MisuseError(
            "REPORT", f"a run with {stored or 'no place'}, and here {typed or 'none'}", "the same options"
        )
    try:
        examples, seed = (int(run.provenance[name]) for name in ("examples", "seed"))
    except (KeyError, ValueError):
        raise MisuseError("REPORT", "a report without its number of cases or its seed", "an undamaged report") from None
    return Sampling.at(place.read(), examples, seed)


def _show(run: Run, audit: Audit, derivable: list[str]) -> None:
    """Show what was compared, what differs, and how likely a forgery would have been seen."""
    from contactverif.cli.console import say, show

    show(f"{len(run.rows)} rows, {audit.n_outcomes} outcomes, {audit.n_examples} witnesses and counterexamples")
    for change in audit.changes:
        say(f"  {change}")
    compared = "up to roundoff" if audit.changes else "bit for bit"
    show(f"derived again: all verdicts and counts; {len(derivable)} disagree")
    n_judged = f"{audit.n_judged} of {audit.n_outcomes} outcomes and all {audit.n_examples} others"
    show(f"judged again: {n_judged}; {len(audit.differences)} differ, {compared}")
    lines = [*derivable, *audit.differences]
    for line in lines[:_MOST_LINES]:
        say(f"  {line}")
    if len(lines) > _MOST_LINES:
        say(f"  and {len(lines) - _MOST_LINES} more")
    show(f"seconds: {audit.seconds:.1f}, and {sum(row.seconds for row in run.rows):.1f} in the run")
    chances = [f"{count}: {audit.chance(count):.0%}" for count in (1, 10, 100) if count <= audit.n_outcomes]
    if chances:
        show(f"chance to see one forged outcome among so many: {', '.join(chances)}")
    show("Something differs." if lines else "Nothing differs.")
