"""The options of the command line: how those of a run are typed, the files that a command writes, and completion.

Every `--help` imports this file, so nothing at its top takes long to import.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args, get_origin, get_type_hints

import typer

from contactverif.api.run_files import JSON, JUNIT, PAGE, PARAVIEW, PICTURES, REPORT, either
from contactverif.cli.signals import begin_work
from contactverif.contract.errors import MisuseError
from contactverif.run.run_options import ISOLATION, PLACE, SAMPLING, Option, RunOptions, declared_options, group_names

if TYPE_CHECKING:
    from contactverif.contract.case import Case
    from contactverif.contract.interface import Interface

MARKDOWN = ".md"
_LABELS = {
    REPORT: "report",
    PAGE: "page",
    MARKDOWN: "page",
    JSON: "JSON",
    JUNIT: "JUnit",
    **dict.fromkeys(PICTURES, "picture"),
    PARAVIEW: "for ParaView",
}
EARLIER, _RESULTS = "Earlier runs", "Results"
_PANELS = {  # {option, or group of options: its panel in a help page}; all others are in the first one.
    SAMPLING: "Cases",
    PLACE: "Mesh or scene",
    ISOLATION: "Processes of plugins",
    **dict.fromkeys(("out", "pictures", "verbose", "quiet", "show", "durations"), _RESULTS),
    **dict.fromkeys(("last_failed", "memory"), EARLIER),
}


@dataclass(frozen=True, slots=True)
class Screen:
    """The parts of the results that are printed."""

    verbose: Annotated[
        bool, Option("Show every row, every counterexample, and the coverage.", flags=("--verbose", "-v"))
    ] = False
    quiet: Annotated[bool, Option("Show the last line alone.", flags=("--quiet", "-q"))] = False
    show: Annotated[
        Literal["first", "all"], Option("The counterexamples that are drawn: the most telling one, or all.")
    ] = "first"
    durations: Annotated[int, Option("Show the N rows that took longest.", "N")] = 0


@dataclass(frozen=True, slots=True)
class Takes:
    """The options of a run that a command takes, in the order of its help."""

    names: Sequence[str]  # Options, groups of options, and parameters of the command that stand between them.
    words: Mapping[str, str] = field(default_factory=dict)  # {option: its help, where it is another one}


def complete_formulation(incomplete: str) -> list[str]:
    """Return the installed formulations whose name begins so, for the shell."""
    from contactverif.plugins.registry import formulation_names

    return [name for name in formulation_names() if name.startswith(incomplete)]


def complete_property(incomplete: str) -> list[str]:
    """Return the installed properties whose id begins so, for the shell."""
    from contactverif.plugins.registry import property_ids

    return [property_id for property_id in property_ids(engines=True) if property_id.startswith(incomplete)]


_COMPLETIONS = {"names": complete_formulation, "properties": complete_property}


def formulation_option(words: str, *flags: str) -> Any:
    """Return an option that names a formulation; typer makes the flag of its name, unless some are given."""
    return typer.Option(*flags, help=words, metavar="NAME", autocompletion=complete_formulation)


def output_option(words: str) -> Any:
    """Return the option for the files that a command writes, with its help in words."""
    return typer.Option("--out", help=words, metavar="FILE")


def done_in(module: str) -> Callable[[Callable[..., None]], Callable[..., int | None]]:
    """Return a decorator: the function of the same name in a module of the command line does the work of a command."""

    def decorate(command: Callable[..., None]) -> Callable[..., int | None]:
        @functools.wraps(command)
        def work(**values: Any) -> int | None:
            work_of_module = getattr(import_module(f"contactverif.cli.{module}"), command.__name__)
            begin_work()
            status: int | None = work_of_module(**values)
            return status

        return work

    return decorate


def spell_out(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Return a command whose parameters are single options, as typer needs them, and no groups.

    A group is a dataclass whose fields are options; of `RunOptions` the command says which ones it takes.
    """
    hints = get_type_hints(command, include_extras=True)
    parameters = inspect.signature(command).parameters
    groups: dict[str, tuple[Any, dict[str, Any]]] = {}  # {parameter: its class, its fields with their defaults}
    single: dict[str, inspect.Parameter] = {}
    lists = [name for name in parameters if "list[" in str(hints[name])]  # Typer has None where nothing is typed.

    def add(name: str) -> None:
        parameter = parameters[name].replace(annotation=hints[name], kind=inspect.Parameter.KEYWORD_ONLY)
        single.setdefault(name, parameter)

    for name, hint in hints.items():
        kind, *extras = get_args(hint) if get_origin(hint) is Annotated else (hint,)
        if name in parameters and not is_dataclass(kind):
            add(name)
        elif name in parameters:
            declared = declared_options(kind)
            takes = next((extra for extra in extras if isinstance(extra, Takes)), Takes([*declared]))
            defaults = {option: getattr(kind(), option) for option in declared}
            for each in takes.names:
                if each in parameters:
                    add(each)
                    continue
                for option in group_names(each) if kind is RunOptions else [each]:
                    words = takes.words.get(option)
                    single[option] = _make_parameter(option, *declared[option], defaults[option], words)
            typed = {option: value for option, value in defaults.items() if option in single}
            groups[name] = kind, {option: value for option, value in typed.items() if option not in parameters}

    @functools.wraps(command)
    def spelled_out(**values: Any) -> int | None:
        for name, (kind, defaults) in groups.items():
            values[name] = kind(**{each: _value(each, values.pop(each), defaults[each]) for each in defaults})
        for name in lists:
            values[name] = () if values[name] is None else values[name]
        return command(**values)

    spelled_out.__signature__ = inspect.Signature([*single.values()])  # type: ignore[attr-defined]
    spelled_out.__annotations__ = {name: parameter.annotation for name, parameter in single.items()}
    return spelled_out


