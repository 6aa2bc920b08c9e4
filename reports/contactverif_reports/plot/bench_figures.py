"""The figures of a bench: errors against the numbers, what an error costs, runtimes. Importing it is slow.

At most six formulations have a colour and a name, the reference among them; the others are grey. Solid lines have the
penalty of the rule, dashed ones the best afterwards.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, inf, isnan
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator

from contactverif_reports.bench_costs import (
    MOST_CURVES,
    REFERENCE,
    ROUNDOFF,
    Ratio,
    costs_at,
    curve,
    format_share,
    rank,
    ratios_at,
    runtimes,
)
from contactverif_reports.bench_results import BEST, DEEPEST, ERRORS, RULE, VARIANTS, BenchResults
from contactverif_reports.plot.case_figures import save

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#8B4513")  # Okabe and Ito's, and brown.
_MARKERS = "os^vDP"
_AXES = {"evaluation": "one evaluation / ms", "factorisation": "one factorisation / ms"}
_GREY: dict[str, Any] = {"color": "0.8", "linewidth": 0.8, "zorder": 0}
_STYLE: dict[Any, Any] = {"font.size": 8.5, "axes.titlesize": 8.5, "axes.linewidth": 0.6, "lines.markersize": 3.5}
_N_COLUMNS = 3
_STROKES = f"solid: {RULE.penalty:g} E/h, dashed: the best penalty,\ndotted: the best linear pressure, grey: others"
ROOM = 0.1  # The least distance of two names, over the height of a panel.
_BESIDE = 1.04  # The place of names, over the width of a panel.


def plot_bench(results: BenchResults, folder: Path) -> None:
    """Draw all figures of a bench as SVG into a folder."""
    for scene in results.scenes:
        if len(results.meshes_of(scene)) > 1:
            save(make_scene_figure(results, scene), folder / f"{scene}.svg")
            if len(results.formulations) > MOST_CURVES:
                save(make_each_figure(results, scene), folder / f"{scene}-each.svg")
    save(make_cost_figure(results), folder / "cost.svg")
    save(make_runtime_figure(results), folder / "runtimes.svg")
    save(make_starts_figure(results), folder / "starts.svg")


def highlights(results: BenchResults) -> dict[str, dict[str, Any]]:
    """Return {formulation: its pen}: the reference, and those that are the most exact on the first scene."""
    order = rank(results, results.scenes[0])
    order.sort(key=lambda name: name != REFERENCE)
    return {
        name: {"color": colour, "marker": marker}
        for name, colour, marker in zip(order, _COLOURS, _MARKERS, strict=False)
    }


def _panels(size: tuple[float, float], rows: int, columns: int, **options: Any) -> tuple[Figure, Any]:
    """Return a figure and its panels (rows, columns), with a faint grid."""
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, **options)
    for axes in panels.flat:
        axes.grid(color="0.93", linewidth=0.5)
    return figure, panels


def _label_plainly(*every: Any) -> None:
    """Write the numbers of a logarithmic axis at 1, 2 and 5 of each power of ten where there is room, else at 1."""
    for axis in every:
        low, high = axis.get_view_interval()
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 60 * low else (1.0,)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
        axis.set_minor_locator(NullLocator())


@matplotlib.rc_context(_STYLE)
def make_scene_figure(results: BenchResults, scene: str) -> Figure:
    """Return the three errors of a scene, each against one evaluation and against one factorisation."""
    pens = highlights(results)
    figure, panels = _panels((5.2, 6.6), len(ERRORS), len(_AXES), sharex="col", sharey="row")
    for row, kind in zip(panels, ERRORS, strict=True):
        for axes, number in zip(row, _AXES, strict=True):
            axes.set(xscale="log", yscale="log")
            for name in sorted(results.formulations, key=lambda name: name in pens):
                _plot_curve(axes, results, scene, (name, kind, number), pens.get(name))
        row[0].set_ylabel(f"error of the {kind}")
    best = np.median(results.best_pressure[results.ladders(scene)], axis=0)
    if REFERENCE in results.formulations and (best > ROUNDOFF).all():  # Uniform pressures have no error.
        # What the mesh allows pressures, at the times of the reference.
        for axes, number in zip(panels[list(ERRORS).index("pressure")], _AXES, strict=True):
            x, _ = curve(results, REFERENCE, scene, "pressure", number)
            axes.plot(1e3 * x, best, color="0.45", linewidth=1.0, linestyle=":", zorder=1)
    for axes, label in zip(panels[-1], _AXES.values(), strict=True):
        axes.set_xlabel(label)
    for axes in panels.flat:
        _label_plainly(axes.xaxis, axes.yaxis)
    figure.draw_without_rendering()  # Labels stand where the layout has put the panels.
    for axes in panels[:, -1]:
        _name_curves(axes, {pen["color"]: name for name, pen in pens.items()})
    figure.suptitle(_STROKES, fontsize=8, color="0.3")
    return figure


def _plot_curve(
    axes: Axes, results: BenchResults, scene: str, series: tuple[str, str, str], pen: dict[str, Any] | None
) -> None:
    """Draw a formulation, error and number: with the penalty of the rule, and with a colour at the best one too."""
    name, kind, number = series
    x, errors = curve(results, name, scene, kind, number)
    finite = np.isfinite(errors) & np.isfinite(x)
    if pen is None:
        axes.plot(1e3 * x[finite], errors[finite], **_GREY)
        return
    axes.plot(1e3 * x[finite], errors[finite], linewidth=1.1, markerfacecolor="none", **pen)
    _, best = curve(results, name, scene, kind, number, BEST)
    finite = np.isfinite(best) & np.isfinite(x)
    axes.plot(1e3 * x[finite], best[finite], color=pen["color"], linewidth=0.8, linestyle="--")


@matplotlib.rc_context(_STYLE)
def make_each_figure(results: BenchResults, scene: str) -> Figure:
    """Return the error of the forces against one evaluation, a panel for each formulation, the reference in each."""
    n_rows = ceil(len(results.formulations) / _N_COLUMNS)
    figure, grid = _panels((5.0, 0.7 + 1.25 * n_rows), n_rows, _N_COLUMNS, sharex=True, sharey=True)
    panels = grid.reshape(-1)
    for axes, name in zip(panels, results.formulations, strict=False):
        axes.set(xscale="log", yscale="log")
        if REFERENCE in results.formulations:
            _plot_curve(axes, results, scene, (REFERENCE, "forces", "evaluation"), None)
        _plot_curve(axes, results, scene, (name, "forces", "evaluation"), {"color": "#C2410C", "marker": "o"})
        axes.set_title(name, fontsize=8, pad=2)
    _label_plainly(panels[0].xaxis, panels[0].yaxis)
    for axes in panels[len(results.formulations) :]:
        axes.set_visible(False)
    figure.supxlabel(f"one evaluation / ms; grey: {REFERENCE}, dashed: best penalty", fontsize=8)
    figure.supylabel("error of the forces", fontsize=8)
    return figure


@matplotlib.rc_context(_STYLE)
def make_cost_figure(results: BenchResults) -> Figure:
    """Return what two errors on the first scene cost: ratios of evaluation and factorisation, and linear systems."""
    scene = results.scenes[0]
    targets = results.targets[scene][:2]
    order, costs = rank(results, scene)[::-1], [costs_at(results, scene, target) for target in targets]
    figure, grid = _panels((5.2, 1.3 + 0.22 * len(order)), 1, 3, sharey=True)
    (evaluation, systems, factorisation), handles = grid[0], []
    for target, each, colour, marker in zip(targets, costs, _COLOURS, _MARKERS, strict=False):
        for axes, number in zip((evaluation, factorisation), _AXES, strict=True):
            _plot_ratios(axes, ratios_at(results, scene, target, number), order, {"color": colour, "marker": marker})
        finite = [(count, place) for place, name in enumerate(order) if (count := each[name].middle("systems")) < inf]
        look: dict[str, Any] = {"color": colour, "marker": marker, "linestyle": "none", "mfc": "none"}
        systems.plot(*zip(*finite, strict=True), **look)
        handles.append(Line2D([], [], label=f"error of {format_share(target)}", **look))
    for place, name in enumerate(order):
        if not any(cost[name].is_usual for cost in costs):
            never: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 7, "color": "0.45"}
            systems.text(0.5, place, "never there", transform=systems.get_yaxis_transform(), **never)
    systems.xaxis.set_major_locator(MaxNLocator(5, integer=True, min_n_ticks=1))
    systems.set_xlim(left=0)
    evaluation.set_title(f"one evaluation,\n{REFERENCE} = 1")
    systems.set_title("linear systems")
    factorisation.set_title(f"one factorisation,\n{REFERENCE} = 1")
    evaluation.set_yticks(range(len(order)), order, parse_math=False)
    evaluation.set_ylim(-0.6, len(order) - 0.4)
    figure.legend(handles=handles, loc="outside upper center", ncols=2, frameon=False)
    return figure


def _plot_ratios(axes: Axes, ratios: Mapping[str, Ratio], order: list[str], pen: dict[str, Any]) -> None:
    axes.set_xscale("log")
    axes.axvline(1.0, color="0.35", linewidth=0.8)
    for height, name in enumerate(order):
        ratio = ratios.get(name)
        if ratio is None or not np.isfinite(ratio.middle):
            continue
        low, high = (ratio.middle if isnan(end) else end for end in (ratio.low, ratio.high))
        axes.plot([low, high], [height, height], color=pen["color"], linewidth=1.2)
        axes.plot([ratio.middle], [height], markerfacecolor="none", **pen)
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 0.5), max(high, 2.0))
    _label_plainly(axes.xaxis)


@matplotlib.rc_context(_STYLE)
def make_runtime_figure(results: BenchResults) -> Figure:
    """Return the share of targets and instances that are reached within all evaluations, or factorisations, so long."""
    scenes, pens = results.scenes, highlights(results)
    figure, panels = _panels((4.6, 1.3 + 1.5 * len(scenes)), len(scenes), 2, sharey=True)
    for row, scene in zip(panels, scenes, strict=True):
        for axes, number in zip(row, _AXES, strict=True):
            axes.set(xscale="log", ylim=(-0.03, 1.03))
            for name in sorted(results.formulations, key=lambda name: name in pens):
                seconds = np.sort(1e3 * runtimes(results, name, scene, number))
                finite = seconds[np.isfinite(seconds)]
                pen = {"color": pens[name]["color"], "linewidth": 1.2} if name in pens else _GREY
                axes.step(finite, np.arange(1, len(finite) + 1) / len(seconds), where="post", **pen)
            _label_plainly(axes.xaxis)
        row[0].set_ylabel(scene)
    for axes, label in zip(panels[-1], ("all evaluations / ms", "all factorisations / ms"), strict=True):
        axes.set_xlabel(label)
    figure.supylabel("share of errors and instances that are reached", fontsize=8.5)
    handles = [Line2D([], [], label=name, color=pen["color"]) for name, pen in pens.items()]
    if len(pens) < len(results.formulations):
        handles.append(Line2D([], [], label="others", **_GREY))
    figure.legend(handles=handles, loc="outside upper center", ncols=3, frameon=False)
    return figure


@matplotlib.rc_context(_STYLE)
def make_starts_figure(results: BenchResults) -> Figure:
    """Return a table of who fails from the deepest start: linear systems, and the share without a solution, shaded."""
    variant = VARIANTS.index(DEEPEST)
    names, scenes = results.formulations, results.scenes
    cells = [results.ladders(scene).reshape(-1) for scene in scenes]
    failed = np.stack([(results.outcomes[:, places, variant] != 0).mean(axis=1) for places in cells], axis=1)
    figure = Figure(figsize=(1.6 + 0.9 * len(scenes), 0.6 + 0.24 * len(names)), layout="constrained")
    axes = figure.subplots()
    axes.pcolormesh(np.where(failed > 0, failed, np.nan), cmap="Reds", vmin=0.0, vmax=1.6)
    axes.invert_yaxis()
    for (row, column), share in np.ndenumerate(failed):
        counts = results.counts_of(names[row], "iterations")[cells[column], variant]
        solved = counts[results.outcomes[row, cells[column], variant] == 0]
        words = [f"{np.median(solved):g}"] if len(solved) else []
        words += [f"{share:.0%} fail"] if share else []
        axes.text(column + 0.5, row + 0.5, ", ".join(words), ha="center", va="center", fontsize=7.5)
    axes.set_xticks(np.arange(len(scenes)) + 0.5, scenes, parse_math=False)
    axes.xaxis.tick_top()
    axes.set_yticks(np.arange(len(names)) + 0.5, names, parse_math=False)
    axes.tick_params(length=0)
    return figure


def _name_curves(axes: Axes, names: Mapping[str, str]) -> None:
    """Write {colour: name} of the solid curves at the right edge, each joined with the end of its curve.

    Call it once the layout and both scales are final.
    """
    ends = {
        str(line.get_color()): np.asarray(line.get_xydata())[-1:] for line in axes.lines if line.get_linestyle() == "-"
    }
    heights = {  # Those of the ends of curves, over that of the panel.
        colour: float(axes.transLimits.transform(axes.transScale.transform(end))[0, 1])
        for colour, end in ends.items()
        if colour in names and len(end)
    }
    colours = sorted(heights, key=lambda colour: heights[colour])
    for colour, height in zip(colours, spread([heights[colour] for colour in colours]), strict=True):
        x, y = ends[colour][0].tolist()
        look: dict[str, Any] = {"color": colour, "fontsize": 7, "va": "center", "parse_math": False}
        arrow = {"arrowstyle": "-", "color": colour, "linewidth": 0.4, "shrinkA": 0, "shrinkB": 2}
        place = (_BESIDE, height)
        axes.annotate(names[colour], (x, y), place, textcoords="axes fraction", arrowprops=arrow, **look)


def spread(heights: Sequence[float]) -> list[float]:
    """Return places for names that are at least `ROOM` apart, as near to their rising heights as that allows.

    Names that would overlap stand together around the mean of their heights, and all stand beside the panel.
    """
    groups: list[tuple[float, int]] = []  # The mean of the heights less the room below, and the number of names
    for number, height in enumerate(heights):
        mean, count = height - number * ROOM, 1
        while groups and groups[-1][0] > mean:
            below, size = groups.pop()
            mean, count = (mean * count + below * size) / (count + size), count + size
        groups.append((mean, count))
    top = 1.0 - (len(heights) - 1) * ROOM
    levels = [min(max(mean, 0.0), top) for mean, count in groups for _ in range(count)]
    return [level + number * ROOM for number, level in enumerate(levels)]
