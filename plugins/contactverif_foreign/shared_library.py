"""A shared library that a user built: its file, its functions, its traits, and the memory that it gets for a call.

All arguments of a call lie at fixed addresses, with guard values around each array. A sweep over the elements keeps a
row of memory for each. It copies the row to the slot, calls, and copies it back. After the sweep all guards and inputs
of all rows are compared at once, so a wrong write has an argument and an element.

Traits come from TOML: a file beside the library, a table of pyproject.toml, or the text that a library returns. The
keys are the names of the traits. Tables such as `[promises]` group them as the class `Traits` does, but no two traits
have the same name, so a flat list says the same.
"""

import ctypes
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import isfinite
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from contactverif.contract.arrays import Array
from contactverif.contract.errors import ContractError, MisuseError, unknown_name_error
from contactverif.contract.traits import Traits

_GROUPS = ("promises", "patch", "rules", "abilities", "evidence")
_FORBIDDEN = ("batched", "takes_complex", "takes_longdouble")  # A library takes one state of doubles.
_PROJECT = "pyproject.toml"
_SOURCES = (".for", ".f", ".f90")
_GUARD = np.uint64(0x7FF8C0DEC0DEC0DE)  # Not a number, so what reads it shows.
_LEAST_GUARD = 8  # Words around an array.


def find_file(file: str) -> Path:
    """Return the absolute path of a shared library; a relative one is looked for in the working folder."""
    path = Path.cwd() / Path(file).expanduser()
    if not path.is_file():
        place = f"{'a folder' if path.is_dir() else 'no such file'}: {path}"
        raise MisuseError("option file", place, "a shared library, such as gcc -shared or gfortran -shared makes")
    return path


@lru_cache(maxsize=16)  # A formulation is made anew for the penalty of each case.
def load_library(path: Path) -> ctypes.CDLL:
    """Load a shared library into this process."""
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        words, needed = " ".join(str(error).split()), "a shared library for this machine"
        _, symbol, missing = words.partition("undefined symbol: ")
        if symbol:
            needed = f"a stub of it, such as: subroutine {missing.rstrip('_')}; end subroutine"
        elif path.suffix.lower() in _SOURCES:
            needed = f"a shared library; this is source text: gfortran -shared -fPIC -o {path.stem}.so {path.name}"
        raise MisuseError("option file", words, needed) from None


def find_function(library: ctypes.CDLL, path: Path, *names: str) -> Any:
    """Return the first of the functions that the library has."""
    for name in names:
        if hasattr(library, name):
            return library[name]  # A new object: its types belong to the caller.
    raise MisuseError("option file", f"{path.name} without the function {names[0]}", f"one of {', '.join(names)}")


def fortran_names(name: str) -> tuple[str, ...]:
    """Return the names that compilers of Fortran give to a subroutine."""
    return f"{name}_", name, name.upper()


def parse_props(value: float | str) -> tuple[float, ...]:
    """Return the numbers of the option `props`, such as 0.3:2 or 0.3; none for an empty text."""
    parts = value.split(":") if isinstance(value, str) else [value]
    try:
        numbers = tuple(float(part) for part in parts if part != "")
    except ValueError:
        numbers = (float("nan"),)
    if isinstance(value, bool) or not all(map(isfinite, numbers)):
        raise MisuseError("option props", repr(value), "finite numbers with ':' between them, such as 0.3:2")
    return numbers


def traits_beside(library: Path, file: str = "") -> Traits:
    """Return the traits of a library: those of a chosen TOML file, else those beside it, else no promise.

    Beside `LIBRARY.so` the file `LIBRARY.toml` counts. Without it the table `[tool.contactverif.traits.LIBRARY]`
    counts, of the `pyproject.toml` in the library's folder or in the nearest one above it.
    """
    beside = Path.cwd() / Path(file).expanduser() if file else library.with_suffix(".toml")
    if file or beside.is_file():
        return parse_traits_text(_read(beside), str(beside))
    project = next((folder / _PROJECT for folder in library.parents if (folder / _PROJECT).is_file()), None)
    if project is not None:
        tables = _parse(_read(project), str(project)).get("tool", {}).get("contactverif", {}).get("traits", {})
        if isinstance(tables, dict) and library.stem in tables:
            return _to_traits(tables[library.stem], f"[tool.contactverif.traits.{library.stem}] of {project}")
    return Traits()


def parse_traits_text(text: str, place: str) -> Traits:
    """Return the traits of a text of TOML; those that it does not name promise nothing."""
    return _to_traits(_parse(text, place), place)


def _to_traits(table: Any, place: str) -> Traits:
    if not isinstance(table, dict):
        raise MisuseError(place, f"a {type(table).__name__}", "a table of traits")
    known = set(Traits().by_name()) - {*_FORBIDDEN}
    values = dict(_flatten(table))
    for name in values:
        if name not in known:
            raise unknown_name_error(place, name, known)
    values |= {name: tuple(values[name]) for name in ("dimensions", "faces") if name in values}
    try:
        return Traits().revise(**values)
    except (ContractError, TypeError) as error:
        raise MisuseError(place, "; ".join(str(error).splitlines()), "traits as the class Traits takes them") from None


