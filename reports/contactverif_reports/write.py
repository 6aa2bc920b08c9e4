"""A report is written whole or not at all: to a temporary name in the same folder, then renamed."""

from __future__ import annotations

import os
import re
from pathlib import Path

from contactverif.errors import MisuseError
from contactverif.result import Run

_ARGUMENT = "--report"


def check_writable(path: str | os.PathLike[str]) -> None:
    """Says before a run what would stop its report from being written after it.

    Raises
    ------
    MisuseError : if there is no such folder, nothing may be written there, or the path is no ordinary file.
    """
    found = os.fspath(path)
    target = Path(path).resolve()
    if not found or found.endswith(os.sep):
        raise MisuseError(_ARGUMENT, f"{found!r}, which names no file", "the name of a file, FILE.nc")
    if target.is_dir():
        raise MisuseError(_ARGUMENT, f"{found}, a folder", "the name of a file, FILE.nc")
    if target.exists() and not target.is_file():
        raise MisuseError(_ARGUMENT, f"{found}, which is no ordinary file", "the name of a file, FILE.nc")
    if not target.parent.is_dir():
        raise MisuseError(_ARGUMENT, f"{found} in {target.parent}, which is no folder", "a folder that exists")
    if target.exists() and not os.access(target, os.W_OK):
        raise MisuseError(_ARGUMENT, f"{found}, which is write-protected", "a file that may be replaced")
    part = _part(target)
    try:
        part.touch()
        part.unlink()
    except OSError as error:
        raise MisuseError(
            _ARGUMENT, f"{found}: {error.strerror}", "a folder that may be written to, and a name of usual length"
        ) from error


def write(run: Run, path: str | os.PathLike[str]) -> None:
    """Writes the report of a run, replacing a file that is there.

    Whatever stops it (an exception, a signal, a full disk) leaves the file that was there as it was; a temporary
    `.NAME.nc.PID.part` that a killed process left behind is removed by the next `write` to the same name.

    Raises
    ------
    MisuseError : if the path cannot be written; the same as `check_writable`.
    """
    from contactverif_reports.tree import tree_of

    check_writable(path)
    target = Path(path).resolve()
    _remove_stale(target)
    part = _part(target)
    try:
        tree_of(run).to_netcdf(part, engine="netcdf4", format="NETCDF4")
        _sync(part)
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)
    _sync(target.parent)


def _part(target: Path) -> Path:
    return target.with_name(f".{target.name}.{os.getpid()}.part")


def _remove_stale(target: Path) -> None:
    """Removes what killed processes left of their reports of the same name."""
    name = re.compile(rf"\.{re.escape(target.name)}\.(\d+)\.part")
    for entry in target.parent.iterdir():
        match = name.fullmatch(entry.name)
        if match and not _alive(int(match[1])):
            entry.unlink(missing_ok=True)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _sync(path: Path) -> None:
    """Has the operating system put the file, or the names in the folder, on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
