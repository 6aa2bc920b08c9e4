"""The figures of the reproduction of the paper, one matplotlib Figure each, by file name. Slow to import.

All are one or two columns of a journal wide, in one type size, and told apart by line and marker, so that they read
in grey. A formulation has the same pen in every figure.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator

from contactverif_paper.paper_data import (
    Convergence,
    Curve,
    Defects,
    Disk,
    DiskStudy,
    History,
    Member,
    Paper,
    Patch,
    Series,
)
from contactverif_reports.draw.scene_curves import choose_pen
from contactverif_reports.draw.scene_meshes import colour_scale, draw_bodies, magnifications

ONE_COLUMN, TWO_COLUMNS = 3.5, 7.2  # inches
_STYLE: dict[Any, Any] = {
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 3.2,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "hatch.linewidth": 0.4,
    "lines.linewidth": 1.1,
}
_EXACT: dict[str, Any] = {"color": "0.75", "linewidth": 2.2, "zorder": 1}
_TALLEST = 2.6  # inches, of a panel with a deformed mesh
_MEGA = 1e6  # pressures of Example 2 are drawn in it
_LOWEST = 1e-17  # where a number that is exactly zero is drawn on a logarithmic axis


@dataclass(frozen=True, slots=True)
class Drawing:
    """A figure that is yet to be drawn: its file name without suffix, what it shows, and how."""

    name: str
    figure: str
    caption: str
    draw: Callable[[], Figure]

    def drawn(self) -> Figure:
        """The figure, in the common style."""
        with matplotlib.rc_context(_STYLE):
            return self.draw()


def drawings(paper: Paper) -> tuple[Drawing, ...]:
    """All figures, in the order of the paper; ours, of the defects, at the end."""
    shown: dict[str, list[Patch]] = {}  # scenes of one figure side by side
    for patch in paper.patches:
        shown.setdefault(_number(patch.meshes), []).append(patch)
    of_the_paper = [
        *(drawing for patches in shown.values() for drawing in _of_patches(patches)),
        Drawing("fig30", "Fig. 30", _CAPTIONS["fig30"], lambda: _convergence(paper.convergence)),
        *(_of_disk(paper.disk) if paper.disk is not None else ()),
    ]
    return (*sorted(of_the_paper, key=lambda drawing: drawing.name), *_of_defects(paper.defects))


_CAPTIONS = {
    "fig30": "Case C: (a, b) residual against iterates, grey where it is roundoff; (c) the linear rate of the basic "
    "version over the penalty.",
    "fig38": "Example 2: (a) contact pressure; (b) close-up of its middle.",
    "why": "Example 2: the largest pressure (a) over the size of an element and (b) over the slope of the contact.",
    "tilt": "Defect 1: (a) force and (b) moment that are lost between slave and master when the slave is tilted.",
    "jump": "Defect 2: (a) what reaches the master while the end of an area of competence slides past a master node, "
    "and (b) the largest jump of a nodal force there.",
    "ends": "Defect 3: error of the stress in a uniform patch test whose slave overhangs the master inside a segment. "
    "Half a segment is an area of competence: nothing is cut there.",
}


def _of_patches(patches: Sequence[Patch]) -> tuple[Drawing, Drawing]:
    meshes, pressures = _number(patches[0].meshes), _number(patches[0].pressures)
    title = patches[0].title.partition(",")[0]
    of_meshes = of_pressures = ""
    if len(patches) > 1:  # the paper's letters: (a, b) of the first scene and (c, d) of the second
        kinds = [patch.title.partition(", ")[2] for patch in patches]
        of_meshes, of_pressures = (
            "; " + ", ".join(f"{_letters(figure)} {kind}" for figure, kind in zip(numbers, kinds, strict=True))
            for numbers in ([patch.meshes for patch in patches], [patch.pressures for patch in patches])
        )
    elif patches[0].close_up:
        of_pressures = "; (b) close-up"
    return (
        Drawing(
            f"fig{meshes}",
            f"Fig. {int(meshes)}",
            f"{title}: magnified penetrations{of_meshes}.",
            lambda: _meshes(patches),
        ),
        Drawing(
            f"fig{pressures}",
            f"Fig. {int(pressures)}",
            f"{title}: contact pressure over the exact one{of_pressures}.",
            lambda: _pressures(patches),
        ),
    )


def _of_disk(disk: Disk) -> tuple[Drawing, ...]:
    drawn = [
        Drawing("fig38", "Fig. 38", _CAPTIONS["fig38"], lambda: _disk_pressures(disk)),
        Drawing(
            "fig39", "Fig. 39", "Example 2: pressure of VTS-PPT minus that of VTS-ME.", lambda: _disk_difference(disk)
        ),
    ]
    study = disk.study
    if study is not None:
        drawn.append(Drawing("fig39-why", "ours", _CAPTIONS["why"], lambda: _why(study, disk)))
    return tuple(drawn)


def _of_defects(defects: Defects) -> tuple[Drawing, ...]:
    return (
        Drawing("defect-tilt", "ours", _CAPTIONS["tilt"], lambda: _tilt(defects)),
        Drawing("defect-jump", "ours", _CAPTIONS["jump"], lambda: _jump(defects)),
        Drawing("defect-ends", "ours", _CAPTIONS["ends"], lambda: _ends(defects)),
    )


def _number(figure: str) -> str:
    return figure.partition("(")[0].zfill(2)


def _letters(figure: str) -> str:
    return f"({figure.partition('(')[2]}"


def _figure(wide: float, high: float) -> Figure:
    return Figure(figsize=(wide, high), layout=ConstrainedLayoutEngine(w_pad=0.06, h_pad=0.05))


def _look(member: Member, n_points: int, **more: Any) -> dict[str, Any]:
    return choose_pen(member.pen).look(n_points) | {"markersize": 3.6, "markeredgewidth": 0.8, "zorder": 3} | more


def _legend(
    figure: Figure,
    members: Sequence[Member],
    *,
    exact: str = "",
    columns: int = 3,
    ends: Mapping[Member, str] = MappingProxyType({}),
) -> None:
    """Below all panels; `ends` is what did not end at a solution."""
    handles = [Line2D([], [], label=f"{member.legend}{ends.get(member, '')}", **_look(member, 1)) for member in members]
    if exact:
        handles.append(Line2D([], [], label=exact, **_EXACT))
    figure.legend(handles=handles, loc="outside lower center", ncols=min(columns, len(handles)))


def _panels(figure: Figure, count: int, **options: Any) -> list[Axes]:
    panels = list(figure.subplots(1, count, squeeze=False, **options)[0])
    if count > 1:
        for axes, letter in zip(panels, "abcdef", strict=False):
            axes.set_title(f"({letter})", loc="left", fontweight="bold")
    return panels


def _pressures(patches: Sequence[Patch]) -> Figure:
    """One panel a scene, or a scene and its close-up."""
    views: list[tuple[Patch, tuple[float, float] | None]] = [(patch, None) for patch in patches]
    if len(patches) == 1 and patches[0].close_up:
        views.append((patches[0], patches[0].close_up))
    figure = _figure(ONE_COLUMN if len(views) == 1 else TWO_COLUMNS, 2.9)
    for axes, (patch, view) in zip(_panels(figure, len(views), sharey=len(patches) > 1), views, strict=True):
        for curve in patch.curves:
            axes.plot(curve.x, curve.pressure, **_look(curve.member, len(curve.x)))
        axes.axhline(1.0, **_EXACT)
        axes.set_xlabel("x coordinate (length)")
        axes.set_ylabel("contact pressure / p (–)")
        axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        axes.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
        if len(patches) > 1:
            axes.label_outer()
        if view is not None:
            axes.set_ylim(_close(patch, *view))
    ends = {curve.member: _end(curve) for patch in patches for curve in patch.curves if _end(curve)}
    _legend(figure, _members(patches), exact="exact", columns=3 if len(views) == 1 else 6, ends=ends)
    return figure


def _close(patch: Patch, low: float, high: float) -> tuple[float, float]:
    """The close-up that the paper prints, made narrower where all lies well within it."""
    values = np.concatenate([curve.pressure for curve in patch.curves if curve.member.formulation != "nts"])
    reach = 1.25 * max(float(np.abs(values - 1).max()), 0.01)
    return max(low, 1 - reach), min(high, 1 + reach)


def _members(patches: Sequence[Patch]) -> list[Member]:
    return list(dict.fromkeys(curve.member for patch in patches for curve in patch.curves))


def _meshes(patches: Sequence[Patch]) -> Figure:
    """One panel a formulation and scene, the penetration magnified alike in all of a scene."""
    panels = [(patch, curve) for patch in patches for curve in patch.curves]
    across = 2 if len(panels) in (2, 4) else 3
    down = -(-len(panels) // across)
    wide, high = np.ptp(np.vstack([body.nodes for body in patches[0].solved.bodies]), axis=0)
    panel = min((TWO_COLUMNS - 0.9) / across, _TALLEST * wide / high)
    figure = _figure(across * panel + 0.9, down * (1.08 * panel * high / wide + 0.3) + 0.3)
    grid = figure.subplots(down, across, squeeze=False)
    for axes in grid.ravel():
        axes.set_axis_off()
    letters, remaining = iter("abcdefghij"), iter(grid.ravel())
    words: dict[str, None] = {}
    for patch in patches:
        scale, large = colour_scale(patch.solved), magnifications(patch.solved)
        words |= dict.fromkeys(one.words for one in large.values())
        own = [next(remaining) for _ in patch.curves]
        for axes, curve in zip(own, patch.curves, strict=True):
            draw_bodies(axes, patch.solved, curve.solution, large[curve.solution.formulation], scale)
            axes.set_title(f"({next(letters)}) {curve.member.legend}{_end(curve)}", loc="left")
        bar = figure.colorbar(scale, ax=own, shrink=0.8, aspect=16, pad=0.01)
        bar.set_label("−σₙ (force / length)")
        bar.locator = MaxNLocator(5, steps=[1, 2, 5, 10])
        bar.outline.set_linewidth(0.5)
    figure.supxlabel(" above; ".join(words) + " below" * (len(words) > 1), fontsize=7.5)
    return figure


def _end(curve: Curve) -> str:
    return "" if curve.solution.converged else f" ({curve.solution.end})"


def _convergence(convergence: Convergence) -> Figure:
    figure = _figure(TWO_COLUMNS, 3.0)
    panels = _panels(figure, 3, width_ratios=(1, 1, 1))
    pairs = zip(panels, convergence.histories, convergence.ratios, strict=False)
    for axes, histories, ratio in pairs:
        for history in histories:
            _draw_history(axes, history)
        _decades(axes)
        axes.set_xlim(-0.5, 16.5)
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
        axes.set_xlabel("iterate")
        title = "equal materials" if ratio == 1 else f"master {ratio:g} × as stiff"
        axes.set_title(title, fontsize=7.5)
    panels[0].set_ylabel("largest residual (force)")
    rates = panels[2]
    basic = convergence.histories[0][1].member
    rates.plot(convergence.stiffness, convergence.radius, **_EXACT)
    look = _look(basic, 1) | {"linestyle": "none"}
    rates.plot(convergence.stiffness, convergence.rate, **look)
    rates.set_xscale("log")
    rates.xaxis.set_minor_locator(NullLocator())
    rates.set_ylim(0, None)
    rates.set_xlabel("ε̂ / E (1 / length)")
    rates.set_ylabel("rate of the basic version (–)")
    _legend(
        figure,
        [history.member for history in convergence.histories[0]],
        exact="spectral radius of I − K⁻¹(basic) K(consistent)",
        columns=4,
    )
    return figure


def _draw_history(axes: Axes, history: History) -> None:
    shown = np.maximum(history.residuals, np.finfo(float).tiny)
    axes.plot(np.arange(len(shown)), shown, **_look(history.member, 1))
    axes.axhspan(0, history.floor, color="0.92", zorder=0, linewidth=0)


def _series(axes: Axes, series: Series, *, marks: bool = True) -> None:
    for member, values in zip(series.members, series.values, strict=True):
        axes.plot(series.at, values, **_look(member, 1 if marks else 1000))


def _logarithmic(axes: Axes, series: Series) -> None:
    """Zeros are drawn at the lower edge."""
    for member, values in zip(series.members, series.values, strict=True):
        axes.plot(series.at, np.maximum(values, _LOWEST), **_look(member, 1))
    _decades(axes)


def _decades(axes: Axes) -> None:
    """A logarithmic axis with few ticks."""
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(numticks=6))
    axes.yaxis.set_minor_locator(NullLocator())


def _tilt(defects: Defects) -> Figure:
    figure = _figure(TWO_COLUMNS, 2.9)
    force, moment = _panels(figure, 2)
    known = defects.force.at
    force.plot(known[1:], 1 - np.cos(known[1:]), **_EXACT)
    _logarithmic(force, defects.force)
    _logarithmic(moment, defects.moment)
    force.set_ylabel("|ΣR| / slave force (–)")
    moment.set_ylabel("|Σx×R| / (slave force × length) (–)")
    for axes in (force, moment):
        axes.set_xlabel("tilt θ (rad)")
    _legend(figure, defects.force.members, exact="1 − cos θ", columns=5)
    return figure


def _jump(defects: Defects) -> Figure:
    figure = _figure(TWO_COLUMNS, 2.9)
    sliding, jump = _panels(figure, 2)
    _series(sliding, defects.sliding, marks=False)
    sliding.set_xlabel("area's end past the master node (slave lengths)")
    sliding.set_ylabel("master force / slave force (–)")
    sliding.set_title(f"θ = {defects.sliding_tilt:g}", fontsize=7.5)
    sliding.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    jump.plot(defects.jump.at[1:], defects.jump_known[1:], **_EXACT)
    _logarithmic(jump, defects.jump)
    jump.set_xlabel("tilt θ (rad)")
    jump.set_ylabel("largest jump / slave force (–)")
    _legend(figure, defects.jump.members, exact="by formula, printed algorithm", columns=4)
    return figure


def _ends(defects: Defects) -> Figure:
    figure = _figure(TWO_COLUMNS, 2.9)
    (axes,) = _panels(figure, 1)
    _logarithmic(axes, defects.free_end)
    axes.set_xlabel("part of a slave segment that overhangs the master (–)")
    axes.set_ylabel("largest error of the stress / p (–)")
    _legend(figure, defects.free_end.members, columns=3)
    return figure


def _disk_pressures(disk: Disk) -> Figure:
    figure = _figure(TWO_COLUMNS, 3.0)
    whole, middle = _panels(figure, 2)
    for axes, end in ((whole, 0.5), (middle, 0.1)):
        axes.plot(disk.winkler_x, disk.winkler_pressure / _MEGA, **_EXACT)
        for curve in disk.curves:
            seen = (curve.x >= 0) & (curve.x <= end)
            axes.plot(curve.x[seen], curve.pressure[seen] / _MEGA, **_look(curve.member, int(seen.sum())))
        axes.set_xlabel("x along the interface (length)")
        axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    whole.set_ylabel("contact pressure (10⁶ force / length)")
    whole.set_xlim(0, 0.5)
    middle.set_xlim(0, 0.1)
    near = [curve.pressure[(curve.x >= 0) & (curve.x <= 0.1)] / _MEGA for curve in disk.curves]
    low, high = min(float(values.min()) for values in near), max(float(values.max()) for values in near)
    middle.set_ylim(low - 0.15 * (high - low), high + 0.25 * (high - low))
    _legend(figure, [curve.member for curve in disk.curves], exact="Hertz on springs ε̂", columns=5)
    return figure


def _disk_difference(disk: Disk) -> Figure:
    figure = _figure(ONE_COLUMN, 2.6)
    (axes,) = _panels(figure, 1)
    right = disk.difference_x >= 0
    axes.axhline(0.0, **_EXACT)
    axes.plot(disk.difference_x[right], disk.difference[right], color="black", linewidth=0.9, zorder=3)
    if (study := disk.study) is not None:
        right = study.difference_x >= 0
        axes.plot(study.difference_x[right], study.difference[right], color="0.45", linewidth=0.9, ls="--", zorder=2)
        handles = [
            Line2D([], [], color="black", linewidth=0.9, label="base meshes"),
            Line2D([], [], color="0.45", linewidth=0.9, linestyle="--", label="meshes twice as fine"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2)
    axes.set_xlim(0, None)
    axes.set_xlabel("x along the interface (length)")
    axes.set_ylabel("VTS-PPT − VTS-ME\n(force / length)")
    return figure


def _why(study: DiskStudy, disk: Disk) -> Figure:
    figure = _figure(TWO_COLUMNS, 2.8)
    meshes, slopes = _panels(figure, 2)
    meshes.axhline(disk.winkler[0] / _MEGA, **_EXACT)
    _series(meshes, Series(study.members, study.size, study.largest / _MEGA))
    meshes.set_xlabel("element size in the middle (length)")
    meshes.set_ylabel("largest pressure (10⁶ force / length)")
    slopes.axhline(0.0, **_EXACT)
    _series(slopes, study.slopes)
    slopes.set_xlabel("a/R over that of the paper (–)")
    slopes.set_ylabel("largest pressure over Hertz\non springs, less 1 (–)")
    for axes in (meshes, slopes):
        axes.set_xlim(0, None)
        axes.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    _legend(figure, study.members, exact="Hertz on springs ε̂", columns=4)
    return figure
