"""Flat interfaces: any meshes, those of the paper's classes, and states with many bits.

In the first two each slave chain lies wholly over one master chain; ends may coincide. Neighbours' lengths differ by up
to 2^20, and up to 100 master segments lie under one slave segment. `contactverif.oracle.is_of_class` says what the
classes are: of the slave's nodes, and of the middles of its segments, some carry a master node.

The last ones stand on multiples of 2^-40, or of 2^-32 if they are moved by up to 2^20, and are turned and stretched by
a Pythagorean triple. All this is exact, but products of the turned coordinates are rounded.
"""

from collections.abc import Sequence
from functools import cache
from itertools import cycle
from typing import overload

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, random_source
from contactverif.contract.interface import Interface
from contactverif.oracle.flat_answers import is_of_class
from contactverif.problems.flat_states import Turn, flat_master, flat_state
from contactverif.strategies import given_interface, samples
from contactverif.strategies.translations import FINENESS, exact_shifts

Sides = tuple[FloatArray, FloatArray]  # The ascending x of the nodes of a slave chain and of a master chain below it.

FLAT = "a straight slave over a parallel master that covers it"
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
    return _uniform_penetrations(_panels()) if interface is None else given_interface.flat_cases(interface)


@st.composite
def _uniform_penetrations(draw: DrawFn, sides: SearchStrategy[list[Sides]]) -> Case:
    lines = draw(sides)
    quarters, unit = draw(_DEPTHS), draw(samples.depth_units())
    motion, penalty, seed = draw(samples.motions()), draw(samples.PENALTIES), draw(samples.SEEDS)
    slide, shuffle = draw(_SLIDES), draw(samples.SHUFFLES)
    penetration = quarters / 4 * unit * min(samples.shortest(_line(x)) for line in lines for x in line)
    panels = [samples.Panel(_line(x, -penetration), _line(below[::-1]), _line(x + slide)) for x, below in lines]
    interface, z, along = samples.assemble_panels(panels, motion, shuffle)
    parameters = {"penetration": np.array(penetration * motion.scale), "along": along, "direction": motion.direction}
    return Case(interface, z, penalty, parameters, seed)


@cache
def _panels() -> SearchStrategy[list[Sides]]:
    # The refinement is drawn first and shrinks first, or one segment in four would count as simpler than one in two.
    overhang, lengths = st.integers(0, 3), samples.lengths()
    side = st.builds(_places, _REFINEMENTS, _REPEATS, lengths, lengths, overhang, overhang, samples.SEVENTHS)
    return samples.one_or_two(side)


def _places(
    refinement: int, repeats: int, slave: Sequence[float], master: Sequence[float], left: int, right: int, sevenths: int
) -> Sides:
    """Return a slave chain, and a master chain that goes beyond it by `left` and `right`; the last one is cut."""
    slave_x = samples.ends_of([*slave] * repeats)
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


@random_source("contactverif.strategies.class_meshes.normal_cases", needs=OF_CLASS)
def normal_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases of uniform penetration whose inner master nodes all lie on slave nodes.

    Given an interface, states of that one; None if it is not flat, not covered, or not of this class.
    """
    return _cases(interface, midpoints=False)


@random_source("contactverif.strategies.class_meshes.single_cases", needs=OF_CLASS)
def single_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases as `normal_cases` does, whose inner master nodes may also lie in the middle of slave segments."""
    return _cases(interface, midpoints=True)


@random_source("contactverif.strategies.class_meshes.overhung_cases", needs=OF_CLASS)
def overhung_cases(interface: Interface | None = None) -> SearchStrategy[Case] | None:
    """Return cases as `single_cases` does, on meshes whose master goes beyond the slave by half a segment or more.

    No master node lies on an end node of the slave, so no node of either surface faces a free end of the other.
    """
    return _cases(interface, midpoints=True, least=1)


def _cases(interface: Interface | None, *, midpoints: bool, least: int = 0) -> SearchStrategy[Case] | None:
    if interface is None:
        return _uniform_penetrations(_class_panels(midpoints, least))
    states, direction = flat_cases(interface), given_interface.slave_direction(interface)
    if states is None or direction is None:
        return None
    return states if is_of_class(interface, interface.nodes @ direction, midpoints=midpoints) else None


@cache
def _class_panels(midpoints: bool, least: int) -> SearchStrategy[list[Sides]]:
    middles, overhang = _CARRIES if midpoints else st.just([0]), st.integers(least, _FURTHEST)
    sides = samples.lengths(), _CARRIES, middles, overhang, overhang, st.just(least > 0)
    return samples.one_or_two(st.builds(_class_places, _CLASS_REPEATS, *sides))


