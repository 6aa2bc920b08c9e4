"""The table `[tool.contactverif]` of `pyproject.toml`: what a run takes where the command line is silent."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from contactverif.contract.errors import MisuseError

_FILE = Path("pyproject.toml")
_TABLE = "tool.contactverif"
_NEEDED = {
    "profile": "the name of a profile",
    "properties": "a list of patterns",
    "known": "a table of properties and reasons",
    "isolation": "box, landlock, process or inline",
    "jobs": "a whole number",
    "open": "a list of paths",
    "memory": "true or false",
    "traits": "a table of libraries and their traits",
}


@dataclass(frozen=True, slots=True)
class Settings:
    """The settings of a project."""

    profile: str | None = None
    properties: tuple[str, ...] = ()  # Patterns, as behind -p.
    known: dict[str, str] = field(default_factory=dict)  # {property: why its failure is known}.
    isolation: Literal["box", "landlock", "process", "inline"] | None = None
    jobs: int | None = None
    open: tuple[str, ...] = ()  # What a plugin in a box may use and write.
    memory: bool = True  # Failures are kept for the next run.
    # {name of a library: its traits}, which the loaders of libraries read and check.
    traits: dict[str, dict[str, Any]] = field(default_factory=dict)


def read_settings() -> Settings:
    """Read the settings of the project in the working folder; without such a table all is left to the command line."""
    try:
        file: Any = tomllib.loads(_FILE.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return Settings()
    except (OSError, ValueError) as error:
        raise MisuseError(f"{_FILE}", " ".join(str(error).split()), "a file of settings that can be read") from None
    table = file.get("tool", {}).get("contactverif", {})
    if not isinstance(table, dict):
        raise MisuseError(f"{_TABLE} of {_FILE}", repr(table), f"a table [{_TABLE}]")
    return _convert(table) if table else Settings()


def _convert(table: dict[str, Any]) -> Settings:
    """Return the settings of a table, each of the right kind."""
    import msgspec

    from contactverif.contract.names import unknown_name_error

    for name in table:
        if name not in _NEEDED:
            raise unknown_name_error(f"[{_TABLE}] of {_FILE}", name, _NEEDED)
    try:
        return msgspec.convert(table, Settings)
    except msgspec.ValidationError as error:
        name = str(error).partition(" - at `$.")[2].rstrip("`").partition("[")[0]
        raise MisuseError(f"{name} in [{_TABLE}] of {_FILE}", repr(table[name]), _NEEDED[name]) from None
