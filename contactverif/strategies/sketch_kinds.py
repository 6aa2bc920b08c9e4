"""Sketches of each kind of projection: onto segments, past free ends, at vertices, and ties of several.

Of a segment, it lies on the x-axis, its left node at the origin, and the slave is above. Of a vertex or a tie, the
vertex or the slave point is the origin; all coordinates are exact, and ties are ties.
"""

from __future__ import annotations

from math import cos, floor, ldexp, log2, radians, sin

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from contactverif.strategies.panels import Chain
from contactverif.strategies.sketches import (
    NODES_AND_OTHERS,
    ROUND_PLACES,
    TILTS,
    Sketch,
    gaps,
    nonzero_gaps,
    slave_steps,
    slave_through,
    upper_side,
)

TAU = 1e-2  # Our formulations still see contact past a free end by this share of the segment.
Points = list[tuple[float, float]]
_LENGTHS = st.integers(1, 8).map(float)
_NEIGHBOURS = st.lists(st.tuples(st.sampled_from([1.0, 2.0, 0.5, 3.0]), TILTS), max_size=2)  # (length, slope)
_FINEST = 31  # Distances from a bisector go down to 2^-31 and 0.
_SIDES = st.sampled_from([1.0, 2.0, 4.0, 3.0])
_SLOPES = st.sampled_from([0.0, 0.125, 0.5, 1.0])
_ENDS = st.lists(st.sampled_from([1.0, 2.0]), max_size=1)


@st.composite
def inside(draw: DrawFn) -> Sketch:
    """Draw a foot inside a segment, whose neighbours are bent by up to 45°."""
    length, point = draw(_feet_inside())
    c = draw(st.sampled_from(ROUND_PLACES))
    steps, segment = draw(slave_steps(length))
    return Sketch("inside a segment", [_graph(draw, length)], slave_through(point, c, steps, segment), segment, c)


@st.composite
def angle(draw: DrawFn, kind: str, degrees: float) -> Sketch:
    """Draw a foot inside a segment; the slave segment is turned against the master by this angle, either way."""
    exact = {90.0: (0.0, 1.0), 180.0: (-1.0, 0.0)}
    length, point = draw(_feet_inside(exact=degrees in exact))
    c, size = draw(st.sampled_from(NODES_AND_OTHERS)), length * draw(st.sampled_from([1.0, 0.5, 2.0]))
    along, across = exact.get(degrees, (cos(radians(degrees)), sin(radians(degrees))))
    steps = [(size * along, size * across * draw(st.sampled_from([1.0, -1.0])))] * draw(st.integers(1, 3))
    segment = draw(st.integers(0, len(steps) - 1))
    slave = slave_through(point, c, steps, segment)
    return Sketch(kind, [_graph(draw, length)], slave, segment, c, exact=degrees in exact)


