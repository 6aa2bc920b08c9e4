"""The command line: one file a command, and the tables that a terminal shows. Nothing else in the house imports it."""

import os
import signal
import sys
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def main() -> None:
    """Run the command `contactverif`; Ctrl-C or SIGTERM is one line, also while modules are imported.

    Python may drop an interrupt that arrives there. So until a command works, a signal ends this process at once. It
    has written nothing, and what it has started ends with it.
    """
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _leave)
    try:
        from contactverif.cli import app

        app.main()
    except KeyboardInterrupt:
        sys.stderr.write("contactverif: stopped\n")
        sys.exit(130)


def begin_work() -> None:
    """Let a signal interrupt this process from now on, which then says what was done."""
    for number in _SIGNALS:
        if signal.getsignal(number) is _leave:
            signal.signal(number, _interrupt)


def _leave(number: int, frame: FrameType | None) -> None:
    os.write(2, b"contactverif: stopped, and nothing was judged\n")
    os._exit(128 + number)


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt(number)
