"""The folder for temporary files of plugins without a box, which goes with the judge's process or with the next one.

A process that is killed removes nothing. So each folder has a lock, which ends with the process that made it, whatever
ended that, and the next process removes the folders that nobody holds.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path

_PREFIX = "contactverif-plugins-"
_LOCK = ".held"
_locks: list[int] = []  # The descriptor of the lock of this process.


@cache
def plugin_folder() -> str:
    """Return the folder of this process of the judge."""
    for path in _list_abandoned():
        shutil.rmtree(path, ignore_errors=True)
    folder = tempfile.mkdtemp(prefix=_PREFIX)
    with suppress(OSError):
        _locks.append(os.open(os.path.join(folder, _LOCK), os.O_CREAT | os.O_RDWR, 0o600))
        _lock(_locks[-1])
    return folder


def remove_plugin_folder() -> None:
    """Remove the folder, if this process has one."""
    if plugin_folder.cache_info().currsize:
        shutil.rmtree(plugin_folder(), ignore_errors=True)
        plugin_folder.cache_clear()
    while _locks:
        os.close(_locks.pop())


def _list_abandoned() -> Iterator[Path]:
    """Yield the folders that no process holds any more."""
    for path in Path(tempfile.gettempdir()).glob(f"{_PREFIX}*"):
        with suppress(OSError):  # It belongs to another user, or a process has just made it or holds it.
            descriptor = os.open(path / _LOCK, os.O_RDWR)
            try:
                _lock(descriptor)
            finally:
                os.close(descriptor)
            yield path


def _lock(descriptor: int) -> None:
    """Lock an open file for this process alone, or raise an OSError."""
    try:
        import fcntl
    except ImportError:
        raise OSError("no locks on this system") from None
    fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
