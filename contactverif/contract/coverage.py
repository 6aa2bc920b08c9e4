"""The coverage of a run: what the cases of each property were worth, all formulations together.

A pass says little if half of the cases stayed undecided, touched nothing, or were of one kind. This is where a reader
sees that. Tables and pages show a `Coverage` for each property; it follows from the rows of the run.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from contactverif.contract.case_counts import CaseCounts, add_by_kind, total
from contactverif.contract.property import PropertyInfo
from contactverif.contract.result import Row, Run

_NUMBER = re.compile(r"[-+]?\b\d+(\.\d+)?(e[-+]?\d+)?\b|\b(nan|inf)\b")


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """The cases of one property, of all formulations that it was judged for."""

    info: PropertyInfo
    n_formulations: int  # The number of formulations with at least one case.
    counts: CaseCounts
    # {kind of situation: counts}, in the order of the property; empty if its cases are of no kind.
    kinds: Mapping[str, CaseCounts]
    # {reason: number of cases} of the undecided cases, the most frequent first. Numbers in a reason are replaced by
    # "…", so that cases that differ in a number alone have one reason.
    reasons: Mapping[str, int]

    @classmethod
    def from_rows(cls, info: PropertyInfo, rows: list[Row]) -> Coverage:
        """Add up the rows of a property."""
        reasons: Counter[str] = Counter()
        for row in rows:
            for reason, number in row.tally.reasons.items():
                reasons[_NUMBER.sub("…", reason)] += number
        return cls(
            info,
            n_formulations=len(rows),
            counts=total(row.tally.counts for row in rows),
            kinds=add_by_kind(row.tally.kinds for row in rows),
            reasons=dict(reasons.most_common()),
        )


def coverage_of(run: Run) -> tuple[Coverage, ...]:
    """Return the coverage of each property of which a case was judged, in the order of the run."""
    judged = [row for row in run.rows if row.outcomes]
    by_property: dict[str, list[Row]] = {id_: [] for id_ in run.properties}
    for row in judged:
        by_property[row.property_id].append(row)
    return tuple(Coverage.from_rows(rows[0].info, rows) for rows in by_property.values() if rows)
