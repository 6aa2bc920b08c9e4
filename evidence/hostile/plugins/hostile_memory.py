"""Plugins that take memory. They run under the limit of their runner only."""

import ctypes
import itertools
from typing import Any

import numpy as np
from hostile_kit import before

_leak: list[Any] = []
_calls = itertools.count(1)
MEGABYTE = 2**20


long_list = before("residual")(lambda: _leak.append([0] * (100 * 1024 * MEGABYTE // 8)), "Make a list of 100 GB.")
large_array = before("residual")(
    lambda: _leak.append(np.ones(100 * 1024 * MEGABYTE // 8)), "Make a numpy array of 100 GB and write to it."
)
slow_leak = before("residual")(lambda: _leak.append(np.ones(200 * MEGABYTE // 8)), "Keep 200 MB more at each call.")


@before("residual")
def leak_in_c() -> None:
    """Take 200 MB more at each call by malloc, and write to a null pointer when there is no more."""
    library = ctypes.CDLL(None)
    library.malloc.restype = ctypes.c_void_p
    address = library.malloc(ctypes.c_size_t(200 * MEGABYTE))
    ctypes.memset(address or 0, 1, 200 * MEGABYTE)


large_in_make = before("make")(
    lambda: _leak.append(np.ones(100 * 1024 * MEGABYTE // 8)), "Make a numpy array of 100 GB in the factory."
)


@before("residual")
def take_all_and_swallow() -> None:
    """Take all memory in small pieces, ignore the error, and go on without any left."""
    if next(_calls) == 1:
        try:
            while True:
                _leak.append(np.ones(50 * MEGABYTE // 8))
        except MemoryError:
            try:
                while True:
                    _leak.append(bytearray(MEGABYTE // 64))
            except MemoryError:
                pass
