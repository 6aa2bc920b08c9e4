"""The strips of the slave that see one master segment each: the search that several strangers share.

A strip is a part of a slave segment between projections of master nodes along the slave's normal. Where master segments
lie behind one another, a strip sees the nearest, and none farther away than four of the longest segments: that may be
another body behind the slave's. A strip is a row of integers, so that a pairing may hold it.
"""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np


def cross(p: Any, q: Any) -> Any:
    return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]


def dot(p: Any, q: Any) -> Any:
    return p[..., 0] * q[..., 0] + p[..., 1] * q[..., 1]


def visible_strips(slave: Any, master: Any, x: Any, snap: float = 0.0) -> Any:
    """Return (n, 4) integers: slave segment, master segment, and the nodes that cut the strip below and above.

    `slave` and `master` are the nodes (n, 2) of segments. −1 in place of a node stands for an end of the slave segment.
    A node cuts no strip nearer to an end than the share `snap` of the segment, and no strip is as narrow as that.
    """
    a = x[slave[:, 0]][:, None, None]
    along = x[slave[:, 1]][:, None, None] - a
    offset = x[master] - a  # (n_slave, n_master, 2, 2)
    places, heights = dot(offset, along) / dot(along, along), cross(along, offset)
    first, second = places[..., 0], places[..., 1]  # A master segment that faces the slave runs the other way.
    lengths = [np.linalg.norm(np.diff(x[side], axis=1)[:, 0], axis=1) for side in (slave, master)]
    reach = 4 * np.concatenate(lengths).max() * lengths[0][:, None]  # Heights count over the length of the slave's.
    near = np.abs(heights).min(axis=2) <= reach
    faces = near & (second < first - snap) & (dot(x[master[:, 1]] - x[master[:, 0]], along[:, 0]) < 0)
    candidates: list[list[Candidate]] = [[] for _ in slave]
    for number, segment in np.argwhere(faces & (second < 1) & (first > 0)).tolist():
        ends = zip(master[segment].tolist(), places[number, segment].tolist(), strict=True)
        candidates[number].append(Candidate(segment, tuple(ends), heights[number, segment].tolist()))
    strips = [strip for number, facing in enumerate(candidates) for strip in _strips_of(number, facing, snap)]
    return np.array(strips, dtype=np.int64).reshape(-1, 4)


class Candidate(NamedTuple):
    """A master segment that faces a slave segment: (node, place) of its ends, and their heights."""

    segment: int
    ends: tuple[tuple[int, float], ...]
    heights: list[float]

    def height(self, place: float) -> float:
        (_, first), (_, second) = self.ends
        share = (place - first) / (second - first)
        return (1 - share) * self.heights[0] + share * self.heights[1]


def _strips_of(number: int, candidates: list[Candidate], snap: float) -> list[list[int]]:
    marks = {place: node for each in candidates for node, place in each.ends if snap < place < 1 - snap}
    marks |= {0.0: -1, 1.0: -1}
    strips: list[list[int]] = []
    for low, high in pairwise(sorted(marks)):
        middle = (low + high) / 2
        over = [each for each in candidates if each.ends[1][1] <= middle <= each.ends[0][1]]
        if not over:
            continue
        nearest = min((abs(each.height(middle)), each.segment) for each in over)[1]
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
