"""How things are asked for by name: `NAME:OPTION=VALUE,OPTION=VALUE`, and what is said where there is no such name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

from contactverif.contract.errors import MisuseError


def unknown_name_error(argument: str, name: str, names: Iterable[str]) -> MisuseError:
    """The error for a name that is none of the names: it suggests the nearest, or lists all if none is near."""
    every = sorted(names)
    near = difflib.get_close_matches(name, every, n=3)
    if near:
        return MisuseError(argument, repr(name), f"a name that exists; the nearest: {', '.join(near)}")
    return MisuseError(argument, repr(name), f"one of {', '.join(every)}" if every else "a name, but there is none")


def parse_name(
    argument: str, text: str, form: str = "NAME or NAME:OPTION=VALUE,OPTION=VALUE"
) -> tuple[str, dict[str, Any]]:
    """Name and options of `name:option=value,option=value`.

    Raises
    ------
    MisuseError
        If the text does not have that form, or names an option twice.
    """
    name, colon, rest = text.partition(":")
    if not name:
        raise MisuseError(argument, repr(text), form)
    options: dict[str, Any] = {}
    for part in rest.split(",") if colon else ():
        option, equals, value = part.partition("=")
        if not (option and equals and value):
            raise MisuseError(argument, f"{part!r} in {text!r}", form)
        if option in options:
            raise MisuseError(argument, f"{option} twice in {text!r}", "each option once")
        options[option] = _value(value)
    return name, options


def _value(text: str) -> bool | int | float | str:
    if text in ("true", "false"):
        return text == "true"
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            pass
    return text
