"""Flat interfaces of the reference paper's classes, under uniform penetration.

The slave is drawn as in `flat`, and the master is made from it: of the slave's nodes, and of the middles of its
segments, some carry a master node. So the meshes are of their class by construction. Each shrinks to one segment on
one. `contactverif.oracle.mesh_classes` says what the classes are.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.interface import Interface
from contactverif.oracle.mesh_classes import is_of_class
from contactverif.strategies.flat import Sides, uniform_penetrations
from contactverif.strategies.given_interface import flat_cases, slave_direction
from contactverif.strategies.parts import lengths

_REPEATS = st.sampled_from([1] * 7 + [2, 4])  # The slave lengths are repeated so often, for long chains.
_CARRIES = st.lists(st.integers(0, 1), min_size=1, max_size=7)  # 1 where there is a master node, dealt out in turn.
_MOST = 3  # The largest length by which the master goes beyond the slave, in halves of the slave's end segment.


@random_source("contactverif.strategies.class_meshes.normal_cases")
def normal_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases of uniform penetration whose inner master nodes all lie on slave nodes.

    Given an interface, states of that one; None if it is not flat, not covered, or not of this class.
    """
    return _cases(interface, midpoints=False)


@random_source("contactverif.strategies.class_meshes.single_cases")
def single_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases of uniform penetration whose inner master nodes lie on slave nodes or in the middle of segments.

    Given an interface, states of that one; None if it is not flat, not covered, or not of this class.
    """
    return _cases(interface, midpoints=True)


@random_source("contactverif.strategies.class_meshes.overhung_cases")
def overhung_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases as `single_cases` does, on meshes whose master goes beyond the slave by half a segment or more.

    No master node lies on an end node of the slave, so no node of either surface faces a free end of the other. Given
    an interface, this is `single_cases`.
    """
    return _cases(interface, midpoints=True, least=1)


def _cases(interface: Interface | None, *, midpoints: bool, least: int = 0) -> SearchStrategy[Case] | None:
    if interface is None:
        return uniform_penetrations(_panels(midpoints, least))
    states, direction = flat_cases(interface), slave_direction(interface)
    if states is None or direction is None:
        return None
    return states if is_of_class(interface, interface.nodes @ direction, midpoints=midpoints) else None


@cache
def _panels(midpoints: bool, least: int) -> SearchStrategy[list[Sides]]:
    middles, overhang = _CARRIES if midpoints else st.just([0]), st.integers(least, _MOST)
    side = st.builds(_places, _REPEATS, lengths(), _CARRIES, middles, overhang, overhang, st.just(least > 0))
    return st.one_of(st.lists(side, min_size=1, max_size=1), st.lists(side, min_size=1, max_size=2))


def _places(
    repeats: int,
    slave: Sequence[float],
    at_nodes: Sequence[int],
    at_middles: Sequence[int],
    left: int,
    right: int,
    inner: bool,
) -> Sides:
    """Return the ascending x of the nodes of a slave chain, and of a master chain made from it.

    Where the master ends with the slave, their end nodes coincide. Where it goes beyond, one of its inner nodes may lie
    on the slave's end node, unless `inner` says that only inner nodes of the slave carry one.
    """
    segments = np.tile(slave, repeats)
    slave_x = np.concatenate([[0.0], np.cumsum(segments)])
    deal = partial(np.resize, new_shape=len(slave_x))
    nodes = slave_x[deal(at_nodes) == 1]
    nodes = nodes[(nodes > slave_x[0]) & (nodes < slave_x[-1])] if inner else nodes
    middles = (slave_x[:-1] + segments / 2)[deal(at_middles)[:-1] == 1]
    first, last = slave_x[0] - left / 2 * segments[0], slave_x[-1] + right / 2 * segments[-1]
    return slave_x, np.unique(np.concatenate([[first], nodes, middles, [last]]))
