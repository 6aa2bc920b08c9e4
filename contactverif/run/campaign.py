"""The shards of a campaign: each judges a share of a run in a process of its own, and has a journal and nothing else.

The union of the journals of all shards is the journal of a run, with which `merge` goes on.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import msgspec

from contactverif.contract.errors import MisuseError
from contactverif.journals.journal import begin_journal, read_record, write_record
from contactverif.journals.run_journal import Journal
from contactverif.journals.run_plan import Plan, check_versions, read_plan, without_place

_MARK = "done"
_SHARD = "shard"  # The option in a plan that differs from shard to shard.
_MOST_NAMES = 3  # The most missing shards that a message names.
_OF_ONE_JOURNAL = ("options", "folder", "machine", "nonce")


@dataclass(frozen=True, slots=True, order=True)
class Shard:
    """The name of a shard: the number of all shards, and that of this one, from 1."""

    count: int
    number: int

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Return the shard of a text I/N."""
        match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
        shard = cls(int(match[2]), int(match[1])) if match else None
        if shard is None or not 1 <= shard.number <= shard.count:
            raise MisuseError("--shard", repr(text), "I/N, the number of a shard from 1 and the number of all shards")
        return shard

    @property
    def folder(self) -> str:
        """The name of its journal's folder."""
        return f"shard-{self.number}-of-{self.count}"

    @property
    def share(self) -> tuple[int, int]:
        """The number of the share of a run, from 0, and the number of all shares."""
        return self.number - 1, self.count

    @property
    def text(self) -> str:
        """The shard as the command line has it."""
        return f"{self.number}/{self.count}"

    def plan(self, plan: Plan) -> Plan:
        """Return the plan of this shard of a run."""
        return msgspec.structs.replace(plan, options=plan.options | {_SHARD: self.text})


class EndMark(msgspec.Struct, frozen=True):
    """The record of a shard that is done: how many outcomes its journal has."""

    n_outcomes: int


def open_shard(folder: Path, plan: Plan) -> bool:
    """Make the journal of a shard, or check that the one that is there has the same plan.

    Return whether the shard is done already.
    """
    if not folder.exists():
        begin_journal(folder, plan, ())
        return False
    earlier = read_plan(folder, "--out")
    check_versions(earlier.versions, plan.versions, "--out")
    if difference := _difference(earlier, plan, shard_too=True):
        raise MisuseError("--out", f"{folder.name} of another plan ({difference})", "the same plan, or another folder")
    mark = _read_mark(folder)
    return mark is not None and mark.n_outcomes == _read(folder, plan).known.n_outcomes


def mark_done(folder: Path, plan: Plan) -> Journal:
    """Mark a shard as done, and return its journal."""
    journal = _read(folder, plan)
    write_record(folder / _MARK, EndMark(journal.known.n_outcomes))
    return journal


def read_shards(folder: Path, argument: str) -> tuple[Plan, tuple[Path, ...]]:
    """Return the plan of a campaign and the journals of all its shards, once each is found to be whole."""
    shards = _list_shards(folder, argument)
    journals = tuple(folder / shard.folder for shard in shards)
    plans = [read_plan(journal, argument) for journal in journals]
    for shard, plan in zip(shards, plans, strict=True):
        if plan.options.get(_SHARD) != shard.text:
            was = plan.options.get(_SHARD, f"a journal of {plan.command}")
            raise MisuseError(argument, f"{shard.folder}, whose header says {was}", f"shard {shard.text}")
        if difference := _difference(plan, plans[0]):
            others = f"that of {shards[0].folder} ({difference})"
            raise MisuseError(argument, f"{shard.folder} with another plan than {others}", "shards of one campaign")
    for shard, journal, plan in zip(shards, journals, plans, strict=True):
        _check_whole(shard, journal, plan, argument)
    return plans[0], journals


def _list_shards(folder: Path, argument: str) -> list[Shard]:
    """Return the shards of a campaign in order, once none is missing."""
    matches = (re.fullmatch(r"shard-([1-9][0-9]{0,8})-of-([1-9][0-9]{0,8})", path.name) for path in folder.glob("*"))
    shards = sorted(Shard(int(match[2]), int(match[1])) for match in matches if match)
    if not shards:
        raise MisuseError(argument, f"no shard in {folder}", "the folder that campaign --out made")
    count = shards[0].count
    if shards[-1].count != count:
        names = f"{shards[0].folder} and {shards[-1].folder}"
        raise MisuseError(argument, names, "shards of one campaign")
    missing = [Shard(count, number).folder for number in sorted({*range(1, count + 1)} - {s.number for s in shards})]
    if missing:
        more = f" and {len(missing) - _MOST_NAMES} more" if len(missing) > _MOST_NAMES else ""
        raise MisuseError(argument, f"no {', '.join(missing[:_MOST_NAMES])}{more}", f"all {count} shards")
    return shards


def _check_whole(shard: Shard, journal: Path, plan: Plan, argument: str) -> None:
    needed = f"its end: the same campaign with --shard {shard.text} goes on"
    mark = _read_mark(journal)
    if mark is None:
        raise MisuseError(argument, f"{shard.folder}, which is not finished", needed)
    known = _read(journal, plan).known
    n_readable = known.n_outcomes
    if n_readable + known.n_misfits < mark.n_outcomes:  # What does not fit is judged again.
        flaw = f"{shard.folder}, damaged: {n_readable} of {mark.n_outcomes} outcomes can be read"
        raise MisuseError(argument, flaw, needed)


def _read_mark(folder: Path) -> EndMark | None:
    """Return the mark of a shard that is done; None if there is none that can be read."""
    try:
        return read_record(folder / _MARK, EndMark)
    except OSError:
        return None


def _read(folder: Path, plan: Plan) -> Journal:
    """Return a journal with what can be read of it."""
    journal = Journal(plan, None, [folder])
    journal.close()
    return journal


def _difference(a: Plan, b: Plan, *, shard_too: bool = False) -> str:
    """Return the name of the first thing in which two plans differ.

    The working folder and the machine are none, and neither is the box that a machine may not have.
    """
    for name in (field for field in Plan.__struct_fields__ if field not in _OF_ONE_JOURNAL):
        if getattr(a, name) != getattr(b, name):
            return name
    both = [without_place(plan.options) for plan in (a, b)]
    for name in sorted({*both[0], *both[1]} - (set() if shard_too else {_SHARD})):
        values = (msgspec.msgpack.encode(options.get(name)) for options in both)  # A file has lists for tuples.
        if len({*values}) > 1:
            return name
    return ""
