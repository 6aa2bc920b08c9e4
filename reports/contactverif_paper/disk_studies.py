"""Example 2 over meshes, slopes and sizes: Fig. 39, and why the largest pressure is not that of Hertz.

Fig. 39 shows a discretization error: it is smaller on finer meshes, and which axis it fits depends on the mesh.

Three things lie between a solution and Hertz' p0, and each is computed on its own. The penalty is a Winkler layer
(`hertz.solve_winkler_contact`). The mesh is refined. And a formulation that measures areas in the current configuration
gives a pressure per current length, on a surface that the contact itself compresses by p/E: this part falls like a/R,
and hardly any is left where areas are measured in the reference configuration. The sizes of the bodies do not matter.

Source: Zavarise & De Lorenzis (2009), Section 7.2, Fig. 39.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from matplotlib.figure import Figure

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.schema import Group
from contactverif_paper.disk_solutions import PAPER, DiskSolution, difference, disk_scene, flatter, solve_disk
from contactverif_paper.figure_style import REFERENCE_LINE, add_legend, line_style, new_panels, use_round_ticks
from contactverif_paper.paper_columns import Column, Formulations, to_group, variables_of
from contactverif_paper.paper_formulations import REFERENCE_AREAS, VTS_ME, VTS_PPT
from contactverif_paper.paper_item import Agreement, Item, PaperFigure, Progress, Statement
from contactverif_reports.html.pages import number

_REFINED = (1, 2)
MESHES = ("our base meshes", "meshes twice as fine")
X_AXIS, AXIS = (0.0, 0.4), (-1.0e3, 1.5e3)  # Ends of the printed axes.


@dataclass(frozen=True, slots=True, eq=False)
class _Difference:
    """The difference of the pressures on one mesh."""

    x: Annotated[FloatArray, Column("place", schema.LENGTH, "x along the interface", name="difference_x")]
    values: Annotated[
        FloatArray, Column("place", schema.STRESS, "VTS-PPT minus VTS-ME in contact pressure", name="difference")
    ]

    @property
    def inside(self) -> bool:
        return AXIS[0] <= float(self.values.min()) and float(self.values.max()) <= AXIS[1]

    @property
    def words(self) -> str:
        return f"{number(float(self.values.min()), 2)} to {number(float(self.values.max()), 2)}"


def _compute_differences(report_progress: Progress) -> tuple[_Difference, ...]:
    differences = []
    for refine, mesh in zip(_REFINED, MESHES, strict=True):
        report_progress(f"Fig. 39, {mesh}")
        pair = (solve_disk(row, refine=refine) for row in (VTS_PPT, VTS_ME))
        differences.append(_Difference(*difference(*pair)))
    return tuple(differences)


def _difference_statements(differences: tuple[_Difference, ...]) -> Iterator[Statement]:
    inside = [row.inside for row in differences]
    fitting = " or ".join(mesh for mesh, fits in zip(MESHES, inside, strict=True) if fits)
    yield Statement(
        "Fig. 39",
        "Example 2: VTS-PPT and VTS-ME differ by little: the axis runs from −1e3 to 1.5e3; the mesh is not printed",
        "; ".join(f"{row.words} on {mesh}" for row, mesh in zip(differences, MESHES, strict=True)),
        Agreement.decide(any(inside), always=all(inside)),
        "fig39",
        f"on {fitting} only",
    )


@PaperFigure.define(
    "fig39",
    "Example 2: the pressure of VTS-PPT minus that of VTS-ME, (a) on meshes twice as fine as our base meshes, on the "
    "paper’s axes; (b) on our base meshes, which leave these axes at the dotted lines.",
)
def _plot_differences(differences: tuple[_Difference, ...]) -> Figure:
    figure, panels = new_panels(3.3, 2)
    for axes, row, mesh in zip(panels, reversed(differences), reversed(MESHES), strict=True):
        axes.axhline(0.0, **REFERENCE_LINE)
        right = (row.x >= 0) & (row.x <= X_AXIS[1])
        axes.plot(row.x[right], row.values[right], linewidth=1.0, zorder=3, color="black")
        axes.set(xlabel="x along the interface (length)", title=mesh)
        use_round_ticks(axes)
        axes.set_xlim(*X_AXIS)
    printed, whole = panels
    printed.set_ylim(*AXIS)
    for end in AXIS:
        whole.axhline(end, color="0.35", linewidth=0.8, linestyle=":", zorder=1)
        words_ = "printed\naxis ends" if end > 0 else "printed axis ends"
        whole.text(X_AXIS[1], 1.05 * end, words_, ha="right", va="bottom" if end > 0 else "top", color="0.35")
    printed.set_ylabel("VTS-PPT − VTS-ME\n(force / length)")
    return figure


def _difference_datasets(differences: tuple[_Difference, ...]) -> dict[str, Group]:
    groups = zip(("base", "fine"), MESHES, differences, strict=True)
    return {group: to_group(row, figure="Fig. 39", comment=mesh) for group, mesh, row in groups}


FIG_39 = Item(
    name="fig39_difference",
    title="Fig. 39: VTS-PPT beside VTS-ME on the disk",
    compute=_compute_differences,
    statements=_difference_statements,
    datasets=_difference_datasets,
    figures=(_plot_differences,),
    n_steps=len(_REFINED),
    slow=True,
)


FORMULATIONS = (VTS_ME, VTS_PPT, REFERENCE_AREAS)
EXPLAINED = (VTS_ME, REFERENCE_AREAS)
_REFINEMENTS = (1, 2, 3)
SLOPES, SIZES = (1.0, 0.5, 0.25), (0.5, 1.0, 2.0)
_MEGA = 1e6
EXCESS = "largest pressure over that of Hertz on springs, less 1"


@dataclass(frozen=True, slots=True, eq=False)
class _PeakStudy:
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
        return np.array([[solution.peak for solution in row] for row in self.solutions])

    @property
    def iterations(self) -> Annotated[IntArray, Column("formulation mesh", "1", "linear systems solved")]:
        return np.array([[solution.iterations for solution in row] for row in self.solutions])


def _compute_peaks(report_progress: Progress) -> _PeakStudy:
    by_mesh = []
    for refine in _REFINEMENTS:
        report_progress(f"Example 2, cells divided by {refine}")
        by_mesh.append([solve_disk(formulation, refine=refine) for formulation in FORMULATIONS])
    report_progress("Example 2, flatter contacts")
    slopes = np.full((len(FORMULATIONS), len(SLOPES)), np.nan)
    for column, slope in enumerate(SLOPES):
        for row in EXPLAINED:
            slopes[FORMULATIONS.index(row), column] = solve_disk(row, flatter(slope)).excess
    report_progress("Example 2, other sizes")
    resized = [replace(PAPER, width=PAPER.width * factor, depth=PAPER.depth * factor) for factor in SIZES]
    interfaces = [disk_scene(refine=refine).interface for refine in _REFINEMENTS]
    return _PeakStudy(
        solutions=tuple(zip(*by_mesh, strict=True)),
        size=np.array([each.slave.lengths(each.nodes).min() for each in interfaces]),
        slope=SLOPES,
        excess_over_slopes=slopes,
        foundation=SIZES,
        excess_over_sizes=np.array([solve_disk(VTS_ME, problem).excess for problem in resized]),
        winkler=PAPER.winkler_contact().peak,
    )


def _peak_statements(study: _PeakStudy) -> Iterator[Statement]:
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
def _plot_peaks(study: _PeakStudy) -> Figure:
    figure, (meshes, slopes) = new_panels(3.6, 2)
    meshes.axhline(study.winkler / _MEGA, **REFERENCE_LINE)
    for formulation, peaks in zip(FORMULATIONS, study.peaks / _MEGA, strict=True):
        meshes.plot(study.size, peaks, **line_style(formulation, 1))
    meshes.set(xlabel="element size in the middle (length)", ylabel="largest pressure\n(10⁶ force / length)")
    slopes.axhline(0.0, **REFERENCE_LINE)
    for formulation in EXPLAINED:
        excess = study.excess_over_slopes[FORMULATIONS.index(formulation)]
        slopes.plot(SLOPES, excess, **line_style(formulation, 1))
    slopes.set(xlabel="a/R over that of the paper (–)", ylabel="excess over Hertz\non springs (–)")
    for axes in (meshes, slopes):
        use_round_ticks(axes)
        axes.set_xlim(0, None)
    add_legend(figure, FORMULATIONS, reference="Hertz on springs ε̂", columns=2)
    return figure


def _peak_datasets(study: _PeakStudy) -> dict[str, Group]:
    solutions = variables_of(study.solutions, "formulation mesh")
    columns = {name: solutions[name] for name in ("largest", "half_width")}
    return {"": Group(variables_of(study) | columns)}


PEAK = Item(
    name="example_2_peak",
    title="Example 2: the largest pressure and Hertz",
    compute=_compute_peaks,
    statements=_peak_statements,
    datasets=_peak_datasets,
    figures=(_plot_peaks,),
    n_steps=len(_REFINEMENTS) + 2,
    slow=True,
)
