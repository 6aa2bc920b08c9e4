"""Publish the kill matrix in the report of the test run: what this run judged, and the rest from the kept table."""

import csv
import json
import sys
from pathlib import Path

import pytest
from zoo.killing import EXAMPLES, KEY, KILL_TABLE, as_lines

sys.path.append(
    str(Path(__file__).parents[2] / "evidence" / "trust")
)  # A campaign there asks what some tests ask here.


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Write one row for each mutant and one column for each property; workers of xdist send cells in their reports."""
    reports = [
        report for every in terminalreporter.stats.values() for report in every if hasattr(report, "user_properties")
    ]
    cells = [dict(report.user_properties)[KEY] for report in reports if KEY in dict(report.user_properties)]
    if not cells:
        return
    rows = {}
    if KILL_TABLE.exists():
        with KILL_TABLE.open(encoding="utf-8", newline="") as stream:
            rows = {row.pop("mutant"): row for row in csv.DictReader(stream)}
    ids = [name for name in next(iter(rows.values()), {}) if name != "caught by"]
    ids = list(dict.fromkeys([*ids, *(json.loads(cell)[1] for cell in cells)]))
    matrix = {}
    for name, intended, number in map(json.loads, dict.fromkeys(cells)):
        row = {each: int(cell) if cell.isdigit() else 0 for each, cell in rows.get(name, {}).items() if each in ids}
        matrix[name] = intended, {**dict.fromkeys(ids), **row, intended: number}
    terminalreporter.section("kill matrix")
    heading = f"the first of {EXAMPLES} cases that caught the mutant, in brackets; all others from {KILL_TABLE.name}"
    for line in (heading, *as_lines(matrix)):
        terminalreporter.write_line(line)
