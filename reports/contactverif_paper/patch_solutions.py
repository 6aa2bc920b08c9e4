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
from typing import Annotated

import numpy as np

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray
from contactverif.mechanics import newton
from contactverif.mechanics.scene import Scene
from contactverif.problems import catalogue
from contactverif.problems.uniform_stress import stress_error
from contactverif.studies import solved_scenes
from contactverif_paper.paper_columns import WORDS, Column, sparse_column
from contactverif_paper.paper_formulations import (
    NTS,
    NTS_AR,
    TWO_PASS,
    VIRTUAL,
    VTS_ME,
    VTS_PPT,
    PaperFormulation,
    subject_of,
)
from contactverif_reports.plot.solved_scene import Solution, SolvedScene

YOUNG = 1e4  # The modulus of the catalogue's scenes.
FAILS = 1e-2  # A stress error above this share of the pressure is a failure.
STRESS_ERROR = "largest error of a stress at a Gauss point over the pressure"
_STIFFNESS_RANGE = 1e-2, 1e2  # ε̂ over E, per unit of length: where `stiffness_limit` searches.

TWO = (NTS, NTS_AR)
FOUR = (*TWO, TWO_PASS, VTS_ME)
FIVE = (*FOUR, VTS_PPT)


PASSES, FAILURE, SILENT = 1, 0, -1  # What the paper says of a patch test.
PRINTED_COLUMN = Column(
    "", "1", "what the paper says", "missing: nothing", SILENT, {"fails": FAILURE, "passes": PASSES}
)


@dataclass(frozen=True, slots=True)
class PatchSetup:
    """A patch test of the paper as its figures show it."""

    scene: Annotated[str, Column("", WORDS, "scene, as on the command line")]
    title: str  # What the paper calls it, at the beginning of a sentence.
    pressures: str  # Numbers of the paper's figures.
    meshes: str
    # Ends of the axes that the paper prints: the coordinate, and the pressure over the exact one.
    x_axis: tuple[float, float]
    axis: tuple[float, float]
    stiffness: Annotated[float, Column("", "m-1", "penalty over E")]  # It is our choice.
    formulations: tuple[PaperFormulation, ...]  # The formulations that the figures show.
    close_up: tuple[float, float] | None = None  # Ends of the pressure axis of the close-up; None where there is none.
    origin: float = 0.0  # The scene's coordinate of the origin of the paper's axis, a length.

    @property
    def figure(self) -> Annotated[str, Column("", WORDS, "meshes, pressures")]:
        """The numbers of the paper's figures."""
        return f"{self.meshes}, {self.pressures}"


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """The pressure that one formulation leaves on a scene."""

    formulation: PaperFormulation
    x: Annotated[FloatArray, sparse_column("point", schema.LENGTH, "reference coordinate on the paper's axis")]
    pressure: Annotated[FloatArray, sparse_column("point", "1", "contact pressure over the exact one")]
    # True at the formulation's own contact points; else nodal forces over the nodes' shares of the interface.
    at_points: Annotated[
        bool, Column("", "1", "where pressures are taken", "missing: not shown", -1, {"at_nodes": 0, "at_points": 1})
    ]
    solution: Solution

    @property
    def departure(self) -> float:
        """The largest |p/p_exact − 1|."""
        return float(abs(self.pressure - 1).max())

    @property
    def stress_error(self) -> Annotated[float, Column("", "1", STRESS_ERROR, fill=np.nan)]:
        """The largest error of a stress over the pressure."""
        return self.solution.stress_error

    @property
    def iterations(self) -> Annotated[float, Column("", "1", "linear systems solved", fill=np.nan)]:
        """The number of linear systems solved."""
        return float(len(self.solution.residuals) - 1)

    @property
    def end(self) -> Annotated[str, Column("", WORDS, "how Newton's method ended")]:
        """The end of Newton's method."""
        return self.solution.end

    @property
    def displacement_x(self) -> Annotated[FloatArray, sparse_column("node", schema.LENGTH, "displacement along x")]:
        """The displacements of all nodes along x."""
        return np.vstack(self.solution.displacements)[:, 0]

    @property
    def displacement_y(self) -> Annotated[FloatArray, sparse_column("node", schema.LENGTH, "displacement along y")]:
        """The displacements of all nodes along y."""
        return np.vstack(self.solution.displacements)[:, 1]


@dataclass(frozen=True, slots=True, eq=False)
class PatchSolution:
    """A patch test, solved by the formulations of its figures."""

    setup: PatchSetup
    exact_pressure: Annotated[float, Column("", schema.STRESS, "exact contact pressure")]
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
    def penalty(self) -> Annotated[float, Column("", schema.PENALTY, "penalty")]:
        """The penalty."""
        return self.solved.case.penalty

    @property
    def body(self) -> Annotated[FloatArray, Column("node", "1", "body of the node; 0 is the slave", fill=np.nan)]:
        """The number of the body of each node that displacements belong to."""
        return np.repeat(np.arange(2.0), [len(body.nodes) for body in self.solved.bodies])

    @property
    def node_x(self) -> Annotated[FloatArray, Column("node", schema.LENGTH, "reference x", fill=np.nan)]:
        """The coordinates of these nodes along x."""
        return np.vstack([body.nodes for body in self.solved.bodies])[:, 0]

    @property
    def node_y(self) -> Annotated[FloatArray, Column("node", schema.LENGTH, "reference y", fill=np.nan)]:
        """The coordinates of these nodes along y."""
        return np.vstack([body.nodes for body in self.solved.bodies])[:, 1]


@cache
def patch_solution(setup: PatchSetup) -> PatchSolution:
    """Solve a patch test at the penalty of its figures."""
    return _solution(setup, setup.stiffness)


def departures(setup: PatchSetup, stiffness: float) -> dict[PaperFormulation, float]:
    """Return {formulation: largest |p/p_exact − 1|} at another penalty, ε̂ = stiffness × E."""
    return {curve.formulation: curve.departure for curve in _solution(setup, stiffness).curves}


def stiffness_limit(setup: PatchSetup, holds: Callable[[dict[PaperFormulation, float]], bool]) -> float:
    """Return the ε̂/E below which a relation between departures holds, by bisection to 1 %; NaN if there is none."""
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
    return solved_error(formulation, catalogue.make_scene(scene_name, ratio=ratio))


def solved_error(formulation: PaperFormulation, scene: Scene) -> float:
    """Return the largest error of a stress over the pressure; NaN where Newton's method ends at no solution."""
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
    at_points = solution.points is not None and formulation in VIRTUAL
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
