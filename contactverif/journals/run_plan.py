"""The plan of a run: the header of its journal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from contactverif.contract.errors import MisuseError
from contactverif.journals.journal import read_header

FORMAT = 3  # A change of a record is a new one.


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """The plan of a run, the header of its journal. A row is a formulation and a property, as on the command line."""

    command: str = ""
    options: dict[str, Any] = {}
    folder: str = ""  # The working folder of the command, to which names of files are relative.
    versions: dict[str, str] = {}  # {library or package: version or digest}.
    formulations: tuple[str, ...] = ()
    properties: tuple[str, ...] = ()
    profile: str = ""
    examples: int = 0
    seed: int = 0
    machine: dict[str, str] = {}  # What the last bits of a number depend on, beside the versions.
    nonce: str = ""  # It tells two runs with the same plan apart.
    format: int = FORMAT

    @property
    def place(self) -> str:
        """The options that say where the run asked; empty if it was on random interfaces and scenes."""
        return place_words(self.options.get("place") or {})


def place_words(options: Mapping[str, Any]) -> str:
    """Return options {name: value} as they are typed, without those that are not there."""
    words = []
    for name, value in options.items():
        option = f"--{name.replace('_', '-')}"
        values = value if isinstance(value, list | tuple) else [value] if value else []
        words += [option if entry is True else f"{option} {entry}" for entry in values]
    return " ".join(words)


def is_provable(options: Mapping[str, Any]) -> bool:
    """Return whether no plugin of a run with these options could read the key of its journal."""
    isolation = options.get("isolation")
    return isinstance(isolation, Mapping) and isolation.get("isolation") == "box"


def without_place(options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options of a run but for the place where its plugins lived: it changes no number."""
    isolation = options.get("isolation")
    if not isinstance(isolation, Mapping):
        return dict(options)
    return {**options, "isolation": {name: value for name, value in isolation.items() if name != "isolation"}}


def read_plan(folder: Path, argument: str) -> Plan:
    """Return the plan of a journal of a run, one of this format."""
    plan = read_header(folder, Plan, argument)
    if plan.format != FORMAT:
        raise MisuseError(argument, f"{folder.name} with format {plan.format}", f"a journal of format {FORMAT}")
    return plan


def check_versions(journal: Mapping[str, str], here: Mapping[str, str], argument: str) -> None:
    """Check that a run goes on with what it began with; the message names the first version or digest that differs."""
    for name in sorted({*journal, *here}):
        if journal.get(name) != here.get(name):
            versions = f"{journal.get(name, 'nothing')} in the journal and {here.get(name, 'nothing')} here"
            raise MisuseError(argument, f"{name.replace('_', ' ')}: {versions}", "the same, or a new run")
