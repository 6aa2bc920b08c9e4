"""Work on parts of a range in threads, with the same bits as in one.

A kernel that takes a range writes only what belongs to it, each number in the order of the whole loop. Plain threads
are used, not numba's `prange`: no kernel is compiled a second time, a process may be forked, two Python threads may
call at once, and NUMBA_NUM_THREADS sets no limit. Nothing is kept between calls.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from threading import Thread

LEAST_PART = 2000  # A part with fewer items takes no longer than starting a thread.


def split_range(n_items: int, threads: int) -> list[tuple[int, int]]:
    """Return the parts (begin, end) of the range of n_items for so many threads; few items are one part."""
    n_parts = max(1, min(threads, n_items // LEAST_PART))
    ends = [n_items * part // n_parts for part in range(n_parts + 1)]
    return list(pairwise(ends))


def run_in_threads(calls: list[Callable[[], None]]) -> None:
    """Run calls side by side, the last one in the calling thread, and return when all have ended."""
    if len(calls) == 1:
        calls[0]()
        return
    errors: dict[int, BaseException] = {}

    def run(number: int) -> None:
        try:
            calls[number]()
        except BaseException as error:
            errors[number] = error

    threads = [Thread(target=run, args=(number,)) for number in range(len(calls) - 1)]
    for thread in threads:
        thread.start()
    run(len(calls) - 1)
    for thread in threads:
        thread.join()
    for _, error in sorted(errors.items()):
        raise error
