"""The counts that say what a number of cases is worth: judged, failed, undecided, and idle ones.

A case is judged or undecided, never both. Idle and failed cases are among the judged ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from contactverif.contract.property import Outcome, PropertyInfo, Verdict

CaseKey = tuple[str, Verdict, bool]  # Kind, verdict, and whether the case was idle.


@dataclass(frozen=True, slots=True)
class CaseCounts:
    """Numbers of cases."""

    judged: int = 0  # The cases that were decided: they pass, fail or crash.
    failed: int = 0  # Those of the judged cases that fail or crash.
    undecided: int = 0  # The cases that were measured, but left open whether they pass.
    idle: int = 0  # Those of the judged cases in which nothing was in contact, so that a pass says little.

    def __add__(self, other: CaseCounts) -> CaseCounts:
        return CaseCounts(
            self.judged + other.judged,
            self.failed + other.failed,
            self.undecided + other.undecided,
            self.idle + other.idle,
        )

    @property
    def cases(self) -> int:
        """The number of all cases."""
        return self.judged + self.undecided

    def share(self, count: int) -> float:
        """Return a number of cases as a share of all, 0 if there are none."""
        return count / self.cases if self.cases else 0.0

    @property
    def undecided_share(self) -> float:
        """The share of undecided cases, 0 to 1."""
        return self.share(self.undecided)

    @property
    def contact_share(self) -> float:
        """The share of judged cases in which something was in contact, 0 to 1; 0 if none was judged."""
        return (self.judged - self.idle) / self.judged if self.judged else 0.0

    @property
    def idle_share(self) -> float:
        """The share of idle cases, 0 to 1."""
        return self.share(self.idle)


def key_of(outcome: Outcome) -> CaseKey:
    """Return the kind of a case, its verdict, and whether it was idle: all that counts depend on."""
    idle = outcome.measurement is not None and outcome.measurement.idle
    return outcome.case_or_summary.kind, outcome.verdict, idle


def count_by_kind(info: PropertyInfo, numbers: Mapping[CaseKey, int]) -> dict[str, CaseCounts]:
    """Return {kind: counts}, the kinds of the property first; cases of no kind are under the empty word, at the end."""
    counts = dict.fromkeys(info.kinds, CaseCounts())
    for (kind, verdict, idle), number in sorted(numbers.items(), key=lambda entry: (not entry[0][0], entry[0])):
        counts[kind] = counts.get(kind, CaseCounts()) + _counts(verdict, number, idle=idle)
    return counts


def total(counts: Iterable[CaseCounts]) -> CaseCounts:
    """Return the sum of counts."""
    return sum(counts, start=CaseCounts())


def add_by_kind(tables: Iterable[Mapping[str, CaseCounts]]) -> dict[str, CaseCounts]:
    """Return the sums of tables {kind: counts}, the kinds in the order of the tables."""
    sums: dict[str, CaseCounts] = {}
    for table in tables:
        for kind, counts in table.items():
            sums[kind] = sums.get(kind, CaseCounts()) + counts
    return sums


def percent(share: float) -> str:
    """Return a share in percent; one that is not 0 never looks like 0, and one that is not 1 never like 100 %."""
    if share in (0.0, 1.0):
        return f"{share:.0%}".replace("%", " %")
    return f"{min(max(100 * share, 0.1), 99.9):.1f} %"


def whole_percent(share: float) -> str:
    """Return a share in whole percent, in four characters at most; only 1 looks like 100 %, and only 0 like 0."""
    return f"{share:.0%}" if share in (0.0, 1.0) else f"{min(max(round(100 * share), 1), 99)}%"


def _counts(verdict: Verdict, number: int, *, idle: bool) -> CaseCounts:
    if verdict is Verdict.UNDECIDED:
        return CaseCounts(undecided=number)
    failed = verdict in (Verdict.FAIL, Verdict.CRASHED)
    return CaseCounts(judged=number, failed=number * failed, idle=number * idle)
