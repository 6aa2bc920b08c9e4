"""Plugins that never answer."""

from __future__ import annotations

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


@before("residual")
def sleep() -> None:
    """Sleep."""
    time.sleep(LONG)


@before("make")
def sleep_in_make() -> None:
    """Sleep in the factory."""
    time.sleep(LONG)


@before("traits")
def sleep_in_traits() -> None:
    """Sleep when it is asked for its promises."""
    time.sleep(LONG)


@before("pair")
def sleep_in_pair() -> None:
    """Sleep in the search."""
    time.sleep(LONG)


@before("residual")
def sleep_sometimes() -> None:
    """Sleep at every fifth call."""
    if next(_calls) % 5 == 0:
        time.sleep(LONG)


@before("residual")
def loop() -> None:
    """Compute for ever in Python."""
    end = time.monotonic() + LONG
    while time.monotonic() < end:
        pass


@before("residual")
def loop_in_c() -> None:
    """Compute for ever in C without giving the lock of the interpreter away, so that no Python signal handler runs."""
    sum(range(10**11))


@before("residual")
def match_for_ever() -> None:
    """Match a regular expression that backtracks exponentially."""
    re.match(r"(a+)+$", "a" * 60 + "b")


@before("residual")
def sleep_with_the_lock() -> None:
    """Sleep while holding the lock of the interpreter."""
    ctypes.PyDLL(None).sleep(int(LONG))


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


@before("residual")
def stop_itself() -> None:
    """Send SIGSTOP to the own process, as Ctrl-Z does."""
    os.kill(os.getpid(), signal.SIGSTOP)


@before("residual")
def wait_for_input() -> None:
    """Wait for a line from standard input."""
    if not sys.stdin.readline():
        raise RuntimeError("nobody types here")


@before("residual", ends=LIKE_NTS)
def sleep_at_exit() -> None:
    """Answer rightly, and sleep when Python ends."""
    atexit.register(time.sleep, LONG)


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
