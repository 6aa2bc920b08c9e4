"""Exact ties, where a formulation must decide and none of its choices is wrong: each case stands on a kink.

Slave nodes over master nodes, quarter points over master nodes, points on the bisector of a vertex, ends at ends, gaps
of exactly zero. Motions are quarter turns and whole numbers, so that a tie stays one bit for bit. Where all gaps would
be zero or open, the slave sinks a little, so that something is in contact.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.strategies.contact import sink_below
from contactverif.strategies.panels import Panel, assemble_panels
from contactverif.strategies.parts import depth_units, ends_of, motions, penalties, repeat_cyclically, seeds

_RISES = st.sampled_from([0.0, 0.25, -0.25, 1.0, -1.0])  # The rise of a vertex above its neighbours, per length.
_QUARTERS = st.lists(st.integers(0, 8), min_size=1, max_size=4)  # Penetrations; 0 is a gap of exactly zero.
_SEGMENT = st.tuples(
    st.integers(0, 3).map(lambda k: 2.0**k), st.integers(0, 3)
)  # The length, and the quarter under a master node.


def tie_cases() -> SearchStrategy[Case]:
    """Return random meshes that stand exactly on a kink, many of them on several."""
    return _tie_cases()


@st.composite
def _tie_cases(draw: DrawFn) -> Case:
    panel = draw(_PANELS)
    motion, penalty, seed = draw(motions(exact=True)), draw(penalties()), draw(seeds())
    interface, z, _ = assemble_panels([panel], motion)
    return Case(interface, z, penalty, {}, seed)


def _facing(
    segments: Sequence[tuple[float, int]], rises: Sequence[float], quarters: Sequence[int], unit: float
) -> Panel:
    """Return a panel with master nodes under all slave nodes.

    Under some slave segments one quarter point or the middle has a master node too (0: none).
    """
    slave_x, master_x = [0.0], [0.0]
    for length, quarter in segments:
        if quarter:
            master_x.append(slave_x[-1] + length * quarter / 4)
        slave_x.append(slave_x[-1] + length)
        master_x.append(slave_x[-1])
    heights = repeat_cyclically(rises, len(master_x)) / 4
    return _below(np.array(slave_x), np.column_stack([master_x, heights]), quarters, unit / 4)


def _on_bisector(
    segments: Sequence[tuple[float, int]], rises: Sequence[float], quarters: Sequence[int], unit: float
) -> Panel:
    """Return a symmetric roof or valley of two segments.

    A node, or the quarter of the first slave segment, lies on its bisector.

    The slave is level, so that the bisector, which is upright, is met at right angles.
    """
    x = ends_of(length for length, _ in segments)
    x -= segments[0][0] * segments[0][1] / 4
    reach = 4 * x[-1]
    line = np.array([[-reach, -reach * rises[0]], [0.0, 0.0], [reach, -reach * rises[0]]])
    slave = sink_below(np.column_stack([x, np.full(len(x), -quarters[0] / 4 * unit)]), line, unit / 4)
    return Panel(slave, line[::-1], np.column_stack([x, np.zeros(len(x))]))


def _below(x: FloatArray, line: FloatArray, quarters: Sequence[int], unit: float) -> Panel:
    """Return a panel with slave nodes at x, sunk below the broken line (n, 2)."""
    heights = np.interp(x, *line.T)
    depths = repeat_cyclically(quarters, len(x)) / 4 * unit
    slave = np.column_stack([x, heights - depths])
    if not _deepest_segment_touches(slave, line):
        slave = sink_below(slave, line, unit / 4)
    return Panel(slave, line[::-1], np.column_stack([x, heights]))


def _deepest_segment_touches(slave: FloatArray, line: FloatArray) -> bool:
    """Return whether a node and a quarter point beside it are below the line, so that a gap of zero may stay."""
    x = slave[:, 0]
    quarters = np.concatenate([0.75 * x[:-1] + 0.25 * x[1:], 0.25 * x[:-1] + 0.75 * x[1:]])
    here, there = (np.interp(places, *slave.T) < np.interp(places, *line.T) for places in (x, quarters))
    return bool(here[np.r_[: len(x) - 1, 1 : len(x)]][there].any())


_ARGUMENTS = (
    st.lists(_SEGMENT, min_size=1, max_size=5),
    st.lists(_RISES, min_size=1, max_size=4),
    _QUARTERS,
    depth_units(),
)
_PANELS = st.one_of(st.builds(_facing, *_ARGUMENTS), st.builds(_on_bisector, *_ARGUMENTS))
