"""One thread for linear algebra while a run makes cases and judges them.

The matrices of a case are small, and threads of BLAS that share one of them wait for each other longer than they
compute. Workers share the cores already. One thread also gives the same last bit on any number of cores.

Rule for the next editor: what makes a case runs on one thread, too. Exact solutions are solved once and remembered, so
another last bit there would be another last bit in every number that is compared with them.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from importlib import import_module
from typing import Any

from threadpoolctl import ThreadpoolController


@cache
def _controller() -> Any:
    """Return what knows the libraries that are loaded; to look for them takes some milliseconds."""
    import_module("scipy.linalg")  # It brings a BLAS of its own, which would not be found later.
    return ThreadpoolController()


def one_thread() -> AbstractContextManager[Any]:
    """Return a context in which numpy and scipy compute on one thread."""
    context: AbstractContextManager[Any] = _controller().limit(limits=1, user_api="blas")
    return context
