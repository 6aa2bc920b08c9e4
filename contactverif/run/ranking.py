"""The order in which failures are shown, by the ranks that properties state; a test compares them with the kill matrix.

A property has a low rank if few others catch the wrong formulations that it catches. Properties that solve bodies, or
integrate along arcs, stand behind the others, because a reader can follow a few springs, and hardly a solution.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from functools import partial

from contactverif.contract.property import Property, Verdict
from contactverif.contract.result import Result, Row
from contactverif.plugins.registry import installed_properties, load_property

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
    rest. Where a flat patch has wrong forces, two answers that differ are shown behind it.
    """
    rows = list(rows)
    if len(rows) < 2:  # To read the ranks imports the families of properties.
        return rows
    properties = _load_installed({row.property_id for row in rows})
    exact = [
        question.rank
        for row in rows
        if (question := properties.get(row.property_id)) and question.role == "exact" and row.verdict is Verdict.FAIL
    ]
    return sorted(rows, key=partial(_key, properties, behind=min(exact, default=-1)))


def _key(properties: Mapping[str, Property], row: Row, behind: float) -> tuple[bool, bool, bool, bool, float]:
    question, failed = properties.get(row.property_id), row.verdict in (Verdict.FAIL, Verdict.CRASHED)
    rank, role = (question.rank, question.role) if question is not None else (-1, "")
    if role == "comparison" and rank < behind:
        rank = behind + _LEAST_STEP * rank
    return row.verdict is not Verdict.CRASHED, not row.breach, not (failed and role == "foundation"), not failed, rank


def _load_installed(ids: Collection[str]) -> dict[str, Property]:
    """Return the properties of some ids that load: rows that were read from a report hold the plain data alone."""
    installed = installed_properties(engines=True)
    loaded = (load_property(property_id, installed) for property_id in ids if property_id in installed)
    return {question.id: question for question in loaded if isinstance(question, Property)}
