"""Error against time in small multiples: a panel for each formulation, where one panel could not hold so many curves.

All panels share their axes, the front of all formulations and the front of the reference, so that each is read alone.
Runs without a solution are drawn at the upper edge.
"""

from __future__ import annotations

from math import ceil
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from contactverif.contract.arrays import FloatArray
from contactverif_reports.bench.results import BenchResults, Outcome
from contactverif_reports.bench.work_precision import REFERENCE, pareto_front

_N_COLUMNS = 3
_SHADES = ("#F0A03C", "#C2410C", "#5B1A07")  # Soft, middle and stiff penalty.
_MARKERS = "os^"
_FRONT: dict[str, Any] = {"color": "0.8", "linewidth": 4}
_REFERENCE_FRONT: dict[str, Any] = {"color": "#0072B2", "linewidth": 1.0, "linestyle": "--"}
_STYLE: dict[Any, Any] = {"font.size": 8.0, "axes.linewidth": 0.6, "lines.markersize": 3.2}

Span = tuple[float, float, float]  # The least error, the error at which failures are drawn, the end of the axis.


def make_multiples_figure(
    results: BenchResults, scene: str, kind: str, span: Span, penalties: dict[float, str]
) -> Figure:
    """Return a panel for each formulation with its runs, the front of all and the front of the reference."""
    n_rows = ceil(len(results.formulations) / _N_COLUMNS)
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(5.0, 0.9 + 1.25 * n_rows), layout="constrained")
        panels = figure.subplots(n_rows, _N_COLUMNS, squeeze=False, sharex=True, sharey=True).reshape(-1)
        fronts = [_front(results, scene, kind, names, span[0]) for names in (results.formulations, _reference(results))]
        for axes, name in zip(panels, results.formulations, strict=False):
            axes.set(xscale="log", yscale="log", ylim=(span[0], span[2]))
            axes.axhline(span[1], color="0.85", linewidth=0.6)
            for front, pen in zip(fronts, (_FRONT, _REFERENCE_FRONT), strict=True):
                axes.step(*front, where="post", zorder=0, **pen)
            _draw_runs(axes, results, scene, kind, name, span, tuple(penalties))
            axes.set_title(name, fontsize=8, pad=2)
            axes.minorticks_off()  # They would be most of the file.
            axes.grid(color="0.93", linewidth=0.5)
        panels[0].xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        hide_empty_panels(panels, len(results.formulations), _N_COLUMNS)
        figure.supxlabel("time of the solution / ms", fontsize=8)
        figure.supylabel(f"error of the {kind}; × at the upper edge: no solution", fontsize=8)
        handles = [
            Line2D([], [], color=colour, marker=marker, label=label)
            for colour, marker, label in zip(_SHADES, _MARKERS, penalties.values(), strict=False)
        ]
        handles.append(Line2D([], [], label="best of all", **_FRONT))
        if _reference(results):
            handles.append(Line2D([], [], label=f"best of {REFERENCE}", **_REFERENCE_FRONT))
        figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False, fontsize=8)
    return figure


def hide_empty_panels(panels: Any, n_used: int, n_columns: int) -> None:
    """Hide the panels behind the last used one, and write the ticks of a column below its last panel."""
    for axes in panels[n_used:]:
        axes.set_visible(False)
    for axes in panels[max(0, n_used - n_columns) : n_used]:
        axes.xaxis.set_tick_params(labelbottom=True)


def _reference(results: BenchResults) -> tuple[str, ...]:
    return (REFERENCE,) if REFERENCE in results.formulations else ()


def _front(
    results: BenchResults, scene: str, kind: str, names: tuple[str, ...], least: float
) -> tuple[FloatArray, FloatArray]:
    """Return times (n,) in ms and errors (n,) of the runs that none of some formulations beats, over all penalties."""
    cells = results.cells_of(scene)
    times = np.concatenate([1e3 * results.times(name)[cells] for name in names] or [np.empty(0)])
    errors = np.concatenate([results.errors_of(name, kind)[cells] for name in names] or [np.empty(0)])
    errors = np.where(np.isnan(errors), np.inf, np.maximum(errors, least))
    front = np.flatnonzero(pareto_front(times, errors))
    front = front[np.argsort(times[front])]
    return times[front], errors[front]


def _draw_runs(
    axes: Axes, results: BenchResults, scene: str, kind: str, name: str, span: Span, penalties: tuple[float, ...]
) -> None:
    """Draw a line for each penalty, from coarse meshes to fine ones, and crosses for failures."""
    row = results.formulations.index(name)
    slowest = 1e3 * np.nanmax(results.fastest[:, results.cells_of(scene), -1], initial=1e-3)
    for stiffness, colour, marker in zip(penalties, _SHADES, _MARKERS, strict=False):
        cells = results.cells_of(scene, stiffness)
        times, solved = 1e3 * results.fastest[row, cells, -1], results.outcomes[row, cells] == Outcome.SOLVED
        errors = np.maximum(results.errors_of(name, kind)[cells], span[0])
        axes.plot(times[solved], errors[solved], color=colour, marker=marker, linewidth=1.0)
        failed = np.where(np.isnan(times), slowest, times)[~solved]  # A plugin that crashed has no time.
        axes.plot(failed, np.full(len(failed), span[1]), color=colour, marker="x", linestyle="none")
