"""Ctrl-C and SIGTERM before the progress of a run is shown. This file imports nothing that takes long."""

import os
import signal
import threading
from types import FrameType

_works = threading.Event()


def watch_signals() -> None:
    """Let Ctrl-C or SIGTERM end this process at once, as long as modules are imported: there Python may drop one.

    Until then a command has written nothing, and what it has started ends with it.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)


def begin_work() -> None:
    """Let a signal interrupt this process from now on, which then says what was done."""
    _works.set()


def _stop(number: int, frame: FrameType | None) -> None:
    if _works.is_set():
        raise KeyboardInterrupt(number)
    os.write(2, b"contactverif: stopped, and nothing was judged\n")
    os._exit(128 + number)
