"""The work of `replay` and `audit`: one case of a stored report, or all of it, is judged again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from contactverif.api.drawing import draw_outcome
from contactverif.cli.console import echo, print_plugin_output, show
from contactverif.cli.options import PICTURES, SOLVED_SCENE, OutputFiles, read_place, with_engines
from contactverif.cli.run_screen import ending_lines
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError, parse_name
from contactverif.contract.interface import PLANE
from contactverif.contract.property import Verdict
from contactverif.contract.result import Run
from contactverif.plugins.registry import formulation_names, the_property, the_subject
from contactverif.run.audit import Audit
from contactverif.run.audit import audit as audit_run
from contactverif.run.judge import judge_if_applicable
from contactverif.run.run_options import RunOptions
from contactverif.sampling.draw import Sampling
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import case_ids, read_case, read_run
from contactverif_reports.netcdf.write import write
from contactverif_reports.plot.text import as_text
from contactverif_reports.tables import Column, Table

_MOST_LINES = 20  # The most differences that are listed.


def replay(
    report: Path,
    case: str | None,
    formulation: str | None,
    engine: str | None,
    out: Sequence[Path],
    options: RunOptions,
) -> int:
    """Judge a stored counterexample again, or list the ids; return 1 if it fails again, else 0."""
    files = OutputFiles.check(out, (*PICTURES, SOLVED_SCENE))
    if case is None:
        ids = case_ids(report)
        echo("\n".join(ids) if ids else "no counterexamples: nothing failed")
        return 0
    example = read_case(report, case)
    check_surfaces(example.case, files)
    instead = formulation if engine is None else with_engines((), [engine])[0]
    subject = the_subject(instead or announce_stored(example.formulation), options.limits())
    question = the_property(example.property_id)
    outcome = judge_if_applicable(question, example.case, subject)
    for picture in files.drawings():  # before anything is printed, in case a file cannot be written
        draw_outcome(subject, question, outcome, picture, argument="--out")
    echo(as_text(example.case))
    table = Table([Column(head, wrap=True) for head in ("", "formulation", "verdict", "reason")])
    table.add("stored", example.formulation, str(example.verdict), example.reason)
    table.add("now", subject.name, str(outcome.verdict), outcome.reason)
    show(table.terminal())
    for line in ending_lines(outcome):
        echo(line)
    files.announce()
    return 1 if outcome.verdict in (Verdict.FAIL, Verdict.CRASHED) else 0


def check_share(share: float) -> None:
    """Check that a share of cases is one."""
    if not 0 < share <= 1:
        raise MisuseError("--share", f"{share:g}", "a number above 0, and at most 1")


def audit(report: Path, share: float, options: RunOptions) -> int:
    """Audit a report, and show what differs; return 1 if something does, else 0."""
    check_share(share)
    run = read_run(report, consistent=False)
    sampling = _sampling(run, options)
    limits = options.limits()
    subjects = [the_subject(name, limits) for name in run.formulations]
    questions = [the_property(id_) for id_ in run.properties]
    result = audit_run(run, subjects, questions, sampling, share)
    with TemporaryDirectory() as folder:
        derived = Path(folder) / "derived.nc"
        write(result.derived, derived)
        derivable = same_data(report, derived, names=("the report", "what follows from its numbers"))
    _show_audit(run, result, derivable)
    print_plugin_output()
    return 1 if derivable or result.differences else 0


def _sampling(run: Run, options: RunOptions) -> Sampling:
    stored, typed = run.provenance.get("place", ""), options.place_words
    if stored != typed:
        difference = f"a run with {stored or 'no place'}, and here {typed or 'none'}"
        raise MisuseError("REPORT", difference, "the same options")
    try:
        examples, seed = (int(run.provenance[name]) for name in ("examples", "seed"))
    except (KeyError, ValueError):
        raise MisuseError("REPORT", "a report without its number of cases or its seed", "an undamaged report") from None
    return Sampling.at(read_place(options), examples, seed)


def _show_audit(run: Run, audit: Audit, derivable: list[str]) -> None:
    show(f"{len(run.rows)} rows, {audit.n_outcomes} outcomes, {audit.n_examples} witnesses and counterexamples")
    for change in audit.changes:
        echo(f"  {change}")
    compared = "up to roundoff" if audit.changes else "bit for bit"
    show(f"derived again: all verdicts and counts; {len(derivable)} disagree")
    n_judged = f"{audit.n_judged} of {audit.n_outcomes} outcomes and all {audit.n_examples} others"
    show(f"judged again: {n_judged}; {len(audit.differences)} differ, {compared}")
    lines = [*derivable, *audit.differences]
    for line in lines[:_MOST_LINES]:
        echo(f"  {line}")
    if len(lines) > _MOST_LINES:
        echo(f"  and {len(lines) - _MOST_LINES} more")
    show(f"seconds: {audit.seconds:.1f}, and {sum(row.seconds for row in run.rows):.1f} in the run")
    chances = [f"{count}: {audit.chance(count):.0%}" for count in (1, 10, 100) if count <= audit.n_outcomes]
    if chances:
        show(f"chance to see one forged outcome among so many: {', '.join(chances)}")
    show("Something differs." if lines else "Nothing differs.")


def check_surfaces(case: Case, files: OutputFiles) -> None:
    """Refuse a file for ParaView of an interface in the plane."""
    if case.interface.dim == PLANE and SOLVED_SCENE in files.names:
        raise MisuseError("--out", f"{files.names[SOLVED_SCENE]} for a case without bodies", "a .png or .svg file")


def announce_stored(name: str) -> str:
    """Say on standard error which formulation a report names, before it is loaded; return the name.

    Running it runs installed code with options that a stranger may have chosen.
    """
    base, options = parse_name("REPORT", name)
    installed = formulation_names()
    for part in base.split("/"):
        if part not in installed:
            needed = "an installed one: install its plugin, or give --formulation NAME"
            raise MisuseError("REPORT", f"the formulation {part!r}, which is not installed", needed)
    listed = ", ".join(f"{option} = {value!r}" for option, value in options.items())
    echo(f"the report names the formulation {base}, {listed or 'without options'}", to_stderr=True)
    return name
