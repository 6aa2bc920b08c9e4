"""Readers that do what a library may do with a damaged file."""

import os
import signal
import sys
import time


def length(path: str) -> bytes:
    """Return the number of bytes, after words that nobody should see."""
    print("a library prints", flush=True)
    os.write(2, b"and so does its C code")
    return str(os.path.getsize(path)).encode()


def crash(path: str) -> bytes:
    """End by a signal."""
    os.kill(os.getpid(), signal.SIGSEGV)
    return b""


def leave(path: str) -> bytes:
    """End as if all were well, without an answer."""
    os._exit(0)


def sleep(path: str) -> bytes:
    """Read for ever."""
    time.sleep(1000)
    return b""


def eat(path: str) -> bytes:
    """Ask for all memory."""
    return bytes(1 << 40)


def talk(path: str) -> bytes:
    """Answer more than anybody asked for."""
    return bytes(3 << 20)


def fail(path: str) -> bytes:
    """Raise an error whose message has several lines, and no end."""
    raise ValueError("no\ngood " + "x" * 10000)


def leave_python(path: str) -> bytes:
    """Raise what no `except Exception` catches."""
    sys.exit("bye")
