"""One timed solution of a cell by one formulation, here or in the plugin's own process.

Where the plugin has a process of its own, all of Newton's method runs there, so that no way between two processes is
timed. Such a process may say of its seconds and counts what it likes. Errors are measured elsewhere, on a solution that
the judge finds by questions.
"""

from __future__ import annotations

import gc
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache
from time import perf_counter, process_time

import numpy as np

from contactverif.contract.errors import PluginError
from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import solve_in_tries
from contactverif.mechanics.trace import Trace
from contactverif.problems.problem import PosedProblem
from contactverif.studies.bench.bench_plan import pose
from contactverif.studies.bench.meter import Meter, add_meter
from contactverif_reports.bench.results import COUNTS, PARTS, Cell

# Seconds. A shorter solution is timed when it is repeated: other processes have used the caches meanwhile.
_SHORT = 0.05
_LARGEST = 2**53  # No time and no count is larger.
_COUNTED = ("pair", "residual", "tangent", "differences")  # The states that a meter counts, in the order of `COUNTS`.


@dataclass(frozen=True, slots=True)
class TimedSolution:
    """The time and the counts of one solution."""

    seconds: dict[str, float]  # The seconds of the processor by part.
    wall: float  # The seconds of the wall clock.
    counts: dict[str, int]  # The counts by name.


def solve_with_clock(subject: Subject, posed: PosedProblem) -> tuple[TimedSolution, tuple[Trace, ...]]:
    """Solve in this process; return times and counts, and the tries."""
    meter = Meter()
    formulation = add_meter(subject, posed.first_guess, meter)
    wall, start = perf_counter(), process_time()
    with np.errstate(all="ignore"):  # A diverging iteration overflows; its end says so.
        tries = solve_in_tries(posed.scene, formulation, posed.start, posed.step)
    total, wall = process_time() - start, perf_counter() - wall
    seconds = meter.seconds | {"solve": sum(trace.seconds["solve"] for trace in tries), "total": total}
    counts = (sum(trace.n_iterations for trace in tries), *(meter.states[name] for name in _COUNTED))
    return TimedSolution(seconds, wall, dict(zip(COUNTS, counts, strict=True))), tries


def solve_there(subject: Subject, cell: Cell, seed: int) -> TimedSolution | None:
    """Let the formulation's process solve a cell; return None if it has no process of its own."""
    words = subject.run_there("solve", f"{__name__}:answer", json.dumps([asdict(cell), seed]).encode())
    if words is None:
        return None
    try:
        timed = TimedSolution(**json.loads(words))
        numbers = [timed.wall, *(timed.seconds[part] for part in PARTS), *(timed.counts[name] for name in COUNTS)]
        usual = len(numbers) == 1 + len(timed.seconds) + len(timed.counts) and all(0 <= n < _LARGEST for n in numbers)
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise PluginError("solve: an answer that cannot be read", "channel") from error
    if not usual:
        raise PluginError("solve: times and counts that cannot be", "channel")
    return timed


def answer(subject: Subject, words: bytes) -> bytes:
    """Solve a cell in the formulation's process, and return times and counts for `solve_there`."""
    cell, seed = json.loads(words)
    posed = _pose(Cell(**cell), subject, seed)
    with without_collector():
        timed, _ = solve_with_clock(subject, posed)
        if timed.seconds["total"] < _SHORT:
            timed, _ = solve_with_clock(subject, posed)
    return json.dumps(asdict(timed)).encode()


_pose = lru_cache(maxsize=1)(pose)  # The scene of a cell is made once, and its bodies are condensed once.


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
