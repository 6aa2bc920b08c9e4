"""The command line: one file a command, and the tables that a terminal shows. Nothing else in the house imports it."""

import os
import signal
import sys
import threading
from types import FrameType

_works = threading.Event()


def main() -> None:
    """Run the command `contactverif`; Ctrl-C or SIGTERM is one line, also while modules are imported.

    Python may drop an interrupt that arrives there. So until a command works, a signal ends this process at once. It
    has written nothing, and what it has started ends with it.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)
    try:
        from contactverif.cli import app

        app.main()
    except KeyboardInterrupt:
        sys.stderr.write("contactverif: stopped\n")
        sys.exit(130)


def begin_work() -> None:
    """Let a signal interrupt this process from now on, which then says what was done."""
    _works.set()


def _stop(number: int, frame: FrameType | None) -> None:
    if _works.is_set():
        raise KeyboardInterrupt(number)
    os.write(2, b"contactverif: stopped, and nothing was judged\n")
    os._exit(128 + number)
