"""The scenes of the bench: what is solved in a cell, where Newton's method starts, and the errors of its solution.

Rule for the next editor: every scene has the exact solution of its own penalty, so that a soft penalty is no error.
Errors are those of the properties `accuracy.*`: `contactverif.mechanics.accuracy` on the scenes' exact fields.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from math import inf

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.subject import Subject
from contactverif.mechanics.accuracy import Solution, force_error, pressure_error, shape_integrals
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.problems import blocks, kinked_patch, ring_errors, wavy_errors
from contactverif.problems.hertz_errors import NEARLY_BALANCED, HertzStudy, errors_of_solution
from contactverif.problems.shrink_fit import ShrinkFit, shrink_fit
from contactverif.problems.wavy import COLUMNS, UPPER, WavyProblem, wavy_scene
from contactverif.run.draw import draw_cases
from contactverif.strategies.solids import block_cases
from contactverif_reports.bench.results import RANDOM, Cell

RINGS = ShrinkFit(interference=1e-2)  # The interference is larger than the height of a facet.
ROOF, WIDTH = 1.5, 8.0  # Height and width of the zigzag with one tooth, lengths.

Errors = dict[str, float]  # {kind of error: number}; a kind that is not reported is not there.


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """The problem that one formulation solves in a cell.

    Attributes
    ----------
    scene : Scene
        The scene with its penalty ε̂.
    start : FloatArray | None, shape (n_free,)
        The first iterate; None for the first guess of the scene.
    step : float | None
        The step of differences where the formulation has no tangent, a length; None for the usual one.
    errors : Callable[[Solution], dict[str, float]]
        The errors of a solution by kind.
    """

    scene: Scene
    start: FloatArray | None
    step: float | None
    errors: Callable[[Solution], Errors]

    @property
    def case(self) -> Case:
        """The first guess, as a case with the penalty."""
        return Case(self.scene.interface, self.scene.positions(self.scene.start), self.scene.penalty)


def make_task(cell: Cell, subject: Subject, seed: int) -> Task:
    """Return what a formulation solves in a cell.

    Parameters
    ----------
    cell : Cell
        The scene, the mesh and the penalty.
    subject : Subject
        The formulation. With multipliers the exact solution is that without springs.
    seed : int
        The seed of the random scenes.
    """
    multipliers = subject.traits.enforcement == "multiplier"
    if cell.scene == RANDOM:
        return _random_task(random_cases(seed, cell.mesh + 1)[cell.mesh], multipliers)
    if cell.scene == "rings":
        return _ring_task(cell, subject, multipliers)
    return {"wavy": _wavy_task, "hertz": _hertz_task, "kinked": _kinked_task}[cell.scene](cell, multipliers)


@cache
def random_cases(seed: int, count: int) -> tuple[Case, ...]:
    """Return the first random scenes: two blocks under a uniform pressure that is known exactly."""
    source = block_cases()
    assert source is not None
    return draw_cases(source, seed=f"bench {seed}", examples=count).cases


def _wavy_task(cell: Cell, multipliers: bool) -> Task:
    penalty = cell.stiffness * WavyProblem().young[UPPER] * min(COLUMNS) * cell.mesh / WavyProblem().wavelength
    problem = WavyProblem(penalty=inf if multipliers else penalty)

    def errors(solution: Solution) -> Errors:
        return _largest(
            wavy_errors.wavy_errors(solution, problem, UPPER),
            forces=(wavy_errors.SLAVE_FORCES, wavy_errors.MASTER_FORCES),
            displacement=(wavy_errors.SLAVE_MOTION, wavy_errors.MASTER_MOTION),
            pressure=(wavy_errors.PRESSURE,),
        )

    scene = replace(wavy_scene(problem, cell.mesh, UPPER), penalty=penalty)
    return Task(scene, None, (problem.mean - problem.wave) / penalty / 16, errors)


def _hertz_task(cell: Cell, multipliers: bool) -> Task:
    study = HertzStudy(parabola_is_slave=True, stiffness=cell.stiffness)
    scene, start = study.scene(cell.mesh, multipliers=multipliers)

    def errors(solution: Solution) -> Errors:
        hertz = errors_of_solution(study, cell.mesh, solution, multipliers=multipliers)
        numbers = {"slave": hertz.slave, "master": hertz.master, "displacement": hertz.displacement}
        if hertz.pressure is not None:
            numbers["pressure"] = hertz.pressure
        return _largest(numbers, forces=("slave", "master"), displacement=("displacement",), pressure=("pressure",))

    return Task(scene, start, None, errors)


def _ring_task(cell: Cell, subject: Subject, multipliers: bool) -> Task:
    penalty = inf if multipliers else cell.stiffness
    fit = RINGS.finite("inner", penalty, "reference" if subject.traits.area == "reference" else "current")

    def errors(solution: Solution) -> Errors:
        forces = [ring_errors.ring_force_error(solution, fit, "inner", of_master=side) for side in (False, True)]
        numbers = {"forces": max(forces), "displacement": ring_errors.ring_motion_error(solution, RINGS, fit, "inner")}
        pressure = ring_errors.ring_pressure_error(solution, fit)
        return numbers if pressure is None else numbers | {"pressure": pressure}

    return Task(replace(shrink_fit(RINGS, refine=cell.mesh), penalty=cell.stiffness), None, None, errors)


def _kinked_task(cell: Cell, multipliers: bool) -> Task:
    """Return blocks on a zigzag of so many teeth: two normals, so that the uniform state is exact."""
    count = 2 * cell.mesh
    line = tuple((WIDTH * place / count, ROOF / cell.mesh * (place % 2)) for place in range(count + 1))
    problem = kinked_patch.KinkedPatch(line)
    penalty = cell.stiffness * problem.young
    scene = kinked_patch.kinked_patch(problem, penalty=penalty)
    exact = kinked_patch.exact_unknowns(problem, scene, 0.0 if multipliers else problem.pressure / penalty)
    return Task(scene, None, None, lambda solution: uniform_errors(solution, problem.pressure, exact))


def _random_task(case: Case, multipliers: bool) -> Task:
    scene = scene_of(case)
    penalty = inf if multipliers else case.penalty
    pressure = blocks.pressure_of(case, penalty)
    exact = blocks.exact_unknowns(scene, pressure, penalty)
    return Task(scene, None, None, lambda solution: uniform_errors(solution, pressure, exact))


def uniform_errors(solution: Solution, pressure: float, exact: FloatArray) -> Errors:
    """Return the errors of a solution whose exact pressure is uniform.

    Parameters
    ----------
    solution : Solution
        The solution.
    pressure : float
        The exact pressure, force per length.
    exact : FloatArray, shape (n_free,)
        The exact unknowns of the scene.
    """
    interface, moves = solution.interface, solution.displacements
    exact_moves = solution.scene.positions(exact).reshape(-1, 2) - interface.nodes
    forces, squares = [], np.zeros(2)
    for surface in (interface.slave, interface.master):
        integrals = shape_integrals(surface, interface.nodes)
        along = np.diff(interface.nodes[surface.segments], axis=1)[:, 0]
        inwards = pressure / 2 * np.column_stack([-along[:, 1], along[:, 0]])  # The body is on the left.
        pushes = np.zeros(interface.nodes.shape)
        np.add.at(pushes, surface.segments, inwards[:, None])
        forces.append(force_error(solution.forces, pushes, integrals))
        squares += [integrals @ (field**2).sum(axis=1) for field in (moves - exact_moves, exact_moves)]
    errors = {"forces": max(forces), "displacement": float(np.sqrt(squares[0] / squares[1]))}
    reported = pressure_error(solution, lambda places: np.full(len(places), pressure), pressure)
    return errors if reported is None else errors | {"pressure": reported}


def is_solved(solution: Solution) -> bool:
    """Return whether the last iterate is a solution, or out of balance by a small share of the largest force."""
    largest = float(np.abs(solution.forces).max(initial=0.0))
    return solution.balanced or bool(solution.trace.residuals[-1] <= NEARLY_BALANCED * largest)


def _largest(numbers: Errors, **names: tuple[str, ...]) -> Errors:
    """Return the largest number of each kind; kinds without numbers are left out."""
    kinds = {kind: [numbers[name] for name in group if name in numbers] for kind, group in names.items()}
    return {kind: max(values) for kind, values in kinds.items() if values}
