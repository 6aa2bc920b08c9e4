"""The copy of a process in which one name of a survey is loaded, so that no plugin sees what another one has done.

Rule: the process that is copied loads no plugin. A copy knows one line, on which it says what the name is, and ends.
"""

from __future__ import annotations

import os
import signal
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


def survey_in_copy(describe: Callable[[], Reply], question: int) -> Reply:
    """Return the reply of a function that a copy of this process calls, or how the copy ended.

    Nothing ends the wait but the judge, which ends this process if the reply is late.
    """
    hide_memory(hidden=True)
    import_module("contactverif.geometry.chain_search")  # What most plugins import is imported once.
    copy = Child.fork(partial(_say, describe, question), _LARGEST)
    try:
        (reply,) = decode_replies(copy.channel.receive())
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
    """End all other processes in the box. Without a box the judge ends what it finds, when the survey is over."""
    if PROCESSES in os.environ and os.getppid() == 1:  # Outside of a box these would be all of the user.
        with suppress(ProcessLookupError):
            os.kill(-1, signal.SIGKILL)
