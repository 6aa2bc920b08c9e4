"""The one place that knows the compiler: a typed `numba.njit`, whose machine code is kept in files that are checked.

Kernels are compiled at their first call and stored beside their source or in the user's cache. A kernel writes to
arrays that Python made, and counts no references to them: so it has half the code, and a call inside it is free. Where
the environment variable NUMBA_DISABLE_JIT is 1 nothing is compiled: kernels are hundreds of times slower, and take
every type that numpy has. A formulation then computes in ``numpy.longdouble`` if its constants have the precision of
its state, too (`match_precision`).

numba trusts its files. A truncated one raises an error where a kernel is called, as if the plugin had failed, and a
changed one may crash the process. Here each file ends with a digest. A file whose digest is wrong counts as absent: the
kernel is compiled again and the file is replaced. A store that cannot be written is no error either. numba compiles a
kernel again if its own file has changed. The code of all that it calls is stored with it, and so are the numbers of
modules that it reads; a change of these counts here, too.

A process that has another folder for what it compiles (NUMBA_CACHE_DIR) reads the usual stores, too, and leaves them as
they are. So a plugin in a box, which may write to a folder of its own alone, compiles what no store holds.

Rule for the next editor: only this file knows the inside of numba's cache. Where a version of numba has another inside,
kernels are stored as numba does it, unchecked.
"""

import hashlib
import pickle
from collections.abc import Callable
from functools import cached_property
from numbers import Number
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core import caching
from numba.core.caching import IndexDataCacheFile
from numba.core.registry import CPUDispatcher

from contactverif.contract.arrays import Array, FloatArray

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}
_PART_OPTIONS: dict[str, Any] = {**_OPTIONS, "no_cpython_wrapper": True, "_nrt": False}
_DIGEST = 32  # Bytes at the end of a file.
Kernel = TypeVar("Kernel", bound=Callable[..., Any])

ARE_KERNELS_COMPILED = not cast(Any, numba.config).DISABLE_JIT
# Whether a formulation made of kernels can promise the trait `takes_longdouble` in this process.
TAKES_LONGDOUBLE = not ARE_KERNELS_COMPILED and bool(np.finfo(np.longdouble).nmant > np.finfo(np.float64).nmant)


def compile_kernel(function: Kernel) -> Kernel:
    """Compile a function that Python calls and that makes no array; division by zero gives infinity or NaN."""
    return cast(Kernel, compile_stored(function, nogil=True, _nrt=False, **_OPTIONS))


def compile_maker(function: Kernel) -> Kernel:
    """Compile a function that Python or another one calls, and that makes arrays."""
    return cast(Kernel, compile_stored(function, nogil=True, _nrt=True, **_OPTIONS))


def compile_part(function: Kernel) -> Kernel:
    """Compile a function that kernels call, which makes no array; its code is stored with the kernel's."""
    return cast(Kernel, _guard(numba.njit(**_PART_OPTIONS)(function)))


def compile_inline(function: Kernel) -> Kernel:
    """Compile a function as `compile_part` does, and put its code wherever a kernel calls it."""
    return cast(Kernel, _guard(numba.njit(forceinline=True, **_PART_OPTIONS)(function)))


class _Part(CPUDispatcher):
    """A function without a wrapper for Python; numba would crash the process where Python calls one."""

    def __call__(self, *arguments: Any) -> Any:
        """Call the function through a kernel that is made for it at the first call."""
        if not hasattr(self, "_entry"):
            self._entry = numba.njit(**_OPTIONS)(lambda *values: self(*values))
        return self._entry(*arguments)


def _guard(part: Any) -> Any:
    if isinstance(part, CPUDispatcher):  # not where nothing is compiled
        part.__class__ = _Part
    return part


def constant(value: int) -> int:
    """Return an integer for a constant of a module that numba takes for no literal.

    A function that is called with a literal, and in a loop with other integers, is compiled for both.
    """
    return cast(int, np.int64(value))


def match_precision(z: Array, *constants: FloatArray) -> tuple[FloatArray, ...]:
    """Return constants in the precision of a state, real, complex or longdouble, so that no kernel rounds them.

    Compiled kernels know float64 and complex128 alone; they get the constants as they are.
    """
    if ARE_KERNELS_COMPILED:
        return constants
    return tuple(constant.astype(z.real.dtype, copy=False) for constant in constants)


