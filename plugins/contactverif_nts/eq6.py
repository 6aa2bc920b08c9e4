"""The kernels of Eq. 6: one point V of a slave segment A B against one master segment 1 → 2.

    x_V = (1−c)/2 x_A + (1+c)/2 x_B        F = penalty × g × area
    R_A = (1−c)/2 F n    R_B = (1+c)/2 F n    R_1 = −(1−ξ) F n    R_2 = −ξ F n

The area of a point is its weight × the length of the slave segment that carries it, plus the same for the other slave
segment at a slave node (NTS-AR), or 1 (NTS).

With multipliers λ, one for each point, F = −λ × area. Each point then has a constraint row: −area × g where it is
active, area × λ where it is not. The area of that second row is measured in the reference configuration, so that the
row never vanishes. Arrays of multipliers without columns mean a penalty.

Rules for the next editor:

1. `pair` makes all decisions and returns integers and booleans. `residual` decides nothing.
2. `residual` takes float64 and complex128, so a number that starts as a constant gets the type of x first.
3. A kernel gets the fields of `Surfaces`, `Points` and `Options` as plain tuples and unpacks them in its first lines.
   numba reads a plain tuple in half the time of a named one. Named tuples of numbers, such as `Contact`, are free.
4. `eq6_tangent` differentiates this file line by line. Change both.

Source: Zavarise & De Lorenzis (2009), Eq. 6.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from contactverif.compiler import compile_kernel, compile_part
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.geometry.block_rows import AnyIntArray
from contactverif.geometry.projection import (
    NO_PLACE,
    PointOnSegment,
    Tree,
    Vector,
    arm,
    cross,
    dot,
    foot_on_surface,
    frame,
    is_next,
    minus,
    nearest_place_from,
    node,
)

NODAL, CURRENT, REFERENCE = 0, 1, 2  # The area of a point: 1, or lengths in one of two configurations.
AREAS = {"current": CURRENT, "reference": REFERENCE}  # The words of the option `area`.

Fields = tuple[Any, ...]  # The fields of a named tuple, as a plain tuple.
Csr = tuple[AnyIntArray, AnyIntArray, FloatArray]  # The indptr, indices and data of compressed rows.


class Surfaces(NamedTuple):
    """The arrays of an interface that the kernels read, in this order."""

    reference: FloatArray  # (n_nodes, 2), positions in the reference configuration
    slave: IntArray  # (n_slave_segments, 2), nodes
    master: IntArray  # (n_master_segments, 2), nodes
    neighbours: IntArray  # (n_master_segments, 2), the previous and the next master segment, −1 at a free end


class Points(NamedTuple):
    """The pairing of points, each array of shape (n_points,), in this order."""

    segment: IntArray  # the slave segment that carries the point
    other: IntArray  # the other slave segment at a slave node, −1 if there is none
    slot: IntArray  # the entry of `Options.c` and `Options.weight` that belongs to the point
    master: IntArray  # the nearest master segment
    active: BoolArray  # the point is in contact


class Options(NamedTuple):
    """The numbers that make a method of this family, in this order."""

    c: FloatArray  # (n_slots,), places on a slave segment in [−1, 1]
    weight: FloatArray  # (n_slots,), shares of the length of a slave segment
    area_from: int  # NODAL, CURRENT or REFERENCE
    penalty: float


class Contact(NamedTuple):
    """One point V at one state: its nodes, its place, and what it sees of its master segment."""

    a: int
    b: int
    node_1: int
    node_2: int
    c: float
    l_12: float
    t: Vector
    normal: Vector
    g: float
    xi: float


def pair(
    x: FloatArray, multipliers: FloatArray, surfaces: Fields, tree: Tree, points: Fields, options: Fields
) -> tuple[IntArray, BoolArray]:
    """Return the nearest master segment of each point at x (n_nodes, 2), and whether the point is active.

    `points` are slave segment and slot of each, (n_points,), and the places c (n_slots,); `options` are τ, the part of
    a master segment by which a foot may lie past its free end, and the penalty.
    """
    n_points = len(points[0])
    answers = np.empty(n_points, dtype=np.int64), np.empty(n_points, dtype=np.bool_)
    _pair_points(answers, x, multipliers, surfaces, tree, points, options)
    return answers


@compile_kernel
def _pair_points(
    answers: Fields,
    x: FloatArray,
    multipliers: FloatArray,
    surfaces: Fields,
    tree: Tree,
    points: Fields,
    options: Fields,
) -> None:
    """Write the answers for all points.

    A point is active where `is_pressed` says so and its foot is on the surface, past a free end by at most τ.
    """
    _, slave, master, neighbours = surfaces
    order, boxes = tree
    segment, slot, c = points
    tau, penalty = options
    nearest, active = answers
    place = NO_PLACE
    for i in range(len(segment)):
        if i > 0 and not is_next(slave, segment[i - 1], segment[i]):
            place = NO_PLACE
        v = PointOnSegment(node(x, slave[segment[i], 0]), node(x, slave[segment[i], 1]), c[slot[i]])
        place = nearest_place_from(place, v, x, master, order, boxes)
        m = order[place]
        x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
        l_12, t, _ = frame(x_1, x_2)
        d = arm(x_1, v)
        g = cross(d, minus(x_2, x_1)) / l_12
        on_surface = foot_on_surface(dot(d, t), l_12, neighbours[m, 0] < 0, neighbours[m, 1] < 0, tau)
        nearest[i] = m
        active[i] = is_pressed(g, multipliers, i, penalty) and on_surface


@compile_part
def is_pressed(g: float, multipliers: FloatArray, i: int, penalty: float) -> bool:
    """Return whether point i is in contact by its gap: g ≤ 0, or with multipliers λ − c g ≥ 0, the penalty being c."""
    if len(multipliers) == 0:
        return g <= 0
    return bool(multipliers[i] - penalty * g >= 0)


def residual(x: Array, multipliers: Array, surfaces: Fields, points: Fields, options: Fields) -> tuple[Array, Array]:
    """Compute forces (n_states, n_nodes, 2) and constraint rows (n_states, n_multipliers) at real or complex x.

    `multipliers` (n_states, n_multipliers) have the type of x (n_states, n_nodes, 2), and no columns for a penalty.
    """
    forces, rows = np.zeros(x.shape, x.dtype), np.zeros(multipliers.shape, x.dtype)
    _add_residual(forces, rows, x, multipliers, surfaces, points, options)
    return forces, rows


@compile_kernel
def _add_residual(
    forces: Array, rows: Array, x: Array, multipliers: Array, surfaces: Fields, points: Fields, options: Fields
) -> None:
    """Add forces and constraint rows to arrays of zeros."""
    reference, slave, master, _ = surfaces
    segment, other, slot, partner, active = points
    places, weights, area_from, penalty = options
    has_multipliers = multipliers.shape[1] > 0
    for state in range(x.shape[0]):
        now, r = x[state], forces[state]
        for i in range(len(active)):
            s, weight = segment[i], weights[slot[i]]
            if not active[i]:
                if has_multipliers:
                    area_0 = 1.0 if area_from == NODAL else weight * area_length(reference, slave, s, other[i])
                    rows[state, i] = multipliers[state, i] * area_0
                continue
            v = contact_at(now, slave[s, 0], slave[s, 1], master[partner[i], 0], master[partner[i], 1], places[slot[i]])
            area = 1 + 0 * v.g  # has the type of x
            if area_from == CURRENT:
                area = weight * area_length(now, slave, s, other[i])
            elif area_from == REFERENCE:
                area = area * (weight * area_length(reference, slave, s, other[i]))
            f = penalty * v.g * area
            if has_multipliers:
                f = -multipliers[state, i] * area
                rows[state, i] = -area * v.g
            push(r, v.a, (1 - v.c) / 2 * f, v.normal)
            push(r, v.b, (1 + v.c) / 2 * f, v.normal)
            push(r, v.node_1, -(1 - v.xi) * f, v.normal)
            push(r, v.node_2, -v.xi * f, v.normal)


@compile_part
def push(forces: Array, number: int, size: float, direction: Vector) -> None:
    """Add a force of this size along a direction to the force on a node."""
    forces[number, 0] += size * direction[0]
    forces[number, 1] += size * direction[1]


@compile_part
def contact_at(x: Array, a: int, b: int, node_1: int, node_2: int, c: float) -> Contact:
    """Return the point at c on the slave segment a b against the master segment 1 2, at x (n_nodes, 2)."""
    x_1, x_2 = node(x, node_1), node(x, node_2)
    l_12, t, normal = frame(x_1, x_2)
    d = arm(x_1, PointOnSegment(node(x, a), node(x, b), c))
    g = cross(d, minus(x_2, x_1)) / l_12
    xi = dot(d, t) / l_12
    return Contact(a, b, node_1, node_2, c, l_12, t, normal, g, xi)


@compile_part
def area_length(x: Array, slave: IntArray, segment: int, other: int) -> float:
    """Return the length of a slave segment, plus that of the other one at a slave node where there is one."""
    length, _, _ = frame(node(x, slave[segment, 0]), node(x, slave[segment, 1]))
    if other >= 0:
        more, _, _ = frame(node(x, slave[other, 0]), node(x, slave[other, 1]))
        length += more
    return length
