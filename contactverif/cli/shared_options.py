"""The options that several commands share, each defined once.

A group of options is a frozen dataclass, each field an option. A command takes the group as one parameter, and
`spell_out_groups` shows typer the single options. Two groups of one command have no field of the same name. Nothing
that takes long to import is imported at the top, because every `--help` imports this file.
"""

from __future__ import annotations

import functools
import inspect
import typing
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from contactverif.contract.errors import MisuseError
from contactverif.run.profiles import Shrink, profile_named

if TYPE_CHECKING:
    from contactverif.contract.case import Case
    from contactverif.contract.interface import Interface

ShowOption = Literal["first", "all"]

PROFILE_HELP = (
    "dev: 100 cases of each property, new ones in every run. ci: 100 cases, always the same. "
    "nightly: 2000 cases, new ones in every run. (default: dev)"
)

SHRINK_HELP = (
    "The failures whose mesh is made as small as it goes. one: the most telling one of each formulation; new: those "
    "that neither the formulation nor --known states; the others show a witness, or the first case that clearly fails. "
    "(default: one)"
)
KEEP_GOING_HELP = (
    "Ask all properties, even if the first show an opposite sign, a crash, a breach of the contract, or answers that "
    "depend on earlier calls."
)
ENGINE_HELP = "A whole contact code, judged by the displacements that it finds. Repeatable."
LAST_FAILED_HELP = "Ask nothing but the cases that failed in earlier runs, which `.contactverif` keeps."
NO_MEMORY_HELP = "Neither ask first what failed in earlier runs, nor keep what fails now."
JOBS_HELP = (
    "Number of processes that share the work; the results are the same. "
    "(default: one for each 1000 planned cases, at most one for each core)"
)


def complete_formulation(incomplete: str) -> list[str]:
    """Return the installed formulations whose name begins so, for the shell."""
    from contactverif.plugins.registry import formulation_names

    return [name for name in formulation_names() if name.startswith(incomplete)]


def complete_property(incomplete: str) -> list[str]:
    """Return the installed properties whose id begins so, for the shell."""
    from contactverif.plugins.registry import property_ids

    return [property_id for property_id in property_ids(engines=True) if property_id.startswith(incomplete)]


def with_engines(names: list[str] | None, engines: list[str] | None) -> list[str]:
    """Return the names of formulations, and those of engines as they stand beside them."""
    from contactverif.contract.engine_subject import ENGINE

    return [*(names or ()), *(f"{ENGINE}{name.removeprefix(ENGINE)}" for name in engines or ())]


def formulation_argument(words: str) -> Any:
    """Return the argument of a command that takes formulations, with its help in words."""
    return typer.Argument(help=words, metavar="NAME", autocompletion=complete_formulation)


def formulation_option(words: str, *flags: str) -> Any:
    """Return an option that names a formulation; typer makes the flag of its name, unless some are given."""
    return typer.Option(*flags, help=words, metavar="NAME", autocompletion=complete_formulation)


def output_option(words: str) -> Any:
    """Return the option for the files that a command writes, with its help in words."""
    return typer.Option("--out", help=words, metavar="FILE")


EngineNames = Annotated[list[str] | None, typer.Option("--engine", help=ENGINE_HELP, metavar="NAME[:OPTIONS]")]
FormulationNames = Annotated[
    list[str] | None,
    formulation_argument("Formulations, with options: vts-ppt, vts-me:n=4, nts-ar:area=reference."),
]
EveryFormulation = Annotated[bool, typer.Option("--all", help="Take every installed formulation that wraps no other.")]
RESULT_FILES = output_option(
    "Write the results: FILE.nc a report, FILE.html a page, FILE.json or FILE.xml (JUnit) for other programs. "
    "Repeatable."
)
PropertyGlobs = Annotated[
    list[str] | None,
    typer.Option(
        "--property",
        "-p",
        help="Check only the properties whose id matches. Repeatable.",
        metavar="GLOB",
        autocompletion=complete_property,
    ),
]
ReportPath = Annotated[Path, typer.Argument(help="A report that verify --out FILE.nc wrote.", metavar="REPORT")]
CaseId = Annotated[str | None, typer.Option(help="Id of a counterexample in the report.", metavar="ID")]


