"""Publish the kill matrix in the report of the test run: what this run judged, and the rest from the kept table."""

import csv
import json
from pathlib import Path

import pytest
from killing import EXAMPLES, KEY, as_lines

FILE = Path(__file__).parents[2] / "reports" / "trust" / "kills.csv"


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Write one row for each mutant and one column for each property; workers of xdist send cells in their reports."""
    reports = [
        report for every in terminalreporter.stats.values() for report in every if hasattr(report, "user_properties")
    ]
    cells = [dict(report.user_properties)[KEY] for report in reports if KEY in dict(report.user_properties)]
    if not cells:
        return
    rows = _kept_rows()
    ids = list(dict.fromkeys([*next(iter(rows.values()), {}), *(json.loads(cell)[1] for cell in cells)]))
    matrix = {}
    for name, intended, number in map(json.loads, dict.fromkeys(cells)):
        row = {question: _as_number(rows.get(name, {}).get(question, "")) for question in ids}
        matrix[name] = intended, row | {intended: number}
    terminalreporter.section("kill matrix")
    heading = f"the first of {EXAMPLES} cases that caught the mutant, in brackets; all others from {FILE.name}"
    for line in (heading, *as_lines(matrix)):
        terminalreporter.write_line(line)


def _as_number(cell: str) -> int:
    """Return the number of the first case, 0 where none catches the mutant or the property was not asked."""
    return int(cell) if cell.isdigit() else 0


def _kept_rows() -> dict[str, dict[str, str]]:
    """Return {mutant: {property: number of the first case, or empty}} of the kept table."""
    if not FILE.exists():
        return {}
    with FILE.open(encoding="utf-8", newline="") as stream:
        return {row.pop("mutant"): {k: v for k, v in row.items() if k != "caught by"} for row in csv.DictReader(stream)}
