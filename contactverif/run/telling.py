"""The order in which failures are shown: the most telling first.

A property is telling if few others catch the wrong formulations that it catches. The order is that of the kill matrix
in `reports/trust/kills.csv`, and a test compares both. Properties that solve bodies, or integrate along arcs, stand
behind the others, because a reader can follow a few springs, and hardly a solution.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from contactverif.contract.property import Verdict
from contactverif.contract.result import Result, Row

PATCH = "patch"  # The family of the patch tests.
PURITY = "purity", "purity.long"  # The properties of which a failure says that no other answer can be relied on.

ORDER = (
    "tangent.directional",
    "purity",
    "tangent.long",
    "tangent.sparsity",
    "projection.forces",
    "projection.activity",
    "unilateral",
    "projection.place",
    "purity.long",
    "patch.flat.nodal",
    "objectivity",
    "nodal-push",
    "mirror",
    "renumbering",
    "hard.touch",
    "stability.translation",
    "patch.flat.normal",
    "stability.local",
    "scaling",
    "remote",
    "patch.flat.single",
    "projection.area",
    "patch.flat.resultant",
    "balance.moment",
    "patch.flat.transmission",
    "patch.tilted.resultant",
    "locality.bend",
    "continuity",
    "balance.force",
    "patch.flat.published",
    "symmetric",
    "hard.concave-corner",
    "projection.segment",
    "stability.sweep",
    "hard.convex-kink",
    "scale",
    "hard.steep-slave",
    "patch.tilted.nodal",
    "hard.deep",
    "hard.search",
    "swap",
    "hard.node-hit",
    "hard.offset",
    "hard.free-end",
    "accuracy.arc",
    "complementarity",
    "newton.order",
    "patch.curved",
    "multipliers.rank",
    "stability.inf-sup",
    "patch.kinked",
    "stability.locking",
    "accuracy.hertz",
    "accuracy.wavy-curved",
    "accuracy.wavy",
    "newton.attainable",
    "newton.history",
    "newton.units",
    "stability.stiffness",
    "patch.flat.normal.solve",
    "hard.dead-zone",
    "patch.flat.single.solve",
    "patch.dead-zone",
    "hard.stiff",
    "hard.short-segment",
    "hard.contrast",
    "patch.flat.solve",
    "hard.c",
    "patch.variants",
    "hard.zero-load",
)
# Two answers that differ do not say which is right. Where forces are also wrong beside an exact answer, that is shown.
_SAME_ANSWER = "objectivity", "mirror", "renumbering", "scaling", "remote", "swap"
_EXACT = "patch.flat.normal", "patch.flat.single", "patch.flat.resultant", "patch.flat.transmission"
_RANK = {property_id: rank for rank, property_id in enumerate(ORDER)}


def wrong_rows(rows: Iterable[Row]) -> list[Row]:
    """Return the rows that make a run fail by what they found, the most telling first."""
    return by_telling(row for row in rows if row.unexpected and row.verdict is not Verdict.NOT_JUDGED)


def most_telling(rows: Iterable[Row]) -> Row | None:
    """Return the row of a formulation whose counterexample a person wants to see; None if there is none.

    Who promises nothing breaks no promise; then it is a patch test that fails.
    """
    rows = list(rows)
    news = by_telling(row for row in rows if row.result is Result.FAIL and row.info.family == PATCH)
    return next(iter([*wrong_rows(rows), *news]), None)


def by_telling(rows: Iterable[Row]) -> list[Row]:
    """Return rows, the most telling first, each group by `ORDER`.

    Crashes come first, then breaches of the contract, answers that depend on earlier calls, other failures, and the
    rest. A property of another author is shown before ours, since it was installed for a purpose. Where a flat patch
    has wrong forces, two answers that differ are shown behind it.
    """
    rows = list(rows)
    exact = [_RANK[row.property_id] for row in rows if row.verdict is Verdict.FAIL and row.property_id in _EXACT]
    return sorted(rows, key=partial(_key, behind=min(exact, default=-1)))


def _key(row: Row, behind: int) -> tuple[bool, bool, bool, bool, float]:
    failed = row.verdict in (Verdict.FAIL, Verdict.CRASHED)
    impure = failed and row.property_id in PURITY
    rank: float = _RANK.get(row.property_id, -1)
    if row.property_id in _SAME_ANSWER and rank < behind:
        rank = behind + rank / len(ORDER)
    return row.verdict is not Verdict.CRASHED, not row.breach, not impure, not failed, rank
