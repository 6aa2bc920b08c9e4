"""The confinement that a process takes on itself before it holds a plugin, and the environment that says how.

Rules: the standard library alone, since engines have interpreters of their own. A process confines itself before it
loads a plugin, and nothing takes that back.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from math import inf
from mmap import PAGESIZE

MEGABYTE = 2**20
SOCKET = "CONTACTVERIF_SOCKET"  # The number of the child's end of the line to its parent.
PROGRESS = "CONTACTVERIF_PROGRESS"  # The number of an open file of one byte, see `docs/reference/protocol.md`.
MEMORY = "CONTACTVERIF_MEMORY"  # The megabytes that the process may take.
PROCESSES = "CONTACTVERIF_PROCESSES"  # The most processes and threads in a box.
WRITABLE = "CONTACTVERIF_WRITABLE"  # The paths that may be written, for the rules of Landlock.
NETWORK = "network"  # The name by which a user opens the network, and not a file.
# OpenMP; the libraries for linear algebra, of which some have threads of their own; and numba, whose layers for threads
# are OpenMP, TBB and one of its own. A library reads its variable once, when it is loaded, so a process must find them
# at its start. TBB alone has no variable: it takes as many threads as the process has cores when it is first used, see
# `contactverif.isolation.process.CpuPinning`.
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "NUMEXPR_NUM_THREADS")
    + ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"),
    "1",
)
_PR_SET_PDEATHSIG = 1
_PR_SET_DUMPABLE = 4


def confine() -> None:
    """Bind this process to its parent, and take on the limits that its environment says."""
    die_with_parent()
    faulthandler.enable()
    limit_memory(int(os.environ[MEMORY]))
    if PROCESSES in os.environ:  # The system counts those of each user namespace, so of a box, apart.
        _lower("RLIMIT_NPROC", int(os.environ[PROCESSES]))
    if WRITABLE in os.environ:
        _keep_to(os.environ[WRITABLE].split(os.pathsep))


def die_with_parent() -> None:
    """Ask the system to kill this process when the thread that started it ends. Only Linux can do that."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


def hide_memory(*, hidden: bool) -> None:
    """Let no other process of the user read or change the memory of this one, or let them. Only Linux can do that."""
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_DUMPABLE, int(not hidden), 0, 0, 0)


def limit_memory(megabytes: int) -> None:
    """Limit the address space of this process beyond what it has, and write no image of it when it crashes."""
    _lower("RLIMIT_CORE", 0)
    with open("/proc/self/statm" if os.path.exists("/proc/self/statm") else os.devnull) as file:
        pages = int((file.read().split() or ["0"])[0])
    _lower("RLIMIT_AS", pages * PAGESIZE + megabytes * MEGABYTE)


def _lower(name: str, value: int) -> None:
    """Lower a limit of this process, unless it is lower already; not every system has it."""
    with suppress(ImportError, AttributeError, OSError, ValueError):
        import resource

        number = getattr(resource, name)
        _, most = resource.getrlimit(number)
        value = value if most == resource.RLIM_INFINITY else min(value, most)
        resource.setrlimit(number, (value, value))


def address_space() -> float:
    """Return the bytes of memory that this process may address."""
    with suppress(ImportError, AttributeError):
        import resource

        most, _ = resource.getrlimit(resource.RLIMIT_AS)
        return inf if most == resource.RLIM_INFINITY else most
    return inf


@cache
def landlock_version() -> int:
    """Return the version of Landlock's interface here; 0 if there is none, or nothing that calls it."""
    if sys.platform != "linux":
        return 0
    try:
        import landlockpy
    except ImportError:
        return 0
    return int(landlockpy.abi_version())


def _keep_to(paths: Sequence[str]) -> None:
    """Let this process write to these paths alone, and to devices that swallow; `NETWORK` lets it use the network.

    It may read what the user may read, and it sees other processes: the rules hold for what it writes, for TCP, and
    from Linux 6.12 on for signals. Nothing is done where there is no Landlock.
    """
    if not landlock_version():
        return
    from landlockpy import AccessFS, AccessNet, Ruleset, Scope, fs_for_abi, net_for_abi

    writing = fs_for_abi(landlock_version()) & ~(AccessFS.READ_FILE | AccessFS.READ_DIR | AccessFS.EXECUTE)
    of_files = AccessFS.WRITE_FILE | AccessFS.TRUNCATE | AccessFS.IOCTL_DEV
    net, scope = net_for_abi(landlock_version()), Scope.ABSTRACT_UNIX_SOCKET | Scope.SIGNAL
    if NETWORK in paths:
        net, scope = AccessNet.NONE, Scope.SIGNAL
    with Ruleset(handled_fs=writing, handled_net=net, scoped=scope) as rules:
        for path in (os.devnull, *paths):
            if os.path.exists(path):
                rules.allow_path(path, writing if os.path.isdir(path) else of_files)
        rules.restrict()


@contextmanager
def one_thread_for_children() -> Iterator[None]:
    """Open a block in which processes that this one starts find the variables of `ONE_THREAD`."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value
