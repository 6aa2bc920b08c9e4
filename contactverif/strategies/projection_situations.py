"""Cases by kind of projection: one strategy for each way in which a slave point can face the master.

`Case.kind` names the kind, so that a run can count how many cases of each kind it judged. The parameters
"probe_segment" and "probe_c" name the slave point that the case is about; its other points are where they happen to be.

Every kind is constructed, and none is filtered. Where exactness is the point (a hit node, a tie), coordinates are exact
in binary and stay so under the motion. The other cases have full mantissas: sevenths, any rotation, offsets to 2^20.
The oracle says whether a case is of its kind (`contactverif.oracle.is_of_kind`), and a test asks it.
"""

from __future__ import annotations

from functools import cache
from math import ldexp
from typing import overload

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.oracle.projection_kinds import TAU, kind_of
from contactverif.strategies import sketch_kinds
from contactverif.strategies.given_interface import touches
from contactverif.strategies.parts import penalties, seeds
from contactverif.strategies.sketches import ROUND_PLACES, Sketch, gaps, sketch_cases

_SKETCHES: dict[str, SearchStrategy[Sketch]] = {
    "inside a segment": sketch_kinds.inside(),
    "first of several segments": sketch_kinds.one_of_several("first"),
    "intermediate of several segments": sketch_kinds.one_of_several("intermediate"),
    "last of several segments": sketch_kinds.one_of_several("last"),
    "node hit exactly": sketch_kinds.node_hit(),
    "coincident nodes": sketch_kinds.coincident_nodes(),
    "convex vertex": sketch_kinds.vertex("convex vertex"),
    "concave vertex": sketch_kinds.vertex("concave vertex"),
    "master angle below 90°": sketch_kinds.vertex("master angle below 90°"),
    "equidistant from three segments": sketch_kinds.three_segments(),
    "equidistant from three nodes": sketch_kinds.three_nodes(),
    "free end hit exactly": sketch_kinds.free_end(),
    "past a free end, inside τ": sketch_kinds.past_end("past a free end, inside τ"),
    "past a free end, outside τ": sketch_kinds.past_end("past a free end, outside τ"),
    "overlap going to zero": sketch_kinds.small_overlap(),
    "edge-on, 89.9°": sketch_kinds.angle("edge-on, 89.9°", 89.9),
    "edge-on, 90°": sketch_kinds.angle("edge-on, 90°", 90.0),
    "from behind": sketch_kinds.angle("from behind", 180.0),
    "second body behind": sketch_kinds.second_body(),
    "closing segment": sketch_kinds.closing_segment(),
    "nearest node not on nearest segment": sketch_kinds.other_node(),
}
KINDS = tuple(_SKETCHES)
_NEAR = st.integers(1, 20).map(lambda k: ldexp(1.0, -k))
_PAST = float(TAU)
_FEET = st.one_of(  # ξ on the master segment: inside, at a node, near one, and past one by less or more than τ.
    st.integers(1, 6).map(lambda sevenths: sevenths / 7),
    st.just(0.0),
    _NEAR,
    _NEAR.map(lambda part: -_PAST * (1 - part)),
    _NEAR.map(lambda part: -_PAST * (1 + part)),
)
# Along the slave's normal nothing is in contact at 90° and beyond, so that only few states are that steep.
_DEGREES = st.sampled_from([*[0.0] * 6, *[5.0, -20.0, 45.0] * 2, 89.9, 90.0, 180.0])


@cache
def cases_of_kind(kind: str) -> SearchStrategy[Case]:
    """Return cases of one kind; the parameters "probe_segment" and "probe_c" name the slave point of this kind."""
    return sketch_cases(_SKETCHES[kind])


@overload
def projections_by_kind(interface: None = None) -> dict[str, SearchStrategy[Case]]: ...
@overload
def projections_by_kind(interface: Interface | None) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case]: ...
def projections_by_kind(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | SearchStrategy[Case]:
    """Return a strategy for each kind, so that each gets its share of a run; one strategy for a mesh of the user."""
    return {kind: cases_of_kind(kind) for kind in KINDS} if interface is None else _states(interface)


def projection_states(interface: Interface | None = None) -> SearchStrategy[Case]:
    """Return cases of all kinds of projection, mixed with others by `st.one_of`.

    Hypothesis varies what it has drawn before, so the shares of the kinds differ widely; `projections_by_kind` gives
    each kind its share.
    """
    if interface is not None:
        return _states(interface)
    return st.one_of(*map(cases_of_kind, KINDS))


@st.composite
def _states(draw: DrawFn, interface: Interface) -> Case:
    """Draw a state of the interface: a point of a slave segment stands in or past a master segment, or on it.

    The slave is moved as a whole. On any mesh another segment may turn out to be nearer, so the oracle names the kind.
    Where nothing touches, a node is set into the master: a run on a mesh of the user shall have contact to judge.
    """
    slave_segment = draw(st.integers(0, len(interface.slave) - 1))
    home = draw(st.integers(0, len(interface.master) - 1))
    c, xi, gap, degrees = draw(st.sampled_from(ROUND_PLACES)), draw(_FEET), draw(gaps()), draw(_DEGREES)
    if draw(st.booleans()):
        xi = 1 - xi
    penalty, seed = draw(penalties()), draw(seeds())
    positions = _set_point(interface, (slave_segment, c), (home, xi), gap, degrees)
    if not touches(interface, positions):
        c = -1.0
        positions = _set_point(interface, (slave_segment, c), (home, 3 / 7), -abs(gap) or -1 / 8, 0.0)
    z = positions.reshape(-1)
    parameters = {"probe_segment": np.array(float(slave_segment)), "probe_c": np.array(c)}
    return Case(interface, z, penalty, parameters, seed, kind=kind_of(interface, z, slave_segment, c))


def _set_point(
    interface: Interface, point: tuple[int, float], foot: tuple[int, float], gap: float, degrees: float
) -> FloatArray:
    """Return positions (n_nodes, 2) with the slave moved as a whole.

    Its point c on a segment gets to `gap`, in lengths of the master segment, above ξ there. Both segments then run
    against each other, up to so many degrees.
    """
    positions = interface.nodes.copy()
    first, second = positions[interface.master.segments[foot[0]]]
    along = second - first
    target = first + foot[1] * along + gap * np.array([along[1], -along[0]])
    slave, c = positions[: interface.n_slave_nodes], point[1]
    a, b = slave[interface.slave.segments[point[0]]]
    slave[:] = (slave - ((1 - c) / 2 * a + (1 + c) / 2 * b)) @ _turn(b - a, -along, degrees).T + target
    return positions


def _turn(before: FloatArray, after: FloatArray, degrees: float) -> FloatArray:
    """Return the rotation (2, 2) that turns one direction into another, and by some degrees more."""
    angle = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0]) + np.radians(degrees)
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
