"""Flat interfaces under uniform penetration, for the patch test: any meshes, and those of the paper's classes.

Each slave chain lies wholly over one master chain; ends may coincide. Meshes match or not, neighbours' lengths differ
by up to 2^20, and up to 100 master segments lie under one slave segment. `contactverif.oracle.flat_answers` says what
the classes are: of the slave's nodes, and of the middles of its segments, some carry a master node.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, partial
from itertools import cycle
from typing import overload

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.cases import random_source
from contactverif.contract.interface import Interface
from contactverif.oracle.flat_answers import is_of_class
from contactverif.strategies import given_interface, parts
from contactverif.strategies.panels import Panel, assemble_panels, shortest

Sides = tuple[FloatArray, FloatArray]  # The ascending x of the nodes of a slave chain and of a master chain below it.

FLAT = "a straight slave over a parallel master"
OF_CLASS = "a flat mesh whose nodes meet"
MOST_MASTER_SEGMENTS = 100  # The most master segments in one chain.
_DEPTHS = st.integers(1, 8)  # quarters
_SLIDES = st.sampled_from([0, 0, 0, 1, 2, 5])  # The distance that the slave has slid from its reference.
_REPEATS = st.sampled_from([1] * 15 + [2, 4, 12])  # The slave lengths are repeated so often, for long chains.
_REFINEMENTS = st.sampled_from([0] * 8 + [1, 2, 4, 6])  # The master lengths are multiplied by 2^-this.

_CLASS_REPEATS = st.sampled_from([1] * 7 + [2, 4])  # The slave lengths are repeated so often, for long chains.
_CARRIES = st.lists(st.integers(0, 1), min_size=1, max_size=7)  # 1 where there is a master node, dealt out in turn.
_FURTHEST = 3  # The largest length by which the master goes beyond the slave, in halves of the slave's end segment.


@overload
def flat_cases(interface: None = None) -> SearchStrategy[Case]: ...
@overload
def flat_cases(interface: Interface | None) -> SearchStrategy[Case] | None: ...
@random_source("contactverif.strategies.flat.flat_cases", needs=FLAT)
def flat_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases of uniform penetration; every slave point projects inside the master.

    Their parameters are "penetration" (|g| > 0, a length), "along" (n_nodes,) (coordinate of each node along the line,
    the unit of z, before any rigid motion) and "direction" (2,) (unit vector, from the slave's first to its last node).
    There are none if the interface is not flat, or its slave is not over its master.
    """
    return uniform_penetrations(_panels()) if interface is None else given_interface.flat_cases(interface)


@st.composite
def uniform_penetrations(draw: DrawFn, panels: SearchStrategy[list[Sides]]) -> Case:
    """Draw meshes and push the slave into the master by the same depth everywhere; the case is that of `flat_cases`."""
    sides = draw(panels)
    quarters, unit = draw(_DEPTHS), draw(parts.depth_units())
    motion, penalty, seed = draw(parts.motions()), draw(parts.penalties()), draw(parts.seeds())
    slide, shuffle = draw(_SLIDES), draw(parts.shuffles())
    penetration = quarters / 4 * unit * min(shortest(_line(x)) for side in sides for x in side)
    interface, z, along = assemble_panels([_panel(*side, penetration, slide) for side in sides], motion, shuffle)
    parameters = {"penetration": np.array(penetration * motion.scale), "along": along, "direction": motion.direction}
    return Case(interface, z, penalty, parameters, seed)


@cache
def _panels() -> SearchStrategy[list[Sides]]:
    # The refinement is drawn first and shrinks first, or one segment in four would count as simpler than one in two.
    overhang = st.integers(0, 3)
    side = st.builds(
        _places, _REFINEMENTS, _REPEATS, parts.lengths(), parts.lengths(), overhang, overhang, parts.SEVENTHS
    )
    return st.one_of(st.lists(side, min_size=1, max_size=1), st.lists(side, min_size=1, max_size=2))


