"""The figure of the stability sweeps: error against condition number, one panel a formulation. Slow to import.

All panels have the same axes, so that they can be compared. Sweeps differ by marker and colour (Okabe and Ito's, which
colour-blind readers can tell apart). An error of exactly 0 has a row of its own at the bottom.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif_reports.draw.case_figure import save
from contactverif_reports.stability.sweep_points import LINE_FACTOR, SWEEPS, TOLERANCE, SweepPanel, short_number

_COLUMNS = 4
_PANEL = 1.95, 1.62  # Width and height of one of many panels in inches.
_FEW = 2  # Up to so many panels are drawn larger.
_LARGE_PANEL = 3.6, 3.0
_LOW, _HIGH, _ZERO = 1e-17, 30.0, 1e-18  # The range of errors, and the row for an error of 0.
_CONDITIONS = 0.5, 1e17
_TICKS = [1.0, 1e5, 1e10, 1e15]
_ERROR_TICKS = [1e-16, 1e-12, 1e-8, 1e-4, 1.0]
_SMALL_TEXT = 5.8  # Points; the line below a title must be narrower than a panel.
_LEGEND_TEXT, _LEGEND_WIDTH = 6.5, 2.1  # Points, and inches of a column of the legend.
_PENS: dict[str, dict[str, Any]] = {
    "gap": {"marker": "o", "color": "#0072B2"},
    "ratio of lengths": {"marker": "s", "color": "#E69F00"},
    "offset": {"marker": "^", "color": "#009E73"},
    "offset, gap 1e-6": {"marker": "v", "color": "#D55E00"},
    "offset, gap, ratio": {"marker": "X", "color": "black"},
    "ε̂h/E": {"marker": "D", "color": "#CC79A7"},
}
_TOLERANCE_LINE: dict[str, Any] = {"color": "0.35", "linewidth": 0.6, "linestyle": (0, (4, 3))}
_STYLE: dict[Any, Any] = {
    "font.size": 7.0,
    "axes.titlesize": 7.5,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
}
_AXES_LABELS = ("condition number κ = Σ ‖K‖ |z − z̄| / max |R| of the worst force", "relative error of the worst force")


def draw_stability(panels: Sequence[SweepPanel], target: Path) -> None:
    """Draw all panels to a .png or .svg file."""
    save(make_stability_figure(panels), target)


@matplotlib.rc_context(_STYLE)
def make_stability_figure(panels: Sequence[SweepPanel]) -> Figure:
    """Return the figure; the legend stands in a free place of the grid, or above one row of panels."""
    n_columns = min(_COLUMNS, len(panels))
    n_rows = ceil((len(panels) + (len(panels) > n_columns)) / n_columns)
    width, height = _LARGE_PANEL if len(panels) <= _FEW else _PANEL
    size = n_columns * width + 0.5, n_rows * height + (0.5 if n_rows > 1 else 1.2)
    figure = Figure(figsize=size, layout="constrained")
    cells = figure.subplots(n_rows, n_columns, squeeze=False).reshape(-1)
    for axes, panel in zip(cells, panels, strict=False):
        _draw_panel(axes, panel)
    for place, axes in enumerate(cells):
        _label_axes(axes, place, len(panels), n_columns)
    free = cells[len(panels) :]
    for axes in free:
        axes.set_axis_off()
    if len(free):
        free[-1].legend(handles=_handles(), loc="center", frameon=False, fontsize=_LEGEND_TEXT, handlelength=1.4)
    else:
        n_legends = max(2, round(size[0] / _LEGEND_WIDTH))
        figure.legend(
            handles=_handles(), loc="outside upper center", frameon=False, ncols=n_legends, fontsize=_LEGEND_TEXT
        )
    figure.supxlabel(_AXES_LABELS[0], fontsize=7.5)
    figure.supylabel(_AXES_LABELS[1], fontsize=7.5)
    return figure


def _draw_panel(axes: Axes, panel: SweepPanel) -> None:
    """Draw the points of a formulation, the line, and how far the worst point is from it."""
    axes.set(xscale="log", yscale="log", xlim=_CONDITIONS, ylim=(_ZERO / 3, _HIGH))
    conditions = np.array(_CONDITIONS)
    line = LINE_FACTOR * UNIT_ROUNDOFF * conditions
    axes.fill_between(conditions, line, _HIGH, color="0.93", linewidth=0)
    axes.plot(conditions, line, color="0.35", linewidth=0.9)
    axes.plot(conditions, TOLERANCE * UNIT_ROUNDOFF * conditions, **_TOLERANCE_LINE)
    axes.axhline(_LOW / 1.8, color="0.8", linewidth=0.5)
    for sweep in SWEEPS:
        points = [point for point in panel.points if point.sweep == sweep]
        conditions_of_points = [min(point.condition, _CONDITIONS[1]) for point in points]
        errors = [min(max(point.error, _LOW), _HIGH / 2) if point.error > 0 else _ZERO for point in points]
        axes.plot(conditions_of_points, errors, **_pen(sweep), zorder=3)
    colour = "#B03A00" if panel.above else "0.25"
    axes.set_title(panel.formulation, loc="left", fontweight="bold", pad=11)
    above: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points", "xytext": (0, 2.5)}
    notes: list[Any] = [axes.annotate(_verdict(panel), (0, 1), fontsize=_SMALL_TEXT, color=colour, **above)]
    if panel.above:  # The lower right corner is free: so exact a force at so large a κ would be a coincidence.
        name = f"worst:\n{panel.above[0].name}"
        place: dict[str, Any] = {"transform": axes.transAxes, "ha": "right", "va": "bottom"}
        notes.append(axes.text(0.98, 0.14, name, fontsize=_SMALL_TEXT, color=colour, **place))
    for note in notes:
        note.set_in_layout(False)


def _verdict(panel: SweepPanel) -> str:
    """Return how the worst point stands to u κ, in a line."""
    worst, above = panel.worst, panel.above
    if worst is None:
        return "no point"
    if not above:
        return f"{len(panel.points)} states, error ≤ {worst.roundings:.2g} u κ"
    return f"{len(above)} of {len(panel.points)} above, up to {short_number(worst.roundings)} u κ"


def _pen(sweep: str) -> dict[str, Any]:
    large = 4.4 if _PENS[sweep]["marker"] == "X" else 3.2
    return {**_PENS[sweep], "linestyle": "none", "markersize": large, "markerfacecolor": "none", "markeredgewidth": 0.7}


def _label_axes(axes: Axes, place: int, n_panels: int, n_columns: int) -> None:
    """Put numbers on the outer axes alone."""
    axes.set_xticks(_TICKS)
    axes.set_yticks([_ZERO, *_ERROR_TICKS])
    axes.minorticks_off()
    is_lowest = place + n_columns >= n_panels
    axes.set_xticklabels([_decade(tick) for tick in _TICKS] if is_lowest else [])
    labels = ["0", *map(_decade, _ERROR_TICKS)]
    axes.set_yticklabels(labels if place % n_columns == 0 else [])


def _decade(value: float) -> str:
    return "1" if value == 1 else f"$10^{{{round(np.log10(value))}}}$"


def _handles() -> list[Any]:
    """Return the entries of the legend."""
    sweeps = [Line2D([], [], label=f"sweep of {sweep}", **_pen(sweep)) for sweep in SWEEPS]
    line = Line2D([], [], color="0.35", linewidth=0.9, label=f"{LINE_FACTOR:g} u κ, u = 2⁻⁵³")
    dashed = Line2D([], [], label=f"{TOLERANCE:g} u κ: the property fails", **_TOLERANCE_LINE)
    return [*sweeps, line, dashed, Patch(color="0.93", label="more than the condition\nnumber explains")]
