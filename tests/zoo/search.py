"""Strips of the slave, closest segments, and numbers that carry their gradient, for right formulations.

A strip is a part of a slave segment between projections of master nodes along the slave's normal. Where master segments
lie behind one another, a strip sees the nearest, and none farther away than four of the longest segments: that may be
another body behind the slave's. A strip is a row of integers, so that a pairing may hold it.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from contactverif import ContactPoints


class Springs:
    """A formulation that has a penalty."""

    def __init__(self, *, penalty):
        self.penalty = penalty


def cross(p, q):
    return p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]


def dot(p, q):
    return p[..., 0] * q[..., 0] + p[..., 1] * q[..., 1]


def visible_strips(slave, master, x, snap=0.0):
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

    def height(self, place):
        (_, first), (_, second) = self.ends
        share = (place - first) / (second - first)
        return (1 - share) * self.heights[0] + share * self.heights[1]


def _strips_of(number, candidates: list[Candidate], snap):
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


def share_of(node, end, ends, x):
    """Return where nodes (n,) cut segments between the nodes `ends` (n, 2), from 0 to 1.

    Where a node is −1, that is `end`: 0 or 1. Positions x may have leading axes of a batch, and may be complex.
    """
    a = x[..., ends[:, 0], :]
    along = x[..., ends[:, 1], :] - a
    place = dot(x[..., np.maximum(node, 0), :] - a, along) / dot(along, along)
    return np.where(node < 0, float(end), place)


def add_at(forces, nodes, parts):
    """Add parts (..., n, 2) to the forces (..., n_nodes, 2) of nodes (n,), some of which may be the same."""
    np.add.at(forces, (..., nodes, slice(None)), parts)


def spread(x, nodes, shares, pull, normal, weight=1.0):
    """Return the forces (..., 2 n_nodes) of weighted pulls (..., n, n_points) along a normal; nodes take shares."""
    forces = np.zeros_like(x)
    for node, share in zip(nodes, shares, strict=True):
        add_at(forces, node, (pull * share * weight).sum(axis=-1)[..., None] * normal)
    return forces.reshape(*x.shape[:-2], -1)


def report(penalty, carrier, c, opposite, t, position, normal, gap, weight, active, ends=None, **others):
    """Return contact points from arrays of any shape, of which a pressure is −ε̂ g where they are active."""
    flat = [np.asarray(each).ravel() for each in (carrier, c, opposite, t)]
    gap, active = np.ravel(gap), np.ravel(active)
    places = (*flat, position.reshape(-1, 2), normal.reshape(-1, 2))
    ends = np.full((2, gap.size), np.nan) if ends is None else ends
    pressure = np.where(active, -penalty * gap, 0.0)
    return ContactPoints(*places, gap, pressure, np.ravel(weight), active, *ends, **others)


def closest_segments(points, master, x):
    """Return the numbers (n,) of the closest master segments of points (n, 2), and whether the foot is on the master.

    Of segments that are equally near, as at a vertex, the one counts whose line passes farther from the point: the foot
    is least past its end there.
    """
    first, second = x[master.segments[:, 0]], x[master.segments[:, 1]]
    along = second - first
    offset, beyond = points[:, None] - first, points[:, None] - second
    size = np.hypot(*along.T)
    advance = np.einsum("pmi,mi->pm", offset, along) / size
    height = np.einsum("pmi,mi->pm", offset, np.column_stack([along[:, 1], -along[:, 0]]) / size[:, None])
    rest = np.einsum("pmi,mi->pm", beyond, along) / size  # Positive past the second node
    distance = np.where(
        advance <= 0,
        np.hypot(offset[..., 0], offset[..., 1]),
        np.where(rest >= 0, np.hypot(beyond[..., 0], beyond[..., 1]), np.abs(height)),
    )
    near = distance <= distance.min(axis=1, keepdims=True) * (1 + 1e-13)
    number = np.where(near, np.abs(height), -1.0).argmax(axis=1)
    rows = np.arange(len(points))
    neighbours = master.neighbours[number]
    before = (advance[rows, number] >= 0) | (neighbours[:, 0] >= 0)
    behind = (rest[rows, number] <= 0) | (neighbours[:, 1] >= 0)
    return number, before & behind


class Dual:
    """An array of values (…) with gradients (…, n)."""

    def __init__(self, value, slope):
        self.value, self.slope = value, slope

    def __add__(self, other):
        other = as_dual(other)
        return Dual(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other):
        other = as_dual(other)
        return Dual(self.value - other.value, self.slope - other.slope)

    def __rsub__(self, other):
        return Dual(other - self.value, -self.slope)

    def __mul__(self, other):
        other = as_dual(other)
        slope = np.asarray(self.value)[..., None] * other.slope + np.asarray(other.value)[..., None] * self.slope
        return Dual(self.value * other.value, slope)

    def __truediv__(self, other):
        quotient = self.value / other.value
        return Dual(quotient, (self.slope - quotient[..., None] * other.slope) / other.value[..., None])

    __radd__, __rmul__ = __add__, __mul__


def as_dual(number):
    return number if isinstance(number, Dual) else Dual(number, np.zeros(1))


def root(number):
    """Return the square root of a dual number or an array."""
    if not isinstance(number, Dual):
        return np.sqrt(number)
    value = np.sqrt(number.value)
    return Dual(value, number.slope / (2 * value[..., None]))
