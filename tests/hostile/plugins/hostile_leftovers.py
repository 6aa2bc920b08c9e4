"""Plugins that answer rightly and leave something behind. All of it ends by itself after two minutes."""

from __future__ import annotations

import contextlib
import itertools
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from multiprocessing import get_context, shared_memory
from pathlib import Path

from hostile_kit import LIKE_NTS, LONG, before

_calls = itertools.count(1)
_keepsakes: list[object] = []
_SLEEP = ["sleep", str(int(LONG))]


@before("residual", ends=LIKE_NTS)
def daemon_threads() -> None:
    """Leave ten sleeping daemon threads."""
    if next(_calls) == 1:
        for _ in range(10):
            threading.Thread(target=time.sleep, args=(LONG,), daemon=True).start()


@before("residual", ends=LIKE_NTS)
def thread() -> None:
    """Leave a thread that Python waits for at its end."""
    if next(_calls) == 1:
        threading.Thread(target=time.sleep, args=(LONG,)).start()


@before("residual", ends=LIKE_NTS)
def busy_threads() -> None:
    """Leave three threads that compute."""

    def compute() -> None:
        end = time.monotonic() + LONG
        while time.monotonic() < end:
            pass

    if next(_calls) == 1:
        for _ in range(3):
            threading.Thread(target=compute, daemon=True).start()


@before("residual", ends=LIKE_NTS)
def child() -> None:
    """Leave a child process."""
    if next(_calls) == 1:
        _keepsakes.append(subprocess.Popen(_SLEEP))


@before("residual", ends=LIKE_NTS)
def children() -> None:
    """Leave twenty child processes."""
    if next(_calls) == 1:
        _keepsakes.extend(subprocess.Popen(_SLEEP) for _ in range(20))


@before("residual", ends=LIKE_NTS)
def stubborn_child() -> None:
    """Leave a child that ignores all signals but SIGKILL."""
    code = f"import signal, time; [signal.signal(n, signal.SIG_IGN) for n in (1, 2, 15)]; time.sleep({LONG})"
    if next(_calls) == 1:
        _keepsakes.append(subprocess.Popen([sys.executable, "-S", "-c", code]))


@before("residual", ends=LIKE_NTS)
def child_with_the_pipes() -> None:
    """Leave a child in a session of its own that keeps every open file, so that a reader of the output waits."""
    if next(_calls) == 1:
        _keepsakes.append(subprocess.Popen(_SLEEP, close_fds=False, start_new_session=True))


@before("residual", ends=LIKE_NTS)
def daemon() -> None:
    """Leave a process in a session of its own, forked twice, with all files closed."""
    if next(_calls) == 1 and not os.fork():
        os.setsid()
        if os.fork():
            os._exit(0)
        os.closerange(0, 256)
        time.sleep(LONG)
        os._exit(0)


@before("residual", ends=LIKE_NTS)
def daemon_without_environment() -> None:
    """Leave a process in a session of its own, forked twice, without any environment variable."""
    if next(_calls) == 1:
        pid = os.fork()
        if not pid:
            os.setsid()
            if os.fork():
                os._exit(0)
            os.closerange(0, 256)
            os.execve("/bin/sleep", _SLEEP, {})
        os.waitpid(pid, 0)


@before("residual", ends=LIKE_NTS)
def stopped_child() -> None:
    """Leave a child that has been stopped, which no SIGTERM reaches."""
    if next(_calls) == 1:
        process = subprocess.Popen(_SLEEP, start_new_session=True)
        process.send_signal(signal.SIGSTOP)
        _keepsakes.append(process)


@before("residual", ends=LIKE_NTS)
def zombies() -> None:
    """Leave thirty children that have ended and that nobody has waited for."""
    if next(_calls) == 1:
        for _ in range(30):
            if not os.fork():
                os._exit(0)


@before("residual", ends=LIKE_NTS)
def pool() -> None:
    """Leave a pool of processes."""
    if next(_calls) == 1:
        processes = get_context("fork").Pool(2)
        _keepsakes.append((processes, processes.apply_async(time.sleep, (LONG,))))


@before("residual", ends=LIKE_NTS)
def temporary_file() -> None:
    """Leave a temporary file at each call."""
    number, _ = tempfile.mkstemp(prefix="hostile-")
    os.close(number)


@before("residual", ends=LIKE_NTS)
def locked_folder() -> None:
    """Leave temporary folders that may not be entered, with a file in each."""
    if next(_calls) <= 3:
        folder = Path(tempfile.mkdtemp(prefix="hostile-"))
        (folder / "file").write_text("left")
        folder.chmod(0)


@before("residual", ends=LIKE_NTS)
def socket_file() -> None:
    """Leave a socket in the temporary folder, and a process that listens to it."""
    if next(_calls) == 1:
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(os.path.join(tempfile.mkdtemp(prefix="hostile-"), "socket"))
        listener.listen()
        if not os.fork():
            os.setsid()
            time.sleep(LONG)
            os._exit(0)
        _keepsakes.append(listener)


@before("residual", ends=LIKE_NTS)
def pipe_file() -> None:
    """Leave a named pipe in the temporary folder, at which a reader waits."""
    if next(_calls) == 1:
        os.mkfifo(os.path.join(tempfile.mkdtemp(prefix="hostile-"), "pipe"))


@before("residual", ends=LIKE_NTS)
def memory_file() -> None:
    """Leave a block of shared memory, which stays until the machine is switched off."""
    if next(_calls) == 1:
        block = shared_memory.SharedMemory(f"hostile-{os.getpid()}", create=True, size=2**20)
        with contextlib.suppress(Exception):
            from multiprocessing.resource_tracker import unregister

            unregister(block._name, "shared_memory")  # type: ignore[attr-defined]
        _keepsakes.append(block)
