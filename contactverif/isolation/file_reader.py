"""A foreign file is opened in a child process, with limits on time and memory.

The libraries that read netCDF and mesh files are large, and a damaged file can make them crash, read for ever or ask
for all memory. Rule: this process never opens the file with such a library, and checks the bytes that it gets.
"""

import contextlib
import faulthandler
import importlib
import io
import os
import signal
import stat
import sys
from collections.abc import Callable
from functools import partial

from contactverif.contract.errors import MisuseError
from contactverif.isolation import child
from contactverif.isolation.child import Channel, Child, ClosedError, TooLargeError, TooLateError, name_of_signal
from contactverif.isolation.confine import MEGABYTE, die_with_parent, limit_memory
from contactverif.isolation.limits import Limits

_READ, _FAILED = b"+", b"-"  # The first byte of an answer.
_LONGEST_REASON = 300  # Characters of a message from a library.
# meshlane reads a million nodes of a text format in 10 s, and the arrays of so many are 0.1 GB. A report with a million
# cases takes half a minute and 1 GB. Both files have tens of megabytes.
_LEAST_SECONDS, _BYTES_A_SECOND, _MEGABYTES = 20.0, 1e6, 4096
_NOT_ORDINARY = {
    stat.S_IFDIR: "which is a folder",
    stat.S_IFIFO: "which is a pipe",
    stat.S_IFSOCK: "which is a socket",
    stat.S_IFCHR: "which is a device",
    stat.S_IFBLK: "which is a device",
}


class ReadError(Exception):
    """The child could not read the file; the message is one line."""


def check_ordinary(path: str | os.PathLike[str], argument: str, needed: str) -> os.stat_result:
    """Check that a name is that of an ordinary file that may be read: no folder, no pipe, and no device."""
    name = os.fspath(path)
    try:
        status = os.stat(path)
        kind = _NOT_ORDINARY.get(stat.S_IFMT(status.st_mode), "")
        if not kind:
            with open(path, "rb"):
                return status
    except FileNotFoundError:
        kind = "which does not exist"
    except OSError as error:
        kind = f"which cannot be read ({error.strerror})"
    except ValueError as error:  # A name with NUL.
        kind = f"which is no name of a file ({error})"
    raise MisuseError(argument, f"{name}, {kind}", needed)


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
    faulthandler.disable()  # A crash is told by its status, and not by a traceback.
    sink = os.open(os.devnull, os.O_RDWR)  # What a library prints vanishes, wherever it prints it.
    for descriptor in (0, 1, 2):
        os.dup2(sink, descriptor)
    sys.stdout = sys.stderr = io.StringIO()
    function = _load(reader)
    die_with_parent()
    with contextlib.suppress(AttributeError, ValueError):  # Nobody may wait any more, but not every system has alarms.
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        signal.alarm(int(limits.seconds) + 2)
    limit_memory(limits.memory)
    try:
        answer = _READ + function(path)
    except MemoryError:
        answer = _FAILED + f"reading it takes more than {limits.memory} MB of memory".encode()
    except BaseException as error:  # A damaged file can make its library raise anything; the parent tells the user.
        reason = " ".join(str(error).split())[:_LONGEST_REASON] or type(error).__name__
        answer = _FAILED + reason.encode(errors="replace")
    channel.send(answer)


if __name__ == "__main__":
    _, _reader, _path, _seconds, _memory = sys.argv
    _answer(_reader, _path, Limits(float(_seconds), int(_memory)), Channel(child.socket_of_parent()))
    os._exit(0)
