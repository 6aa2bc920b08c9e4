"""Cases by kind of projection: a few segments drawn by hand, with one slave point that faces the master in that way.

`Case.kind` names the kind; the parameters "probe_segment" and "probe_c" name the slave point. Every kind is
constructed, and none is filtered; `contactverif.oracle.is_of_kind` says whether a case is of its kind, and a test asks.

A sketch stands on a lattice so coarse that an exact turn moves it without rounding, even to an offset of 2^20.
Coordinates are below 2^8 and multiples of 2^-32, so what a sketch shows exactly (a tie, a hit node) stays exact. Only a
sketch whose kind survives rounding may set `exact` to False; it gets a full mantissa.

The segment of a sketch lies on the x-axis, its left node at the origin, and the slave is above. Of a vertex or a tie,
the vertex or the slave point is the origin.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import cos, floor, ldexp, log2, radians, sin
from typing import Self

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn, SearchStrategy

from contactverif.contract.arrays import FloatArray
from contactverif.contract.case import Case
from contactverif.contract.interface import Interface
from contactverif.oracle.projection_kinds import TAU, kind_of
from contactverif.strategies import samples
from contactverif.strategies.given_interface import touches
from contactverif.strategies.samples import Chain

Point = tuple[float, float]
Steps = tuple[list[Point], int]  # Vectors of slave segments from left to right, and which of them carries the point.

_PAST = float(TAU)  # Formulations may still see contact past a free end by this share of the segment.
_FINEST = 31  # Distances from a bisector go down to 2^-31 and 0.
_NODES_AND_OTHERS = (-1.0, 1.0, -0.5, 0.5, 0.0, -1.0, 1.0)  # Places c; every other one is a node.
_C = st.sampled_from(_NODES_AND_OTHERS)
# With Gauss points, which are not on the lattice.
_ROUND_C = st.sampled_from((*_NODES_AND_OTHERS, -(3**-0.5), 3**-0.5, 0.75))
_TILTS = st.sampled_from([0.0, 0.125, -0.125, 0.375, -0.375, 1.0, -1.0])  # The slope of a slave segment.
_STRETCHES = st.sampled_from([1.0, 2.0, 0.5, 0.75])  # The slave's reference over its present length.
_COUNTS = st.integers(0, 2)
# Whether a second pair of chains is in contact. Hypothesis draws the simplest value more often than others, so two
# draws decide.
_COMPANY = st.tuples(*[st.sampled_from([False, True, True, True])] * 2).map(any)
_LENGTHS = st.sampled_from([1.0, 2.0, 0.5, 0.25, 4.0])
_WHOLE_LENGTHS = st.integers(1, 8).map(float)
_NEIGHBOURS = st.lists(st.tuples(st.sampled_from([1.0, 2.0, 0.5, 3.0]), _TILTS), max_size=2)  # (length, slope)
_SIDES = st.sampled_from([1.0, 2.0, 4.0, 3.0])
_SLOPES = st.sampled_from([0.0, 0.125, 0.5, 1.0])
_ENDS = st.lists(st.sampled_from([1.0, 2.0]), max_size=1)


def _gap(exponent: int, part: float, sign: int) -> float:
    # All gaps take as many draws, or hypothesis would count zero as the simplest one.
    return ldexp(sign * part, -exponent)


# Gaps in units of a segment: 1e-9 to 1/2, half of them in penetration, some exactly zero.
_SIZES = st.integers(1, 28), st.sampled_from([1.0, 0.75])
_GAPS = st.builds(_gap, *_SIZES, st.sampled_from([-1, 1, -1, 1, -1, 0]))
_NONZERO_GAPS = st.builds(_gap, *_SIZES, st.sampled_from([-1, 1]))


_ANY_MOTIONS = st.one_of(samples.exact_turns(), samples.motions(), samples.motions(furthest=samples.FURTHEST))


@dataclass(frozen=True, slots=True)
class Sketch:
    """Slave and master chains, and the slave point that they are about."""

    # The master's chains, the body on the left: a master on the x-axis runs in −x, a slave above it in +x.
    masters: Sequence[Chain]
    slave: Chain
    segment: int  # The number of the slave segment that carries the point, on the walk.
    c: float  # The place of the point on its segment, from −1 to 1.
    exact: bool = False  # Rounding would spoil the kind.
    ordered: bool = False  # The numbers of nodes on the walk matter.
    mirrored: bool = True  # The mirror image is of the same kind.

    def mirror(self) -> Self:
        """Return the mirror image in the y-axis, every chain walked the other way."""

        def flip(chain: Chain) -> Chain:
            return replace(chain, points=chain.points[::-1] * [-1, 1] + 0.0)

        n_segments = len(self.slave.points) - (not self.slave.closed)
        # A closed chain keeps its joint between the last node and the first.
        segment = n_segments - 1 if self.slave.closed else n_segments - 1 - self.segment
        masters = [flip(chain) for chain in self.masters]
        return replace(self, masters=masters, slave=flip(self.slave), segment=segment, c=-self.c)


@st.composite
def _cases_of_kind(draw: DrawFn, kind: str, sketches: SearchStrategy[Sketch]) -> Case:
    """Draw a sketch and put it somewhere, mostly beside a pair in contact, since many kinds are open or past an end."""
    sketch = draw(sketches)
    if sketch.mirrored and draw(st.booleans()):
        sketch = sketch.mirror()
    motion = draw(samples.exact_turns() if sketch.exact else _ANY_MOTIONS)
    penalty, seed = draw(samples.PENALTIES), draw(samples.SEEDS)
    stretch, shuffle = draw(_STRETCHES), 0 if sketch.ordered else draw(samples.SHUFFLES)
    reference = replace(sketch.slave, points=sketch.slave.points * stretch)
    slaves, masters, references = [sketch.slave], list(sketch.masters), [reference]
    if draw(_COMPANY):  # Drawn last, so that it goes first.
        # It is upside down: the slave is below and runs in −x, the master above in +x. So no slave of a sketch, which
        # runs in +x, faces that master, and none is near it.
        points = np.vstack([chain.points for chain in (*slaves, *masters)])
        low, high = np.floor(points.min(axis=0)), np.ceil(points.max(axis=0))
        x, y = high[0] + (high - low).max(), low[1]
        slave = Chain(np.array([[x + 1.5, y + 0.125], [x + 0.5, y + 0.125]]))
        master = Chain(np.array([[x, y], [x + 2.0, y]]))
        slaves, masters, references = [*slaves, slave], [*masters, master], [*references, slave]
    interface, order = samples.assemble_chains(slaves, masters, references, motion.scale, shuffle)
    current = np.vstack([chain.points for chain in (*slaves, *masters)])[order]
    (segment,) = np.flatnonzero(order[interface.slave.segments[:, 0]] == sketch.segment)
    parameters = {"probe_segment": np.array(float(segment)), "probe_c": np.array(sketch.c)}
    return Case(interface, motion(current).reshape(-1), penalty, parameters, seed, kind=kind)


@st.composite
def _slave_steps(draw: DrawFn, unit: float) -> Steps:
    before, after = draw(_COUNTS), draw(_COUNTS)
    length = unit * draw(_LENGTHS)
    return [(length, length * draw(_TILTS)) for _ in range(before + 1 + after)], before


def _sketch(masters: Sequence[Chain], point: Point, c: float, steps: Steps, **flags: bool) -> Sketch:
    """Return the sketch of an open slave chain that has the point at c of one of its segments."""
    vectors, segment = np.array(steps[0], dtype=np.float64), steps[1]
    nodes = np.concatenate([np.zeros((1, 2)), np.cumsum(vectors, axis=0)])
    start = np.array(point) - nodes[segment] - (1 + c) / 2 * vectors[segment]
    return Sketch(masters, Chain(nodes + start), segment, c, **flags)


def _upper_side(left_to_right: Sequence[Point]) -> Chain:
    """Return the chain of a body below these points."""
    return Chain(np.array(left_to_right, dtype=np.float64)[::-1])


def _graph(draw: DrawFn, length: float, *, left: bool = True, slopes: bool = True) -> Chain:
    """Draw a master that is a graph with slopes up to 45° besides the segment from (0, 0) to (length, 0).

    A point over that segment, no farther from it than from its ends, is nearer to it than to all others.
    """
    right_to_left: list[Point] = [(length, 0.0), (0.0, 0.0)]
    for size, slope in draw(_NEIGHBOURS):
        x, y = right_to_left[0]
        right_to_left.insert(0, (x + size, y + size * slope * slopes))
    for size, slope in draw(_NEIGHBOURS) if left else ():
        x, y = right_to_left[-1]
        right_to_left.append((x - size, y + size * slope * slopes))
    return Chain(np.array(right_to_left))


@st.composite
def _feet_inside(draw: DrawFn, *, exact: bool = False) -> tuple[float, Point]:
    """Draw a length, and a point over the inside of a segment of that length, no farther from it than from its ends."""
    length, denominator = draw(_WHOLE_LENGTHS), 8 if exact else draw(st.sampled_from([8, 7]))
    part = draw(st.integers(1, denominator - 1)) / denominator
    room = 2.0 ** floor(log2(2 * min(part, 1 - part)))
    return length, (part * length, draw(_GAPS) * room * length)


def _inside(draw: DrawFn) -> Sketch:
    """Draw a foot inside a segment, whose neighbours are bent by up to 45°."""
    length, point = draw(_feet_inside())
    c, steps = draw(_ROUND_C), draw(_slave_steps(length))
    return _sketch([_graph(draw, length)], point, c, steps)


def _angle(draw: DrawFn, degrees: float) -> Sketch:
    """Draw a foot inside a segment; the slave segment is turned against the master by this angle, either way."""
    exact = {90.0: (0.0, 1.0), 180.0: (-1.0, 0.0)}
    length, point = draw(_feet_inside(exact=degrees in exact))
    c, size = draw(_C), length * draw(st.sampled_from([1.0, 0.5, 2.0]))
    along, across = exact.get(degrees, (cos(radians(degrees)), sin(radians(degrees))))
    vectors = [(size * along, size * across * draw(st.sampled_from([1.0, -1.0])))] * draw(st.integers(1, 3))
    segment = draw(st.integers(0, len(vectors) - 1))
    return _sketch([_graph(draw, length)], point, c, (vectors, segment), exact=degrees in exact)


def _one_of_several(draw: DrawFn, role: str) -> Sketch:
    """Draw a slave segment over three to six master segments; its point is over the first, the last, or another."""
    width = draw(_WHOLE_LENGTHS)
    c = draw(st.sampled_from({"first": (0.5, 1.0), "intermediate": (0.0, -0.5, 0.5), "last": (-0.5, -1.0)}[role]))
    # Master nodes lie at odd sixteenths of the slave segment, and the point at an eighth.
    here = round(8 * (1 + c))
    fewest, odd = 1 if role == "intermediate" else 2, list[int]()
    for side, places in (("first", (0, here // 2 - 1)), ("last", (here // 2, 7))):  # Left of the point, and right of it
        if role in (side, "intermediate"):
            odd += draw(st.lists(st.integers(*places), min_size=fewest, max_size=fewest + 1, unique=True))
    beyond = draw(st.tuples(st.sampled_from([0.25, 1.0]), st.sampled_from([0.25, 1.0])))
    nodes = [-beyond[0], *((2 * k + 1) / 16 for k in sorted(odd)), 1 + beyond[1]]
    before, after = draw(st.integers(0, 1)), draw(st.integers(0, 1))
    tilt = draw(st.sampled_from([0.0, 0.125, -0.125, 0.25]))
    point = ((1 + c) / 2 * width, draw(_GAPS) * width / 8)
    steps = [(width, tilt * width)] * (before + 1 + after), before
    return _sketch([_upper_side([(node * width, 0.0) for node in nodes])], point, c, steps, mirrored=False)


def _past_end(draw: DrawFn, *, inside: bool) -> Sketch:
    """Draw a point past the free left end of the master by somewhat less, or somewhat more, than τ of its segment."""
    length, c = draw(_WHOLE_LENGTHS), draw(_ROUND_C)
    off = ldexp(1.0, -draw(st.integers(1 if inside else -7, 20)))
    past = _PAST * (1 - off if inside else 1 + off)
    steps, gap = draw(_slave_steps(length)), draw(_GAPS) * length
    return _sketch([_graph(draw, length, left=False)], (-past * length, gap), c, steps)


def _free_end(draw: DrawFn) -> Sketch:
    """Draw a point whose foot is exactly the free left end of the master."""
    length, c = draw(_WHOLE_LENGTHS), draw(_C)
    steps, gap = draw(_slave_steps(length)), draw(_GAPS) * length
    return _sketch([_graph(draw, length, left=False)], (0.0, gap), c, steps, exact=True)


def _small_overlap(draw: DrawFn) -> Sketch:
    """Draw a slave whose last node is 2^-k of a master segment inside the master's free end, the rest outside."""
    length, overlap = draw(_WHOLE_LENGTHS), ldexp(1.0, -draw(st.integers(2, 30)))
    vectors, segment = draw(_slave_steps(2 * length))
    point, steps = (overlap * length, draw(_GAPS) * length * 0.5), (vectors[: segment + 1], segment)
    return _sketch([_graph(draw, length, left=False)], point, 1.0, steps, exact=True)


