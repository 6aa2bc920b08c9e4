"""The copy of a process in which one name of a survey is loaded, so that no plugin sees what another one has done.

Rules: the process that is copied loads no plugin. A copy knows one line, on which it says what the name is, and ends.
If it has changed what the next one would find, its process ends, too.
"""

from __future__ import annotations

import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib import import_module

from contactverif.contract.foreign_text import describe_error
from contactverif.isolation.box import PROCESSES
from contactverif.isolation.channel import Channel, ClosedError, TooLargeError
from contactverif.isolation.child import SOCKET, Child, name_of_signal
from contactverif.isolation.messages import Failure, MessageError, Reply, decode_replies, encode
from contactverif.isolation.parent_death import die_with_parent, hide_memory

_LARGEST = 1 << 20  # Bytes of a reply. Traits are some hundred.
_CHANGED = 113  # The status with which the process ends.
_FOLDERS = tempfile.gettempdir(), "/dev/shm"  # The folders that may be written in a box.


def survey_in_copy(describe: Callable[[], Reply], question: int) -> Reply:
    """Return the reply of a function that a copy of this process calls, or how the copy ended.

    Nothing ends the wait but the judge, which ends this process if the reply is late.
    """
    hide_memory(hidden=True)
    import_module("contactverif.geometry.chain_search")  # What most plugins import is imported once.
    _end_what_is_left()
    before = _state()
    copy = Child.fork(partial(_say, describe, question), _LARGEST)
    try:
        (reply,) = decode_replies(copy.channel.receive(), loading=True)
    except ClosedError:
        status = copy.wait() or 0
        words = f"its process ended with status {status}"
        if status < 0:
            words = f"{name_of_signal(-status)} ended its process"
        return Failure(question, "plugin", "exit", (f"import: {words}",))
    except (TooLargeError, MessageError, ValueError) as error:
        return Failure(question, "plugin", "channel", (f"import: {error}",))
    else:
        return reply
    finally:
        copy.end()
        _end_what_is_left()
        if _has_changed(before):
            os._exit(_CHANGED)


def _say(describe: Callable[[], Reply], question: int, channel: Channel) -> None:
    """Call the function in the copy, and send what it returns."""
    os.close(int(os.environ[SOCKET]))  # The line of the process that was copied.
    hide_memory(hidden=False)  # A plugin may want to look at itself.
    die_with_parent()
    try:
        reply = describe()
    except BaseException as error:  # A plugin may raise anything.
        reply = Failure(question, "plugin", "exception", (f"import: {describe_error(error)}",))
    channel.send(encode([reply]))


def _end_what_is_left() -> None:
    """End all other processes in the box and delete files. Without a box the judge does so when the survey is over."""
    if PROCESSES in os.environ and os.getppid() == 1:  # Outside of a box these would be all of the user.
        with suppress(ProcessLookupError):
            os.kill(-1, signal.SIGKILL)
        for folder in _FOLDERS:
            with suppress(OSError, RecursionError):  # What cannot be deleted is a change.
                _empty(folder)


def _empty(folder: str) -> None:
    """Delete what lies in a folder, whatever rights a plugin took from it."""
    for place, folders, files in os.walk(folder):
        for name in folders:
            with suppress(OSError):
                os.chmod(os.path.join(place, name), 0o700)
        for name in files:
            with suppress(OSError):
                os.unlink(os.path.join(place, name))
    for entry in os.scandir(folder):
        shutil.rmtree(entry.path, ignore_errors=True)


def _has_changed(before: tuple[object, ...]) -> bool:
    """Return whether this process, or its box, is not as it was."""
    try:
        return _state() != before
    except OSError:  # It may not open another file.
        return True


def _state() -> tuple[object, ...]:
    """Return what a copy can change for those after it: the limits of this process, and the files in its box."""
    if sys.platform == "win32":  # There are no copies, and no such limits.
        return ()
    import resource

    limits = [resource.getrlimit(getattr(resource, name)) for name in dir(resource) if name.startswith("RLIMIT_")]
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set()
    files = [os.listdir(folder) for folder in _FOLDERS] if PROCESSES in os.environ else []
    return limits, cores, os.getpriority(os.PRIO_PROCESS, 0), files
