"""The figure of a solved scene: bodies, pressures along the interface, Newton's iterates. Importing it is slow."""

from __future__ import annotations

import os
import textwrap
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from contactverif_reports.draw.case_figure import SUFFIXES, save
from contactverif_reports.draw.lengths import format_number
from contactverif_reports.draw.scene_curves import choose_pen, draw_history, draw_pressures
from contactverif_reports.draw.scene_meshes import close_up, colour_scale, draw_bodies, draw_meshes, magnifications
from contactverif_reports.draw.solved_scene import Solution, SolvedScene
from contactverif_reports.files import checked_name

_WIDTH = 10.0  # Width of the figure in inches.
_ACROSS = 3  # The largest number of panels side by side.
_SMALL: dict[Any, Any] = {
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 9,
    "hatch.linewidth": 0.5,
}


def draw_scene(solved: SolvedScene, path: str | os.PathLike[str], *, title: str = "") -> None:
    """Draw a solved scene to a .png or .svg file."""
    target = checked_name(path, SUFFIXES)
    with matplotlib.rc_context(_SMALL):
        save(_figure(solved, title), target)


def make_scene_figure(solved: SolvedScene) -> Figure:
    """Return the figure that `draw_scene` writes, without a title, for a page."""
    with matplotlib.rc_context(_SMALL):
        return _figure(solved, "")


def _figure(solved: SolvedScene, title: str) -> Figure:
    box = close_up(solved)
    panels = len(solved.solutions) + (box is not None)
    across = min(panels, _ACROSS)
    rows = -(-panels // across)
    width, height = np.ptp(np.vstack([body.nodes for body in solved.bodies]), axis=0) + 0.1 * solved.size
    slope = height / width if box is None else 1.0
    panel = float(np.clip((_WIDTH - 2.2) / across * slope, 1.6, 4.2))
    heights = rows * (panel + 0.5) + 0.6, 4.8
    figure = Figure(figsize=(_WIDTH, sum(heights)), layout=ConstrainedLayoutEngine(h_pad=0.07))
    grid = figure.add_gridspec(2, 1, height_ratios=heights)
    bodies, curves = figure.add_subfigure(grid[0]), figure.add_subfigure(grid[1])
    _draw_meshes(bodies, solved, rows, across)
    _draw_curves(curves, solved)
    lines = [*textwrap.wrap(title, 110), _facts(solved), *_advice(solved)]
    figure.suptitle("\n".join(lines), fontsize=10, parse_math=False)
    return figure


def _draw_meshes(figure: SubFigure, solved: SolvedScene, rows: int, across: int) -> None:
    scale, large = colour_scale(solved), magnifications(solved)
    box = close_up(solved)
    panels = figure.subplots(rows, across, squeeze=False, sharex=box is None, sharey=box is None)
    if box is not None:
        whole = panels.ravel()[0]
        draw_meshes(whole, solved, box)
        whole.set_title("all of the meshes; the frame\nis drawn on the right")
        _bare(whole, alone=True)
    from_near = panels.ravel()[int(box is not None) :]
    for axes, solution in zip(from_near, solved.solutions, strict=False):
        draw_bodies(axes, solved, solution, large[solution.formulation], scale)
        axes.set_title(f"{solution.formulation}\n{large[solution.formulation].words}", parse_math=False)
        _bare(axes, alone=box is not None)
    for axes in from_near[len(solved.solutions) :]:
        axes.set_axis_off()
    bar = figure.colorbar(scale, ax=panels, shrink=0.85, aspect=18, pad=0.01)
    bar.set_label("pressure across the\ninterface, −σₙ (force / length)")


def _draw_curves(figure: SubFigure, solved: SolvedScene) -> None:
    (slave, residuals), (master, energies) = figure.subplots(2, 2, sharex="col")
    draw_pressures(slave, solved, "slave")
    draw_pressures(master, solved, "master")
    master.set_xlabel("position along the interface (length)")
    draw_history(residuals, solved, "residuals")
    draw_history(energies, solved, "energies")
    energies.set_xlabel("iterate")
    for axes in (slave, master, residuals, energies):
        axes.spines[["top", "right"]].set_visible(False)
    handles: list[Artist] = [
        Line2D([], [], label=_end(solution), **choose_pen(number).look(1))
        for number, solution in enumerate(solved.solutions)
    ]
    if any(solution.points is not None for solution in solved.solutions):
        handles.append(
            Line2D([], [], color="0.3", linewidth=0.8, marker=".", label="pressure at contact points, over their areas")
        )
    if solved.pressures:
        exact = " and ".join(map(format_number, solved.pressures))  # A penalty and multipliers may have one each.
        handles.append(Line2D([], [], color="0.6", linewidth=2.2, label=f"exact pressure {exact}"))
    handles.append(Patch(color="0.92", label="roundoff of the residual"))
    figure.legend(
        handles=handles, loc="outside lower center", ncols=2 if len(handles) > 3 else len(handles), frameon=False
    )


def _end(solution: Solution) -> str:
    """Say how Newton's method ended."""
    count = solution.n_iterations
    times = f"{count} iteration{'s' * (count != 1)}"
    return f"{solution.formulation}: {solution.end}{' after' if solution.converged else ','} {times}"


def _facts(solved: SolvedScene) -> str:
    """Return the penalty and the moduli."""
    moduli = ", ".join(
        f"{body.name} E {format_number(body.young)}, ν {format_number(body.poisson)}"
        for body in solved.bodies
        if not body.rigid
    )
    words = f"penalty {format_number(float(f'{solved.case.penalty:.4g}'))}; {moduli}"
    return "\n".join(textwrap.wrap(words, 110, max_lines=2, placeholder=" …"))


def _advice(solved: SolvedScene) -> list[str]:
    """Say what happened where Newton's method did not converge, and what to try next."""
    advice = [f"{solution.formulation}: {solution.advice}" for solution in solved.solutions if solution.advice]
    return [line for words in advice for line in textwrap.wrap(words, 110)]


def _bare(axes: Axes, *, alone: bool) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("x (length)")
    axes.set_ylabel("y (length)")
    if not alone:  # A panel that stands alone has a scale of its own.
        axes.label_outer()
