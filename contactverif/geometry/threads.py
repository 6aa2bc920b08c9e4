"""Share work among threads, with the same bits as in one: parts of a range, and couplings whose rows are shared.

A kernel that takes a range writes only what belongs to it, each number in the order of the whole loop. Plain threads
are used, not numba's `prange`: no kernel is compiled a second time, a process may be forked, two Python threads may
call at once, and NUMBA_NUM_THREADS sets no limit. Nothing is kept between calls.
"""

from collections.abc import Callable
from itertools import pairwise
from threading import Thread
from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_maker
from contactverif.contract.arrays import BoolArray, IntArray
from contactverif.geometry.block_rows import NO_NODE, NumberArray

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


class Share(NamedTuple):
    """The share of one thread in the work on all couplings, in this order.

    A part begins with its own couplings, from begin to end. Then come those of later parts that touch its rows. So each
    row gets its sums from one thread, in the order of the couplings.
    """

    owner: NumberArray  # (n_numbers,), the part that writes the rows of each node or multiplier
    part: int
    begin: int
    end: int
    others: IntArray  # (n_others,), ascending


def share_couplings(n_numbers: int, nodes: NumberArray, starts: IntArray, parts: list[tuple[int, int]]) -> list[Share]:
    """Divide couplings among threads by `parts`, (begin, end) each; a row belongs to the first part that touches it."""
    if len(parts) == 1:
        return [Share(np.zeros(n_numbers, dtype=np.int32), 0, *parts[0], np.empty(0, dtype=np.int64))]
    begins = np.array([begin for begin, _ in parts] + [parts[-1][1]])
    owner, touches = _divide_rows(n_numbers, nodes, starts, begins)
    return [Share(owner, part, *parts[part], np.flatnonzero(touches[part])) for part in range(len(parts))]


@compile_maker
def _divide_rows(
    n_numbers: int, nodes: NumberArray, starts: IntArray, begins: IntArray
) -> tuple[NumberArray, BoolArray]:
    """Return the owner of each row, and whether a coupling (n_parts, n_couplings) of a later part touches its rows."""
    owner = np.full(n_numbers, NO_NODE, dtype=np.int32)
    touches = np.zeros((len(begins) - 1, len(starts) - 1), dtype=np.bool_)
    for part in range(len(begins) - 1):
        for coupling in range(begins[part], begins[part + 1]):
            for place in range(starts[coupling], starts[coupling + 1]):
                number = nodes[place]
                if owner[number] == NO_NODE:
                    owner[number] = part
                elif owner[number] != part:
                    touches[owner[number], coupling] = True
    return owner, touches
