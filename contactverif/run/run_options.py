"""The options of a run, each declared once.

The command line, `[tool.contactverif]` in `pyproject.toml`, the plan of a journal and `contactverif.verify` follow from
this declaration. Every `--help` imports this file, so nothing at its top takes long to import.
"""

from __future__ import annotations

import os
import secrets
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, get_args, get_type_hints

from contactverif.contract.errors import MisuseError, unknown_name_error

if TYPE_CHECKING:
    from contactverif.isolation.limits import Limits

MOST_EXAMPLES = 10**9
FIRST_CASES = 5  # The number of cases of a property in the first round.
# The failures that are shrunk: those that nobody stated, all, or none. The others show a witness or the first case.
Shrink = Literal["one", "new", "all", "none"]


@dataclass(frozen=True, slots=True)
class Profile:
    """The size of a run under a name on the command line, with its seed."""

    name: str
    examples: int  # The number of planned cases of each property.
    seed: int | None  # The seed of all cases; None means a fresh seed in every run.

    def resolve(self, *, examples: int | None = None, seed: int | None = None, fresh: int | None = None) -> Self:
        """Return the profile with the numbers of the user, and the seed of either, else the fresh one, or a new one."""
        examples = self.examples if examples is None else examples
        seed = self.seed if seed is None else seed
        if not 1 <= examples <= MOST_EXAMPLES:
            raise MisuseError("examples", str(examples), f"at least 1, at most {MOST_EXAMPLES}")
        if seed is not None and not 0 <= seed < 2**63:
            raise MisuseError("seed", str(seed), "a whole number ≥ 0 and < 2^63")
        if seed is None:
            seed = secrets.randbelow(10**9) if fresh is None else fresh
        return replace(self, examples=examples, seed=seed)


# `dev` draws new cases in every run, `ci` the same cases every time, `nightly` twenty times as many.
PROFILES = {
    profile.name: profile
    for profile in (Profile("dev", 100, None), Profile("ci", 100, 0), Profile("nightly", 2000, None))
}


def profile_named(name: str) -> Profile:
    """Return the profile of that name."""
    if name not in PROFILES:
        raise unknown_name_error("profile", name, PROFILES)
    return PROFILES[name]


SAMPLING, PLACE, ISOLATION = "sampling", "place", "isolation"
_FILE = Path("pyproject.toml")
_TABLE = "tool.contactverif"
_TRAITS = "traits"  # The loaders of libraries read and check this entry of the table.


class Isolation(StrEnum):
    """The place where plugins live."""

    BOX = "box"
    LANDLOCK = "landlock"
    PROCESS = "process"
    INLINE = "inline"


