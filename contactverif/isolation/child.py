"""A child process and the line to it: started, limited, and ended, for plugins and for files of strangers.

Rule: a child is a session of its own, so that all of it can be ended, and Ctrl-C reaches the parent alone.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from time import perf_counter, sleep
from typing import Any

from contactverif.isolation.channel import Channel
from contactverif.isolation.limits import MEGABYTE

# A fork takes milliseconds, since everything is imported already. On macOS a fork may crash in the system's own code.
FORKS = hasattr(os, "fork") and sys.platform != "darwin"
SOCKET = "CONTACTVERIF_SOCKET"  # The environment variable with the number of the child's end of the line.
_SECONDS_TO_DIE = 5.0


class Child:
    """A child process and the channel to it."""

    def __init__(self, process: subprocess.Popen[bytes] | _Fork, channel: Channel) -> None:
        self._process, self.channel = process, channel
        self.pid = process.pid

    @classmethod
    def start(
        cls,
        command: Sequence[str],
        largest: int,
        *,
        environment: Mapping[str, str] | None = None,
        files: Sequence[int] = (),
        output: int = subprocess.DEVNULL,
    ) -> Child:
        """Start a program that finds further variables in its environment, and further open files.

        A frame from it has at most `largest` bytes. What it prints goes to the file descriptor `output`.
        """
        ours, theirs = socket.socketpair()
        with theirs, ExitStack() as on_error:
            on_error.callback(ours.close)
            process = subprocess.Popen(
                [*command],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                pass_fds=(theirs.fileno(), *files),
                env=os.environ | (environment or {}) | {SOCKET: str(theirs.fileno())},
                start_new_session=True,
            )
            on_error.pop_all()
        return cls(process, Channel(ours, largest))

    @classmethod
    def fork(cls, serve: Callable[[Channel], None], largest: int) -> Child:
        """Start a copy of this process that calls a function with its end of the line, and ends."""
        ours, theirs = socket.socketpair()
        with warnings.catch_warnings():
            # Python and JAX warn of threads, which the child neither has nor starts.
            warnings.simplefilter("ignore", DeprecationWarning)
            warnings.filterwarnings("ignore", r"os\.fork\(\) was called", RuntimeWarning)
            pid = os.fork()
        if pid == 0:
            try:
                os.setsid()
                ours.close()
                serve(Channel(theirs))
                os._exit(0)
            finally:
                os._exit(1)
        theirs.close()
        return cls(_Fork(pid), Channel(ours, largest))

    def wait(self) -> int | None:
        """Return the status with which the child has ended, negative for a signal; None if it does not end soon."""
        with suppress(subprocess.TimeoutExpired):
            return self._process.wait(_SECONDS_TO_DIE)
        return None

    def end(self) -> None:
        """Kill the child with all that stayed in its session, and reap it."""
        self.channel.close()
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.pid, signal.SIGKILL)
        with suppress(ProcessLookupError):
            self._process.kill()
        self._process.wait()


class _Fork:
    """A copy of this process, with the methods of `subprocess.Popen` that a `Child` needs."""

    def __init__(self, pid: int) -> None:
        self.pid, self._status = pid, None

    _status: int | None

    def wait(self, timeout: float | None = None) -> int:
        deadline = None if timeout is None else perf_counter() + timeout
        while self._status is None:
            pid, status = os.waitpid(self.pid, 0 if deadline is None else os.WNOHANG)
            if pid:
                self._status = os.waitstatus_to_exitcode(status)
            elif deadline is not None and perf_counter() > deadline:
                raise subprocess.TimeoutExpired("fork", timeout or 0.0)
            else:
                sleep(0.001)
        return self._status

    def kill(self) -> None:
        if self._status is None:
            os.kill(self.pid, signal.SIGKILL)


def socket_of_parent() -> socket.socket:
    """Return the child's end of the line, in a program that `Child.start` has started."""
    return socket.socket(fileno=int(os.environ[SOCKET]))


def limit_memory(megabytes: int) -> None:
    """Limit the address space of this process beyond what it has, and write no image of it when it crashes."""
    resource: Any
    try:
        import resource
    except ImportError:  # Windows has no such limits.
        return
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with open("/proc/self/statm" if os.path.exists("/proc/self/statm") else os.devnull) as file:
        pages = int((file.read().split() or ["0"])[0])
    limit = pages * resource.getpagesize() + megabytes * MEGABYTE
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    if most == resource.RLIM_INFINITY or limit < most:
        with suppress(OSError, ValueError):  # Not every system has this limit.
            resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def limit_processes(most: int) -> None:
    """Limit the processes and threads of this user's namespace; the system counts those of other namespaces apart."""
    try:
        import resource
    except ImportError:  # Windows has no such limits.
        return
    resource.setrlimit(resource.RLIMIT_NPROC, (most, most))


def name_of_signal(number: int) -> str:
    """Return the name of a signal, such as SIGSEGV."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
