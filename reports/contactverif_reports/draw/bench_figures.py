"""The figures of a bench: error against time, cost at an error of 1 %, performance profiles. Slow to import.

Failed runs are drawn at the upper edge, and formulations that never reach an error in a column of their own: nothing is
left out. Formulations differ by colour, marker and line, the same in all figures of a bench.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, inf
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from contactverif_reports.bench.bench_text import COST_PICTURE, PROFILE_PICTURE, picture_of
from contactverif_reports.bench.results import BenchResults, Outcome
from contactverif_reports.bench.work_precision import (
    REFERENCE,
    SENTENCE_TARGET,
    PairProfile,
    cost_ratio,
    pair_profiles,
    pareto_front,
)
from contactverif_reports.draw.bench_multiples import hide_empty_panels, make_multiples_figure
from contactverif_reports.draw.case_figure import save

_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8B4513")  # Okabe and Ito's, and brown.
_MARKERS = "os^vDPX"
_DASHES = ("-", "--", ":")
_LEAST_ERROR = 1e-12  # Errors below are roundoff, and are drawn here.
_MOST_IN_A_PANEL = 6  # More curves than these cannot be told apart.
_EDGE = 0.07  # Failed runs are drawn above the largest error, by this share of the range of log errors, and a half.
_COST_TICKS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
_STYLE: dict[Any, Any] = {"font.size": 8.0, "axes.titlesize": 8.5, "axes.linewidth": 0.6, "lines.markersize": 4.0}


def draw_bench(results: BenchResults, folder: Path) -> None:
    """Draw all figures of a bench as SVG into a folder: one for each scene, the cost, and the profiles."""
    for scene in results.scenes:
        save(make_work_precision_figure(results, scene), folder / picture_of(scene))
    if results.scenes and len(results.formulations) > 1 and REFERENCE in results.formulations:
        save(make_cost_figure(results), folder / COST_PICTURE)
    profile = make_profile_figure(results)
    if profile is not None:
        save(profile, folder / PROFILE_PICTURE)


def make_work_precision_figure(results: BenchResults, scene: str, kind: str = "forces") -> Figure:
    """Return error against time of one scene with the Pareto front.

    There is a panel for each penalty; of many formulations there is a panel for each instead.
    """
    stiffnesses, n_names = results.stiffnesses_of(scene), len(results.formulations)
    low, high = _error_range(results, scene, kind)
    edge = 1.5 * high * (high / low) ** _EDGE
    if n_names > _MOST_IN_A_PANEL:
        penalties = {stiffness: results.penalty_name(scene, stiffness) for stiffness in stiffnesses}
        return make_multiples_figure(results, scene, kind, (low / 2, edge, edge**2 / high), penalties)
    with matplotlib.rc_context(_STYLE):
        n_columns = min(6, max(2, 2 * len(stiffnesses)))
        legend = 0.19 * ceil(n_names / n_columns) + 0.2
        figure = Figure(figsize=(1 + 2.7 * len(stiffnesses), 2.9 + legend), layout="constrained")
        panels = figure.subplots(1, len(stiffnesses), squeeze=False, sharey=True)[0]
        for axes, stiffness in zip(panels, stiffnesses, strict=True):
            axes.set(xscale="log", yscale="log", ylim=(low / 2, edge**2 / high), xlabel="time of the solution / ms")
            axes.set_title(results.penalty_name(scene, stiffness))
            axes.axhline(edge, color="0.8", linewidth=0.6)
            _draw_runs(axes, results, results.cells_of(scene, stiffness), kind, edge)
            _label_times(axes)
            axes.grid(color="0.92", linewidth=0.5)
        panels[0].set_ylabel(f"error of the {kind}")
        panels[0].annotate(
            "no solution", (0.01, edge), xycoords=("axes fraction", "data"), va="bottom", fontsize=6.5, color="0.4"
        )
        handles = [Line2D([], [], label=name, **pen) for name, pen in _pens(results)]
        handles.append(Line2D([], [], color="0.75", linewidth=4, label="Pareto front"))
        figure.legend(handles=handles, loc="outside lower center", ncols=n_columns, frameon=False, fontsize=7.5)
    return figure


def make_cost_figure(results: BenchResults) -> Figure:
    """Return the time to an error of 1 % in the forces over that of the reference, by formulation and scene."""
    names = [name for name in results.formulations if name != REFERENCE]
    ratios = _cost_ratios(results, names)
    low, high = _cost_range(ratios)
    order = sorted(names, key=lambda name: _rank([row[name] for row in ratios.values()]), reverse=True)
    with matplotlib.rc_context(_STYLE | {"font.size": 10.0, "lines.markersize": 6.5}):
        figure = Figure(figsize=(5.4, 1.5 + 0.25 * len(order)), layout="constrained")
        axes = figure.subplots()
        width = (high / low) ** 0.03  # One place in the column of those that never get there.
        places = [high * width ** (2 + place) for place in range(len(ratios))]
        end = places[-1] * width**2
        axes.axvspan(high * width**0.5, end, color="0.93")
        axes.axvline(1.0, color="0.35", linewidth=0.9)
        for (scene, row), never, marker, colour in zip(ratios.items(), places, _MARKERS, _COLOURS, strict=False):
            values = np.array([row[name] for name in order])  # NaN, where the reference fails, is not drawn.
            values = np.where(values == inf, never, values)
            hollow: dict[str, Any] = {"markerfacecolor": "none", "linestyle": "none", "label": scene}
            axes.plot(values, range(len(order)), marker=marker, color=colour, **hollow)
        axes.set(xscale="log", xlim=(low, end), ylim=(-0.7, len(order) - 0.3))
        ticks = [tick for tick in _COST_TICKS if low <= tick <= high]
        axes.set_xticks([*ticks, (places[0] * places[-1]) ** 0.5], [*map("{:g}".format, ticks), "never"])
        axes.minorticks_off()
        axes.set_yticks(range(len(order)), order, parse_math=False)
        axes.grid(color="0.92", linewidth=0.5)
        axes.set_xlabel(f"time to an error of {SENTENCE_TARGET:.0%} in the forces, {REFERENCE} = 1")
        figure.legend(loc="outside upper center", ncols=4, frameon=False, handletextpad=0.1, columnspacing=1.2)
    return figure


def make_profile_figure(results: BenchResults) -> Figure | None:
    """Return the performance profile of each formulation beside the reference on random scenes; None without any."""
    profiles = pair_profiles(results)
    if not profiles:
        return None
    n_columns = min(3, len(profiles))
    n_rows = ceil(len(profiles) / n_columns)
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(0.5 + 1.5 * n_columns, 0.7 + 1.25 * n_rows), layout="constrained")
        panels = figure.subplots(n_rows, n_columns, squeeze=False, sharex=True, sharey=True)
        furthest = _furthest(profiles)
        for axes, profile in zip(panels.reshape(-1), profiles, strict=False):
            for factors, style in ((profile.reference_factors, "k--"), (profile.factors, "C3-")):
                axes.step(*_steps(factors, furthest), style, where="post", linewidth=1.2)
            axes.set(xscale="log", xlim=(0.95, furthest), ylim=(-0.03, 1.05))
            axes.set_title(profile.formulation, fontsize=7.5)
            axes.grid(color="0.92", linewidth=0.5)
        hide_empty_panels(panels.reshape(-1), len(profiles), n_columns)
        figure.supxlabel("within this factor of the faster one", fontsize=8)
        figure.supylabel("share of the random scenes", fontsize=8)
        handles = [Line2D([], [], color="C3", label="formulation"), Line2D([], [], color="k", ls="--", label=REFERENCE)]
        figure.legend(handles=handles, loc="outside upper center", ncols=2, frameon=False)
    return figure


def _cost_ratios(results: BenchResults, names: list[str]) -> dict[str, dict[str, float]]:
    """Return {scene: {formulation: time over that of the reference}}."""
    return {scene: {name: cost_ratio(results, name, scene) for name in names} for scene in results.scenes}


def _cost_range(ratios: dict[str, dict[str, float]]) -> tuple[float, float]:
    """Return the range of the axis, which holds all finite ratios and 1."""
    finite = [ratio for row in ratios.values() for ratio in row.values() if np.isfinite(ratio)] or [1.0]
    return min(0.5, min(finite) / 1.3), max(2.0, max(finite) * 1.3)


def _draw_runs(axes: Axes, results: BenchResults, cells: Any, kind: str, edge: float) -> None:
    """Draw all runs of a panel, those without a solution at the edge, and the Pareto front behind them."""
    times_of_all, errors_of_all = [], []
    for row, (name, pen) in enumerate(_pens(results)):
        times = 1e3 * results.fastest[row, cells, -1]
        solved = results.outcomes[row, cells] == Outcome.SOLVED
        errors = results.errors_of(name, kind)[cells]
        clipped = np.clip(errors, _LEAST_ERROR, None)
        axes.plot(times[solved], clipped[solved], linewidth=0.8, **pen)
        cross = {**pen, "marker": "x", "linestyle": "none"}
        crashed = 1e3 * np.nanmax(results.fastest[:, cells, -1], initial=1e-3)  # A plugin that crashed has no time.
        axes.plot(np.where(np.isnan(times), crashed, times)[~solved], np.full((~solved).sum(), edge), **cross)
        times_of_all.append(np.where(solved, times, inf))
        errors_of_all.append(np.where(np.isnan(errors), inf, clipped))
    times, errors = np.concatenate(times_of_all), np.concatenate(errors_of_all)
    front = np.flatnonzero(pareto_front(times, errors))
    front = front[np.argsort(times[front])]
    axes.step(times[front], errors[front], where="post", color="0.82", linewidth=4, zorder=0)


def _label_times(axes: Axes) -> None:
    """Write times as plain numbers, at 1, 2 and 5 of each power of ten where there is room."""
    low, high = axes.get_xlim()
    steps = (1.0, 2.0, 5.0) if high < 30 * low else (1.0, 3.0) if high < 300 * low else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=steps))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _pens(results: BenchResults) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the name of each formulation with its colour, marker and line."""
    n = len(_COLOURS)
    for place, name in enumerate(results.formulations):
        look = {"color": _COLOURS[place % n], "marker": _MARKERS[(place + place // n) % n]}
        yield name, {**look, "linestyle": _DASHES[place // n % len(_DASHES)], "markerfacecolor": "none"}


def _error_range(results: BenchResults, scene: str, kind: str) -> tuple[float, float]:
    errors = np.array([results.errors_of(name, kind)[results.cells_of(scene)] for name in results.formulations])
    finite = errors[np.isfinite(errors)]
    return (max(_LEAST_ERROR, float(finite.min())), float(finite.max())) if len(finite) else (1e-3, 1.0)


def _rank(ratios: list[float]) -> tuple[int, float]:
    """Return what formulations are sorted by: how often they never get there, then the mean of log ratio."""
    there = [ratio for ratio in ratios if np.isfinite(ratio)]
    return sum(ratio == inf for ratio in ratios), float(np.log(there).mean()) if there else inf


def _furthest(profiles: tuple[PairProfile, ...]) -> float:
    factors = np.concatenate([part for p in profiles for part in (p.factors, p.reference_factors)])
    return max(3.0, 1.5 * float(factors[np.isfinite(factors)].max(initial=1.0)))


def _steps(factors: Any, furthest: float) -> tuple[list[float], list[float]]:
    """Return the places and heights of the steps of a profile."""
    finite = np.sort(factors[np.isfinite(factors)])
    heights = np.arange(1, len(finite) + 1) / len(factors)
    return [0.9, *finite, furthest], [0.0, *heights, heights[-1] if len(heights) else 0.0]