class CheckedFiles(IndexDataCacheFile):
    """The files of one kernel: an index and a file for each signature, each with its digest at the end."""

    function: Callable[..., Any]  # The Python function of the kernel.
    usual: "tuple[CheckedFiles, ...]" = ()  # The files in the stores that are read if a signature is not in this one.

    @cached_property
    def stamp(self) -> tuple[Any, ...]:
        """The files and numbers that a kernel is compiled from. At its first call all that it calls is there."""
        parts: set[Any] = set()
        _add_parts(parts, self.function)
        return self._source_stamp, *sorted(parts)

    def load(self, key: Any) -> Any:
        """Return what is stored for a signature; None if there is nothing, or it is damaged."""
        name = self._load_index().get(key)
        stored = None if name is None else _unpickle(Path(self._data_path(name)))  # type: ignore[no-untyped-call]
        if stored is not None:
            return stored
        return next((there for files in self.usual if (there := files.load(key)) is not None), None)

    def save(self, key: Any, data: Any) -> None:
        """Store what was compiled for a signature; a store that cannot be written stays as it is."""
        try:
            super().save(key, data)  # type: ignore[no-untyped-call]
        except OSError:
            return

    def _load_index(self) -> dict[Any, str]:
        """Return {signature: name of its file}; nothing if the index is damaged or of another source."""
        index = _unpickle(Path(self._index_path))
        is_current = isinstance(index, tuple) and index[:2] == (self._version, self.stamp)
        return index[2] if is_current else {}

    def _save_index(self, overloads: dict[Any, str]) -> None:
        self._write(self._index_path, pickle.dumps((self._version, self.stamp, overloads)))

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), self._dump(data))  # type: ignore[no-untyped-call]

    def _write(self, path: str, content: bytes) -> None:
        with self._open_for_write(path) as file:
            file.write(content + hashlib.sha256(content).digest())


def compile_stored(function: Callable[..., Any], **options: Any) -> Any:
    """Return the function compiled by numba, with its machine code in a store that is checked."""
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # No folder can be written: neither that of the source nor the user's cache.
        return numba.njit(**options)(function)
    files: Any = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
    if type(files) is IndexDataCacheFile:
        files.__class__ = CheckedFiles
        assert isinstance(files, CheckedFiles)
        files.usual = _usual_files(function, files) if cast(Any, numba.config).CACHE_DIR else ()
        for each in (files, *files.usual):
            each.function = function
    return dispatcher


def _usual_files(function: Callable[..., Any], files: Any) -> tuple[CheckedFiles, ...]:
    base, stamp = files._index_name.removesuffix(".nbi"), files._source_stamp
    names = ("InTreeCacheLocator", "UserWideCacheLocator")  # Old versions of numba have `_` before them.
    kinds = [getattr(caching, name, None) or getattr(caching, f"_{name}") for name in names]
    locators = (kind(function, function.__code__.co_filename) for kind in kinds)
    folders = [locator.get_cache_path() for locator in locators]
    return tuple(CheckedFiles(folder, base, stamp) for folder in folders)  # type: ignore[no-untyped-call]


def _add_parts(parts: set[Any], function: Callable[..., Any]) -> None:
    """Add the names of all functions that one calls, with digests of their files, and the numbers that it reads."""
    code, names = function.__code__, function.__globals__
    file = Path(code.co_filename)
    digest = hashlib.sha256(file.read_bytes()).hexdigest() if file.exists() else ""
    part = f"{function.__module__}.{function.__qualname__}", digest
    if part in parts:
        return
    parts.add(part)
    for name in code.co_names:
        value = names.get(name)
        if isinstance(value, CPUDispatcher):
            _add_parts(parts, value.py_func)
        elif isinstance(value, Number):
            parts.add((f"{part[0]}: {name}", repr(value)))


def _unpickle(path: Path) -> Any:
    """Return what a file holds; None if it is absent, cannot be read, or its digest is wrong."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    if hashlib.sha256(content[:-_DIGEST]).digest() != content[-_DIGEST:]:
        return None
    try:
        return pickle.loads(content[:-_DIGEST])
    except Exception:  # What was stored refers to a module that is not there any more.
        return None