def _make_parameter(name: str, kind: Any, option: Option, default: Any, words: str | None) -> inspect.Parameter:
    """Return an option as a parameter of typer: what has several values is a list, and None where nothing is typed."""
    several = next((part for part in (kind, *get_args(kind)) if get_origin(part) in (tuple, dict)), None)
    if several is not None:
        kind, default = list[get_args(several)[0]] | None, None  # type: ignore[misc]
    flags = option.flags or (f"--{name.replace('_', '-')}",)
    more: dict[str, Any] = {
        "help": words or option.help,
        "metavar": "" if kind is bool else option.metavar,  # A flag takes no value.
        "autocompletion": _COMPLETIONS.get(name),
        "rich_help_panel": _PANELS.get(option.group or name),
    }
    info = typer.Argument(**more) if name == "names" else typer.Option(*flags, **more)
    default = False if kind is bool else default
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, info])


def _value(name: str, typed: Any, default: Any) -> Any:
    """Return the value of a field from what is typed; known failures are {property: reason} of each ID=REASON."""
    if typed is None:
        return default
    if isinstance(typed, bool):
        return typed != default
    if name != "known":
        return tuple(typed) if isinstance(typed, list) else typed
    reasons = {}
    for text in typed:
        property_id, _, reason = text.partition("=")
        if not (property_id and reason):
            raise MisuseError("--known", repr(text), "ID=REASON, the id of a property and why it is known to fail")
        reasons[property_id] = reason
    return reasons


def with_engines(names: Sequence[str], engines: Sequence[str]) -> tuple[str, ...]:
    """Return the names of formulations, and those of engines as they stand beside them."""
    from contactverif.contract.subject import ENGINE

    return (*names, *(f"{ENGINE}{name.removeprefix(ENGINE)}" for name in engines))


