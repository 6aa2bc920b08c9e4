"""Plugins that try to change, stop or reach something outside of their box; the answers of most are right.

Rule for the next editor: what an act aims at lies in the folder of `bait.py`, or is restored there. An act that would
harm a machine without a box tries nothing there.
"""

import array
import contextlib
import ctypes
import fcntl
import mmap
import os
import resource
import signal
import socket
import stat
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import psutil
from hostile_kit import CAUGHT, EITHER, LONG, Factory, before, leaves

BAIT = Path(os.environ.get("HOSTILE_BAIT", "/missing"))
IN_BOX = "CONTACTVERIF_PROCESSES" in os.environ
_FILE = BAIT / "file"
_PTRACE_SEIZE, _PR_SET_PDEATHSIG = 0x4206, 1
_NEW_USER, _NEW_MOUNTS, _NEW_GROUPS = 0x10000000, 0x20000, 0x02000000
_ADD_KEY, _KEYCTL, _SET_TIMEOUT, _SESSION = 248, 250, 15, -3  # On x86-64; another machine has other numbers.
_libc = ctypes.CDLL(None, use_errno=True)


def tries(act: Callable[[], Any], summary: str | None = None) -> Factory:
    """Decorate `act()`, which tries something at the first question for forces, and may fail."""

    def attempt() -> None:
        with suppress(OSError, psutil.Error, ValueError):
            act()

    return leaves(attempt, summary or act.__doc__)


def _numbers() -> list[int]:
    """Return the numbers of a process, of a port, and of the process that has the bait."""
    return [int(word) for word in (BAIT / "numbers").read_text().split()]


def _name() -> str:
    """Return the name of what a plugin makes in the system."""
    return f"hostile-{_numbers()[2]}"


def _open_files() -> Iterator[tuple[int, str]]:
    """Yield the open files of this process."""
    for number in range(64):
        with suppress(OSError):
            yield number, os.readlink(f"/proc/self/fd/{number}")


write_file = tries(lambda: _FILE.write_text("changed", encoding="utf-8"), "Write to a file of the user.")
delete_file = tries(lambda: _FILE.unlink(), "Delete a file of the user.")
move_file = tries(lambda: _FILE.rename(BAIT / "moved"), "Rename a file of the user.")
cut_file = tries(lambda: os.truncate(_FILE, 0), "Cut a file of the user.")
link_file = tries(lambda: os.link(_FILE, BAIT / "link"), "Make a hard link to a file of the user.")
take_rights = tries(lambda: _FILE.chmod(0o400), "Take the rights from a file of the user.")
set_times = tries(lambda: os.utime(_FILE, (1, 1)), "Change the times of a file of the user.")
make_folder = tries(lambda: (BAIT / "new").mkdir(), "Make a folder among the files of the user.")
file_in_run = tries(lambda: Path("new").write_text("left"), "Write a file into the folder of the run.")


@tries
def linked_out() -> None:
    """Move a file out of the temporary folder by a hard link, which needs no right to read it."""
    number, name = tempfile.mkstemp(prefix="hostile-")
    os.close(number)
    try:
        os.link(name, BAIT / "link")
    finally:
        os.unlink(name)


@tries
def write_through_link() -> None:
    """Write to a file of the user by a symbolic link in the temporary folder."""
    link = Path(tempfile.mkdtemp(prefix="hostile-"), "link")
    link.symlink_to(_FILE)
    link.write_text("changed", encoding="utf-8")


write_through_root = tries(
    lambda: Path(f"/proc/self/root{_FILE}").write_text("changed", encoding="utf-8"),
    "Write to a file by the root folder of the process.",
)


@tries
def write_through_others() -> None:
    """Write to a file by the root folders of all other processes."""
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            Path(process, "root", *_FILE.parts[1:]).write_text("changed", encoding="utf-8")


@tries
def write_pipe() -> None:
    """Write to a named pipe of another program."""
    os.write(os.open(BAIT / "pipe", os.O_WRONLY | os.O_NONBLOCK), b"x")


@tries
def connect_file() -> None:
    """Connect to the socket of another program in a file."""
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(str(BAIT / "socket"))


@tries
def connect_name() -> None:
    """Connect to a socket of another program that has a name and no file."""
    with socket.socket(socket.AF_UNIX) as line:
        line.connect(f"\0{_name()}")