def _closing_segment(draw: DrawFn) -> Sketch:
    """Draw a disc or a hole, and a point over its closing segment; the slave is open, or a closed box."""
    length, (x, y) = draw(_feet_inside())
    height = length * draw(st.sampled_from([-1.0, 1.0, -2.0, 2.0]))  # Below the x-axis is a disc, above it a hole.
    between = draw(st.sampled_from([[], [0.5], [0.25, 0.75]]))
    nodes = [(0.0, 0.0), (0.0, height), *((length * part, height) for part in between), (length, height), (length, 0.0)]
    masters, point, size = [Chain(np.array(nodes), closed=True)], (x, y / 2), length / 4
    c, steps = draw(_ROUND_C), draw(_slave_steps(size))
    if not draw(st.booleans()):
        return _sketch(masters, point, c, steps, ordered=True)
    sketch = _sketch(masters, point, c, ([(size, 0.0)], 0), ordered=True)
    left, right = sketch.slave.points
    box = np.array([right, right + [0, size], left + [0, size], left])
    return replace(sketch, slave=Chain(box, closed=True), segment=3)


def _second_body(draw: DrawFn) -> Sketch:
    """Draw another chain of the master behind the first; the point may even be nearer to the second."""
    length, part = draw(_WHOLE_LENGTHS), draw(st.integers(1, 7)) / 8
    behind = length * draw(st.sampled_from([1.0, 0.25, 0.0625]))
    gap = draw(_GAPS) * behind
    if draw(st.sampled_from([False, False, False, True])) and gap < 0:
        gap = -behind - gap
    c, steps = draw(_ROUND_C), draw(_slave_steps(length / 8))
    first = _graph(draw, length, slopes=False)
    cuts = draw(st.sampled_from([[], [0.5625], [0.3125, 0.6875]]))  # Odd sixteenths: the point is at an eighth.
    second = _upper_side([(x * length, -behind) for x in (-0.5, *cuts, 1.5)])
    if draw(st.booleans()):  # The second chain faces away: it is the lower side of the first body.
        second = Chain(second.points[::-1])
    return _sketch([first, second], (part * length, gap), c, steps)


