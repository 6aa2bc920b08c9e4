"""The counterexamples of a run: the cases that a report stores whole, so that they can be drawn and judged again.

Each has an id that a shell takes as it is. It is spelled like formulation and property, so that it says what failed.
"""

import difflib
import hashlib
import re
import shlex
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.property import FAILED, Outcome, Verdict
from contactverif.contract.result import Row, Run

_LONGEST_FILE_NAME = 180  # File systems take 255 bytes, and a suffix and the mark of a temporary file are added.


class Origin(StrEnum):
    """The ways to a counterexample, as a report says them."""

    SHRUNK = "shrunk from the random cases"
    WITNESS = "the witness of a formulation"
    EARLIER = "a case that failed in an earlier run"
    FIRST = "the first case that clearly fails, not shrunk"


@dataclass(frozen=True, slots=True, eq=False)
class Counterexample:
    """A case on which a formulation fails, or with which it says that it fails."""

    id: str  # The id on the command line, `vts-me_n_4.patch.flat.transmission`.
    row: Row
    outcome: Outcome

    @property
    def case(self) -> Case:
        """The case itself."""
        return self.outcome.case

    @property
    def origin(self) -> Origin:
        """The way to the case: only one that was shrunk is the smallest found."""
        if self.outcome is self.row.witness:
            return Origin.WITNESS if self.row.promise is False else Origin.EARLIER
        return Origin.FIRST if self.row.shrunk is None else Origin.SHRUNK

    @property
    def label(self) -> str:
        """The case in a few words, for a reader."""
        case, words = self.case, str(self.origin)
        if self.origin is Origin.WITNESS:
            words = f"its witness, the case {case.name}"
        elif self.origin is not Origin.EARLIER and case.name:
            words = f"the case {case.name}"
        elif self.origin is Origin.SHRUNK:
            words = "the smallest case found"
        return f"{words} ({case.kind})" if case.kind else words

    @property
    def formulation(self) -> str:
        """The formulation as typed on the command line."""
        return self.row.formulation

    @property
    def property_id(self) -> str:
        """The property as typed on the command line."""
        return self.row.property_id

    @property
    def verdict(self) -> Verdict:
        """The verdict on the case."""
        return self.outcome.verdict

    @property
    def reason(self) -> str:
        """The reason why the verdict is no pass."""
        return self.outcome.reason

    @property
    def words(self) -> list[str]:
        """The failure in lines: what fails, the reason, and what is found and right at the worst place."""
        measurement = self.outcome.measurement
        finding = "" if measurement is None else str(measurement.finding or "")
        finding = "" if finding in self.reason else finding  # Most reasons end with it.
        title = f"{self.formulation}, {self.property_id}: {self.row.result}, {self.label}"
        promise = f"promised by {self.row.promised_by}" if self.row.promised_by else ""
        return [line for line in (title, self.reason, finding, promise) if line]

    def replay_command(self, report: str) -> str:
        """Return the command that judges the case again."""
        return f"contactverif replay {shlex.quote(report)} --case {shlex.quote(self.id)}"


def counterexamples(run: Run) -> dict[str, Counterexample]:
    """Return all counterexamples {id: counterexample}, in the order of the run."""
    entries = [(row, outcome) for row in run.rows if (outcome := counterexample_of(row)) is not None]
    ids = distinct(
        case_id(row.formulation, row.property_id, witness=outcome is row.witness and row.promise is False)
        for row, outcome in entries
    )
    return {id_: Counterexample(id_, *entry) for id_, entry in zip(ids, entries, strict=True)}


def failing_examples(run: Run) -> list[Counterexample]:
    """Return the counterexamples of all rows that fail or crash, in the order of the run."""
    return [example for example in counterexamples(run).values() if example.row.verdict in FAILED]


def counterexample_of(row: Row) -> Outcome | None:
    """Return the case that was shrunk or is the first, else a witness that failed or broke its promise, else None."""
    planned = row.shrunk or row.first
    if planned is not None or row.witness is None:
        return planned
    return row.witness if row.witness.verdict in FAILED or (row.promise is False and row.unexpected) else None


def named_failures(run: Run) -> dict[str, Counterexample]:
    """Return the named cases that a formulation fails {id: counterexample}, of those that the run holds whole.

    A property with a finite list of cases names each of them. The id is `vts-ppt.stability.sweep.offset-1e6-a`.
    """
    failures = {}
    for row in run.rows:
        for outcome in row.outcomes:
            case = outcome.case_or_summary
            if outcome.verdict in FAILED and isinstance(case, Case) and case.name:
                id_ = typeable(f"{row.formulation}.{row.property_id}.{case.name}")
                failures[id_] = Counterexample(id_, row, outcome)
    return failures


def find_counterexample(run: Run, id_: str) -> Counterexample:
    """Return the counterexample of that id."""
    examples = {**named_failures(run), **counterexamples(run)}
    if id_ in examples:
        return examples[id_]
    needed, ids = "a report with counterexamples; this one has none", list(examples)
    if ids:
        near = difflib.get_close_matches(id_, ids, n=3, cutoff=0.4)
        listed = near or ids[:5]
        more = f" (and {len(ids) - len(listed)} more)" if len(ids) > len(listed) else ""
        needed = f"{'an id like' if near else 'one of'} {', '.join(listed)}{more}"
    raise MisuseError("--case", repr(id_), needed)


def case_id(formulation: str, property_id: str, *, witness: bool = False) -> str:
    """Return `vts-me_n_4.patch.flat.transmission`, with `.witness` behind it for a witness."""
    return typeable(f"{formulation}.{property_id}") + (".witness" if witness else "")


def typeable(name: str) -> str:
    """Return the name with only letters, digits, `.`, `_` and `-`, which a shell and netCDF take as they are.

    A name that is too long for a file is cut; a digest of all of it keeps it apart from others that begin alike.
    """
    plain = re.sub(r"[^A-Za-z0-9._-]+", "_", name).lstrip("-.") or "_"
    if len(plain) <= _LONGEST_FILE_NAME:
        return plain
    digest = hashlib.sha256(plain.encode()).hexdigest()[:12]
    return f"{plain[:_LONGEST_FILE_NAME]}-{digest}"


def distinct(names: Iterable[str]) -> list[str]:
    """Return the names in their order; one that was there before gets `-2`, `-3`, … behind it."""
    result: list[str] = []
    for name in names:
        number, free = 1, name
        while free in result:
            number += 1
            free = f"{name}-{number}"
        result.append(free)
    return result
