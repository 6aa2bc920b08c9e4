"""The names of curves beside their ends, in place of a legend."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from contactverif.contract.arrays import FloatArray

ROOM = 0.1  # The least distance of two names, over the height of a panel.
_BESIDE = 1.04  # The place of names, over the width of a panel.


def name_curves(axes: Axes, names: Mapping[str, str]) -> None:
    """Write {colour: name} of the solid curves at the right edge, each joined with the end of its curve.

    Call it once the layout and both scales are final.
    """
    ends = {
        str(line.get_color()): np.asarray(line.get_xydata())[-1:] for line in axes.lines if line.get_linestyle() == "-"
    }
    heights = {colour: _height(axes, end) for colour, end in ends.items() if colour in names and len(end)}
    colours = sorted(heights, key=lambda colour: heights[colour])
    for colour, height in zip(colours, spread([heights[colour] for colour in colours]), strict=True):
        x, y = ends[colour][0].tolist()
        axes.annotate(
            names[colour],
            (x, y),
            (_BESIDE, height),
            textcoords="axes fraction",
            color=colour,
            fontsize=7,
            va="center",
            parse_math=False,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.4, "shrinkA": 0, "shrinkB": 2},
        )


def _height(axes: Axes, end: FloatArray) -> float:
    """Return the height of the end (1, 2) of a curve, over that of the panel."""
    return float(axes.transLimits.transform(axes.transScale.transform(end))[0, 1])


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
