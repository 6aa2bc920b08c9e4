"""Circular interfaces: arcs and closed rings, the master inside or outside, the nodes on the lattice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.strategies import parts
from contactverif.strategies.contact import radial_factor
from contactverif.strategies.panels import Panel, assemble_panels, on_lattice, shortest

RADIUS = 4.0


@dataclass(frozen=True, slots=True)
class Ring:
    """Two concentric polygons, or parts of them."""

    slave: Sequence[int]  # Weights by which the segments share the angle.
    master: Sequence[int]
    degrees: int  # The angle; 360 is closed.
    inner_slave: bool  # The slave is the disc, else the hole around it.
    # As of `Broken`, measured along the radius. Then the slave grows or shrinks as a whole until half of a segment
    # penetrates.
    quarters: Sequence[int]
    unit: float

    def __call__(self, offsets: Sequence[int]) -> Panel:
        """Return the panel, its slave nodes moved off the lattice by these numerators, 0 for none."""
        warp = 1 + offsets[0] / 13 / 8  # no two segments at right angles, so that nothing is seen exactly edge-on
        master = self._points(self.master, not self.inner_slave, warp)
        reference = self._points(self.slave, self.inner_slave, 1.0)
        length = min(shortest(master), shortest(reference))
        depth = on_lattice(parts.repeat_cyclically(self.quarters, len(reference)) / 4 * self.unit * length)
        depth = np.clip(depth, -RADIUS / 2, RADIUS / 2)  # neither a hole nor a disc shrinks to a point
        outward = reference / RADIUS if self.inner_slave else -reference / RADIUS
        shift = parts.shifts(offsets, len(reference)) * length
        slave = on_lattice(reference + outward * depth[:, None]) + shift
        least, closed = min(self.unit * length / 4, RADIUS / 16), self.degrees == 360
        edges = master[::-1] if self.inner_slave else master
        factor = radial_factor(slave, edges, least, outside=self.inner_slave, closed=closed)
        return Panel(slave * factor, master, reference, closed=closed)

    def _points(self, weights: Sequence[int], inner: bool, warp: float) -> FloatArray:
        """Return points (n, 2), the body on the left: counter-clockwise around a disc, clockwise around a hole."""
        shares = parts.ends_of(weights) / sum(weights)
        angles = np.deg2rad(self.degrees * (shares[:-1] if self.degrees == 360 else shares) ** warp)
        points = on_lattice(RADIUS * np.column_stack([np.cos(angles), np.sin(angles)]))
        return points if inner else points[::-1]


def rings() -> SearchStrategy[Ring]:
    """Return arcs of 60° to 180°, and closed rings."""
    weights = st.lists(st.integers(1, 3), min_size=3, max_size=10)
    degrees = st.sampled_from([60, 150, 360, 180, 360, 360])
    depth = st.one_of(parts.depths(), parts.depths(lowest=-6))
    return st.builds(Ring, weights, weights, degrees, st.booleans(), depth, parts.depth_units())


_RINGS = rings()


def closed_cases() -> SearchStrategy[Case]:
    """Return a closed ring in a hole, off the lattice; its seam is where the numbering, on the walk or not, begins."""
    return _closed_cases()


@st.composite
def _closed_cases(draw: DrawFn) -> Case:
    ring = replace(draw(_RINGS), degrees=360)
    motion, penalty, seed, shuffle = parts.draw_others(draw)
    interface, z, _ = assemble_panels([ring(draw(parts.OFFSETS))], motion, shuffle)
    return Case(interface, z, penalty, {}, seed)