@st.composite
def one_of_several(draw: DrawFn, role: str) -> Sketch:
    """Draw a slave segment over three to six master segments; its point is over the first, the last, or another.

    The order is that of the master, which runs in −x.
    """
    width, place = draw(_LENGTHS), {"first": (0.5, 1.0), "intermediate": (0.0, -0.5, 0.5), "last": (-0.5, -1.0)}[role]
    c = draw(st.sampled_from(place))
    # Master nodes lie at odd sixteenths of the slave segment, and the point at an eighth.
    here = round(8 * (1 + c))
    left = draw(st.lists(st.integers(0, here // 2 - 1), min_size=2, max_size=3, unique=True)) if role == "first" else []
    right = draw(st.lists(st.integers(here // 2, 7), min_size=2, max_size=3, unique=True)) if role == "last" else []
    if role == "intermediate":
        left = draw(st.lists(st.integers(0, here // 2 - 1), min_size=1, max_size=2, unique=True))
        right = draw(st.lists(st.integers(here // 2, 7), min_size=1, max_size=2, unique=True))
    beyond = draw(st.tuples(st.sampled_from([0.25, 1.0]), st.sampled_from([0.25, 1.0])))
    nodes = [-beyond[0], *((2 * k + 1) / 16 for k in sorted(left + right)), 1 + beyond[1]]
    line: Points = [(node * width, 0.0) for node in nodes]
    before, after = draw(st.integers(0, 1)), draw(st.integers(0, 1))
    tilt = draw(st.sampled_from([0.0, 0.125, -0.125, 0.25]))
    point = ((1 + c) / 2 * width, draw(gaps()) * width / 8)
    slave = slave_through(point, c, [(width, tilt * width)] * (before + 1 + after), before)
    return Sketch(f"{role} of several segments", [upper_side(line)], slave, before, c, mirrored=False)


@st.composite
def past_end(draw: DrawFn, kind: str) -> Sketch:
    """Draw a point past the free left end of the master by somewhat less, or somewhat more, than τ of its segment."""
    length, c = draw(_LENGTHS), draw(st.sampled_from(ROUND_PLACES))
    if "inside" in kind:
        past = TAU * (1 - ldexp(1.0, -draw(st.integers(1, 20))))
    else:
        past = TAU * (1 + ldexp(1.0, -draw(st.integers(-7, 20))))
    steps, segment = draw(slave_steps(length))
    slave = slave_through((-past * length, draw(gaps()) * length), c, steps, segment)
    return Sketch(kind, [_graph(draw, length, left=False)], slave, segment, c)


@st.composite
def free_end(draw: DrawFn) -> Sketch:
    """Draw a point whose foot is exactly the free left end of the master."""
    length, c = draw(_LENGTHS), draw(st.sampled_from(NODES_AND_OTHERS))
    steps, segment = draw(slave_steps(length))
    slave = slave_through((0.0, draw(gaps()) * length), c, steps, segment)
    return Sketch("free end hit exactly", [_graph(draw, length, left=False)], slave, segment, c, exact=True)


@st.composite
def small_overlap(draw: DrawFn) -> Sketch:
    """Draw a slave whose last node is 2^-k of a master segment inside the master's free end, the rest outside."""
    length, overlap = draw(_LENGTHS), ldexp(1.0, -draw(st.integers(2, 30)))
    steps, segment = draw(slave_steps(2 * length))
    slave = slave_through((overlap * length, draw(gaps()) * length * 0.5), 1.0, steps[: segment + 1], segment)
    masters = [_graph(draw, length, left=False)]
    return Sketch("overlap going to zero", masters, slave, segment, 1.0, exact=True)


@st.composite
def closing_segment(draw: DrawFn) -> Sketch:
    """Draw a disc or a hole, and a point over the segment that joins its last node to the first.

    The slave is open, or a closed box whose own closing segment carries the point.
    """
    length, (x, y) = draw(_feet_inside())
    height = length * draw(st.sampled_from([-1.0, 1.0, -2.0, 2.0]))  # Below the x-axis is a disc, above it a hole.
    between = draw(st.sampled_from([[], [0.5], [0.25, 0.75]]))
    nodes = [(0.0, 0.0), (0.0, height), *((length * part, height) for part in between), (length, height), (length, 0.0)]
    master = Chain(np.array(nodes), closed=True)
    c, point = draw(st.sampled_from(ROUND_PLACES)), (x, y / 2)
    steps, segment = draw(slave_steps(length / 4))
    if draw(st.booleans()):
        size = length / 4
        (left, right) = slave_through(point, c, [(size, 0.0)], 0).points
        box = np.array([right, right + [0, size], left + [0, size], left])
        return Sketch("closing segment", [master], Chain(box, closed=True), 3, c, ordered=True)
    slave = slave_through(point, c, steps, segment)
    return Sketch("closing segment", [master], slave, segment, c, ordered=True)


@st.composite
def second_body(draw: DrawFn) -> Sketch:
    """Draw another chain of the master behind the first; the point may even be nearer to the second."""
    length, part = draw(_LENGTHS), draw(st.integers(1, 7)) / 8
    behind = length * draw(st.sampled_from([1.0, 0.25, 0.0625]))
    gap = draw(gaps()) * behind
    if draw(st.sampled_from([False, False, False, True])) and gap < 0:
        gap = -behind - gap
    c = draw(st.sampled_from(ROUND_PLACES))
    steps, segment = draw(slave_steps(length / 8))
    first = _graph(draw, length, slopes=False)
    cuts = draw(st.sampled_from([[], [0.5625], [0.3125, 0.6875]]))  # Odd sixteenths: the point is at an eighth.
    second = upper_side([(x * length, -behind) for x in (-0.5, *cuts, 1.5)])
    if draw(st.booleans()):  # The second chain faces away: it is the lower side of the first body.
        second = Chain(second.points[::-1])
    slave = slave_through((part * length, gap), c, steps, segment)
    return Sketch("second body behind", [first, second], slave, segment, c)


@st.composite
def other_node(draw: DrawFn) -> Sketch:
    """Draw a point over the middle of a long segment, nearer to the tip of a hook than to both ends of it."""
    length, c = 16.0, draw(st.sampled_from(ROUND_PLACES))
    tip = (8.0 + draw(st.integers(0, 2)), draw(st.sampled_from([3.0, 4.0, -3.0, -4.0])))
    steps, segment = draw(slave_steps(0.25))
    slave = slave_through((8.0, 2 * draw(gaps())), c, steps, segment)
    hook = upper_side([(0.0, 0.0), (length, 0.0), tip])
    return Sketch("nearest node not on nearest segment", [hook], slave, segment, c)


@st.composite
def node_hit(draw: DrawFn) -> Sketch:
    """Draw a point whose foot on the nearest segment is exactly a node between two segments.

    The left segment is collinear, or bent to the side where the node stays nearest.
    """
    gap, right, left = draw(nonzero_gaps()), draw(_SIDES), draw(_SIDES)
    slope = draw(_SLOPES) * (1 if gap < 0 else -1)
    line: Points = [(-left, slope * left), (0.0, 0.0), (right, 0.0)]
    line += [(right + length, 0.0) for length in draw(_ENDS)]
    c = draw(st.sampled_from(NODES_AND_OTHERS))
    steps, segment = draw(slave_steps(1.0))
    return Sketch(
        "node hit exactly", [upper_side(line)], slave_through((0.0, gap), c, steps, segment), segment, c, True
    )


@st.composite
def coincident_nodes(draw: DrawFn) -> Sketch:
    """Draw matching meshes: each slave node stands over a master node, at the same place if the gap is zero."""
    steps = draw(st.lists(st.tuples(_SIDES, _SLOPES, st.sampled_from([1, -1])), min_size=1, max_size=4))
    level, gap = draw(st.sampled_from([True, False])), draw(gaps())
    line: Points = [(0.0, 0.0)]
    for length, slope, sign in steps:
        line.append((line[-1][0] + length, line[-1][1] + (0.0 if level else sign * slope * length)))
    gap = gap if level else 0.0
    more = [(line[-1][0] + length, line[-1][1]) for length in draw(_ENDS)]
    segment, c = draw(st.integers(0, len(steps) - 1)), draw(st.sampled_from([-1.0, 1.0]))
    slave = upper_side([(x, y + gap) for x, y in line[::-1]])
    return Sketch("coincident nodes", [upper_side(line + more)], slave, segment, c, True)


@st.composite
def vertex(draw: DrawFn, kind: str) -> Sketch:
    """Draw a point near the bisector of a vertex, on it, or off it by 2^-k, on either side of the master.

    Where the vertex sticks out, a penetrating point may be nearest to two segments, and an open one to the node alone;
    where it sticks in, it is the other way round.
    """
    if kind == "master angle below 90°":
        up, steep = draw(st.sampled_from([-1, 1])), draw(st.sampled_from([2.0, 4.0, 8.0]))
    else:
        up, steep = (-1 if kind == "convex vertex" else 1), draw(st.sampled_from([1.0, 0.5, 0.25, 0.125]))
    left, right = draw(_SIDES), draw(_SIDES)
    line: Points = [(-left, up * steep * left), (0.0, 0.0), (right, up * steep * right)]
    line += [(line[-1][0] + length, line[-1][1]) for length in draw(_ENDS)]
    gap = draw(nonzero_gaps())
    c = draw(st.sampled_from(NODES_AND_OTHERS))
    steps, segment = draw(slave_steps(1.0))
    point = (draw(_off_the_bisector(abs(gap) * min(steep, 1.0))), gap)
    return Sketch(kind, [upper_side(line)], slave_through(point, c, steps, segment), segment, c, True)


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


@st.composite
def three_segments(draw: DrawFn) -> Sketch:
    """Draw the centre of a groove or of a rib: three segments are equally near."""
    width, wall = draw(_SIDES), draw(st.sampled_from([1.0, 0.5, 2.0]))
    groove: Points = [(-width, wall * width), (-width, -width), (width, -width), (width, wall * width)]
    rib: Points = [(-width, -wall * width), (-width, width), (width, width), (width, -wall * width)]
    return _at_origin(draw, "equidistant from three segments", groove, rib)


@st.composite
def three_nodes(draw: DrawFn) -> Sketch:
    """Draw a point to which three tips of the master, or three bottoms of its grooves, are equally near."""
    end = draw(st.sampled_from([8.0, 6.0]))
    tips = [(-5.0, -end), (-3.0, -4.0), (-2.0, -end), (0.0, -5.0), (2.0, -end), (3.0, -4.0), (5.0, -end)]
    return _at_origin(draw, "equidistant from three nodes", tips, [(x, -y) for x, y in tips])


def _at_origin(draw: DrawFn, kind: str, above: Points, below: Points) -> Sketch:
    """Return a sketch whose slave point is the origin: the master is below it, or it penetrates the master."""
    line = above if draw(st.booleans()) else below
    c = draw(st.sampled_from(NODES_AND_OTHERS))
    steps, segment = draw(slave_steps(0.5))
    return Sketch(kind, [upper_side(line)], slave_through((0.0, 0.0), c, steps, segment), segment, c, True)


@st.composite
def _feet_inside(draw: DrawFn, *, exact: bool = False) -> tuple[float, tuple[float, float]]:
    """Draw a length, and a point over the inside of a segment of that length, no farther from it than from its ends."""
    length, denominator = draw(_LENGTHS), 8 if exact else draw(st.sampled_from([8, 7]))
    part = draw(st.integers(1, denominator - 1)) / denominator
    room = 2.0 ** floor(log2(2 * min(part, 1 - part)))
    return length, (part * length, draw(gaps()) * room * length)


def _graph(draw: DrawFn, length: float, *, left: bool = True, slopes: bool = True) -> Chain:
    """Draw a master that is a graph with slopes up to 45° besides the segment from (0, 0) to (length, 0).

    A point over that segment, no farther from it than from its ends, is nearer to it than to all others.
    """
    right_to_left: Points = [(length, 0.0), (0.0, 0.0)]
    for size, slope in draw(_NEIGHBOURS):
        x, y = right_to_left[0]
        right_to_left.insert(0, (x + size, y + size * slope * slopes))
    for size, slope in draw(_NEIGHBOURS) if left else ():
        x, y = right_to_left[-1]
        right_to_left.append((x - size, y + size * slope * slopes))
    return Chain(np.array(right_to_left))
