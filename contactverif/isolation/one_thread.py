"""The environment in which libraries compute on one thread, for every process that may hold a plugin.

Rule for the next editor: a library reads its variable once, when it is loaded. So a process must find the variables at
its start. TBB alone has no variable: it takes as many threads as the process has cores when it is first used, see
`contactverif.isolation.one_core`.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

# OpenMP; the libraries for linear algebra, of which some have threads of their own; and numba, whose layers for threads
# are OpenMP, TBB and one of its own.
ONE_THREAD = {
    **dict.fromkeys(("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "NUMEXPR_NUM_THREADS"), "1"),
    **dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"),
}


@contextmanager
def one_thread_for_children() -> Iterator[None]:
    """Open a block in which processes that this one starts find the variables; behind it all is as before."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