@dataclass(frozen=True, slots=True)
class SamplingOptions:
    """Number and seed of the random cases of a run, None to leave them to the profile, and what is shrunk."""

    examples: Annotated[int | None, typer.Option(help="Number of random cases of each property.", metavar="N")] = None
    seed: Annotated[int | None, typer.Option(help="The same seed gives the same cases.", metavar="N")] = None
    profile: Annotated[str | None, typer.Option(help=PROFILE_HELP, metavar="NAME")] = None
    shrink: Annotated[Shrink | None, typer.Option(help=SHRINK_HELP)] = None

    def planned_examples(self) -> int:
        """Return the number of random cases of each property."""
        return self.examples or profile_named(self.profile or "dev").examples


@dataclass(frozen=True, slots=True)
class FailureOptions:
    """The failures that count, those of earlier runs, and what others are worth once one is found."""

    known: Annotated[
        list[str] | None,
        typer.Option("--known", help="A known failure, with its reason. Repeatable.", metavar="ID=REASON"),
    ] = None
    keep_going: Annotated[bool, typer.Option("--keep-going", help=KEEP_GOING_HELP)] = False
    last_failed: Annotated[bool, typer.Option("--last-failed", help=LAST_FAILED_HELP)] = False
    no_memory: Annotated[bool, typer.Option("--no-memory", help=NO_MEMORY_HELP)] = False


@dataclass(frozen=True, slots=True)
class SubjectOptions:
    """The formulations and engines that are judged."""

    names: FormulationNames = None
    engines: EngineNames = None
    all_: Annotated[bool, typer.Option("--all", help="Check every installed formulation that wraps no other.")] = False


@dataclass(frozen=True, slots=True)
class ScreenOptions:
    """The parts of the results that are printed."""

    verbose: Annotated[
        bool,
        typer.Option("--verbose", "-v", help="Show every row, every counterexample, and what the cases were worth."),
    ] = False
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Show the last line alone.")] = False
    show: Annotated[
        ShowOption, typer.Option(help="The counterexamples that are drawn: the most telling one, or all.")
    ] = "first"


@dataclass(frozen=True, slots=True)
class WorkerOptions:
    """The number of processes that share the work of a run."""

    jobs: Annotated[int | None, typer.Option("--jobs", "-j", help=JOBS_HELP, metavar="N")] = None

    def prepare(self, *, every_property: bool) -> None:
        """Start the server of workers before anything large is imported, if the run is likely to have some."""
        from contactverif.run.worker_pool import start_server

        if self.jobs != 1 and every_property:
            start_server()

    def number(self, n_formulations: int, n_properties: int, examples: int) -> int:
        """Return the number of processes: the user's, or one that fits the work."""
        from contactverif.run.worker_pool import check_jobs, default_jobs

        if self.jobs is None:
            return default_jobs(n_formulations * n_properties * examples)
        return check_jobs(self.jobs)


