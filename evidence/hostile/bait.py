"""Bait beside a run: files, sockets and processes for hostile plugins to change, and a list of what was changed.

A plugin finds it in the folder that the environment variable `HOSTILE_BAIT` names. What it changes of the system is
restored here.
"""

import ctypes
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import psutil

BAIT = "HOSTILE_BAIT"
TEXT = "as it was"
SEGMENTS = 0x68000000  # The key of a segment of shared memory of System V is this and the number of this process.
DEVICE = Path(os.devnull)
SETTING = Path("/proc/sys/fs/lease-break-time")  # Seconds that nobody misses.
_REVOKE = 250, 3  # The call of the system that ends a key, on x86-64, where a plugin makes one.
# Folders of the system in which a plugin may try to make something.
PLACES = ("/run", "/dev", "/sys/fs/cgroup/*")


class Bait:
    """The files, sockets and processes beside a run."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.folder = folder
        folder.mkdir()
        (folder / "file").write_text(TEXT)
        self._before = self._facts()
        os.mkfifo(folder / "pipe")
        self._pipe = os.open(folder / "pipe", os.O_RDWR | os.O_NONBLOCK)
        stack.callback(os.close, self._pipe)
        self._listeners = {"socket in a file": str(folder / "socket"), "abstract socket": f"\0hostile-{os.getpid()}"}
        self._sockets = {}
        for name, address in self._listeners.items():
            self._sockets[name] = stack.enter_context(socket.socket(socket.AF_UNIX))
            self._sockets[name].bind(address)
        self._sockets["port"] = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
        for listener in self._sockets.values():
            listener.listen()
            listener.setblocking(False)
        popen = stack.enter_context(subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE))
        stack.callback(popen.kill)
        self._process = psutil.Process(popen.pid)
        self._state = self._process_state()
        self._memory = Path(f"/dev/shm/bait-{os.getpid()}")
        self._memory.write_text(TEXT)
        stack.callback(self._memory.unlink, missing_ok=True)
        numbers = popen.pid, self._sockets["port"].getsockname()[1], os.getpid()
        (folder / "numbers").write_text(" ".join(map(str, numbers)))
        self._setting = SETTING.read_text()

    def _facts(self) -> tuple[object, ...]:
        file = self.folder / "file"
        try:
            facts = file.stat()
        except OSError:
            return ()
        return file.read_text(), facts.st_mode, facts.st_mtime, facts.st_nlink

    def _process_state(self) -> tuple[object, ...]:
        """Return what can be changed of the process, but for whether it sleeps or computes."""
        process = self._process
        score = Path(f"/proc/{process.pid}/oom_score_adj").read_text()
        stopped = process.status() in (psutil.STATUS_STOPPED, psutil.STATUS_ZOMBIE)
        return stopped, process.nice(), process.rlimit(psutil.RLIMIT_CORE), process.cpu_affinity(), score

    def changes(self) -> list[str]:
        """Return what was changed, and restore what is the system's."""
        changed = {
            "file": self._facts() != self._before,
            "process": self._process_state() != self._state,
            "shared memory": not self._memory.exists() or self._memory.read_text() != TEXT,
            "setting of the system": SETTING.read_text() != self._setting,
            "device": DEVICE.stat().st_mtime == 1.0,
            "folder": {path.name for path in self.folder.iterdir()} != {"file", "pipe", "socket", "numbers"},
        }
        with suppress(BlockingIOError):
            changed["pipe"] = bool(os.read(self._pipe, 1))
        for name, listener in self._sockets.items():
            with suppress(BlockingIOError):
                listener.accept()[0].close()
                changed[name] = True
        if changed["setting of the system"]:
            SETTING.write_text(self._setting)
        if changed["device"]:
            os.utime(DEVICE)
        return [f"changed {name}" for name, is_changed in changed.items() if is_changed] + _new_things(
            f"hostile-{os.getpid()}"
        )


def _new_things(name: str) -> list[str]:
    """Return what plugins have made in the system under a name, and remove it."""
    new = [path for place in PLACES for path in Path("/").glob(f"{place[1:]}/{name}")]
    for path in new:
        path.rmdir() if path.is_dir() else path.unlink()
    names = [f"new {path}" for path in new]
    libc = ctypes.CDLL(None)
    if (segment := libc.shmget(SEGMENTS + os.getpid(), 0, 0)) >= 0:
        libc.shmctl(segment, 0, None)  # IPC_RMID
        names.append("new shared memory of System V")
    keys = Path("/proc/keys").read_text().splitlines() if Path("/proc/keys").exists() else []
    numbers = [int(line.split()[0], 16) for line in keys if f"{name}:" in line]
    for number in numbers:
        libc.syscall(*_REVOKE, number)
    return names + (["new key"] if numbers else [])


@contextmanager
def bait(folder: Path) -> Iterator[Bait]:
    """Open a block in which there is bait in a folder."""
    with ExitStack() as stack:
        yield Bait(folder, stack)
