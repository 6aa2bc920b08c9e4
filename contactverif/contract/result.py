"""What a run found, ready to be printed or stored: a `Row` for each formulation and property, all rows in a `Run`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from contactverif.contract.property import Outcome, Property, Verdict

JUDGED_SHARE = 0.9  # a property with a smaller share of its planned cases judged is not judged


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
        """Empty, or why this row makes the run fail."""
        if self.verdict is Verdict.CRASHED:
            return "" if self.known else "crashed"
        if self.verdict is Verdict.FAIL and self.breach and not self.known:
            return "breaks the contract"
        if self.verdict is Verdict.NOT_PROVIDED and self.promise is True and not self.known:
            return "promised, and not provided"
        if self.verdict is Verdict.NOT_JUDGED:
            return "not judged"
        if self.verdict is Verdict.FAIL and self.promise is True and not self.known:
            return "promised, and fails"
        if self.verdict is Verdict.PASS and self.promise is False:
            return "said to fail, and passes"
        if self.verdict is Verdict.PASS and self.known:
            return "known to fail, and passes"
        return ""


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
