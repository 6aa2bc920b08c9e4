"""The work of `list` (what is installed, and what formulations state) and of `scenes`, with their options."""

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

from rich.text import Text

from contactverif.cli.console import columns, line, show
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import ENGINE, OPTIONAL_PARTS, Subject
from contactverif.contract.traits import Evidence, Traits
from contactverif.isolation.remote import Wrapper
from contactverif.plugins.registry import formulation_names, load_formulations, load_problems, load_properties
from contactverif.problems.catalogue import BLOCKS, SCENES, load_scene, options_of
from contactverif.run.run_options import RunOptions
from contactverif_reports.plot.text import blocks_as_text, silhouettes_as_text
from contactverif_reports.tables import PROMISES, Column, Table

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
_EVIDENCE = [entry.name for entry in fields(Evidence)]
_MARGIN = 4
_NARROWEST, _WIDEST = 40, 96  # Columns of running text, whatever the terminal has.


def list_installed(options: RunOptions, traits: bool) -> None:
    """Show four tables; of the traits the most important ones or all."""
    installed, count = load_formulations(options.limits(), engines=True), len(formulation_names())
    formulations = (_formulation(item, traits) for item in installed[:count])
    _show_table("formulations", ("name", "in", "patch test", "promises"), formulations)
    questions = (
        (item.formulation, "", _not_loaded(item))
        if isinstance(item, NotLoaded)
        else (item.id, "2-D" if item.cases_in_space is None else "2-D, 3-D", item.summary)
        for item in load_properties()
    )
    _show_table("properties", ("id", "in", "asks"), questions)
    problems = (
        (name, _not_loaded(item) if isinstance(item, NotLoaded) else item.label)
        for name, item in load_problems().items()
    )
    _show_table("problems", ("name", "what bench solves"), problems)
    engines = (
        (item.formulation.removeprefix(ENGINE), _not_loaded(item))
        if isinstance(item, NotLoaded)
        else (item.name.removeprefix(ENGINE), getattr(item, "summary", ""))
        for item in installed[count:]
    )
    _show_table("engines", ("name", "what it is"), engines)


def _show_table(title: str, heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Show a table of which all columns but the first give way on a narrow screen."""
    table = Table([Column(head, wrap=number > 0) for number, head in enumerate(heads)], title)
    for row in rows:
        table.add(*row)
    show(table.terminal())


def _not_loaded(item: NotLoaded) -> Text:
    return Text(f"not loaded: {item.reason}", style="red")


def _formulation(item: Subject | Wrapper | NotLoaded, every_trait: bool) -> tuple[Any, ...]:
    if isinstance(item, NotLoaded):
        return item.formulation, "", "", _not_loaded(item)
    if not isinstance(item, Subject):
        verbs = {"/NAME": "wraps another", "=PATH": "loads a file", "=KIND": "has kinds"}
        verb = next(words for ending, words in verbs.items() if item.form.endswith(ending))
        return item.name, "", "", f"{verb}, {item.form}{f': {item.summary}' if item.summary else ''}"
    flat = item.traits.promises.patch.flat
    statements = _statements(item.traits, every_trait) or ["nothing" if flat is None else "nothing else"]
    if missing := ", ".join(part for part in OPTIONAL_PARTS if part not in item.provides):
        statements.append(f"not provided: {missing}")
    dimensions = ", ".join(f"{each}-D" for each in item.traits.abilities.dimensions)
    return item.name, dimensions, PROMISES[flat], "; ".join(statements)


def _statements(traits: Traits, every_trait: bool) -> list[str]:
    """Return what a formulation states; all of it in the words of the code, which its author writes."""
    if not every_trait:
        by = [] if traits.rules.enforcement == "penalty" else [f"by {traits.rules.enforcement}"]
        tangent = traits.promises.tangent
        words = f"{tangent} tangent" if isinstance(tangent, str) else f"tangent to {tangent:g}" if tangent else ""
        return [*by, *filter(None, [words])]
    silent, evidence = Traits().by_name(), traits.evidence
    values = traits.by_name().items()
    statements = [f"{name}={value!r}" for name, value in values if value != silent[name] and name not in _EVIDENCE]
    statements += [f"forces stated on {name}" for name in evidence.published_forces]
    return statements + [f"{property_id} fails on {case}" for property_id, case in sorted(evidence.witnesses.items())]


def list_scenes(path: Path | None) -> None:
    """Show all scenes, then the meaning of their options; or what is in a mesh file."""
    if path is not None:
        from contactverif.cli.mesh_screen import show_mesh

        show_mesh(path)
        return
    width = max(_NARROWEST, min(columns(), _WIDEST))
    show(*(text for name in SCENES for text in _scene(name, width)), *_options(width))


def _scene(name: str, width: int) -> Iterator[Text]:
    entry, is_block = SCENES[name], name in BLOCKS
    pressure = f"; pressure {BLOCKS[name].pressure:g}" if is_block else ""
    words = [
        entry.summary,
        f"source: {SOURCE}, {entry.source}" if entry.source else "source: this project",
        f"our choice: {entry.assumptions}{pressure}",
    ]
    if not is_block:
        options = (f"{option} {_default_in_words(default)}".strip() for option, default in options_of(name).items())
        words.append(f"options: {', '.join(options)}")
    indent = " " * _MARGIN
    yield Text(name, style="bold")
    for each in words:
        yield line(textwrap.fill(each, width, initial_indent=indent, subsequent_indent=f"{indent}  "))
    scene, draw = load_scene(name), blocks_as_text if is_block else silhouettes_as_text
    slave, master = scene.bodies
    yield line(textwrap.indent(draw(scene.case(), slave, master, width - _MARGIN), indent))
    yield Text("")


def _options(width: int) -> Iterator[Text]:
    yield Text("options, as in --scene c:refine=2,penalty=1e4", style="bold")
    defaults = {option: default for name in [*SCENES][::-1] for option, default in options_of(name).items()}
    longest = max(map(len, MEANINGS))
    indent = " " * (longest + _MARGIN)
    for option, meaning in MEANINGS.items():
        lines = textwrap.wrap(f"{meaning} {_default_in_words(defaults[option])}".strip(), width - len(indent))
        yield line(f"\n{indent}".join([f"  {option:{longest}}  {lines[0]}", *lines[1:]]))


def _default_in_words(default: Any) -> str:
    if default is None:
        return ""
    return f"({default})" if isinstance(default, str) else f"({default:g})"
