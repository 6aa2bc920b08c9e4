"""One thread of linear algebra, for all that makes cases and judges them."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache
from importlib import import_module
from typing import Any

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[Any]:
    """Return a context in which numpy and scipy compute on one thread, to judge cases and to make them.

    The matrices of a case are small: threads of BLAS that share one wait for each other longer than they compute. One
    thread also gives the same last bit on any number of cores. Exact solutions are solved once and remembered, so what
    makes a case needs one thread, too.
    """
    context: AbstractContextManager[Any] = _blas().limit(limits=1, user_api="blas")
    return context


@cache
def _blas() -> Any:
    """Return what knows the libraries that are loaded; to look for them takes some milliseconds."""
    import_module("scipy.linalg")  # It brings a BLAS of its own, which would not be found later.
    return ThreadpoolController()