@dataclass(frozen=True, slots=True)
class Option:
    """The words and the needs of an option. A flag that is typed changes a default of True or False."""

    help: str
    metavar: str | None = None
    flags: tuple[str, ...] = ()  # Empty for `--NAME` alone.
    group: str = ""  # Options that a command takes together.
    setting: str = ""  # Its name in the table of settings; empty if it is that of the option.
    needed: str = ""  # What an error says that the setting needs; empty if there is no setting.


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """The options of a run, as they are typed or as a journal has them. Those of a journal are settled."""

    # `compare` names its reference first.
    names: Annotated[
        tuple[str, ...], Option("Formulations, with options: vts-ppt, vts-me:n=4, nts-ar:area=reference.", "NAME")
    ] = ()
    engines: Annotated[
        tuple[str, ...],
        Option(
            "A whole contact code, judged by the displacements that it finds. Repeatable.",
            "NAME[:OPTIONS]",
            ("--engine",),
        ),
    ] = ()
    every: Annotated[bool, Option("Check every installed formulation that wraps no other.", flags=("--all",))] = False
    properties: Annotated[
        tuple[str, ...],
        Option(
            "Check only the properties whose id matches, or those of a family. Repeatable.",
            "GLOB",
            ("--property", "-p"),
            needed="a list of patterns",
        ),
    ] = ()
    examples: Annotated[
        int | None,
        Option("Number of random cases of each property.", "N", group=SAMPLING, needed="a whole number"),
    ] = None
    seed: Annotated[int | None, Option("The same seed gives the same cases.", "N", group=SAMPLING)] = None
    profile: Annotated[
        str | None,
        Option(
            "dev: 100 cases of each property, new ones in every run. ci: 100 cases, always the same. "
            "nightly: 2000 cases, new ones in every run. (default: dev)",
            "NAME",
            group=SAMPLING,
            needed="the name of a profile",
        ),
    ] = None
    shrink: Annotated[
        Shrink | None,
        Option(
            "The failures whose mesh is made as small as it goes. one: the most telling one of each formulation; new: "
            "those that neither the formulation nor --known states; the others show a witness, or the first case that "
            "clearly fails. (default: one)",
            group=SAMPLING,
        ),
    ] = None
    out: Annotated[
        tuple[Path, ...],
        Option(
            "Write the results: FILE.nc a report, FILE.html a page, FILE.json or FILE.xml (JUnit) for other programs. "
            "Repeatable.",
            "FILE",
        ),
    ] = ()
    pictures: Annotated[Path | None, Option("Draw each counterexample into this folder.", "FOLDER")] = None
    known: Annotated[  # {property: why its failure is known}
        dict[str, str],
        Option(
            "A known failure, with its reason. Repeatable.", "ID=REASON", needed="a table of properties and reasons"
        ),
    ] = field(default_factory=dict)
    keep_going: Annotated[
        bool,
        Option(
            "Ask all properties, even if the first show an opposite sign, a crash, a breach of the contract, or "
            "answers that depend on earlier calls."
        ),
    ] = False
    exit_first: Annotated[
        bool, Option("Ask nothing more once a row is wrong, beyond rows with its cases.", flags=("--exitfirst", "-x"))
    ] = False
    quick: Annotated[bool, Option("Ask the first round alone: cheap properties, 5 cases each.", flags=("--quick",))] = (
        False
    )
    last_failed: Annotated[
        bool, Option("Ask nothing but the cases that failed in earlier runs, which `.contactverif` keeps.")
    ] = False
    memory: Annotated[
        bool,
        Option(
            "Neither ask first what failed in earlier runs, nor keep what fails now.",
            flags=("--no-memory",),
            needed="true or false",
        ),
    ] = True
    mesh: Annotated[
        Path | None,
        Option("Check on the interface of this mesh file, and on the bodies of its cells.", "FILE", group=PLACE),
    ] = None
    slave: Annotated[
        str | None,
        Option("Slave: a group of the mesh, or a file. (default: of its contact pair)", "GROUP", group=PLACE),
    ] = None
    master: Annotated[str | None, Option("Master: as the slave.", "GROUP", group=PLACE)] = None
    pair: Annotated[int, Option("Number of the contact pair of the mesh, if it has several.", "N", group=PLACE)] = 0
    flip: Annotated[
        Literal["slave", "master", "both"] | None,
        Option("Exchange inside and outside of a side without cells.", "SIDE", group=PLACE),
    ] = None
    material: Annotated[
        tuple[str, ...],
        Option("Material of the body of a group of the mesh. (default: 1,0.3) Repeatable.", "GROUP=E,ν", group=PLACE),
    ] = ()
    support: Annotated[
        tuple[str, ...],
        Option(
            "Displacement imposed on a group of the mesh, each a number or free. (default: bodies are held far from "
            "the contact, and the slave is pushed) Repeatable.",
            "GROUP=X,Y[,Z]",
            group=PLACE,
        ),
    ] = ()
    scene: Annotated[
        str | None, Option("Check on this scene: c or c:refine=2,penalty=1e4.", "NAME[:OPTIONS]", group=PLACE)
    ] = None
    scene_file: Annotated[
        str | None,
        Option(
            "Check on the scene that this function returns. The file runs in a process of its own.",
            "FILE.py:FUNCTION",
            group=PLACE,
        ),
    ] = None
    jobs: Annotated[
        int | None,
        Option(
            "Number of processes that share the work; the results are the same. "
            "(default: one for each 1000 planned cases, at most one for each core)",
            "N",
            ("--jobs", "-j"),
            needed="a whole number",
        ),
    ] = None
    isolation: Annotated[
        Isolation | None,
        Option(
            "box: each plugin in a process of its own that can write nothing, and sees no network and no other "
            "process; the default where the system has boxes. landlock: a process that writes no file, the default "
            "where it can be had and a box cannot. process: without either. inline: in this process, for debugging.",
            "WHERE",
            group=ISOLATION,
            needed="box, landlock, process or inline",
        ),
    ] = None
    time_limit: Annotated[
        float, Option("Longest time of a call in a plugin's process.", "SECONDS", group=ISOLATION)
    ] = 60.0
    memory_limit: Annotated[int, Option("Memory that a plugin's process may take.", "MEGABYTES", group=ISOLATION)] = (
        4096
    )
    opened: Annotated[  # None to leave it to the settings
        tuple[str, ...] | None,
        Option(
            "What a plugin in a box may use and write: a file, a folder, a device, or network. Repeatable.",
            "PATH",
            ("--open",),
            ISOLATION,
            setting="open",
            needed="a list of paths",
        ),
    ] = None

    def with_settings(self) -> RunOptions:
        """Return the options with those of the project where nothing is typed."""
        from contactverif.plugins.registry import has_engine, matching_ids, property_ids, unknown_property_error

        settings, nothing = read_settings(), RunOptions()
        # A profile that is typed has its own number of cases, and so has `--quick`.
        typed = {"examples"} if self.profile or self.quick else set()
        silent = [name for name in _settings().values() if getattr(self, name) == getattr(nothing, name)]
        silent = [name for name in silent if name not in typed]
        options = replace(self, **{name: getattr(settings, name) for name in silent})
        ids = property_ids(engines=True)
        for unknown in settings.known.keys() - {*ids}:
            raise unknown_property_error("known failure", unknown, ids)
        matching = {*matching_ids(options.properties, engines=has_engine(self.names))} - self.known.keys()
        known = {name: reason for name, reason in settings.known.items() if name in matching}
        return replace(options, known=self.known | known)

    def settle(self, fresh_seed: int | None = None) -> RunOptions:
        """Return the options with all that a journal must know: ids for patterns, numbers of the profile, the place.

        Where nothing says the seed it is the fresh one, or a new one. Options that are obeyed before are not kept.
        """
        from contactverif.plugins.registry import has_engine, matching_ids

        examples = FIRST_CASES if self.quick and self.examples is None else self.examples
        size = profile_named(self.profile or "dev").resolve(examples=examples, seed=self.seed, fresh=fresh_seed)
        isolation, opened = self.settled_isolation()
        return replace(
            self,
            engines=(),
            every=False,
            memory=True,
            last_failed=False,
            properties=matching_ids(self.properties, engines=has_engine(self.names)),
            profile=size.name,
            examples=size.examples,
            seed=size.seed,
            isolation=isolation,
            opened=opened,
        )

    @property
    def size(self) -> Profile:
        """The profile of settled options, with their number of cases and their seed."""
        assert self.profile is not None
        assert self.examples is not None
        return Profile(self.profile, self.examples, self.seed)

    def settled_isolation(self, argument: str = "--isolation") -> tuple[Isolation, tuple[str, ...]]:
        """Return the place of plugins and what is open to them, as the user, the project or the system says.

        Without a choice of the user a plugin is in a box, or else has rules of Landlock, or else neither. Under pytest
        it is in this process, where a test may want to look into it. `argument` is the name of the choice in an error.
        """
        settings = read_settings()
        opened = _absolute((settings.opened or ()) if self.opened is None else self.opened)
        place = self.isolation or settings.isolation
        if place is None and "PYTEST_CURRENT_TEST" in os.environ:
            place = Isolation.INLINE
        if place not in (Isolation.PROCESS, Isolation.INLINE):
            place = _strongest(place, opened, argument)
        return place, opened

    def limits(self, hidden: Iterable[Path] = (), argument: str = "--isolation") -> Limits | None:
        """Return the limits of a plugin's process, and its box, in which some paths are not there.

        None if plugins live in this process.
        """
        place, opened = self.settled_isolation(argument)
        if place is Isolation.INLINE:
            return None
        from contactverif.isolation.box import Box
        from contactverif.isolation.limits import Limits
        from contactverif.isolation.process import adopt_orphans
        from contactverif.run.journal import key_file

        adopt_orphans()
        box = Box(opened, tuple(map(str, [*hidden, key_file()])), by_rules=place is Isolation.LANDLOCK)
        return Limits(self.time_limit, self.memory_limit, None if place is Isolation.PROCESS else box)

    def words(self, names: Iterable[str]) -> list[str]:
        """Return some of the options as they are typed, a word each; those that nobody typed have none."""
        words, nothing = [], RunOptions()
        for name in names:
            value, option = getattr(self, name), declared_options(RunOptions)[name][1]
            if value == getattr(nothing, name) or value is None:
                continue
            flag = next(iter(option.flags), f"--{name.replace('_', '-')}")
            pairs = [f"{key}={reason}" for key, reason in value.items()] if isinstance(value, dict) else value
            for entry in pairs if isinstance(pairs, tuple | list) else [pairs]:
                words += [flag] if isinstance(entry, bool) else [flag, str(entry)]
        return words

    @property
    def place_words(self) -> str:
        """The options that say where a run asks, as they are typed; empty if it is on random interfaces and scenes."""
        return " ".join(self.words(group_names(PLACE)))

    def from_folder(self, folder: str) -> RunOptions:
        """Return the options of a run in a folder, with names of files as they are from here."""
        if os.getcwd() == folder:
            return self
        base = Path(folder)
        return replace(
            self,
            out=tuple(base / path for path in self.out),
            pictures=self.pictures and base / self.pictures,
            mesh=self.mesh and base / self.mesh,
            scene_file=self.scene_file and str(base / self.scene_file),
        )


