"""The shards of a campaign: each judges a share of a run in a process of its own, and has a store and nothing else.

The union of the stores of all shards is the store of a run, with which `merge` goes on.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Self

import msgspec

from contactverif.contract.errors import MisuseError
from contactverif.run.journal import hold_journal, new_journal, read_record, write_record
from contactverif.run.run_options import RunOptions
from contactverif.run.store import Plan, Store, check_versions, read_plan

_MARK = "done"
_MOST_NAMES = 3  # The most missing shards that a message names.


@dataclass(frozen=True, slots=True, order=True)
class Shard:
    """The name of a shard: the number of all shards, and that of this one, from 1."""

    count: int
    number: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the shard of a text I/N."""
        match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
        shard = cls(int(match[2]), int(match[1])) if match else None
        if shard is None or not 1 <= shard.number <= shard.count:
            raise MisuseError("--shard", repr(text), "I/N, the number of a shard from 1 and the number of all shards")
        return shard

    @property
    def folder(self) -> str:
        """The name of its folder."""
        return f"shard-{self.number}-of-{self.count}"

    @property
    def share(self) -> tuple[int, int]:
        """The number of the share of a run, from 0, and the number of all shares."""
        return self.number - 1, self.count

    @property
    def text(self) -> str:
        """The shard as the command line has it."""
        return f"{self.number}/{self.count}"


class _EndMark(msgspec.Struct, frozen=True):
    n_outcomes: int


@contextmanager
def open_shard(folder: Path, plan: Plan) -> Iterator[bool]:
    """Open a block with the store of a shard, a new one or that which is there if it has the same plan.

    Yield whether the shard is done already; if not, no other process uses its store in the block.
    """
    if not folder.exists():
        with new_journal(folder, plan):
            yield False
        return
    earlier = read_plan(folder, "--out")
    check_versions(earlier.versions, plan.versions, "--out")
    if difference := _difference(earlier, plan, shard_too=True):
        raise MisuseError("--out", f"{folder.name} of another plan ({difference})", "the same plan, or another folder")
    if _outcomes_at_end(folder) == Store(plan, None, [folder]).n_outcomes:
        yield True
        return
    with hold_journal(folder, "--out"):
        yield False


def mark_done(folder: Path, plan: Plan) -> int:
    """Mark a shard as done, and return how many outcomes its store has."""
    n_outcomes = Store(plan, None, [folder]).n_outcomes
    write_record(folder / _MARK, _EndMark(n_outcomes))
    return n_outcomes


def read_shards(folder: Path, argument: str) -> tuple[Plan, tuple[Path, ...]]:
    """Return the plan of a campaign and the stores of all its shards, once each is found to be whole."""
    shards = _list_shards(folder, argument)
    stores = tuple(folder / shard.folder for shard in shards)
    plans = [read_plan(store, argument) for store in stores]
    for shard, plan in zip(shards, plans, strict=True):
        if plan.shard != shard.text:
            was = plan.shard or f"a journal of {plan.command}"
            raise MisuseError(argument, f"{shard.folder}, whose header says {was}", f"shard {shard.text}")
        if difference := _difference(plan, plans[0]):
            others = f"that of {shards[0].folder} ({difference})"
            raise MisuseError(argument, f"{shard.folder} with another plan than {others}", "shards of one campaign")
    for shard, store, plan in zip(shards, stores, plans, strict=True):
        needed = f"its end: the same campaign with --shard {shard.text} goes on"
        n_outcomes = _outcomes_at_end(store)
        if n_outcomes is None:
            raise MisuseError(argument, f"{shard.folder}, which is not finished", needed)
        if (n_readable := Store(plan, None, [store]).n_outcomes) < n_outcomes:
            flaw = f"{shard.folder}, damaged: {n_readable} of {n_outcomes} outcomes can be read"
            raise MisuseError(argument, flaw, needed)
    return plans[0], stores


def _list_shards(folder: Path, argument: str) -> list[Shard]:
    matches = (re.fullmatch(r"shard-([1-9][0-9]{0,8})-of-([1-9][0-9]{0,8})", path.name) for path in folder.glob("*"))
    shards = sorted(Shard(int(match[2]), int(match[1])) for match in matches if match)
    if not shards:
        raise MisuseError(argument, f"no shard in {folder}", "the folder that campaign --out made")
    count = shards[0].count
    if shards[-1].count != count:
        raise MisuseError(argument, f"{shards[0].folder} and {shards[-1].folder}", "shards of one campaign")
    missing = [Shard(count, number).folder for number in sorted({*range(1, count + 1)} - {s.number for s in shards})]
    if missing:
        more = f" and {len(missing) - _MOST_NAMES} more" if len(missing) > _MOST_NAMES else ""
        raise MisuseError(argument, f"no {', '.join(missing[:_MOST_NAMES])}{more}", f"all {count} shards")
    return shards


def _outcomes_at_end(folder: Path) -> int | None:
    try:
        mark = read_record(folder / _MARK, _EndMark)
    except OSError:
        return None
    return None if mark is None else mark.n_outcomes


def _difference(a: Plan, b: Plan, *, shard_too: bool = False) -> str:
    """Return the name of the first thing in which two plans differ.

    The working folder and the machine are none, and neither is the place where plugins lived: it changes no number, and
    a machine may have no box.
    """
    pairs: list[tuple[str, object, object]] = [
        (name, a, b) for name in ("command", "versions", *(["shard"] if shard_too else []))
    ]
    pairs += [(each.name, a.options, b.options) for each in fields(RunOptions) if each.name != "isolation"]
    return next((name for name, mine, other in pairs if getattr(mine, name) != getattr(other, name)), "")
