"""The counts that say what a number of cases is worth: judged, failed, undecided, and idle ones.

A case is judged or undecided, never both. Idle and failed cases are among the judged ones.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import exp, lgamma, log, log1p

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.contract.property import Outcome, PropertyInfo, Verdict

# The probability below which a count is no chance. A run of a thousand rows accuses one by chance once in ten runs.
BY_CHANCE = 1e-4
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


def exceeds(count: int, number: int, share: float) -> bool:
    """Return whether `count` or more of `number` cases, each of probability `share`, are rarer than `BY_CHANCE`."""
    if count <= number * share:
        return False
    return _at_least(count, number, share) < BY_CHANCE


def _at_least(count: int, number: int, share: float) -> float:
    """Return the binomial probability of `count` or more, for a count above `number` × `share`.

    The term of n + 1 is ratio × the term of n, with ratio = (N − n) p / ((n + 1) (1 − p)). It is below 1 for n above
    N p, and falls with n. So all terms behind n add up to at most term × ratio / (1 − ratio). They are left out as soon
    as this is below the roundoff of the sum.
    """
    total = 0.0
    for n in range(count, number + 1):
        term = _probability(n, number, share)
        total += term
        ratio = (number - n) * share / ((n + 1) * (1 - share)) if share < 1 else 0.0
        if term * ratio <= UNIT_ROUNDOFF * total * (1 - ratio):
            break
    return total


def _probability(count: int, number: int, share: float) -> float:
    if not 0 < share < 1:
        return float(count == number * share)
    exponent = count * log(share) + (number - count) * log1p(-share)
    return exp(exponent + lgamma(number + 1) - lgamma(count + 1) - lgamma(number - count + 1))
