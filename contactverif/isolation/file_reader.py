"""A foreign file is opened in a child process, with limits on time and memory.

The libraries that read netCDF and mesh files are large, and a damaged file can make them crash, read for ever or ask
for all memory. Rule: this process never opens the file with such a library, and checks the bytes that it gets.
"""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import io
import os
import signal
import sys
from collections.abc import Callable
from functools import partial

from contactverif.isolation import child
from contactverif.isolation.channel import Channel, ClosedError, TooLargeError, TooLateError
from contactverif.isolation.child import Child, limit_memory, name_of_signal, socket_of_parent
from contactverif.isolation.limits import MEGABYTE, Limits
from contactverif.isolation.parent_death import die_with_parent

_READ, _FAILED = b"+", b"-"  # The first byte of an answer.
_LONGEST_REASON = 300  # Characters of a message from a library.
# meshio reads a million nodes of a text format in 10 s, and the arrays of so many are 0.1 GB. A report with a million
# cases takes half a minute and 1 GB. Both files have tens of megabytes.
_LEAST_SECONDS, _BYTES_A_SECOND, _MEGABYTES = 20.0, 1e6, 4096


class ReadError(Exception):
    """The child could not read the file; the message is one line."""


def limits_for(size: int) -> Limits:
    """Return the limits for a file of so many bytes; a whole one needs a small part of them, also on a slow machine."""
    return Limits(_LEAST_SECONDS + size / _BYTES_A_SECOND, _MEGABYTES)


def read_in_child(reader: str, path: str, limits: Limits) -> bytes:
    """Return what a function, ``package.module:function``, makes of the file of a path, called in a child process.

    If the function raises an exception, or the child crashes, or takes too much time or memory, that is a ReadError.
    """
    largest = limits.memory * MEGABYTE
    if child.FORKS:
        _load(reader)  # Here, and not in each child.
        process = Child.fork(partial(_answer, reader, path, limits), largest)
    else:
        arguments = [reader, path, str(limits.seconds), str(limits.memory)]
        process = Child.start([sys.executable, "-P", "-m", __name__, *arguments], largest)
    try:
        answer = process.channel.receive(limits.seconds)
    except TooLateError:
        raise ReadError(f"reading it takes longer than {limits.seconds:g} s") from None
    except TooLargeError:
        raise ReadError(f"it holds more than {limits.memory} MB") from None
    except ClosedError:
        status = process.wait()
        if status is not None and status < 0:
            raise ReadError(f"reading it crashes ({name_of_signal(-status)})") from None
        raise ReadError(f"reading it ends the process with status {status}") from None
    finally:
        process.end()
    if answer[:1] == _READ:
        return answer[1:]
    raise ReadError(" ".join(answer[1:].decode(errors="replace").split()))


def _load(reader: str) -> Callable[[str], bytes]:
    module, _, name = reader.partition(":")
    function: Callable[[str], bytes] = getattr(importlib.import_module(module), name)
    return function


def _answer(reader: str, path: str, limits: Limits, channel: Channel) -> None:
    """Read the file in the child, and send the answer."""
    faulthandler.disable()  # A crash is told by its status, and not by a traceback.
    _discard_outputs()
    function = _load(reader)
    _end_without_parent(limits)
    limit_memory(limits.memory)
    try:
        answer = _READ + function(path)
    except MemoryError:
        answer = _FAILED + f"reading it takes more than {limits.memory} MB of memory".encode()
    except BaseException as error:  # A damaged file can make its library raise anything; the parent tells the user.
        reason = " ".join(str(error).split())[:_LONGEST_REASON] or type(error).__name__
        answer = _FAILED + reason.encode(errors="replace")
    channel.send(answer)


def _discard_outputs() -> None:
    """Let what a library prints vanish, wherever it prints it."""
    sink = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(sink, descriptor)
    sys.stdout = sys.stderr = io.StringIO()


def _end_without_parent(limits: Limits) -> None:
    """Let this process end by itself where nobody waits for it any more."""
    die_with_parent()
    with contextlib.suppress(AttributeError, ValueError):  # Not every system has alarms.
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(int(limits.seconds) + 2)


if __name__ == "__main__":
    _, _reader, _path, _seconds, _memory = sys.argv
    _answer(_reader, _path, Limits(float(_seconds), int(_memory)), Channel(socket_of_parent()))
    os._exit(0)
