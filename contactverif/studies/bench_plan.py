"""The plan of a bench, and the problem that is solved in each cell of it.

Every problem has the exact solution of its own penalty, so that a soft penalty is no error. Two plans that are equal
give equal results but for seconds.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import product
from typing import Any
from zlib import crc32

import numpy as np

from contactverif.contract.errors import MisuseError, describe_error, place_of_error
from contactverif.contract.interface import PLANE, SPACE, TRIANGLE
from contactverif.contract.result import NotLoaded
from contactverif.contract.subject import Subject
from contactverif.contract.traits import Traits
from contactverif.mechanics.accuracy import Solution
from contactverif.plugins.registry import load_problems
from contactverif.problems.problem import Errors, Problem, ProblemInstance, Variation
from contactverif_reports.bench_results import ERRORS, Cell

INSTANCES, PROCESSES = 15, 5  # Instances of each mesh, and processes of each formulation, of a full bench.
QUICK_MESHES, QUICK_INSTANCES, QUICK_PROCESSES = 2, 5, 2
MOST = 1000  # Instances or processes
NEARLY_BALANCED = 1e-4  # An iterate that is out of balance by this share of the largest force is a solution.
OTHER_DIMENSION = "another dimension"  # Begins the reason of what is left out, which is no failure.
_SIZE, _LOAD = 0.2, 0.2  # The largest changes of size and load


@dataclass(frozen=True, slots=True)
class BenchPlan:
    """The cells of a bench, the processes that time them, and the seed of the variations."""

    cells: tuple[Cell, ...]  # In the order in which they are run
    processes: int = PROCESSES  # The number of processes of each formulation, one after another
    seed: int = 0  # The seed of the variations
    not_loaded: dict[str, str] = field(default_factory=dict)  # {problem: why it did not load}

    @property
    def problems(self) -> dict[str, Problem]:
        """The problems that the cells are of, by name."""
        return {name: _problem(name) for name in dict.fromkeys(cell.scene for cell in self.cells)}


def make_plan(
    scenes: Sequence[str] = (), *, quick: bool = False, instances: int | None = None, processes: int | None = None
) -> BenchPlan:
    """Return the plan of a bench of scenes, or of all problems; a quick one has coarse meshes and few processes."""
    problems = load_problems()
    usual = (QUICK_INSTANCES, QUICK_PROCESSES) if quick else (INSTANCES, PROCESSES)
    n_instances, n_processes = (
        number if wish is None else wish for wish, number in zip((instances, processes), usual, strict=True)
    )
    for scene in scenes:
        if scene not in problems:
            raise MisuseError("--scene", repr(scene), f"one of {', '.join(problems)}")
    for option, number in (("--instances", n_instances), ("--processes", n_processes)):
        if not 1 <= number <= MOST:
            raise MisuseError(option, f"{number}", f"at least 1, at most {MOST}")
    cells: list[Cell] = []
    not_loaded = {}
    for name in filter(tuple(scenes or problems).__contains__, problems):
        problem = problems[name]
        if isinstance(problem, NotLoaded):
            not_loaded[name] = problem.reason
            continue
        meshes = problem.meshes[: QUICK_MESHES if quick else None]
        cells += [Cell(name, mesh, instance) for mesh, instance in product(meshes, range(n_instances))]
    if not cells:
        raise MisuseError("--scene", "; ".join(map(": ".join, not_loaded.items())), "a problem that loads")
    return BenchPlan(tuple(cells), n_processes, not_loaded=not_loaded)


def match_dimension(plan: BenchPlan, subjects: Sequence[Subject]) -> tuple[BenchPlan, dict[str, str]]:
    """Return the plan of problems in the plane or in space alone, and {name: why it is left out}.

    Where the plan has both, the first formulation decides.
    """
    problems = plan.problems
    dims = {problem.dim for problem in problems.values()}
    if len(dims) > 1:
        dims &= {PLANE if PLANE in subjects[0].traits.abilities.dimensions else SPACE}
    dim = min(dims)
    place, needed = ("in the plane", "segments") if dim == PLANE else ("in space", "triangles")
    others = {
        name: f"{OTHER_DIMENSION}: it is {'in space' if dim == PLANE else 'in the plane'}, the bench {place}"
        for name, problem in problems.items()
        if problem.dim != dim
    }
    for subject in subjects:
        abilities = subject.traits.abilities
        if dim not in abilities.dimensions or (dim == SPACE and TRIANGLE not in abilities.faces):
            others[subject.name] = f"{OTHER_DIMENSION}: it takes no {needed} {place}"
    if all(subject.name in others for subject in subjects):
        listed = "; ".join(f"{subject.name}: {others[subject.name]}" for subject in subjects)
        raise MisuseError(
            "NAME", listed, f"a formulation for {', '.join(name for name in problems if name not in others)}"
        )
    return replace(plan, cells=tuple(cell for cell in plan.cells if cell.scene not in others)), others


def vary(cell: Cell, seed: int) -> Variation:
    """Return the variation of an instance of a scene, the same on all meshes and in every bench of the same seed."""
    dice = np.random.default_rng([seed, crc32(cell.scene.encode()), cell.instance])
    size, load = (1 + most * dice.uniform(-1, 1) for most in (_SIZE, _LOAD))
    shift, grading = dice.uniform(-0.5, 0.5), dice.uniform(-1, 1)
    return Variation(size=size, shift=shift, grading=grading, load=load, swapped=bool(dice.integers(2)))


def pose(cell: Cell, penalty: float, traits: Traits, seed: int) -> ProblemInstance:
    """Return the problem that formulations of some traits solve in a cell at a penalty in E/h."""
    problem = _problem(cell.scene)
    try:
        instance: Any = problem.pose(cell.mesh, penalty, traits, vary(cell, seed))
    except Exception as error:  # A stranger's function may raise what it likes.
        place = f"{place_of_error(error)}, on mesh {cell.mesh} at the penalty {penalty:g}"
        cause = f"{describe_error(error)}{place}"
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