@dataclass(frozen=True, slots=True)
class PlaceOptions:
    """The mesh of the user or the scene on which the properties are checked, instead of random interfaces."""

    mesh: Annotated[
        Path | None,
        typer.Option(help="Check on the interface of this mesh file, and on the bodies of its cells.", metavar="FILE"),
    ] = None
    slave: Annotated[
        str | None, typer.Option(help="Group of the mesh's slave lines, or faces in space.", metavar="TAG")
    ] = None
    master: Annotated[
        str | None, typer.Option(help="Group of the mesh's master lines, or faces in space.", metavar="TAG")
    ] = None
    flip: Annotated[bool, typer.Option("--flip", help="Exchange inside and outside of the mesh's lines.")] = False
    material: Annotated[
        list[str] | None,
        typer.Option(
            help="Material of the body of a group of the mesh. (default: 1,0.3) Repeatable.", metavar="TAG=E,ν"
        ),
    ] = None
    support: Annotated[
        list[str] | None,
        typer.Option(
            help="Displacement imposed on a group of the mesh, each a number or free. (default: bodies are held far "
            "from the contact, and the slave is pushed) Repeatable.",
            metavar="TAG=X,Y",
        ),
    ] = None
    scene: Annotated[
        str | None, typer.Option(help="Check on this scene: c or c:refine=2,penalty=1e4.", metavar="NAME[:OPTIONS]")
    ] = None
    scene_file: Annotated[
        str | None,
        typer.Option(
            help="Check on the scene that this function returns. The file runs in a process of its own.",
            metavar="FILE.py:FUNCTION",
        ),
    ] = None

    def read(self) -> Interface | Case | None:
        """Return the scene or the interface of the mesh, or the scene with a name; None for random ones."""
        return self.make_scene() or self.read_mesh()

    def read_mesh(self) -> Interface | Case | None:
        """Return the scene of the mesh's bodies, or its interface if it makes no scene; None without a mesh.

        What the scene is, or why there is none, goes to standard error.
        """
        if self.mesh is None:
            for option in ("slave", "master", "flip", "material", "support"):
                if getattr(self, option):
                    raise MisuseError("--mesh", f"none, but --{option}", "--mesh FILE, which the tags belong to")
            return None
        if self.slave is None or self.master is None:
            missing = "--slave" if self.slave is None else "--master"
            raise MisuseError(
                missing, "nothing", f"{missing} TAG, a physical group of lines, or of faces in space, of {self.mesh}"
            )
        from contactverif.meshes.mesh_file import read_interface

        try:
            return self._read_bodies(self.mesh, self.slave, self.master)
        except MisuseError as error:
            if self.material or self.support:
                raise
            interface = read_interface(self.mesh, slave=self.slave, master=self.master, flip=self.flip)
            typer.echo(f"contactverif: no bodies are solved: {error}", err=True)
            return interface

    def _read_bodies(self, mesh: Path, slave: str, master: str) -> Case:
        """Return the scene of the mesh's bodies, and print a line for each of them."""
        from contactverif.meshes.mesh_scene import describe_bodies, parse_material, parse_support, read_scene

        materials = dict(map(parse_material, self.material or ()))
        supports = dict(map(parse_support, self.support or ()))
        scene = read_scene(mesh, slave=slave, master=master, flip=self.flip, materials=materials, supports=supports)
        for line in describe_bodies(scene):
            typer.echo(f"contactverif: {line}", err=True)
        return scene.case()

    def make_scene(self) -> Case | None:
        """Return the case of the scene, None without a scene."""
        places = {"--scene": self.scene, "--scene-file": self.scene_file, "--mesh": self.mesh}
        typed = [(option, value) for option, value in places.items() if value is not None]
        if len(typed) > 1:
            raise MisuseError(typed[0][0], f"{typed[0][1]} and {typed[1][0]} {typed[1][1]}", "one of the two")
        if self.scene_file is not None:
            from contactverif.meshes.scene_file import load_scene_file

            return load_scene_file(self.scene_file).case()
        if self.scene is None:
            return None
        from contactverif.problems.catalogue import load_scene

        return load_scene(self.scene).case()


def spell_out_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with each group of options replaced by its options, as typer needs it."""
    hints = typing.get_type_hints(command, include_extras=True)
    groups = {name: hint for name, hint in hints.items() if is_dataclass(hint)}

    @functools.wraps(command)
    def spelled_out(**values: Any) -> None:
        for name, group in groups.items():
            values[name] = typing.cast("type[Any]", group)(
                **{field.name: values.pop(field.name) for field in fields(group)}
            )
        command(**values)

    parameters = list(_single_options(command, hints, groups))
    spelled_out.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    spelled_out.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return spelled_out


def _single_options(
    command: Callable[..., None], hints: dict[str, Any], groups: dict[str, Any]
) -> Iterator[inspect.Parameter]:
    """Yield the parameters of the command, with the fields of a group in its place."""
    keyword = inspect.Parameter.KEYWORD_ONLY
    for name, parameter in inspect.signature(command).parameters.items():
        if name not in groups:
            yield inspect.Parameter(name, keyword, default=parameter.default, annotation=hints[name])
            continue
        annotations = typing.get_type_hints(groups[name], include_extras=True)
        for field in fields(groups[name]):
            yield inspect.Parameter(field.name, keyword, default=field.default, annotation=annotations[field.name])
