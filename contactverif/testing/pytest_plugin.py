"""The pytest plugin: options, the checks of `contactverif.testing`, and a line of counts at the end.

Rule: every pytest run of a user who has installed contactverif loads this file. Nothing that takes long is imported
before a marked test is collected.
"""

from __future__ import annotations  # Old versions of pytest lack some names of the annotations.

import secrets
from collections.abc import Iterator
from typing import Any

import pytest

from contactverif.testing import MARK

_FRESH_SEED = pytest.StashKey[int]()
_TO_WORKERS = "contactverif_fresh_seed"
_COUNTS = "contactverif"  # Prefix of the numbers that a test report carries from a worker to the terminal.


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options that overrule the arguments of `parametrize_with_properties`."""
    group = parser.getgroup("contactverif", "verification of contact formulations")
    group.addoption("--contactverif-profile", metavar="NAME", help="dev, ci or nightly")
    group.addoption("--contactverif-examples", metavar="N", type=int, help="number of planned cases of each property")
    group.addoption("--contactverif-seed", metavar="N", type=int, help="seed of all cases")


def pytest_configure(config: pytest.Config) -> None:
    """Register the mark, and draw one fresh seed for the whole session, all workers included."""
    config.addinivalue_line("markers", f"{MARK}(…): set by contactverif.testing.parametrize_with_properties")
    from_controller = getattr(config, "workerinput", {})
    config.stash[_FRESH_SEED] = from_controller.get(_TO_WORKERS, secrets.randbelow(10**9))


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Hand the seed to a worker of pytest-xdist, if that is installed."""
    node.workerinput[_TO_WORKERS] = node.config.stash[_FRESH_SEED]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Make one test of each formulation and property of a marked function."""
    marks = list(metafunc.definition.iter_markers(MARK))
    if not marks:
        return
    from contactverif.contract.errors import MisuseError
    from contactverif.testing.checks import make_checks

    config = metafunc.config
    fresh_seed = config.stash[_FRESH_SEED]
    try:
        checks = [check for mark in marks for check in make_checks(config.option, fresh_seed, **mark.kwargs)]
    except MisuseError as error:
        raise pytest.Collector.CollectError(f"parametrize_with_properties: {error}") from None
    metafunc.parametrize("check", [pytest.param(check, id=check.id) for check in checks])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[Any]:
    """Put the counts of a check into its test report."""
    if call.when == "call" and item.get_closest_marker(MARK) is not None:
        check = getattr(item, "callspec").params["check"]  # noqa: B009 (only parametrized items have it)
        if check.row is not None:
            numbers = {"planned": check.row.planned, "judged": check.row.judged, "seed": check.seed}
            item.user_properties.extend((f"{_COUNTS}_{name}", number) for name, number in numbers.items())
    return (yield)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print how many cases were planned and judged, and the seed that gives the same cases again."""
    counts = list(_counts(terminalreporter.stats.values()))
    if not counts:
        return
    planned, judged = (sum(numbers[f"{_COUNTS}_{name}"] for numbers in counts) for name in ("planned", "judged"))
    seeds = sorted({numbers[f"{_COUNTS}_seed"] for numbers in counts})
    again = f"same cases with --contactverif-seed={seeds[0]}" if len(seeds) == 1 else "seeds as in the test files"
    terminalreporter.write_line(
        f"contactverif: {len(counts)} checks, {planned} cases planned, {judged} judged; {again}"
    )


def _counts(reports_by_outcome: Any) -> Iterator[dict[str, Any]]:
    for reports in reports_by_outcome:
        for report in reports:
            numbers = dict(report.user_properties) if getattr(report, "when", "") == "call" else {}
            if f"{_COUNTS}_planned" in numbers:
                yield numbers
