"""A journal: the folder beside an output file from which a killed run, shard or bench goes on.

It has a `header`, the plan, and a file of records for each process that writes, so that writers need no lock. A record
is a length, a CRC-32 and a message of MessagePack, decoded by a schema: a journal may come from a stranger.
At every moment, even if the process is killed, the folder has its whole header, or it is not there.
"""

import errno
import os
import re
import shutil
import struct
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from hashlib import blake2b
from pathlib import Path
from secrets import compare_digest, token_bytes, token_hex
from typing import IO, Any, TypeVar

import msgspec
import psutil

from contactverif.contract.errors import MisuseError

_RECORDS, _HEADER, _EARLIER, _SIGNATURE = ".outcomes", "header", "earlier", "signature"
_KEY_SIZE = 32  # Bytes.
_FRAME = struct.Struct("<II")
_LARGEST = 2**26  # The largest record, in bytes.
_Record = TypeVar("_Record", bound=msgspec.Struct)


class RecordFile:
    """A new file of records in a journal, for this process alone. After an error of the disk it writes no more."""

    def __init__(self, folder: Path) -> None:
        self.write_error = ""
        self.forms: dict[Any, int] = {}  # The places of records to which later ones refer.
        self._end = 0
        self._file: IO[bytes] | None = None
        try:
            self._file = (folder / f"{os.getpid()}-{token_hex(4)}{_RECORDS}").open("xb", buffering=0)
        except OSError as error:
            self._stop(error)

    def append(self, message: bytes) -> int | None:
        """Append a record, and return its place in bytes; None if it does not stand there whole.

        It goes to the operating system at once: a process that is killed loses none.
        """
        if self._file is None or len(message) > _LARGEST:
            return None
        place, data = self._end, _frame(message)
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

    def close(self) -> None:
        """Close the file, once the operating system has written it to the disk."""
        self.sync()
        if self._file is not None:
            self._file.close()
            self._file = None

    def sync(self) -> None:
        """Let the operating system write the file to the disk."""
        if self._file is not None:
            try:
                os.fsync(self._file.fileno())
            except OSError as error:
                self._stop(error)

    def _stop(self, error: OSError) -> None:
        self.write_error = error.strerror or str(error)
        if self._file is not None:
            with suppress(OSError):  # The reader cuts off what is not whole.
                os.ftruncate(self._file.fileno(), self._end)
            self._file.close()
            self._file = None


def _frame(message: bytes) -> bytes:
    return _FRAME.pack(len(message), zlib.crc32(message)) + message


def record_files(folder: Path) -> list[Path]:
    """Return the files of records of a journal."""
    return sorted(path for path in folder.glob(f"*{_RECORDS}") if path.is_file())  # A pipe would wait for a writer.


