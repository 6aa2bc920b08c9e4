"""A straight or plane slave that penetrates a flat part of a larger master with all of itself: its gap is linear.

In the last ones in the plane the gap is open, and the master ends under a segment of the slave.

Each rule for gaps sees the same straight line or plane opposite. Everything stands on a lattice of 2^-24, in 3-D of
2^-23, and the turns are matrices of integers, so that no coordinate is rounded: straight and plane stay so bit for bit.
"""

from dataclasses import replace
from functools import cache, partial
from itertools import accumulate, cycle, takewhile
from math import ceil, hypot, log2

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case, random_source
from contactverif.contract.interface import TRIANGLE, Interface, Surface
from contactverif.problems.flat_states import SpaceMotion
from contactverif.strategies import samples
from contactverif.strategies.surfaces import surface_grids, surface_pairs

_SLAVE = st.lists(st.sampled_from([1.0, 2.0, 1.5]), min_size=1, max_size=4)
_SIXTEENTHS = st.integers(1, 11)  # The slope of a tilted slave: 0.06 to 0.6 rad.
# The slopes of a steep slave in sixteenths: 35° to 89°, half of them between 80° and 88°.
_STEEP_SIXTEENTHS = st.sampled_from([11, 16, 24, 40, 64, *(91, 112, 144, 200, 288, 448), 912])
_OCTAVES = st.integers(5, 45)
_LEVEL_OR_TILTED = st.integers(0, 11)
_SIGNS = st.sampled_from([1, -1])
_QUARTERS = st.integers(1, 8)  # The depth of the shallow end, in quarters of a unit.
CLEAR = 0.05  # Five times the share of a segment by which a foot may lie past a free end and still count.
_EXPONENTS = st.integers(0, 300).map(lambda hundredths: hundredths / 100)
_NUMBERS = st.integers(0, 3)
_BENDS = st.sampled_from([0.3, 0.9, 0.6, 0.1, -0.1, -0.3])  # Turns of an end of the master in rad, down if positive.
_DISTANCES = st.integers(1, 4)  # Distances of the body behind, in lengths that no depth reaches.


@random_source("contactverif.strategies.straight.tilted_cases")
@samples.on_own_meshes
def tilted_cases(draw: DrawFn) -> Case:
    """Return straight slaves, tilted by 0.06 to 0.6 rad, wholly in contact with a flat master; None for a given mesh.

    The slave's reference is level, so that its lengths there are others than in the state.
    """
    slave, master, _ = _layout(draw, draw(_SIXTEENTHS) * draw(_SIGNS) / 16)
    return _place(draw, slave, master)


@random_source("contactverif.strategies.straight.slight_cases")
@samples.on_own_meshes
def slight_cases(draw: DrawFn) -> Case:
    """Return slaves as `tilted_cases` does, tilted by 2^-5 to 2^-45, near the origin; None for a given mesh."""
    slave, master, _ = _layout(draw, draw(_SIGNS) * 2.0 ** -draw(_OCTAVES))
    return _place(draw, slave, master, near=True)


@random_source("contactverif.strategies.straight.steep_cases")
@samples.on_own_meshes
def steep_cases(draw: DrawFn) -> Case:
    """Return slaves as `tilted_cases` does, tilted by 35° to 89°; None for a given mesh.

    Coordinates along the slave are integers over a power of two, and so are those across it. No rounding bends it.
    """
    slope = draw(_STEEP_SIXTEENTHS) / 16
    x = samples.ends_of(draw(_SLAVE)) * 2.0 ** -ceil(3 + log2(max(slope, 1.0)))  # So the slave is less than 1 high.
    shallow = draw(_QUARTERS) / 4 * draw(samples.depth_units(finest=6)) / 8
    depth = shallow + slope * (x if draw(_SIGNS) > 0 else x[-1] - x)
    # A line along the slave's normal meets the master depth × slope aside. Each master segment is longer than that, so
    # no gap is longer than two segments, and a search that looks no farther than that finds all.
    reach = float(ceil(depth.max() * slope) + 1)
    first, second = (float(samples.on_lattice(np.array(draw(samples.SEVENTHS) / 7))) for _ in range(2))
    x, master_x = x + first, reach * (np.arange(3.0, -2.0, -1.0) - second)
    return _place(draw, np.column_stack([x, -depth]), np.column_stack([master_x, np.zeros(5)]))


@random_source("contactverif.strategies.straight.bent_end_cases")
@samples.on_own_meshes
def bent_end_cases(draw: DrawFn) -> Case:
    """Return slaves, straight and tilted or not, between the bent ends of a master; None for a given mesh.

    The parameter "bent" (n_unknowns,) holds the positions after the two unloaded end segments of the master have turned
    about the nodes that join them to the flat part.
    """
    slave, master, reach = _layout(draw, draw(_LEVEL_OR_TILTED) * draw(_SIGNS) / 16)
    ends = []
    for corner, side in ((master[0], 1.0), (master[-1], -1.0)):
        bend = draw(_BENDS)
        ends.append(samples.on_lattice(corner + reach * np.array([side * np.cos(bend), -np.sin(bend)])))
    straight = np.vstack([master[0] + [reach, 0.0], master, master[-1] - [reach, 0.0]])
    bent = np.vstack([ends[0], master, ends[1]])
    return _place(draw, slave, straight, bent=np.vstack([slave, bent]))


