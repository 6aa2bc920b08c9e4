"""Kinds of queries at one vertex, one segment or one free end of an ordinary chain."""

from __future__ import annotations

from contactverif.oracle.exact_nearest import Nearest
from contactverif.studies.queries.kind_contract import Kind, has_inner_foot, is_tie, lies_off_a_vertex
from contactverif.studies.queries.query_dice import Dice, Vector
from contactverif.studies.queries.query_shapes import (
    Chain,
    Shape,
    add,
    exact_motion,
    frame,
    lattice_chain,
    make_shape,
    rough_chain,
    rounded_motion,
)

N_POINTS = 10  # The number of points that are drawn for a surface.
_ALMOST = 1e-12  # The distance from a node, in lengths of the segment, within which a foot almost hits it.


def point_over(dice: Dice, shape: Shape, segment: int, *, powers: tuple[int, int] = (-30, -2)) -> Vector:
    """Return a point over or under the inside of a segment, at a distance between two powers of 2 of its length."""
    first, second = shape.ends(segment)
    length, t, n = frame(first, second)
    gap = dice.sign() * dice.power(*powers) * length
    return add(first, (dice.real(0.05, 0.95) * length, t), (gap, n))


def points_over(dice: Dice, shape: Shape, *, powers: tuple[int, int] = (-30, -2)) -> list[Vector]:
    """Return points over or under random segments."""
    segments = [dice.integer(0, len(shape.segments) - 1) for _ in range(N_POINTS)]
    return [point_over(dice, shape, segment, powers=powers) for segment in segments]


def draw_inside(dice: Dice) -> tuple[Shape, list[Vector]]:
    """Draw a rough chain and points beside its segments."""
    shape = make_shape(rounded_motion(dice, rough_chain(dice, dice.integer(2, 12))))
    return shape, points_over(dice, shape)


def draw_free_end(dice: Dice) -> tuple[Shape, list[Vector]]:
    """Draw points past the ends of a rough chain, by 2^-40 … 2 lengths."""
    shape = make_shape(rounded_motion(dice, rough_chain(dice, dice.integer(1, 6))))
    points = []
    for _ in range(N_POINTS):
        end = dice.integer(0, 1)
        ends = shape.ends((0, len(shape.segments) - 1)[end])
        _, t, n = frame(*ends)
        past = (2 * end - 1) * dice.power(-40, 0)
        points.append(add(ends[end], (past, t), (dice.sign() * dice.power(-20, 0), n)))
    return shape, points


def is_past_free_end(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the nearest place is a free end, and the foot lies past it."""
    (near, *others) = nearest.segments
    return not others and not 0 <= near.xi <= 1 and shape.surface.neighbours[near.segment, int(near.xi > 1)] < 0


def draw_vertex(dice: Dice) -> tuple[Shape, list[Vector]]:
    """Draw points between the two normals of a vertex, outside a convex one or inside a concave one."""
    chain = rounded_motion(dice, rough_chain(dice, dice.integer(2, 8)))
    shape, points = make_shape(chain), []
    for _ in range(N_POINTS):
        vertex = dice.integer(1, len(chain) - 2)
        (_, t, n), (_, _, n2) = frame(chain[vertex - 1], chain[vertex]), frame(chain[vertex], chain[vertex + 1])
        side = 1 if t[0] * n2[0] + t[1] * n2[1] > 0 else -1
        share, reach = dice.real(0, 1), side * dice.power(-20, -3)
        points.append(add(chain[vertex], (reach * share, n), (reach * (1 - share), n2)))
    return shape, points


def draw_valley(dice: Dice) -> tuple[Shape, list[Vector]]:
    """Draw points near the bisector of a concave vertex, off it by 2^-40 … 1/8 of their height."""
    left, right = dice.real(0.3, 3), dice.real(0.3, 3)
    arms: Chain = [(4.0, 4 * right), (0.0, 0.0), (-4.0, 4 * left)]
    chain = rounded_motion(dice, [(8.0, 4 * right), *arms, (-8.0, 4 * left)])
    (_, t, n), (_, _, n2) = frame(chain[1], chain[2]), frame(chain[2], chain[3])
    points = []
    for _ in range(N_POINTS):
        height = dice.power(-12, 0)
        off = height * dice.sign() * dice.power(-40, -4)
        points.append(add(chain[2], (height, n), (height, n2), (off, t)))
    return make_shape(chain), points


def draw_bisector(dice: Dice) -> tuple[Shape, list[Vector]]:
    """Draw points on the axis of a symmetric vertex, convex or concave, on a lattice: exact ties."""
    width, height = dice.integer(2, 12), dice.sign() * dice.integer(1, 24)
    arms: Chain = [(width, height), (0, 0), (-width, height)]
    whole = [(width + 4.0, float(height)), *arms, (-width - 4.0, float(height))]
    points: Chain = [(0, dice.sign() * dice.integer(1, 16) / 8) for _ in range(N_POINTS)]
    moved = exact_motion(dice, [*whole, *points])
    return make_shape(moved[: len(whole)]), moved[len(whole) :]


def draw_node_hit(dice: Dice) -> tuple[Shape, list[Vector]]:
    """Draw points whose foot is exactly at a node of a lattice chain."""
    chain = lattice_chain(dice, dice.integer(1, 8))
    points: Chain = []
    for _ in range(N_POINTS):
        segment, end, multiple = (
            dice.integer(0, len(chain) - 2),
            dice.integer(0, 1),
            dice.sign() / 2 ** dice.integer(1, 8),
        )
        (ax, ay), (bx, by) = chain[segment : segment + 2]
        x, y = chain[segment + end]
        points.append((x + multiple * (by - ay), y - multiple * (bx - ax)))
    moved = exact_motion(dice, [*chain, *points])
    return make_shape(moved[: len(chain)]), moved[len(chain) :]


def hits_node(shape: Shape, point: Vector, nearest: Nearest) -> bool:
    """Return whether the foot on one of the nearest segments is exactly one of its nodes."""
    return nearest.squared_distance > 0 and any(near.xi in (0, 1) for near in nearest.segments)


def draw_node_almost_hit(dice: Dice) -> tuple[Shape, list[Vector]]:
    """Draw points over a node of a steep chain, along the normal of one of its segments."""
    chain = rounded_motion(dice, rough_chain(dice, dice.integer(2, 8), largest_slope=0.9))
    points = []
    for _ in range(N_POINTS):
        segment, end = dice.integer(0, len(chain) - 2), dice.integer(0, 1)
        _, _, n = frame(chain[segment], chain[segment + 1])
        points.append(add(chain[segment + end], (dice.sign() * dice.power(-20, -3), n)))
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
