"""The process of a plugin as the judge sees it: started, asked, and ended.

Rule: whatever the process does, a question ends: with a reply, or with an error that says how the process ended.
Nothing of it is left behind.
"""

from __future__ import annotations

import atexit
import ctypes
import os
import shutil
import sys
import tempfile
import threading
import uuid
from collections.abc import Sequence
from contextlib import suppress
from functools import cache, cached_property
from multiprocessing import util
from typing import IO

import psutil

from contactverif.contract.errors import PluginError
from contactverif.isolation.box import enclose, temporary_folder
from contactverif.isolation.box import environment as box_environment
from contactverif.isolation.channel import ClosedError, TooLargeError, TooLateError
from contactverif.isolation.child import Child, name_of_signal
from contactverif.isolation.limits import MEGABYTE, Limits
from contactverif.isolation.messages import MessageError, Reply, decode_replies
from contactverif.isolation.one_core import JUDGE
from contactverif.isolation.one_thread import ONE_THREAD

MARK = "CONTACTVERIF_PLUGIN"  # The environment variable that marks the processes of plugins, and of their children.
PROGRESS = "CONTACTVERIF_PROGRESS"  # The number of an open file of one byte, see `docs/reference/protocol.md`.
MEMORY = "CONTACTVERIF_MEMORY"  # The megabytes that the process may take.
_run = uuid.uuid4().hex
_adopts = False
_PR_SET_CHILD_SUBREAPER = 36
_LARGEST_ANSWER = 512  # Megabytes. The judge keeps some answers at a time, in its own memory.
_SECONDS_TO_DIE = 5.0
_SECONDS_TO_READ = 1.0
_LAST_WORDS = 2000  # Bytes.
_SIGNALED = 128  # A box ends with this status plus the number of the signal that ended its process.
# One thread, as for linear algebra in the judge's process (`contactverif.run.judge.one_thread`): the same bits.
# A plugin that limits the size of files would cut the compiled modules of the harness, which all runs share.
_SETTINGS = ONE_THREAD | {"PYTHONDONTWRITEBYTECODE": "1"}
# A second process of the same plugin differs in what no answer may depend on. The number of threads is not among it.
_OTHER_SETTINGS = {"PYTHONHASHSEED": "4711"}


class Question:
    """A question with its number and its method, and the answer once it is there."""

    __slots__ = ("answer", "number", "verb")

    def __init__(self, number: int, verb: str) -> None:
        self.number, self.verb = number, verb
        self.answer: Reply | PluginError | None = None

    @property
    def result(self) -> Reply | PluginError:
        """Return the answer, which must be there."""
        assert self.answer is not None
        return self.answer


