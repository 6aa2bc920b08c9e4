"""The figures of a bench: errors against the numbers, what an error costs, runtimes. Importing it is slow.

At most six formulations have a colour and a name, the reference among them; the others are grey. A figure with curves
is as wide as a phone, so that a page shows its letters as large as they are.
"""

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

from contactverif_reports import bench_costs
from contactverif_reports.bench_costs import REFERENCE
from contactverif_reports.bench_results import BEST, DEEPEST, ERRORS, RULE, VARIANTS, BenchResults
from contactverif_reports.plot.case_figures import save
from contactverif_reports.tables import decimal

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#8B4513")  # Okabe and Ito's, and brown.
_MARKERS = "os^vDP"
_AXES = {"evaluation": "evaluation / ms", "factorisation": "factorisation / ms"}
_WIDTH = 3.7  # The width of a figure with curves, in inches.
_GREY: dict[str, Any] = {"color": "0.75", "linewidth": 0.8, "zorder": 0}
_DOTTED: dict[str, Any] = {"color": "0.3", "linewidth": 1.0, "linestyle": ":", "zorder": 1}
_STYLE: dict[Any, Any] = {
    **dict.fromkeys(("font.size", "axes.titlesize", "legend.fontsize", "figure.labelsize"), 9),
    "axes.linewidth": 0.6,
    "lines.markersize": 4,
    "legend.frameon": False,
}
_N_COLUMNS = 2


def plot_bench(results: BenchResults, folder: Path) -> None:
    """Draw all figures of a bench as SVG into a folder."""
    for scene in results.scenes:
        if len(results.meshes_of(scene)) > 1:
            save(make_scene_figure(results, scene), folder / f"{scene}.svg")
            if len(results.formulations) > bench_costs.MOST_CURVES:
                save(make_each_figure(results, scene), folder / f"{scene}-each.svg")
    save(make_cost_figure(results), folder / "cost.svg")
    save(make_runtime_figure(results), folder / "runtimes.svg")
    save(make_starts_figure(results), folder / "starts.svg")


def highlights(results: BenchResults) -> dict[str, dict[str, Any]]:
    """Return {formulation: its pen}: the reference, and those that are the most exact on the first scene."""
    order = bench_costs.rank(results, results.scenes[0])
    order.sort(key=lambda name: name != REFERENCE)
    return {
        name: {"color": colour, "marker": marker}
        for name, colour, marker in zip(order, _COLOURS, _MARKERS, strict=False)
    }


def _panels(size: tuple[float, float], rows: int, columns: int, **options: Any) -> tuple[Figure, Any]:
    figure = Figure(figsize=size, layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, **options)
    for axes in panels.flat:
        axes.grid(color="0.93", linewidth=0.5)
    return figure, panels


def _label_plainly(*every: Any) -> None:
    """Write the numbers of a logarithmic axis at 1, 2 and 5 of each power of ten where there is room, else at fewer."""
    for axis in every:
        low, high = axis.get_view_interval()
        subs = (1.0, 2.0, 5.0) if high < 10 * low else (1.0, 3.0) if high < 40 * low else (1.0,)
        axis.set_major_locator(LogLocator(subs=subs))
        axis.set_major_formatter(FuncFormatter(lambda value, _: decimal(value, 3)))
        axis.set_minor_formatter(NullFormatter())
        axis.set_minor_locator(NullLocator())


@matplotlib.rc_context(_STYLE)
def make_scene_figure(results: BenchResults, scene: str) -> Figure:
    """Return the errors of a scene that are known, each against one evaluation and against one factorisation."""
    pens, errors = highlights(results), results.errors[:, results.ladders(scene).reshape(-1)]
    kinds = [kind for place, kind in enumerate(ERRORS) if np.isfinite(errors[..., place]).any()] or list(ERRORS)
    figure, panels = _panels((_WIDTH, 0.5 + 2.1 * len(kinds)), len(kinds), len(_AXES), sharex="col", sharey="row")
    for row, kind in zip(panels, kinds, strict=True):
        for axes, number in zip(row, _AXES, strict=True):
            axes.set(xscale="log", yscale="log")
            for name in sorted(results.formulations, key=lambda name: name in pens):
                _plot_curve(axes, results, scene, (name, kind, number), pens.get(name, _GREY))
        row[0].set_ylabel(f"error of the {kind}")
    best = np.median(results.best_pressure[results.ladders(scene)], axis=0)
    if (
        "pressure" in kinds and REFERENCE in results.formulations and (best > bench_costs.ROUNDOFF).all()
    ):  # Uniform pressures have no error.
        # What the mesh allows pressures, at the times of the reference.
        for axes, number in zip(panels[kinds.index("pressure")], _AXES, strict=True):
            x, _ = bench_costs.curve(results, REFERENCE, scene, "pressure", number)
            axes.plot(1e3 * x, best, **_DOTTED)
    for axes, label in zip(panels[-1], _AXES.values(), strict=True):
        axes.set_xlabel(label)
    for axes in panels.flat:
        _label_plainly(axes.xaxis, axes.yaxis)
    others = {"others": _GREY} if len(pens) < len(results.formulations) else {}
    _add_legend(figure, {**pens, **others, "best linear pressure": _DOTTED})
    return figure


