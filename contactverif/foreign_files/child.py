"""A foreign file is opened in a child process, with limits on time and memory.

The libraries that read netCDF and mesh files are large, and a damaged file can make them crash, read for ever or ask
for all memory. In a child process that costs the child and nothing else.

Rules for the next editor:

- This process never opens the file with such a library. It gets bytes from the child and believes none of them.
- A file that ends its child is a `ReadError` with the reason in one line, however it ends.
"""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import io
import os
import selectors
import signal
import subprocess
import sys
import time
import warnings
from dataclasses import dataclass
from typing import NoReturn

import psutil

# A fork costs milliseconds, since everything is imported already. On macOS a fork may crash in the system's own code.
FORKS = hasattr(os, "fork") and sys.platform != "darwin"
_READ, _FAILED = b"+", b"-"  # The first byte of an answer.
_LONGEST_REASON = 300  # Characters of a message from a library.
# meshio reads a million nodes of a text format in 10 s, and the arrays of so many are 0.1 GB. A report with a million
# cases takes half a minute and 1 GB. Both files have tens of megabytes.
_LEAST_SECONDS, _BYTES_A_SECOND, _MEGABYTES = 20.0, 1e6, 4096
_CHUNK = 1 << 20  # Bytes that are received at once.


class ReadError(Exception):
    """The child could not read the file; the message is one line."""


@dataclass(frozen=True, slots=True)
class Limits:
    """The limits of a child.

    Attributes
    ----------
    seconds : float
        The time until the child is stopped.
    megabytes : int
        The memory that it may take beyond what this process has, and the size of its answer.
    """

    seconds: float
    megabytes: int


def limits_for(size: int) -> Limits:
    """Return the limits for a file of so many bytes; a whole one needs a small part of them, also on a slow machine."""
    return Limits(_LEAST_SECONDS + size / _BYTES_A_SECOND, _MEGABYTES)


def read_in_child(reader: str, path: str, limits: Limits) -> bytes:
    """Return what a function makes of a file, run in a child process.

    Parameters
    ----------
    reader : str
        The function, ``package.module:function``. It takes the path and returns bytes.
    path : str
        The file.
    limits : Limits
        The limits.

    Returns
    -------
    bytes
        The answer of the function.

    Raises
    ------
    ReadError
        If the function raises an exception, or the child crashes, or takes too much time or memory.
    """
    return _read_in_fork(reader, path, limits) if FORKS else _read_in_new_process(reader, path, limits)


def _read_in_fork(reader: str, path: str, limits: Limits) -> bytes:
    _load(reader)  # Here, and not in each child.
    receive, send = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # Of a fork with threads: the child starts none.
        child = os.fork()
    if child == 0:
        os.close(receive)
        _answer(reader, path, limits, send)
    os.close(send)
    try:
        answer = _receive(receive, limits)
    except BaseException:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        raise
    finally:
        os.close(receive)
    _, status = os.waitpid(child, 0)
    return _unwrap(answer, os.waitstatus_to_exitcode(status))


def _read_in_new_process(reader: str, path: str, limits: Limits) -> bytes:
    arguments = [reader, path, str(limits.seconds), str(limits.megabytes)]
    with subprocess.Popen(
        [sys.executable, "-P", "-m", __name__, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as child:
        assert child.stdout is not None
        try:
            answer = _receive(child.stdout.fileno(), limits)
        except BaseException:
            child.kill()
            raise
        return _unwrap(answer, child.wait())


def _receive(receive: int, limits: Limits) -> bytes:
    """Return all that comes through a pipe, within the limits."""
    deadline, chunks, size = time.monotonic() + limits.seconds, list[bytes](), 0
    with selectors.DefaultSelector() as selector:
        selector.register(receive, selectors.EVENT_READ)
        while True:
            left = deadline - time.monotonic()
            if left <= 0 or not selector.select(left):
                raise ReadError(f"reading it takes longer than {limits.seconds:g} s")
            chunk = os.read(receive, _CHUNK)
            if not chunk:
                return b"".join(chunks)
            chunks.append(chunk)
            size += len(chunk)
            if size > limits.megabytes << 20:
                raise ReadError(f"it holds more than {limits.megabytes} MB")


def _unwrap(answer: bytes, status: int) -> bytes:
    """Return the answer of a child that ended with a status, negative for a signal."""
    if status < 0:
        raise ReadError(f"reading it crashes ({_name_of_signal(-status)})")
    if answer[:1] == _FAILED:
        raise ReadError(" ".join(answer[1:].decode(errors="replace").split()))
    if answer[:1] != _READ or status:
        raise ReadError(f"reading it ends the process with status {status}")
    return answer[1:]


def _name_of_signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _load(reader: str) -> object:
    module, _, function = reader.partition(":")
    return getattr(importlib.import_module(module), function)


def _answer(reader: str, path: str, limits: Limits, send: int) -> NoReturn:
    """Read the file, send the answer and end the process, whatever happens."""
    try:
        faulthandler.disable()  # A crash is told by its status, and not by a traceback.
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        _discard_outputs(send)
        function = _load(reader)
        _limit(limits)
        try:
            answer = _READ + function(path)  # type: ignore[operator]
        except MemoryError:
            answer = _FAILED + f"reading it takes more than {limits.megabytes} MB of memory".encode()
        except BaseException as error:
            reason = " ".join(str(error).split())[:_LONGEST_REASON] or type(error).__name__
            answer = _FAILED + reason.encode(errors="replace")
        view = memoryview(answer)
        while view:
            view = view[os.write(send, view) :]
        os._exit(0)
    finally:
        os._exit(1)


def _discard_outputs(send: int) -> None:
    """Let what a library prints vanish, wherever it prints it."""
    sink = os.open(os.devnull, os.O_RDWR)
    for descriptor in {0, 1, 2} - {send}:
        os.dup2(sink, descriptor)
    sys.stdout = sys.stderr = io.StringIO()


def _limit(limits: Limits) -> None:
    """Limit the memory of this process, and let it end by itself where nobody waits for it any more."""
    with contextlib.suppress(ImportError, AttributeError, OSError, ValueError):  # Not every system has these.
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        most = psutil.Process().memory_info().vms + (limits.megabytes << 20)
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (most if hard < 0 else min(most, hard), hard))
    with contextlib.suppress(AttributeError, ValueError):
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(int(limits.seconds) + 2)


if __name__ == "__main__":
    _, _reader, _path, _seconds, _megabytes = sys.argv
    _send = os.dup(1)
    _answer(_reader, _path, Limits(float(_seconds), int(_megabytes)), _send)
