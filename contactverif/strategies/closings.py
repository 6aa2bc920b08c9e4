"""Two surfaces that touch in one node: a vertex of either one lies on a vertex or on a segment of the other one.

A straight line through that node parts them, and each of their vertices is convex. So they may close along the normal
of the line from any distance, and the distance of a node from the other surface has no kink on the way.
"""

from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, random_source
from contactverif.contract.interface import Interface
from contactverif.strategies import samples

KINDS = tuple(f"{side} node on a {place}" for side in ("slave", "master") for place in ("vertex", "segment"))
_LENGTHS = st.builds(np.ldexp, st.integers(4, 7).map(float), st.integers(-2, 2))
# The surface of the node leaves the line so steeply that no other node is near; the other one may hardly leave it.
_STEEP = st.integers(2, 12).map(lambda eighths: eighths / 8)
_SLOPES = st.one_of(_STEEP, st.builds(np.ldexp, _STEEP, st.integers(-40, 0)))
_MIDDLES = st.integers(4, 8).map(lambda sixteenths: sixteenths / 16)
_SHARES = st.one_of(_MIDDLES, st.builds(np.ldexp, _MIDDLES, st.integers(-12, 0)))
_SIDES = st.sampled_from([1, -1])


@random_source("contactverif.strategies.closings.closing_cases")
def closing_cases(interface: Interface | None = None) -> dict[str, SearchStrategy[Case]] | None:
    """Return surfaces that touch in one node, each kind in a quarter of all cases; None for a given mesh.

    Their parameters are "penetration", 0; "direction" (2,), a unit vector along the line, with the slave on its left;
    "room", the length from the touching node to the nearest other one; and "closing" (3,): that node, a vertex of the
    other surface, and a neighbour of the vertex.
    """
    return {kind: _closings("slave" in kind, "segment" in kind) for kind in KINDS} if interface is None else None


@st.composite
def _closings(draw: DrawFn, slave_closes: bool, on_segment: bool) -> Case:
    node, reach = _profile([0.0], [draw(each) for each in 2 * [_STEEP, _LENGTHS]]), [0.0]
    if on_segment:
        length, share, side = draw(_LENGTHS), draw(_SHARES), draw(_SIDES)
        reach = sorted([side * share * length, -side * (1 - share) * length])
    other = _profile(reach, [draw(each) for each in 2 * [_SLOPES, _LENGTHS]])
    vertex = draw(st.integers(1, len(reach)))
    neighbour = vertex + draw(_SIDES)
    motion, penalty, seed, shuffle = samples.draw_others(draw)
    slave, master = (node, other) if slave_closes else (other, node)
    chains = [samples.Chain(slave)], [samples.Chain((master * [1, -1])[::-1])]
    interface, order = samples.assemble_chains(*chains, chains[0], motion.scale, shuffle)
    closing, facing = np.split(np.argsort(order), [len(slave)])[:: 1 if slave_closes else -1]
    numbers = closing[1], *(facing[:: -1 if slave_closes else 1][[vertex, neighbour]])  # The master runs to the left.
    room = min(*map(samples.shortest, (node, other)), *(abs(x) for x in reach if x))
    sizes = {"penetration": 0.0, "direction": motion.direction, "room": room * motion.scale, "closing": numbers}
    points = np.vstack([slave, (master * [1, -1])[::-1]])[order]
    parameters = {name: np.array(values, dtype=np.float64) for name, values in sizes.items()}
    return Case(interface, motion(points).reshape(-1), penalty, parameters, seed)


def _profile(on_line: Sequence[float], ends: Sequence[float]) -> FloatArray:
    """Return points (n, 2) from left to right, x and how far behind the line; each end has a slope and a width."""
    before, first, behind, last = ends
    within = [[x, 0.0] for x in on_line]
    return np.array([[on_line[0] - first, before * first], *within, [on_line[-1] + last, behind * last]])
