"""Pictures on request: a case with its forces, or its scene solved, as PNG, SVG or VTU, and a small table beside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import typer
from rich.table import Table

from contactverif.cli.run_tables import plain_table, show
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import Outcome, Property
from contactverif.contract.subject import Subject
from contactverif.mechanics.scene import has_bodies
from contactverif.run.one_case import forces_on, judged, the_formulation, the_property
from contactverif.run.registry import formulation_names, load_formulation
from contactverif.scenes.catalogue import load_scene
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports import draw as pictures
from contactverif_reports.draw import as_text
from contactverif_reports.draw.solved_scene import Solution, SolvedScene
from contactverif_reports.files import check_writable, checked_name
from contactverif_reports.netcdf.read import StoredCase, read_case

PICTURES = (".png", ".svg")
GRIDS = (".vtu",)


@dataclass(frozen=True, slots=True)
class Targets:
    """Where to draw to, None for not at all.

    Raises
    ------
    MisuseError
        For a file that cannot be written, before anything is solved.
    """

    out: Path | None
    vtu: Path | None

    def __post_init__(self) -> None:
        for option, path, suffixes in (("--out", self.out, PICTURES), ("--vtu", self.vtu, GRIDS)):
            if path is not None:
                checked_name(path, suffixes, option)
                check_writable(path, option, f"FILE{suffixes[0]}")


def draw(report: Path | None, case_id: str | None, scene: str | None, names: Sequence[str], targets: Targets) -> bool:
    """The command `draw`: whether every formulation could be asked.

    Raises
    ------
    MisuseError
        If it is not said what to draw, or what is said does not go together.
    """
    if len(set(names)) < len(names):
        twice = next(name for name in names if list(names).count(name) > 1)
        raise MisuseError("--formulation", f"{twice} twice", "each of them once")
    if scene is not None:
        for option, given in (("--case", case_id), ("REPORT", report)):
            if given is not None:
                raise MisuseError("--scene", f"{scene} and {option} {given}", "one of the two")
        case = load_scene(scene).case()
        if not names:
            raise MisuseError("--formulation", "nothing", f"some of {', '.join(formulation_names())}")
        return _draw_solved(case, names, scene, targets)
    if report is None and case_id is None:
        raise MisuseError("--scene", "nothing to draw", "--scene NAME, or REPORT --case ID")
    if report is None:
        raise MisuseError("REPORT", f"none, but --case {case_id}", "the report that holds the case")
    if case_id is None:
        needed = f"--case ID; `contactverif replay {report}` lists the ids"
        raise MisuseError("--case", "nothing", needed)
    stored = read_case(report, case_id)
    if has_bodies(stored.case):
        return _draw_solved(stored.case, names or [stored.formulation], f"{case_id}: {stored.reason}", targets)
    _draw_stored(stored, names, targets)
    return True


def draw_case(subject: Subject, question: Property, outcome: Outcome, path: Path, argument: str = "--picture") -> None:
    """The interface of a case with the forces of the formulation beside the exact ones.

    Raises
    ------
    MisuseError
        If the file cannot be written.
    """
    title = f"{subject.name}, {question.id}: {outcome.reason or outcome.verdict}"
    try:
        forces = forces_on(outcome.case, subject)
        exact = question.exact(outcome.case) if question.exact is not None and forces is not None else None
        pictures.draw_case(outcome.case, path, title=title, forces=forces, exact=exact)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None


def solutions_table(found: SolvedScene) -> Table:
    """How each formulation ended, a line each."""
    table = plain_table("")
    columns = ["formulation", "end", "iterations", "residual", *(["stress error"] if _has_error(found) else [])]
    for column in columns:
        table.add_column(column, justify="right" if column in columns[2:] else "left", no_wrap=True)
    for one in found.solutions:
        error = [f"{one.stress_error:.2g}" if one.stress_error == one.stress_error else "–"]
        row = [one.formulation, one.end, f"{one.n_iterations}", f"{one.residuals[-1]:.2g}", *error]
        table.add_row(*row[: len(columns)])
    return table


def _draw_stored(stored: StoredCase, names: Sequence[str], targets: Targets) -> None:
    """A case without bodies, as `replay --picture` draws it."""
    if targets.vtu is not None:
        raise MisuseError("--vtu", "a case without bodies", "a scene, or --out FILE.png")
    if len(names) > 1:
        raise MisuseError("--formulation", f"{len(names)} of them", "one, for a case without bodies")
    subject, question = the_formulation((names or [stored.formulation])[0]), the_property(stored.property_id)
    outcome = judged(question, stored.case, subject)
    if targets.out is None:
        typer.echo(as_text(stored.case))
        return
    draw_case(subject, question, outcome, targets.out, "--out")
    typer.echo(f"picture: {targets.out}")


def _draw_solved(case: Case, names: Sequence[str], title: str, targets: Targets) -> bool:
    if targets.vtu is not None and len(names) > 1:
        raise MisuseError("--vtu", f"{len(names)} formulations", "one --formulation: a file holds one solution")
    found = solve_scene(case, [load_formulation(name) for name in names])
    written = _written(found, title, targets) if found.solutions else []
    if not written:
        typer.echo(as_text(case))
    if found.solutions:
        show(solutions_table(found))
    for name, why in _remarks(found):
        typer.echo(f"{name}: {' '.join(why.split())}")
    for line in written:
        typer.echo(line)
    return not found.failures


def _written(found: SolvedScene, title: str, targets: Targets) -> list[str]:
    """Writes what was asked for; a line for each file."""
    lines = []
    if targets.out is not None:
        from contactverif_reports.draw.scene_figures import draw_scene  # matplotlib takes its time

        draw_scene(found, targets.out, title=title)
        lines.append(f"picture: {targets.out}")
    if targets.vtu is not None:
        from contactverif_reports.draw.vtu import write_vtu

        write_vtu(found, found.solutions[0], targets.vtu)
        lines.append(f"ParaView: {targets.vtu}")
    return lines


def _remarks(found: SolvedScene) -> list[tuple[str, str]]:
    said = [(one.formulation, one.remark) for one in found.solutions if one.remark]
    return said + list(found.failures.items())


def _has_error(found: SolvedScene) -> bool:
    return any(isinstance(one, Solution) and one.stress_error == one.stress_error for one in found.solutions)