def _other_node(draw: DrawFn) -> Sketch:
    """Draw a point over the middle of a long segment, nearer to the tip of a hook than to both ends of it."""
    c, tip = draw(_ROUND_C), (8.0 + draw(st.integers(0, 2)), draw(st.sampled_from([3.0, 4.0, -3.0, -4.0])))
    steps, gap = draw(_slave_steps(0.25)), 2 * draw(_GAPS)
    return _sketch([_upper_side([(0.0, 0.0), (16.0, 0.0), tip])], (8.0, gap), c, steps)


def _node_hit(draw: DrawFn) -> Sketch:
    """Draw a point whose foot is exactly a node between two segments, collinear or bent so that it stays nearest."""
    gap, right, left = draw(_NONZERO_GAPS), draw(_SIDES), draw(_SIDES)
    slope = draw(_SLOPES) * (1 if gap < 0 else -1)
    line = [(-left, slope * left), (0.0, 0.0), (right, 0.0), *((right + length, 0.0) for length in draw(_ENDS))]
    return _sketch([_upper_side(line)], (0.0, gap), draw(_C), draw(_slave_steps(1.0)), exact=True)


def _coincident_nodes(draw: DrawFn) -> Sketch:
    """Draw matching meshes: each slave node stands over a master node, at the same place if the gap is zero."""
    steps = draw(st.lists(st.tuples(_SIDES, _SLOPES, st.sampled_from([1, -1])), min_size=1, max_size=4))
    level, gap = draw(st.sampled_from([True, False])), draw(_GAPS)
    line = [(0.0, 0.0)]
    for length, slope, sign in steps:
        line.append((line[-1][0] + length, line[-1][1] + (0.0 if level else sign * slope * length)))
    more = [(line[-1][0] + length, line[-1][1]) for length in draw(_ENDS)]
    segment, c = draw(st.integers(0, len(steps) - 1)), draw(st.sampled_from([-1.0, 1.0]))
    slave = Chain(np.array([(x, y + (gap if level else 0.0)) for x, y in line]))
    return Sketch([_upper_side(line + more)], slave, segment, c, exact=True)


