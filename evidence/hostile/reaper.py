"""Run a command under limits, and say what it left behind: `python reaper.py FACTS.json SECONDS MEGABYTES COMMAND …`.

On Linux this process adopts every process below it whose parent has ended (it is a child subreaper). So whatever the
command has started is a descendant when it ends, whatever it did to hide: that is counted, and killed. A shell stands
between this process and the command, since a plugin may kill the process above it.

Rule for the next editor: this file imports the standard library and psutil alone, for it runs once for each plugin.
"""

import ctypes
import json
import os
import resource
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil

_PR_SET_CHILD_SUBREAPER = 36
_GRACE = 3.0  # Seconds in which helpers of a process pool see that it has ended.


def adopt_orphans() -> None:
    """Make this process the parent of all orphans below it."""
    ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def descendants(known: frozenset[int] = frozenset()) -> list[psutil.Process]:
    """Return the living processes below this one, but for those that are known."""
    living = []
    for process in psutil.Process().children(recursive=True):
        with suppress(psutil.Error):
            if process.pid not in known and process.status() != psutil.STATUS_ZOMBIE:
                living.append(process)
    return living


def kill_descendants(known: frozenset[int] = frozenset()) -> list[str]:
    """Kill the processes below this one, and return their command lines."""
    lines: list[str] = []
    for _ in range(20):  # A process may start another one while it is killed.
        below = descendants(known)
        for process in below:
            with suppress(psutil.Error):
                lines.append(" ".join(process.cmdline())[:80])
                process.kill()
        psutil.wait_procs(below, timeout=1.0)
        if not below:
            break
    return lines


def run(command: list[str], seconds: float, megabytes: int) -> dict[str, Any]:
    """Run a command; return its status, its seconds, whether it was too late, and the processes that it left."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (megabytes * 2**20, megabytes * 2**20))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    start = time.monotonic()
    reading, writing = os.pipe()  # A standard input that never says anything, as a terminal.
    shell = subprocess.Popen(
        ["/bin/sh", "-c", '"$@"; exit $?', "sh", *command], stdin=reading, start_new_session=True, preexec_fn=limit
    )
    status: int | None = None
    with suppress(subprocess.TimeoutExpired):
        status = shell.wait(seconds)
    facts = {"status": status, "seconds": round(time.monotonic() - start, 1), "late": status is None}
    end = time.monotonic() + (0 if status is None else _GRACE)
    while descendants() and time.monotonic() < end:
        time.sleep(0.05)
    left = kill_descendants()
    with suppress(ProcessLookupError):
        os.killpg(shell.pid, signal.SIGKILL)
    os.close(writing)
    return facts | {"left": [] if facts["late"] else left}


if __name__ == "__main__":
    adopt_orphans()
    Path(sys.argv[1]).write_text(json.dumps(run(sys.argv[4:], float(sys.argv[2]), int(sys.argv[3]))))
