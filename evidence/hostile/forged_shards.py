"""Forge the headers of shards, merge them, and count what a run reached, wrote or excused that nobody typed.

`python evidence/hostile/forged_shards.py COUNT SEED` prints a table by kind. A merge must name what a shard asks for
and go on without it, or refuse the shard in one line.
"""

from __future__ import annotations

import os
import random
import re
import shutil
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgspec
from damage import Campaign, main, run_command
from damaged_reports import import_everything
from forged_records import IDS, forge_header

from contactverif.cli.verify import versions_of
from contactverif.contract.errors import MisuseError
from contactverif.run.journal import read_header, write_record
from contactverif.run.run_options import Isolation
from contactverif.run.store import Plan
from contactverif_reports.netcdf.read import read_run

ENDINGS = ("told", "refused", "obeyed", "silent", "traceback")
_SCENE = "from pathlib import Path\n\n\ndef make():\n    Path({!r}).touch()\n"

# {kind: the options that the header asks for, in a folder that a run must not touch}
KINDS: Mapping[str, Callable[[Path, random.Random], dict[str, Any]]] = {
    "isolation": lambda outside, chance: {"isolation": Isolation.INLINE},
    "open folders": lambda outside, chance: {
        "opened": chance.choice([("/etc",), ("network",), (str(outside.parent),)])
    },
    "pictures": lambda outside, chance: {"pictures": outside},
    "known failures": lambda outside, chance: {"known": {chance.choice(IDS): "as ever"}},
    "limits": lambda outside, chance: {
        "time_limit": chance.choice([0.0, -1.0, 1e-9, float("nan"), float("inf")]),
        "memory_limit": chance.choice([0, -1, 1, 2**62]),
    },
    "a mesh": lambda outside, chance: {"mesh": outside.with_suffix(".msh"), "slave": "a", "master": "b"},
    "a scene file": lambda outside, chance: {"scene_file": f"{outside.with_suffix('.py')}:make"},
    "a library": lambda outside, chance: {"names": ("nts", f"{chance.choice(['c', 'uel', 'feap'])}:file={outside}.so")},
    "a program": lambda outside, chance: {"names": ("nts", f"engine/calculix:program={outside.with_suffix('.sh')}")},
    "a run without end": lambda outside, chance: {"examples": chance.choice([2**40, 2**62, -1])},
    "a pipe": lambda outside, chance: {},
}


def forge_versions(shard: Path) -> None:
    """Let the header of a shard have the digests of what it asks for, as somebody would who has the same files."""
    plan = read_header(shard, Plan, "")
    with suppress(MisuseError):
        write_record(shard / "header", msgspec.structs.replace(plan, versions=versions_of(plan.options)))


class Forgery(Campaign):
    """A campaign of one shard, and how merges of forgeries of it ended."""

    head, endings, harmful = "a shard asks for", ENDINGS, frozenset(ENDINGS[2:])
    kinds = tuple(KINDS)

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        import_everything()
        self.outside = folder / "outside"  # Whatever obeys a header makes it.
        self.outside.with_suffix(".py").write_text(_SCENE.format(str(self.outside)), encoding="utf-8")
        script = self.outside.with_suffix(".sh")
        script.write_text(f"#!/bin/sh\ntouch {self.outside}\n", encoding="utf-8")
        script.chmod(0o700)
        words = ["campaign", "nts", *(word for name in IDS for word in ("-p", name)), "--examples", "12"]
        ending = run_command([*words, "--shard", "1/1", "--out", str(folder / "whole"), "--isolation", "process"], 600)
        assert ending.status == 0, ending.errors

    def attack(self, kind: str, chance: random.Random, name: str = "") -> str:
        """Merge a forged copy, and return how that ended."""
        shards, report = self.folder / "shards", self.folder / "r.nc"
        shutil.rmtree(shards, ignore_errors=True)
        shutil.rmtree(self.outside, ignore_errors=True)
        for path in (report, self.outside):
            path.unlink(missing_ok=True)
        shutil.copytree(self.folder / "whole", shards)
        (shard,) = shards.iterdir()
        if kind == "a pipe":
            path = chance.choice([shard / "header", shard / "done", *shard.glob("*.outcomes")])
            path.unlink()
            os.mkfifo(path)
        else:
            forge_header(shard, **KINDS[kind](self.outside, chance))
            forge_versions(shard)
        ending = run_command(["merge", str(shards), "--isolation", "process", "--out", str(report)])
        if ending.status not in (0, 1, 2) or "Traceback" in ending.errors:
            print(ending.errors, file=sys.stderr)
            return self.add(kind, "traceback")
        if self.outside.exists() or (report.exists() and not self._is_that_of_the_user(report)):
            return self.add(kind, "obeyed")
        if re.fullmatch("contactverif: [^ ]+: found .*; needed .*\n", ending.errors):
            return self.add(kind, "refused")
        return self.add(kind, "told" if "does not get it; type it to allow it" in ending.errors else "silent")

    @staticmethod
    def _is_that_of_the_user(report: Path) -> bool:
        run = read_run(report)
        place = run.provenance["isolation"]
        return place == "process" and not any(row.known for row in run.rows) and run.promises_kept


if __name__ == "__main__":
    main(Forgery, count=100)