def _vertex(draw: DrawFn, up: int = 0) -> Sketch:
    """Draw a point near the bisector of a vertex, on it, or off it by 2^-k, on either side of the master.

    The neighbours of the vertex are up (1) or down (−1) from it; by default either, and steep, so that it is sharp.

    Where the vertex sticks out, a penetrating point may be nearest to two segments, and an open one to the node alone;
    where it sticks in, it is the other way round.
    """
    slopes = [1.0, 0.5, 0.25, 0.125] if up else [2.0, 4.0, 8.0]
    up, steep = up or draw(st.sampled_from([-1, 1])), draw(st.sampled_from(slopes))
    left, right = draw(_SIDES), draw(_SIDES)
    line = [(-left, up * steep * left), (0.0, 0.0), (right, up * steep * right)]
    line += [(line[-1][0] + length, line[-1][1]) for length in draw(_ENDS)]
    gap, c, steps = draw(_NONZERO_GAPS), draw(_C), draw(_slave_steps(1.0))
    point = (draw(_off_the_bisector(abs(gap) * min(steep, 1.0))), gap)
    return _sketch([_upper_side(line)], point, c, steps, exact=True)


@st.composite
def _off_the_bisector(draw: DrawFn, reach: float) -> float:
    """Draw a distance from the bisector, below the reach: 0 or a power of two, on either side."""
    nearest = 1
    while ldexp(1.0, -nearest) >= reach:
        nearest += 1
    if nearest > _FINEST:
        return 0.0
    size = st.integers(nearest, _FINEST).map(lambda k: ldexp(1.0, -k))
    return draw(st.one_of(st.just(0.0), size, size.map(lambda distance: -distance)))