def _class_places(
    repeats: int,
    slave: Sequence[float],
    at_nodes: Sequence[int],
    at_middles: Sequence[int],
    left: int,
    right: int,
    inner: bool,
) -> Sides:
    """Return a slave chain, and a master chain with nodes on its nodes; `inner` leaves the slave's end nodes free."""
    segments = np.array([*slave] * repeats)
    slave_x = samples.ends_of(segments)
    carries, middle_carries = (samples.repeat_cyclically(each, len(slave_x)) == 1 for each in (at_nodes, at_middles))
    if inner:
        carries[[0, -1]] = False
    nodes, middles = slave_x[carries], (slave_x[:-1] + segments / 2)[middle_carries[:-1]]
    first, last = slave_x[0] - left / 2 * segments[0], slave_x[-1] + right / 2 * segments[-1]
    return slave_x, np.unique(np.concatenate([[first], nodes, middles, [last]]))


_TURNS: tuple[Turn, ...] = ((4, 3, 5), (12, -5, 13), (-3, 4, 5), (-5, -12, 13))
_FINENESS_AT_REST = 40
_COARSE = 12  # The bits of the places of a slave that is not parallel to the master.
_ANY_TURN = st.sampled_from(_TURNS)
_QUARTERS = st.integers(1, 7)
_EXPONENTS, _COARSE_EXPONENTS = st.integers(6, 28), st.integers(6, 12)  # Of the penetration 2^-e.
_RISES = st.sampled_from([1, -1, 2, -2, 3, -3])
_SHIFTS = st.one_of(st.just(np.zeros(2)), exact_shifts())
_LENGTHS = st.lists(st.integers(1, 4), min_size=1, max_size=4)


@samples.on_own_meshes
def exact_flat_cases(draw: DrawFn) -> Case:
    """Return states of uniform penetration, near the origin, whose exact forces are rationals.

    Cases have the parameters of `contactverif.problems.flat_states.flat_state`, and "shift" (2,), a length each: a
    translation that rounds no coordinate. The penetration is 2^-28 to 2^-6 of a segment; every slave point projects
    inside the master.
    """
    return _lattice_state(draw, tilted=False)


@samples.on_own_meshes
def linear_flat_cases(draw: DrawFn) -> Case:
    """Return states like those of `exact_flat_cases` whose slave is straight and has a slope, the parameter "slope"."""
    return _lattice_state(draw, tilted=True)


def _lattice_state(draw: DrawFn, *, tilted: bool) -> Case:
    turn, slave_lengths, master_lengths = draw(_ANY_TURN), draw(_LENGTHS), draw(_LENGTHS)
    if tilted:
        depth, rise = 2.0 ** -draw(_COARSE_EXPONENTS), draw(_RISES)
    else:
        depth, rise = draw(_QUARTERS) / 4 * 2.0 ** -draw(_EXPONENTS), 0
    penalty, seed = draw(samples.PENALTIES), draw(samples.SEEDS)
    shift, offsets = draw(_SHIFTS), draw(samples.OFFSETS)
    fineness = FINENESS if tilted or shift.any() else _FINENESS_AT_REST

    def place(x: FloatArray, over: int, bits: int) -> FloatArray:  # Moved by up to 1/16, and rounded.
        return samples.on_lattice(x + samples.repeat_cyclically(offsets, len(x)) / over / 16, bits)

    slave, master = samples.ends_of(slave_lengths), samples.ends_of(master_lengths)
    end = slave[-1] + 1  # The master goes beyond the slave by 1.
    # Heights are places times a power of two, so that they need some bits more than places.
    slave = place(slave, 7, _COARSE if tilted else fineness)
    master = place(np.array([-1.0, *master[master < end], end]), 13, fineness)
    case = flat_state("", slave.tolist(), flat_master(master.tolist()), depth, turn=turn)
    positions, parameters = case.positions.copy(), {**case.parameters, "shift": shift}
    if tilted:
        # The longest slave is 16 long, so that the penetration is 5/8 of that of the middle node or more.
        slope = depth * rise / 128
        (p, q, _), middle = turn, slave[len(slave) // 2]
        positions[: len(slave)] += np.outer(slope * (slave - middle), [-q, p])
        parameters = {"direction": case.parameters["direction"], "slope": np.array(slope), "shift": shift}
    return Case(case.interface, positions.reshape(-1), penalty, parameters, seed)
