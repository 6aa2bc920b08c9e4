"""Curves of a solved scene: pressures along the interface, and residuals of Newton's method. Importing it is slow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from contactverif_reports.draw.solved_scene import Solution, SolvedScene

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
