"""What contactverif adds to pytest: options, the checks of `contactverif.testing`, and a line of counts at the end.

It loads in every pytest run of whoever has contactverif installed, so nothing that takes long is imported before a
marked test is met.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from typing import Any

import pytest

MARK = "contactverif_properties"
_FRESH_SEED = pytest.StashKey[int]()
_TO_WORKERS = "contactverif_fresh_seed"
_COUNTS = "contactverif"  # of the numbers that a report carries from a worker to the terminal


def pytest_addoption(parser: pytest.Parser) -> None:
    """Options that overrule what `parametrize_with_properties` was given."""
    group = parser.getgroup("contactverif", "verification of contact formulations")
    group.addoption("--contactverif-profile", metavar="NAME", help="dev, ci or nightly")
    group.addoption("--contactverif-examples", metavar="N", type=int, help="planned cases of each property")
    group.addoption("--contactverif-seed", metavar="N", type=int, help="seed of all cases")


def pytest_configure(config: pytest.Config) -> None:
    """Register the mark; one fresh seed for the whole session, all workers included."""
    config.addinivalue_line("markers", f"{MARK}(…): set by contactverif.testing.parametrize_with_properties")
    from_controller = getattr(config, "workerinput", {})
    config.stash[_FRESH_SEED] = from_controller.get(_TO_WORKERS, secrets.randbelow(10**9))


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Hand the seed to a worker of pytest-xdist, where there is one."""
    node.workerinput[_TO_WORKERS] = node.config.stash[_FRESH_SEED]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """One test for each formulation and property of a marked function."""
    marks = list(metafunc.definition.iter_markers(MARK))
    if not marks:
        return
    from contactverif.contract.errors import MisuseError
    from contactverif.testing.parametrize import checks

    config = metafunc.config
    try:
        found = [
            one for mark in marks for one in checks(mark.kwargs["asked"], config.option, config.stash[_FRESH_SEED])
        ]
    except MisuseError as error:
        raise pytest.Collector.CollectError(f"parametrize_with_properties: {error}") from None
    metafunc.parametrize("check", [pytest.param(check, id=check.id) for check in found])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Iterator[Any]:
    """Put the counts of a check into its report."""
    if call.when == "call" and item.get_closest_marker(MARK) is not None:
        check = getattr(item, "callspec").params["check"]  # noqa: B009 (only parametrized items have it)
        if check.row is not None:
            numbers = {"planned": check.row.planned, "judged": check.row.judged, "seed": check.seed}
            item.user_properties.extend((f"{_COUNTS}_{name}", number) for name, number in numbers.items())
    return (yield)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """One line: how many cases were planned, how many judged, and how to ask the same again."""
    reports = [report for every in terminalreporter.stats.values() for report in every if hasattr(report, "when")]
    carried = [dict(report.user_properties) for report in reports if report.when == "call"]
    counts = [numbers for numbers in carried if f"{_COUNTS}_planned" in numbers]
    if not counts:
        return
    planned, judged = (sum(numbers[f"{_COUNTS}_{name}"] for numbers in counts) for name in ("planned", "judged"))
    seeds = sorted({numbers[f"{_COUNTS}_seed"] for numbers in counts})
    again = f"again with --contactverif-seed={seeds[0]}" if len(seeds) == 1 else "seeds as the tests give them"
    terminalreporter.write_line(
        f"contactverif: {len(counts)} checks, {planned} cases planned, {judged} judged; {again}"
    )
