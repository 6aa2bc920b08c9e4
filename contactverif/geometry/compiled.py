"""The one place that knows the compiler: a typed `numba.njit`, so that mypy --strict still checks the kernels.

Kernels are compiled at their first call and cached beside their source (`kernel_store`). A kernel writes to arrays that
Python made, and counts no references to them: so it has half the code, and a call inside it is free. `python_function`
gives the Python function back, for coverage and for tests that change a line of it. Where the environment variable
NUMBA_DISABLE_JIT is 1 nothing is compiled: kernels are hundreds of times slower, and take every type that numpy has. A
formulation then computes in ``numpy.longdouble`` if its constants have the precision of its state, too
(`match_precision`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np
from numba.core.registry import CPUDispatcher

from contactverif.contract.arrays import Array, FloatArray
from contactverif.kernel_store.checked_files import compile_stored

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "no_cfunc_wrapper": True}
_PART_OPTIONS: dict[str, Any] = {**_OPTIONS, "no_cpython_wrapper": True, "_nrt": False}
Kernel = TypeVar("Kernel", bound=Callable[..., Any])

ARE_KERNELS_COMPILED = not cast(Any, numba.config).DISABLE_JIT
_IS_LONGER = np.finfo(np.longdouble).nmant > np.finfo(np.float64).nmant
# Whether a formulation made of kernels can promise the trait `takes_longdouble` in this process.
TAKES_LONGDOUBLE = not ARE_KERNELS_COMPILED and bool(_IS_LONGER)


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
    """Return a compiled function as one that Python may call."""
    if isinstance(part, CPUDispatcher):  # not where nothing is compiled
        part.__class__ = _Part
    return part


def constant(value: int) -> int:
    """Return an integer for a constant of a module that numba takes for no literal.

    A function that is called with a literal, and in a loop with other integers, is compiled for both.
    """
    return cast(int, np.int64(value))


def python_function(function: Kernel) -> Kernel:
    """Return the Python function behind a compiled one, or the function itself if it is not compiled."""
    return cast(Kernel, getattr(function, "py_func", function))


def match_precision(z: Array, *constants: FloatArray) -> tuple[FloatArray, ...]:
    """Return constants in the precision of a state, real, complex or longdouble, so that no kernel rounds them.

    Compiled kernels know float64 and complex128 alone; they get the constants as they are.
    """
    if ARE_KERNELS_COMPILED:
        return constants
    return tuple(constant.astype(z.real.dtype, copy=False) for constant in constants)
