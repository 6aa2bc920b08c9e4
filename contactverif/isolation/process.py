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
from collections.abc import Iterable
from contextlib import suppress
from functools import cache
from multiprocessing import util
from typing import IO

import psutil

from contactverif.contract.errors import PluginError
from contactverif.isolation.channel import Channel, ClosedError, TooLargeError, TooLateError
from contactverif.isolation.limits import MEGABYTE, Limits
from contactverif.isolation.messages import MessageError, Reply, decode_reply

MARK = "CONTACTVERIF_PLUGIN"  # The environment variable that marks the processes of plugins, and of their children.
_run = uuid.uuid4().hex
_LIBC = ctypes.CDLL(None)
_CALLS_ON_A_CORE = 32  # The judge may be moved to another core now and then.
_adopts = False
_PR_SET_CHILD_SUBREAPER = 36
_LARGEST_ANSWER = 512  # Megabytes. The judge keeps some answers at a time, in its own memory.
_SECONDS_TO_DIE = 5.0
_SECONDS_TO_READ = 1.0
_CODE = "import sys; sys.path[:] = {path!r}; from contactverif.isolation.worker import main; main({end}, {memory})"
# One thread for linear algebra, as in the judge's process (`contactverif.run.one_thread`): the same bits.
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
        code = _CODE.format(path=[*filter(None, sys.path)], end=theirs.fileno(), memory=limits.memory)
        environment = (
            os.environ
            | _THREADS
            | {MARK: _run, "TMPDIR": _folder(), **_NO_TRACES}
            | (_OTHER_SETTINGS if second else {})
        )
        self._process = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            pass_fds=(theirs.fileno(),),
            env=environment,
            start_new_session=True,
        )
        theirs.close()
        self._channel = Channel(ours, largest=min(limits.memory, _LARGEST_ANSWER) * MEGABYTE)
        assert self._process.stdout is not None
        self.output = Output(self._process.stdout)
        self._known_verbs: set[str] = set()
        self._n_sent, self._core = 0, -1

    def send(self, verb: str, requests: Iterable[bytes]) -> None:
        """Send requests.

        Parameters
        ----------
        verb : str
            The method that is asked first, for messages.
        requests : Iterable[bytes]
            The requests, encoded.

        Raises
        ------
        PluginError
            If the process has ended, or does not read. It is ended then.
        """
        if self._n_sent % _CALLS_ON_A_CORE == 0:
            self._follow()
        self._n_sent += 1
        try:
            self._channel.send(*requests, seconds=self._limits.start_seconds)
        except TooLateError:
            raise self._end_with(f"{verb}: its process does not listen", "hang") from None
        except ClosedError:
            raise self._end_with(verb, "") from None

    def _follow(self) -> None:
        """Put the process on the core of the judge, for one of the two always waits for the other.

        To wake a process on another core that sleeps takes longer than most answers.
        """
        core = _core_of_judge()
        if core not in (-1, self._core):
            with suppress(OSError):
                os.sched_setaffinity(self._process.pid, {core})
            self._core = core

    def receive(self, verb: str) -> Reply:
        """Return the next reply.

        Parameters
        ----------
        verb : str
            The method that was asked, for messages. Its first call may take longer.

        Returns
        -------
        Reply
            What the process says, of a known kind, with nothing else checked.

        Raises
        ------
        PluginError
            If the process ends, hangs or says what nobody can read. It is ended then.
        """
        seconds = self._limits.seconds if verb in self._known_verbs else self._limits.start_seconds
        try:
            reply = decode_reply(self._channel.receive(seconds))
        except TooLateError:
            raise self._end_with(f"{verb}: no answer within {seconds:g} s", "hang") from None
        except ClosedError:
            raise self._end_with(verb, "") from None
        except TooLargeError as error:
            raise self._end_with(f"{verb}: an answer of {error}", "memory") from None
        except MessageError as error:
            raise self._end_with(f"{verb}: {error}", "channel") from None
        self._known_verbs.add(verb)
        return reply

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


@cache
def _folder() -> str:
    """Return the folder for temporary files of the plugins of this process of the judge."""
    return tempfile.mkdtemp(prefix=f"contactverif-{os.getpid()}-")


@cache
def _end_at_exit() -> None:
    """Let this process end its plugins' processes when it ends. One of a pool does not call what `atexit` has."""
    atexit.register(end_marked)
    util.Finalize(None, end_marked, exitpriority=10)


def _core_of_judge() -> int:
    """Return the number of the core that this process runs on, −1 where nobody says."""
    return int(_LIBC.sched_getcpu()) if sys.platform == "linux" else -1


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
