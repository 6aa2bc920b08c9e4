"""The spelling of names with options on the command line, `NAME:OPTION=VALUE,OPTION=VALUE`, and its error messages.

Formulations and scenes use the same spelling. A name that does not exist is answered with the nearest names that do.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

from contactverif.contract.errors import MisuseError


def unknown_name_error(argument: str, name: str, names: Iterable[str], otherwise: str = "") -> MisuseError:
    """Return the error for a name that does not exist; it suggests the nearest names.

    If none is near, it lists all, or says `otherwise` what is needed.
    """
    every = sorted(names)
    near = difflib.get_close_matches(name, every, n=3)
    if near:
        return MisuseError(argument, repr(name), f"a name that exists; the nearest: {', '.join(near)}")
    if otherwise:
        return MisuseError(argument, repr(name), otherwise)
    return MisuseError(argument, repr(name), f"one of {', '.join(every)}" if every else "a name, but there is none")


def parse_name(
    argument: str, text: str, form: str = "NAME or NAME:OPTION=VALUE,OPTION=VALUE"
) -> tuple[str, dict[str, Any]]:
    """Split `name:option=value,option=value` into the name and its options.

    Examples
    --------
    >>> parse_name("formulation", "vts-me:n=4,area=reference")
    ('vts-me', {'n': 4, 'area': 'reference'})
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
        options[option] = _parse_value(value)
    return name, options


def _parse_value(text: str) -> bool | int | float | str:
    if text in ("true", "false"):
        return text == "true"
    for number in (int, float):
        try:
            return number(text)
        except ValueError:
            pass
    return text
