"""The one place that knows the compiler: a typed `numba.njit`, so that mypy --strict still checks the kernels.

Kernels are compiled at their first call and cached beside their source (`kernel_store`). `python_function` gives the
Python function back, for coverage and for tests that change a line of it. Where the environment variable
NUMBA_DISABLE_JIT is 1 nothing is compiled: kernels are hundreds of times slower, and take every type that numpy has. A
formulation then computes in ``numpy.longdouble`` if its constants have the precision of its state, too
(`match_precision`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
import numpy as np

from contactverif.contract.arrays import Array, FloatArray
from contactverif.kernel_store.checked_files import compile_stored

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

ARE_KERNELS_COMPILED = not cast(Any, numba.config).DISABLE_JIT
_IS_LONGER = np.finfo(np.longdouble).nmant > np.finfo(np.float64).nmant
# Whether a formulation made of kernels can promise the trait `takes_longdouble` in this process.
TAKES_LONGDOUBLE = not ARE_KERNELS_COMPILED and bool(_IS_LONGER)


def compile_kernel(function: Kernel) -> Kernel:
    """Compile a function for the types of each call; division by zero gives infinity or NaN, as in numpy."""
    return cast(Kernel, compile_stored(function, nogil=True, error_model="numpy"))


def compile_inline(function: Kernel) -> Kernel:
    """Compile a function as `compile_kernel` does, and put its code wherever a kernel calls it.

    A call that hands on an array costs two atomic operations. Use this for what a loop calls for each point.
    """
    return cast(Kernel, compile_stored(function, error_model="numpy", forceinline=True))


def python_function(function: Kernel) -> Kernel:
    """Return the Python function behind a compiled one, or the function itself if it is not compiled."""
    return cast(Kernel, getattr(function, "py_func", function))


def match_precision(z: Array, *constants: FloatArray) -> tuple[FloatArray, ...]:
    """Return arrays of constants in the precision of a state, so that no kernel rounds to float64 on its way.

    Compiled kernels know float64 and complex128 alone; they get the constants as they are.

    Parameters
    ----------
    z : Array, shape (..., n_unknowns)
        States: real, complex, or in an uncompiled process ``numpy.longdouble``.
    *constants : FloatArray, shape (...)
        Arrays such as reference positions or quadrature weights.
    """
    if ARE_KERNELS_COMPILED:
        return constants
    return tuple(constant.astype(z.real.dtype, copy=False) for constant in constants)
