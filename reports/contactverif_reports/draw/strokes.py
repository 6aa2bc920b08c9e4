"""How a surface and its forces look in a figure: lines, markers, hatches, numbers, arrows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Surface

_NUMBERED = 20  # nodes a side that get their numbers
_LABELLED = 10  # segments a side that get their lengths, nodes that get their forces
_ROOM = 0.04  # of the picture; a shorter segment gets no label


@dataclass(frozen=True, slots=True)
class Pen:
    """How one surface is told from the other, without colours."""

    name: str
    color: str
    style: str
    marker: str
    fill: str
    hatch: str


SLAVE = Pen("slave", "black", "solid", "o", "black", "///")
MASTER = Pen("master", "0.4", "dashed", "s", "white", "\\\\\\")


def draw_surface(
    axes: Axes, surface: Surface, nodes: FloatArray, labels: Sequence[str], pen: Pen, *, body: float, side: float
) -> None:
    """Segments, nodes and a hatched strip of the body, `body` wide.

    `labels` are the lengths of the segments; they and the node numbers lie towards the body (side = 1) or away (−1).
    """
    ends = nodes[surface.segments]  # (n_segments, 2, 2)
    lefts = _lefts(surface, nodes)
    inside = (nodes + body * lefts)[surface.segments]
    strips = np.concatenate([ends, inside[:, ::-1]], axis=1)  # (n_segments, 4, 2)
    axes.add_collection(
        PolyCollection(list(strips), facecolor="none", edgecolor="0.82", linewidth=0, hatch=pen.hatch, zorder=1)
    )
    axes.add_collection(LineCollection(list(ends), colors=pen.color, linewidths=1.6, linestyles=pen.style, zorder=3))
    few = len(surface.nodes) <= _NUMBERED
    look: dict[str, Any] = {
        "color": pen.color,
        "marker": pen.marker,
        "markerfacecolor": pen.fill,
        "markersize": 5.5 if few else 3,
    }
    axes.plot(*nodes[surface.nodes].T, linestyle="none", zorder=4, **look)
    axes.plot([], [], linestyle=pen.style, label=f"{pen.name} (body hatched {pen.hatch[0]})", **look)
    size = float(np.ptp(nodes, axis=0).max())
    for node in _spread(surface, nodes, size):
        style: dict[str, Any] = {"fontsize": 8 if few else 6, "color": pen.color, "zorder": 5}
        _write(axes, str(node), nodes[node], 11 * side * lefts[node], **style)
    if len(surface) > _LABELLED:
        return
    for (first, second), label in zip(surface.segments.tolist(), labels, strict=True):
        if np.linalg.norm(nodes[second] - nodes[first]) > _ROOM * size:
            offset = 9 * side * (lefts[first] + lefts[second]) / 2
            style = {"fontsize": 7, "style": "italic", "color": "0.35", "zorder": 4.5}
            _write(axes, label, (nodes[first] + nodes[second]) / 2, offset, **style)


def draw_arrows(
    axes: Axes, nodes: FloatArray, forces: FloatArray | None, exact: FloatArray | None, *, longest: float
) -> None:
    """Nodal forces of one scale: found, thin and black, over exact, broad and light; in numbers where there are few."""
    pairs = [
        None if values is None else np.asarray(values, dtype=np.float64).reshape(-1, 2) for values in (exact, forces)
    ]
    given = [values for values in pairs if values is not None]
    largest = max((float(np.linalg.norm(values, axis=1).max()) for values in given), default=0.0)
    if not (np.isfinite(largest) and largest > 0):
        return
    looks: tuple[dict[str, Any], dict[str, Any]] = (
        {"color": "0.72", "width": 0.010, "headwidth": 2.2, "headlength": 2.4, "headaxislength": 2.4},
        {"color": "black", "width": 0.003},
    )
    for values, look, label in zip(pairs, looks, ("exact force", "force found"), strict=True):
        if values is not None:
            arrows = values * (longest / largest)
            axes.quiver(*nodes.T, *arrows.T, angles="xy", scale_units="xy", scale=1, zorder=6, label=label, **look)
            axes.plot(*(nodes + 1.15 * arrows).T, linestyle="none")  # so that the axes reach beyond the tips
    if len(nodes) > 2 * _LABELLED:
        return
    for node in range(len(nodes)):
        sizes = [float(np.linalg.norm(values[node])) for values in given]
        tip = max((values[node] for values in given), key=lambda force: float(force @ force))
        reach = float(np.linalg.norm(tip))
        if reach > 0:
            said = f"{sizes[-1]:.3g}"
            if abs(sizes[0] - sizes[-1]) > 1e-6 * largest:
                digits = next(d for d in range(3, 17) if f"{sizes[-1]:.{d}g}" != f"{sizes[0]:.{d}g}")
                said = f"{sizes[-1]:.{digits}g} ≠ {sizes[0]:.{digits}g}"
            place = nodes[node] + tip * (longest / largest)
            _write(axes, said, place, 7 * tip / reach, fontsize=7, color="black", zorder=7)


def _write(axes: Axes, words: str, place: FloatArray, offset: FloatArray, **style: Any) -> None:
    """Words beside a place, `offset` in points."""
    axes.annotate(
        words,
        (float(place[0]), float(place[1])),
        xytext=(float(offset[0]), float(offset[1])),
        textcoords="offset points",
        ha="center",
        va="center",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8},
        **style,
    )


def _spread(surface: Surface, nodes: FloatArray, size: float) -> list[int]:
    """The nodes that get their numbers: at most about twenty, none on top of the last."""
    chosen: list[int] = []
    numbers = surface.nodes.tolist()
    for node in numbers[:: -(-len(numbers) // _NUMBERED)]:
        if not chosen or np.linalg.norm(nodes[node] - nodes[chosen[-1]]) > _ROOM / 2 * size:
            chosen.append(node)
    return chosen


def _lefts(surface: Surface, nodes: FloatArray) -> FloatArray:
    """(n_nodes, 2) unit vectors into the body, the mean of the adjacent segments; zero off this surface."""
    chords = nodes[surface.segments[:, 1]] - nodes[surface.segments[:, 0]]
    chords = chords / np.maximum(np.linalg.norm(chords, axis=1, keepdims=True), np.finfo(float).tiny)
    lefts = np.zeros_like(nodes)
    for end in (0, 1):
        np.add.at(lefts, surface.segments[:, end], np.column_stack([-chords[:, 1], chords[:, 0]]))
    lengths = np.linalg.norm(lefts, axis=1, keepdims=True)
    units: FloatArray = np.divide(lefts, lengths, out=np.zeros_like(lefts), where=lengths > 1e-9)
    return units
