"""A child process and the line to it, for plugins and for files of strangers: started, spoken to, and ended.

Rules: a child is a session of its own, so that all of it can be ended, and Ctrl-C reaches the parent alone. Over the
line go frames of bytes: eight bytes of length, little-endian, then the bytes. The other end may send anything, or
nothing, or a byte now and then. So a frame has a deadline for all of it, and no memory is taken before its bytes come.
"""

from __future__ import annotations

import os
import select
import signal
import socket
import struct
import subprocess
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from math import ceil, inf
from time import perf_counter, sleep

from contactverif.isolation.confine import SOCKET

# A fork takes milliseconds, since everything is imported already. On macOS a fork may crash in the system's own code.
FORKS = hasattr(os, "fork") and sys.platform != "darwin"
_SECONDS_TO_DIE = 5.0
_LENGTH = struct.Struct("<Q")
_PIECE = 1 << 16
_LARGEST_PIECE = 1 << 22


class ClosedError(Exception):
    """The other end is closed."""


class TooLateError(Exception):
    """The deadline has passed."""


class TooLargeError(Exception):
    """A frame is longer than it may be."""


class Channel:
    """One end of a socket, which takes frames of at most `largest` bytes."""

    def __init__(self, end: socket.socket, largest: int = 1 << 62) -> None:
        end.setblocking(False)
        self._end, self._largest = end, largest
        self._file = end.fileno()
        self._rest = b""
        self._polls = {event: select.poll() for event in (select.POLLIN, select.POLLOUT)}
        for event, poll in self._polls.items():
            poll.register(self._file, event)

    def send(self, frame: bytes, seconds: float = inf) -> None:
        """Send a frame, or raise a ClosedError, or a TooLateError if the other end does not read all of it in time."""
        data = memoryview(_LENGTH.pack(len(frame)) + frame)
        deadline = perf_counter() + seconds
        while data:
            try:
                data = data[os.write(self._file, data[:_LARGEST_PIECE]) :]
            except BlockingIOError:
                self._wait(select.POLLOUT, deadline)
            except OSError:
                raise ClosedError from None

    def receive(self, seconds: float = inf, largest: int | None = None) -> bytes:
        """Return the next frame, or raise one of the errors above. What has come too late is kept for the next call.

        `largest` is a limit of bytes for this frame, where it is less than that of all.
        """
        deadline = perf_counter() + seconds
        data = self._rest or self._read(_PIECE, deadline)
        end = _LENGTH.size + _LENGTH.unpack_from(data)[0] if len(data) >= _LENGTH.size else 1 << 63
        if end > len(data):
            head = self._gather(data, _LENGTH.size, deadline)
            length = int(_LENGTH.unpack_from(head)[0])
            if length > (most := min(self._largest, largest or self._largest)):
                raise TooLargeError(f"{length} bytes; needed at most {most}")
            end = _LENGTH.size + length
            data = self._gather(head, end, deadline)
        self._rest = data[end:]
        return data[_LENGTH.size : end]

    def _gather(self, data: bytes, size: int, deadline: float) -> bytes:
        parts, have = [data], len(data)
        while have < size:
            try:
                parts.append(self._read(min(max(size - have, _PIECE), _LARGEST_PIECE), deadline))
            except TooLateError:
                self._rest = b"".join(parts)
                raise
            have += len(parts[-1])
        return b"".join(parts)

    def _read(self, size: int, deadline: float) -> bytes:
        self._wait(select.POLLIN, deadline)
        try:
            data = os.read(self._file, size)
        except OSError:
            data = b""
        if not data:
            raise ClosedError
        return data

    def _wait(self, event: int, deadline: float) -> None:
        left = None if deadline == inf else max(0, ceil(1000 * (deadline - perf_counter())))
        if not self._polls[event].poll(left):
            raise TooLateError

    def close(self) -> None:
        """Close this end."""
        self._end.close()


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
        self.pid = pid
        self._status: int | None = None

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


def name_of_signal(number: int) -> str:
    """Return the name of a signal, such as SIGSEGV."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
