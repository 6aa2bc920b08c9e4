"""Plugins that raise what nobody expects."""

import errno
import os
import time
from collections.abc import Callable
from typing import Any

import hypothesis
import typer
from hostile_kit import EITHER, LONG, Factory, before, raises

from contactverif.contract.errors import ContractError, MisuseError

system_exit_0 = raises("residual")(lambda: SystemExit(0), "Raise SystemExit with status 0.")
system_exit_in_make = raises("make")(lambda: SystemExit(0), "Raise SystemExit with status 0 in the factory.")
keyboard_interrupt = raises("residual")(KeyboardInterrupt, "Raise KeyboardInterrupt, as Ctrl-C does.")
keyboard_interrupt_in_make = raises("make")(KeyboardInterrupt, "Raise KeyboardInterrupt in the factory.")
generator_exit = raises("residual")(GeneratorExit, "Raise GeneratorExit.")
stop_iteration = raises("residual")(StopIteration, "Raise StopIteration, which ends a loop of somebody else.")
memory_error = raises("residual")(MemoryError, "Raise MemoryError.")


@before("residual")
def recursion_error() -> None:
    """Recurse until Python refuses."""

    def descend() -> None:
        descend()

    descend()


def _with_text(text: Callable[[], Any], summary: str) -> Factory:
    """Make a plugin that raises an exception whose text is what a function returns."""
    return raises("residual")(type("StrangeError", (Exception,), {"__str__": lambda self: text()}), summary)


def _raise_again() -> str:
    raise RuntimeError("no text")


text_raises = _with_text(_raise_again, "Raise an exception whose text raises another one.")
text_is_no_text = _with_text(lambda: 7, "Raise an exception whose text is a number.")
text_exits = _with_text(lambda: os._exit(0), "Raise an exception whose text ends the process with status 0.")
text_hangs = _with_text(lambda: time.sleep(LONG), "Raise an exception whose text never comes.")
name_with_controls = raises("residual")(
    lambda: type("\x1b[2J\x1b[HAll tests passed\r\n\x07", (Exception,), {})("\x1b]0;title\x07"),
    "Raise an exception whose class name clears the terminal.",
)
long_text = raises("residual")(lambda: RuntimeError("x" * 20_000_000), "Raise an exception with a text of 20 MB.")
many_lines = raises("residual")(
    lambda: RuntimeError("line\n" * 100_000), "Raise an exception with a text of 100,000 lines."
)
half_characters = raises("residual")(
    lambda: RuntimeError("\ud800\udfff\x00\u202e"),
    "Raise an exception whose text holds halves of characters and NUL, which cannot be written as UTF-8.",
)


@before("residual")
def base_exception() -> None:
    """Raise an exception that is no Exception."""

    class PlainError(BaseException):
        pass

    raise PlainError("no Exception")


exception_group = raises("residual")(
    lambda: BaseExceptionGroup("outer", [ExceptionGroup("inner", [ValueError("a")]), KeyboardInterrupt()]),
    "Raise a group of exceptions in groups.",
)


@before("residual")
def long_chain() -> None:
    """Raise an exception with 100,000 causes, whose traceback nobody can print."""
    last: BaseException = ValueError("first")
    for _ in range(100_000):
        error = ValueError("next")
        error.__cause__ = last
        last = error
    raise last


looks_like_misuse = raises("residual")(
    lambda: MisuseError("--seed", "nothing", "another plugin"),
    "Raise the harness' own error for a mistake on the command line.",
)
looks_like_misuse_in_make = raises("make", ends=EITHER)(
    lambda: MisuseError("option", "nothing", "another plugin"),
    "Raise the harness' own error for a wrong option in the factory, though there is none.",
)
looks_like_a_breach = raises("residual")(
    lambda: type("ContractError", (ContractError,), {"__module__": "\x1b[31m"})("\x1b[2J"),
    "Raise the harness' own error for a broken contract, with a class name that lies about its module.",
)
looks_like_success = raises("residual")(lambda: typer.Exit(0), "Raise what ends a command with status 0.")
looks_like_a_closed_pipe = raises("residual")(
    lambda: BrokenPipeError(errno.EPIPE, "closed"), "Raise BrokenPipeError, after which a command ends quietly."
)
looks_like_a_full_disk = raises("residual")(
    lambda: OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)), "Raise the error of a full disk."
)
rejects_the_case = before("residual")(
    hypothesis.reject, "Tell hypothesis that the case is of no use, so that it draws another one."
)


class _Deep(Exception):
    """An exception with an unusual constructor, which pickle cannot make again."""

    def __init__(self, first: Any, second: Any) -> None:
        super().__init__()
        self.first, self.second = first, second


@before("residual")
def cannot_be_pickled() -> None:
    """Raise an exception that no other process can make again, with a function inside."""
    raise _Deep(lambda: None, open(os.devnull))  # noqa: SIM115
