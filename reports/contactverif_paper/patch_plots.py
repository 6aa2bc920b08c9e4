"""Draws the patch tests of the paper: pressures, magnified penetrations, meshes. Slow to import."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from contactverif.contract.arrays import IntArray
from contactverif.contract.body import Body
from contactverif_paper.figure_style import (
    LETTERS,
    REFERENCE_LINE,
    WIDTH,
    add_legend,
    line_style,
    new_figure,
    new_panels,
    use_round_ticks,
)
from contactverif_paper.paper_formulations import PaperFormulation
from contactverif_paper.patch_solutions import Curve, PatchSolution
from contactverif_reports.plot.scene_figures import colour_scale, magnifications, plot_bodies

_TALLEST = 2.6  # Inches: the height of a panel with a deformed mesh.
_SHORT_AXIS = 4.0  # An x axis of this length has a tick at each unit.
_BROAD_LEGEND = 3  # Columns of a legend under two panels.
_BAR = 10  # The length of a colour bar beside a row of panels over its width.
_ARROW = 0.12  # Length of an arrow of pressure over the height of a body.


def plot_pressures(patches: Sequence[PatchSolution]) -> Figure:
    """Draw one panel for each scene, or for a scene and its close-up, with the paper's axes."""
    views = [(patch, patch.setup.axis) for patch in patches]
    views += [(patch, patch.setup.close_up) for patch in patches if patch.setup.close_up]
    figure, panels = new_panels(3.6 if len(views) > 1 else 3.4, len(views))
    for axes, (patch, limits) in zip(panels, views, strict=True):
        _draw_pressures(axes, patch, limits)
    remarks = {curve.formulation: _end_remark(curve) for patch in patches for curve in patch.curves}
    add_legend(figure, shown_formulations(patches), reference="exact", columns=_BROAD_LEGEND, remarks=remarks)
    return figure


def _draw_pressures(axes: Axes, patch: PatchSolution, limits: tuple[float, float]) -> None:
    low, high = limits
    axes.axhline(1.0, **REFERENCE_LINE)
    for curve in patch.curves:
        inside = low <= curve.pressure.min() and curve.pressure.max() <= high
        axes.plot(curve.x, curve.pressure, clip_on=not inside, **line_style(curve.formulation, len(curve.x)))
    axes.set(xlabel="x coordinate (length)", ylabel="contact pressure / p (–)")
    use_round_ticks(axes, 6)
    left, right = patch.setup.x_axis
    step = 1.0 if right - left <= _SHORT_AXIS else 2.0  # The paper's axes have a tick at every second unit.
    axes.set_xticks(np.arange(left, right + 0.5, step))
    axes.set_xlim(left, right)
    axes.set_ylim(low, high)


def shown_formulations(patches: Sequence[PatchSolution]) -> list[PaperFormulation]:
    """Return the formulations of all patch tests, each once."""
    return list(dict.fromkeys(curve.formulation for patch in patches for curve in patch.curves))


def plot_penetrations(patches: Sequence[PatchSolution]) -> Figure:
    """Draw one panel for each formulation and scene, the penetration magnified alike in all of a scene."""
    panels = [curve for patch in patches for curve in patch.curves]
    across = 2
    down = -(-len(panels) // across)
    wide, high = np.ptp(np.vstack([body.nodes for body in patches[0].solved.bodies]), axis=0)
    panel = min((WIDTH - 1.6) / across, _TALLEST * wide / high)
    figure = new_figure(down * (panel * high / wide + 0.35) + 0.7)
    grid = figure.subplots(down, across, squeeze=False)
    for axes in grid.ravel():
        axes.set_axis_off()
    letters, remaining = iter("abcdefghij"), iter(grid.ravel())
    remarks: dict[str, None] = {}
    for patch in patches:
        scale, magnified = colour_scale(patch.solved), magnifications(patch.solved)
        remarks |= dict.fromkeys(magnification.words for magnification in magnified.values())
        panels_of_scene = [next(remaining) for _ in patch.curves]
        for axes, curve in zip(panels_of_scene, patch.curves, strict=True):
            plot_bodies(axes, patch.solved, curve.solution, magnified[curve.solution.formulation], scale)
            axes.set_title(f"({next(letters)}) {curve.formulation.legend}{_end_remark(curve)}", loc="left")
        rows = -(-len(panels_of_scene) // across)
        bar = figure.colorbar(scale, ax=panels_of_scene, shrink=0.8, aspect=_BAR * rows, pad=0.01)
        bar.locator = MaxNLocator(5, steps=[1, 2, 5, 10])
        bar.outline.set_linewidth(0.5)
    lines = list(remarks)
    if len(lines) == 2:
        lines = [f"above: {lines[0]}", f"below: {lines[1]}"]
    title = "\n".join(["colour: −σₙ (force / length)", *lines])
    figure.legend(handles=_surface_handles(), loc="outside lower center", ncols=3, title=title, title_fontsize=LETTERS)
    return figure


def _surface_handles() -> list[Line2D | Patch]:
    """Return the legend of both surfaces and of the penetration, as `plot_bodies` draws them."""
    pen: dict[str, Any] = {"color": "black", "linewidth": 1.3, "markersize": 3.6, "markeredgecolor": "black"}
    return [
        Line2D([], [], label="slave", marker="o", **pen),
        Line2D([], [], label="master", marker="s", linestyle=(0, (4, 1.5)), markerfacecolor="white", **pen),
        Patch(facecolor="white", edgecolor="0.35", linewidth=0, hatch="xxxxxx", label="penetration"),
    ]


def plot_meshes(patches: Sequence[PatchSolution]) -> Figure:
    """Draw the undeformed meshes of both bodies of the first patch test, and the pressure on them."""
    figure = new_figure(3.6)
    axes = figure.subplots()
    axes.set_axis_off()
    for body in patches[0].solved.bodies:
        edges = list(body.nodes[edges_of(body.cells)])
        axes.add_collection(LineCollection(edges, colors="0.35", linewidths=0.7, zorder=2))
        _draw_contact(axes, body)
        _draw_load(axes, body)
    axes.set_aspect("equal")
    axes.margins(0.04)
    axes.autoscale_view()
    figure.supxlabel("filled: slave nodes; open: master nodes; arrows: p = 1", fontsize=LETTERS)
    return figure


def _end_remark(curve: Curve) -> str:
    """Return how Newton's method ended, in brackets; empty for a solution."""
    return "" if curve.solution.converged else f" ({curve.end})"


def edges_of(cells: IntArray) -> IntArray:
    """Return the nodes (n_edges, 2) of the edges of some cells, each edge once."""
    pairs = np.stack([cells, np.roll(cells, -1, axis=1)], axis=-1).reshape(-1, 2)
    return np.unique(np.sort(pairs, axis=1), axis=0)


def _draw_contact(axes: Axes, body: Body) -> None:
    is_slave = body.name == "slave"
    face = "black" if is_slave else "white"
    nodes = body.nodes[body.contact_nodes]
    axes.plot(*nodes.T, ls="none", marker="o" if is_slave else "s", ms=5, mfc=face, mec="black", zorder=6 - is_slave)


def _draw_load(axes: Axes, body: Body) -> None:
    loaded = np.flatnonzero(body.load[:, 1] < 0)
    height = float(np.ptp(body.nodes[:, 1])) * _ARROW
    for x, y in body.nodes[loaded]:
        axes.annotate("", (x, y), (x, y + height), arrowprops={"arrowstyle": "-|>", "color": "black", "lw": 0.8})
        axes.plot(x, y + height, alpha=0.0)
