"""The strips of the slave that see one master segment each: the search that several strangers share.

A strip is a part of a slave segment between projections of master nodes along the slave's normal. Where master segments
lie behind one another, a strip sees the nearest. A strip is a row of integers, so that a pairing may hold it.
"""

from itertools import pairwise
from typing import Any

import numpy as np


def cross(p: Any, q: Any) -> Any:
    return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]


def dot(p: Any, q: Any) -> Any:
    return p[..., 0] * q[..., 0] + p[..., 1] * q[..., 1]


def visible_strips(slave: Any, master: Any, x: Any) -> Any:
    """Return (n, 4) integers: slave segment, master segment, and the nodes that cut the strip below and above.

    `slave` and `master` are the nodes (n, 2) of segments. −1 in place of a node stands for an end of the slave segment.
    """
    strips = [strip for number in range(len(slave)) for strip in _strips_of(number, slave[number], master, x)]
    return np.array(strips, dtype=np.int64).reshape(-1, 4)


def _strips_of(number: int, ends: Any, master: Any, x: Any) -> list[list[int]]:
    a, along = x[ends[0]], x[ends[1]] - x[ends[0]]
    offset = x[master] - a
    places, heights = dot(offset, along) / dot(along, along), cross(along, offset)
    second, first = places[:, 1], places[:, 0]  # A master segment that faces the slave runs the other way.
    candidates = np.flatnonzero((second < first) & (second < 1) & (first > 0))
    marks = {0.0: -1, 1.0: -1}
    for segment in candidates:
        marks.update({place: int(node) for place, node in zip(places[segment], master[segment], strict=True)
                      if 0 < place < 1})  # fmt: skip
    cuts = sorted(marks)
    strips: list[list[int]] = []
    for low, high in pairwise(cuts):
        middle = (low + high) / 2
        over = candidates[(second[candidates] <= middle) & (middle <= first[candidates])]
        if not len(over):
            continue
        share = (middle - first[over]) / (second[over] - first[over])
        nearest = int(over[np.argmin(np.abs((1 - share) * heights[over, 0] + share * heights[over, 1]))])
        if strips and strips[-1][1] == nearest and strips[-1][3] == marks[low] != -1:
            strips[-1][3] = marks[high]
        else:
            strips.append([number, nearest, marks[low], marks[high]])
    return strips


def share_of(node: Any, end: int, ends: Any, x: Any) -> Any:
    """Return where nodes (n,) cut segments between the nodes `ends` (n, 2), from 0 to 1.

    Where a node is −1, that is `end`: 0 or 1. Positions x may have leading axes of a batch, and may be complex.
    """
    a = x[..., ends[:, 0], :]
    along = x[..., ends[:, 1], :] - a
    place = dot(x[..., np.maximum(node, 0), :] - a, along) / dot(along, along)
    return np.where(node < 0, float(end), place)


def add_at(forces: Any, nodes: Any, parts: Any) -> None:
    """Add parts (..., n, 2) to the forces (..., n_nodes, 2) of nodes (n,), some of which may be the same."""
    np.add.at(forces, (..., nodes, slice(None)), parts)
