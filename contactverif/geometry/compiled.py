"""The one place that knows the compiler: a typed `numba.njit`, so that mypy --strict still checks the kernels.

Kernels are compiled at their first call and cached beside their source. `python_function` gives the Python function
back, for coverage and for tests that change a line of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def compile_kernel(function: Kernel) -> Kernel:
    """Compile a function for the types of each call; division by zero gives infinity or NaN, as in numpy."""
    return cast(Kernel, numba.njit(cache=True, error_model="numpy")(function))


def python_function(function: Kernel) -> Kernel:
    """Return the Python function behind a compiled one, or the function itself if it is not compiled."""
    return cast(Kernel, getattr(function, "py_func", function))
