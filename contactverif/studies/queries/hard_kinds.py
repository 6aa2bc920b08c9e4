"""Kinds of queries that are hard for a reason: roundoff, scale, offset, or a surface that is no graph of a function."""

from __future__ import annotations

import math

import numpy as np

from contactverif.contract.interface import Surface
from contactverif.oracle.exact_nearest import Nearest
from contactverif.studies.queries.kinds import (
    N_POINTS,
    Kind,
    draw_bisector,
    draw_inside,
    has_inner_foot,
    point_over,
    points_over,
)
from contactverif.studies.queries.surfaces import (
    PYTHAGOREAN,
    Chain,
    RandomNumbers,
    Shape,
    Vector,
    add,
    exact_motion,
    frame,
    lattice_chain,
    make_shape,
    move,
    move_together,
    polygon,
    rational_direction,
    rough_chain,
    rounded_motion,
    stretch,
    turn,
)

_LONG = 1000  # The number of segments of a long chain.
_TINY = 1e-9  # The length of the shortest segment beside those of length 1.


def one_ulp_off(random: RandomNumbers, point: Vector) -> Vector:
    """Return the point with one coordinate replaced by a neighbouring double, 0 by ± the unit roundoff."""
    x, y = point
    moved_x, moved_y = (math.nextafter(v, random.sign() * math.inf) if v else random.sign() * 2.0**-53 for v in point)
    return (moved_x, y) if random.integer(0, 1) else (x, moved_y)


