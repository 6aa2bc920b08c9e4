"""Kinds of projection at vertices: nodes that are hit, vertices that stick out or in, and ties of several.

In every sketch the vertex is the origin, or the slave point is; all coordinates are exact, and ties are ties.
"""

from __future__ import annotations

from math import ldexp

from hypothesis import strategies as st
from hypothesis.strategies import DrawFn

from contactverif.strategies.sketches import (
    NODES_AND_OTHERS,
    Sketch,
    gaps,
    nonzero_gaps,
    slave_steps,
    slave_through,
    upper_side,
)

Points = list[tuple[float, float]]
_FINEST = 31  # Distances from a bisector go down to 2^-31 and 0.
_LENGTHS = st.sampled_from([1.0, 2.0, 4.0, 3.0])
_SLOPES = st.sampled_from([0.0, 0.125, 0.5, 1.0])
_ENDS = st.lists(st.sampled_from([1.0, 2.0]), max_size=1)


@st.composite
def node_hit(draw: DrawFn) -> Sketch:
    """Draw a point whose foot on the nearest segment is exactly a node between two segments.

    The left segment is collinear, or bent to the side where the node stays nearest.
    """
    gap, right, left = draw(nonzero_gaps()), draw(_LENGTHS), draw(_LENGTHS)
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
    steps = draw(st.lists(st.tuples(_LENGTHS, _SLOPES, st.sampled_from([1, -1])), min_size=1, max_size=4))
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
    left, right = draw(_LENGTHS), draw(_LENGTHS)
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
    width, wall = draw(_LENGTHS), draw(st.sampled_from([1.0, 0.5, 2.0]))
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
