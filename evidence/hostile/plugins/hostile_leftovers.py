"""Plugins that answer rightly and leave something behind. All of it ends by itself after two minutes."""

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

from hostile_kit import LIKE_NTS, LONG, before, leaves

_calls = itertools.count(1)
_keepsakes: list[object] = []
_SLEEP = ["sleep", str(int(LONG))]


@leaves
def daemon_threads() -> None:
    """Leave ten sleeping daemon threads."""
    for _ in range(10):
        threading.Thread(target=time.sleep, args=(LONG,), daemon=True).start()


thread = leaves(
    lambda: threading.Thread(target=time.sleep, args=(LONG,)).start(),
    "Leave a thread that Python waits for at its end.",
)


@leaves
def busy_threads() -> None:
    """Leave three threads that compute."""

    def compute() -> None:
        end = time.monotonic() + LONG
        while time.monotonic() < end:
            pass

    for _ in range(3):
        threading.Thread(target=compute, daemon=True).start()


child = leaves(lambda: _keepsakes.append(subprocess.Popen(_SLEEP)), "Leave a child process.")


children = leaves(
    lambda: _keepsakes.extend(subprocess.Popen(_SLEEP) for _ in range(20)), "Leave twenty child processes."
)


@leaves
def stubborn_child() -> None:
    """Leave a child that ignores all signals but SIGKILL."""
    code = f"import signal, time; [signal.signal(n, signal.SIG_IGN) for n in (1, 2, 15)]; time.sleep({LONG})"
    _keepsakes.append(subprocess.Popen([sys.executable, "-S", "-c", code]))


child_with_the_pipes = leaves(
    lambda: _keepsakes.append(subprocess.Popen(_SLEEP, close_fds=False, start_new_session=True)),
    "Leave a child in a session of its own that keeps every open file, so that a reader of the output waits.",
)


@leaves
def daemon() -> None:
    """Leave a process in a session of its own, forked twice, with all files closed."""
    if not os.fork():
        os.setsid()
        if os.fork():
            os._exit(0)
        os.closerange(0, 256)
        time.sleep(LONG)
        os._exit(0)


@leaves
def daemon_without_environment() -> None:
    """Leave a process in a session of its own, forked twice, without any environment variable."""
    pid = os.fork()
    if not pid:
        os.setsid()
        if os.fork():
            os._exit(0)
        os.closerange(0, 256)
        os.execve("/bin/sleep", _SLEEP, {})
    os.waitpid(pid, 0)


@leaves
def stopped_child() -> None:
    """Leave a child that has been stopped, which no SIGTERM reaches."""
    process = subprocess.Popen(_SLEEP, start_new_session=True)
    process.send_signal(signal.SIGSTOP)
    _keepsakes.append(process)


@leaves
def zombies() -> None:
    """Leave thirty children that have ended and that nobody has waited for."""
    for _ in range(30):
        if not os.fork():
            os._exit(0)


@leaves
def pool() -> None:
    """Leave a pool of processes."""
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


@leaves
def socket_file() -> None:
    """Leave a socket in the temporary folder, and a process that listens to it."""
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(os.path.join(tempfile.mkdtemp(prefix="hostile-"), "socket"))
    listener.listen()
    if not os.fork():
        os.setsid()
        time.sleep(LONG)
        os._exit(0)
    _keepsakes.append(listener)


pipe_file = leaves(
    lambda: os.mkfifo(os.path.join(tempfile.mkdtemp(prefix="hostile-"), "pipe")),
    "Leave a named pipe in the temporary folder, at which a reader waits.",
)


@leaves
def memory_file() -> None:
    """Leave a block of shared memory, which stays until the machine is switched off."""
    block = shared_memory.SharedMemory(f"hostile-{os.getpid()}", create=True, size=2**20)
    with contextlib.suppress(Exception):
        from multiprocessing.resource_tracker import unregister

        unregister(block._name, "shared_memory")  # type: ignore[attr-defined]
    _keepsakes.append(block)