def select_names(options: RunOptions) -> tuple[str, ...]:
    """Return the formulations and engines that the user named, or all formulations."""
    from contactverif.plugins.registry import formulation_names, standalone_names

    names = with_engines(options.names, options.engines)
    if options.every and names:
        raise MisuseError("NAME", f"{', '.join(names)} and --all", "one of the two")
    if options.every:
        return tuple(standalone_names(options.limits()))
    if not names:
        raise MisuseError("NAME", "nothing", f"--all, or some of {', '.join(formulation_names())}")
    return names


def read_place(options: RunOptions) -> Interface | Case | None:
    """Return the scene or interface on which a run asks; None for random ones. Remarks go to standard error."""
    places = {"--scene": options.scene, "--scene-file": options.scene_file, "--mesh": options.mesh}
    typed = [(option, value) for option, value in places.items() if value is not None]
    if len(typed) > 1:
        raise MisuseError(typed[0][0], f"{typed[0][1]} and {typed[1][0]} {typed[1][1]}", "one of the two")
    if options.scene_file is not None:
        from contactverif.meshes.scene_file import load_scene_file

        return load_scene_file(options.scene_file).case()
    if options.scene is not None:
        from contactverif.problems.catalogue import load_scene

        return load_scene(options.scene).case()
    files = [name for name in (options.slave, options.master) if name is not None and Path(name).is_file()]
    if options.mesh is None and len(files) < 2:
        for option in ("slave", "master", "pair", "flip", "material", "support"):
            if getattr(options, option):
                raise MisuseError("--mesh", f"none, but --{option}", "--mesh FILE, which the groups belong to")
        return None
    from contactverif.meshes.mesh_file import read_sides
    from contactverif.meshes.mesh_scene import describe_bodies, parse_material, parse_support, scene_of

    slave, master, materials = options.slave, options.master, dict(map(parse_material, options.material))
    sides = read_sides(options.mesh, slave=slave, master=master, pair=options.pair, flip=options.flip)
    words = sides.words.splitlines()
    place: Interface | Case = sides.interface
    try:
        scene = scene_of(sides, materials, dict(map(parse_support, options.support)))
    except MisuseError as error:
        if options.material or options.support:
            raise
        words.insert(0, f"the interface alone is asked, no bodies are solved: {error}")
    else:
        place, words = scene.case(), words + describe_bodies(scene)
    for line in words:
        typer.echo(f"contactverif: {line}", err=True)
    return place


@dataclass(frozen=True, slots=True)
class OutputFiles:
    """The files that a command writes, at most one of each suffix.

    Everything that can be wrong with a name is said by `check`, before anything takes long.
    """

    names: Mapping[str, Path]  # {suffix: name as the user typed it}.
    paths: Mapping[str, Path]  # {suffix: absolute path}. A plugin may change the working folder while it runs.

    @classmethod
    def check(cls, names: Sequence[Path] | None, suffixes: Sequence[str]) -> OutputFiles:
        """Return the files, once it is sure that they can be written."""
        from contactverif_reports.files import check_writable

        by_suffix: dict[str, Path] = {}
        for name in names or ():
            suffix = name.suffix.lower()
            if suffix not in suffixes:
                raise MisuseError("--out", f"{str(name)!r}", f"a name that ends in {either(suffixes)}")
            if suffix in by_suffix:
                raise MisuseError("--out", f"{by_suffix[suffix]} and {name}", f"one file that ends in {suffix}")
            check_writable(name, "--out", f"FILE{suffix}")
            by_suffix[suffix] = name
        return cls(by_suffix, {suffix: name.absolute() for suffix, name in by_suffix.items()})

    def announce(self) -> None:
        """Print the name of each file that was written, a line each."""
        from contactverif.cli.console import echo

        for suffix, label in _LABELS.items():
            if suffix in self.names:
                echo(f"{label}: {self.names[suffix]}")


def picture_folder(name: Path | None) -> Path | None:
    """Make the folder that `--pictures` names, and return its absolute path; None without a name."""
    if name is None:
        return None
    from contactverif_reports.files import made_folder

    made_folder(name, "--pictures")
    return name.absolute()
