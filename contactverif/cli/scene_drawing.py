"""The pictures of `draw`: a scene is solved, or a stored case judged again, and drawn; a small table goes with it."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from math import isnan
from pathlib import Path

from rich.table import Table

from contactverif.cli.console import plain_table, say, show
from contactverif.cli.counterexample_output import announce_stored, check_surfaces, draw_outcome
from contactverif.cli.output_files import SOLVED_SCENE, OutputFiles
from contactverif.contract.case import Case
from contactverif.contract.counterexample import Counterexample
from contactverif.contract.errors import MisuseError
from contactverif.isolation.file_reader import check_ordinary
from contactverif.isolation.limits import Limits
from contactverif.mechanics.scene import has_bodies
from contactverif.plugins.registry import formulation_names, load_formulation, the_formulation, the_property
from contactverif.problems.catalogue import load_scene
from contactverif.run.judge import judge_if_applicable
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.draw import as_text
from contactverif_reports.draw.solved_scene import SolvedScene
from contactverif_reports.netcdf.read import read_case

_WIDEST = 80  # The largest number of columns of a remark.


def draw_scene_or_case(
    report: Path | None,
    case_id: str | None,
    scene: str | None,
    names: Sequence[str],
    files: OutputFiles,
    limits: Limits | None = None,
) -> bool:
    """Draw a scene or a counterexample; return whether every formulation loaded and kept its contract."""
    for name in names:
        if list(names).count(name) > 1:
            raise MisuseError("--formulation", f"{name} twice", "each formulation once")
    if scene is not None:
        _check_alone(scene, report, case_id)
        case = load_scene(scene).case()
        if not names:
            raise MisuseError("--formulation", "nothing", f"some of {', '.join(formulation_names())}")
        return _draw_solved(case, names, scene, files, limits)
    stored = _read_stored(report, case_id)
    if has_bodies(stored.case):
        names = names or [announce_stored(stored.formulation)]
        return _draw_solved(stored.case, names, f"{case_id}: {stored.reason}", files, limits)
    _draw_stored(stored, names, files, limits)
    return True


def _check_alone(scene: str, report: Path | None, case_id: str | None) -> None:
    """Refuse a scene beside a counterexample."""
    for option, value in (("--case", case_id), ("REPORT", report)):
        if value is not None:
            raise MisuseError("--scene", f"{scene} and {option} {value}", "one of the two")


def _read_stored(report: Path | None, case_id: str | None) -> Counterexample:
    """Read the counterexample that the user names."""
    if report is None and case_id is None:
        raise MisuseError("--scene", "nothing to draw", "--scene NAME, or REPORT --case ID")
    if report is None:
        raise MisuseError("REPORT", f"none, but --case {case_id}", "the report that holds the case")
    if case_id is None:
        check_ordinary(report, "REPORT", "a report that `contactverif verify --out FILE.nc` wrote, or --scene NAME")
        raise MisuseError("--case", "nothing", f"--case ID; `contactverif replay {report}` lists the ids")
    return read_case(report, case_id)


def solutions_table(scene: SolvedScene) -> Table:
    """Return a table of how Newton's method ended for each formulation, a line each."""
    numbers = ["iterations", "residual"]
    if not all(isnan(solution.stress_error) for solution in scene.solutions):
        numbers.append("stress error")
    table = plain_table(words=("formulation", "end"), numbers=numbers)
    for solution in scene.solutions:
        error = "–" if isnan(solution.stress_error) else f"{solution.stress_error:.2g}"
        cells = f"{solution.n_iterations}", f"{solution.residuals[-1]:.2g}", error
        table.add_row(solution.formulation, solution.end, *cells[: len(numbers)])
    return table


def _draw_stored(stored: Counterexample, names: Sequence[str], files: OutputFiles, limits: Limits | None) -> None:
    """Draw a case without bodies, as `replay --out` draws it."""
    check_surfaces(stored.case, files)
    if len(names) > 1:
        raise MisuseError("--formulation", f"{len(names)} of them", "one, for a case without bodies")
    name = names[0] if names else announce_stored(stored.formulation)
    subject, question = the_formulation(name, limits), the_property(stored.property_id)
    outcome = judge_if_applicable(question, stored.case, subject)
    if not files.paths:
        say(as_text(stored.case))
    for picture in files.drawings():
        draw_outcome(subject, question, outcome, picture, argument="--out")
    files.announce()


def _draw_solved(case: Case, names: Sequence[str], title: str, files: OutputFiles, limits: Limits | None) -> bool:
    """Solve a scene with each formulation and write the files; return whether all could be used."""
    if SOLVED_SCENE in files.names and len(names) > 1:
        file_for_many = f"{files.names[SOLVED_SCENE]} for {len(names)} formulations"
        raise MisuseError("--out", file_for_many, "one --formulation: a .vtu file holds one solution")
    scene = solve_scene(case, [load_formulation(name, limits) for name in names])
    if scene.solutions:
        _write_files(scene, title, files)
    if not (scene.solutions and files.paths):
        say(as_text(case))
    if scene.solutions:
        show(solutions_table(scene))
    for line in _remarks(scene):
        say(line)
    if scene.solutions:
        files.announce()
    return not scene.failures


def _write_files(scene: SolvedScene, title: str, files: OutputFiles) -> None:
    """Write each picture and the file for ParaView."""
    for picture in files.pictures():
        from contactverif_reports.draw.scene_figures import draw_scene  # importing matplotlib is slow

        draw_scene(scene, picture, title=title)
    if SOLVED_SCENE in files.paths:
        from contactverif_reports.draw.vtu import write_vtu

        write_vtu(scene, scene.solutions[0], files.paths[SOLVED_SCENE])


def _remarks(scene: SolvedScene) -> list[str]:
    """Return what the user should know: advice where Newton's method failed, remarks, formulations without solution."""
    remarks = []
    for solution in scene.solutions:
        remarks += [(solution.formulation, text) for text in (solution.advice, solution.remark) if text]
    remarks += scene.failures.items()
    return ["\n".join(textwrap.wrap(f"{name}: {text}", _WIDEST, subsequent_indent="  ")) for name, text in remarks]
