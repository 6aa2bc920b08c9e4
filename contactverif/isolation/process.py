"""The process of a plugin as the judge sees it: started, asked, and ended.

Rule: whatever the process does, a question ends: with a reply, or with an error that says how the process ended.
Nothing of it is left behind.
"""

import atexit
import ctypes
import os
import signal
import sys
import tempfile
import threading
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache, cached_property
from multiprocessing import util
from pathlib import Path
from time import perf_counter
from typing import IO

import psutil

from contactverif.contract.errors import PluginError, one_line
from contactverif.isolation import box as boxes
from contactverif.isolation.child import Child, ClosedError, TooLargeError, TooLateError, name_of_signal
from contactverif.isolation.confine import MEGABYTE, MEMORY, ONE_THREAD, PROGRESS
from contactverif.isolation.limits import Limits
from contactverif.isolation.wire import MessageError, Reply, decode_replies

MARK = "CONTACTVERIF_PLUGIN"  # The environment variable that marks the processes of plugins, and of their children.
stop_signals: list[int] = []  # Those that are to stop this process; see `contactverif.cli.progress`.
_run = uuid.uuid4().hex
_adopts = False
_PR_SET_CHILD_SUBREAPER = 36
# An answer is joined, decoded, copied and converted, so it costs the judge a few times its bytes. A tangent in entries
# has 24 bytes for each, and some hundred points of a segment add some dozen. A dense one has 8 for each two unknowns.
_ANSWER, _ANSWER_A_NUMBER = 1 << 20, 1 << 17  # Bytes of any answer, and as many more for each number of the state.
_LARGEST_ANSWER = 128  # Megabytes of all answers to one message.
_LOOKS = 16  # The number of looks at a process that does not answer, within its time.
_LONGEST_STEP = 1.0  # Seconds.
_SECONDS_TO_DIE = 5.0
_SECONDS_TO_READ = 1.0
_LAST_WORDS = 2000  # Bytes.
_SIGNALED = 128  # A box ends with this status plus the number of the signal that ended its process.
# One thread, as for linear algebra in the judge's process (`contactverif.run.judge.one_thread`): the same bits.
# A plugin that limits the size of files would cut the compiled modules of the harness, which all runs share.
_SETTINGS = ONE_THREAD | {"PYTHONDONTWRITEBYTECODE": "1"}
# A second process of the same plugin differs in what no answer may depend on. The number of threads is not among it.
_OTHER_SETTINGS = {"PYTHONHASHSEED": "4711"}
_QUESTIONS_FIRST = 32  # The judge is not held to one core before so many questions.
_SECONDS_ON_A_CORE = 0.5  # The judge waits so long at most for a core that another program took.
_LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None
# A process that waits for a core uses at least this share of the time, so that it ends however many take the core.
_LEAST_SHARE = 1 / 16


class NoBoxError(PluginError):
    """The process has ended since its box was not made: nobody is to blame, and another try may make one."""


class Question:
    """A question with its number and its method, and the answer once it is there.

    `size` is the number of numbers that it is about: the answer may have more bytes where they are more.
    """

    __slots__ = ("answer", "largest", "number", "verb")

    def __init__(self, number: int, verb: str, size: int = 0) -> None:
        self.number, self.verb = number, verb
        self.largest = _ANSWER + size * _ANSWER_A_NUMBER
        self.answer: Reply | PluginError | None = None


