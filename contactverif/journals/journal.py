"""The journal of a run or a bench: a folder beside its output file, from which a killed process goes on.

A journal has a `header`, the plan, and a file of records for each process that writes, so that no lock is needed. A
record is eight bytes (a length and a CRC-32, for damage), a tag, and a message of MessagePack, decoded by a schema: a
journal may come from a stranger. The tag is a digest of the message and its place under the key of the journal, so that
a record that is changed, moved or copied does not fit. At every moment, even if the process is killed, the folder has
its whole header, or it is not there.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
import struct
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from hashlib import blake2b
from pathlib import Path
from secrets import token_hex
from typing import IO, NamedTuple, TypeVar

import msgspec
import psutil

from contactverif.contract.errors import MisuseError
from contactverif.journals.keys import make_key, read_key, remove_key

SUFFIX = ".journal"
RECORDS = ".outcomes"
_HEADER = "header"
_EARLIER = "earlier"
_TAG = 16
_FRAME = struct.Struct("<II")
_LARGEST = 2**26  # The largest record, in bytes.
_NONCE = 16  # Bytes.
_Record = TypeVar("_Record", bound=msgspec.Struct)


class JournalKey(NamedTuple):
    """The identity of a journal, a digest of its header, and its key, which is empty if it is not here."""

    identity: str = ""
    key: bytes = b""

    @classmethod
    def read(cls, folder: Path) -> JournalKey:
        """Return the key of a journal; without a header it has none."""
        try:
            identity = blake2b((folder / _HEADER).read_bytes(), digest_size=32).hexdigest()
        except OSError:
            return cls()
        return cls(identity, read_key(identity))

    def tags(self, path: Path) -> RecordTags | None:
        """Return what makes the tags of a file of records; None without a key."""
        return RecordTags(self, path.name) if self.key else None


class RecordTags:
    """The maker of the tags of one file of records."""

    def __init__(self, key: JournalKey, name: str) -> None:
        self._start = blake2b(f"{key.identity}/{name}/".encode(), key=key.key, digest_size=_TAG)

    def tag(self, place: int, message: bytes) -> bytes:
        """Return the tag of the message of a record at a place of the file, in bytes."""
        digest = self._start.copy()
        digest.update(place.to_bytes(8, "little"))
        digest.update(message)
        return digest.digest()

    def fit(self, place: int, body: bytes) -> bool:
        """Return whether the tag in front of a message is that of its place."""
        return body[:_TAG] == self.tag(place, body[_TAG:])


class RecordFile:
    """A new file of records in a journal, for this process alone. After the first error of the disk it writes no more.

    `trouble` says what went wrong; it is empty if nothing did.
    """

    def __init__(self, folder: Path, key: JournalKey) -> None:
        self.trouble = ""
        self._end = 0
        self._file: IO[bytes] | None = None
        path = folder / f"{os.getpid()}-{token_hex(4)}{RECORDS}"
        self._tags = key.tags(path)
        try:
            self._file = path.open("xb", buffering=0)
        except OSError as error:
            self._stop(error)

    def append(self, message: bytes) -> int | None:
        """Append a record, and return its place in bytes; None if it does not stand there whole.

        It goes to the operating system at once: a process that is killed loses none.
        """
        if self._file is None or len(message) > _LARGEST:
            return None
        place = self._end
        data = _frame((self._tags.tag(place, message) if self._tags else bytes(_TAG)) + message)
        try:
            written = self._file.write(data)
            if written < len(data):  # The next attempt says what is wrong.
                self._file.write(data[written:])
                raise OSError("the disk took only a part of a record")
        except OSError as error:
            self._stop(error)
            return None
        self._end += len(data)
        return place

    def sync(self) -> None:
        """Let the operating system write the file to the disk."""
        if self._file is not None:
            try:
                os.fsync(self._file.fileno())
            except OSError as error:
                self._stop(error)

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _stop(self, error: OSError) -> None:
        """Note the error, and leave the file with whole records."""
        self.trouble = error.strerror or str(error)
        if self._file is not None:
            with suppress(OSError):  # The reader cuts off what is not whole.
                os.ftruncate(self._file.fileno(), self._end)
            self.close()


def record_files(folder: Path) -> list[Path]:
    """Return the files of records of a journal."""
    return sorted(folder.glob(f"*{RECORDS}"))


class StoredMessage(NamedTuple):
    """The message of a whole record."""

    place: int  # In bytes.
    message: bytes
    fits: bool  # Its tag fits the key, the file and the place.


def read_messages(path: Path, key: JournalKey) -> Iterator[StoredMessage]:
    """Yield the message of each whole record, up to the first that is damaged."""
    tags = key.tags(path)
    with open(path, "rb") as file:
        place = 0
        while (body := _read_body(file)) is not None:
            message = body[_TAG:]
            yield StoredMessage(place, message, tags is not None and tags.fit(place, body))
            place += _FRAME.size + len(body)


def read_message(file: IO[bytes], place: int) -> bytes | None:
    """Return the message of the record at a place; None if it is not whole, or there is none."""
    file.seek(place)
    body = _read_body(file)
    return None if body is None else body[_TAG:]


def _read_body(file: IO[bytes]) -> bytes | None:
    """Return the tag and the message of the next record; None if it is not whole, or there is none."""
    head = file.read(_FRAME.size)
    if len(head) < _FRAME.size:
        return None
    length, checksum = _FRAME.unpack(head)
    body = file.read(length) if length <= _LARGEST else b""
    return body if len(body) == length and zlib.crc32(body) == checksum else None


def write_record(path: Path, record: msgspec.Struct) -> None:
    """Write a file with one record, which has no tag, whole and on the disk."""
    part = path.with_name(f".{path.name}.part")
    with open(part, "wb") as file:
        file.write(_frame(msgspec.msgpack.encode(record)))
        file.flush()
        os.fsync(file.fileno())
    os.replace(part, path)


def read_record(path: Path, kind: type[_Record]) -> _Record | None:
    """Return the one record of a file; None if it is damaged. Without such a file there is an `OSError`."""
    with open(path, "rb") as file:
        message = _read_body(file)
        if message is None or file.read(1):
            return None
    return decode(message, msgspec.msgpack.Decoder(kind))


def decode(message: bytes, decoder: msgspec.msgpack.Decoder[_Record]) -> _Record | None:
    """Return the record of a message; None if it is none of these."""
    try:
        return decoder.decode(message)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return None


def _frame(body: bytes) -> bytes:
    return _FRAME.pack(len(body), zlib.crc32(body)) + body


def journal_folder(output: Path, argument: str = "--out") -> Path:
    """Return the folder of the journal of an output file; of a link, that beside the file itself."""
    try:
        output.stat()
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise MisuseError(argument, f"{output.name}, a link that leads to itself", "another name") from None
    target = output.resolve()
    return target.with_name(target.name + SUFFIX)


def begin_journal(folder: Path, plan: msgspec.Struct, outputs: Iterable[Path], argument: str = "--out") -> str:
    """Make a new journal with a key, and move the output files of an earlier run into it.

    The plan has a field `nonce`, which is set here, so that no two journals have the same identity. A journal that is
    there is set aside; the name of its folder is returned, which is empty if there was none. It must belong to no run
    that is going on.
    """
    aside = _aside(folder)
    had_one = folder.exists() or folder.is_symlink()
    try:
        if had_one:
            with hold_journal(folder, argument):
                _discard(aside)
                os.replace(folder, aside)
        _remove_stale(folder)
        part = folder.with_name(f".{folder.name}.{os.getpid()}.part")
        part.mkdir()
        write_record(part / _HEADER, msgspec.structs.replace(plan, nonce=token_hex(_NONCE)))
        make_key(JournalKey.read(part).identity)
        os.replace(part, folder)
        for path in aside.glob(f"{_EARLIER}.*"):
            os.replace(path, folder / path.name)
        keep_earlier(folder, outputs)
    except OSError as error:
        needed = "a folder that may be written to, and a disk that is not full"
        raise MisuseError(argument, f"{folder.name}: {error.strerror}", needed) from error
    return aside.name if had_one else ""


def _remove_stale(folder: Path) -> None:
    """Remove what processes left behind that were killed while they made a journal of this name."""
    name = re.compile(rf"\.{re.escape(folder.name)}\.(\d{{1,9}})\.part")
    for path in list(folder.parent.iterdir()):
        match = name.fullmatch(path.name)
        if match and (int(match[1]) == os.getpid() or not psutil.pid_exists(int(match[1]))):
            _discard(path)


def keep_earlier(folder: Path, outputs: Iterable[Path]) -> None:
    """Move the output files of an earlier run into the journal, so that they are not taken for those of this run."""
    for output in outputs:
        target = output.resolve()
        if target.exists():
            os.replace(target, folder / f"{_EARLIER}{target.suffix}")


def withdraw_journal(folder: Path, outputs: Iterable[Path]) -> None:
    """Take back what `begin_journal` did, if nothing was judged: the command line was wrong, as it turned out."""
    if any(path.stat().st_size for path in record_files(folder)):
        return
    for output in outputs:
        target = output.resolve()
        earlier = folder / f"{_EARLIER}{target.suffix}"
        if earlier.exists() and not target.exists():
            os.replace(earlier, target)
    _discard(folder)
    if _aside(folder).exists():
        os.replace(_aside(folder), folder)


def remove_journal(folder: Path) -> None:
    """Remove a journal whose output is complete, with what it kept of earlier runs."""
    for path in (folder, _aside(folder)):
        _discard(path)


def _discard(folder: Path) -> None:
    """Remove a journal and its key."""
    remove_key(JournalKey.read(folder).identity)
    shutil.rmtree(folder, ignore_errors=True)


def _aside(folder: Path) -> Path:
    return folder.with_name(f"{folder.name}.{_EARLIER}")


@contextmanager
def hold_journal(folder: Path, argument: str) -> Iterator[None]:
    """Open a block in which no other process goes on with this journal, where the file system has locks.

    The lock ends with the process, whatever ends that.
    """
    try:
        import fcntl
    except ImportError:  # Windows has none.
        yield
        return
    try:
        file = (folder / _HEADER).open("rb")
    except OSError:
        _check_there(folder, argument)
        raise MisuseError(argument, f"{folder.name}, which is no journal of a run", "another name") from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            needed = "its end, or another name"
            raise MisuseError(argument, f"{folder.name}, of a run that is going on", needed) from None
        except OSError:
            pass
        _check_there(folder, argument)
        yield


def _check_there(folder: Path, argument: str) -> None:
    """Check that no other process has completed the run, and removed the journal, since it was read."""
    if not folder.exists():
        reason = f"no journal {folder.name} any more, since another process has completed the run"
        raise MisuseError(argument, reason, "that of a run that was stopped")


def read_header(folder: Path, kind: type[_Record], argument: str) -> _Record:
    """Return the plan of a journal."""
    try:
        plan = read_record(folder / _HEADER, kind)
    except OSError:
        raise MisuseError(argument, f"no journal {folder.name}", "that of a run that was stopped") from None
    if plan is None:
        raise MisuseError(argument, f"{folder.name} with a damaged header", "an undamaged journal, or another name")
    return plan