@samples.on_own_meshes
def cases_over_a_body(draw: DrawFn) -> Case:
    """Return slaves as `bent_end_cases` does on a straight master, with a place for a second body; None for a mesh.

    The parameter "behind" (n, 2) holds the nodes of a surface of the second body: it lies behind the master, farther
    than any point penetrates, and is walked as the master is.
    """
    slave, master, reach = _layout(draw, draw(_LEVEL_OR_TILTED) * draw(_SIGNS) / 16)
    depth = reach * draw(_DISTANCES)
    behind = np.column_stack([np.linspace(master[0, 0] + reach, master[-1, 0] - reach, 4), np.full(4, -2 * depth)])
    return _place(draw, slave, master, behind=samples.on_lattice(behind))


@random_source("contactverif.strategies.straight.open_end_cases")
@samples.on_own_meshes
def open_end_cases(draw: DrawFn) -> Case:
    """Return straight slaves over a flat master that ends under one of their segments; None for a given mesh.

    It covers 1e-3 to 1 of that segment. The gap is linear, with a slope of 0.06 to 0.7. Where one of both surfaces ends
    it is least, `CLEAR` to 1 of slope × longest segment. So it is open past that end, as far as a foot still counts.
    """
    segments, slope, left = draw(_SLAVE), draw(_SIXTEENTHS) / 16, draw(_SIGNS) > 0
    x, number = samples.ends_of(segments), draw(_NUMBERS) % len(segments)
    end, stop = float(x[number + 1] - 10.0 ** -draw(_EXPONENTS) * segments[number]), float(x[-1]) + 1
    steps = cycle(draw(samples.lengths(graded=False)))
    master_x = np.array([*takewhile(lambda place: place < stop, accumulate(steps, initial=end)), stop])
    least = CLEAR ** (draw(_EXPONENTS) / 3) * slope * max(*segments, *np.diff(master_x))
    slave = np.column_stack([x, least + slope * (x - end if left else x[-1] - x)])
    master = np.column_stack([master_x[::-1], np.zeros(len(master_x))])
    if draw(_SIGNS) < 0:
        slave, master = slave[::-1] * [-1.0, 1.0], master[::-1] * [-1.0, 1.0]
    return _place(draw, samples.on_lattice(slave), samples.on_lattice(master))


def _layout(draw: DrawFn, slope: float) -> tuple[FloatArray, FloatArray, float]:
    """Draw slave and flat master in walking order, and a length larger than all depths."""
    x = samples.ends_of(draw(_SLAVE))
    shallow = draw(_QUARTERS) / 4 * draw(samples.depth_units(finest=6)) * float((x[1:] - x[:-1]).min())
    depth = shallow + (slope * (x - x[0]) if slope > 0 else slope * (x - x[-1]))
    # Lines along the slave's normal meet the master less than one depth aside; two depths keep off the corners.
    reach = float(ceil(2 * depth.max()) + 1)
    x = x + float(samples.on_lattice(np.array(draw(samples.SEVENTHS) / 7)))
    lengths, end = np.array(draw(samples.lengths(graded=False))), float(ceil(x[-1])) + reach
    # No gap along the slave's normal is longer than twice the longest segments of both: a search may end there.
    while depth.max() * hypot(1.0, slope) > 2 * (np.diff(x).max() + lengths.max()):
        lengths = 2 * lengths
    steps = cycle(lengths.tolist())
    master_x = [*takewhile(lambda place: place < end, accumulate(steps, initial=-reach)), end]
    master = np.column_stack([master_x[::-1], np.zeros(len(master_x))])
    return np.column_stack([x, -depth]), master, reach


def _place(draw: DrawFn, slave: FloatArray, master: FloatArray, near: bool = False, **others: FloatArray) -> Case:
    """Return the case after a motion that rounds nothing, without a shift if `near`; it moves `others` (n, 2), too."""
    motion, penalty = draw(samples.exact_turns()), draw(samples.PENALTIES)
    motion = replace(motion, shift=(0, 0)) if near else motion
    seed, shuffle = draw(samples.SEEDS), draw(samples.SHUFFLES)
    slaves, masters, references = ([samples.Chain(points)] for points in (slave, master, slave * [1.0, 0.0] + 0.0))
    interface, order = samples.assemble_chains(slaves, masters, references, motion.scale, shuffle)
    parameters = {name: motion(points) for name, points in others.items()}
    if "bent" in parameters:  # The positions of all nodes
        parameters["bent"] = parameters["bent"][order].reshape(-1)
    return Case(interface, motion(np.vstack([slave, master])[order]).reshape(-1), penalty, parameters, seed)