class PluginProcess:
    """A process that may hold one plugin: any program that speaks the protocol. A `second` has another hash seed."""

    def __init__(self, command: Sequence[str], limits: Limits, *, second: bool = False) -> None:
        _end_at_exit()
        box = limits.box
        self._limits, self._encloses = limits, box is not None and not box.by_rules
        self._progress, self.output = _file_of_one_byte(), Output()
        folder = boxes.temporary_folder() if self._encloses else boxes.plugin_folder()
        environment = _SETTINGS | (_OTHER_SETTINGS if second else {})
        environment |= {MARK: _run, MEMORY: str(limits.memory), PROGRESS: str(self._progress.fileno())}
        environment |= {"TMPDIR": folder} if box is None else boxes.environment(box, folder)
        self._group = boxes.ControlGroup(limits.memory) if self._encloses else None
        if box is not None and self._group is not None:
            command = self._group.join(boxes.enclose(tuple(command), box, limits.memory))
        try:
            self.output.start()  # Before the process, which nobody would end if there were no thread for its output.
            with PINNING.on_one_core():
                self._child = Child.start(
                    command,
                    min(limits.memory, _LARGEST_ANSWER) * MEGABYTE,
                    environment=environment,
                    files=[self._progress.fileno()],
                    output=self.output.end,
                )
        except (OSError, RuntimeError) as error:  # The user may have as many processes or threads as the system allows.
            self._progress.close()
            words = getattr(error, "strerror", error)
            raise PluginError(f"import: {command[0]} does not start: {words}", "exit", ended=True) from error
        finally:
            os.close(self.output.end)
        self._core = -1
        self._sent_ahead = b""

    def send_ahead(self, frame: bytes) -> None:
        """Send encoded requests that `ask` will wait for as soon as it is called with them."""
        with suppress(ClosedError, TooLateError):  # `ask` finds out why.
            self._child.channel.send(frame, self._limits.start_seconds)
            self._sent_ahead = frame

    def ask(self, frame: bytes, questions: Sequence[Question], seconds: float | None = None) -> None:
        """Send encoded requests, and give each question its reply, of a known kind with nothing else checked.

        All replies have to come within some seconds, by default those of a start. If the process ends, hangs or says
        what cannot be read, it is ended, and a PluginError is raised. If anything else comes between, such as Ctrl-C,
        it is ended, too, or its next reply would be that to an earlier question.
        """
        if len(questions) > 1:
            with suppress(OSError):  # A plugin can let the file take data at its end alone, where there is no place.
                os.pwrite(self._progress.fileno(), b"\0", 0)
        PINNING.ask()
        if PINNING.core not in (-1, self._core):
            with suppress(OSError):
                os.sched_setaffinity(self._worker_pid, {PINNING.core})
            self._core = PINNING.core
        try:
            if frame != self._sent_ahead:
                try:
                    self._child.channel.send(frame, self._limits.start_seconds)
                except TooLateError:
                    raise TooLateError("its process does not listen") from None
            self._sent_ahead = b""
            if not questions:
                return
            data = self._receive(seconds or self._limits.start_seconds, sum(each.largest for each in questions))
            replies = decode_replies(data, loading=questions[0].verb == "import")
            if [reply.question for reply in replies] != [question.number for question in questions]:
                raise MessageError("answers to other questions")
        except (TooLateError, ClosedError, TooLargeError, MessageError) as error:
            # A file that is read cannot do harm. One that is mapped into memory can: the plugin may cut it.
            number = (os.pread(self._progress.fileno(), 1, 0) or b"\0")[0]
            verb = questions[min(number, len(questions) - 1)].verb if questions else "make"
            raise self._end_with(verb, error) from None
        except BaseException:
            self.end()
            raise
        for question, reply in zip(questions, replies, strict=True):
            question.answer = reply

    def _receive(self, seconds: float, largest: int) -> bytes:
        """Return the next frame, for which the process may use some seconds, however little of it comes at a time."""
        step, clock = min(seconds / _LOOKS, _LONGEST_STEP), None
        while clock is None or clock.seconds < seconds:
            try:
                return self._child.channel.receive(step, largest)
            except TooLateError:
                if stop_signals:
                    raise KeyboardInterrupt(stop_signals[0]) from None
                clock = clock or ActiveClock(self._child.pid)
                clock.look()
        raise TooLateError(f"no answer within {seconds:g} s: an endless loop? (--time-limit)")

    @property
    def code_files(self) -> list[Path]:
        """The files whose compiled code the process has loaded."""
        return [*mapped_files(self._worker_pid)]

    @cached_property
    def _worker_pid(self) -> int:
        """The number of the process that answers. In a box it is the first child of the first one there."""
        process = psutil.Process(self._child.pid)
        for _ in range(2 if self._encloses else 0):
            process = min(process.children(), key=psutil.Process.create_time, default=process)
        return int(process.pid)

    def _end_with(self, verb: str, error: Exception) -> PluginError:
        """End the process, and return the error; of one that closed its line, the end of the process tells it."""
        if not isinstance(error, ClosedError):
            self.end()
            words = f"an answer of {error}" if isinstance(error, TooLargeError) else error
            kinds = {TooLateError: "hang", TooLargeError: "memory", MessageError: "channel"}
            return PluginError(f"{verb}: {words}", kinds[type(error)], ended=True)
        status = self._child.wait()
        if self._encloses and status is not None and status - _SIGNALED in signal.valid_signals():
            status = _SIGNALED - status
        self.end()
        if status is None:
            return PluginError(f"{verb}: it closed its end of the line", "channel", ended=True)
        if status < 0:
            return PluginError(f"{verb}: {name_of_signal(-status)} ended its process", "signal", ended=True)
        kind = NoBoxError if self._encloses and self.output.last.startswith(b"bwrap: ") else PluginError
        printed = self.output.last.decode(errors="replace").splitlines()
        # Behind the error, the library of gfortran prints a trace of calls.
        lines = [line for line in printed if line.strip() and not line.startswith("#") and "Backtrace" not in line]
        words = f": {one_line(lines[-1])}" if lines else " (a STOP?)" if status == 0 else ""
        return kind(f"{verb}: its process ended with status {status}{words}", "exit", ended=True)

    def end(self) -> None:
        """End the process and all that it started, as far as they stayed in its session; see `end_marked`."""
        first: list[psutil.Process] = []
        # A plugin can make the first process in its box forget to end with its parent. With it ends all of the box.
        with suppress(psutil.Error):
            first = psutil.Process(self._child.pid).children() if self._encloses else []
        for process in first:
            with suppress(psutil.Error):
                process.kill()
        self._child.end()
        psutil.wait_procs(first, timeout=_SECONDS_TO_DIE)
        self.output.join(_SECONDS_TO_READ)  # A child that still writes is not waited for.
        self._progress.close()
        if self._group is not None:
            self._group.remove()


