"""Kinds of queries: the data of one, and those at one vertex, segment or free end of an ordinary chain.

What holds is decided by the exact answer alone. A point for which it does not hold is drawn again, so that a query is
of the kind whose name it bears.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from contactverif.oracle.exact_nearest import Nearest
from contactverif.studies.queries.surfaces import (
    Chain,
    RandomNumbers,
    Shape,
    Vector,
    add,
    exact_motion,
    frame,
    lattice_chain,
    make_shape,
    move_together,
    rough_chain,
    rounded_motion,
)

N_POINTS = 10  # The number of points that are drawn for a surface.
_ALMOST = 1e-12  # The distance from a node, in lengths of the segment, within which a foot almost hits it.
Draw = Callable[[RandomNumbers], tuple[Shape, list[Vector]]]
Condition = Callable[[Shape, Vector, Nearest], bool]


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of query."""

    name: str  # One word, as it stands in the file.
    meaning: str
    draw: Draw  # Draws a surface and some points for it.
    holds: Condition = lambda shape, point, nearest: True  # Whether a point is of this kind, by its exact answer.


def has_inner_foot(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether one segment is nearest, and the foot is between its nodes."""
    return len(nearest.segments) == 1 and 0 < nearest.segments[0].xi < 1


def is_tie(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether no rule but the number of the segment decides."""
    return nearest.n_undecided > 1


def lies_off_a_vertex(sign: int) -> Condition:
    """Return the condition that a node of two segments is nearest, and the point is outside (+1) or inside (−1)."""

    def condition(shape: Shape, point: Vector, nearest: Nearest) -> bool:
        gap = nearest.segments[0].signed_squared_gap
        return len(nearest.segments) == 2 and nearest.n_undecided == 1 and gap * sign > 0

    return condition


def point_over(random: RandomNumbers, shape: Shape, segment: int, *, powers: tuple[int, int] = (-30, -2)) -> Vector:
    """Return a point over or under the inside of a segment, at a distance between two powers of 2 of its length."""
    first, second = shape.ends(segment)
    length, t, n = frame(first, second)
    gap = random.sign() * random.power(*powers) * length
    return add(first, (random.real(0.05, 0.95) * length, t), (gap, n))


def points_over(random: RandomNumbers, shape: Shape, *, powers: tuple[int, int] = (-30, -2)) -> list[Vector]:
    """Return points over or under random segments."""
    segments = [random.integer(0, len(shape.segments) - 1) for _ in range(N_POINTS)]
    return [point_over(random, shape, segment, powers=powers) for segment in segments]


def draw_inside(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw a rough chain and points beside its segments."""
    shape = make_shape(rounded_motion(random, rough_chain(random, random.integer(2, 12))))
    return shape, points_over(random, shape)


def draw_free_end(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points past the ends of a rough chain, by 2^-40 … 2 lengths."""
    shape = make_shape(rounded_motion(random, rough_chain(random, random.integer(1, 6))))
    points = []
    for _ in range(N_POINTS):
        end = random.integer(0, 1)
        ends = shape.ends((0, len(shape.segments) - 1)[end])
        _, t, n = frame(*ends)
        past = (2 * end - 1) * random.power(-40, 0)
        points.append(add(ends[end], (past, t), (random.sign() * random.power(-20, 0), n)))
    return shape, points


def is_past_free_end(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the nearest place is a free end, and the foot lies past it."""
    (near, *others) = nearest.segments
    return not others and not 0 <= near.xi <= 1 and shape.surface.neighbours[near.segment, int(near.xi > 1)] < 0


def draw_vertex(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points between the two normals of a vertex, outside a convex one or inside a concave one."""
    chain = rounded_motion(random, rough_chain(random, random.integer(2, 8)))
    shape, points = make_shape(chain), []
    for _ in range(N_POINTS):
        vertex = random.integer(1, len(chain) - 2)
        (_, t, n), (_, _, n2) = frame(chain[vertex - 1], chain[vertex]), frame(chain[vertex], chain[vertex + 1])
        side = 1 if t[0] * n2[0] + t[1] * n2[1] > 0 else -1
        share, reach = random.real(0, 1), side * random.power(-20, -3)
        points.append(add(chain[vertex], (reach * share, n), (reach * (1 - share), n2)))
    return shape, points


def draw_valley(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points near the bisector of a concave vertex, off it by 2^-40 … 1/8 of their height."""
    left, right = random.real(0.3, 3), random.real(0.3, 3)
    arms: Chain = [(4.0, 4 * right), (0.0, 0.0), (-4.0, 4 * left)]
    chain = rounded_motion(random, [(8.0, 4 * right), *arms, (-8.0, 4 * left)])
    (_, t, n), (_, _, n2) = frame(chain[1], chain[2]), frame(chain[2], chain[3])
    points = []
    for _ in range(N_POINTS):
        height = random.power(-12, 0)
        off = height * random.sign() * random.power(-40, -4)
        points.append(add(chain[2], (height, n), (height, n2), (off, t)))
    return make_shape(chain), points


def draw_bisector(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points on the axis of a symmetric vertex, convex or concave, on a lattice: exact ties."""
    width, height = random.integer(2, 12), random.sign() * random.integer(1, 24)
    arms: Chain = [(width, height), (0, 0), (-width, height)]
    whole = [(width + 4.0, float(height)), *arms, (-width - 4.0, float(height))]
    points: Chain = [(0, random.sign() * random.integer(1, 16) / 8) for _ in range(N_POINTS)]
    return move_together(exact_motion, random, [whole], points)


def draw_node_hit(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points whose foot is exactly at a node of a lattice chain."""
    chain = lattice_chain(random, random.integer(1, 8))
    points: Chain = []
    for _ in range(N_POINTS):
        segment, end = random.integer(0, len(chain) - 2), random.integer(0, 1)
        multiple = random.sign() / 2 ** random.integer(1, 8)
        (ax, ay), (bx, by) = chain[segment : segment + 2]
        x, y = chain[segment + end]
        points.append((x + multiple * (by - ay), y - multiple * (bx - ax)))
    return move_together(exact_motion, random, [chain], points)


def hits_node(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the foot on one of the nearest segments is exactly one of its nodes."""
    return nearest.squared_distance > 0 and any(near.xi in (0, 1) for near in nearest.segments)


def draw_node_almost_hit(random: RandomNumbers) -> tuple[Shape, list[Vector]]:
    """Draw points over a node of a steep chain, along the normal of one of its segments."""
    chain = rounded_motion(random, rough_chain(random, random.integer(2, 8), largest_slope=0.9))
    points = []
    for _ in range(N_POINTS):
        segment, end = random.integer(0, len(chain) - 2), random.integer(0, 1)
        _, _, n = frame(chain[segment], chain[segment + 1])
        points.append(add(chain[segment + end], (random.sign() * random.power(-20, -3), n)))
    return make_shape(chain), points


def almost_hits_node(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the foot on a nearest segment is within 1e-12 of its length from a node, and not on it."""
    return any(0 < min(abs(near.xi), abs(near.xi - 1)) < _ALMOST for near in nearest.segments)


PLAIN_KINDS = (
    Kind("inside", "the foot is between the nodes of one segment", draw_inside, has_inner_foot),
    Kind("free-end", "the foot is past a free end, by as little as 1e-12 lengths", draw_free_end, is_past_free_end),
    Kind("convex-vertex", "outside, between the two normals of a convex vertex", draw_vertex, lies_off_a_vertex(1)),
    Kind("concave-vertex", "inside, between the two normals of a concave vertex", draw_vertex, lies_off_a_vertex(-1)),
    Kind("valley", "near the bisector of a concave vertex, a foot on either side", draw_valley, has_inner_foot),
    Kind("bisector", "exactly on the bisector of a vertex: a tie", draw_bisector, is_tie),
    Kind("node-hit", "the foot is exactly a node", draw_node_hit, hits_node),
    Kind("node-almost-hit", "the foot is a node but for roundoff", draw_node_almost_hit, almost_hits_node),
)
