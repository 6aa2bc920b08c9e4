"""A file is written whole or not at all: to a temporary name in the same folder, then renamed."""

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import psutil

from contactverif.contract.errors import MisuseError

_LARGE = 2**26  # The size of a large file, in bytes.


def checked_name(path: str | os.PathLike[str], suffixes: Sequence[str], argument: str = "path") -> Path:
    """Return the path if its name ends as a file of that kind does."""
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        raise MisuseError(argument, f"{os.fspath(path)!r}", f"a name that ends in {' or '.join(suffixes)}")
    return target


def check_writable(path: str | os.PathLike[str], argument: str = "--out", form: str = "FILE.nc") -> None:
    """Check before a long computation that its file can be written afterwards."""
    name = os.fspath(path)
    target = Path(os.path.realpath(path))  # `resolve` raises an error for links that form a loop.
    file, is_there = f"the name of a file, {form}", target.exists()
    for wrong, words, needed in (
        (not name or name.endswith(os.sep), f"{name!r}, which names no file", file),
        (target.is_dir(), f"{name}, a folder", file),
        (is_there and not target.is_file(), f"{name}, which is no ordinary file", file),
        (not target.parent.is_dir(), f"{name} in {target.parent}, which is no folder", "a folder that exists"),
        (is_there and not os.access(target, os.W_OK), f"{name}, which is write-protected", "one that may be replaced"),
    ):
        if wrong:
            raise MisuseError(argument, words, needed)
    part = _part(target)
    try:
        part.touch()
        part.unlink()
    except OSError as error:
        needed = "a folder that may be written to, and a name of usual length"
        raise MisuseError(argument, f"{name}: {error.strerror}", needed) from error


def reason_not_to_grow(path: Path) -> str:
    """Return why a file in the folder of a path cannot become large, such as a full disk; empty if it can."""
    part = _part(path.resolve())
    try:
        with open(part, "wb") as file:
            os.posix_fallocate(file.fileno(), 0, _LARGE)
    except OSError as error:
        return error.strerror or ""
    finally:
        part.unlink(missing_ok=True)
    return ""


def made_folder(folder: Path, argument: str) -> None:
    """Make the folder, and those above it, if it does not exist."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = ", which is no folder" if isinstance(error, FileExistsError) else f" ({error.strerror})"
        raise MisuseError(argument, f"{folder}{reason}", "a folder that can be written") from None


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Open a block with a temporary file, which replaces `path` when the block ends without an error.

    Whatever stops it (an exception, a signal, a full disk) leaves the file that was there as it was; a temporary
    `.NAME.PID.part` that a killed process left behind is removed by the next one that writes the same name.
    """
    target = Path(os.path.realpath(path))
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
    name = re.compile(rf"\.{re.escape(target.name)}\.(\d{{1,9}})\.part")
    for entry in target.parent.iterdir():
        match = name.fullmatch(entry.name)
        if match and not psutil.pid_exists(int(match[1])):
            entry.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Let the operating system write the file, or the names in the folder, to the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