def read_messages(path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield place and message of each whole record, up to the first that is damaged."""
    with path.open("rb") as file:
        place = 0
        while (message := read_message(file)) is not None:
            yield place, message
            place += _FRAME.size + len(message)


def read_message(file: IO[bytes], place: int | None = None) -> bytes | None:
    """Return the message of the next record, or of that at a place; None if it is not whole, or there is none."""
    if place is not None:
        file.seek(place)
    head = file.read(_FRAME.size)
    if len(head) < _FRAME.size:
        return None
    length, checksum = _FRAME.unpack(head)
    message = file.read(length) if length <= _LARGEST else b""
    return message if len(message) == length and zlib.crc32(message) == checksum else None


def write_record(path: Path, record: msgspec.Struct) -> None:
    """Write a file with one record, whole and on the disk."""
    part = path.with_name(f".{path.name}.part")
    with part.open("wb") as file:
        file.write(_frame(msgspec.msgpack.encode(record, enc_hook=os.fspath)))
        file.flush()
        os.fsync(file.fileno())
    part.replace(path)


def read_record(path: Path, kind: type[_Record]) -> _Record | None:
    """Return the one record of a file; None if it is damaged. Without such a file there is an `OSError`."""
    if not path.is_file():
        raise FileNotFoundError(path)
    with path.open("rb") as file:
        message = read_message(file)
        decoder = msgspec.msgpack.Decoder(kind, dec_hook=lambda kind, value: kind(value))  # Of paths.
        return None if message is None or file.read(1) else decode(message, decoder)


def decode(message: bytes, decoder: msgspec.msgpack.Decoder[_Record]) -> _Record | None:
    """Return the record of a message; None if it is none of these."""
    try:
        return decoder.decode(message)
    except (msgspec.MsgspecError, ValueError, TypeError, RecursionError):
        return None


def journal_folder(output: Path, argument: str = "--out") -> Path:
    """Return the folder of the journal of an output file; of a link, that beside the file itself."""
    try:
        output.stat()
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise MisuseError(argument, f"{output.name}, a link that leads to itself", "another name") from None
    target = output.resolve()
    return target.with_name(f"{target.name}.journal")


@contextmanager
def new_journal(folder: Path, plan: msgspec.Struct, outputs: Sequence[Path] = ()) -> Iterator[str]:
    """Open a block with a new journal, which no other process may use, and into which earlier output files are moved.

    Yield the name of the folder to which the journal of an earlier run went; empty if there was none. If a
    `MisuseError` ends the block before anything was judged, all is as it was before.
    """
    aside = _aside(folder)
    had_one = folder.exists() or folder.is_symlink()
    with ExitStack() as locks:
        try:
            if had_one:
                with hold_journal(folder, "--out"):
                    shutil.rmtree(aside, ignore_errors=True)
                    folder.replace(aside)
            _remove_stale(folder)
            part = folder.with_name(f".{folder.name}.{os.getpid()}.part")
            part.mkdir()
            write_record(part / _HEADER, plan)
            with suppress(OSError):  # Without a key the user types again what matters.
                (part / _SIGNATURE).write_bytes(_sign(part))
            locks.enter_context(hold_journal(part, "--out"))
            part.replace(folder)
            for path in aside.glob(f"{_EARLIER}.*"):
                path.replace(folder / path.name)
            keep_earlier(folder, outputs)
        except OSError as error:
            needed = "a folder that may be written to, and a disk that is not full"
            raise MisuseError("--out", f"{folder.name}: {error.strerror}", needed) from error
        try:
            yield aside.name if had_one else ""
        except MisuseError:
            if not any(path.stat().st_size for path in record_files(folder)):
                for target in (output.resolve() for output in outputs):
                    earlier = folder / f"{_EARLIER}{target.suffix}"
                    if earlier.exists() and not target.exists():
                        earlier.replace(target)
                shutil.rmtree(folder, ignore_errors=True)
                if aside.exists():
                    aside.replace(folder)
            raise


def key_file() -> Path:
    """Return the file of the key with which this user signs journals, and which no plugin in a box sees."""
    return Path(os.environ.get("XDG_STATE_HOME") or os.path.expanduser("~/.local/state"), "contactverif", "key")


def is_own(folder: Path) -> bool:
    """Return whether this user has begun a journal here: anybody may write one, but who has the key signs it."""
    path = folder / _SIGNATURE
    with suppress(OSError):
        return path.is_file() and compare_digest(path.read_bytes(), _sign(folder))
    return False


def _sign(folder: Path) -> bytes:
    """Return a digest of the header of a journal under the key of this user, which is made where there is none."""
    path = key_file()
    if not path.is_absolute():
        raise OSError("nobody knows the home of this user")
    if not path.exists():
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        part = path.with_name(token_hex(4))
        part.touch(0o600)
        part.write_bytes(token_bytes(_KEY_SIZE))
        part.replace(path)
    key = path.read_bytes()
    if len(key) != _KEY_SIZE:
        raise OSError(f"{path} is no key")
    return blake2b((folder / _HEADER).read_bytes(), key=key).digest()


def _remove_stale(folder: Path) -> None:
    name = re.compile(rf"\.{re.escape(folder.name)}\.(\d{{1,9}})\.part")
    for path in list(folder.parent.iterdir()):
        match = name.fullmatch(path.name)
        if match and (int(match[1]) == os.getpid() or not psutil.pid_exists(int(match[1]))):
            shutil.rmtree(path, ignore_errors=True)


def keep_earlier(folder: Path, outputs: Iterable[Path]) -> None:
    """Move the output files of an earlier run into the journal, so that they are not taken for those of this run."""
    for target in (output.resolve() for output in outputs):
        if target.exists():
            target.replace(folder / f"{_EARLIER}{target.suffix}")


def remove_journal(folder: Path) -> None:
    """Remove a journal whose output is complete, with what it kept of earlier runs."""
    for path in (folder, _aside(folder)):
        shutil.rmtree(path, ignore_errors=True)


def _aside(folder: Path) -> Path:
    return folder.with_name(f"{folder.name}.{_EARLIER}")


@contextmanager
def hold_journal(folder: Path, argument: str) -> Iterator[str]:
    """Open a block in which no other process uses a journal that is there, where the file system has locks.

    The lock ends with the process, whatever ends that. Yield an empty name, as `new_journal` does if none was there.
    """
    try:
        import fcntl
    except ImportError:  # Windows has none.
        yield ""
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
        yield ""


def _check_there(folder: Path, argument: str) -> None:
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
