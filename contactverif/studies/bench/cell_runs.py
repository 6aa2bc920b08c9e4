"""One cell of the bench: all formulations solve it in turns, again and again, each repeat timed.

The first turn is not timed: kernels compile, bodies are condensed, errors and counts are taken. Then all formulations
take turns, and who begins changes, so that whatever disturbs the machine disturbs all. In each repeat a fixed piece of
work, the yardstick, is timed too.

Seconds are those of the processor: on two cores beside four other programs they grew by a quarter at most, where the
wall clock showed eight times as many. They do not hold the work that a plugin leaves to other processes, so the wall
clock is kept beside them.
"""

from __future__ import annotations

import gc
from collections.abc import Sequence
from dataclasses import dataclass, field
from time import process_time

import numpy as np

from contactverif.contract.errors import ContractError
from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import solution_of
from contactverif.studies.bench.bench_plan import is_solved, largest_errors, pose
from contactverif.studies.bench.timed_solution import solve_with_clock, without_collector
from contactverif_reports.bench.results import PARTS, Cell, Outcome


@dataclass(slots=True)
class RunRecord:
    """One formulation in one cell."""

    outcome: int = int(Outcome.CRASHED)  # The outcome, see `Outcome`.
    remark: str = ""  # How it ended, if it is no solution.
    errors: dict[str, float] = field(default_factory=dict)  # The errors by kind; empty without a solution.
    counts: dict[str, int] = field(default_factory=dict)  # The counts by name; empty after a crash.
    # The seconds of the processor in each repeat by part; empty after a crash.
    seconds: dict[str, list[float]] = field(default_factory=dict)
    wall: list[float] = field(default_factory=list)  # The seconds of the wall clock in each repeat.


@dataclass(slots=True)
class CellRecord:
    """All formulations in one cell, as the journal keeps it."""

    segments: int  # The numbers of slave segments and of unknowns of the scene.
    unknowns: int
    yardstick: list[float]  # The seconds of the yardstick in each repeat.
    runs: dict[str, RunRecord]  # The runs by formulation.


def run_cell(cell: Cell, subjects: Sequence[Subject], repeats: int, seed: int) -> CellRecord:
    """Solve a cell with all formulations, in turns."""
    runners = [_Runner(subject, cell, seed) for subject in subjects]
    scene = runners[0].instance.scene
    for runner in runners:
        runner.warm_up()
    yardstick = []
    gc.collect()
    with without_collector():
        for turn in range(repeats):
            yardstick.append(time_yardstick())
            for place in range(len(runners)):
                runners[(place + turn) % len(runners)].take_turn()
    runs = {runner.subject.name: runner.record for runner in runners}
    return CellRecord(len(scene.interface.slave), scene.n_free, yardstick, runs)


def time_yardstick() -> float:
    """Return the seconds that a fixed piece of work takes: small steps of numpy and a linear system, as in Newton's."""
    values, matrix = np.linspace(1.0, 2.0, 64), np.eye(64) + 1 / np.add.outer(np.arange(1.0, 65.0), np.arange(64.0))
    start = process_time()
    for _ in range(100):
        values = np.sqrt(values * values[::-1])
    np.linalg.solve(matrix, values)
    return process_time() - start


class _Runner:
    """One formulation in one cell, with its record so far."""

    def __init__(self, subject: Subject, cell: Cell, seed: int) -> None:
        self.subject, self.instance, self.record = subject, pose(cell, subject, seed), RunRecord()

    def warm_up(self) -> None:
        """Solve once without the clock, and record outcome, errors and counts."""
        try:
            timed, tries = solve_with_clock(self.subject, self.instance)
            formulation = self.subject.for_case(self.instance.first_guess)
            solution = solution_of(tries[-1], formulation, nodal=self.subject.traits.rules.penalty == "nodal")
            solved = is_solved(solution)
            self.record.errors = largest_errors(self.instance, solution) if solved else {}
        except ContractError as error:
            self.record.remark = str(error)
            return
        self.record.counts = timed.counts
        self.record.outcome = int(Outcome.SOLVED if solved else Outcome.NOT_SOLVED)
        self.record.remark = "" if solved else tries[-1].end.label
        self.record.seconds = {part: [] for part in PARTS}

    def take_turn(self) -> None:
        """Solve once with the clock; a formulation that crashed takes no turn."""
        if self.record.outcome == Outcome.CRASHED:
            return
        try:
            timed, _ = solve_with_clock(self.subject, self.instance)
        except ContractError as error:  # A plugin with a memory may fail later.
            self.record = RunRecord(remark=str(error))
            return
        for part, seconds in timed.seconds.items():
            self.record.seconds[part].append(seconds)
        self.record.wall.append(timed.wall)
