"""The work of `draw` (a scene is solved, or a stored case judged again, and drawn) and of `scenes`, a list of them."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from math import isnan
from pathlib import Path
from typing import Any

from rich.text import Text

from contactverif.api.drawing import draw_outcome
from contactverif.cli.console import columns, echo, print_plugin_output, show
from contactverif.cli.options import PICTURES, SOLVED_SCENE, OutputFiles
from contactverif.cli.replay import announce_stored, check_surfaces
from contactverif.contract.case import Case
from contactverif.contract.counterexample import Counterexample
from contactverif.contract.errors import MisuseError
from contactverif.isolation.file_reader import check_ordinary
from contactverif.isolation.limits import Limits
from contactverif.mechanics.scene import has_bodies
from contactverif.plugins.registry import formulation_names, load_formulation, the_formulation, the_property
from contactverif.problems.catalogue import BLOCKS, SCENES, load_scene, options_of
from contactverif.run.judge import judge_if_applicable
from contactverif.run.run_options import RunOptions
from contactverif.studies.solved_scenes import solve_scene
from contactverif_reports.netcdf.read import read_case
from contactverif_reports.plot.text import as_text, blocks_as_text, silhouettes_as_text
from contactverif_reports.plot.vtu import write_vtu
from contactverif_reports.tables import Column, Table, numbers

SOURCE = "Zavarise & De Lorenzis (2009)"
MEANINGS = {
    "refine": "number of parts into which each segment and each layer of cells is divided",
    "penalty": "penalty ε̂: force per length of the interface, per length of penetration; 10 E/h by default",
    "young": "Young's modulus E of the slave",
    "ratio": "E of the master over E of the slave",
    "poisson": "Poisson's ratio of both bodies",
    "pressure": "pressure on top of the slave; each scene has its own default",
    "degrees": "angle by which the whole scene is rotated, counter-clockwise",
    "sides": "rollers; or free, so that the bodies strain sideways and the contact area changes",
    "lowered": "depth of the slave in the first guess; 0 begins where the bodies touch; p/ε̂ by default",
    "force": "force on top of the disk, per unit of thickness",
}
_MARGIN = 4
_NARROWEST, _WIDEST = 40, 96  # Columns of running text, whatever the terminal has.
_MOST_COLUMNS = 80  # The largest number of columns of a remark.


def draw(
    report: Path | None,
    case: str | None,
    scene: str | None,
    formulation: Sequence[str],
    out: Sequence[Path],
    options: RunOptions,
) -> int:
    """Draw a scene or a counterexample; return 0 if every formulation loaded and kept its contract, else 1."""
    files, limits, names = OutputFiles.check(out, (*PICTURES, SOLVED_SCENE)), options.limits(), formulation
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
            raise MisuseError("--formulation", "nothing", f"some of {', '.join(formulation_names())}")
        complete = _draw_solved(case_of_scene, names, scene, files, limits)
    else:
        stored = _read_stored(report, case)
        if has_bodies(stored.case):
            names = names or [announce_stored(stored.formulation)]
            complete = _draw_solved(stored.case, names, f"{case}: {stored.reason}", files, limits)
        else:
            _draw_stored(stored, names, files, limits)
    print_plugin_output()
    return 0 if complete else 1


def _read_stored(report: Path | None, case: str | None) -> Counterexample:
    if report is None and case is None:
        raise MisuseError("--scene", "nothing to draw", "--scene NAME, or REPORT --case ID")
    if report is None:
        raise MisuseError("REPORT", f"none, but --case {case}", "the report that holds the case")
    if case is None:
        check_ordinary(report, "REPORT", "a report that `contactverif verify --out FILE.nc` wrote, or --scene NAME")
        raise MisuseError("--case", "nothing", f"--case ID; `contactverif replay {report}` lists the ids")
    return read_case(report, case)


def _draw_stored(stored: Counterexample, names: Sequence[str], files: OutputFiles, limits: Limits | None) -> None:
    check_surfaces(stored.case, files)
    if len(names) > 1:
        raise MisuseError("--formulation", f"{len(names)} of them", "one, for a case without bodies")
    name = names[0] if names else announce_stored(stored.formulation)
    subject, question = the_formulation(name, limits), the_property(stored.property_id)
    outcome = judge_if_applicable(question, stored.case, subject)
    if not files.paths:
        echo(as_text(stored.case))
    for picture in files.drawings():
        draw_outcome(subject, question, outcome, picture, argument="--out")
    files.announce()


def _draw_solved(case: Case, names: Sequence[str], title: str, files: OutputFiles, limits: Limits | None) -> bool:
    """Solve a scene with each formulation and write the files; return whether all could be used."""
    if SOLVED_SCENE in files.names and len(names) > 1:
        file_for_many = f"{files.names[SOLVED_SCENE]} for {len(names)} formulations"
        raise MisuseError("--out", file_for_many, "one --formulation: a .vtu file holds one solution")
    scene = solve_scene(case, [load_formulation(name, limits) for name in names])
    for suffix, path in files.paths.items() if scene.solutions else ():
        if suffix == SOLVED_SCENE:
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


def list_scenes() -> None:
    """Show all scenes, then the meaning of their options."""
    width = max(_NARROWEST, min(columns(), _WIDEST))
    show(*(text for name in SCENES for text in _scene(name, width)), *_options(width))


def _scene(name: str, width: int) -> Iterator[Text]:
    entry = SCENES[name]
    yield Text(name, style="bold")
    yield _wrap(entry.summary, width)
    yield _wrap(f"source: {SOURCE}, {entry.source}" if entry.source else "source: this project", width)
    pressure = f"; pressure {BLOCKS[name].pressure:g}" if name in BLOCKS else ""
    yield _wrap(f"our choice: {entry.assumptions}{pressure}", width)
    if name not in BLOCKS:
        options = (f"{option} {_default_in_words(default)}".strip() for option, default in options_of(name).items())
        yield _wrap(f"options: {', '.join(options)}", width)
    scene = load_scene(name)
    slave, master = scene.bodies
    draw = blocks_as_text if name in BLOCKS else silhouettes_as_text
    picture = draw(scene.case(), slave, master, width - _MARGIN)
    yield _keep_lines(textwrap.indent(picture, " " * _MARGIN))
    yield Text("")


def _options(width: int) -> Iterator[Text]:
    yield Text("options, as in --scene c:refine=2,penalty=1e4", style="bold")
    defaults = {option: default for name in [*SCENES][::-1] for option, default in options_of(name).items()}
    longest = max(map(len, MEANINGS))
    for option, meaning in MEANINGS.items():
        lines = textwrap.wrap(f"{meaning} {_default_in_words(defaults[option])}".strip(), width - longest - _MARGIN)
        indent = " " * (longest + _MARGIN)
        yield _keep_lines(f"\n{indent}".join([f"  {option:{longest}}  {lines[0]}", *lines[1:]]))


def _default_in_words(default: Any) -> str:
    """Return a default in parentheses; nothing where the scene has its own."""
    if default is None:
        return ""
    return f"({default})" if isinstance(default, str) else f"({default:g})"


def _wrap(words: str, width: int) -> Text:
    indent = " " * _MARGIN
    return _keep_lines(textwrap.fill(words, width, initial_indent=indent, subsequent_indent=indent + "  "))


def _keep_lines(words: str) -> Text:
    """Return words that the terminal does not wrap once more."""
    return Text(words, no_wrap=True, overflow="ignore")
