"""One timed solution of a cell by one formulation.

Newton's method runs in this process. Where the plugin has a process of its own, that tells the seconds of each of its
calls, and no way between two processes is timed. Such a process may say of its seconds what it likes.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from time import perf_counter, process_time

import numpy as np

from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import solve_in_tries
from contactverif.mechanics.trace import Trace
from contactverif.problems.problem import ProblemInstance
from contactverif.studies.bench.meter import Meter, add_meter
from contactverif_reports.bench.results import COUNTS

_COUNTED = ("pair", "residual", "tangent", "differences")  # The states that a meter counts, in the order of `COUNTS`.


@dataclass(frozen=True, slots=True)
class TimedSolution:
    """The time and the counts of one solution."""

    seconds: dict[str, float]  # The seconds of the processor by part.
    wall: float  # The seconds of the wall clock.
    counts: dict[str, int]  # The counts by name.


def solve_with_clock(subject: Subject, instance: ProblemInstance) -> tuple[TimedSolution, tuple[Trace, ...]]:
    """Solve in this process; return times and counts, and the tries."""
    meter = Meter()
    formulation = add_meter(subject, instance.first_guess, meter)
    wall, start = perf_counter(), process_time()
    with np.errstate(all="ignore"):  # A diverging iteration overflows; its end says so.
        tries = solve_in_tries(instance.scene, formulation, instance.start, instance.step)
    total, wall = process_time() - start - meter.excess, perf_counter() - wall - meter.wall_excess
    seconds = meter.seconds | {"solve": sum(trace.solve_seconds for trace in tries), "total": total}
    counts = (sum(trace.n_iterations for trace in tries), *(meter.states[name] for name in _COUNTED))
    return TimedSolution(seconds, wall, dict(zip(COUNTS, counts, strict=True))), tries


@contextmanager
def without_collector() -> Iterator[None]:
    """Keep Python's collector of garbage out of the times, as `timeit` does."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()