def _three_segments(draw: DrawFn) -> Sketch:
    """Draw the centre of a groove or of a rib: three segments are equally near."""
    width, wall = draw(_SIDES), draw(st.sampled_from([1.0, 0.5, 2.0]))
    top, groove = wall * width, draw(st.booleans())
    line = [(-width, top), (-width, -width), (width, -width), (width, top)]
    return _at_origin(draw, line if groove else [(x, -y) for x, y in line])


def _three_nodes(draw: DrawFn) -> Sketch:
    """Draw a point to which three tips of the master, or three bottoms of its grooves, are equally near."""
    end = draw(st.sampled_from([8.0, 6.0]))
    tips = [(-5.0, -end), (-3.0, -4.0), (-2.0, -end), (0.0, -5.0), (2.0, -end), (3.0, -4.0), (5.0, -end)]
    return _at_origin(draw, tips if draw(st.booleans()) else [(x, -y) for x, y in tips])


def _at_origin(draw: DrawFn, line: Sequence[Point]) -> Sketch:
    return _sketch([_upper_side(line)], (0.0, 0.0), draw(_C), draw(_slave_steps(0.5)), exact=True)


_MAKERS: dict[str, Callable[[DrawFn], Sketch]] = {
    "inside a segment": _inside,
    "first of several segments": lambda draw: _one_of_several(draw, "first"),
    "intermediate of several segments": lambda draw: _one_of_several(draw, "intermediate"),
    "last of several segments": lambda draw: _one_of_several(draw, "last"),
    "node hit exactly": _node_hit,
    "coincident nodes": _coincident_nodes,
    "convex vertex": lambda draw: _vertex(draw, -1),
    "concave vertex": lambda draw: _vertex(draw, 1),
    "master angle below 90°": _vertex,
    "equidistant from three segments": _three_segments,
    "equidistant from three nodes": _three_nodes,
    "free end hit exactly": _free_end,
    "past a free end, inside τ": lambda draw: _past_end(draw, inside=True),
    "past a free end, outside τ": lambda draw: _past_end(draw, inside=False),
    "overlap going to zero": _small_overlap,
    "edge-on, 89.9°": lambda draw: _angle(draw, 89.9),
    "edge-on, 90°": lambda draw: _angle(draw, 90.0),
    "from behind": lambda draw: _angle(draw, 180.0),
    "second body behind": _second_body,
    "closing segment": _closing_segment,
    "nearest node not on nearest segment": _other_node,
}
KINDS = tuple(_MAKERS)
_NEAR = st.integers(1, 20).map(lambda k: ldexp(1.0, -k))
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
def projections_by_kind() -> dict[str, SearchStrategy[Case]]:
    """Return a strategy for each kind, so that each gets its share of a run.

    The parameters "probe_segment" and "probe_c" of a case name the slave point of this kind.
    """
    return {kind: _cases_of_kind(kind, st.composite(make)()) for kind, make in _MAKERS.items()}


