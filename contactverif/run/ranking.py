"""The order in which failures are shown, by the ranks that properties state; a test compares them with the kill matrix.

A property has a low rank if few others catch the wrong formulations that it catches. Properties that solve bodies, or
integrate along arcs, stand behind the others, because a reader can follow a few springs, and hardly a solution.
"""

from collections.abc import Iterable
from functools import partial

from contactverif.contract.property import Verdict
from contactverif.contract.result import Result, Row

PATCH = "patch"  # The family of the patch tests.
_LEAST_STEP = 1e-4  # A rank times this is less than the least difference of two ranks, which is 1.


def wrong_rows(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that make a run fail by what they found, the lowest rank first."""
    return by_rank(row for row in rows if row.unexpected and row.verdict is not Verdict.NOT_JUDGED)


def first_failure(rows: Iterable[Row]) -> Row | None:
    """Return the row of a formulation whose counterexample a person wants to see; None if there is none.

    Who promises nothing breaks no promise; then it is a patch test that fails.
    """
    rows = list(rows)
    first = wrong_rows(rows) or by_rank(row for row in rows if row.result is Result.FAIL and row.info.family == PATCH)
    return first[0] if first else None


def by_rank(rows: Iterable[Row]) -> list[Row]:
    """Return rows, the lowest rank first within each group.

    Crashes come first, then breaches of the contract, answers that depend on earlier calls, other failures, and the
    rest. Where an exact answer is missed, two answers that differ are shown behind it.
    """
    rows = list(rows)
    exact = [row.info.rank for row in rows if row.info.role == "exact" and row.verdict is Verdict.FAIL]
    return sorted(rows, key=partial(_key, behind=min(exact, default=-1)))


def _key(row: Row, behind: float) -> tuple[bool, bool, bool, bool, float]:
    rank, failed = row.info.rank, row.verdict in (Verdict.FAIL, Verdict.CRASHED)
    if row.info.role in ("comparison", "trait") and rank < behind:
        rank = behind + _LEAST_STEP * rank
    foundation = failed and row.info.role == "foundation"
    return row.verdict is not Verdict.CRASHED, not row.breach, not foundation, not failed, rank
