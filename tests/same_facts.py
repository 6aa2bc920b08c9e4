"""The facts of a run that another run of the same seed must have, bit by bit."""

from dataclasses import replace
from typing import Any

from contactverif import Case, Outcome, Run
from contactverif.contract.result import Row


def facts(result: Run) -> list[bytes]:
    """Return all rows as bytes, without the seconds and without the meshes of those cases that all have."""

    def timeless(outcome: Outcome | None, *, whole: bool = True) -> Any:
        if outcome is None:
            return None
        case = outcome.case_or_summary if whole else outcome.summary
        arrays = {name: array.tolist() for name, array in case.to_arrays().items()} if isinstance(case, Case) else case
        return replace(outcome, seconds=0.0, case_or_summary=outcome.summary), arrays

    def line(row: Row) -> bytes:
        outcomes = [timeless(outcome) for outcome in row.outcomes]
        return repr(
            (row.formulation, row.property_id, row.verdict, row.reason, row.planned, row.promise)
            + (outcomes, timeless(row.witness), timeless(row.shrunk))
        ).encode()

    return [line(row) for row in result.rows]