connect_port = tries(
    lambda: socket.create_connection(("127.0.0.1", _numbers()[1]), 1).close(), "Connect to a port of this machine."
)
stop_process = tries(lambda: os.kill(_numbers()[0], signal.SIGSTOP), "Stop a process of the user.")
slow_process = tries(lambda: psutil.Process(_numbers()[0]).nice(19), "Give a process of the user the lowest priority.")
pin_process = tries(lambda: psutil.Process(_numbers()[0]).cpu_affinity([0]), "Hold a process of the user on one core.")
limit_process = tries(
    lambda: resource.prlimit(_numbers()[0], resource.RLIMIT_CORE, (0, 0)), "Limit a process of the user."
)
offer_process = tries(
    lambda: Path(f"/proc/{_numbers()[0]}/oom_score_adj").write_text("500"),
    "Offer a process of the user to the system that looks for memory.",
)
shared_memory = tries(
    lambda: Path(f"/dev/shm/bait-{_numbers()[2]}").write_text("changed", encoding="utf-8"),
    "Write to the shared memory of others.",
)


@tries
def segment() -> None:
    """Leave a segment of shared memory of System V."""
    _libc.shmget(0x68000000 + _numbers()[2], 4096, 0o1600)


@tries
def hidden_folders() -> None:
    """Make files in folders of the system that a box hides, each of which would take memory."""
    for folder in ("/run", "/dev"):
        with suppress(OSError):
            Path(folder, _name()).write_text("left")


@tries
def control_groups() -> None:
    """Make a control group."""
    for folder in Path("/sys/fs/cgroup").glob("*"):
        with suppress(OSError):
            (folder / _name()).mkdir()


@tries
def namespaces() -> None:
    """Become the root user of a new namespace, mount the control groups and make one."""
    pid = os.fork()
    if not pid:
        with suppress(OSError):
            folder = tempfile.mkdtemp(prefix="hostile-")
            if not _libc.unshare(_NEW_USER | _NEW_MOUNTS | _NEW_GROUPS) and not _libc.mount(
                b"none", folder.encode(), b"cgroup2", 0, None
            ):
                Path(folder, _name()).mkdir()
        os._exit(0)
    os.waitpid(pid, 0)


@tries
def setting() -> None:
    """Change a setting of the whole system, as the root user may."""
    path = Path("/proc/sys/fs/lease-break-time")
    path.write_text(str(int(path.read_text()) + 1))


device_times = tries(lambda: os.utime(os.devnull, (1, 1)), "Change the times of a device, as the root user may.")


@tries
def key() -> None:
    """Leave a key in the system's keyring of the session, for ten minutes."""
    if os.uname().machine == "x86_64":
        number = _libc.syscall(_ADD_KEY, b"user", _name().encode(), b"x", 1, ctypes.c_int(_SESSION))
        _libc.syscall(_KEYCTL, _SET_TIMEOUT, number, 600)


attach_to_parent = tries(
    lambda: _libc.ptrace(_PTRACE_SEIZE, os.getppid(), None, None), "Attach to the process above, as a debugger does."
)


@tries
def signals_by_files() -> None:
    """Let every open file tell the process above, by a signal that ends it, when it can be read."""
    for number, _ in _open_files():
        with suppress(OSError):
            fcntl.fcntl(number, fcntl.F_SETOWN, os.getppid())
            fcntl.fcntl(number, 10, signal.SIGTERM)  # F_SETSIG
            fcntl.fcntl(number, fcntl.F_SETFL, fcntl.fcntl(number, fcntl.F_GETFL) | os.O_ASYNC)


@tries
def long_progress() -> None:
    """Lengthen the file that tells the progress, and let it take data at its end alone."""
    for number, name in _open_files():
        if "progress" in name:
            fcntl.fcntl(number, fcntl.F_SETFL, os.O_APPEND)
            os.ftruncate(number, 2**20)


@tries
def changed_pipes() -> None:
    """Take the rights from all open files, and let nobody wait for them."""
    for number, name in _open_files():
        if name.startswith(("pipe", "/memfd", "socket")):
            with suppress(OSError):
                os.fchmod(number, 0)
            if name.startswith("pipe"):
                fcntl.fcntl(number, fcntl.F_SETFL, os.O_NONBLOCK)


@before("residual", ends=CAUGHT)
def send_files() -> None:
    """Send two hundred open files to the judge."""
    files = array.array("i", [os.open(os.devnull, os.O_RDONLY)] * 200)
    for number, name in _open_files():
        if name.startswith("socket"):
            line = socket.socket(fileno=os.dup(number))
            line.sendmsg([b"\xff" * 8], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, files)])