@cache
def declared_options(group: type) -> dict[str, tuple[Any, Option]]:
    """Return {name of a field: its type and its declaration} of a dataclass whose fields are options."""
    hints = get_type_hints(group, include_extras=True)
    return {name: (get_args(hint)[0], get_args(hint)[1]) for name, hint in hints.items()}


def group_names(name: str) -> list[str]:
    """Return the options of a group of `RunOptions`, or the one option of this name."""
    return [each for each, (_, option) in declared_options(RunOptions).items() if name in (option.group, each)]


@cache
def _settings() -> dict[str, str]:
    options = declared_options(RunOptions)
    return {option.setting or name: name for name, (_, option) in options.items() if option.needed}


def read_settings() -> RunOptions:
    """Read the settings of the project in the working folder; without such a table all is left to the command line."""
    if not os.path.lexists(_FILE):
        return RunOptions()
    from contactverif.isolation.file_reader import check_ordinary

    needed = "a file of settings that can be read"
    check_ordinary(_FILE, f"{_FILE}", needed)
    try:
        tool: Any = tomllib.loads(_FILE.read_text(encoding="utf-8")).get("tool", {})
    except (OSError, ValueError, RecursionError) as error:
        raise MisuseError(f"{_FILE}", " ".join(str(error).split()), needed) from None
    table = tool.get("contactverif", {}) if isinstance(tool, dict) else tool
    if not isinstance(table, dict):
        raise MisuseError(f"{_TABLE} of {_FILE}", repr(table), f"a table [{_TABLE}]")
    return RunOptions(**_convert(table)) if table else RunOptions()