# The slopes of a slave. Seen along its own normal, all of it then lies over the master, whatever the turn of that.
_SLOPES = st.sampled_from([0.0, 0.125, -0.125, 0.25, -0.25])
_SIXTEENTHS_OF_DEPTH = st.integers(1, 4)  # The least depth, in sixteenths of the square.
_PARTS = st.integers(-2, 2)
# Heights of the lower side of a plate that is 1 thick. No depth reaches 1, so the master stays the nearest surface.
_HEIGHTS = st.sampled_from([-3.0, 1.0, -5.0, 3.0])


@cache
def _exact_space_turns() -> SearchStrategy[SpaceMotion]:
    """Return rest, or exact similarities with offsets up to 2^16 and scales 2^±20."""
    place = st.one_of(st.integers(-64, 64), st.integers(-(2**16), 2**16))
    exponent = st.one_of(st.just(0), st.integers(-20, 20))
    quaternion = st.tuples(st.integers(1, 3), _PARTS, _PARTS, _PARTS)
    turns = st.builds(partial(SpaceMotion, whole=True), quaternion, st.tuples(place, place, place), exponent)
    return st.one_of(st.just(SpaceMotion(whole=True)), turns, turns)


@random_source("contactverif.strategies.surfaces.plane_slaves.tilted_plane_cases")
@samples.on_own_meshes
def tilted_plane_cases(draw: DrawFn, faces: tuple[int, ...] = (TRIANGLE,)) -> Case:
    """Return states of a plane slave that is tilted by up to 19° against a flat master, and wholly in contact."""
    return _tilted_plane(draw, faces)[0]


@samples.on_own_meshes
def steep_plane_cases(draw: DrawFn, faces: tuple[int, ...] = (TRIANGLE,)) -> Case:
    """Return states as `tilted_plane_cases` does, tilted by 14° to 89°; the slave's edges are short against the depth.

    No gap along the slave's normal is longer than an edge of the master.
    """
    # Quadrilaterals are parallelograms, on which shape functions are polynomials of the place.
    slave, master = (draw(surface_grids(most=3, faces=faces, straight=True)) for _ in range(2))
    slope = 2.0 ** draw(st.integers(-2, 5)) * (1 + draw(_QUARTERS) / 16)
    slopes, shallow = slope * np.array([1.0, draw(_PARTS) / 4]), draw(_QUARTERS) / 32
    turn, penalty, seed = draw(_exact_space_turns()), draw(samples.PENALTIES), draw(samples.SEEDS)
    # Few bits, so that no product is rounded.
    x = samples.on_lattice(slave.points(), 6) * 2.0 ** -ceil(3 + log2(max(slope, 1.0)))
    depth = x @ slopes - (x @ slopes).min() + shallow
    reach = ceil(2 * depth.max() * slope) + 1
    level = np.vstack([x, 6 * reach * (master.points() - 0.5)])
    nodes = np.column_stack([level, np.zeros(len(level))])
    current = nodes.copy()
    current[: len(x), 2] = -depth
    sides = Surface(slave.faces()[:, ::-1]), Surface(master.faces() + len(x))
    return Case(Interface(nodes * turn.scale, *sides), turn(current).reshape(-1), penalty, {}, seed)


@samples.on_own_meshes
def plane_cases_by_a_plate(draw: DrawFn, faces: tuple[int, ...] = (TRIANGLE,)) -> Case:
    """Return states as `tilted_plane_cases` does, with a place for a plate behind the master or at the slave's back.

    The parameter "behind" (8, 3) holds its corners, those of the lower side first, counter-clockwise from above.
    """
    case, turn = _tilted_plane(draw, faces)
    low = draw(_HEIGHTS)
    square = np.array([[-1.0, -1], [2, -1], [2, 2], [-1, 2]])
    plate = np.column_stack([np.vstack([square, square]), np.repeat([low, low + 1], 4)])
    return replace(case, parameters={"behind": turn(plate)})


def _tilted_plane(draw: DrawFn, faces: tuple[int, ...]) -> tuple[Case, SpaceMotion]:
    """Return a case, and the similarity that took it where it is."""
    pair = draw(surface_pairs(same_domain=False, stretched=False, most=4, faces=faces))
    if pair.slave.corners != TRIANGLE:  # Only on parallelograms are shape functions polynomials of the place.
        pair = replace(pair, slave=replace(pair.slave, straight=True))
    slopes, quarters = (draw(_SLOPES), draw(_SLOPES)), draw(_SIXTEENTHS_OF_DEPTH)
    turn, penalty, seed = draw(_exact_space_turns()), draw(samples.PENALTIES), draw(samples.SEEDS)
    interface, plane, domain = pair.lay_out()
    n_slave, current = interface.n_slave_nodes, interface.nodes.copy()
    depth = (abs(slopes[0]) + abs(slopes[1])) / 2 + quarters / 16
    current[:n_slave, 2] = (plane[:n_slave] - domain.mean(axis=0)) @ slopes - depth
    reference = interface.at(interface.nodes * turn.scale)
    return Case(reference, turn(current).reshape(-1), penalty, {}, seed), turn
