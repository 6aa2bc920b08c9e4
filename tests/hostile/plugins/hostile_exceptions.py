"""Plugins that raise what nobody expects."""

from __future__ import annotations

import errno
import os
import time
from typing import Any

import hypothesis
import typer
from hostile_kit import EITHER, LONG, before

from contactverif.contract.errors import ContractError, MisuseError


@before("residual")
def system_exit_0() -> None:
    """Raise SystemExit with status 0."""
    raise SystemExit(0)


@before("make")
def system_exit_in_make() -> None:
    """Raise SystemExit with status 0 in the factory."""
    raise SystemExit(0)


@before("residual")
def keyboard_interrupt() -> None:
    """Raise KeyboardInterrupt, as Ctrl-C does."""
    raise KeyboardInterrupt


@before("make")
def keyboard_interrupt_in_make() -> None:
    """Raise KeyboardInterrupt in the factory."""
    raise KeyboardInterrupt


@before("residual")
def generator_exit() -> None:
    """Raise GeneratorExit."""
    raise GeneratorExit


@before("residual")
def stop_iteration() -> None:
    """Raise StopIteration, which ends a loop of somebody else."""
    raise StopIteration


@before("residual")
def memory_error() -> None:
    """Raise MemoryError."""
    raise MemoryError


@before("residual")
def recursion_error() -> None:
    """Recurse until Python refuses."""

    def descend() -> None:
        descend()

    descend()


@before("residual")
def text_raises() -> None:
    """Raise an exception whose text raises another one."""

    class NoTextError(Exception):
        def __str__(self) -> str:
            raise RuntimeError("no text")

    raise NoTextError


@before("residual")
def text_is_no_text() -> None:
    """Raise an exception whose text is a number."""

    class NumberError(Exception):
        def __str__(self) -> str:
            return 7  # type: ignore[return-value]

    raise NumberError


@before("residual")
def text_exits() -> None:
    """Raise an exception whose text ends the process with status 0."""

    class ExitError(Exception):
        def __str__(self) -> str:
            os._exit(0)

    raise ExitError


@before("residual")
def text_hangs() -> None:
    """Raise an exception whose text never comes."""

    class SlowError(Exception):
        def __str__(self) -> str:
            time.sleep(LONG)
            return ""

    raise SlowError


@before("residual")
def name_with_controls() -> None:
    """Raise an exception whose class name clears the terminal."""
    raise type("\x1b[2J\x1b[HAll tests passed\r\n\x07", (Exception,), {})("\x1b]0;title\x07")


@before("residual")
def long_text() -> None:
    """Raise an exception with a text of 20 MB."""
    raise RuntimeError("x" * 20_000_000)


@before("residual")
def many_lines() -> None:
    """Raise an exception with a text of 100,000 lines."""
    raise RuntimeError("line\n" * 100_000)


@before("residual")
def half_characters() -> None:
    """Raise an exception whose text holds halves of characters and NUL, which cannot be written as UTF-8."""
    raise RuntimeError("\ud800\udfff\x00\u202e")


@before("residual")
def base_exception() -> None:
    """Raise an exception that is no Exception."""

    class PlainError(BaseException):
        pass

    raise PlainError("no Exception")


@before("residual")
def exception_group() -> None:
    """Raise a group of exceptions in groups."""
    raise BaseExceptionGroup("outer", [ExceptionGroup("inner", [ValueError("a")]), KeyboardInterrupt()])


@before("residual")
def long_chain() -> None:
    """Raise an exception with 100,000 causes, whose traceback nobody can print."""
    last: BaseException = ValueError("first")
    for _ in range(100_000):
        error = ValueError("next")
        error.__cause__ = last
        last = error
    raise last


@before("residual")
def looks_like_misuse() -> None:
    """Raise the harness' own error for a mistake on the command line."""
    raise MisuseError("--seed", "nothing", "another plugin")


@before("make", ends=EITHER)
def looks_like_misuse_in_make() -> None:
    """Raise the harness' own error for a wrong option in the factory, though there is none."""
    raise MisuseError("option", "nothing", "another plugin")


@before("residual")
def looks_like_a_breach() -> None:
    """Raise the harness' own error for a broken contract, with a class name that lies about its module."""
    raise type("ContractError", (ContractError,), {"__module__": "\x1b[31m"})("\x1b[2J")


@before("residual")
def looks_like_success() -> None:
    """Raise what ends a command with status 0."""
    raise typer.Exit(0)


@before("residual")
def looks_like_a_closed_pipe() -> None:
    """Raise BrokenPipeError, after which a command ends quietly."""
    raise BrokenPipeError(errno.EPIPE, "closed")


@before("residual")
def looks_like_a_full_disk() -> None:
    """Raise the error of a full disk."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@before("residual")
def rejects_the_case() -> None:
    """Tell hypothesis that the case is of no use, so that it draws another one."""
    hypothesis.reject()


class _Deep(Exception):
    """An exception with an unusual constructor, which pickle cannot make again."""

    def __init__(self, first: Any, second: Any) -> None:
        super().__init__()
        self.first, self.second = first, second


@before("residual")
def cannot_be_pickled() -> None:
    """Raise an exception that no other process can make again, with a function inside."""
    raise _Deep(lambda: None, open(os.devnull))  # noqa: SIM115