class Output(threading.Thread):
    """The last bytes that a process writes to `end`. A thread reads them, so that no process waits for a reader."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._near, self.end = os.pipe()
        self.last = b""

    def run(self) -> None:
        """Read until nobody has the other end."""
        with os.fdopen(self._near, "rb", buffering=0) as pipe, suppress(OSError):
            while data := pipe.read(1 << 16):
                self.last = (self.last + data)[-_LAST_WORDS:]


def _file_of_one_byte() -> IO[bytes]:
    """Return a file of one byte, without a name, that cannot grow where the system has such files."""
    if not hasattr(os, "memfd_create"):
        number, path = tempfile.mkstemp()
        os.unlink(path)
        os.write(number, b"\0")
        return os.fdopen(number, "r+b", buffering=0)
    from fcntl import F_ADD_SEALS, F_SEAL_GROW, F_SEAL_SEAL, F_SEAL_SHRINK, fcntl

    number = os.memfd_create("progress", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    os.write(number, b"\0")
    fcntl(number, F_ADD_SEALS, F_SEAL_GROW | F_SEAL_SHRINK | F_SEAL_SEAL)
    return os.fdopen(number, "r+b", buffering=0)


class CpuPinning:
    """The core that the judge and a plugin's process share, for one of the two always waits for the other.

    To wake a process that sleeps on another core takes longer than most answers, and the system likes to wake a process
    on a core that sleeps. So both are held on one core, and let go now and then for one question: then the system may
    move the judge to a better core. A plugin's process starts on one core and stays on one, for what counts cores.
    """

    def __init__(self) -> None:
        self.core = -1  # It may run on any of its cores.
        self._n_questions = 0
        self._cores: set[int] = set()
        self._until = 0.0

    def ask(self) -> None:
        """Note that a question is about to be asked; let this process go if it was held long enough."""
        self._n_questions += 1
        if self._n_questions <= _QUESTIONS_FIRST:
            return
        if self.core < 0:
            self._hold()
        elif perf_counter() > self._until:
            self.let_go()

    def _hold(self) -> None:
        if _LIBC is not None:
            self._cores, self.core = os.sched_getaffinity(0), int(_LIBC.sched_getcpu())
            self._until = perf_counter() + _SECONDS_ON_A_CORE
            with suppress(OSError):
                os.sched_setaffinity(0, {self.core})

    @contextmanager
    def on_one_core(self) -> Iterator[None]:
        """Open a block in which this process is on one core, so that a process that it starts there is held on it."""
        self.let_go()
        self._hold()
        try:
            yield
        finally:
            self.let_go()

    def let_go(self) -> None:
        """Let this process run on any of its cores."""
        if self.core >= 0:
            self.core = -1
            with suppress(OSError):
                os.sched_setaffinity(0, self._cores)


PINNING = CpuPinning()


class ActiveClock:
    """A clock that goes on with each look at a process and its descendants.

    A process that sleeps, or was stopped, uses all of the time that passes. One that runs, or waits for a core, uses
    the time that the processor has worked for it: on a busy machine that is less. `seconds` count from the first look.
    """

    def __init__(self, pid: int) -> None:
        self._pid, self.seconds = pid, 0.0
        self._before = perf_counter(), self._look()[1]

    def look(self) -> None:
        """Add the time that was used up since the last look."""
        runs, processor = self._look()
        now = perf_counter()
        passed, worked = now - self._before[0], processor - self._before[1]
        self.seconds += min(passed, max(worked, _LEAST_SHARE * passed)) if runs else passed
        self._before = now, processor

    def _look(self) -> tuple[bool, float]:
        """Return whether one of the processes runs or is ready to, and the processor's time of all, ended ones too."""
        runs, processor = False, 0.0
        with suppress(psutil.Error):
            root = psutil.Process(self._pid)
            for process in (root, *root.children(recursive=True)):
                with suppress(psutil.Error), process.oneshot():
                    runs = process.status() == psutil.STATUS_RUNNING or runs
                    processor += sum(process.cpu_times()[:4])
        return runs, processor


def mapped_files(pid: int | str) -> Iterator[Path]:
    """Yield the files from which a process has mapped code."""
    with suppress(OSError):  # It has ended, or the system has no such folder.
        for line in os.fsdecode(Path(f"/proc/{pid}/maps").read_bytes()).split("\n"):
            _, rights, *_, name = line.split(maxsplit=5) or ("", "", "")
            if "x" in rights and name.startswith("/"):
                yield Path(name)


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
    boxes.remove_plugin_folder()
