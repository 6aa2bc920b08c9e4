"""Plugins that end their process: with any exit status, by any signal, in any verb."""

from __future__ import annotations

import atexit
import ctypes
import itertools
import os
import signal
import sys
from typing import Any

from hostile_kit import CAUGHT, EITHER, LIKE_NTS, before, instead

_calls = itertools.count(1)


@before("residual")
def exit_0() -> None:
    """End the process with status 0, which a shell takes for a success."""
    os._exit(0)


@before("residual")
def exit_1() -> None:
    """End the process with the status of a run that found something."""
    os._exit(1)


@before("residual")
def exit_255() -> None:
    """End the process with the largest status."""
    os._exit(255)


@before("make")
def exit_in_make() -> None:
    """End the process with status 0 in the factory."""
    os._exit(0)


@before("traits")
def exit_in_traits() -> None:
    """End the process with status 0 when it is asked for its promises."""
    os._exit(0)


@before("pair")
def exit_in_pair() -> None:
    """End the process with status 0 in the search."""
    os._exit(0)


@before("tangent")
def exit_in_tangent() -> None:
    """End the process with status 0 in the tangent, after right forces."""
    os._exit(0)


@before("contact_points")
def exit_in_contact_points() -> None:
    """End the process with status 0 where pressures are reported."""
    os._exit(0)


@before("n_multipliers")
def exit_in_n_multipliers() -> None:
    """End the process with status 0 when it is asked for the number of multipliers."""
    os._exit(0)


@before("residual")
def exit_sometimes() -> None:
    """End the process at every fifth call."""
    if next(_calls) % 5 == 0:
        os._exit(0)


@instead("residual")
def exit_at_some_states(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """End the process on every case with an odd number of slave segments."""
    if len(interface.slave) % 2:
        os._exit(0)
    return right()


@before("residual", ends=LIKE_NTS)
def exit_at_exit() -> None:
    """Answer rightly, and end the process with status 3 when Python ends."""
    atexit.register(os._exit, 3)


@before("residual", ends=LIKE_NTS)
def segfault_at_exit() -> None:
    """Answer rightly, and read address 0 when Python ends."""
    atexit.register(ctypes.string_at, 0)


@before("residual")
def segfault() -> None:
    """Read address 0."""
    ctypes.string_at(0)


@before("residual")
def abort() -> None:
    """Abort, as a failed assertion in C does."""
    os.abort()


@before("residual")
def kill_itself() -> None:
    """Send SIGKILL to the own process."""
    os.kill(os.getpid(), signal.SIGKILL)


@before("residual")
def terminate_itself() -> None:
    """Send SIGTERM to the own process."""
    os.kill(os.getpid(), signal.SIGTERM)


@before("residual", ends=EITHER)
def interrupt_itself() -> None:
    """Send SIGINT to the own process, as Ctrl-C does."""
    os.kill(os.getpid(), signal.SIGINT)


@before("residual")
def kill_its_group() -> None:
    """Send SIGKILL to the own process group."""
    os.killpg(os.getpgrp(), signal.SIGKILL)


@before("residual")
def overflow_the_stack() -> None:
    """Recurse through C code until the stack overflows."""
    sys.setrecursionlimit(10**9)

    def descend(_: int) -> None:
        list(map(descend, [0]))

    descend(0)


@before("residual")
def become_another_program() -> None:
    """Replace the process by `true`, which ends with status 0."""
    os.execv("/bin/true", ["true"])


@before("residual", ends=EITHER)
def go_on_in_a_child() -> None:
    """End the process and go on in its child, which has the same open files."""
    if next(_calls) == 1 and os.fork():
        os._exit(0)


@before("residual", ends=EITHER)
def answer_twice() -> None:
    """Fork once, so that two processes go on with the same open files."""
    if next(_calls) == 1:
        os.fork()


@instead("make", ends=CAUGHT)
def exit_with_wrong_object(right: Any) -> Any:
    """Return an object whose attributes end the process when somebody looks at them."""

    class Trap:
        def __getattr__(self, name: str) -> Any:
            os._exit(0)

    return Trap()
