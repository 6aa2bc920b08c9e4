"""Publishes the kill matrix in the report of the test run."""

from __future__ import annotations

import json

import pytest
from killing import EXAMPLES, KEY, OTHERS, as_lines


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """One row a mutant, one column a property; it travels in the reports, so that workers of xdist can send it."""
    reports = [
        report for every in terminalreporter.stats.values() for report in every if hasattr(report, "user_properties")
    ]
    carried = [dict(report.user_properties)[KEY] for report in reports if KEY in dict(report.user_properties)]
    if not carried:
        return
    matrix = {name: (meant, row) for name, meant, row in map(json.loads, dict.fromkeys(carried))}
    terminalreporter.section("kill matrix")
    said = (
        f"the first of {EXAMPLES} cases that caught the mutant, in brackets where it is meant to; others: of {OTHERS}"
    )
    for line in (said, *as_lines(matrix)):
        terminalreporter.write_line(line)
