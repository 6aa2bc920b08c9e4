"""The look of a surface and its forces in a figure: lines, markers, hatches, numbers, arrows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Surface

_NUMBERED = 20  # About so many nodes a side get their numbers.
_LABELLED = 10  # Lengths of segments and sizes of forces are written for at most so many a side.
_ROOM = 0.04  # A segment shorter than this share of the picture gets no label.


@dataclass(frozen=True, slots=True)
class Pen:
    """The look that tells one surface from the other, without colours."""

    name: str
    color: str
    style: str
    marker: str
    fill: str
    hatch: str

    def marks(self, size: float) -> dict[str, Any]:
        """Return the arguments of a plot that draws nodes of that size in points."""
        return {"color": self.color, "marker": self.marker, "markerfacecolor": self.fill, "markersize": size}


SLAVE = Pen("slave", "black", "solid", "o", "black", "///")
MASTER = Pen("master", "0.4", "dashed", "s", "white", "\\\\\\")


_BROAD = {"width": 0.010, "headwidth": 2.2, "headlength": 2.4, "headaxislength": 2.4}
_ARROWS: dict[str, dict[str, Any]] = {
    "exact": {"color": "0.72", "label": "exact force", **_BROAD},
    "formulation": {"color": "black", "width": 0.003, "label": "force of the formulation"},
}


def draw_surface(
    axes: Axes, surface: Surface, nodes: FloatArray, labels: Sequence[str], pen: Pen, *, body: float, side: float
) -> None:
    """Draw segments with the texts of their lengths, nodes, and a hatched strip of the body that is `body` wide.

    `side` is 1 for labels and node numbers on the side of the body, −1 for the other side.
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
    marks = pen.marks(5.5 if few else 3)
    axes.plot(*nodes[surface.nodes].T, linestyle="none", zorder=4, **marks)
    axes.plot([], [], linestyle=pen.style, label=f"{pen.name} (body hatched {pen.hatch[0]})", **marks)
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
    """Draw nodal forces as arrows of one scale: those of the formulation, thin, over the exact ones, broad and light.

    `longest` is the length of the longest arrow; forces of None are not drawn.
    """
    by_kind = {
        kind: np.asarray(values, dtype=np.float64).reshape(-1, 2)
        for kind, values in (("exact", exact), ("formulation", forces))
        if values is not None
    }
    largest = max((float(np.linalg.norm(values, axis=1).max()) for values in by_kind.values()), default=0.0)
    if not (np.isfinite(largest) and largest > 0):
        return
    for kind, values in by_kind.items():
        arrows = values * (longest / largest)
        axes.quiver(*nodes.T, *arrows.T, angles="xy", scale_units="xy", scale=1, zorder=6, **_ARROWS[kind])
        axes.plot(*(nodes + 1.15 * arrows).T, linestyle="none")  # The axes reach beyond the tips.
    if len(nodes) <= 2 * _LABELLED:
        _write_sizes(axes, nodes, list(by_kind.values()), longest / largest, 1e-6 * largest)


def _write_sizes(axes: Axes, nodes: FloatArray, forces: list[FloatArray], scale: float, slack: float) -> None:
    """Write the size of each force at the tip of its arrow, and the exact one if it differs by more than `slack`."""
    for node, at_node in enumerate(np.stack(forces, axis=1)):  # (n_kinds, 2), the exact force first
        sizes = np.linalg.norm(at_node, axis=1).tolist()
        tip, reach = at_node[int(np.argmax(sizes))], max(sizes)
        if reach > 0:
            words = size_in_words(sizes[-1], sizes[0], slack)
            offset = (3 + 4 * (1 + words.count("\n"))) * tip / reach
            _write(axes, words, nodes[node] + tip * scale, offset, fontsize=7, color="black", zorder=7)


def size_in_words(size: float, exact: float, slack: float) -> str:
    """Return the size of a force; if the exact one differs, both, with the digits that tell them apart."""
    if abs(exact - size) <= slack:
        return f"{size:.3g}"
    digits = next(count for count in range(3, 17) if f"{size:.{count}g}" != f"{exact:.{count}g}")
    return f"{size:.{digits}g}\nexact {exact:.{digits}g}"


def _write(axes: Axes, words: str, place: FloatArray, offset: FloatArray, **style: Any) -> None:
    """Write words beside a place; `offset` is in points."""
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
    """Return the nodes that get their numbers: about twenty at most, none on top of the one before."""
    numbered: list[int] = []
    numbers = surface.nodes.tolist()
    for node in numbers[:: -(-len(numbers) // _NUMBERED)]:
        if not numbered or np.linalg.norm(nodes[node] - nodes[numbered[-1]]) > _ROOM / 2 * size:
            numbered.append(node)
    return numbered


def _lefts(surface: Surface, nodes: FloatArray) -> FloatArray:
    """Return (n_nodes, 2) unit vectors into the body, the mean of the adjacent segments; zero off this surface."""
    chords = nodes[surface.segments[:, 1]] - nodes[surface.segments[:, 0]]
    chords = chords / np.maximum(np.linalg.norm(chords, axis=1, keepdims=True), np.finfo(float).tiny)
    lefts = np.zeros_like(nodes)
    for end in (0, 1):
        np.add.at(lefts, surface.segments[:, end], np.column_stack([-chords[:, 1], chords[:, 0]]))
    lengths = np.linalg.norm(lefts, axis=1, keepdims=True)
    units: FloatArray = np.divide(lefts, lengths, out=np.zeros_like(lefts), where=lengths > 1e-9)
    return units
