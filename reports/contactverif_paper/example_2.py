"""Example 2: an elastic disk on an elastic foundation: its meshes, its pressures beside Hertz, and the iterations.

Source: Zavarise & De Lorenzis (2009), Section 7.2, Figs. 37 and 38. What is given and what is chosen is said in
`contactverif.problems.disk`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path

from contactverif.contract.arrays import FloatArray
from contactverif.contract.body import Body
from contactverif.problems import hertz
from contactverif_paper import paper_formulations as formulations
from contactverif_paper.disk_solutions import PAPER, DiskSolution, disk_scene, solve_disk
from contactverif_paper.figure_style import (
    REFERENCE_LINE,
    TWO_COLUMNS,
    add_legend,
    line_style,
    new_figure,
    new_panels,
    use_round_ticks,
)
from contactverif_paper.mesh_lines import mesh_lines
from contactverif_paper.paper_formulations import name_variables
from contactverif_paper.paper_item import Agreement, Cell, Item, PageTable, PaperFigure, Progress, Statement
from contactverif_paper.paper_tree import pad_rows
from contactverif_reports.html.pages import number
from contactverif_reports.netcdf import schema
from contactverif_reports.netcdf.variables import numbers

FORMULATIONS = (formulations.NTS_AR, formulations.VTS_G, formulations.VTS_ME, formulations.VTS_PPT)
PRINTED_PEAK, PRINTED_ITERATIONS = 1.61e6, 4
PEAK_TOLERANCE = 0.03
TOUCHING = 1e-2  # The depth of the disk in the other first guess, over what is about right.
WHOLE = (0.0, 0.5), (-2.0, 0.0)  # Ends of the printed axes: x, and the pressure in 1e6.
MIDDLE = (0.0, 0.1), (-1.61, -1.54)
_PLACES = 401  # The number of places where the exact pressure is stored.
_MEGA = 1e6
_CLOSE_UP = np.array([[-0.8, -0.5], [0.8, 0.7]])  # Lower left and upper right corner of Fig. 37(b).


@dataclass(frozen=True, slots=True, eq=False)
class Example2:
    """Solutions on the base meshes, and the exact answers for half-planes."""

    # From a disk that is lowered about as far as it ends; a solution for each of `FORMULATIONS`.
    solutions: tuple[DiskSolution, ...]
    touching: tuple[DiskSolution, ...]  # The same from a disk that just touches.
    hertz: tuple[float, float]  # Largest pressure and half-width after Hertz, and after Hertz on a layer of springs ε̂.
    winkler: tuple[float, float]
    winkler_x: FloatArray  # (n_places,) The pressure after Hertz on springs.
    winkler_pressure: FloatArray
    bodies: tuple[Body, ...]  # The disk and the foundation, undeformed.


def compute(report_progress: Progress) -> Example2:
    """Solve the base meshes with every formulation, from two first guesses."""
    solutions, touching = [], []
    for formulation in FORMULATIONS:
        report_progress(f"Example 2, {formulation.name}")
        solutions.append(solve_disk(formulation))
        touching.append(solve_disk(formulation, lowered=TOUCHING))
    layer = PAPER.winkler_contact()
    places = np.linspace(0.0, layer.half_width, _PLACES)
    return Example2(
        tuple(solutions),
        tuple(touching),
        (hertz.peak(PAPER.force, PAPER.radius, PAPER.stiffness), PAPER.half_width),
        (layer.peak, layer.half_width),
        places,
        layer.pressure(places),
        tuple(disk_scene().bodies),
    )


def iterations(solution: DiskSolution) -> int:
    """Return the number of linear systems solved; −1 without a solution."""
    return solution.iterations if solution.converged else -1


def statements(example: Example2) -> tuple[Statement, ...]:
    """Compare pressures and numbers of iterations."""
    return _peak_statement(example), _iteration_statement(example)


def _peak_statement(example: Example2) -> Statement:
    peaks, widths = ([getattr(solution, name) for solution in example.solutions] for name in ("peak", "half_width"))
    return Statement(
        "Fig. 38",
        "Example 2: the axis of the close-up ends at 1.61e6, and curves are nearly the same for all",
        f"{number(min(peaks), 4)} to {number(max(peaks), 4)}; half-width {min(widths):.3f} to {max(widths):.3f}. "
        f"Hertz: {number(example.hertz[0], 4)} and {example.hertz[1]:.3f}; Hertz on a layer of springs ε̂: "
        f"{number(example.winkler[0], 4)} and {example.winkler[1]:.3f}",
        Agreement.decide(all(abs(peak / PRINTED_PEAK - 1) <= PEAK_TOLERANCE for peak in peaks)),
        "fig38",
    )


def _iteration_statement(example: Example2) -> Statement:
    near, far = (sorted({iterations(solution) for solution in row}) for row in (example.solutions, example.touching))
    near_words, far_words = (", ".join(map(str, counts)) for counts in (near, far))
    holds, always = near == [PRINTED_ITERATIONS], far == [PRINTED_ITERATIONS]
    agreement = Agreement.CONDITIONAL if holds and not always else Agreement.decide(holds)
    return Statement(
        "Section 7.2",
        "Example 2: every algorithm needs the same number of iterations, 4; the first guess is not said",
        f"to the residual’s own roundoff {near_words} from a disk lowered about as far as it ends; {far_words} from "
        "one that just touches",
        agreement,
        "",
        "the first guess lowers the disk about as far as it ends" if agreement is Agreement.CONDITIONAL else "",
    )


def tables(example: Example2) -> tuple[PageTable, ...]:
    """Return the table of the page."""
    rows = [
        (
            solution.formulation.legend,
            number(solution.peak, 5),
            number(solution.half_width, 4),
            str(iterations(solution)),
        )
        for solution in example.solutions
    ]
    rows.append(("Hertz", number(example.hertz[0], 5), number(example.hertz[1], 4), "–"))
    rows.append(("Hertz on springs ε̂", number(example.winkler[0], 5), number(example.winkler[1], 4), "–"))
    return (
        PageTable(
            "Largest pressure, half-width of the contact, linear systems solved",
            ("Formulation", "Largest pressure", "Half-width", "Iterations"),
            tuple((Cell((head,)), *(Cell((value,), tone="n") for value in values)) for head, *values in rows),
        ),
    )


def plot_meshes(example: Example2) -> Figure:
    """Draw all of the meshes, and the contact zone from near."""
    figure = new_figure(TWO_COLUMNS, 5.0)
    whole, near = new_panels(figure, 2)
    nodes = np.vstack([body.nodes for body in example.bodies])
    _draw_meshes(whole, example.bodies, np.array([nodes.min(axis=0), nodes.max(axis=0)]), 0.15)
    _draw_meshes(near, example.bodies, _CLOSE_UP, 0.4)
    corner, size = _CLOSE_UP[0], _CLOSE_UP[1] - _CLOSE_UP[0]
    whole.add_patch(Rectangle((corner[0], corner[1]), size[0], size[1], fill=False, linewidth=1.4, zorder=3))
    return figure


def plot_pressures(example: Example2) -> Figure:
    """Draw the pressures on the paper's axes, where they are negative."""
    figure = new_figure(TWO_COLUMNS, 3.9)
    panels = new_panels(figure, 2)
    for axes, (x_axis, axis) in zip(panels, (WHOLE, MIDDLE), strict=True):
        axes.plot(example.winkler_x, -example.winkler_pressure / _MEGA, **REFERENCE_LINE)
        for solution in example.solutions:
            shown = (solution.x >= 0) & (solution.x <= x_axis[1])
            style = line_style(solution.formulation, int(shown.sum()))
            axes.plot(solution.x[shown], -solution.pressure[shown] / _MEGA, **style)
        axes.set_xlabel("x along the interface (length)")
        use_round_ticks(axes)
        axes.set_xlim(*x_axis)
        axes.set_ylim(*axis)
    panels[0].set_ylabel("contact pressure, negative\n(10⁶ force / length)")
    add_legend(figure, FORMULATIONS, reference="Hertz on springs ε̂", columns=3)
    return figure


