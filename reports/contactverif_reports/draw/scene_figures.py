"""The figure of a solved scene: bodies, pressures along the interface, Newton's iterates. Importing it is slow."""

from __future__ import annotations

import os
import textwrap
from dataclasses import dataclass
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from contactverif_reports.draw.case_figure import SUFFIXES, save
from contactverif_reports.draw.lengths import format_number
from contactverif_reports.draw.scene_meshes import close_up, colour_scale, draw_bodies, draw_meshes, magnifications
from contactverif_reports.draw.solved_scene import Solution, SolvedScene
from contactverif_reports.files import checked_name

_WIDTH = 10.0  # Width of the figure in inches.
_ACROSS = 3  # The largest number of panels side by side.
_SMALL: dict[Any, Any] = {
    **dict.fromkeys(("font.size", "axes.labelsize", "axes.titlesize", "legend.fontsize"), 9),
    **dict.fromkeys(("xtick.labelsize", "ytick.labelsize"), 8),
    "hatch.linewidth": 0.5,
}
_MANY = 40  # The points of a curve get markers up to this number.


@dataclass(frozen=True, slots=True)
class Pen:
    """The look of the curves of one formulation, which differs from the others in grey too."""

    color: str
    style: Any
    marker: str
    fill: str

    def look(self, n_points: int) -> dict[str, Any]:
        """Return the arguments of a plot of so many points."""
        look: dict[str, Any] = {"color": self.color, "linestyle": self.style, "linewidth": 1.2}
        if n_points <= _MANY:
            fill = self.color if self.fill == "full" else "white"
            look |= {"marker": self.marker, "markersize": 4.5, "markerfacecolor": fill, "markeredgewidth": 1.0}
        return look


_PENS = (
    Pen("black", "solid", "o", "full"),
    Pen("#0072b2", (0, (5, 1.5)), "s", "none"),
    Pen("#d55e00", (0, (1, 1)), "^", "full"),
    Pen("#777777", (0, (6, 1.5, 1, 1.5)), "D", "none"),
    Pen("#009e73", (0, (3, 1, 1, 1, 1, 1)), "v", "full"),
    Pen("#aa4499", (0, (8, 2)), "x", "full"),
)


def choose_pen(number: int) -> Pen:
    """Return the pen of the formulation of that number. There are six; then they repeat."""
    return _PENS[number % len(_PENS)]


def draw_pressures(axes: Axes, solved: SolvedScene, side: Literal["slave", "master"]) -> None:
    """Draw the pressure along one side of the interface, for each formulation.

    The curve is the nodal force over the node's share of the interface. On the slave, thin lines show the pressure at
    the contact points too.
    """
    order = [index for index, its_side in enumerate(solved.sides) if its_side == side]
    for number, solution in enumerate(solved.solutions):
        along, pressures, look = solved.along, solved.node_pressures(solution), choose_pen(number)
        for index in order:
            on = solved.on_interface[index]
            on = on[np.argsort(along[on], kind="stable")]
            on = on[np.isfinite(pressures[on])]
            axes.plot(along[on], pressures[on], zorder=3, **look.look(len(on)))
        if side == "slave" and solution.points is not None:
            _draw_points(axes, solved, solution, look.color)
    for pressure in solved.pressures:
        axes.axhline(pressure, color="0.6", linewidth=2.2, zorder=1)
    axes.set_ylabel(f"{side}: nodal force\nover its share\n(force / length)")
    _widen(axes)


def draw_history(axes: Axes, solved: SolvedScene, quantity: Literal["residuals", "energies"]) -> None:
    """Draw a norm against the iterates of Newton's method, for each formulation."""
    for number, solution in enumerate(solved.solutions):
        values = getattr(solution, quantity)
        floors = solution.floors if quantity == "residuals" else np.full_like(values, np.finfo(float).tiny)
        norms = np.where(values == 0, floors, values)
        iterates = np.flatnonzero(np.isfinite(norms) & (norms > 0))
        axes.plot(iterates, norms[iterates], zorder=3, **choose_pen(number).look(len(iterates)))
        for step in np.flatnonzero(np.diff(solution.factors)) if len(solved.solutions) == 1 else ():
            axes.axvline(step + 0.5, color="0.8", linewidth=0.8, zorder=1)
    axes.set_yscale("log")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    last = max(len(solution.residuals) for solution in solved.solutions) - 1
    axes.set_xlim(-0.3, max(last, 1) + 0.3)
    if quantity == "residuals":
        axes.axhspan(
            0, max(float(solution.floors[-1]) for solution in solved.solutions), color="0.92", zorder=0, linewidth=0
        )
    axes.set_ylabel(
        {"residuals": "largest residual\n(force)", "energies": "energy of the step\n(force × length)"}[quantity]
    )


def _draw_points(axes: Axes, solved: SolvedScene, solution: Solution, color: str) -> None:
    """Draw each point's pressure over its area of competence, or at its place if the plugin gives no area."""
    assert solution.points is not None
    places, areas = solved.points_along(solution.points)
    pressures = solution.points.pressure
    here = np.isfinite(pressures)
    known = here & np.isfinite(areas).all(axis=1)
    axes.hlines(
        pressures[known], areas[known].min(axis=1), areas[known].max(axis=1), color=color, linewidth=0.8, zorder=2
    )
    bare = here & ~known
    axes.plot(places[bare], pressures[bare], ls="none", marker=".", ms=4, color=color, zorder=2)


def _widen(axes: Axes) -> None:
    """Widen the axis to at least a tenth of the pressure, so that roundoff does not look like a result."""
    low, high = axes.get_ylim()
    middle = (low + high) / 2
    half = max((high - low) / 2, 0.1 * abs(middle))
    axes.set_ylim(middle - half, middle + half)


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
    axes.set(xlabel="x (length)", ylabel="y (length)")
    if not alone:  # A panel that stands alone has a scale of its own.
        axes.label_outer()
