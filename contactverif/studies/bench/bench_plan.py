"""The plan of a bench, and the problem that is solved in each cell of it.

Every problem has the exact solution of its own penalty, so that a soft penalty is no error. Two plans that are equal
give equal results but for seconds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import product
from typing import Any

import numpy as np

from contactverif.contract.case import Case
from contactverif.contract.errors import MisuseError
from contactverif.contract.foreign_text import describe_error
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import Solution
from contactverif.problems.problem import Errors, Problem, ProblemInstance
from contactverif.problems.uniform_stress import pose_blocks
from contactverif.run.draw import draw_cases
from contactverif.run.registry import load_problems
from contactverif.strategies.solids import block_cases
from contactverif_reports.bench.results import ERRORS, RANDOM, Cell

N_RANDOM = 24  # Random scenes of a full bench.
QUICK_MESHES, QUICK_RANDOM = 2, 6  # Meshes of each scene, and random scenes, of a quick bench.
MOST_REPEATS = 1000
REPEATS = 7  # Repeats of each solution that are timed.
NEARLY_BALANCED = 1e-4  # An iterate that is out of balance by this share of the largest force is a solution.


@dataclass(frozen=True, slots=True)
class BenchPlan:
    """The cells of a bench, how often each is repeated, and the seed of its random scenes."""

    cells: tuple[Cell, ...]  # In the order in which they are run
    repeats: int = REPEATS  # The number of timed repeats
    seed: int = 0  # The seed of the random scenes
    not_loaded: dict[str, str] = field(default_factory=dict)  # {problem: why it did not load}

    @property
    def labels(self) -> dict[str, str]:
        """The words of each problem."""
        return {name: _problem(name).label for name in self._names}

    @property
    def units(self) -> dict[str, str]:
        """The unit of the penalties of each problem."""
        return {name: _problem(name).unit for name in self._names}

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(cell.scene for cell in self.cells if cell.scene != RANDOM))


def make_plan(
    scenes: Sequence[str] = (), *, quick: bool = False, repeats: int = REPEATS, n_random: int | None = None
) -> BenchPlan:
    """Return the plan of a bench of some scenes, or of all installed problems and the random scenes.

    A quick bench takes the coarsest meshes, the penalty in the middle and few random scenes.
    """
    problems = load_problems()
    names = (*problems, RANDOM)
    count = (QUICK_RANDOM if quick else N_RANDOM) if n_random is None else n_random
    _check_arguments(scenes, names, repeats, count)
    selection = tuple(scenes) or names
    cells: list[Cell] = []
    not_loaded = {}
    for name in filter(selection.__contains__, problems):
        problem = problems[name]
        if isinstance(problem, NotLoaded):
            not_loaded[name] = problem.reason
        else:
            cells += _grid(name, problem, quick=quick)
    cells += [Cell(RANDOM, number, 1.0) for number in range(count * (RANDOM in selection))]
    if not cells:
        raise _no_cells(not_loaded)
    return BenchPlan(tuple(cells), repeats, not_loaded=not_loaded)


def _check_arguments(scenes: Sequence[str], names: Sequence[str], repeats: int, count: int) -> None:
    """Refuse scenes that there are not, and numbers that are too small."""
    for scene in scenes:
        if scene not in names:
            raise MisuseError("--scene", repr(scene), f"one of {', '.join(names)}")
    if not 1 <= repeats <= MOST_REPEATS:
        raise MisuseError("--repeats", f"{repeats}", f"at least 1, at most {MOST_REPEATS}")
    if count < 0:
        raise MisuseError("--random", f"{count}", "at least 0")


def _no_cells(not_loaded: Mapping[str, str]) -> MisuseError:
    """Return the error of a plan of nothing."""
    if not_loaded:
        return MisuseError("--scene", "; ".join(map(": ".join, not_loaded.items())), "a problem that loads")
    return MisuseError("--random", "0 random scenes and no other", "at least one scene")


def _grid(name: str, problem: Problem, *, quick: bool) -> list[Cell]:
    """Return the cells of a problem; of a quick bench those of the coarsest meshes at the penalty in the middle."""
    meshes, penalties = problem.meshes, problem.penalties
    if quick:
        middle = (len(penalties) - 1) // 2
        meshes, penalties = meshes[:QUICK_MESHES], penalties[middle : middle + 1]
    return [Cell(name, mesh, stiffness) for stiffness, mesh in product(penalties, meshes)]


def pose(cell: Cell, subject: Subject, seed: int) -> ProblemInstance:
    """Return the problem that a formulation solves in a cell; the seed is that of the random scenes."""
    if cell.scene == RANDOM:
        return pose_blocks(random_cases(seed, cell.mesh + 1)[cell.mesh], subject.traits)
    try:
        instance: Any = _problem(cell.scene).pose(cell.mesh, cell.stiffness, subject.traits)
    except MisuseError:
        raise
    except Exception as error:  # A stranger's function may raise what it likes.
        cause = f"{describe_error(error)}, on mesh {cell.mesh} at the penalty {cell.stiffness:g}"
        raise MisuseError(f"pose of the problem {cell.scene}", cause, "a ProblemInstance") from error
    if not isinstance(instance, ProblemInstance):
        raise MisuseError(f"pose of the problem {cell.scene}", f"a {type(instance).__name__}", "a ProblemInstance")
    return instance


@cache
def _problem(name: str) -> Problem:
    problem = load_problems()[name]
    if isinstance(problem, NotLoaded):
        raise MisuseError("--scene", f"{name}: {problem.reason}", "a problem that loads")
    return problem


@cache
def random_cases(seed: int, count: int) -> tuple[Case, ...]:
    """Return the first random scenes: two blocks under a uniform pressure that is known exactly."""
    source = block_cases()
    assert source is not None
    return draw_cases(source, seed=f"bench {seed}", examples=count).cases


def largest_errors(instance: ProblemInstance, solution: Solution) -> Errors:
    """Return the largest error of each kind of a bench, such as "forces" of "slave forces" and "master forces"."""
    largest: Errors = {}
    for name, error in instance.errors(solution).items():
        kind = name.rpartition(" ")[2]
        if kind in ERRORS:
            largest[kind] = max(largest.get(kind, error), error)
    return largest


def is_solved(solution: Solution) -> bool:
    """Return whether the last iterate is a solution, or out of balance by a small share of the largest force."""
    return solution.is_balanced_to(NEARLY_BALANCED * float(np.abs(solution.forces).max(initial=0.0)))
