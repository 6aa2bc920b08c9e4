"""Plugins that end their process: with any exit status, by any signal, in any verb."""

import atexit
import ctypes
import itertools
import os
import signal
import sys
from typing import Any

from hostile_kit import CAUGHT, EITHER, LIKE_NTS, before, instead

_calls = itertools.count(1)


exit_0 = before("residual")(lambda: os._exit(0), "End the process with status 0, which a shell takes for a success.")
exit_1 = before("residual")(lambda: os._exit(1), "End the process with the status of a run that found something.")
exit_255 = before("residual")(lambda: os._exit(255), "End the process with the largest status.")
exit_in_make = before("make")(lambda: os._exit(0), "End the process with status 0 in the factory.")
exit_in_traits = before("traits")(
    lambda: os._exit(0), "End the process with status 0 when it is asked for its promises."
)
exit_in_pair = before("pair")(lambda: os._exit(0), "End the process with status 0 in the search.")
exit_in_tangent = before("tangent")(
    lambda: os._exit(0), "End the process with status 0 in the tangent, after right forces."
)
exit_in_contact_points = before("contact_points")(
    lambda: os._exit(0), "End the process with status 0 where pressures are reported."
)
exit_in_n_multipliers = before("n_multipliers")(
    lambda: os._exit(0), "End the process with status 0 when it is asked for the number of multipliers."
)


@before("residual")
def exit_sometimes() -> None:
    """End the process at every third call."""
    if next(_calls) % 3 == 0:
        os._exit(0)


@instead("residual")
def exit_at_some_states(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
    """End the process on every case with an odd number of slave segments."""
    if len(interface.slave) % 2:
        os._exit(0)
    return right()


exit_at_exit = before("residual", ends=LIKE_NTS)(
    lambda: atexit.register(os._exit, 3), "Answer rightly, and end the process with status 3 when Python ends."
)
segfault_at_exit = before("residual", ends=LIKE_NTS)(
    lambda: atexit.register(ctypes.string_at, 0), "Answer rightly, and read address 0 when Python ends."
)
segfault = before("residual")(lambda: ctypes.string_at(0), "Read address 0.")
abort = before("residual")(os.abort, "Abort, as a failed assertion in C does.")
kill_itself = before("residual")(lambda: os.kill(os.getpid(), signal.SIGKILL), "Send SIGKILL to the own process.")
terminate_itself = before("residual")(lambda: os.kill(os.getpid(), signal.SIGTERM), "Send SIGTERM to the own process.")
interrupt_itself = before("residual", ends=EITHER)(
    lambda: os.kill(os.getpid(), signal.SIGINT), "Send SIGINT to the own process, as Ctrl-C does."
)
kill_its_group = before("residual")(
    lambda: os.killpg(os.getpgrp(), signal.SIGKILL), "Send SIGKILL to the own process group."
)


@before("residual")
def overflow_the_stack() -> None:
    """Recurse through C code until the stack overflows."""
    sys.setrecursionlimit(10**9)

    def descend(_: int) -> None:
        list(map(descend, [0]))

    descend(0)


become_another_program = before("residual")(
    lambda: os.execv("/bin/true", ["true"]), "Replace the process by `true`, which ends with status 0."
)


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
