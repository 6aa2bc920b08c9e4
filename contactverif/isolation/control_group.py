"""The control group of a box: all its processes together take so much memory, and are so many, at most.

Rule: a group is made where this user may make one, and nothing is said where not: then each process has limits alone.
"""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from time import monotonic, sleep, time

MOST_PROCESSES = 512  # Processes and threads.
_BASE = 512 << 20  # Bytes beyond the limit of memory, for Python and what it has loaded.
_PREFIX = "contactverif-"
_SECONDS_TO_END, _STEP = 10.0, 0.01
_SECONDS_TO_JOIN = 60.0
_ROOT = Path("/sys/fs/cgroup")
# The shell joins the groups, and becomes the program: from its first moment on all that it starts is in them.
_JOIN = 'while [ "$1" != -- ]; do echo $$ > "$1/cgroup.procs"; shift; done; shift; exec "$@"'


class ControlGroup:
    """The folders in which the system keeps a group, one for each thing that it limits; none where it may not be."""

    def __init__(self, megabytes: int) -> None:
        name = f"{_PREFIX}{uuid.uuid4().hex}"
        limits = {"memory": (megabytes << 20) + _BASE, "pids": MOST_PROCESSES}
        self.folders: list[Path] = []
        for controller, parent in _find_parents():
            _remove_abandoned(parent)
            with suppress(OSError):
                folder = parent / name
                folder.mkdir(exist_ok=True)
                self.folders += [folder] if folder not in self.folders else []
                _limit(folder, controller, limits[controller])

    def join(self, command: tuple[str, ...]) -> tuple[str, ...]:
        """Return the command that runs a command in the group."""
        return ("/bin/sh", "-c", _JOIN, "sh", *map(str, self.folders), "--", *command) if self.folders else command

    def remove(self) -> None:
        """Remove the group, once its processes have ended; the system takes a moment for that."""
        deadline = monotonic() + _SECONDS_TO_END
        while self.folders and not _remove(self.folders[-1]) and monotonic() < deadline:
            sleep(_STEP)
        self.folders = [folder for folder in self.folders if not _remove(folder)]


def _remove(folder: Path) -> bool:
    """Remove a group without processes; return whether it is gone."""
    with suppress(OSError):
        folder.rmdir()
    return not folder.exists()


def _remove_abandoned(parent: Path) -> None:
    """Remove the groups of runs that were killed; one that is new may be about to get its first process."""
    for folder in parent.glob(f"{_PREFIX}*"):
        with suppress(OSError):
            if time() - folder.stat().st_mtime > _SECONDS_TO_JOIN:
                folder.rmdir()


def _limit(folder: Path, controller: str, most: int) -> None:
    """Set the limit of a group, whose file has another name in each version of the system's interface."""
    names = ("memory.max", "memory.limit_in_bytes") if controller == "memory" else ("pids.max",)
    for name in names:
        if (folder / name).exists():
            (folder / name).write_text(str(most))


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


def may_group() -> bool:
    """Return whether a group can be made here."""
    return any(os.access(parent, os.W_OK) for _, parent in _find_parents())
