"""Forged journals of one run: records that are changed by somebody who knows the format, but not the key."""

import secrets
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec

from contactverif.contract.property import Verdict
from contactverif.contract.result import Run
from contactverif.journals.journal import JournalKey, read_messages, record_files
from contactverif.journals.outcome_records import BlockRecord, FormRecord, OutcomeRecord
from contactverif.journals.run_journal import Journal
from contactverif.journals.run_plan import Plan
from contactverif.plugins.provenance import machine
from contactverif.plugins.registry import load_formulation, load_properties
from contactverif.run.run import run

IDS = ("balance.force", "patch.flat.transmission")
EXAMPLES, SEED = 12, 3
BOX: dict[str, object] = {"isolation": {"isolation": "box"}}  # No plugin can read the key of such a run.
Record = FormRecord | OutcomeRecord | BlockRecord
_DECODER: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(Record)
_TAG = 16


def read(path: Path) -> Iterator[tuple[int, Record]]:
    """Yield (place, record) of a file of records."""
    for place, message, _ in read_messages(path, JournalKey()):
        yield place, _DECODER.decode(message)


def frame(record: Record) -> bytes:
    """Return a record with a length and a checksum that are right, and a tag that is a guess."""
    body = secrets.token_bytes(_TAG) + msgspec.msgpack.encode(record)
    return struct.pack("<II", len(body), zlib.crc32(body)) + body


def plan_of(seed: int = SEED, options: dict[str, object] = BOX) -> Plan:
    return Plan(formulations=("nts",), properties=IDS, examples=EXAMPLES, seed=seed, machine=machine(), options=options)


def judge(journal: Journal, seed: int = SEED) -> Run:
    """Judge what the journal does not have."""
    return run([load_formulation("nts")], load_properties(IDS), examples=EXAMPLES, seed=seed, journal=journal)


def forge(journal: Path, change: Callable[[Record], Record]) -> None:
    """Write all records of a journal anew, changed, into the same files; forms are where they were."""
    for path in record_files(journal):
        records = list(read(path))
        data, places = b"", dict[int, int]()
        for place, record in records:
            changed = change(record)
            if isinstance(changed, OutcomeRecord):
                changed = msgspec.structs.replace(changed, form=places.get(changed.form, changed.form))
            places[place] = len(data)
            data += frame(changed)
        path.write_bytes(data)


def say_pass(record: Record) -> Record:
    """Return the form of a failure as that of a pass, with the same numbers."""
    if isinstance(record, FormRecord) and record.form.verdict is Verdict.FAIL:
        return FormRecord(record.form._replace(verdict=Verdict.PASS, reason=""))
    return record


def scale_numbers(record: Record) -> Record:
    """Return an outcome with other numbers."""
    if not isinstance(record, OutcomeRecord):
        return record
    count = len(record.numbers) // 8
    numbers = struct.pack(f"<{count}d", *(2 * number for number in struct.unpack(f"<{count}d", record.numbers)))
    return msgspec.structs.replace(record, numbers=numbers)
