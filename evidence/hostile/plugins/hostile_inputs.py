"""Plugins that change what they were given, remember what they were asked, or answer by what is no argument."""

import ctypes
import itertools
import os
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from hostile_kit import EITHER, IMPURE, LIKE_NTS, Factory, answers, instead

_calls = itertools.count(1)
_last: list[Any] = []


def _overwrites(choose: Callable[..., Any], summary: str) -> Factory:
    """Make a plugin that writes over the first entry of an array after the right answer, whatever its flags say."""

    def overwrite(right: Any, *arguments: Any) -> Any:
        answer, array = right(), choose(*arguments)
        number = np.full(1, 7.5 if array.dtype.kind == "f" else 0, array.dtype)
        ctypes.memmove(array.ctypes.data, number.ctypes.data, number.nbytes)
        return answer

    return instead("residual", ends=EITHER)(overwrite, summary)


write_to_z = _overwrites(lambda interface, pairing, z: z, "Write into the read-only state after the right answer.")
write_to_nodes = _overwrites(
    lambda interface, *_: interface.nodes, "Write into the read-only nodes of the interface after the right answer."
)
write_to_segments = _overwrites(
    lambda interface, *_: interface.slave.segments,
    "Write into the read-only segments of the interface after the right answer.",
)
write_to_pairing = _overwrites(
    lambda interface, pairing, z: pairing["master"], "Write into the read-only pairing after the right answer."
)


@instead("residual", ends=EITHER)
def exchange_the_nodes(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Exchange the nodes of the frozen interface by others, after the right answer."""
    answer = right()
    object.__setattr__(interface, "nodes", 2 * interface.nodes)
    return answer


@instead("residual")
def set_flags(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Make the read-only state writeable, and write to it."""
    z.setflags(write=True)
    z[:] = 0
    return right()


@instead("residual", ends=IMPURE)
def add_the_last_answer(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Add a trace of the last answer of the same shape."""
    answer = right()
    last = _last[0] if _last and _last[0].shape == answer.shape else 0 * answer
    _last[:] = [answer]
    return answer + 1e-9 * last


by_count = answers("residual", ends=IMPURE)(
    lambda answer: answer * (1 + 1e-9 * next(_calls)), "Answer by the number of calls."
)
by_process = answers("residual", ends=IMPURE)(
    lambda answer: answer * (1 + 1e-12 * os.getpid()), "Answer by the number of the process."
)
by_hash_seed = answers("residual", ends=IMPURE)(
    lambda answer: answer * (1 + 1e-6 * (hash("seed") % 1001)),
    "Answer by the seed of Python's hashes, as the order of a set of words does.",
)
by_threads = answers("residual", ends=LIKE_NTS)(
    lambda answer: answer * (1 + 1e-6 * (int(os.environ.get("OMP_NUM_THREADS", "2")) - 1)),
    "Answer by the number of threads that the environment allows, which is one.",
)
by_time = answers("residual", ends=IMPURE)(
    lambda answer: answer * (1 + 1e-9 * (time.perf_counter_ns() % 1_000_003)), "Answer by the clock."
)
by_chance = answers("residual", ends=IMPURE)(
    lambda answer: answer * (1 + 1e-9 * np.random.default_rng().random()), "Answer by chance."
)
by_address = instead("residual", ends=EITHER)(
    lambda right, interface, pairing, z: right() * (1 + 1e-9 * (z.ctypes.data // 64 % 1009)),
    "Answer by the address of the state in memory.",
)


@instead("residual", ends=IMPURE)
def from_another_thread(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """Compute in a thread, and answer what the thread of the last call has computed."""
    answer = right()
    thread = threading.Thread(target=lambda: _last.append(1.0))
    thread.start()
    thread.join()
    return answer * (1 + 1e-9 * len(_last))
