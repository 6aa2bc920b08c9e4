"""Solves the patch tests of the paper, for the items that show them.

The paper prints no penalty. Each figure here has one of ours (ε̂ = E in case A1, softer ones in the others, per unit of
length); the table of who passes has the moderate penalty 10 E/h. How large an error is, and which of two wrong methods
is the better one, depends on the penalty; who passes does not.

Each solution is computed once in a process and shared by the items that need it.

Source: Zavarise & De Lorenzis (2009), Sections 4, 5 and 7.1.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.mechanics import newton
from contactverif.problems import catalogue
from contactverif.problems.uniform_stress import stress_error
from contactverif.studies import solved_scenes
from contactverif_paper import paper_formulations as formulations
from contactverif_paper.paper_formulations import PaperFormulation, subject_of
from contactverif_paper.paper_item import Progress
from contactverif_reports.draw.solved_scene import Solution, SolvedScene

YOUNG = 1e4  # The modulus of the catalogue's scenes.
FAILS = 1e-2  # A stress error above this share of the pressure is a failure.
_STIFFNESS_RANGE = 1e-2, 1e2  # ε̂ over E, per unit of length: where `stiffness_limit` searches.

TWO = (formulations.NTS, formulations.NTS_AR)
FOUR = (*TWO, formulations.TWO_PASS, formulations.VTS_ME)
FIVE = (*FOUR, formulations.VTS_PPT)


@dataclass(frozen=True, slots=True)
class PatchSetup:
    """A patch test of the paper as its figures show it."""

    scene: str  # Name of the scene on the command line.
    title: str  # What the paper calls it, at the beginning of a sentence.
    pressures: str  # Numbers of the paper's figures.
    meshes: str
    # Ends of the axes that the paper prints: the coordinate, and the pressure over the exact one.
    x_axis: tuple[float, float]
    axis: tuple[float, float]
    stiffness: float  # ε̂ over E, per unit of length. It is our choice.
    formulations: tuple[PaperFormulation, ...]  # The formulations that the figures show.
    close_up: tuple[float, float] | None = None  # Ends of the pressure axis of the close-up; None where there is none.
    origin: float = 0.0  # The scene's coordinate of the origin of the paper's axis, a length.

    @property
    def n_steps(self) -> int:
        """The number of solutions that `patch_solution` reports."""
        return len(self.formulations)


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """The pressure that one formulation leaves on a scene."""

    formulation: PaperFormulation  # The formulation.
    x: FloatArray  # (n_points,) Reference coordinates of the paper's axis, a length.
    pressure: FloatArray  # (n_points,) The contact pressure over the exact one.
    # True at the formulation's own contact points; else nodal forces over the nodes' shares of the interface.
    at_points: bool
    solution: Solution  # The solved scene.

    @property
    def departure(self) -> float:
        """The largest |p/p_exact − 1|."""
        return float(abs(self.pressure - 1).max())


@dataclass(frozen=True, slots=True, eq=False)
class PatchSolution:
    """A patch test, solved by the formulations of its figures."""

    setup: PatchSetup  # What was solved.
    exact: float  # The exact pressure, force per length.
    solved: SolvedScene  # The scene with all solutions, ready to be drawn.
    curves: tuple[Curve, ...]  # A curve for each formulation.

    def curve(self, formulation: PaperFormulation) -> Curve:
        """Return the curve of a formulation."""
        return next(curve for curve in self.curves if curve.formulation == formulation)

    @property
    def pressure_range(self) -> tuple[float, float]:
        """The least and the largest pressure of all curves that are solutions, over the exact one."""
        values = np.concatenate([curve.pressure for curve in self.curves if curve.solution.converged])
        return float(values.min()), float(values.max())

    @property
    def not_converged(self) -> tuple[Curve, ...]:
        """The curves that are no solutions."""
        return tuple(curve for curve in self.curves if not curve.solution.converged)


def patch_item_data(*setups: PatchSetup) -> Callable[[Progress], tuple[PatchSolution, ...]]:
    """Return the `compute` of an item that consists of these patch tests alone."""

    def compute(report_progress: Progress) -> tuple[PatchSolution, ...]:
        solutions = []
        for setup in setups:
            report_progress(setup.title)
            solutions.append(patch_solution(setup))
        return tuple(solutions)

    return compute


@cache
def patch_solution(setup: PatchSetup) -> PatchSolution:
    """Solve a patch test at the penalty of its figures."""
    return _solution(setup, setup.stiffness)


def departures(setup: PatchSetup, stiffness: float) -> dict[PaperFormulation, float]:
    """Return {formulation: largest |p/p_exact − 1|} at another penalty, ε̂ = stiffness × E."""
    return {curve.formulation: curve.departure for curve in _solution(setup, stiffness).curves}


def stiffness_limit(setup: PatchSetup, holds: Callable[[dict[PaperFormulation, float]], bool]) -> float:
    """Return the ε̂/E below which a relation between departures holds, by bisection; NaN if no limit was found.

    Returns
    -------
    float
        The limit, per unit of length, within one per cent.
    """
    low, high = _STIFFNESS_RANGE
    if not holds(departures(setup, low)) or holds(departures(setup, high)):
        return np.nan
    while high / low > 1.01:
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if holds(departures(setup, middle)) else (low, middle)
    return low


@cache
def moderate_error(formulation: PaperFormulation, scene_name: str, ratio: float = 1.0) -> float:
    """Return the largest error of a stress over the pressure at ε̂ = 10 E/h; NaN without a solution."""
    scene = catalogue.make_scene(scene_name, ratio=ratio)
    trace = newton.solve(scene, subject_of(formulation).for_case(scene.case()))
    return stress_error(scene, scene.stresses(trace.solution)) if trace.converged else np.nan


def _solution(setup: PatchSetup, stiffness: float) -> PatchSolution:
    case = catalogue.make_scene(setup.scene, penalty=stiffness * YOUNG).case()
    solved = solved_scenes.solve_scene(case, [subject_of(formulation) for formulation in setup.formulations])
    curves = tuple(
        _curve(formulation, solved, solution, setup.origin)
        for formulation, solution in zip(setup.formulations, solved.solutions, strict=True)
    )
    return PatchSolution(setup, solved.solutions[0].pressure, solved, curves)


def _curve(formulation: PaperFormulation, solved: SolvedScene, solution: Solution, origin: float) -> Curve:
    """Take pressures at the virtual slave nodes if there are any, else nodal forces over the nodes' shares (Eq. 3)."""
    at_points = solution.points is not None and formulation in formulations.VIRTUAL
    if solution.points is not None and at_points:
        x, _ = solved.points_along(solution.points)
        pressure = solution.points.pressure
    else:
        n_nodes = solved.case.interface.n_slave_nodes
        x, pressure = solved.along[:n_nodes], solved.node_pressures(solution)[:n_nodes]
        covered = np.isfinite(pressure)
        x, pressure = x[covered], pressure[covered]
    order = np.argsort(x, kind="stable")
    return Curve(formulation, x[order] - origin, pressure[order] / solution.pressure, at_points, solution)
