"""Solves Example 2 over formulations, meshes, sizes and slopes, for the items that show it.

Each solution is computed once in a process.

Source: Zavarise & De Lorenzis (2009), Section 7.2. What is given and what is chosen is said in
`contactverif.problems.disk`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif.mechanics import newton
from contactverif.mechanics.scene import Scene
from contactverif.problems.disk import DiskProblem, disk_on_foundation
from contactverif_paper.paper_formulations import PaperFormulation, subject_of

PAPER = DiskProblem()


@dataclass(frozen=True, slots=True, eq=False)
class DiskSolution:
    """A solution of Example 2."""

    formulation: PaperFormulation  # The formulation.
    problem: DiskProblem  # What was solved.
    converged: bool  # True if it is a solution.
    iterations: int  # Linear systems solved, from the disk lowered to roundoff.
    x: FloatArray  # (n_points,) The contact points from left to right: a length, and force per length.
    pressure: FloatArray
    half_width: float  # Half-width of the contact, where the gap changes its sign, a length; NaN if it does not.

    @property
    def peak(self) -> float:
        """The largest pressure."""
        return float(self.pressure.max())

    @property
    def excess(self) -> float:
        """The largest pressure over that of Hertz on a Winkler layer, less 1."""
        return self.peak / self.problem.winkler_contact().peak - 1


@cache
def solve_disk(
    formulation: PaperFormulation, problem: DiskProblem = PAPER, refine: int = 1, lowered: float = 1.0
) -> DiskSolution:
    """Solve Example 2.

    Parameters
    ----------
    formulation : PaperFormulation
        The formulation.
    problem : DiskProblem
        Radius, materials, force, penalty, size of the foundation.
    refine : int
        Parts that each side of each cell of the base meshes is divided into.
    lowered : float
        Depth of the disk in the first guess, over what is about right.
    """
    scene = disk_scene(problem, refine)
    plugin = subject_of(formulation).for_case(scene.case())
    trace = newton.solve(scene, plugin, start=lowered * scene.start)
    points = plugin.contact_points(scene.interface, plugin.pair(scene.interface, trace.z), trace.z)
    pressure = np.where(points.active, points.pressure, 0.0)
    order = np.argsort(points.position[:, 0], kind="stable")
    x, gap = points.position[order, 0], points.gap[order]
    return DiskSolution(
        formulation=formulation,
        problem=problem,
        converged=trace.converged,
        iterations=trace.n_iterations,
        x=x,
        pressure=pressure[order],
        half_width=_half_width(x, gap),
    )


@lru_cache(maxsize=2)
def disk_scene(problem: DiskProblem = PAPER, refine: int = 1) -> Scene:
    """Return the scene of Example 2.

    The last two are kept, because condensing a scene takes longer than solving it.
    """
    return disk_on_foundation(problem, refine=refine)


def flatter(slope: float) -> DiskProblem:
    """Return a contact of the same width and the same E*/(ε̂ a) with a/R smaller by that factor: smaller strains."""
    return DiskProblem(radius=PAPER.radius / slope, force=PAPER.force * slope)


def difference(solution: DiskSolution, other: DiskSolution) -> tuple[FloatArray, FloatArray]:
    """Return x of the points in contact in both, and the difference of their pressures (Fig. 39)."""
    if solution.x.shape != other.x.shape:
        counts = (
            f"{len(solution.x)} points of {solution.formulation.name} and {len(other.x)} of {other.formulation.name}"
        )
        raise MisuseError("difference", counts, "formulations with the same contact points")
    both = (solution.pressure > 0) & (other.pressure > 0)
    return other.x[both], (solution.pressure - other.pressure)[both]


def _half_width(x: FloatArray, gap: FloatArray) -> float:
    """Return half the distance from the first to the last change of sign of the gap, interpolated between points."""
    edges = np.flatnonzero((gap[:-1] <= 0) != (gap[1:] <= 0))
    if len(edges) < 2:
        return np.nan
    places = x[edges] - gap[edges] * (x[edges + 1] - x[edges]) / (gap[edges + 1] - gap[edges])
    return float(places[-1] - places[0]) / 2
