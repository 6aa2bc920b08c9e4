"""The kernels of Eq. 6: one point V of a slave segment A B against one master segment 1 → 2, and their exact tangent.

    x_V = (1−c)/2 x_A + (1+c)/2 x_B        F = penalty × g × area
    R_A = (1−c)/2 F n    R_B = (1+c)/2 F n    R_1 = −(1−ξ) F n    R_2 = −ξ F n

The area of a point is its weight × the length of the slave segment that carries it, plus the same for the other slave
segment at a slave node (NTS-AR), or 1 (NTS).

With multipliers λ, one for each point, F = −λ × area. Each point then has a constraint row: −area × g where it is
active, area × λ where it is not. The area of that second row is measured in the reference configuration, so that the
row never vanishes. Arrays of multipliers without columns mean a penalty.

The variation Δ of a number belongs to one node at a time, a column of the tangent: it is the vector of what the number
gains for a displacement of that node along x and along y.

Rules for the next editor:

1. `pair` makes all decisions and returns integers and booleans. `add_residual` decides nothing.
2. `add_residual` takes float64 and complex128, so a number that starts as a constant gets the type of x first.
3. A kernel gets plain tuples and unpacks them in its first lines: numba reads them in half the time of named ones.
   `surfaces` are the reference positions (n_nodes, 2), slave and master segments (n, 2), and the master's neighbours
   (n, 2), −1 at a free end. `points` are the fields of `Points`. `options` are places c on a slave segment and shares
   of its length, (n_slots,) each, NODAL, CURRENT or REFERENCE, and the penalty. Named tuples of numbers are free.
4. `add_tangent` differentiates the residual line by line: change both. It writes no block that `list_couplings` does
   not list, and allocates nothing for a point.

Source: Zavarise & De Lorenzis (2009), Eqs. 6, A1–A12.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_kernel, compile_maker, compile_part
from contactverif.contract.arrays import Array, BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface, join_rows, split_states
from contactverif.geometry.block_rows import Csr, Fields, NumberArray, add_block, add_column, add_entry, add_row
from contactverif.geometry.projection import (
    NO_PLACE,
    ZERO,
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
    plus,
    times,
)

NODAL, CURRENT, REFERENCE = 0, 1, 2  # The area of a point: 1, or lengths in one of two configurations.
AREAS = {"current": CURRENT, "reference": REFERENCE}  # The words of the option `area`.

# The local nodes of a point: those of the other slave segment at a slave node; B, 1, 2, A.
OTHER_A, OTHER_B, B, NODE_1, NODE_2, A = range(6)
N_LOCAL = 6


class Points(NamedTuple):
    """The pairing of points, each array of shape (n_points,), in this order."""

    segment: IntArray  # the slave segment that carries the point
    other: IntArray  # the other slave segment at a slave node, −1 if there is none
    slot: IntArray  # its entry of the places and shares in `options`
    master: IntArray  # the nearest master segment
    active: BoolArray  # the point is in contact


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


def pair(state: Fields, surfaces: Fields, tree: Tree, points: Fields, options: Fields) -> tuple[IntArray, BoolArray]:
    """Return the nearest master segment of each point, and whether it is active, at x (n_nodes, 2) and multipliers.

    `points` are slave segment and slot of each, (n_points,), and the places c (n_slots,); `options` are τ, the part of
    a master segment by which a foot may lie past its free end, and the penalty.
    """
    n_points = len(points[0])
    answers = np.empty(n_points, dtype=np.int64), np.empty(n_points, dtype=np.bool_)
    _pair_points(answers, state, surfaces, tree, points, options)
    return answers


@compile_kernel
def _pair_points(answers: Fields, state: Fields, surfaces: Fields, tree: Tree, points: Fields, options: Fields) -> None:
    """Write the answers: active is what `is_pressed` says so of, with its foot past a free end by at most τ."""
    x, multipliers = state
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


def residual_of(add: Callable[..., None], interface: Interface, z: Array, arguments: Sequence[Fields]) -> Array:
    """Return the forces and, behind them, the constraint rows that a kernel adds at the states z (..., n_unknowns)."""
    x, multipliers = split_states(interface, z)
    forces, rows = np.zeros(x.shape, x.dtype), np.zeros(multipliers.shape, x.dtype)
    add(forces, rows, x, multipliers, *arguments)
    return join_rows(forces, rows, z)


@compile_kernel
def add_residual(
    forces: Array, rows: Array, x: Array, multipliers: Array, surfaces: Fields, points: Fields, options: Fields
) -> None:
    """Add the forces (n_states, n_nodes, 2) and the constraint rows (n_states, n_multipliers) at real or complex x.

    `multipliers` (n_states, n_multipliers) have the type of x (n_states, n_nodes, 2), and no columns for a penalty.
    """
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
    """Add a force along a direction to the force on a node."""
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


class Variation(NamedTuple):
    """The change of the numbers of a point for a displacement of one node."""

    omega: Vector
    g: Vector
    xi: Vector
    area: Vector


class Force(NamedTuple):
    """The force F of a point, negative where it presses: F = stiffness × e × area."""

    f: float
    stiffness: float  # the penalty, or 1 for a multiplier
    e: float  # the gap, or −λ
    area: float
    t_ab: Vector  # weight × tangent of the slave segment; zero where no current length counts
    t_other: Vector  # the same of the other slave segment


@compile_maker
def add_tangent(
    csr: Csr, x: FloatArray, multipliers: FloatArray, surfaces: Fields, points: Fields, options: Fields
) -> None:
    """Add the derivative of `residual` at one state to a matrix with the pattern of `list_couplings`."""
    reference, slave, master, _ = surfaces
    segment, other, slot, partner, active = points
    places, weights, area_from, penalty = options
    has_multipliers = len(multipliers) > 0
    nodes = np.empty(N_LOCAL, dtype=np.int32)
    for i in range(len(active)):
        s, weight, unknown = segment[i], weights[slot[i]], x.size + i  # `unknown`: row and column of the multiplier
        if not active[i]:
            if has_multipliers:
                area = 1.0 if area_from == NODAL else weight * area_length(reference, slave, s, other[i])
                add_entry(csr, unknown, unknown, area)
            continue
        begin, first_row = _fill_nodes(nodes, slave, master, s, other[i], partner[i], places[slot[i]], area_from)
        v = contact_at(x, nodes[A], nodes[B], nodes[NODE_1], nodes[NODE_2], places[slot[i]])
        area, t_ab, t_other = 1.0, ZERO, ZERO
        if area_from == REFERENCE:
            area = weight * area_length(reference, slave, s, other[i])
        elif area_from == CURRENT:
            area = weight * area_length(x, slave, s, other[i])
            t_ab = times(weight, frame(node(x, nodes[A]), node(x, nodes[B]))[1])
            if begin == OTHER_A:
                t_other = times(weight, frame(node(x, nodes[OTHER_A]), node(x, nodes[OTHER_B]))[1])
        force = Force(penalty * v.g * area, penalty, v.g, area, t_ab, t_other)
        if has_multipliers:
            force = Force(-multipliers[i] * area, 1.0, -multipliers[i], area, t_ab, t_other)
            _add_constraint(csr, nodes, begin, first_row, unknown, v, force)
        _add_linearized_forces(csr, nodes, begin, first_row, v, force, not has_multipliers)


@compile_inline
def _add_linearized_forces(
    csr: Csr, nodes: NumberArray, begin: int, first_row: int, v: Contact, force: Force, is_spring: bool
) -> None:
    """Add Δ of the forces on A, B, 1 and 2, share × F n."""
    f = force.f
    for k in range(begin, N_LOCAL):
        d = _variation(k, v, force)
        by_e = times(force.area, d.g) if is_spring else ZERO
        d_f = times(force.stiffness, plus(by_e, times(force.e, d.area)))
        for row in range(first_row, N_LOCAL):
            share = _share(row, v)
            d_size = times(share, d_f)
            if row == NODE_1:
                d_size = plus(d_size, times(f, d.xi))
            elif row == NODE_2:
                d_size = plus(d_size, times(-f, d.xi))
            _add_turned_force(csr, nodes[row], nodes[k], v, share * f, d_size, d.omega)


@compile_inline
def _add_turned_force(
    csr: Csr, row: int, column: int, v: Contact, force: float, d_force: Vector, omega: Vector
) -> None:
    """Add Δ(force n) = n Δforce + force Δn, Δn = −t ω; `d_force` and `omega` are for displacements of node `column`."""
    normal, t = v.normal, v.t
    xx = normal[0] * d_force[0] - force * t[0] * omega[0]
    xy = normal[0] * d_force[1] - force * t[0] * omega[1]
    yx = normal[1] * d_force[0] - force * t[1] * omega[0]
    yy = normal[1] * d_force[1] - force * t[1] * omega[1]
    add_block(csr, row, column, xx, xy, yx, yy)


@compile_inline
def _add_constraint(
    csr: Csr, nodes: NumberArray, begin: int, first_row: int, unknown: int, v: Contact, force: Force
) -> None:
    """Add Δ of the constraint −area × g, and what a unit of the multiplier pushes with: −area n."""
    for k in range(begin, N_LOCAL):
        d = _variation(k, v, force)
        d_row = times(-1.0, plus(times(force.area, d.g), times(v.g, d.area)))
        add_row(csr, unknown, nodes[k], d_row[0], d_row[1])
    for row in range(first_row, N_LOCAL):
        size = -force.area * _share(row, v)
        add_column(csr, nodes[row], unknown, size * v.normal[0], size * v.normal[1])


@compile_inline
def _fill_nodes(
    nodes: NumberArray, slave: IntArray, master: IntArray, s: int, other: int, partner: int, c: float, area_from: int
) -> tuple[int, int]:
    """Write the local nodes of a point into `nodes`; return the first one, and the first one that a force acts on.

    The other slave segment counts where the area has its current length. A point at A leaves B without a force.
    """
    nodes[A], nodes[B] = slave[s, 0], slave[s, 1]
    nodes[NODE_1], nodes[NODE_2] = master[partner, 0], master[partner, 1]
    begin = B
    if other >= 0 and area_from == CURRENT:
        nodes[OTHER_A], nodes[OTHER_B], begin = slave[other, 0], slave[other, 1], OTHER_A
    return begin, NODE_1 if c == -1.0 else B


@compile_inline
def _share(row: int, v: Contact) -> float:
    """Return the share of a local node in the force F (Eq. 6), by which its displacement counts in the gap, too."""
    if row == A:
        return (1 - v.c) / 2
    if row == B:
        return (1 + v.c) / 2
    if row == NODE_1:
        return -(1 - v.xi)
    return -v.xi if row == NODE_2 else 0.0


@compile_inline
def _variation(k: int, v: Contact, force: Force) -> Variation:
    """Return Δω, Δg, Δξ and Δ of the area for a displacement of the local node k."""
    shape, omega, area = _share(k, v), ZERO, ZERO
    if k == NODE_1:
        omega = times(-1 / v.l_12, v.normal)  # ω = n·(Δx2 − Δx1)/l
    elif k == NODE_2:
        omega = times(1 / v.l_12, v.normal)
    elif k in (A, B):
        area = times(1.0 if k == B else -1.0, force.t_ab)  # Δl_AB = t_AB·(Δx_B − Δx_A)
    else:
        area = times(1.0 if k == OTHER_B else -1.0, force.t_other)
    g = times(shape, v.normal)  # Δg = n·(Δx_V − (1−ξ)Δx1 − ξΔx2)
    xi = times(1 / v.l_12, plus(times(shape, v.t), times(v.g, omega)))  # l Δξ = t·(Δx_V − (1−ξ)Δx1 − ξΔx2) + g ω
    return Variation(omega, g, xi, area)


@compile_maker
def list_couplings(
    surfaces: Fields, points: Fields, places: FloatArray, area_from: int, first_multiplier: int
) -> tuple[NumberArray, IntArray, IntArray]:
    """List which nodes feel which, as the fields of `Couplings`: one coupling for each active point or multiplier.

    The number of the first multiplier is −1 for a penalty.
    """
    _, slave, master, _ = surfaces
    segment, other, slot, partner, active = points
    has_multipliers = first_multiplier >= 0
    listed = np.empty((N_LOCAL + 1) * len(active), dtype=np.int32)
    starts, first_row = np.empty(len(active) + 1, dtype=np.int64), np.empty(len(active), dtype=np.int64)
    nodes = np.empty(N_LOCAL, dtype=np.int32)
    coupling, place, starts[0] = 0, 0, 0
    for i in range(len(active)):
        if not active[i] and not has_multipliers:
            continue
        first_row[coupling] = place
        if active[i]:
            begin, row = _fill_nodes(nodes, slave, master, segment[i], other[i], partner[i], places[slot[i]], area_from)
            first_row[coupling] = place + row - begin
            for k in range(begin, N_LOCAL):
                listed[place] = nodes[k]
                place += 1
        if has_multipliers:
            listed[place] = first_multiplier + i
            place += 1
        coupling += 1
        starts[coupling] = place
    return listed[:place], starts[: coupling + 1], first_row[:coupling]