class PluginProcess:
    """A process that may hold one plugin: any program that speaks the protocol.

    A `second` one has another hash seed.
    """

    def __init__(self, command: Sequence[str], limits: Limits, *, second: bool = False) -> None:
        _end_at_exit()
        self._limits = limits
        self._progress = _file_of_one_byte()
        self.output = Output()
        numbers = {MARK: _run, MEMORY: str(limits.memory), PROGRESS: str(self._progress.fileno())}
        largest = min(limits.memory, _LARGEST_ANSWER) * MEGABYTE
        settings, files = _SETTINGS | (_OTHER_SETTINGS if second else {}), [self._progress.fileno()]
        encloses = limits.box is not None and not limits.box.by_rules
        folder = temporary_folder() if encloses else _folder()
        numbers |= {"TMPDIR": folder} if limits.box is None else box_environment(limits.box, folder)
        if limits.box is not None and encloses:
            command = enclose(tuple(command), limits.box, limits.memory)
        self._encloses = encloses
        try:
            with JUDGE.on_one_core():
                self._child = Child.start(
                    command, largest, environment=settings | numbers, files=files, output=self.output.end
                )
        except OSError as error:
            self._progress.close()
            raise PluginError(f"import: {command[0]} does not start: {error.strerror}", "exit", ended=True) from error
        finally:
            self.output.start()
        self._known_verbs: set[str] = set()
        self._core = -1

    def ask(self, frame: bytes, questions: Sequence[Question]) -> None:
        """Send encoded requests, and give each question its reply, of a known kind with nothing else checked.

        The first call of each method may take longer. If the process ends, hangs or says what cannot be read, it is
        ended, and a PluginError is raised.
        """
        if len(questions) > 1:
            os.pwrite(self._progress.fileno(), b"\0", 0)
        self._follow()
        try:
            self._child.channel.send(frame, seconds=self._limits.start_seconds)
            replies = decode_replies(self._receive(questions)) if questions else []
            if [reply.question for reply in replies] != [question.number for question in questions]:
                raise MessageError("answers to other questions")
        except TooLateError:
            raise self._end_with(f"{self._last_verb(questions)}: its process does not listen", "hang") from None
        except ClosedError:
            raise self._end_with(self._last_verb(questions), "") from None
        except TooLargeError as error:
            raise self._end_with(f"{self._last_verb(questions)}: an answer of {error}", "memory") from None
        except MessageError as error:
            raise self._end_with(f"{self._last_verb(questions)}: {error}", "channel") from None
        for question, reply in zip(questions, replies, strict=True):
            question.answer = reply
            self._known_verbs.add(question.verb)

    def _last_verb(self, questions: Sequence[Question]) -> str:
        """Return the method that the process is working on, as it says."""
        return questions[self._count_answers(questions)].verb if questions else "make"

    def _count_answers(self, questions: Sequence[Question]) -> int:
        """Return the number of questions that the process has done with, as it says; less than there are."""
        # A file that is read cannot do harm. One that is mapped into memory can: the plugin may cut it.
        return min((os.pread(self._progress.fileno(), 1, 0) or b"\0")[0], len(questions) - 1)

    def _receive(self, questions: Sequence[Question]) -> bytes:
        """Return the next frame, each of the methods having its own time."""
        number = 0
        while True:
            verb = questions[number].verb
            seconds = self._limits.seconds if verb in self._known_verbs else self._limits.start_seconds
            try:
                return self._child.channel.receive(seconds)
            except TooLateError:
                before, number = number, self._count_answers(questions)
            if number <= before:
                raise self._end_with(f"{verb}: no answer within {seconds:g} s", "hang")

    def _follow(self) -> None:
        """Put the process on the core of the judge."""
        JUDGE.ask()
        if JUDGE.core not in (-1, self._core):
            with suppress(OSError):
                os.sched_setaffinity(self._worker_pid, {JUDGE.core})
            self._core = JUDGE.core

    @cached_property
    def _worker_pid(self) -> int:
        """The number of the process that answers. In a box it is the first child of the first one there."""
        process = psutil.Process(self._child.pid)
        for _ in range(2 if self._encloses else 0):
            process = min(process.children(), key=psutil.Process.create_time, default=process)
        return int(process.pid)

    def _end_with(self, words: str, kind: str) -> PluginError:
        """End the process, and return the error; without a kind, the one that the end of the process tells."""
        status = None if kind else self._child.wait()
        if self._encloses and status is not None and status > _SIGNALED:
            status = _SIGNALED - status
        self.end()
        if not kind and status is None:
            kind, words = "channel", f"{words}: it closed its end of the line"
        elif status is not None and status < 0:
            kind, words = "signal", f"{words}: {name_of_signal(-status)} ended its process"
        elif status is not None:
            kind, words = "exit", f"{words}: its process ended with status {status}"
        return PluginError(words, cause=kind, ended=True)

    def end(self) -> None:
        """End the process and all that it started, as far as they stayed in its session; see `end_marked`."""
        self._child.end()
        self.output.wait()
        self._progress.close()


class Output:
    """The last bytes that a process writes to `end`. A thread reads them, so that no process waits for a reader."""

    def __init__(self) -> None:
        self._near, self.end = os.pipe()
        self.last = b""
        self._thread = threading.Thread(target=self._read, daemon=True)

    def start(self) -> None:
        """Begin to read, once the process has the other end."""
        os.close(self.end)
        self._thread.start()

    def _read(self) -> None:
        with os.fdopen(self._near, "rb", buffering=0) as pipe, suppress(OSError):
            while data := pipe.read(1 << 16):
                self.last = (self.last + data)[-_LAST_WORDS:]

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
        _adopts = ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0


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
