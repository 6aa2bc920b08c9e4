"""Example 2 over meshes, sizes and slopes: what the pressure under the disk is, and why it is not that of Hertz.

Three things lie between a solution and Hertz' p0, and each is computed on its own. The penalty is a Winkler layer:
`hertz.solve_winkler_contact`. The mesh: `over_meshes`. And a formulation that measures areas in the current
configuration gives a pressure per current length, on a surface that the contact itself compresses by p/E: `over_slopes`
shows that this part falls like a/R, and that hardly any is left where areas are measured in the reference one.
The sizes of the bodies do not matter: `over_sizes`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.subject import Subject
from contactverif.mechanics import newton
from contactverif.mechanics.scene import Scene
from contactverif.run.registry import load_formulation
from contactverif.scenes.disk import DiskProblem, disk_on_foundation

PAPER = DiskProblem()


@dataclass(frozen=True, slots=True, eq=False)
class Pressed:
    """One solution.

    Attributes
    ----------
    formulation : str
        As typed on the command line.
    problem : DiskProblem
        Of what.
    converged : bool
        Whether it is a solution.
    iterations : int
        Linear systems solved, from the disk lowered to roundoff.
    x, pressure : FloatArray, shape (n_points,)
        Of the contact points from left to right; a length, and force per length.
    half_width : float
        Of the contact, where the gap changes its sign, a length; NaN where it does not.
    """

    formulation: str
    problem: DiskProblem
    converged: bool
    iterations: int
    x: FloatArray
    pressure: FloatArray
    half_width: float

    @property
    def peak(self) -> float:
        """The largest pressure."""
        return float(self.pressure.max())

    @property
    def over_layer(self) -> float:
        """The largest pressure over that of Hertz on a Winkler layer, less 1."""
        return self.peak / self.problem.winkler_contact().peak - 1


def pressed(formulation: str, problem: DiskProblem = PAPER, refine: int = 1, lowered: float = 1.0) -> Pressed:
    """Solves Example 2.

    Parameters
    ----------
    refine : int
        How many times finer than the base meshes.
    lowered : float
        How deep the disk is pushed in the first guess, over what is about right.

    Raises
    ------
    MisuseError
        If the formulation cannot be loaded, or as `disk_on_foundation` does.
    """
    subject = load_formulation(formulation)
    if not isinstance(subject, Subject):
        raise MisuseError("formulation", f"{formulation}, not loaded: {subject.reason}", "one that loads")
    scene = _scene(problem, refine)
    asked = subject.for_case(scene.case())
    trace = newton.solve(scene, asked, start=lowered * scene.start)
    points = asked.contact_points(scene.interface, asked.pair(scene.interface, trace.z), trace.z)
    pressure = np.where(points.active, points.pressure, 0.0)
    order = np.argsort(points.position[:, 0], kind="stable")
    x, gap = points.position[order, 0], points.gap[order]
    return Pressed(
        formulation=formulation,
        problem=problem,
        converged=trace.converged,
        iterations=trace.n_iterations,
        x=x,
        pressure=pressure[order],
        half_width=_half_width(x, gap),
    )


def over_meshes(formulations: Sequence[str], refined: Sequence[int]) -> list[Pressed]:
    """Every formulation on every mesh."""
    return [pressed(name, refine=refine) for refine in refined for name in formulations]


def over_sizes(formulation: str, sizes: Sequence[float], refine: int = 1) -> list[Pressed]:
    """A foundation that is smaller or larger, by `sizes` over the one that was chosen."""
    return [
        pressed(formulation, replace(PAPER, width=PAPER.width * size, depth=PAPER.depth * size), refine)
        for size in sizes
    ]


def over_slopes(formulations: Sequence[str], slopes: Sequence[float], refine: int = 1) -> list[Pressed]:
    """Flatter contacts of the same width and the same E*/(ε̂ a): R larger and F smaller, so that strains are smaller.

    Parameters
    ----------
    slopes : Sequence[float]
        a/R, over that of the paper.
    """
    return [
        pressed(name, DiskProblem(radius=PAPER.radius / slope, force=PAPER.force * slope), refine)
        for slope in slopes
        for name in formulations
    ]


def difference(one: Pressed, other: Pressed) -> tuple[FloatArray, FloatArray]:
    """x of the contact points in contact in both, and the difference of their pressures; Fig. 39.

    Raises
    ------
    MisuseError
        If the two have not the same points.
    """
    if one.x.shape != other.x.shape:
        found = f"{len(one.x)} points of {one.formulation} and {len(other.x)} of {other.formulation}"
        raise MisuseError("difference", found, "formulations with the same contact points")
    both = (one.pressure > 0) & (other.pressure > 0)
    return other.x[both], (one.pressure - other.pressure)[both]


@lru_cache(maxsize=2)
def _scene(problem: DiskProblem, refine: int) -> Scene:
    """Condensing it takes longer than solving it."""
    return disk_on_foundation(problem, refine=refine)


def _half_width(x: FloatArray, gap: FloatArray) -> float:
    """Half of what lies between the first and the last change of sign of the gap, each interpolated between points."""
    edges = np.flatnonzero((gap[:-1] <= 0) != (gap[1:] <= 0))
    if len(edges) < 2:
        return np.nan
    places = x[edges] - gap[edges] * (x[edges + 1] - x[edges]) / (gap[edges + 1] - gap[edges])
    return float(places[-1] - places[0]) / 2
