"""The records of a journal, and the file that one process appends them to.

A record is eight bytes (its length and its CRC-32) and a message of MessagePack, which is decoded by a schema: a
journal may come from a stranger. A file is read up to its first damaged record. Each process writes a file of its own,
so that no lock is needed, and hands each record to the operating system at once: a process that is killed loses none.

Rule for the next editor: a change of a record is a new `FORMAT`.
"""

from __future__ import annotations

import os
import struct
import zlib
from array import array
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from secrets import token_hex
from typing import IO, Any

import msgspec

from contactverif.contract.property import Outcome
from contactverif.run.outcome_forms import OutcomeForm, put_together, take_apart

FORMAT = 1
SUFFIX = ".outcomes"
WITNESS = -1  # The number of the outcome of a row's witness.
_FRAME = struct.Struct("<II")
_LARGEST = 2**26  # The largest record, in bytes.
_MOST_FORMS = 10_000  # The most forms that a process remembers.


class FormRecord(msgspec.Struct, frozen=True, array_like=True, tag="form"):
    """The form of outcomes that stand behind it in the same file.

    Attributes
    ----------
    form : OutcomeForm
        The form.
    """

    form: OutcomeForm


class OutcomeRecord(msgspec.Struct, frozen=True, array_like=True, tag="outcome"):
    """The outcome of one case.

    Attributes
    ----------
    row, number : int
        The numbers of the row in the plan and of the case in the row; `WITNESS` for its witness.
    form : int
        The place of the form in the file, in bytes.
    numbers : bytes
        The numbers, as little-endian float64.
    """

    row: int
    number: int
    form: int
    numbers: bytes


class BlockRecord(msgspec.Struct, frozen=True, array_like=True, tag="block"):
    """A block of cases that was drawn.

    Attributes
    ----------
    group : str
        The name of the cases' source and seed.
    number : int
        The number of the block.
    count : int
        The number of its cases.
    exhausted, last : bool
        The attributes of `DrawnCases`.
    """

    group: str
    number: int
    count: int
    exhausted: bool
    last: bool


Record = FormRecord | OutcomeRecord | BlockRecord
_ENCODER = msgspec.msgpack.Encoder(enc_hook=str)  # Words of a property may be of a type of their own.
_DECODER: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(Record)


class RecordWriter:
    """The file that this process appends records to. After the first error of the disk it writes no more.

    Parameters
    ----------
    folder : Path
        The folder of the journal.

    Attributes
    ----------
    trouble : str
        What went wrong; empty if nothing did.
    """

    def __init__(self, folder: Path) -> None:
        self.trouble = ""
        self._forms: dict[OutcomeForm, int] = {}
        self._end = 0
        self._file: IO[bytes] | None = None
        try:
            self._file = (folder / f"{os.getpid()}-{token_hex(4)}{SUFFIX}").open("xb", buffering=0)
        except OSError as error:
            self._stop(error)

    def add_outcome(self, row: int, number: int, outcome: Outcome) -> None:
        """Append the outcome of a case."""
        form, numbers = take_apart(outcome)
        if form not in self._forms:
            if len(self._forms) >= _MOST_FORMS:
                self._forms.clear()
            place = self._end
            if not self._append(FormRecord(form)):
                return
            self._forms[form] = place
        self._append(OutcomeRecord(row, number, self._forms[form], array("d", numbers).tobytes()))

    def add_block(self, block: BlockRecord) -> None:
        """Append a block that was drawn."""
        self._append(block)

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

    def _append(self, record: Record) -> bool:
        """Append a record; return whether it stands there whole."""
        if self._file is None:
            return False
        message = _encode(record)
        if len(message) > _LARGEST:  # It is judged again when the run goes on.
            return False
        data = _FRAME.pack(len(message), zlib.crc32(message)) + message
        try:
            written = self._file.write(data)
            if written < len(data):  # The next attempt says what is wrong.
                self._file.write(data[written:])
                raise OSError("the disk took only a part of a record")
        except OSError as error:
            self._stop(error)
            return False
        self._end += len(data)
        return True

    def _stop(self, error: OSError) -> None:
        """Note the error, and leave the file with whole records."""
        self.trouble = error.strerror or str(error)
        if self._file is not None:
            with suppress(OSError):  # The reader cuts off what is not whole.
                os.ftruncate(self._file.fileno(), self._end)
            self.close()


def _encode(record: Record) -> bytes:
    try:
        return _ENCODER.encode(record)
    except UnicodeEncodeError:  # Words of a plugin may hold half of a character.
        assert isinstance(record, FormRecord)
        form = msgspec.to_builtins(record.form)
        return _ENCODER.encode(("form", _writable(form)))


def _writable(item: Any) -> Any:
    """Return words and tuples of words in which what is no character is spelled out."""
    if isinstance(item, str):
        return item.encode("utf-8", "backslashreplace").decode()
    return [_writable(part) for part in item] if isinstance(item, list | tuple) else item


def read_records(path: Path) -> Iterator[tuple[int, Record]]:
    """Yield (place in bytes, record) of each whole record, up to the first that is damaged."""
    with open(path, "rb") as file:
        place = 0
        while (record := _read_next(file)) is not None:
            yield place, record
            place = file.tell()


def _read_next(file: IO[bytes]) -> Record | None:
    head = file.read(_FRAME.size)
    if len(head) < _FRAME.size:
        return None
    length, checksum = _FRAME.unpack(head)
    if length > _LARGEST:
        return None
    message = file.read(length)
    if len(message) < length or zlib.crc32(message) != checksum:
        return None
    try:
        record: Record = _DECODER.decode(message)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return None
    return record


def read_record_at(file: IO[bytes], place: int) -> Record | None:
    """Return the record at a place of a file; None if it is not whole, or there is none."""
    file.seek(place)
    return _read_next(file)


def outcome_of(record: OutcomeRecord, form: OutcomeForm) -> Outcome | None:
    """Return the outcome of a record and its form; None if they do not belong together."""
    if len(record.numbers) % array("d").itemsize:
        return None
    numbers = array("d", record.numbers)
    try:
        return put_together(form, numbers.tolist()) if form.n_numbers == len(numbers) else None
    except (ValueError, OverflowError):  # Such as NaN segments.
        return None