def _draw_meshes(axes: Axes, bodies: tuple[Body, ...], box: FloatArray, width: float) -> None:
    size = float(np.ptp(box, axis=0).max())
    for body, color in zip(bodies, ("black", "#0072b2"), strict=True):
        lines = [Path(line) for line in mesh_lines(body, box, 5e-4 * size)]
        axes.add_patch(PathPatch(Path.make_compound_path(*lines), fill=False, edgecolor=color, linewidth=width))
    axes.set_aspect("equal")
    axes.set(xlim=box[:, 0], ylim=box[:, 1])
    axes.set_axis_off()


def datasets(example: Example2) -> dict[str, xr.Dataset]:
    """Return pressures, half-widths and iterations."""
    solutions = example.solutions
    each, at = ["formulation"], ["formulation", "point"]
    touching = [iterations(solution) for solution in example.touching]
    table = name_variables(FORMULATIONS) | {
        "x": numbers(
            at, pad_rows([solution.x for solution in solutions]), "x along the interface", schema.LENGTH, fill=np.nan
        ),
        "pressure": numbers(
            at, pad_rows([solution.pressure for solution in solutions]), "contact pressure", schema.STRESS, fill=np.nan
        ),
        "largest": numbers(each, [solution.peak for solution in solutions], "largest contact pressure", schema.STRESS),
        "half_width": numbers(
            each, [solution.half_width for solution in solutions], "half-width of the contact", schema.LENGTH
        ),
        "iterations": numbers(
            each, np.array([iterations(solution) for solution in solutions], np.int32), "linear systems", "1"
        ),
        "from_touching": numbers(
            each, np.array(touching, np.int32), "linear systems solved from a disk that just touches", "1"
        ),
        "winkler_x": numbers(["exact_place"], example.winkler_x, "x along the interface", schema.LENGTH),
        "winkler_pressure": numbers(
            ["exact_place"], example.winkler_pressure, "Hertz on a layer of springs: pressure", schema.STRESS
        ),
    }
    attributes = {
        "figure": "Figs. 37, 38",
        "scene": "example-2",
        "hertz": np.array(example.hertz),
        "winkler": np.array(example.winkler),
        "comment": f"hertz, winkler: largest pressure ({schema.STRESS}) and half-width ({schema.LENGTH})",
    }
    return {"": xr.Dataset(table, attrs=attributes)}


ITEM = Item(
    name="example_2",
    title="Example 2: a disk on a foundation",
    compute=compute,
    statements=statements,
    datasets=datasets,
    figures=(
        PaperFigure(
            "fig37",
            "Fig. 37",
            "Example 2: (a) the meshes of the disk (black) and of the foundation (blue, 160 × 30 elements); (b) "
            "close-up of the contact zone. The paper draws them and prints no coordinates: the grading is ours.",
            plot_meshes,
        ),
        PaperFigure(
            "fig38",
            "Fig. 38",
            "Example 2: (a) contact pressure; (b) close-up of its middle. Pressures are negative, as in the paper.",
            plot_pressures,
        ),
    ),
    tables=tables,
    choices={
        "Example 2": "plane strain, the whole disk held on its axis, a foundation 20 wide and 10 deep, clamped below, "
        "free at its sides, 160 × 30 elements of which 61 are equally wide over |x| ≤ 0.6; four segments of the disk "
        "to five of them; the disk begins as deep as Hertz on springs ε̂ has it"
    },
    n_steps=len(FORMULATIONS),
)