def _flatten(table: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        yield from _flatten(value) if name in _GROUPS and isinstance(value, dict) else [(name, value)]


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise MisuseError(str(path), " ".join(str(error).split()), "a TOML file with traits") from None


def _parse(text: str, place: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise MisuseError(place, " ".join(str(error).split()), "TOML") from None


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument of a library's function."""

    name: str
    shape: tuple[int, ...] = ()  # A scalar has none.
    kind: Literal["real", "integer"] = "real"
    is_input: bool = True  # It must be unchanged after the call.

    @property
    def size(self) -> int:
        """The number of values."""
        return int(np.prod(self.shape, dtype=np.int64))

    @property
    def n_halves(self) -> int:
        """The number of half words that a value takes."""
        return 1 if self.kind == "integer" else 2

    def values(self, halves: Array) -> Array:
        """Return half words (…, n) as numbers of this argument."""
        return halves if self.kind == "integer" else halves.view(np.float64)


class GuardedSlot:
    """The memory of one call. Scalars share their guards, an array has its own.

    A guard is as many words of eight bytes as wanted at least, such as the size of a column of the largest array.
    """

    def __init__(self, arguments: Sequence[Argument], guard: int = _LEAST_GUARD) -> None:
        self.arguments = {argument.name: argument for argument in arguments}
        self.spans: dict[str, slice] = {}  # The halves of words in a row that the values of each argument take.
        guard, place, is_behind_scalar = 2 * max(guard, _LEAST_GUARD), 0, False
        for argument in sorted(arguments, key=lambda argument: bool(argument.shape)):
            if argument.shape or not is_behind_scalar:
                place += guard
            is_behind_scalar = not argument.shape
            n_halves = argument.size * argument.n_halves
            self.spans[argument.name] = slice(place, place + n_halves)
            place += n_halves + n_halves % 2
        self.empty = np.full((place + guard) // 2, _GUARD)
        self.fixed = np.full_like(self.empty, ~np.uint64(0))  # The bits that a call must not change.
        for argument in arguments:
            self.empty.view(np.int32)[self.spans[argument.name]] = 0
            if not argument.is_input:
                self.fixed.view(np.int32)[self.spans[argument.name]] = 0
        self.memory = self.empty.copy()
        self.addresses = {name: self.memory.ctypes.data + 4 * span.start for name, span in self.spans.items()}

    def preset(self, values: Mapping[str, Any]) -> None:
        """Set arguments that are the same in all calls."""
        SlotRows(self, self.empty[None]).fill(values)

    def rows(self, n_rows: int) -> "SlotRows":
        """Return the memory of so many calls, zero but for the guards."""
        return SlotRows(self, np.tile(self.empty, (n_rows, 1)))

    def describe(self, half: int) -> str:
        """Return what lies at a half of a word: an input, or what is before or behind an array."""
        name, span = min(self.spans.items(), key=lambda item: max(item[1].start - half, half - item[1].stop + 1, 0))
        argument = self.arguments[name]
        number = (half - span.start) // argument.n_halves + 1
        if span.start <= half < span.stop:
            return f"the input {name}{f', number {number} of {argument.size}' if argument.shape else ''}"
        if half < span.start:
            return f"the place before {name}"
        size = f", {' × '.join(map(str, argument.shape))}" if len(argument.shape) > 1 else ""
        return f"number {number} of {name}, which has {argument.size}{size}"


class SlotRows:
    """The memory of a sweep: for each element a row, of which the arguments are views."""

    def __init__(self, slot: GuardedSlot, memory: NDArray[np.uint64]) -> None:
        self._slot, self._memory = slot, memory

    def __getitem__(self, name: str) -> Array:
        """Return the values (n_rows, size) of an argument, which may be written."""
        return self._slot.arguments[name].values(self._memory.view(np.int32)[:, self._slot.spans[name]])

    def fill(self, values: Mapping[str, Any]) -> None:
        """Write the values of arguments: scalars, arrays (size,) for all rows, or arrays (n_rows, size)."""
        for name, value in values.items():
            self[name][...] = value

    def call(
        self, function: Callable[..., Any], values: Sequence[Any], describe_row: Callable[[int], str]
    ) -> list[Any]:
        """Call the function once for each row, and return what it returned; refuse a guard or an input that changed."""
        slot, before, answers = self._slot, self._memory.copy(), []
        for row in self._memory:
            slot.memory[:] = row
            answers.append(function(*values))
            row[:] = slot.memory
        before ^= self._memory
        before &= slot.fixed
        if before.any():  # Bits changed that are fixed.
            number, half = np.argwhere(before.view(np.int32))[0].tolist()
            raise ContractError(f"{describe_row(number)}: wrote to {slot.describe(half)}; needed no write there")
        return answers
