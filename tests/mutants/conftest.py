"""Publish the kill matrix in the report of the test run."""

from __future__ import annotations

import json

import pytest
from killing import EXAMPLES, KEY, OTHERS, as_lines


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Write one row for each mutant and one column for each property; workers of xdist send rows in their reports."""
    reports = [
        report for every in terminalreporter.stats.values() for report in every if hasattr(report, "user_properties")
    ]
    rows = [dict(report.user_properties)[KEY] for report in reports if KEY in dict(report.user_properties)]
    if not rows:
        return
    matrix = {name: (intended, row) for name, intended, row in map(json.loads, dict.fromkeys(rows))}
    terminalreporter.section("kill matrix")
    heading = (
        f"the first of {EXAMPLES} cases that caught the mutant, in brackets where it is meant to; others: of {OTHERS}"
    )
    for line in (heading, *as_lines(matrix)):
        terminalreporter.write_line(line)
