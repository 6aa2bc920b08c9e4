"""Forge and damage journals, go on with them, and count what is believed of them.

`python evidence/hostile/forged_journals.py COUNT SEED` prints a table by kind. A run that goes on must come to what it
would have come to without the forgery, name the rows that differ, and never end in a traceback. Here all stored
outcomes are judged again, and not only a random share of them, which meets a single forged one by chance alone.
"""

from __future__ import annotations

import random
import shutil
import traceback
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import msgspec
from damage import BYTES, Campaign, main
from forged_records import EXAMPLES, SEED, Record, frame, judge, plan_of, read, say_pass, scale_numbers

from contactverif.contract.errors import MisuseError
from contactverif.contract.result import Run
from contactverif.run import recheck
from contactverif.run.journal import new_journal, record_files
from contactverif.run.store import OutcomeRecord, Store

ENDINGS = ("named", "judged again", "refused", "believed", "traceback")
HARM = frozenset(ENDINGS[-2:])
_Change = Callable[[Record, random.Random], Record]


def facts(result: Run) -> list[str]:
    """Return what a run came to, without its seconds."""
    return [
        f"{row.verdict} {row.reason} {row.planned} {row.witness and (row.witness.verdict, row.witness.measurement)} "
        f"{[(each.verdict, each.reason, each.measurement, each.summary) for each in row.outcomes]}"
        for row in result.rows
    ]


def _other_seed(folder: Path, chance: random.Random, others: Path) -> None:
    """Put the records of a run with another seed into the file."""
    (path,) = record_files(folder)
    shutil.copy(record_files(others / "seed")[0], path)


def _records(change: _Change, share: float = 0.2) -> Callable[[Path, random.Random, Path], None]:
    """Return a forgery that changes some records, with right lengths, checksums and places of forms."""

    def forge(folder: Path, chance: random.Random, others: Path) -> None:
        (path,) = record_files(folder)
        data, places, whole = b"", dict[int, int](), path.read_bytes()
        records = list(read(path))
        ends = [*(place for place, _ in records[1:]), len(whole)]
        selection = {chance.randrange(len(records))}
        for number, ((place, record), end) in enumerate(zip(records, ends, strict=True)):
            changed = change(record, chance) if number in selection or chance.random() < share else record
            if isinstance(changed, OutcomeRecord):
                changed = msgspec.structs.replace(changed, form=places.get(changed.form, changed.form))
            places[place] = len(data)
            data += whole[place:end] if changed is record else frame(changed)
        path.write_bytes(data)

    return forge


def _bytes(change: Callable[[bytes, random.Random], bytes]) -> Callable[[Path, random.Random, Path], None]:
    def damage(folder: Path, chance: random.Random, others: Path) -> None:
        path = chance.choice([*record_files(folder), folder / "header"])
        path.write_bytes(change(path.read_bytes(), chance))

    return damage


def _another(field: str, *values: int) -> _Change:
    def change(record: Record, chance: random.Random) -> Record:
        is_outcome = isinstance(record, OutcomeRecord)
        return msgspec.structs.replace(record, **{field: chance.choice(values)}) if is_outcome else record

    return change


KINDS: dict[str, Callable[[Path, random.Random, Path], None]] = {
    **{f"bytes: {kind}": _bytes(change) for kind, change in BYTES.items()},
    "another verdict": _records(lambda record, chance: say_pass(record), share=1.0),
    "other numbers": _records(lambda record, chance: scale_numbers(record)),
    "another row": _records(_another("row", 0, 1, -1, 2, 2**31, 2**62)),
    "another case": _records(_another("number", -1, 0, 5, EXAMPLES, -(2**40), 2**63)),
    "another form": _records(_another("form", 0, 1, -1, 2**40, 2**63)),
    "records of another seed": _other_seed,
}


class Forgery(Campaign):
    """A journal, and how runs ended that went on with a forgery of it."""

    head, endings, harmful = "forgery", ENDINGS, HARM
    kinds = tuple(KINDS)

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        for name, seed in (("seed", SEED + 1), ("whole", SEED)):
            with new_journal(folder / name, plan_of(seed)):
                result = judge(Store(plan_of(seed), folder / name), seed)
        self.right = facts(result)

    def attack(self, kind: str, chance: random.Random, name: str = "") -> str:
        """Go on with a forged copy, and return how that ended."""
        copy = self.folder / "copy"
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(self.folder / "whole", copy)
        KINDS[kind](copy, chance, self.folder)
        try:
            store = Store(plan_of(), None, [copy])
            with patch.object(recheck, "choose_share", lambda numbers, share=1.0: list(numbers)):
                result = judge(store)
        except MisuseError:
            return self.add(kind, "refused")
        except Exception:
            traceback.print_exc()
            return self.add(kind, "traceback")
        if facts(result) != self.right:
            return self.add(kind, "believed")
        return self.add(kind, "named" if store.remarks else "judged again")


if __name__ == "__main__":
    main(Forgery)
