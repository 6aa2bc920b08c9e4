"""A slave that slides along a bent master: a path of states, on which points pass the vertices of the master.

The master is the graph of a broken line with slopes up to 1/2, and the slave follows it from below. So each line along
a normal meets the master once, and penetrations are small against its segments: the nearest segment is always near.
"""

from __future__ import annotations

from itertools import pairwise, product

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.strategies.panels import Chain, assemble_chains, on_lattice
from contactverif.strategies.parts import draw_others, ends_of, on_own_meshes, repeat_cyclically

_SLAVE = st.lists(st.sampled_from([1.0, 1.5, 2.0]), min_size=1, max_size=3)
_MASTER = st.lists(st.sampled_from([1.0, 2.0, 1.5]), min_size=1, max_size=3)
_SLOPES = st.lists(st.integers(1, 8), min_size=2, max_size=5)  # Sixteenths; their signs alternate along the master.
_DEPTHS = st.lists(st.integers(1, 8), min_size=1, max_size=3)  # Thirty-seconds of the unit length.
_PLACES = st.integers(0, 12)
_PARALLEL = 2.0**-10  # The largest difference of parallel slopes: what opens in so short a time looks like a jump.
_MARGIN = 3.0  # The length of master on both sides of what the slave passes.


@random_source("contactverif.strategies.sliding.sliding_cases")
@on_own_meshes
def sliding_cases(draw: DrawFn) -> Case:
    """Return slaves that slide along a bent master by the length of a segment; None for a given mesh.

    The parameter "path" (n_unknowns,) holds the way of each node, a length each: states are z + t path, 0 ≤ t ≤ 1. The
    parameter "opens" is 1 if a length of the slave leaves the master in one moment of the way, or enters it, else 0.
    """
    steps = draw(_SLAVE)
    way = max(steps)
    x = ends_of(steps)
    line = _bent_line(draw(_MASTER), draw(_SLOPES), -_MARGIN - draw(_PLACES) / 13, x[-1] + way + _MARGIN)
    depth = repeat_cyclically(draw(_DEPTHS), len(x)) / 32
    # The slave follows the master as it lies in the middle of the way.
    slave = np.column_stack([x, on_lattice(np.interp(x + way / 2, *line.T)) - depth])
    motion, penalty, seed, shuffle = draw_others(draw)
    chains = [Chain(slave)], [Chain(line[::-1])], [Chain(slave)]
    interface, order = assemble_chains(*chains, motion.scale, shuffle)
    nodes = np.vstack([slave, line[::-1]])
    moved = nodes + np.where(np.arange(len(nodes)) < len(slave), way, 0.0)[:, None] * [1.0, 0.0]
    z, end = motion(nodes[order]).reshape(-1), motion(moved[order]).reshape(-1)
    opens = _opens_at_once(slave, line, way)
    return Case(interface, z, penalty, {"path": end - z, "opens": np.array(float(opens))}, seed)


def _opens_at_once(slave: FloatArray, line: FloatArray, way: float) -> bool:
    """Return whether a length of the slave (n, 2), which slides by a way, leaves the line (m, 2) in one moment.

    It is parallel to a segment of the line then, and both are in touch there after a share of the way.
    """
    for (a, b), (p, q) in product(pairwise(slave), pairwise(line)):
        slope, other = ((end[1] - start[1]) / (end[0] - start[0]) for start, end in ((a, b), (p, q)))
        if abs(slope - other) > _PARALLEL:
            continue
        share = (a[1] - p[1] + other * (p[0] - a[0])) / (slope * way)
        overlap = min(q[0], b[0] + share * way) - max(p[0], a[0] + share * way)
        if -_PARALLEL <= share <= 1 + _PARALLEL and overlap > 0:
            return True
    return False


def _bent_line(lengths: list[float], slopes: list[int], start: float, end: float) -> FloatArray:
    """Return a broken line (n, 2) from left to right; it goes up and down in turn, so that it stays near one height."""
    points = [(start, 0.0)]
    while points[-1][0] < end:
        number = len(points)
        length = lengths[number % len(lengths)]
        slope = slopes[number % len(slopes)] / 16 * (1 if number % 2 else -1)
        points.append((points[-1][0] + length, points[-1][1] + length * slope))
    return on_lattice(np.array(points))
