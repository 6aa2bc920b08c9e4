"""Solves Example 2 over formulations, meshes, sizes and slopes, for the items that show it.

Each solution is computed once in a process.

Source: Zavarise & De Lorenzis (2009), Section 7.2. What is given and what is chosen is said in
`contactverif.problems.disk`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Annotated

import numpy as np

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif.mechanics import newton
from contactverif.mechanics.scene import Scene
from contactverif.problems.disk import DiskProblem, disk_on_foundation
from contactverif_paper.paper_columns import Column
from contactverif_paper.paper_formulations import PaperFormulation, subject_of

PAPER = DiskProblem()
ENERGY = 1e-15  # The paper's energy norm. Its unit is not said; here it is taken over the energy of the first step.


@dataclass(frozen=True, slots=True, eq=False)
class DiskSolution:
    """A solution of Example 2."""

    formulation: PaperFormulation
    problem: DiskProblem
    # From the disk lowered to roundoff; −1 without a solution.
    iterations: Annotated[int, Column("", "1", "linear systems")]
    by_energy: Annotated[int, Column("", "1", "linear systems until the energy of a step is 1e-15 of the first")]
    # The contact points from left to right.
    x: Annotated[FloatArray, Column("point", schema.LENGTH, "x along the interface", fill=np.nan)]
    pressure: Annotated[FloatArray, Column("point", schema.STRESS, "contact pressure", fill=np.nan)]
    # Where the gap changes its sign; NaN if it does not.
    half_width: Annotated[float, Column("", schema.LENGTH, "half-width of the contact")]

    @property
    def peak(self) -> Annotated[float, Column("", schema.STRESS, "largest contact pressure", name="largest")]:
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
    """Solve Example 2, with each side of each cell divided into `refine` parts.

    `lowered` is the depth of the disk in the first guess, over what is about right.
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
        iterations=trace.n_iterations if trace.converged else -1,
        by_energy=steps_until_energy(trace.energies[np.isfinite(trace.energies)]),
        x=x,
        pressure=pressure[order],
        half_width=_half_width(x, gap),
    )


def steps_until_energy(energies: FloatArray) -> int:
    """Return the number of linear systems solved until a step's energy is `ENERGY` of the first; all if none is."""
    below = np.flatnonzero(energies <= ENERGY * energies[0])
    return int(below[0]) + 1 if len(below) else len(energies)


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
