"""Example 2: what the largest pressure under the disk is, and why it is not that of Hertz.

Three things lie between a solution and Hertz' p0, and each is computed on its own. The penalty is a Winkler layer
(`hertz.solve_winkler_contact`). The mesh is refined. And a formulation that measures areas in the current configuration
gives a pressure per current length, on a surface that the contact itself compresses by p/E: this part falls like a/R,
and hardly any is left where areas are measured in the reference configuration. The sizes of the bodies do not matter.

Source: Zavarise & De Lorenzis (2009), Section 7.2.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.columns import Group
from contactverif_paper.disk_solutions import PAPER, DiskSolution, disk_scene, flatter, solve_disk
from contactverif_paper.figure_style import REFERENCE_LINE, Series, add_legend, new_panels, plot_series, use_round_ticks
from contactverif_paper.paper_columns import Column, Formulations, variables_of
from contactverif_paper.paper_formulations import REFERENCE_AREAS, VTS_ME, VTS_PPT
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement

FORMULATIONS = (VTS_ME, VTS_PPT, REFERENCE_AREAS)
EXPLAINED = (VTS_ME, REFERENCE_AREAS)
REFINE = (1, 2, 3)
SLOPES, SIZES = (1.0, 0.5, 0.25), (0.5, 1.0, 2.0)
_MEGA = 1e6
EXCESS = "largest pressure over that of Hertz on springs, less 1"


@dataclass(frozen=True, slots=True, eq=False)
class PeakStudy:
    """The steps between the largest pressure and that of Hertz on a layer of springs."""

    solutions: tuple[tuple[DiskSolution, ...], ...]  # For each of `FORMULATIONS`, on each mesh.
    # The shortest segment of the slave, which is in the middle.
    size: Annotated[FloatArray, Column("mesh", schema.LENGTH, "size of an element in the middle")]
    slope: Annotated[tuple[float, ...], Column("slope", "1", "a/R over that of the paper")]
    excess_over_slopes: Annotated[FloatArray, Column("formulation slope", "1", EXCESS, "NaN: not computed", np.nan)]
    foundation: Annotated[tuple[float, ...], Column("foundation", "1", "size of the foundation over the chosen one")]
    excess_over_sizes: Annotated[FloatArray, Column("foundation", "1", f"{EXCESS}; VTS-ME")]
    winkler: float  # The largest pressure of Hertz on springs.
    formulations: Formulations = FORMULATIONS

    @property
    def peaks(self) -> FloatArray:
        """The largest pressures (n_formulations, n_meshes)."""
        return np.array([[solution.peak for solution in row] for row in self.solutions])

    @property
    def iterations(self) -> Annotated[IntArray, Column("formulation mesh", "1", "linear systems solved")]:
        """The numbers of linear systems solved."""
        return np.array([[solution.iterations for solution in row] for row in self.solutions])


def compute(report_progress: Progress) -> PeakStudy:
    """Solve Example 2 over meshes, slopes and sizes."""
    by_mesh = []
    for refine in REFINE:
        report_progress(f"Example 2, cells divided by {refine}")
        by_mesh.append([solve_disk(formulation, refine=refine) for formulation in FORMULATIONS])
    report_progress("Example 2, flatter contacts")
    slopes = np.full((len(FORMULATIONS), len(SLOPES)), np.nan)
    for column, slope in enumerate(SLOPES):
        for row in EXPLAINED:
            slopes[FORMULATIONS.index(row), column] = solve_disk(row, flatter(slope)).excess
    report_progress("Example 2, other sizes")
    return PeakStudy(
        solutions=tuple(zip(*by_mesh, strict=True)),
        size=np.array([_element_size(refine) for refine in REFINE]),
        slope=SLOPES,
        excess_over_slopes=slopes,
        foundation=SIZES,
        excess_over_sizes=np.array([_solve_size(factor).excess for factor in SIZES]),
        winkler=PAPER.winkler_contact().peak,
    )


def statements(study: PeakStudy) -> Iterator[Statement]:
    """Say what the rest of the difference to Hertz is made of."""
    current, reference = (study.excess_over_slopes[FORMULATIONS.index(row)] for row in EXPLAINED)
    change = float(np.ptp(study.peaks, axis=1).max()) / study.winkler
    yield Statement(
        "Section 7.2",
        "Example 2: the pressure is not compared with an exact one",
        f"Hertz on springs ε̂ is exceeded by {current[0]:.2%}. That is a pressure per current length on a surface "
        f"that contact compresses: it falls with a/R, to {current[-1]:.2%} at {SLOPES[-1]:g} of it, and with "
        f"reference areas {reference[0]:.2%} are left, of which the mesh is the cause. Finer meshes change "
        f"{change:.2%}, a foundation of half or twice the size {float(np.ptp(study.excess_over_sizes)):.2%}",
        Agreement.SILENT,
        "example-2-peak",
    )


@PaperFigure.define(
    "example-2-peak",
    "Example 2: the largest pressure (a) over the size of an element and (b) over the slope of the contact.",
)
def plot(study: PeakStudy) -> Figure:
    """Draw the largest pressure over the mesh and over the slope."""
    figure, (meshes, slopes) = new_panels(3.6, 2)
    meshes.axhline(study.winkler / _MEGA, **REFERENCE_LINE)
    plot_series(meshes, Series(FORMULATIONS, study.size, study.peaks / _MEGA))
    meshes.set(xlabel="element size in the middle (length)", ylabel="largest pressure\n(10⁶ force / length)")
    slopes.axhline(0.0, **REFERENCE_LINE)
    numbers = [FORMULATIONS.index(row) for row in EXPLAINED]
    plot_series(slopes, Series(EXPLAINED, np.array(SLOPES), study.excess_over_slopes[numbers]))
    slopes.set(xlabel="a/R over that of the paper (–)", ylabel="excess over Hertz\non springs (–)")
    for axes in (meshes, slopes):
        use_round_ticks(axes)
        axes.set_xlim(0, None)
    add_legend(figure, FORMULATIONS, reference="Hertz on springs ε̂", columns=2)
    return figure


def datasets(study: PeakStudy) -> dict[str, Group]:
    """Return the study."""
    solutions = variables_of(study.solutions, "formulation mesh")
    columns = {name: solutions[name] for name in ("largest", "half_width")}
    return {"": Group(variables_of(study) | columns)}


def _solve_size(factor: float) -> DiskSolution:
    """Solve with a smaller or larger foundation."""
    return solve_disk(VTS_ME, replace(PAPER, width=PAPER.width * factor, depth=PAPER.depth * factor))


def _element_size(refine: int) -> float:
    """Return the length of the shortest segment of the slave."""
    interface = disk_scene(refine=refine).interface
    return float(interface.slave.lengths(interface.nodes).min())


ITEM = Item(
    name="example_2_peak",
    title="Example 2: the largest pressure and Hertz",
    compute=compute,
    statements=statements,
    datasets=datasets,
    figures=(plot,),
    n_steps=len(REFINE) + 2,
    slow=True,
)
