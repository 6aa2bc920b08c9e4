"""The memory that a library gets for one call: all arguments at fixed addresses, with guard values around each array.

A sweep over the elements keeps a row of memory for each. It copies the row to the slot, calls, and copies it back.
After the sweep all guards and inputs of all rows are compared at once, so a wrong write has an argument and an element.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from contactverif.contract.arrays import Array
from contactverif.contract.errors import ContractError

_GUARD = np.uint64(0x7FF8C0DEC0DEC0DE)  # Not a number, so what reads it shows.
_LEAST_GUARD = 8  # Words around an array.
_DTYPES: dict[str, np.dtype[Any]] = {"real": np.dtype(np.float64), "integer": np.dtype(np.int32)}


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


class GuardedSlot:
    """The memory of one call. Scalars share their guards, an array has its own.

    A guard is as many words of eight bytes as wanted at least, such as the size of a column of the largest array.
    """

    def __init__(self, arguments: Sequence[Argument], guard: int = _LEAST_GUARD) -> None:
        self._arguments = {argument.name: argument for argument in arguments}
        self.spans: dict[str, slice] = {}  # The halves of words in a row that the values of each argument take.
        guard, place, is_behind_scalar = 2 * max(guard, _LEAST_GUARD), 0, False
        for argument in sorted(arguments, key=lambda argument: bool(argument.shape)):
            if argument.shape or not is_behind_scalar:
                place += guard
            is_behind_scalar = not argument.shape
            n_halves = argument.size * _DTYPES[argument.kind].itemsize // 4
            self.spans[argument.name] = slice(place, place + n_halves)
            place += n_halves + n_halves % 2
        self._empty = np.full((place + guard) // 2, _GUARD)
        for argument in arguments:
            self._empty.view(np.int32)[self.spans[argument.name]] = 0
        self._memory = self._empty.copy()
        self.addresses = {name: self._memory.ctypes.data + 4 * span.start for name, span in self.spans.items()}
        self._fixed = np.full_like(self._empty, ~np.uint64(0))  # The bits that a call must not change.
        for argument in arguments:
            if not argument.is_input:
                self._fixed.view(np.int32)[self.spans[argument.name]] = 0

    def preset(self, values: dict[str, Any]) -> None:
        """Set arguments that are the same in all calls."""
        for name, value in values.items():
            argument = self._arguments[name]
            view: Array = self._empty.view(np.int32)[self.spans[argument.name]]
            (view if argument.kind == "integer" else view.view(np.float64))[...] = value

    def rows(self, n_rows: int) -> SlotRows:
        """Return the memory of so many calls, zero but for the guards."""
        return SlotRows(self, np.tile(self._empty, (n_rows, 1)), self._arguments)

    def sweep(self, rows: NDArray[np.uint64], function: Callable[..., Any], values: Sequence[Any]) -> list[Any]:
        """Call the function once for each row, and return what it returned."""
        memory, answers = self._memory, []
        for row in rows:
            memory[:] = row
            answers.append(function(*values))
            row[:] = memory
        return answers

    def find_write(self, before: NDArray[np.uint64], after: NDArray[np.uint64]) -> tuple[int, str] | None:
        """Return the first row with a guard or an input that changed, and what was written there; None if none has."""
        changed = before ^ after
        changed &= self._fixed
        if not changed.any():
            return None
        row, half = np.argwhere(changed.view(np.int32))[0]
        return int(row), self._describe(int(half))

    def _describe(self, half: int) -> str:
        """Return what lies at a half of a word: an input, or what is before or behind an array."""
        name, span = min(self.spans.items(), key=lambda item: max(item[1].start - half, half - item[1].stop + 1, 0))
        argument = self._arguments[name]
        number = (half - span.start) * 4 // _DTYPES[argument.kind].itemsize + 1
        if span.start <= half < span.stop:
            return f"the input {name}{f', number {number} of {argument.size}' if argument.shape else ''}"
        if half < span.start:
            return f"the place before {name}"
        size = f", {' × '.join(map(str, argument.shape))}" if len(argument.shape) > 1 else ""
        return f"number {number} of {name}, which has {argument.size}{size}"


class SlotRows:
    """The memory of a sweep: for each element a row, of which the arguments are views."""

    def __init__(self, slot: GuardedSlot, memory: NDArray[np.uint64], arguments: dict[str, Argument]) -> None:
        self._slot, self._memory, self._arguments = slot, memory, arguments

    def __getitem__(self, name: str) -> Array:
        """Return the values (n_rows, size) of an argument, which may be written."""
        argument = self._arguments[name]
        view: Array = self._memory.view(np.int32)[:, self._slot.spans[name]]
        return view if argument.kind == "integer" else view.view(np.float64)

    def fill(self, values: dict[str, Any]) -> None:
        """Write the values of arguments: scalars, arrays (size,) for all rows, or arrays (n_rows, size)."""
        for name, value in values.items():
            self[name][...] = value

    def call(
        self, function: Callable[..., Any], values: Sequence[Any], describe_row: Callable[[int], str]
    ) -> list[Any]:
        """Call the function once for each row, and return what it returned; refuse a guard or an input that changed."""
        before = self._memory.copy()
        answers = self._slot.sweep(self._memory, function, values)
        if (write := self._slot.find_write(before, self._memory)) is not None:
            row, place = write
            raise ContractError(f"{describe_row(row)}: wrote to {place}; needed no write there")
        return answers
