"""Example 2: an elastic disk on an elastic foundation: its meshes, its pressures beside Hertz, and the iterations.

Source: Zavarise & De Lorenzis (2009), Section 7.2, Figs. 37 and 38. What is given and what is chosen is said in
`contactverif.problems.disk`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch, Rectangle
from matplotlib.path import Path

from contactverif.contract import schema
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.body import Body
from contactverif.contract.schema import Group
from contactverif.problems import hertz
from contactverif_paper.disk_solutions import PAPER, DiskSolution, disk_scene, solve_disk
from contactverif_paper.figure_style import REFERENCE_LINE, add_legend, line_style, new_panels, use_round_ticks
from contactverif_paper.paper_columns import Column, Formulations, variables_of
from contactverif_paper.paper_formulations import NTS_AR, VTS_G, VTS_ME, VTS_PPT
from contactverif_paper.paper_item import Agreement, Item, PageTable, PaperFigure, Progress, Statement
from contactverif_paper.patch_tests import edges_of
from contactverif_reports.html.pages import number

FORMULATIONS = (NTS_AR, VTS_G, VTS_ME, VTS_PPT)
PRINTED_PEAK, PRINTED_ITERATIONS = 1.61e6, 4
PEAK_TOLERANCE = 0.03
TOUCHING = 1e-2  # The depth of the disk in the other first guess, over what is about right.
WHOLE = (0.0, 0.5), (-2.0, 0.0)  # Ends of the printed axes: x, and the pressure in 1e6.
MIDDLE = (0.0, 0.1), (-1.61, -1.54)
_PLACES = 401  # The number of places where the exact pressure is stored.
_MEGA = 1e6
_STRAIGHT = 0.7  # The least cosine between two edges of one line of a mesh.
_CLOSE_UP = np.array([[-0.8, -0.5], [0.8, 0.7]])  # Lower left and upper right corner of Fig. 37(b).


@dataclass(frozen=True, slots=True, eq=False)
class _Example2:
    """Solutions on the base meshes, and the exact answers for half-planes."""

    solutions: tuple[DiskSolution, ...]  # From a disk lowered about as far as it ends; for each of `FORMULATIONS`.
    touching: tuple[DiskSolution, ...]  # The same from a disk that just touches.
    from_touching: Annotated[
        tuple[int, ...], Column("formulation", "1", "linear systems solved from a disk that just touches")
    ]
    hertz: tuple[float, float]  # Largest pressure and half-width after Hertz.
    winkler: tuple[float, float]  # The same after Hertz on a layer of springs ε̂.
    winkler_x: Annotated[FloatArray, Column("exact_place", schema.LENGTH, "x along the interface")]
    winkler_pressure: Annotated[
        FloatArray, Column("exact_place", schema.STRESS, "Hertz on a layer of springs: pressure")
    ]
    bodies: tuple[Body, ...]  # The disk and the foundation, undeformed.
    formulations: Formulations = FORMULATIONS


def _compute(report_progress: Progress) -> _Example2:
    solutions, touching = [], []
    for formulation in FORMULATIONS:
        report_progress(f"Example 2, {formulation.name}")
        solutions.append(solve_disk(formulation))
        touching.append(solve_disk(formulation, lowered=TOUCHING))
    layer = PAPER.winkler_contact()
    places = np.linspace(0.0, layer.half_width, _PLACES)
    return _Example2(
        tuple(solutions),
        tuple(touching),
        tuple(solution.iterations for solution in touching),
        (hertz.peak(PAPER.force, PAPER.radius, PAPER.stiffness), PAPER.half_width),
        (layer.peak, layer.half_width),
        places,
        layer.pressure(places),
        tuple(disk_scene().bodies),
    )


def _statements(example: _Example2) -> Iterator[Statement]:
    peaks, widths = ([getattr(solution, name) for solution in example.solutions] for name in ("peak", "half_width"))
    yield Statement(
        "Fig. 38",
        "Example 2: the axis of the close-up ends at 1.61e6, and curves are nearly the same for all",
        f"{number(min(peaks), 4)} to {number(max(peaks), 4)}; half-width {min(widths):.3f} to {max(widths):.3f}. "
        f"Hertz: {number(example.hertz[0], 4)} and {example.hertz[1]:.3f}; Hertz on a layer of springs ε̂: "
        f"{number(example.winkler[0], 4)} and {example.winkler[1]:.3f}",
        Agreement.decide(all(abs(peak / PRINTED_PEAK - 1) <= PEAK_TOLERANCE for peak in peaks)),
        "fig38",
    )
    near, far = (sorted({solution.by_energy for solution in row}) for row in (example.solutions, example.touching))
    near_words, far_words = (", ".join(map(str, counts)) for counts in (near, far))
    ours = sorted({solution.iterations for solution in example.solutions})
    yield Statement(
        "Section 7.2",
        "Example 2: every algorithm needs the same number of iterations, 4, to an energy norm of 1e−15; the first "
        "guess is not said",
        f"until the energy of a step is 1e−15 of the first one, {near_words} from a disk lowered about as far as it "
        f"ends, and {far_words} from one that just touches; by our own rule, to the residual’s own roundoff, "
        f"{', '.join(map(str, ours))} from the lowered disk too",
        Agreement.decide(near == [PRINTED_ITERATIONS], always=far == [PRINTED_ITERATIONS]),
        condition="the first guess lowers the disk about as far as it ends",
    )


def _tables(example: _Example2) -> Iterator[PageTable]:
    rows = [(row.formulation.legend, row.peak, row.half_width, str(row.iterations)) for row in example.solutions]
    rows += [("Hertz", *example.hertz, "–"), ("Hertz on springs ε̂", *example.winkler, "–")]
    yield PageTable.of_numbers(
        "Largest pressure, half-width of the contact, linear systems solved",
        ("Formulation", "Largest pressure", "Half-width", "Iterations"),
        [(head, number(peak, 5), number(width, 4), count) for head, peak, width, count in rows],
    )


@PaperFigure.define(
    "fig37",
    "Example 2: (a) the meshes of the disk (black) and of the foundation (blue, 160 × 30 elements); (b) "
    "close-up of the contact zone. The paper draws them and prints no coordinates: the grading is ours.",
)
def _plot_meshes(example: _Example2) -> Figure:
    figure, (whole, near) = new_panels(5.0, 2)
    nodes = np.vstack([body.nodes for body in example.bodies])
    _draw_meshes(whole, example.bodies, np.array([nodes.min(axis=0), nodes.max(axis=0)]), 0.15)
    _draw_meshes(near, example.bodies, _CLOSE_UP, 0.4)
    corner, size = _CLOSE_UP[0], _CLOSE_UP[1] - _CLOSE_UP[0]
    whole.add_patch(Rectangle((corner[0], corner[1]), size[0], size[1], fill=False, linewidth=1.4, zorder=3))
    return figure


@PaperFigure.define(
    "fig38",
    "Example 2: (a) contact pressure; (b) close-up of its middle. Pressures are negative, as in the paper.",
)
def _plot_pressures(example: _Example2) -> Figure:
    figure, panels = new_panels(3.9, 2)
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


def _datasets(example: _Example2) -> dict[str, Group]:
    attributes = {
        "figure": "Figs. 37, 38",
        "scene": "example-2",
        "hertz": np.array(example.hertz),
        "winkler": np.array(example.winkler),
        "comment": f"hertz, winkler: largest pressure ({schema.STRESS}) and half-width ({schema.LENGTH})",
    }
    return {"": Group(variables_of(example) | variables_of(example.solutions, "formulation"), attrs=attributes)}


def mesh_lines(body: Body, box: FloatArray, tolerance: float) -> list[FloatArray]:
    """Return polylines (n_points, 2) along the edges of the cells of a body that lie in a box, given by two corners.

    Points that lie nearer than the tolerance to the line between their neighbours are left out.
    """
    corners = body.nodes[body.cells]
    inside = (corners.max(axis=1) >= box[0]).all(axis=1) & (corners.min(axis=1) <= box[1]).all(axis=1)
    chains = _chains(body.nodes, edges_of(body.cells[inside]))
    return [thin_out(body.nodes[chain], tolerance) for chain in chains]


def thin_out(points: FloatArray, tolerance: float) -> FloatArray:
    """Return the polyline without the points that lie within the tolerance of the line through the others."""
    if len(points) < 3:
        return points
    chord = points[-1] - points[0]
    offsets = points - points[0]
    length = float(np.hypot(*chord))
    if length > 0:
        distances = np.abs(chord[0] * offsets[:, 1] - chord[1] * offsets[:, 0]) / length
    else:
        distances = np.hypot(*offsets.T)
    farthest = int(distances.argmax())
    if distances[farthest] <= tolerance:
        return points[[0, -1]]
    return np.vstack([thin_out(points[: farthest + 1], tolerance)[:-1], thin_out(points[farthest:], tolerance)])


def _chains(nodes: FloatArray, edges: IntArray) -> list[list[int]]:
    """Join edges that follow each other about straight; each edge is in one chain."""
    edges_at: defaultdict[int, list[int]] = defaultdict(list)
    for edge, (a, b) in enumerate(edges.tolist()):
        edges_at[a].append(edge)
        edges_at[b].append(edge)
    remaining = set(range(len(edges)))

    def extend(chain: list[int]) -> None:
        """Lengthen the chain at its end, taking edges from those that remain."""
        while True:
            before, end = chain[-2], chain[-1]
            direction = nodes[end] - nodes[before]
            best, best_cosine, target = -1, _STRAIGHT, -1
            for edge in edges_at[end]:
                if edge not in remaining:
                    continue
                a, b = edges[edge].tolist()
                other = b if a == end else a
                step = nodes[other] - nodes[end]
                cosine = float(direction @ step / (np.hypot(*direction) * np.hypot(*step)))
                if cosine > best_cosine:
                    best, best_cosine, target = edge, cosine, other
            if best < 0:
                return
            remaining.discard(best)
            chain.append(target)

    chains = []
    for edge in range(len(edges)):
        if edge not in remaining:
            continue
        remaining.discard(edge)
        chain = edges[edge].tolist()
        extend(chain)
        chain.reverse()
        extend(chain)
        chains.append(chain)
    return chains


ITEM = Item(
    name="example_2",
    title="Example 2: a disk on a foundation",
    compute=_compute,
    statements=_statements,
    datasets=_datasets,
    figures=(_plot_meshes, _plot_pressures),
    tables=_tables,
    choices={
        "Example 2": "plane strain, the whole disk held on its axis, a foundation 20 wide and 10 deep, clamped below, "
        "free at its sides, 160 × 30 elements of which 61 are equally wide over |x| ≤ 0.6; four segments of the disk "
        "to five of them; the disk begins as deep as Hertz on springs ε̂ has it"
    },
    n_steps=len(FORMULATIONS),
)
