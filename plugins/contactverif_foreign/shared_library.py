"""A shared library that a user built: its file, its functions, and the errors that say what is wrong with it."""

from __future__ import annotations

import ctypes
from functools import lru_cache
from math import isfinite
from pathlib import Path
from typing import Any

from contactverif.contract.errors import MisuseError


def find_file(file: str, needed: str = "a shared library, such as gcc -shared or gfortran -shared makes") -> Path:
    """Return the absolute path of a file; a relative one is looked for in the working folder."""
    path = Path(file).expanduser()
    if not path.is_absolute():
        path = Path.cwd() / path
    if not path.is_file():
        kind = "a folder" if path.is_dir() else "no such file"
        raise MisuseError("option file", f"{kind}: {path}", needed)
    return path


@lru_cache(maxsize=16)  # A formulation is made anew for the penalty of each case.
def load_library(path: Path) -> ctypes.CDLL:
    """Load a shared library into this process."""
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        needed = "a shared library for this machine that refers to no function of the solver"
        raise MisuseError("option file", " ".join(str(error).split()), needed) from None


def find_function(library: ctypes.CDLL, path: Path, *names: str) -> Any:
    """Return the first of the functions that the library has."""
    for name in names:
        if hasattr(library, name):
            return library[name]  # A new object, so that nobody else changes its types.
    raise MisuseError("option file", f"{path.name} without the function {names[0]}", f"one of {', '.join(names)}")


def fortran_names(name: str) -> tuple[str, ...]:
    """Return the names that compilers of Fortran give to a subroutine."""
    return f"{name}_", name, name.upper()


def parse_numbers(option: str, value: float | str) -> tuple[float, ...]:
    """Return the numbers of an option, such as 0.3:2 or 0.3; none for an empty text.

    Examples
    --------
    >>> parse_numbers("props", "0.3:2")
    (0.3, 2.0)
    """
    parts = value.split(":") if isinstance(value, str) else [value]
    try:
        numbers = tuple(float(part) for part in parts if part != "")
    except ValueError:
        numbers = (float("nan"),)
    if isinstance(value, bool) or not all(map(isfinite, numbers)):
        raise MisuseError(option, repr(value), "finite numbers with ':' between them, such as 0.3:2")
    return numbers
