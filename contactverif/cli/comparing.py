"""The command `compare`: formulations against a reference, or an old report and a new one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from fnmatch import fnmatchcase
from pathlib import Path

import typer

from contactverif.cli.comparison_tables import (
    DRAWN,
    ChangesTable,
    SideBySide,
    last_line,
    mesh,
    outcome_of,
    stored_mesh,
)
from contactverif.cli.drawing import draw_case
from contactverif.cli.progress import Bar
from contactverif.cli.run_tables import show, show_as_it_is
from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface
from contactverif.contract.names import unknown_name_error
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.mechanics.scene import has_bodies
from contactverif.run.one_case import forces_on
from contactverif.run.registry import formulation_names, load_formulation, load_properties
from contactverif.studies.comparison_study import Study, compared
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.compare.comparison import Differing
from contactverif_reports.compare.regression import Changes
from contactverif_reports.files import check_writable, made_folder
from contactverif_reports.html.comparison_page import Drawing, changes_page, comparison_page
from contactverif_reports.html.pages import check_page, write_page
from contactverif_reports.netcdf.read import StoredCase, case_ids, read_case
from contactverif_reports.netcdf.schema import case_id
from contactverif_reports.netcdf.stored_cells import StoredCells, read_cells
from contactverif_reports.netcdf.write import write


@dataclass(frozen=True, slots=True, eq=False)
class Asked:
    """What a comparison of formulations is asked for, None where nothing is said; each is an option of the command."""

    against: str | None = None
    profile: str | None = None
    examples: int | None = None
    seed: int | None = None
    interface: Interface | None = None
    scene: Case | None = None
    report: Path | None = None
    pictures: Path | None = None


def reports_in(names: Sequence[str]) -> list[Path]:
    """The two reports, if reports are what the names are; empty if they are formulations.

    A report is what ends in .nc, or is a file and no installed formulation.

    Raises
    ------
    MisuseError
        If the names are both kinds, or not two reports.
    """
    installed = formulation_names()
    files = [name for name in names if name.lower().endswith(".nc") or (name not in installed and Path(name).is_file())]
    if not files:
        return []
    others = [name for name in names if name not in files]
    if others:
        raise MisuseError("NAME", f"{others[0]} and the report {files[0]}", "formulations alone, or two reports")
    if len(files) != 2:
        raise MisuseError("NAME", f"{len(files)} report{'s' * (len(files) > 1)}", "two, OLD.nc NEW.nc")
    return [Path(name) for name in files]


def compare_reports(paths: Sequence[Path], globs: Sequence[str], html: Path | None, asked: Asked) -> bool:
    """Tables of an old report and a new one: whether nothing got worse.

    Raises
    ------
    MisuseError
        For a file that is no report of this schema, or if the two have nothing in common.
    """
    for entry in fields(asked):
        if getattr(asked, entry.name) is not None:
            option = {"interface": "mesh"}.get(entry.name, entry.name)
            raise MisuseError(f"--{option}", "two reports beside it", "formulations, which can be asked something")
    if html is not None:
        check_page(html)
    old, new = (_read(path, argument) for path, argument in zip(paths, ("OLD.nc", "NEW.nc"), strict=True))
    changes = Changes.of(*(_only(report, globs, [old, new]) for report in (old, new)))
    if not changes.changes and not changes.lost:
        kind = "formulation" if not set(old.formulations) & set(new.formulations) else "property"
        has = " and ".join(", ".join(_named(report, kind)) or "nothing" for report in (old, new))
        raise MisuseError("NEW.nc", f"no {kind} that OLD.nc has too ({has})", "two reports with something in common")
    meshes = _smallest_failing(changes)
    if html is not None:
        write_page(html, changes_page(changes, meshes))
    show(ChangesTable(changes))
    for place, (id_, stored) in enumerate(meshes.items()):
        if place < DRAWN:
            show_as_it_is(stored_mesh(id_, stored, new.path))
    if html is not None:
        typer.echo(f"page: {html}")
    show(outcome_of(changes))
    return not changes.regressions


def compare_formulations(names: Sequence[str], globs: Sequence[str], html: Path | None, asked: Asked) -> bool:
    """Tables of formulations against a reference: whether every candidate kept its promises.

    Raises
    ------
    MisuseError
        For what cannot be asked or written.
    """
    if asked.against is None:
        raise MisuseError("--against", "nothing", "the formulation to compare with, or two reports OLD.nc NEW.nc")
    if not names:
        others = ", ".join(name for name in formulation_names() if name != asked.against)
        raise MisuseError("NAME", "nothing", f"some of {others}, or two reports OLD.nc NEW.nc")
    if asked.report is not None:
        check_writable(asked.report)
    if html is not None:
        check_page(html)
    if asked.pictures is not None:
        made_folder(asked.pictures, "--pictures")
    # a plugin may change where we are
    target, page, folder = (path and path.absolute() for path in (asked.report, html, asked.pictures))
    questions = load_properties(globs or ["*"])
    try:
        reference = load_formulation(asked.against)
    except MisuseError as error:
        raise MisuseError("--against", error.found, error.needed) from None
    if isinstance(reference, NotLoaded):
        raise MisuseError("--against", f"{asked.against}, which does not load ({reference.reason})", "one that loads")
    candidates = [load_formulation(name) for name in names]
    with Bar() as bar:
        study = compared(
            reference,
            candidates,
            questions,
            profile=asked.profile or "dev",
            examples=asked.examples,
            seed=asked.seed,
            interface=asked.interface,
            scene=asked.scene,
            progress=bar.told,
        )
    by_name = {item.name: item for item in (reference, *candidates) if isinstance(item, Subject)}
    if target is not None:  # before anything is shown, so that nothing that was judged is lost
        write(study.run, target)
    if page is not None:
        drawings = [_drawing(one, by_name, asked.against) for one in study.differing]
        write_page(page, comparison_page(study.comparison, study.differing, drawings, study.costs))
    show(SideBySide(study))
    _show_meshes(study, by_name, folder, asked.pictures, drawn=page is not None)
    for what, path in (("report", asked.report), ("page", html)):
        if path is not None:
            typer.echo(f"{what}: {path}")
    show(last_line(study.comparison))
    return study.comparison.kept


def _smallest_failing(changes: Changes) -> dict[str, StoredCase]:
    """{id: counterexample} of the new report, for what got worse and fails."""
    kept = case_ids(changes.new.path)
    found = [change.new for change in changes.changes if change.regressions]
    ids = [case_id(cell.formulation, cell.property_id) for cell in found]
    return {id_: read_case(changes.new.path, id_) for id_ in ids if id_ in kept}


def _show_meshes(
    study: Study, subjects: dict[str, Subject], folder: Path | None, shown_as: Path | None, *, drawn: bool
) -> None:
    """The meshes that tell most in the terminal, all of them in the folder; `drawn`: and on a page."""
    reference = study.comparison.reference
    for place, one in enumerate(study.differing):
        if place < DRAWN:
            show_as_it_is(mesh(one, reference))
        if folder is not None:
            for name in _pictures(one, reference, subjects, folder):
                typer.echo(f"    picture: {shown_as}/{name}")
    rest = study.differing[DRAWN:]
    if rest and folder is None and not drawn:
        ids = ", ".join(one.question.id for one in rest)
        show(f"\nthey differ on {ids} too: --html FILE or --pictures FOLDER draws those")


def _drawing(one: Differing, subjects: dict[str, Subject], reference: str) -> Drawing:
    """What a picture of the case needs: its scene solved by both, or the forces of both."""
    candidate, other = subjects[one.formulation], subjects[reference]
    if has_bodies(one.case):
        return Drawing(solved=solve_scene(one.case, [candidate, other]))
    exact = one.question.exact(one.case) if one.question.exact is not None else None
    return Drawing(forces_on(one.case, candidate), forces_on(one.case, other), exact)


def _pictures(one: Differing, reference: str, subjects: dict[str, Subject], folder: Path) -> list[str]:
    """Names of what was drawn: the bodies solved by both, or the case with the forces of each of them."""
    if has_bodies(one.case):
        from contactverif_reports.draw.scene_figures import draw_scene  # matplotlib takes its time

        found = solve_scene(one.case, [subjects[one.formulation], subjects[reference]])
        name = f"{case_id(one.formulation, one.question.id)}.png"
        if found.solutions:
            draw_scene(found, folder / name, title=f"{one.question.id}, case {one.number}")
        return [name] if found.solutions else []
    names = []
    for formulation, outcome in ((one.formulation, one.outcome), (reference, one.reference_outcome)):
        name = f"{case_id(formulation, one.question.id)}.png"
        draw_case(subjects[formulation], one.question, outcome, folder / name, "--pictures")
        names.append(name)
    return names


def _only(report: StoredCells, globs: Sequence[str], both: Sequence[StoredCells]) -> StoredCells:
    """The report without the properties that no pattern names."""
    every = dict.fromkeys(id_ for one in both for id_ in one.properties)
    for glob in globs:
        if not any(fnmatchcase(id_, glob) for id_ in every):
            raise unknown_name_error("--property", glob, every)
    return report.only([id_ for id_ in every if not globs or any(fnmatchcase(id_, glob) for glob in globs)])


def _named(report: StoredCells, kind: str) -> Sequence[str]:
    return report.formulations if kind == "formulation" else report.properties


def _read(path: Path, argument: str) -> StoredCells:
    try:
        return read_cells(path)
    except MisuseError as error:
        raise MisuseError(argument, error.found, error.needed) from None
