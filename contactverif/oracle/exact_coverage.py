"""The exact parts of the slave that the master covers, as shares of the slave segments."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from contactverif.contract.arrays import BoolArray
from contactverif.contract.interface import Interface
from contactverif.oracle.exact_choices import DEEP, overlaps
from contactverif.oracle.exact_points import ExactPoints, Integers, Lattice, Ratios, slave_normal_view


@dataclass(frozen=True, slots=True, eq=False)
class Coverage:
    """The part of each slave segment that sees the master along the slave's normal."""

    share: Ratios  # (n_slave_segments,) The covered share of the segment's length, from 0 to 1 where it is clear.
    # (n_slave_segments,) False where formulations may differ: master segments lie behind one another, or deeper or
    # farther than two lengths of both.
    clear: BoolArray

    @classmethod
    def along_slave_normals(cls, lattice: Lattice) -> Coverage:
        """Return the coverage of a state by all master segments that face the slave."""
        n_slave, n_master = len(lattice.slave), len(lattice.master)
        carrier, segment = np.divmod(np.arange(n_slave * n_master), n_master)
        low, high, squared = overlaps(lattice, carrier, segment)
        pairs = np.flatnonzero(high > low)
        carrier, segment, low, high = carrier[pairs], segment[pairs], low[pairs], high[pairs]
        middle = ExactPoints.at_ratios(lattice, carrier, low + high, 2 * squared[pairs])
        view = slave_normal_view(lattice, middle, segment)
        facing = view.cosine > 0
        deep = facing & (np.abs(view.gap.floats()) > DEEP * (view.slave_length + view.master_length))
        above, below, clear = np.zeros(n_slave, dtype=object), np.ones(n_slave, dtype=object), np.ones(n_slave, bool)
        clear[carrier[deep]] = False
        for number in np.unique(carrier[facing]).tolist():
            here = np.flatnonzero(facing & (carrier == number))
            above[number], below[number] = sum((high - low)[here].tolist()), 2 * squared[pairs][here[0]]
            clear[number] &= not _overlap(low[here], high[here])
        return cls(Ratios(above, below), clear)


def _overlap(low: Integers, high: Integers) -> bool:
    """Return whether any two of some intervals have more than an end in common."""
    order = sorted(range(len(low)), key=lambda number: (low[number], high[number]))
    return any(high[now] > low[following] for now, following in pairwise(order))


def lies_in_shadow(lattice: Lattice, interface: Interface) -> bool:
    """Return whether the whole slave faces one open master chain, between its ends along the normal of each segment.

    Then nothing overhangs by whatever normal of the master it is measured, and no segment of one side is seen edge-on.
    """
    master, order = interface.master, interface.master.chain_order
    if (master.neighbours[order[1:], 0] != order[:-1]).any() or master.neighbours[order[0], 0] >= 0:
        return False
    nodes = lattice.nodes
    along = nodes[master.segments[:, 1]] - nodes[master.segments[:, 0]]
    against = nodes[interface.slave.segments[:, 1]] - nodes[interface.slave.segments[:, 0]]
    points = nodes[: interface.n_slave_nodes]
    before = points - nodes[master.segments[order[0], 0]]
    behind = nodes[master.segments[order[-1], 1]] - points
    return bool(
        (along.dot(along.T) > 0).all()
        and (along.dot(against.T) < 0).all()
        and (before.dot(along.T) > 0).all()
        and (behind.dot(along.T) > 0).all()
    )