status_of_a_signal = before("residual", ends=CAUGHT)(
    lambda: os._exit(139), "End with the status that a shell gives to a process that a signal ended."
)
status_minus_one = before("residual", ends=CAUGHT)(lambda: os._exit(-1), "End with the status −1.")
kill_group = before("residual", ends=CAUGHT)(
    lambda: os.kill(0, signal.SIGKILL), "Kill all processes of the group, also those around a box."
)
stop_group = before("residual", ends=CAUGHT)(
    lambda: os.kill(0, signal.SIGSTOP), "Stop all processes of the group, also those around a box."
)


@tries
def stop_first_process() -> None:
    """Stop and kill the first process in the box."""
    if IN_BOX:  # Elsewhere it is that of the machine.
        os.kill(1, signal.SIGSTOP)
        os.kill(1, signal.SIGKILL)


@tries
def outlive() -> None:
    """Leave a process that forgets to end with its parent, in a session of its own."""
    if not os.fork():
        os.setsid()
        _libc.prctl(_PR_SET_PDEATHSIG, 0, 0, 0, 0)
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
            signal.signal(number, signal.SIG_IGN)
        time.sleep(LONG)
        os._exit(0)


def _map_as_code(path: Path) -> mmap.mmap:
    """Map a new file into memory as code."""
    path.write_bytes(b"x" * mmap.PAGESIZE)
    with path.open("r+b") as file:
        return mmap.mmap(file.fileno(), mmap.PAGESIZE, prot=mmap.PROT_READ | mmap.PROT_EXEC)


_keepsakes: list[object] = []


@tries
def odd_code() -> None:
    """Map a file as code whose name has characters that end lines."""
    _keepsakes.append(_map_as_code(Path(tempfile.mkdtemp(prefix="hostile-"), "a\x0bb\x0cc\rd\x1b[31m.so")))


@tries
def endless_code() -> None:
    """Map a file of the store of kernels as code, and put pipes and links where a reader would look for it."""
    store = Path(os.environ["NUMBA_CACHE_DIR"])
    for name in ("pipe.so", "zero.so"):
        store.mkdir(exist_ok=True)
        _keepsakes.append(_map_as_code(store / name))
        (store / name).unlink()
        with suppress(FileExistsError):
            other = store / f"{name} (deleted)"
            os.mkfifo(other) if name == "pipe.so" else other.symlink_to("/dev/zero")


@tries
def links_in_store() -> None:
    """Put links to files of the user into the store of kernels."""
    store = Path(os.environ["NUMBA_CACHE_DIR"])
    store.mkdir(exist_ok=True)
    for name in ("residual.nbi", "residual.nbc", "__pycache__"):
        with suppress(FileExistsError):
            (store / name).symlink_to(_FILE)


@before("residual", ends=EITHER)
def full_folder() -> None:
    """Fill the temporary folder and the shared memory of the box."""
    if IN_BOX:  # Elsewhere it is the disk.
        for folder in (tempfile.gettempdir(), "/dev/shm"):
            with suppress(OSError), Path(folder, "hostile-full").open("wb") as file:
                for _ in range(2048):
                    file.write(bytes(2**20))


@tries
def terminal() -> None:
    """Write to the terminal, and type into it."""
    for path in ("/dev/tty", "/dev/console", "/dev/stdin"):
        with suppress(OSError), open(path, "wb", buffering=0) as file:
            file.write(b"\x1b]0;hostile\x07")
            fcntl.ioctl(file, 0x5412, b"x")  # TIOCSTI


@before("residual", ends=CAUGHT)
def image_of_memory() -> None:
    """Crash, and ask for an image of the memory in the folder of the run."""
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CORE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    _libc.prctl(4, 1, 0, 0, 0)  # PR_SET_DUMPABLE
    signal.signal(signal.SIGSEGV, signal.SIG_DFL)
    os.kill(os.getpid(), signal.SIGSEGV)


@tries
def locked_files() -> None:
    """Lock files that can only be read."""
    for path in (_FILE, BAIT / "numbers"):
        number = os.open(path, os.O_RDONLY)
        _keepsakes.append(number)
        fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)


@tries
def rights_of_file() -> None:
    """Leave a program that runs with the rights of its owner in the store of kernels, open to everybody."""
    store = Path(os.environ["NUMBA_CACHE_DIR"])
    store.mkdir(exist_ok=True)
    program = store / "program"
    program.write_text("#!/bin/sh\n")
    program.chmod(stat.S_ISUID | 0o755)
    with contextlib.suppress(OSError):
        store.chmod(0o755)