def draw_near_tie(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw exact ties and move each point by one unit in the last place."""
    shape, points = draw_bisector(random)
    return shape, [one_ulp_off(random, point) for point in points]


def draw_three_feet(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw three to five segments that touch one circle of whole numbers, and its centre."""
    lengths = [math.isqrt(a * a + b * b) for a, b in PYTHAGOREAN]
    radius = math.lcm(*lengths)
    turns = random.shuffle([(a, b, c) for (a, b), c in zip(PYTHAGOREAN, lengths, strict=True)])
    side, chains = random.sign(), list[Chain]()
    for number, (a, b, c) in enumerate(turns[: random.integer(3, 5)]):
        quarters = ((a, b), (-b, a), (-a, -b), (b, -a))
        a, b = quarters[number % 4]
        foot = (a * (radius // c), b * (radius // c))
        half = side * (radius // (32 * c))
        chains.append([(foot[0] - half * b, foot[1] + half * a), (foot[0] + half * b, foot[1] - half * a)])
    return move_together(exact_motion, random, chains, [(0, 0)])


def has_three_feet(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the point is equally far from three places or more."""
    return len({near.foot for near in nearest.segments}) >= 3


def draw_on_surface(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points exactly on the segments and nodes of a lattice chain."""
    chain = lattice_chain(random, random.integer(1, 8), spacing=16)
    points = []
    for _ in range(N_POINTS):
        place = random.integer(0, len(chain) - 2)
        (ax, ay), (bx, by) = chain[place : place + 2]
        share = random.integer(0, 16) / 16
        points.append((ax + share * (bx - ax), ay + share * (by - ay)))
    return move_together(exact_motion, random, [chain], points)


def touches(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the point is exactly on the surface."""
    return nearest.squared_distance == 0


def draw_tiny_gap(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points that are one unit in the last place off a surface near the origin."""
    chain = lattice_chain(random, random.integer(1, 8), spacing=16)
    home = random.integer(0, len(chain) - 2)
    (ax, ay), (bx, by) = chain[home : home + 2]
    on_surface = [(ax + k * (bx - ax) / 16, ay + k * (by - ay) / 16) for k in range(1, 16) if k != 8]
    places = move([*chain, *on_surface], (-(ax + bx) / 2, -(ay + by) / 2))
    turned = stretch(turn(places, random.choice(((1, 0), (0, 1), *PYTHAGOREAN))), 2.0**-8)
    shape = make_shape(turned[: len(chain)])
    return shape, [one_ulp_off(random, random.choice(turned[len(chain) :])) for _ in range(N_POINTS)]


def nearly_touches(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the distance is not zero, and at most 1e-15."""
    return has_inner_foot(shape, point, nearest) and 0 < nearest.squared_distance <= 1e-30


def draw_cavity(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points over a long segment, below nodes of another body that are nearer than the ends of the segment."""
    floor: Chain = [(10.0, 0.0), (-10.0, 0.0)]
    height = random.real(0.3, 1)
    above = turn(rough_chain(random, random.integer(6, 12), largest_slope=0.05), (-1.0, 0.0))
    points = [(random.real(-5, 3), height * random.real(0.2, 1)) for _ in range(N_POINTS)]
    return move_together(rounded_motion, random, [floor, move(above, (-5.0, 2.5 * height))], points)


def nearest_node_is_of_another_segment(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether one segment is nearest, and the nearest node is clearly not one of its two."""
    if not has_inner_foot(shape, point, nearest):
        return False
    squares = ((shape.nodes - np.array(point)) ** 2).sum(axis=1)  # No `hypot`, which differs from machine to machine.
    ends = shape.segments[nearest.segments[0].segment]
    return bool(squares.min() < (1 - 1e-9) * squares[ends].min())


def draw_sharp_tip(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points before a tip of the body with an angle of 5° to 84°."""
    (c, s), (c2, s2) = rational_direction(random.real(0.02, 0.38)), rational_direction(random.real(0.02, 0.38))
    tip: Chain = [(-c, -s), (0.0, 0.0), (-c2, s2)]
    points = [stretch([random.slope(0.9)], random.power(-20, 0))[0] for _ in range(N_POINTS)]
    return move_together(rounded_motion, random, [tip], points)


def is_before_sharp_tip(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the tip is nearest, its angle is below 90°, and one of its lines has the point on its left."""
    if len(nearest.segments) != 2 or nearest.n_undecided > 1:
        return False
    first, second = (near.signed_squared_gap for near in nearest.segments)
    return first > 0 > second


def draw_several_chains(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw two to four chains, one over the other, whose segments are numbered in random order."""
    chains = []
    for level in range(random.integer(2, 4)):
        chain = rough_chain(random, random.integer(2, 6), largest_slope=0.05)
        if random.integer(0, 1):  # Its body is on the other side.
            chain = move(turn(chain, (-1.0, 0.0)), chain[-1])
        chains.append(move(chain, (random.real(-1, 1), 2.5 * level)))
    shape, _ = move_together(rounded_motion, random, chains, [])
    shape = Shape(shape.nodes, Surface(shape.segments[random.shuffle(range(len(shape.segments)))]))
    low, high = shape.nodes.min(axis=0).tolist(), shape.nodes.max(axis=0).tolist()
    scattered = [(random.real(low[0], high[0]), random.real(low[1], high[1])) for _ in range(N_POINTS // 2)]
    return shape, [*scattered, *points_over(random, shape)[N_POINTS // 2 :]]


def draw_thin_body(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points in a thin closed body that lies before another one, on both sides of its middle."""
    body = polygon(random, random.integer(8, 20), flatten=random.power(-8, -4))
    behind = move(rough_chain(random, 4, largest_slope=0.02), (2.0, -random.real(0.4, 0.6)))
    points = []
    for _ in range(N_POINTS):
        (ax, ay), (bx, by) = random.choice(body), random.choice(body)
        share = 0.5 + random.sign() * random.power(-30, -2)
        points.append((ax + share * (bx - ax), ay + share * (by - ay)))
    return move_together(rounded_motion, random, [body, behind], points, closed=[0])


def is_inside(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the point is inside the body."""
    return nearest.segments[0].signed_squared_gap < 0


def draw_seam(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points over the segment that joins the last node of a closed chain to the first, and over its ends."""
    shape = make_shape(rounded_motion(random, stretch(polygon(random, random.integer(3, 12)), 4)), closed=[0])
    last = len(shape.segments) - 1
    points = [point_over(random, shape, last, powers=(-20, -2)) for _ in range(N_POINTS // 2)]
    first, second = shape.ends(last)
    _, t, n = frame(first, second)
    for _ in range(N_POINTS - len(points)):
        end, side = random.choice(((first, -1), (second, 1)))
        points.append(add(end, (side * random.power(-30, -4), t), (random.power(-8, -2), n)))
    return shape, points


def meets_seam(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the segment that closes the chain is a nearest one."""
    return any(near.segment == len(shape.segments) - 1 for near in nearest.segments)


def draw_offset(random: RandomNumbers, offset: float) -> tuple[Shape, list[Vector]]:
    """Draw an ordinary chain far from the origin; half of the gaps are a few units in the last place there."""
    c, s = random.direction()
    chain = move(rounded_motion(random, rough_chain(random, random.integer(2, 12))), (offset * c, offset * s))
    shape, last_place = make_shape(chain), math.frexp(offset)[1] - 53
    small = points_over(random, shape, powers=(last_place, last_place + 4))[: N_POINTS // 2]
    return shape, [*small, *points_over(random, shape)[N_POINTS // 2 :]]


def draw_tiny_segment(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw a chain near the origin with one segment of 1e-9, and points 1e-10 … 1 away from it."""
    before, behind = rough_chain(random, random.integer(1, 4)), rough_chain(random, random.integer(1, 4))
    c, s = random.slope(0.3)
    tiny = (-_TINY * c, _TINY * s)
    last = before[-1]
    chain = [*move(before, (-last[0], -last[1])), *move(behind, tiny)]
    points = [stretch([random.direction()], random.power(-33, -1))[0] for _ in range(N_POINTS)]
    by = random.direction()
    return make_shape(turn(chain, by)), turn(points, by)


def draw_long_chain(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw a rough chain of a thousand segments and a hundred points along it."""
    shape = make_shape(rounded_motion(random, rough_chain(random, _LONG)))
    return shape, [point for _ in range(10) for point in points_over(random, shape, powers=(-20, -2))]


def draw_far_away(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points that are 1e3 to 1e9 lengths away, so that all segments are nearly equally far."""
    chain = rounded_motion(random, rough_chain(random, random.integer(2, 12)))
    points = [add(random.choice(chain), (random.power(10, 29), random.direction())) for _ in range(N_POINTS)]
    return make_shape(chain), points


def draw_other_units(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw ordinary queries with all coordinates multiplied by 2^-60 or 2^60."""
    shape, points = draw_inside(random)
    factor = math.ldexp(1, 60 * random.sign())
    return Shape(shape.nodes * factor, shape.surface), stretch(points[:4], factor)


HARD_KINDS = (
    Kind("near-tie", "one unit in the last place off a tie", draw_near_tie, has_inner_foot),
    Kind("three-feet", "equally far from three segments or more: a tie", draw_three_feet, has_three_feet),
    Kind("touching", "exactly on the surface: the gap is 0", draw_on_surface, touches),
    Kind("tiny-gap", "one unit in the last place off the surface, about 1e-16", draw_tiny_gap, nearly_touches),
    Kind(
        "node-elsewhere",
        "the nearest node is not on the nearest segment",
        draw_cavity,
        nearest_node_is_of_another_segment,
    ),
    Kind("sharp-tip", "before a tip below 90°, behind the line of one side", draw_sharp_tip, is_before_sharp_tip),
    Kind("several-chains", "two to four chains, segments numbered in random order", draw_several_chains),
    Kind("thin-body", "in a thin closed body before another: front or back", draw_thin_body, is_inside),
    Kind("seam", "the segment that closes a chain, or an end of it", draw_seam, meets_seam),
    Kind("offset-1e6", "coordinates near 1e6, lengths near 1", lambda random: draw_offset(random, 1e6)),
    Kind("offset-1e8", "coordinates near 1e8, lengths near 1", lambda random: draw_offset(random, 1e8)),
    Kind("tiny-segment", "a segment of 1e-9 beside those of 1", draw_tiny_segment),
    Kind("far-away", "a distance of 1e3 to 1e9 lengths", draw_far_away),
    Kind("other-units", "all coordinates times 2^-60 or 2^60", draw_other_units, has_inner_foot),
    Kind("long-chain", "a chain of 1000 segments", draw_long_chain),
)
