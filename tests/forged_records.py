"""Forged journals of one run: records that are changed by somebody who knows the format."""

import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec

from contactverif.contract.property import Verdict
from contactverif.contract.result import Run
from contactverif.plugins.provenance import machine
from contactverif.plugins.registry import load_formulation, load_properties
from contactverif.run.journal import read_messages, record_files, write_record
from contactverif.run.run import run
from contactverif.run.run_options import RunOptions
from contactverif.run.store import FormRecord, OutcomeRecord, Plan, RejectedRecord, Store, read_plan

IDS = ("balance.force", "patch.flat.transmission")
EXAMPLES, SEED = 12, 3
Record = FormRecord | OutcomeRecord | RejectedRecord
_DECODER: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(Record)


def read(path: Path) -> Iterator[tuple[int, Record]]:
    """Yield (place, record) of a file of records."""
    for place, message in read_messages(path):
        yield place, _DECODER.decode(message)


def frame(record: Record) -> bytes:
    """Return a record with a length and a checksum that are right."""
    message = msgspec.msgpack.encode(record)
    return struct.pack("<II", len(message), zlib.crc32(message)) + message


def plan_of(seed: int = SEED) -> Plan:
    options = RunOptions(names=("nts",), properties=IDS, examples=EXAMPLES, seed=seed)
    return Plan(options=options, machine=machine())


def judge(store: Store, seed: int = SEED) -> Run:
    """Judge what the store does not have."""
    return run([load_formulation("nts")], load_properties(IDS), examples=EXAMPLES, seed=seed, store=store)


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


def forge_header(journal: Path, **options: Any) -> None:
    """Let the header of a journal ask for other options."""
    plan = read_plan(journal, "")
    write_record(journal / "header", msgspec.structs.replace(plan, options=replace(plan.options, **options)))


def say_pass(record: Record) -> Record:
    """Return the form of a failure as that of a pass, with the same numbers."""
    if isinstance(record, FormRecord):
        case, verdict, _, *others = msgspec.msgpack.decode(record.form)
        if verdict == Verdict.FAIL.name:
            return FormRecord(msgspec.msgpack.encode([case, Verdict.PASS.name, "", *others]))
    return record


def scale_numbers(record: Record) -> Record:
    """Return an outcome with other numbers."""
    if not isinstance(record, OutcomeRecord):
        return record
    count = len(record.numbers) // 8
    numbers = struct.pack(f"<{count}d", *(2 * number for number in struct.unpack(f"<{count}d", record.numbers)))
    return msgspec.structs.replace(record, numbers=numbers)
