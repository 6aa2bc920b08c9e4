"""Projections on an interface that somebody gives: the slave is moved as a whole, until one of its points is in place.

A case is called by the kind that the oracle finds, because on any mesh another segment may turn out to be nearer.
"""

from __future__ import annotations

from math import ldexp

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.oracle.projection_kinds import TAU, kind_of
from contactverif.strategies.parts import penalties, seeds
from contactverif.strategies.sketches import ROUND_PLACES, gaps

_NEAR = st.integers(1, 20).map(lambda k: ldexp(1.0, -k))
_PAST = float(TAU)
_FEET = st.one_of(  # ξ on the master segment: inside, at a node, near one, and past one by less or more than τ.
    st.integers(1, 6).map(lambda sevenths: sevenths / 7),
    st.just(0.0),
    _NEAR,
    _NEAR.map(lambda part: -_PAST * (1 - part)),
    _NEAR.map(lambda part: -_PAST * (1 + part)),
)
_DEGREES = st.sampled_from([0.0, 0.0, 0.0, 5.0, -20.0, 45.0, 89.9, 90.0, 180.0])


@st.composite
def states(draw: DrawFn, interface: Interface) -> Case:
    """Draw a state of the interface: a point of a slave segment stands over, in or past a master segment."""
    slave_segment = draw(st.integers(0, len(interface.slave) - 1))
    home = draw(st.integers(0, len(interface.master) - 1))
    c, xi, gap, degrees = draw(st.sampled_from(ROUND_PLACES)), draw(_FEET), draw(gaps()), draw(_DEGREES)
    if draw(st.booleans()):
        xi = 1 - xi
    penalty, seed = draw(penalties()), draw(seeds())
    positions = interface.nodes.copy()
    first, second = positions[interface.master.segments[home]]
    along = second - first
    target = first + xi * along + gap * np.array([along[1], -along[0]])
    slave = positions[: interface.n_slave_nodes]
    a, b = slave[interface.slave.segments[slave_segment]]
    point = (1 - c) / 2 * a + (1 + c) / 2 * b
    slave[:] = (slave - point) @ _turn(b - a, -along, degrees).T + target
    z = positions.reshape(-1)
    parameters = {"probe_segment": np.array(float(slave_segment)), "probe_c": np.array(c)}
    return Case(interface, z, penalty, parameters, seed, kind=kind_of(interface, z, slave_segment, c))


def _turn(before: FloatArray, after: FloatArray, degrees: float) -> FloatArray:
    """Return the rotation (2, 2) that turns one direction into another, and by some degrees more."""
    angle = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0]) + np.radians(degrees)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
