"""The common style of all figures of the paper: sizes, type, pens, panels and legends. Slow to import.

Figures are one or two columns of a journal wide. Letters stay legible at half size. Curves differ by line and marker,
so that they read in grey; a formulation has the same pen in every figure. Axes have the limits that the paper prints.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from contactverif_paper.paper_formulations import PaperFormulation
from contactverif_paper.paper_item import PaperFigure
from contactverif_reports.plot.scene_figures import choose_pen

WIDTH = 7.2  # The width of a figure in inches: two columns of a journal.
LETTERS = 11  # Points: 5.5 at half size.
REFERENCE_LINE: dict[str, Any] = {"color": "0.75", "linewidth": 2.6, "zorder": 1}  # The style of an exact answer.
_SIZES = ("font.size", "axes.labelsize", "axes.titlesize", "xtick.labelsize", "ytick.labelsize", "legend.fontsize")
_STYLE: dict[Any, Any] = {
    **dict.fromkeys(_SIZES, LETTERS),
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "legend.columnspacing": 1.4,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "hatch.linewidth": 0.4,
    "lines.linewidth": 1.2,
}


def render_figure(figure: PaperFigure, data: Any) -> Figure:
    """Draw a figure of an item in the common style."""
    with matplotlib.rc_context(_STYLE):
        return figure.plot(data)


def new_figure(height: float) -> Figure:
    """Return an empty figure of that height in inches."""
    return Figure(figsize=(WIDTH, height), layout=ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.05))


def new_panels(height: float, count: int, **options: Any) -> tuple[Figure, list[Axes]]:
    """Return a figure and its `count` panels side by side, with a letter each if there are several."""
    figure = new_figure(height)
    panels = list(figure.subplots(1, count, squeeze=False, **options)[0])
    if count > 1:
        for axes, letter in zip(panels, "abcdef", strict=False):
            axes.set_title(f"({letter})", loc="left", fontweight="bold")
    return figure, panels


def line_style(formulation: PaperFormulation, n_points: int, **more: Any) -> dict[str, Any]:
    """Return the arguments of a plot of this formulation; a curve of many points has no markers."""
    return choose_pen(formulation.pen).look(n_points) | {"markersize": 4.6, "markeredgewidth": 0.9, "zorder": 3} | more


def add_legend(
    figure: Figure,
    formulations: Sequence[PaperFormulation],
    *,
    reference: str = "",
    columns: int = 3,
    remarks: Mapping[PaperFormulation, str] = MappingProxyType({}),
) -> None:
    """Put a legend below all panels; `reference` is the legend of the exact answer, `remarks` stand behind legends."""
    handles = [
        Line2D([], [], label=f"{formulation.legend}{remarks.get(formulation, '')}", **line_style(formulation, 1))
        for formulation in formulations
    ]
    if reference:
        handles.append(Line2D([], [], label=reference, **REFERENCE_LINE))
    figure.legend(handles=handles, loc="outside lower center", ncols=min(columns, len(handles)))


def use_decades(axes: Axes, n_ticks: int = 6) -> None:
    """Make the vertical axis logarithmic, with few ticks."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(numticks=n_ticks))
    axes.yaxis.set_minor_locator(NullLocator())


def use_round_ticks(axes: Axes, n_ticks: int = 5) -> None:
    """Give both axes a few round ticks."""
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(n_ticks, steps=[1, 2, 5, 10]))
