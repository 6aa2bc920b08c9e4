"""The work of `replay`, `draw` and `audit`: a stored case, a scene, or a whole report is judged or solved again."""

import shlex
import textwrap
from collections.abc import Sequence
from math import isnan
from pathlib import Path
from tempfile import TemporaryDirectory

from contactverif.api.report import draw_outcome
from contactverif.api.run_files import PARAVIEW, PICTURES
from contactverif.cli.console import echo, print_plugin_output, show
from contactverif.cli.options import OutputFiles, read_place, with_engines
from contactverif.cli.run_screen import ending_lines
from contactverif.contract.case import Case
from contactverif.contract.counterexample import Counterexample
from contactverif.contract.errors import MisuseError, parse_name
from contactverif.contract.interface import PLANE
from contactverif.contract.property import Outcome, Verdict
from contactverif.contract.result import Run
from contactverif.contract.subject import Subject
from contactverif.isolation.file_reader import check_ordinary
from contactverif.isolation.limits import Limits
from contactverif.mechanics.scene import has_bodies
from contactverif.plugins import registry
from contactverif.problems.catalogue import load_scene
from contactverif.run.audit import Audit, check_libraries
from contactverif.run.audit import audit as audit_run
from contactverif.run.judge import judge_if_applicable
from contactverif.run.run_options import RunOptions
from contactverif.run.store import check_names
from contactverif.sampling.draw import Sampling
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.netcdf.differences import same_data
from contactverif_reports.netcdf.read import case_ids, read_case, read_run
from contactverif_reports.netcdf.write import write
from contactverif_reports.plot.text import as_text
from contactverif_reports.plot.vtu import write_vtu
from contactverif_reports.tables import Column, Table, numbers

_DRAWINGS = (*PICTURES, PARAVIEW)
_MOST_LINES = 20  # The most differences that are listed.
_MOST_COLUMNS = 80  # The largest number of columns of a remark.


def replay(
    report: Path,
    case: str | None,
    formulation: str | None,
    engine: str | None,
    out: Sequence[Path],
    options: RunOptions,
) -> int:
    """Judge a stored counterexample again, or list the ids; return 1 if it fails again, else 0."""
    files = OutputFiles.check(out, _DRAWINGS)
    if case is None:
        echo("\n".join(case_ids(report)) or "no counterexamples: nothing failed")
        return 0
    example = read_case(report, case)
    _check_surfaces(example.case, files)
    instead = formulation if engine is None else with_engines((), [engine])[0]
    subject = registry.the_subject(instead or announce_stored(example.formulation), options.limits())
    outcome = _judge_and_draw(example, subject, files)  # Before anything is printed: a file may not be writable.
    echo(as_text(example.case))
    table = Table([Column(head, wrap=True) for head in ("", "formulation", "verdict", "reason")])
    table.add("stored", example.formulation, str(example.verdict), example.reason)
    table.add("now", subject.name, str(outcome.verdict), outcome.reason)
    show(table.terminal())
    for line in ending_lines(outcome):
        echo(line)
    files.announce()
    return 1 if outcome.verdict in (Verdict.FAIL, Verdict.CRASHED) else 0


def draw(
    report: Path | None,
    case: str | None,
    scene: str | None,
    formulation: Sequence[str],
    out: Sequence[Path],
    options: RunOptions,
) -> int:
    """Draw a scene or a counterexample; return 0 if every formulation loaded and kept its contract, else 1."""
    files, limits, names = OutputFiles.check(out, _DRAWINGS), options.limits(), formulation
    for name in names:
        if names.count(name) > 1:
            raise MisuseError("--formulation", f"{name} twice", "each formulation once")
    complete = True
    if scene is not None:
        for option, value in (("--case", case), ("REPORT", report)):
            if value is not None:
                raise MisuseError("--scene", f"{scene} and {option} {value}", "one of the two")
        case_of_scene = load_scene(scene).case()
        if not names:
            raise MisuseError("--formulation", "nothing", f"some of {', '.join(registry.formulation_names())}")
        complete = _draw_solved(case_of_scene, names, scene, files, limits)
    else:
        example = _read_stored(report, case)
        if has_bodies(example.case):
            names = names or [announce_stored(example.formulation)]
            complete = _draw_solved(example.case, names, f"{case}: {example.reason}", files, limits)
        else:
            _check_surfaces(example.case, files)
            if len(names) > 1:
                raise MisuseError("--formulation", f"{len(names)} of them", "one, for a case without bodies")
            subject = registry.the_subject(names[0] if names else announce_stored(example.formulation), limits)
            _judge_and_draw(example, subject, files)
            if not files.paths:
                echo(as_text(example.case))
            files.announce()
    print_plugin_output()
    return 0 if complete else 1


def _judge_and_draw(example: Counterexample, subject: Subject, files: OutputFiles) -> Outcome:
    question = registry.the_property(example.property_id)
    outcome = judge_if_applicable(question, example.case, subject)
    for suffix, path in files.paths.items():
        if suffix == PARAVIEW and has_bodies(example.case):
            solved = solve_scene(example.case, [subject])
            if not solved.solutions:
                raise MisuseError("--out", f"no solution ({solved.failures[subject.name]})", "a .png or .svg file")
            write_vtu(solved, solved.solutions[0], path)
        else:
            draw_outcome(subject, question, outcome, path, argument="--out")
    return outcome