def _convert(table: dict[str, Any]) -> dict[str, Any]:
    import msgspec

    options, values = declared_options(RunOptions), {}
    for name in table:
        if name not in (*_settings(), _TRAITS):
            raise unknown_name_error(f"[{_TABLE}] of {_FILE}", name, (*_settings(), _TRAITS))
    for name, value in table.items():
        kind, option = (dict[str, dict[str, Any]], None) if name == _TRAITS else options[_settings()[name]]
        try:
            converted = msgspec.convert(value, kind)
        except msgspec.ValidationError:
            needed = option.needed if option else "a table of libraries and their traits"
            raise MisuseError(f"{name} in [{_TABLE}] of {_FILE}", repr(value), needed) from None
        if option:
            values[_settings()[name]] = converted
    return values


def _strongest(wanted: Isolation | None, opened: tuple[str, ...], argument: str) -> Isolation:
    """Return the place that the user wants, which must be possible, or else the safest that is."""
    from contactverif.isolation.box import Box, why_no_box
    from contactverif.isolation.confine import landlock_version

    reason = "" if wanted is Isolation.LANDLOCK else why_no_box(Box(opened))
    if reason and wanted is Isolation.BOX:
        raise MisuseError(argument, f"box, but {reason}", "a system that has boxes, or process")
    if wanted is Isolation.LANDLOCK and not landlock_version():
        needed = "Linux with Landlock and the package landlockpy, or process"
        raise MisuseError(argument, "landlock, which this system has not", needed)
    if wanted is None and reason:
        return Isolation.LANDLOCK if landlock_version() else Isolation.PROCESS
    return wanted or Isolation.BOX


def _absolute(opened: Iterable[str]) -> tuple[str, ...]:
    from contactverif.isolation.confine import NETWORK

    paths = tuple(path if path == NETWORK else os.path.abspath(path) for path in opened)
    for path in paths:
        if path != NETWORK and not os.path.exists(path):
            raise MisuseError("--open", f"{path}, which does not exist", f"a path that exists, or {NETWORK}")
    return paths