def _add_legend(figure: Figure, looks: Mapping[str, Mapping[str, Any]], columns: int = 2) -> None:
    handles = [Line2D([], [], label=label, **{"mfc": "none", **look}) for label, look in looks.items()]
    figure.legend(handles=handles, loc="outside upper center", ncols=columns)


def _plot_curve(
    axes: Axes,
    results: BenchResults,
    scene: str,
    series: tuple[str, str, str],
    pen: Mapping[str, Any],
    variants: Sequence[int] = (0,),
) -> None:
    """Draw the curve of a formulation, an error and a number: at the penalty of the rule, or at the best of some."""
    name, kind, number = series
    x, errors = bench_costs.curve(results, name, scene, kind, number, variants)
    finite = np.isfinite(errors) & np.isfinite(x)
    axes.plot(1e3 * x[finite], errors[finite], **{"linewidth": 1.1, "markerfacecolor": "none", **pen})


@matplotlib.rc_context(_STYLE)
def make_each_figure(results: BenchResults, scene: str) -> Figure:
    """Return the error of the forces against one evaluation, a panel for each formulation, the reference in each."""
    n_rows = ceil(len(results.formulations) / _N_COLUMNS)
    figure, grid = _panels((_WIDTH, 1.0 + 1.15 * n_rows), n_rows, _N_COLUMNS, sharex=True, sharey=True)
    panels = grid.reshape(-1)
    looks: dict[str, dict[str, Any]] = {
        f"{RULE.penalty:g} E/h": {"color": _COLOURS[1], "marker": "o"},
        "best penalty": {"color": _COLOURS[1], "linestyle": "--"},
        REFERENCE: {"color": "0.5", "zorder": 1},
    }
    solid, dashed, grey = looks.values()
    for axes, name in zip(panels, results.formulations, strict=False):
        axes.set(xscale="log", yscale="log")
        if REFERENCE in results.formulations:
            _plot_curve(axes, results, scene, (REFERENCE, "forces", "evaluation"), grey)
        _plot_curve(axes, results, scene, (name, "forces", "evaluation"), solid)
        _plot_curve(axes, results, scene, (name, "forces", "evaluation"), dashed, BEST)
        axes.set_title(name, pad=2, parse_math=False)
    _label_plainly(panels[0].xaxis, panels[0].yaxis)
    for axes in panels[len(results.formulations) :]:
        axes.set_visible(False)
    figure.supxlabel("evaluation / ms")
    figure.supylabel("error of the forces")
    _add_legend(figure, looks)
    return figure


@matplotlib.rc_context(_STYLE)
def make_cost_figure(results: BenchResults) -> Figure:
    """Return what two errors on the first scene cost: ratios of evaluation and factorisation, and linear systems."""
    scene = results.scenes[0]
    targets = results.targets[scene][:2]
    order = bench_costs.rank(results, scene)[::-1]
    costs = [bench_costs.costs_at(results, scene, target) for target in targets]
    figure, grid = _panels((5.2, 1.3 + 0.22 * len(order)), 1, 3, sharey=True)
    (evaluation, systems, factorisation), looks = grid[0], {}
    for target, each, colour, marker in zip(targets, costs, _COLOURS, _MARKERS, strict=False):
        for axes, number in zip((evaluation, factorisation), _AXES, strict=True):
            ratios = bench_costs.ratios_at(results, scene, target, number)
            _plot_ratios(axes, ratios, order, {"color": colour, "marker": marker})
        finite = [(count, place) for place, name in enumerate(order) if (count := each[name].middle("systems")) < inf]
        look: dict[str, Any] = {"color": colour, "marker": marker, "linestyle": "none", "mfc": "none"}
        systems.plot(*zip(*finite, strict=True), **look)
        looks[f"error of {bench_costs.format_share(target)}"] = look
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
    _add_legend(figure, looks)
    return figure


def _plot_ratios(axes: Axes, ratios: Mapping[str, bench_costs.Ratio], order: list[str], pen: dict[str, Any]) -> None:
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
                seconds = np.sort(1e3 * bench_costs.runtimes(results, name, scene, number))
                finite = seconds[np.isfinite(seconds)]
                pen = {"color": pens[name]["color"], "linewidth": 1.2} if name in pens else _GREY
                axes.step(finite, np.arange(1, len(finite) + 1) / len(seconds), where="post", **pen)
            _label_plainly(axes.xaxis)
        row[0].set_ylabel(scene)
    for axes, label in zip(panels[-1], ("all evaluations / ms", "all factorisations / ms"), strict=True):
        axes.set_xlabel(label)
    figure.supylabel("share of errors and instances that are reached", fontsize=8.5)
    others = {"others": _GREY} if len(pens) < len(results.formulations) else {}
    _add_legend(figure, {name: {"color": pen["color"]} for name, pen in pens.items()} | others, columns=3)
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
