"""What a run found, ready to be printed or stored: a `Row` for each formulation and property, all rows in a `Run`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from contactverif.contract.property import Outcome, Property, Verdict

JUDGED_SHARE = 0.9  # A property counts as judged if at least this share of its planned cases was decided.
BROKEN_BY_FAILING = "promised to pass, but fails"
BROKEN_BY_PASSING = "stated to fail, but passes"


class Result(StrEnum):
    """The word for a row in every table and page: the verdict, seen beside what the formulation states."""

    PASS = "pass"
    FAIL = "fail"
    FAILS_AS_STATED = "fails as stated"
    BROKEN_PROMISE = "BROKEN PROMISE"
    CRASHED = "crashed"
    UNDECIDED = "undecided"
    NOT_JUDGED = "not judged"
    NOT_APPLICABLE = "not applicable"
    NOT_PROVIDED = "not provided"
    NOT_LOADED = "not loaded"


def result_of(verdict: Verdict, promise: bool | None, known: str, unexpected: str) -> Result:
    """Return the word for a verdict, given what the formulation states and why the row makes the run fail, if so."""
    failed = verdict in (Verdict.FAIL, Verdict.CRASHED)
    if unexpected and verdict not in (Verdict.CRASHED, Verdict.NOT_JUDGED):
        return Result.BROKEN_PROMISE
    if failed and not unexpected and (promise is False or known):
        return Result.FAILS_AS_STATED
    return Result[verdict.name]


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """One formulation, one property.

    Attributes
    ----------
    formulation : str
        Name on the command line, with options.
    question : Property
        The property.
    verdict : Verdict
        Over all cases: crashed and fail first, then not judged, then pass.
    promise : bool | None
        True promised, False said to fail, None nothing said.
    known : str
        Why a failure is known, empty if it is not.
    reason : str
        Why the verdict is no pass, of the worst case.
    planned : int
        Number of random cases asked for.
    outcomes : tuple[Outcome, ...]
        Of the random cases, in order.
    witness : Outcome | None
        Outcome of the named case of a promise "does not".
    shrunk : Outcome | None
        The worst case after shrinking, None where nothing failed.
    seconds : float
        Spent judging, shrinking excluded.
    """

    formulation: str
    question: Property
    verdict: Verdict
    promise: bool | None
    known: str = ""
    reason: str = ""
    planned: int = 0
    outcomes: tuple[Outcome, ...] = ()
    witness: Outcome | None = None
    shrunk: Outcome | None = None
    seconds: float = 0.0

    @property
    def judged(self) -> int:
        """Number of random cases that were decided."""
        return sum(outcome.decided for outcome in self.outcomes)

    @property
    def breach(self) -> bool:
        """Whether the contract was broken somewhere, which fails a run whatever was promised."""
        return any(outcome.breach for outcome in (*self.outcomes, *((self.witness,) if self.witness else ())))

    @property
    def unexpected(self) -> str:
        """Why this row makes the run fail; empty if it does not."""
        match self.verdict:
            case Verdict.CRASHED:
                return "" if self.known else "crashed"
            case Verdict.NOT_JUDGED:
                return "not judged"
            case Verdict.FAIL if not self.known:
                return "breaks the contract" if self.breach else BROKEN_BY_FAILING if self.promise else ""
            case Verdict.NOT_PROVIDED if self.promise and not self.known:
                return "promised to pass, but a part that it needs is not provided"
            case Verdict.PASS if self.promise is False:
                return BROKEN_BY_PASSING
            case Verdict.PASS if self.known:
                return "listed as a known failure, but passes"
        return ""

    @property
    def result(self) -> Result:
        """The word for the row in tables and pages."""
        return result_of(self.verdict, self.promise, self.known, self.unexpected)


@dataclass(frozen=True, slots=True, eq=False)
class NotLoaded:
    """A formulation (or a property, under its id) that could not be loaded, and so was not asked anything."""

    formulation: str
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """All that one run found.

    Attributes
    ----------
    rows : tuple[Row, ...]
        Formulation by formulation, property by property.
    not_loaded : tuple[NotLoaded, ...]
        Plugins that did not load.
    provided : Mapping[str, Mapping[str, bool]]
        {formulation: {part of the contract: provided}}.
    provenance : Mapping[str, str]
        Root attributes of a report: versions, seed, profile, command, ….
    """

    rows: tuple[Row, ...]
    not_loaded: tuple[NotLoaded, ...] = ()
    provided: Mapping[str, Mapping[str, bool]] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)

    @property
    def passed(self) -> bool:
        """Whether every promise was kept and every property judged."""
        return bool(self.rows) and not self.not_loaded and not any(row.unexpected for row in self.rows)
