"""Measure how long the parts of a formulation take, and print the ratios. No verdict depends on a clock.

Run with `tox -e bench`, or `pytest tests/benchmarks --benchmark-only -s`.
"""

from __future__ import annotations

from collections.abc import Callable
from statistics import median
from time import perf_counter
from typing import Any

import numpy as np
import pytest

import contactverif_nts
from contactverif import Case, Interface
from contactverif.contract.subject import Subject
from contactverif_properties.tangent_directional import measure_directional

NAMES = ("nts", "vts_me", "vts_ppt", "vts_ppt_balanced")


def make_wavy(n_slave: int) -> Case:
    """Return a wavy slave pressed into a wavy master of 1.3 times as many segments, all in contact."""
    upper, lower = np.linspace(0, n_slave, n_slave + 1), np.linspace(-0.3, n_slave + 0.4, int(1.3 * n_slave) + 1)
    slave = np.column_stack([upper, -0.2 - 0.05 * np.cos(upper) ** 2])
    interface = Interface.from_chains(slave, np.column_stack([lower, 0.05 * np.sin(lower)])[::-1])
    return Case(interface, interface.nodes.ravel(), penalty=10.0, seed=1)


def time_in_turns(*calls: Callable[[], Any], rounds: int = 9, repeats: int = 20) -> list[float]:
    """Return the median seconds of one call of each, measured in turns so that a slow moment hits all of them."""
    times: list[list[float]] = [[] for _ in calls]
    for _ in range(rounds):
        for call, durations in zip(calls, times, strict=True):
            start = perf_counter()
            for _ in range(repeats):
                call()
            durations.append((perf_counter() - start) / repeats)
    return [median(durations) for durations in times]


@pytest.mark.parametrize("n_slave", [10, 100, 1000])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("verb", ["pair", "residual", "tangent"])
def test_verb(benchmark: Any, verb: str, name: str, n_slave: int) -> None:
    benchmark.group = f"{verb}, {n_slave} slave segments"
    case = make_wavy(n_slave)
    formulation = Subject(name, getattr(contactverif_nts, name)).for_case(case)
    pairing = formulation.pair(case.interface, case.z)
    calls = {
        "pair": lambda: formulation.pair(case.interface, case.z),
        "residual": lambda: formulation.residual(case.interface, pairing, case.z),
        "tangent": lambda: formulation.tangent(case.interface, pairing, case.z),
    }
    benchmark(calls[verb])


@pytest.mark.parametrize("n_slave", [10, 100])
@pytest.mark.parametrize("name", NAMES)
def test_directional_check(benchmark: Any, capsys: pytest.CaptureFixture[str], name: str, n_slave: int) -> None:
    benchmark.group = f"tangent.directional, {n_slave} slave segments"
    case, subject = make_wavy(n_slave), Subject(name, getattr(contactverif_nts, name))
    formulation = subject.for_case(case)
    pairing = formulation.pair(case.interface, case.z)

    def evaluate() -> Any:
        return formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)

    check, whole, frozen = time_in_turns(
        lambda: measure_directional(case, subject),
        evaluate,
        lambda: formulation.residual(case.interface, pairing, case.z),
    )
    benchmark.extra_info |= {"over a residual with its search": check / whole, "over a residual": check / frozen}
    with capsys.disabled():
        print(
            f"\ntangent.directional, {name}, {n_slave} segments: {1e6 * check:.0f} µs = "
            f"{check / whole:.1f} × a residual with its search ({1e6 * whole:.0f} µs) = "
            f"{check / frozen:.0f} × a residual alone ({1e6 * frozen:.0f} µs)"
        )
    benchmark(lambda: measure_directional(case, subject))
