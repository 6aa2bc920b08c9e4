"""The folder of a journal beside the file that a command will write: made, locked, read again, and removed at the end.

`FILE.nc.journal/` stands beside FILE.nc. Until the command has written FILE.nc anew, the folder also keeps the file of
an earlier run, so that nobody takes yesterday's report for today's. At every moment, even if the process is killed, the
folder is there with its whole header, or it is not there.
"""

from __future__ import annotations

import errno
import os
import shutil
import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import msgspec

from contactverif.contract.errors import MisuseError
from contactverif.run.journal_records import FORMAT
from contactverif.run.journal_records import SUFFIX as OUTCOMES
from contactverif.run.run_journal import Plan

SUFFIX = ".journal"
_HEADER = "header"
_EARLIER = "earlier"
_FRAME = struct.Struct("<II")
_Kind = TypeVar("_Kind", bound=msgspec.Struct)


def journal_folder(output: Path, argument: str = "--out") -> Path:
    """Return the folder of the journal of an output file; of a link, that beside the file itself.

    Raises
    ------
    MisuseError
        If the file is a link that leads to itself.
    """
    try:
        output.stat()
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise MisuseError(argument, f"{output.name}, a link that leads to itself", "another name") from None
    target = output.resolve()
    return target.with_name(target.name + SUFFIX)


def begin_journal(folder: Path, plan: Plan, outputs: Iterable[Path], argument: str = "--out") -> str:
    """Make a new journal, and move the files of an earlier run into it.

    Parameters
    ----------
    folder : Path
        The folder to make. A journal that is there is set aside.
    plan : Plan
        The plan of the run.
    outputs : Iterable[Path]
        The files that the run will write.
    argument : str
        The name of the argument in error messages.

    Returns
    -------
    str
        The name of the folder in which an earlier journal is now; empty if there was none.

    Raises
    ------
    MisuseError
        If the folder cannot be made, is no journal, or belongs to a run that is still going on.
    """
    aside = _aside(folder)
    had_one = folder.exists() or folder.is_symlink()
    try:
        if had_one:
            with hold_journal(folder, argument):
                shutil.rmtree(aside, ignore_errors=True)
                os.replace(folder, aside)
        part = folder.with_name(f".{folder.name}.{os.getpid()}.part")
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir()
        write_record(part / _HEADER, plan)
        os.replace(part, folder)
        for path in aside.glob(f"{_EARLIER}.*"):
            os.replace(path, folder / path.name)
        keep_earlier(folder, outputs)
    except OSError as error:
        needed = "a folder that may be written to, and a disk that is not full"
        raise MisuseError(argument, f"{folder.name}: {error.strerror}", needed) from error
    return aside.name if had_one else ""


def keep_earlier(folder: Path, outputs: Iterable[Path]) -> None:
    """Move the files of an earlier run into the journal."""
    for output in outputs:
        target = output.resolve()
        if target.exists():
            os.replace(target, folder / f"{_EARLIER}{target.suffix}")


def withdraw_journal(folder: Path, outputs: Iterable[Path]) -> None:
    """Take back what `begin_journal` did, if nothing was judged: the command line was wrong, as it turned out."""
    if any(path.stat().st_size for path in folder.glob(f"*{OUTCOMES}")):
        return
    for output in outputs:
        target = output.resolve()
        earlier = folder / f"{_EARLIER}{target.suffix}"
        if earlier.exists() and not target.exists():
            os.replace(earlier, target)
    shutil.rmtree(folder, ignore_errors=True)
    if _aside(folder).exists():
        os.replace(_aside(folder), folder)


def remove_journal(folder: Path) -> None:
    """Remove a journal whose report is complete, with what it kept of earlier runs."""
    for path in (folder, _aside(folder)):
        shutil.rmtree(path, ignore_errors=True)


def _aside(folder: Path) -> Path:
    return folder.with_name(f"{folder.name}.{_EARLIER}")


@contextmanager
def hold_journal(folder: Path, argument: str) -> Iterator[None]:
    """Open a block in which no other process goes on with this journal.

    The lock ends with the process, whatever ends that. Where a file system has no locks, there is none.

    Raises
    ------
    MisuseError
        If there is no journal, or another process goes on with it.
    """
    try:
        import fcntl
    except ImportError:  # Windows has none.
        yield
        return
    try:
        file = (folder / _HEADER).open("rb")
    except OSError:
        raise MisuseError(argument, f"{folder.name}, which is no journal of a run", "another name") from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise MisuseError(
                argument, f"{folder.name}, of a run that is going on", "its end, or another name"
            ) from None
        except OSError:
            pass
        yield


def read_plan(folder: Path, argument: str) -> Plan:
    """Return the plan of a journal.

    Raises
    ------
    MisuseError
        If there is no journal, or its header is damaged or of another format.
    """
    try:
        plan = read_record(folder / _HEADER, Plan)
    except OSError:
        raise MisuseError(argument, f"no journal {folder.name}", "that of a run that was stopped") from None
    if plan is None or plan.format != FORMAT:
        flaw = "a damaged header" if plan is None else f"format {plan.format}"
        raise MisuseError(argument, f"{folder.name} with {flaw}", f"a journal of format {FORMAT}")
    return plan


def check_versions(journal: Mapping[str, str], here: Mapping[str, str], argument: str) -> None:
    """Check that a run goes on with what it began with.

    Raises
    ------
    MisuseError
        If a version or a digest differs; the message names the first.
    """
    for name in sorted({*journal, *here}):
        if journal.get(name) != here.get(name):
            versions = f"{journal.get(name, 'nothing')} in the journal and {here.get(name, 'nothing')} here"
            raise MisuseError(argument, f"{name.replace('_', ' ')}: {versions}", "the same, or a new run")


def write_record(path: Path, record: msgspec.Struct) -> None:
    """Write a file with one record, whole and on the disk."""
    message = msgspec.msgpack.encode(record)
    part = path.with_name(f".{path.name}.part")
    with open(part, "wb") as file:
        file.write(_FRAME.pack(len(message), zlib.crc32(message)) + message)
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)


def read_record(path: Path, kind: type[_Kind]) -> _Kind | None:
    """Return the one record of a file; None if it is damaged.

    Raises
    ------
    OSError
        If there is no such file.
    """
    data = path.read_bytes()
    message = data[_FRAME.size :]
    if len(data) < _FRAME.size or _FRAME.unpack(data[: _FRAME.size]) != (len(message), zlib.crc32(message)):
        return None
    try:
        return msgspec.msgpack.decode(message, type=kind)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return None
