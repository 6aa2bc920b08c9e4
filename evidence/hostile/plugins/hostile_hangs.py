"""Plugins that never answer."""

import atexit
import ctypes
import itertools
import os
import re
import signal
import sys
import threading
import time
from typing import Any

from hostile_kit import LIKE_NTS, LONG, answers, before

_calls = itertools.count(1)


sleep = before("residual")(lambda: time.sleep(LONG), "Sleep.")
sleep_in_make = before("make")(lambda: time.sleep(LONG), "Sleep in the factory.")
sleep_in_traits = before("traits")(lambda: time.sleep(LONG), "Sleep when it is asked for its promises.")
sleep_in_pair = before("pair")(lambda: time.sleep(LONG), "Sleep in the search.")


@before("residual")
def sleep_sometimes() -> None:
    """Sleep at every third call."""
    if next(_calls) % 3 == 0:
        time.sleep(LONG)


@before("residual")
def loop() -> None:
    """Compute for ever in Python."""
    end = time.monotonic() + LONG
    while time.monotonic() < end:
        pass


loop_in_c = before("residual")(
    lambda: sum(range(10**11)),
    "Compute for ever in C without giving the lock of the interpreter away, so that no Python signal handler runs.",
)
match_for_ever = before("residual")(
    lambda: re.match(r"(a+)+$", "a" * 60 + "b"), "Match a regular expression that backtracks exponentially."
)
sleep_with_the_lock = before("residual")(
    lambda: ctypes.PyDLL(None).sleep(int(LONG)), "Sleep while holding the lock of the interpreter."
)


@before("residual")
def wait_for_a_lock() -> None:
    """Wait for a lock that the plugin itself has taken."""
    lock = threading.Lock()
    lock.acquire()
    lock.acquire(timeout=LONG)


@before("residual")
def sleep_without_signals() -> None:
    """Block all signals that can be blocked, and sleep."""
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    end = time.monotonic() + LONG
    while time.monotonic() < end:
        time.sleep(1.0)


stop_itself = before("residual")(
    lambda: os.kill(os.getpid(), signal.SIGSTOP), "Send SIGSTOP to the own process, as Ctrl-Z does."
)


@before("residual")
def wait_for_input() -> None:
    """Wait for a line from standard input."""
    if not sys.stdin.readline():
        raise RuntimeError("nobody types here")


sleep_at_exit = before("residual", ends=LIKE_NTS)(
    lambda: atexit.register(time.sleep, LONG), "Answer rightly, and sleep when Python ends."
)


@answers("residual", ends=LIKE_NTS)
def sleep_when_forgotten(answer: Any) -> Any:
    """Answer rightly, with an object in a circle that sleeps when it is collected."""

    class Sleeper:
        def __del__(self) -> None:
            time.sleep(LONG)

    if next(_calls) == 1:
        sleeper = Sleeper()
        sleeper.__dict__["itself"] = sleeper
    return answer