@st.composite
def projection_states(draw: DrawFn, interface: Interface) -> Case:
    """Draw a state of the interface: a point of a slave segment stands in or past a master segment, or on it.

    The slave is moved as a whole. On any mesh another segment may turn out to be nearer, so the oracle names the kind.
    Where nothing touches, a node is set into the master: a run on a mesh of the user shall have contact to judge.
    """
    slave_segment = draw(st.integers(0, len(interface.slave) - 1))
    home = draw(st.integers(0, len(interface.master) - 1))
    c, xi, gap, degrees = draw(_ROUND_C), draw(_FEET), draw(_GAPS), draw(_DEGREES)
    if draw(st.booleans()):
        xi = 1 - xi
    penalty, seed = draw(samples.PENALTIES), draw(samples.SEEDS)
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
    """Return positions (n_nodes, 2) with the slave's point c at `gap`, in master segments, above ξ, and turned."""
    positions = interface.nodes.copy()
    first, second = positions[interface.master.segments[foot[0]]]
    along = second - first
    target = first + foot[1] * along + gap * np.array([along[1], -along[0]])
    slave, c = positions[: interface.n_slave_nodes], point[1]
    a, b = slave[interface.slave.segments[point[0]]]
    angle = np.arctan2(-along[1], -along[0]) - np.arctan2(*(b - a)[::-1]) + np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    slave[:] = (slave - ((1 - c) / 2 * a + (1 + c) / 2 * b)) @ turn.T + target
    return positions
