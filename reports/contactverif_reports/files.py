"""A file is written whole or not at all: to a temporary name in the same folder, then renamed."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from contactverif.contract.errors import MisuseError


def checked_name(path: str | os.PathLike[str], suffixes: Sequence[str], argument: str = "path") -> Path:
    """The path, if its name ends as a file of that kind does.

    Raises
    ------
    MisuseError
        If it does not.
    """
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        raise MisuseError(argument, f"{os.fspath(path)!r}", f"a name that ends in {' or '.join(suffixes)}")
    return target


def check_writable(path: str | os.PathLike[str], argument: str = "--out", form: str = "FILE.nc") -> None:
    """Says before something takes long what would stop its file from being written after it.

    Parameters
    ----------
    argument : str
        How the caller calls the path.
    form : str
        What a name of such a file looks like.

    Raises
    ------
    MisuseError
        If there is no such folder, nothing may be written there, or the path is no ordinary file.
    """
    found = os.fspath(path)
    target = Path(path).resolve()
    if not found or found.endswith(os.sep):
        raise MisuseError(argument, f"{found!r}, which names no file", f"the name of a file, {form}")
    if target.is_dir():
        raise MisuseError(argument, f"{found}, a folder", f"the name of a file, {form}")
    if target.exists() and not target.is_file():
        raise MisuseError(argument, f"{found}, which is no ordinary file", f"the name of a file, {form}")
    if not target.parent.is_dir():
        raise MisuseError(argument, f"{found} in {target.parent}, which is no folder", "a folder that exists")
    if target.exists() and not os.access(target, os.W_OK):
        raise MisuseError(argument, f"{found}, which is write-protected", "a file that may be replaced")
    part = _part(target)
    try:
        part.touch()
        part.unlink()
    except OSError as error:
        raise MisuseError(
            argument, f"{found}: {error.strerror}", "a folder that may be written to, and a name of usual length"
        ) from error


def made_folder(folder: Path, argument: str) -> None:
    """Makes the folder, and those above it, if it is not there.

    Raises
    ------
    MisuseError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise MisuseError(argument, f"{folder}, which is no folder", "a folder that can be written") from None
    except OSError as error:
        raise MisuseError(argument, f"{folder} ({error.strerror})", "a folder that can be written") from None


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary file to write to, which takes the place of `path` when the block ends well.

    Whatever stops it (an exception, a signal, a full disk) leaves the file that was there as it was; a temporary
    `.NAME.PID.part` that a killed process left behind is removed by the next one that writes the same name.
    """
    target = Path(path).resolve()
    _remove_stale(target)
    part = _part(target)
    try:
        yield part
        _sync(part)
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)
    _sync(target.parent)


def _part(target: Path) -> Path:
    return target.with_name(f".{target.name}.{os.getpid()}.part")


def _remove_stale(target: Path) -> None:
    """Removes what killed processes left of their files of the same name."""
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
