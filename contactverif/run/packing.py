"""Pieces of work as bytes, so that another process can do them.

Rules for the next editor: what comes out is what went in, bit by bit. A read-only array stays read-only, or a plugin
could change in a worker what it cannot change in the parent. A registered property travels as its id.
"""

from __future__ import annotations

import io
import pickle
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from contactverif.contract.arrays import freeze
from contactverif.contract.case import Case
from contactverif.contract.property import Property
from contactverif.run.registry import installed_properties, load_property


class CaseChunk:
    """A few cases that travel together. The bytes are made once, and read when somebody asks for the cases.

    Parameters
    ----------
    cases : Sequence[Case]
        The cases.
    """

    __slots__ = ("_cases", "_packed", "count")

    def __init__(self, cases: Sequence[Case]) -> None:
        self._cases: tuple[Case, ...] | None = tuple(cases)
        self._packed: bytes | None = None
        self.count = len(cases)

    @property
    def cases(self) -> tuple[Case, ...]:
        """The cases; of a chunk that came from another process they are made anew at every call."""
        if self._cases is not None:
            return self._cases
        assert self._packed is not None
        cases: tuple[Case, ...] = unpack(self._packed)
        return cases

    def keep(self) -> None:
        """Keep the cases in memory, for several rows that hold them."""
        self._cases = self.cases

    def __getstate__(self) -> tuple[bytes, int]:
        return pack(self._cases) if self._packed is None else self._packed, self.count

    def __setstate__(self, state: tuple[bytes, int]) -> None:
        self._cases = None
        self._packed, self.count = state


def pack(item: Any) -> bytes:
    """Return an object as bytes.

    Raises
    ------
    Exception
        If it cannot be pickled, such as a class that a function defines.
    """
    buffer = io.BytesIO()
    _Pickler(buffer, protocol=pickle.HIGHEST_PROTOCOL).dump(item)
    return buffer.getvalue()


def unpack(data: bytes) -> Any:
    """Return the object that `pack` made bytes of.

    Raises
    ------
    Exception
        If this process cannot import what the object refers to.
    """
    return pickle.loads(data)


class _Pickler(pickle.Pickler):
    def reducer_override(self, item: Any) -> Any:
        if type(item) is np.ndarray and not item.flags.writeable and not item.dtype.hasobject:
            return _read_only, (item.tobytes(), item.dtype.str, item.shape)
        if isinstance(item, Property) and _find_registered(item.id) is item:
            return _find_registered, (item.id,)
        return NotImplemented


def _read_only(data: bytes, dtype: str, shape: tuple[int, ...]) -> np.ndarray[Any, Any]:
    if not data:
        return freeze(np.empty(shape, dtype), np.dtype(dtype).type)
    return np.frombuffer(data, dtype=dtype).reshape(shape)


@cache
def _find_registered(property_id: str) -> Any:
    """Return the installed property of that id, or None."""
    installed = _read_installed()
    return load_property(property_id, installed) if property_id in installed else None


_read_installed = cache(installed_properties)
