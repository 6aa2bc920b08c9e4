"""Traits in TOML: a file beside the library, a table of pyproject.toml, or the text that a library returns.

All three have the same form and the same reader. The keys are the names of the traits. Tables such as `[promises]`
group them as the class `Traits` does, but no two traits have the same name, so a flat list says the same.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from contactverif.contract.errors import ContractError, MisuseError
from contactverif.contract.names import unknown_name_error
from contactverif.contract.traits import Traits

_GROUPS = ("promises", "patch", "rules", "abilities", "evidence")
_FORBIDDEN = ("batched", "takes_complex", "takes_longdouble")  # A library takes one state of doubles.
_PROJECT = "pyproject.toml"


def traits_beside(library: Path, file: str = "") -> Traits:
    """Return the traits of a library: those of a chosen TOML file, else those beside it, else no promise.

    Beside `LIBRARY.so` the file `LIBRARY.toml` counts. Without it the table `[tool.contactverif.traits.LIBRARY]`
    counts, of the `pyproject.toml` in the library's folder or in the nearest one above it.
    """
    if file:
        path = Path.cwd() / Path(file).expanduser()
        return parse_traits(_read(path), str(path))
    beside = library.with_suffix(".toml")
    if beside.is_file():
        return parse_traits(_read(beside), str(beside))
    project = next((folder / _PROJECT for folder in library.parents if (folder / _PROJECT).is_file()), None)
    if project is not None:
        tables = _read(project).get("tool", {}).get("contactverif", {}).get("traits", {})
        if isinstance(tables, dict) and library.stem in tables:
            return parse_traits(tables[library.stem], f"[tool.contactverif.traits.{library.stem}] of {project}")
    return Traits()


def parse_traits_text(text: str, place: str) -> Traits:
    """Return the traits of a text of TOML."""
    return parse_traits(_parse(text, place), place)


def parse_traits(table: Any, place: str) -> Traits:
    """Return the traits of a table at a place; those that it does not name promise nothing.

    Examples
    --------
    >>> table = {"rules": {"penalty": "nodal"}, "promises": {"symmetric": True, "patch": {"flat": None}}}
    >>> parse_traits(table, "a table").promises.symmetric
    True
    """
    if not isinstance(table, dict):
        raise MisuseError(place, f"a {type(table).__name__}", "a table of traits")
    values = dict(_flatten(table))
    for name in values:
        if name not in Traits().by_name() or name in _FORBIDDEN:
            raise unknown_name_error(place, name, set(Traits().by_name()) - {*_FORBIDDEN})
    values |= {name: tuple(values[name]) for name in ("dimensions", "faces") if name in values}
    try:
        return Traits().revise(**values)
    except (ContractError, TypeError) as error:
        raise MisuseError(place, "; ".join(str(error).splitlines()), "traits as the class Traits takes them") from None


def _flatten(table: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the names and values of a table, groups taken apart."""
    for name, value in table.items():
        if name in _GROUPS and isinstance(value, dict):
            yield from _flatten(value)
        else:
            yield name, value


def _read(path: Path) -> dict[str, Any]:
    """Return the tables of a TOML file."""
    try:
        return _parse(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise MisuseError(str(path), " ".join(str(error).split()), "a TOML file with traits") from None


def _parse(text: str, place: str) -> dict[str, Any]:
    """Return the tables of a text of TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise MisuseError(place, " ".join(str(error).split()), "TOML") from None