def _places(
    refinement: int, repeats: int, slave: Sequence[float], master: Sequence[float], left: int, right: int, sevenths: int
) -> Sides:
    """Return the ascending x of the nodes of a slave chain and of a master chain that covers it.

    The master goes beyond the slave by `left` and `right`.

    What the master lengths do not cover is one more segment, and what is too much is cut; refined ones are repeated
    as long as needed. The slave moves into the left overhang by some sevenths of it.
    """
    slave_x = parts.ends_of([*slave] * repeats)
    end = slave_x[-1] + right
    master_x = [-float(left)]
    for length in cycle(master) if refinement else master:
        following = master_x[-1] + length * 2.0**-refinement
        if following >= end or len(master_x) == MOST_MASTER_SEGMENTS:
            break
        master_x.append(following)
    return slave_x - left * sevenths / 7, np.array([*master_x, end])


def _line(x: FloatArray, height: float = 0.0) -> FloatArray:
    return np.column_stack([x, np.full(len(x), height)])


def _panel(slave_x: FloatArray, master_x: FloatArray, penetration: float, slide: int) -> Panel:
    return Panel(_line(slave_x, -penetration), _line(master_x[::-1]), _line(slave_x + slide))


@random_source("contactverif.strategies.class_meshes.normal_cases", needs=OF_CLASS)
def normal_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases of uniform penetration whose inner master nodes all lie on slave nodes.

    Given an interface, states of that one; None if it is not flat, not covered, or not of this class.
    """
    return _cases(interface, midpoints=False)


@random_source("contactverif.strategies.class_meshes.single_cases", needs=OF_CLASS)
def single_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases of uniform penetration whose inner master nodes lie on slave nodes or in the middle of segments.

    Given an interface, states of that one; None if it is not flat, not covered, or not of this class.
    """
    return _cases(interface, midpoints=True)


@random_source("contactverif.strategies.class_meshes.overhung_cases", needs=OF_CLASS)
def overhung_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases as `single_cases` does, on meshes whose master goes beyond the slave by half a segment or more.

    No master node lies on an end node of the slave, so no node of either surface faces a free end of the other. Given
    an interface, this is `single_cases`.
    """
    return _cases(interface, midpoints=True, least=1)


def _cases(interface: Interface | None, *, midpoints: bool, least: int = 0) -> SearchStrategy[Case] | None:
    if interface is None:
        return uniform_penetrations(_class_panels(midpoints, least))
    states, direction = flat_cases(interface), given_interface.slave_direction(interface)
    if states is None or direction is None:
        return None
    return states if is_of_class(interface, interface.nodes @ direction, midpoints=midpoints) else None


@cache
def _class_panels(midpoints: bool, least: int) -> SearchStrategy[list[Sides]]:
    middles, overhang = _CARRIES if midpoints else st.just([0]), st.integers(least, _FURTHEST)
    side = st.builds(
        _class_places, _CLASS_REPEATS, parts.lengths(), _CARRIES, middles, overhang, overhang, st.just(least > 0)
    )
    return st.one_of(st.lists(side, min_size=1, max_size=1), st.lists(side, min_size=1, max_size=2))


def _class_places(
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
    segments = np.array([*slave] * repeats)
    slave_x = parts.ends_of([*slave] * repeats)
    deal = partial(parts.repeat_cyclically, count=len(slave_x))
    nodes = slave_x[deal(at_nodes) == 1]
    nodes = nodes[(nodes > slave_x[0]) & (nodes < slave_x[-1])] if inner else nodes
    middles = (slave_x[:-1] + segments / 2)[deal(at_middles)[:-1] == 1]
    first, last = slave_x[0] - left / 2 * segments[0], slave_x[-1] + right / 2 * segments[-1]
    return slave_x, np.unique(np.concatenate([[first], nodes, middles, [last]]))
