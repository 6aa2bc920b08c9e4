"""From points to a case: panels (a slave chain and the master chain below it), put side by side, moved, numbered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, log2

import numpy as np

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.interface import Interface, Surface
from contactverif.strategies.samples import Motion


@dataclass(frozen=True, slots=True)
class Chain:
    """Points that segments join one after the other."""

    points: FloatArray  # (n, 2) The points in walking order, the body on the left.
    closed: bool = False  # The last point is joined to the first.


@dataclass(frozen=True, slots=True)
class Panel:
    """One slave chain and one master chain, at rest on the lattice."""

    # (n, 2) Current positions in walking order, the body on the left: in +x and in −x if they are open and the slave
    # is on top.
    slave: FloatArray
    master: FloatArray
    reference: FloatArray  # (n, 2) Reference positions of the slave; the master is where it was.
    closed: bool = False  # Each chain's last point is joined to its first.

    @property
    def shortest_segment(self) -> float:
        """The length of the shortest reference segment of both sides."""
        return min(shortest(self.reference), shortest(self.master))


def on_lattice(values: FloatArray) -> FloatArray:
    """Return the nearest multiples of 2^-20."""
    return np.round(values * 2.0**20) * 2.0**-20


def shortest(points: FloatArray) -> float:
    """Return the length of the shortest of the segments between consecutive points (n, 2)."""
    return float(np.hypot(*(points[1:] - points[:-1]).T).min())


def assemble_panels(
    panels: Sequence[Panel], motion: Motion, shuffle: int = 0
) -> tuple[Interface, FloatArray, FloatArray]:
    """Assemble panels in a row, far apart: the interface, scaled; its state z, scaled and moved; and x before that.

    The shuffle 0 numbers nodes and segments as one walks along them; any other number is a shuffle of its own.
    """
    offsets = _offsets(panels)
    slaves, masters, references = (
        [Chain(getattr(panel, side) + offset, panel.closed) for panel, offset in zip(panels, offsets, strict=True)]
        for side in ("slave", "master", "reference")
    )
    interface, order = assemble_chains(slaves, masters, references, motion.scale, shuffle)
    current = np.vstack([chain.points for chain in (*slaves, *masters)])[order]
    return interface, motion(current).reshape(-1), current[:, 0] * motion.scale


def assemble_chains(
    slaves: Sequence[Chain], masters: Sequence[Chain], references: Sequence[Chain], scale: float, shuffle: int = 0
) -> tuple[Interface, IntArray]:
    """Return the scaled interface of these chains, and the place (n_nodes,) of each node on the walk along them.

    The walk goes along the slave's chains, then the master's. The master is where it was.
    """
    n_slave, n_master = (sum(len(chain.points) for chain in side) for side in (slaves, masters))
    slave, master = _segments(slaves, 0), _segments(masters, n_slave)
    order: IntArray = np.arange(n_slave + n_master)
    if shuffle:
        random = np.random.default_rng(shuffle)
        order = np.concatenate([random.permutation(n_slave), n_slave + random.permutation(n_master)])
        number = np.argsort(order)  # the number of each node on the walk
        slave, master = (random.permutation(number[side]) for side in (slave, master))
    nodes = np.vstack([chain.points for chain in (*references, *masters)])[order]
    return Interface(nodes * scale, Surface(slave), Surface(master)), order


def _offsets(panels: Sequence[Panel]) -> list[FloatArray]:
    """Return shifts in x that keep panels apart by four widths or more, powers of two."""
    offsets, reached = [np.zeros(2)], 0.0
    for before, panel in pairwise(panels):
        width = max(np.ptp(np.vstack([side.slave, side.master])[:, 0]) for side in (before, panel))
        reached += 8 * 2.0 ** ceil(log2(width))
        offsets.append(np.array([reached, 0.0]))
    return offsets


def _segments(chains: Sequence[Chain], start: int) -> IntArray:
    """Return the segments (n, 2) of chains whose nodes are numbered on the walk, from `start`."""
    segments: list[tuple[int, int]] = []
    for chain in chains:
        numbers = [*range(start, start + len(chain.points))]
        segments += pairwise([*numbers, start] if chain.closed else numbers)
        start += len(numbers)
    return np.array(segments)
