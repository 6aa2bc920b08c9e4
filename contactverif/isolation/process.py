"""The process of a plugin as the judge sees it: started, asked, and ended.

Rule for the next editor: whatever the process does, a question ends: with a reply, or with an error that says how the
process ended. Nothing of it is left behind.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import uuid
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from multiprocessing import util
from typing import IO

import psutil

from contactverif.contract.errors import PluginError
from contactverif.isolation.channel import Channel, ClosedError, TooLargeError, TooLateError
from contactverif.isolation.limits import MEGABYTE, Limits
from contactverif.isolation.messages import MessageError, Reply, decode_replies
from contactverif.isolation.one_core import JUDGE

MARK = "CONTACTVERIF_PLUGIN"  # The environment variable that marks the processes of plugins, and of their children.
_run = uuid.uuid4().hex
_LIBC = ctypes.CDLL(None)
_adopts = False
_PR_SET_CHILD_SUBREAPER = 36
_LARGEST_ANSWER = 512  # Megabytes. The judge keeps some answers at a time, in its own memory.
_SECONDS_TO_DIE = 5.0
_SECONDS_TO_READ = 1.0
_CODE = """import sys; sys.path[:] = {path!r}
from contactverif.isolation.worker import main; main({end}, {progress}, {memory})"""
# One thread for linear algebra, as in the judge's process (`contactverif.run.judge.one_thread`): the same bits.
_THREADS = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM")}
# A plugin that limits the size of files would cut the compiled modules of the harness, which all runs share.
_NO_TRACES = {"PYTHONDONTWRITEBYTECODE": "1"}
# A second process of the same plugin differs in what no answer may depend on.
_OTHER_SETTINGS = {"PYTHONHASHSEED": "4711", "OMP_NUM_THREADS": "2", "NUMBA_NUM_THREADS": "2"}


class PluginProcess:
    """A process that may hold one plugin.

    Parameters
    ----------
    limits : Limits
        Its limits.
    second : bool
        Start it with another hash seed and another number of threads.
    """

    def __init__(self, limits: Limits, *, second: bool = False) -> None:
        _end_at_exit()
        self._limits = limits
        ours, theirs = socket.socketpair()
        self._progress = _file_of_one_byte()
        ends = {"end": theirs.fileno(), "progress": self._progress.fileno()}
        code = _CODE.format(path=[*filter(None, sys.path)], **ends, memory=limits.memory)
        environment = (
            os.environ
            | _THREADS
            | {MARK: _run, "TMPDIR": _folder(), **_NO_TRACES}
            | (_OTHER_SETTINGS if second else {})
        )
        JUDGE.let_go()  # A process that starts while the judge is held to one core is held, too.
        self._process = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            pass_fds=tuple(ends.values()),
            env=environment,
            start_new_session=True,
        )
        theirs.close()
        self._channel = Channel(ours, largest=min(limits.memory, _LARGEST_ANSWER) * MEGABYTE)
        assert self._process.stdout is not None
        self.output = Output(self._process.stdout)
        self._known_verbs: set[str] = set()
        self._core = -1

    def ask(self, frame: bytes, verbs: Sequence[str]) -> Sequence[Reply]:
        """Send requests and return the replies.

        Parameters
        ----------
        frame : bytes
            The requests, encoded.
        verbs : Sequence[str]
            The methods that are asked, for messages. The first call of each may take longer.

        Returns
        -------
        Sequence[Reply]
            What the process says to each question, of a known kind, with nothing else checked.

        Raises
        ------
        PluginError
            If the process ends, hangs or says what nobody can read. It is ended then.
        """
        if len(verbs) > 1:
            os.pwrite(self._progress.fileno(), b"\0", 0)
        self._follow()
        try:
            self._channel.send(frame, seconds=self._limits.start_seconds)
            if not verbs:
                return ()
            replies = decode_replies(self._receive(verbs))
            if len(replies) != len(verbs):
                raise MessageError(f"{len(replies)} answers to {len(verbs)} questions")
        except TooLateError:
            raise self._end_with(f"{self._last_verb(verbs)}: its process does not listen", "hang") from None
        except ClosedError:
            raise self._end_with(self._last_verb(verbs), "") from None
        except TooLargeError as error:
            raise self._end_with(f"{self._last_verb(verbs)}: an answer of {error}", "memory") from None
        except MessageError as error:
            raise self._end_with(f"{self._last_verb(verbs)}: {error}", "channel") from None
        self._known_verbs.update(verbs)
        return replies

    def _last_verb(self, verbs: Sequence[str]) -> str:
        """Return the method that the process is working on, as it says."""
        return verbs[self._count_answers(verbs)] if verbs else "make"

    def _count_answers(self, verbs: Sequence[str]) -> int:
        """Return the number of questions that the process has done with, as it says; less than there are."""
        # A file that is read cannot do harm. One that is mapped into memory can: the plugin may cut it.
        return min((os.pread(self._progress.fileno(), 1, 0) or b"\0")[0], len(verbs) - 1)

    def _receive(self, verbs: Sequence[str]) -> bytes:
        """Return the next frame, each of the methods having its own time."""
        number = 0
        while True:
            verb = verbs[number]
            seconds = self._limits.seconds if verb in self._known_verbs else self._limits.start_seconds
            with suppress(TooLateError):
                return self._channel.receive(seconds)
            before, number = number, self._count_answers(verbs)
            if number <= before:
                raise self._end_with(f"{verb}: no answer within {seconds:g} s", "hang")

    def _follow(self) -> None:
        """Put the process on the core of the judge."""
        JUDGE.ask()
        if JUDGE.core not in (-1, self._core):
            with suppress(OSError):
                os.sched_setaffinity(self._process.pid, {JUDGE.core})
            self._core = JUDGE.core

    def _end_with(self, words: str, kind: str) -> PluginError:
        """End the process, and return the error; without a kind, the one that the end of the process tells."""
        if kind:
            self.end()
            return PluginError(words, cause=kind, ended=True)
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_SECONDS_TO_DIE)
        status = self._process.poll()
        self.end()
        if status is None:
            return PluginError(f"{words}: it closed its end of the line", cause="channel", ended=True)
        if status < 0:
            return PluginError(f"{words}: {_name_of_signal(-status)} ended its process", cause="signal", ended=True)
        return PluginError(f"{words}: its process ended with status {status}", cause="exit", ended=True)

    def end(self) -> None:
        """End the process and all that it started, as far as they stayed in its session; see `end_marked`."""
        self._channel.close()
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        with suppress(ProcessLookupError):
            self._process.kill()
        self._process.wait()
        self.output.wait()
        self._progress.close()


class Output:
    """The last bytes that a process writes to its standard output and error.

    Parameters
    ----------
    pipe : IO[bytes]
        The end to read from. A thread of its own reads, so that no process waits for a reader.
    """

    LAST = 2000

    def __init__(self, pipe: IO[bytes]) -> None:
        self._pipe = pipe
        self.last = b""
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        with self._pipe, suppress(OSError):
            while data := os.read(self._pipe.fileno(), 1 << 16):
                self.last = (self.last + data)[-self.LAST :]

    def wait(self) -> None:
        """Wait until all is read; a child that still writes is not waited for."""
        self._thread.join(_SECONDS_TO_READ)


def _file_of_one_byte() -> IO[bytes]:
    """Return a file of one byte, without a name."""
    if hasattr(os, "memfd_create"):
        number = os.memfd_create("progress")
    else:
        number, path = tempfile.mkstemp()
        os.unlink(path)
    file = os.fdopen(number, "r+b", buffering=0)
    file.write(b"\0")
    return file


@cache
def _folder() -> str:
    """Return the folder for temporary files of the plugins of this process of the judge."""
    return tempfile.mkdtemp(prefix=f"contactverif-{os.getpid()}-")


@cache
def _end_at_exit() -> None:
    """Let this process end its plugins' processes when it ends. One of a pool does not call what `atexit` has."""
    atexit.register(end_marked)
    util.Finalize(None, end_marked, exitpriority=10)


def adopt_orphans() -> None:
    """Become the parent of whatever a plugin's process leaves behind, so that `end_marked` finds it. Linux only."""
    global _adopts
    if sys.platform == "linux":
        _adopts = _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0


def end_marked() -> None:
    """End every process of a plugin, and what it left behind: processes, also in a session of their own, and files."""
    for process in psutil.process_iter():
        with suppress(psutil.Error, OSError):
            if process.environ().get(MARK) == _run:
                process.kill()
    for process in psutil.Process().children() if _adopts else ():
        with suppress(psutil.Error, OSError):  # Our own helpers stay in our session.
            if os.getsid(process.pid) != os.getsid(0):
                process.kill()
                process.wait(_SECONDS_TO_DIE)
    if _folder.cache_info().currsize:
        shutil.rmtree(_folder(), ignore_errors=True)
        _folder.cache_clear()


def _name_of_signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
