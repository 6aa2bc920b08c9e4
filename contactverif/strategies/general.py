"""Interfaces of any shape: flat, tilted, bent, circular, overhanging on either side, partly open.

The master of an open panel is the graph of a broken line, with walls; the slave's nodes lie below that line by their
penetration. So contact is there by construction, and nothing need be filtered: half of a slave segment lies over the
master, and where the draws leave it open, the slave sinks as a whole until that half is closed (`contact.py`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import cycle
from math import floor, log2

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.interface import Interface
from contactverif.strategies import given_interface, parts
from contactverif.strategies.contact import covered_start, extend_line, sink_below
from contactverif.strategies.panels import Panel, assemble_panels, on_lattice, shortest
from contactverif.strategies.rings import Ring, rings

_ON = st.integers(0, 7)  # Zero means no offset.
_WALL = 5  # The kind of a step that is a wall: one step in six.
_BENDS = st.sampled_from([0.0, 0.125, 0.25, 0.5, 1.0, 0.03125])  # steepness of the master's steps
_TILTS = st.sampled_from([0.0, 0.125, -0.125, 0.375, -0.375, 1.0, -1.0])  # slope of a slave segment, at most 45°


def general_cases(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Return states of any kind; one in eight exactly on the lattice, the others off it by some sevenths."""
    return _general_cases(smooth=False) if interface is None else given_interface.states(interface, smooth=False)


@random_source("contactverif.strategies.general.smooth_cases")
def smooth_cases(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Return cases as `general_cases` does, always off the lattice: for derivatives, which mean nothing at a kink."""
    return _general_cases(smooth=True) if interface is None else given_interface.states(interface, smooth=True)


@st.composite
def _general_cases(draw: DrawFn, smooth: bool) -> Case:
    makers: list[Broken | Ring] = draw(_panels(smooth))
    motion, penalty, seed, shuffle = parts.draw_others(draw)
    # Drawn last, so that the offset shrinks last.
    offset_on = smooth or draw(_ON) > 0
    offsets = draw(parts.OFFSETS) if offset_on else [0]
    if not offset_on or any(isinstance(maker, Broken) and maker.upright for maker in makers):
        # A quarter turn keeps a tie a tie, and a wall upright.
        motion = replace(motion, degrees=motion.degrees // 90 * 90)
    interface, z, _ = assemble_panels([maker(offsets) for maker in makers], motion, shuffle)
    return Case(interface, z, penalty, {}, seed)


@dataclass(frozen=True, slots=True)
class Broken:
    """A slave chain below a broken line."""

    # The master from left to right: length along, rise in units of `bend`, kind (a wall if 5).
    steps: Sequence[tuple[float, int, int]]
    bend: float  # The steepness of a rise of 1; walls are steep anyway.
    slave: Sequence[float]  # Lengths along of the slave segments.
    # X of the first slave node; the first master node is at 0. The slave moves on, and the master grows, until half
    # of a slave segment is over it.
    start: int
    tilt: float  # Slope of the slave against the master, turned about its middle, flatter for long chains.
    quarters: Sequence[int]  # Penetrations: quarters/4 × unit × the shortest segment, dealt to the slave nodes in turn.
    unit: float
    upright: bool = False  # Walls do not lean, and the slave stays where it starts.

    def __call__(self, offsets: Sequence[int]) -> Panel:
        """Return the panel, its nodes moved off the lattice by these numerators, 0 for none."""
        line = self._master(offsets)
        length = min(shortest(line), min(self.slave))
        start = float(self.start)
        if not self.upright:
            line = extend_line(line, self.slave, length / 8)
            start = covered_start(start, self.slave, line[-1, 0] - length / 8)
        x = start + parts.ends_of(self.slave)
        reference = np.column_stack([x, on_lattice(np.interp(x, *line.T))])
        flatter = 2.0 ** floor(min(0.0, log2(2 * length / (x[-1] - x[0]))))
        rise = self.tilt * flatter * (x - (x[0] + x[-1]) / 2)
        shift = parts.shifts(offsets, len(x))
        depth = (parts.repeat_cyclically(self.quarters, len(x)) / 4 + shift[:, 1]) * self.unit * length
        x = x + shift[:, 0] * length
        # The line is met again at the moved nodes, or a steep line would make the penetration another one.
        slave = np.column_stack([x, on_lattice(np.interp(x, *line.T)) + rise - depth])
        return Panel(sink_below(slave, line, self.unit * length / 4), line[::-1], reference)

    def _master(self, offsets: Sequence[int]) -> FloatArray:
        """Return points (n, 2) from left to right; no wall stands on a wall, so that no two nodes can coincide.

        With an offset walls lean and bends are uneven, so that nothing is seen exactly edge-on.
        """
        points, wall = [(0.0, 0.0)], False
        for index, ((along, up, kind), offset) in enumerate(zip(self.steps, cycle(offsets), strict=False)):
            wall = kind == _WALL and not wall
            uneven = offset / 13 / 32
            if wall:
                dx, dy = 0.0 if self.upright else uneven, (up or 1) / 2
            else:
                dx, dy = along, (up + index % 3 * uneven) * self.bend
            points.append((points[-1][0] + dx, points[-1][1] + dy))
        return np.array(points)


@cache
def _broken_lines() -> SearchStrategy[Broken]:
    """Return flat panels with neighbours' lengths of any ratio, bent panels with lengths of 1 to 4."""
    flat = parts.lengths().map(lambda along: [(length, 0, 0) for length in along])
    bent = st.lists(
        st.tuples(st.integers(1, 4).map(float), st.integers(-4, 4), st.integers(0, _WALL)), min_size=1, max_size=6
    )
    plain = parts.lengths(graded=False).map(lambda along: [(length + 1) // 2 for length in along])
    depth = st.one_of(parts.depths(), parts.depths(lowest=-6))
    start = st.integers(-2, 2)
    return st.one_of(
        st.builds(Broken, flat, st.just(0.0), parts.lengths(), start, _TILTS, depth, parts.depth_units()),
        st.builds(Broken, bent, _BENDS, plain, start, _TILTS, depth, parts.depth_units()),
    )


def _ledge(floor: Sequence[float], slave: Sequence[float], rise: int, quarters: Sequence[int], unit: float) -> Broken:
    """Return a floor whose free end is an upright wall.

    The slave begins on it with a long segment beyond the wall.

    The area of competence of that segment's first quarter point goes past the wall: a walk ends edge-on.
    """
    steps = [*((length, 0, 0) for length in floor), (0.0, rise, _WALL)]
    end = int(sum(floor))
    return Broken(steps, 0.0, [6.0, *slave], end - min(end, 2), 0.0, quarters, unit, upright=True)


@cache
def _panels(smooth: bool) -> SearchStrategy[list[Broken | Ring]]:
    """Return one or two panels; ledges, which are kinks, only if not smooth."""
    shapes: list[SearchStrategy[Broken | Ring]] = [_broken_lines(), _broken_lines(), _broken_lines(), rings(), rings()]
    if not smooth:
        plain = parts.lengths(graded=False)  # drawn from like the others, so that these do not shrink to a ledge
        shapes.append(
            st.builds(_ledge, plain, plain, st.sampled_from([-1, -1, 1]), parts.depths(), parts.depth_units())
        )
    panel = st.one_of(*shapes)
    return st.one_of(st.lists(panel, min_size=1, max_size=1), st.lists(panel, min_size=1, max_size=2))