def _check_surfaces(case: Case, files: OutputFiles) -> None:
    if case.interface.dim == PLANE and PARAVIEW in files.names and not has_bodies(case):
        raise MisuseError("--out", f"{files.names[PARAVIEW]} for a case without bodies", "a .png or .svg file")


def announce_stored(name: str) -> str:
    """Say on standard error which formulation a report names, before it is loaded; return the name.

    Running it runs installed code with options that a stranger may have chosen.
    """
    base, options = parse_name("REPORT", name)
    installed = registry.formulation_names()
    for part in base.split("/"):
        if part not in installed:
            needed = "an installed one: install its plugin, or give --formulation NAME"
            raise MisuseError("REPORT", f"the formulation {part!r}, which is not installed", needed)
    if registry.loads_file(name):
        needed = f"--formulation {shlex.quote(name)}, if you trust the file"
        raise MisuseError("REPORT", f"the formulation {name}, which loads a file", needed)
    listed = ", ".join(f"{option} = {value!r}" for option, value in options.items())
    echo(f"the report names the formulation {base}, {listed or 'without options'}", to_stderr=True)
    return name


def _read_stored(report: Path | None, case: str | None) -> Counterexample:
    if report is None and case is None:
        raise MisuseError("--scene", "nothing to draw", "--scene NAME, or REPORT --case ID")
    if report is None:
        raise MisuseError("REPORT", f"none, but --case {case}", "the report that holds the case")
    if case is None:
        check_ordinary(report, "REPORT", "a report that `contactverif verify --out FILE.nc` wrote, or --scene NAME")
        raise MisuseError("--case", "nothing", f"--case ID; `contactverif replay {report}` lists the ids")
    return read_case(report, case)


def _draw_solved(case: Case, names: Sequence[str], title: str, files: OutputFiles, limits: Limits | None) -> bool:
    if PARAVIEW in files.names and len(names) > 1:
        file_for_many = f"{files.names[PARAVIEW]} for {len(names)} formulations"
        raise MisuseError("--out", file_for_many, "one --formulation: a .vtu file holds one solution")
    scene = solve_scene(case, [registry.load_formulation(name, limits) for name in names])
    for suffix, path in files.paths.items() if scene.solutions else ():
        if suffix == PARAVIEW:
            write_vtu(scene, scene.solutions[0], path)
        else:
            from contactverif_reports.plot.scene_figures import plot_scene  # importing matplotlib is slow

            plot_scene(scene, path, title=title)
    if not (scene.solutions and files.paths):
        echo(as_text(case))
    if scene.solutions:
        # How Newton's method ended for each formulation, a line each.
        table = Table([Column("formulation"), Column("end"), *numbers("iterations", "residual", "stress error")])
        for each in scene.solutions:
            residual = f"{each.residuals[-1]:.2g}"
            table.add(each.formulation, str(each.end), each.n_iterations, residual, each.stress_error)
        without_stress = all(isnan(each.stress_error) for each in scene.solutions)
        show((table.without("stress error") if without_stress else table).terminal())
    remarks = [(each.formulation, text) for each in scene.solutions for text in (each.advice, each.remark) if text]
    for name, text in (*remarks, *scene.failures.items()):
        echo("\n".join(textwrap.wrap(f"{name}: {text}", _MOST_COLUMNS, subsequent_indent="  ")))
    if scene.solutions:
        files.announce()
    return not scene.failures


def check_share(share: float) -> None:
    """Check that a share of cases is one."""
    if not 0 < share <= 1:
        raise MisuseError("--share", f"{share:g}", "a number above 0, and at most 1")


def audit(report: Path, share: float, options: RunOptions) -> int:
    """Audit a report, and show what differs; return 1 if something does, else 0."""
    check_share(share)
    run = read_run(report, consistent=False)
    check_names(run.formulations, options.names, "REPORT")
    check_libraries(run)
    stored, typed = run.provenance.get("place", ""), options.place_words
    if stored != typed:
        difference = f"a run with {stored or 'no place'}, and here {typed or 'none'}"
        raise MisuseError("REPORT", difference, "the same options")
    try:
        examples, seed = (int(run.provenance[name]) for name in ("examples", "seed"))
    except (KeyError, ValueError):
        raise MisuseError("REPORT", "a report without its number of cases or its seed", "an undamaged report") from None
    sampling, limits = Sampling.at(read_place(options), examples, seed), options.limits()
    subjects = [registry.the_subject(name, limits) for name in run.formulations]
    result = audit_run(run, subjects, [registry.the_property(id_) for id_ in run.properties], sampling, share)
    with TemporaryDirectory() as folder:
        derived = Path(folder) / "derived.nc"
        write(result.derived, derived)
        derivable = same_data(report, derived, names=("the report", "what follows from its numbers"))
    _show_audit(run, result, derivable)
    print_plugin_output()
    return 1 if derivable or result.differences else 0


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
    show("not derived: command, commit, date, isolation, platform, profile, seconds")
    show("Something differs." if lines else "Nothing differs.")
