"""Example 2: what the largest pressure under the disk is, and why it is not that of Hertz.

Three things lie between a solution and Hertz' p0, and each is computed on its own. The penalty is a Winkler layer
(`hertz.solve_winkler_contact`). The mesh is refined. And a formulation that measures areas in the current configuration
gives a pressure per current length, on a surface that the contact itself compresses by p/E: this part falls like a/R,
and hardly any is left where areas are measured in the reference configuration. The sizes of the bodies do not matter.

Source: Zavarise & De Lorenzis (2009), Section 7.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif_paper import paper_formulations as formulations
from contactverif_paper.disk_solutions import PAPER, DiskSolution, disk_scene, flatter, solve_disk
from contactverif_paper.figure_style import (
    REFERENCE_LINE,
    TWO_COLUMNS,
    Series,
    add_legend,
    new_figure,
    new_panels,
    plot_series,
    use_round_ticks,
)
from contactverif_paper.paper_formulations import name_variables
from contactverif_paper.paper_item import OURS, Agreement, Item, PaperFigure, Progress, Statement
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.variables import numbers

FORMULATIONS = (formulations.VTS_ME, formulations.VTS_PPT, formulations.REFERENCE_AREAS)
EXPLAINED = (formulations.VTS_ME, formulations.REFERENCE_AREAS)
REFINE = (1, 2, 3)
SLOPES, SIZES = (1.0, 0.5, 0.25), (0.5, 1.0, 2.0)
_MEGA = 1e6


@dataclass(frozen=True, slots=True, eq=False)
class PeakStudy:
    """The steps between the largest pressure and that of Hertz on a layer of springs."""

    size: FloatArray  # (n_meshes,) The size of an element in the middle, a length.
    peaks: FloatArray  # (n_formulations, n_meshes) Largest pressure and half-width of the contact.
    half_width: FloatArray
    iterations: IntArray  # (n_formulations, n_meshes) Linear systems solved.
    slopes: Series  # Over a/R, over that of the paper: largest pressure over that of Hertz on springs, less 1.
    sizes: Series  # Over the size of the foundation, over the one chosen: the same.
    winkler: float  # The largest pressure of Hertz on springs.


def compute(report_progress: Progress) -> PeakStudy:
    """Solve Example 2 over meshes, slopes and sizes."""
    size, solutions = [], []
    for refine in REFINE:
        report_progress(f"Example 2, cells divided by {refine}")
        solutions.append([solve_disk(formulation, refine=refine) for formulation in FORMULATIONS])
        size.append(_element_size(refine))
    report_progress("Example 2, flatter contacts")
    slopes = [[solve_disk(row, flatter(slope)).excess for row in EXPLAINED] for slope in SLOPES]
    report_progress("Example 2, other sizes")
    sizes = [_solve_size(factor).excess for factor in SIZES]
    return PeakStudy(
        size=np.array(size),
        peaks=_table(solutions, "peak"),
        half_width=_table(solutions, "half_width"),
        iterations=_table(solutions, "iterations").astype(np.int64),
        slopes=Series(EXPLAINED, np.array(SLOPES), np.array(slopes).T),
        sizes=Series((formulations.VTS_ME,), np.array(SIZES), np.array([sizes])),
        winkler=PAPER.winkler_contact().peak,
    )


def _table(solutions: Sequence[Sequence[DiskSolution]], name: str) -> FloatArray:
    """Return an attribute of all solutions (n_formulations, n_meshes)."""
    return np.array([[getattr(solution, name) for solution in row] for row in solutions], dtype=np.float64).T


def statements(study: PeakStudy) -> tuple[Statement, ...]:
    """Say what the rest of the difference to Hertz is made of."""
    current, reference = study.slopes.values
    change = float(np.ptp(study.peaks, axis=1).max()) / study.winkler
    return (
        Statement(
            "Section 7.2",
            "Example 2: the pressure is not compared with an exact one",
            f"Hertz on springs ε̂ is exceeded by {current[0]:.2%}. That is a pressure per current length on a surface "
            f"that contact compresses: it falls with a/R, to {current[-1]:.2%} at {SLOPES[-1]:g} of it, and with "
            f"reference areas {reference[0]:.2%} are left, of which the mesh is the cause. Finer meshes change "
            f"{change:.2%}, a foundation of half or twice the size {float(np.ptp(study.sizes.values)):.2%}",
            Agreement.SILENT,
            "example-2-peak",
        ),
    )


def plot(study: PeakStudy) -> Figure:
    """Draw the largest pressure over the mesh and over the slope."""
    figure = new_figure(TWO_COLUMNS, 3.6)
    meshes, slopes = new_panels(figure, 2)
    meshes.axhline(study.winkler / _MEGA, **REFERENCE_LINE)
    plot_series(meshes, Series(FORMULATIONS, study.size, study.peaks / _MEGA))
    meshes.set_xlabel("element size in the middle (length)")
    meshes.set_ylabel("largest pressure\n(10⁶ force / length)")
    slopes.axhline(0.0, **REFERENCE_LINE)
    plot_series(slopes, study.slopes)
    slopes.set_xlabel("a/R over that of the paper (–)")
    slopes.set_ylabel("excess over Hertz\non springs (–)")
    for axes in (meshes, slopes):
        use_round_ticks(axes)
        axes.set_xlim(0, None)
    add_legend(figure, FORMULATIONS, reference="Hertz on springs ε̂", columns=2)
    return figure


def datasets(study: PeakStudy) -> dict[str, xr.Dataset]:
    """Return the study; NaN where a slope was not computed."""
    dims = ["formulation", "mesh"]
    meaning = "largest pressure over that of Hertz on springs, less 1"
    slopes = np.full((len(FORMULATIONS), len(SLOPES)), np.nan)
    for formulation in EXPLAINED:
        slopes[FORMULATIONS.index(formulation)] = study.slopes.row(formulation)
    over_slopes = numbers(["formulation", "slope"], slopes, meaning, "1", "NaN: not computed", fill=np.nan)
    table = name_variables(FORMULATIONS) | {
        "size": numbers(["mesh"], study.size, "size of an element in the middle", schema.LENGTH),
        "largest": numbers(dims, study.peaks, "largest contact pressure", schema.STRESS),
        "half_width": numbers(dims, study.half_width, "half-width of the contact", schema.LENGTH),
        "iterations": numbers(dims, study.iterations.astype(np.int32), "linear systems solved", "1"),
        "slope": numbers(["slope"], study.slopes.at, "a/R over that of the paper", "1"),
        "excess_over_slopes": over_slopes,
        "foundation": numbers(["foundation"], study.sizes.at, "size of the foundation over the chosen one", "1"),
        "excess_over_sizes": numbers(["foundation"], study.sizes.values[0], f"{meaning}; VTS-ME", "1"),
    }
    return {"": xr.Dataset(table)}


def _solve_size(factor: float) -> DiskSolution:
    """Solve with a smaller or larger foundation."""
    return solve_disk(formulations.VTS_ME, replace(PAPER, width=PAPER.width * factor, depth=PAPER.depth * factor))


def _element_size(refine: int) -> float:
    """Return the shortest segment of the slave, which is in the middle, a length."""
    interface = disk_scene(refine=refine).interface
    return float(interface.slave.lengths(interface.nodes).min())


ITEM = Item(
    name="example_2_peak",
    title="Example 2: the largest pressure and Hertz",
    compute=compute,
    statements=statements,
    datasets=datasets,
    figures=(
        PaperFigure(
            "example-2-peak",
            OURS,
            "Example 2: the largest pressure (a) over the size of an element and (b) over the slope of the contact.",
            plot,
        ),
    ),
    n_steps=len(REFINE) + 2,
    slow=True,
)
