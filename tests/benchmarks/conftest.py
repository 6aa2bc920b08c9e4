"""A benchmark measures a call beside a reference, in turns, and the file keeps their ratio.

Rules for the next editor:

- No verdict depends on a clock. Without `--benchmark-enable` each call is made once and nothing is timed.
- Seconds are those of the processor, since other programs may wait for the same core.
- The file names the processor and the versions. It names no path, no host and no user.
"""

import os
import platform
import sys
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import pytest

from contactverif.plugins.provenance import collect_provenance

HERE = Path(__file__).parent
sys.path.append(str(HERE.parents[1] / "evidence" / "bench"))  # The campaigns there are modules for some tests here.
TURNS = 9
SHORTEST_TURN = 0.004  # Seconds. A call that is shorter is repeated within its turn.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
PACKAGES = ("numpy", "scipy", "numba", "hypothesis", "xarray", "matplotlib")


def pytest_configure(config: pytest.Config) -> None:
    """Refuse to time several threads: their seconds would be added up."""
    if config.getoption("benchmark_enable") and any(os.environ.get(name) != "1" for name in THREADS):
        raise pytest.UsageError(f"benchmarks need one thread: set {', '.join(THREADS)} to 1, as `tox -e bench` does")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(pytest.mark.benchmark(timer=process_time))


@pytest.fixture
def race(benchmark: Any) -> Callable[..., None]:
    """Return a function that times a call beside a reference, in turns, under the name of a group and its own."""

    def run(group: str, name: str, racers: tuple[Callable[[], Any], Callable[[], Any], str]) -> None:
        call, reference, words = racers
        if benchmark.disabled:
            benchmark(call)
            return
        repeats, repeats_of_reference = _count_repeats(call), _count_repeats(reference)
        times_of_reference: list[float] = []

        def take_turn_of_reference() -> None:
            times_of_reference.append(_seconds(reference, repeats_of_reference))

        def take_turn() -> None:
            for _ in range(repeats):
                call()

        benchmark.group = group
        benchmark.pedantic(take_turn, setup=take_turn_of_reference, rounds=TURNS)
        times = [seconds / repeats for seconds in benchmark.stats.stats.data]
        ratios = sorted(mine / other for mine, other in zip(times, times_of_reference, strict=True))
        benchmark.extra_info |= {
            "name": name,
            "reference": words,
            "seconds": min(times),
            "seconds of the reference": min(times_of_reference),
            "ratio": {"least": ratios[0], "median": median(ratios), "greatest": ratios[-1]},
        }

    return run


def _count_repeats(call: Callable[[], Any]) -> int:
    """Return how often a call is repeated within a turn; the first call compiles and imports."""
    call()
    return max(1, round(SHORTEST_TURN / max(_seconds(call, 1), 1e-9)))


def _seconds(call: Callable[[], Any], repeats: int) -> float:
    start = process_time()
    for _ in range(repeats):
        call()
    return (process_time() - start) / repeats


def pytest_benchmark_generate_json(config: Any, benchmarks: list[Any], machine_info: dict[str, Any]) -> dict[str, Any]:
    """Return what the file holds, in place of what pytest-benchmark would write."""
    facts = collect_provenance(profile="", examples=0, seed=0)
    return {
        "processor": machine_info["cpu"].get("brand_raw", "unknown"),
        "machine": platform.machine(),
        "python": platform.python_version(),
        "versions": {name: metadata.version(name) for name in ("contactverif", *PACKAGES)},
        "commit": facts["commit"],
        "created": facts["created"],
        "turns": TURNS,
        "benchmarks": [{"group": each.group, **_round(each.extra_info)} for each in benchmarks],
    }


def _round(value: Any) -> Any:
    """Return numbers with four digits; a clock knows no more."""
    if isinstance(value, dict):
        return {name: _round(each) for name, each in value.items()}
    return float(f"{value:.4g}") if isinstance(value, float) else value
