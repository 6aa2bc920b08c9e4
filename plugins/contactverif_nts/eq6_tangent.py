"""The exact tangent of Eq. 6: the derivative of `eq6.residual` for one point against one master segment.

A Δ of a number belongs to one node at a time, a column of the tangent: it is the vector of what the number gains for a
displacement of that node along x and along y. Nothing is allocated for a point, and `add_tangent` writes no block that
`list_couplings` does not list.

Source: Zavarise & De Lorenzis (2009), Eqs. A1–A12.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_maker
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.geometry.block_rows import NumberArray, add_column, add_entry, add_row
from contactverif.geometry.projection import Vector, frame, node
from contactverif_nts.eq6 import CURRENT, NODAL, REFERENCE, Contact, Csr, Fields, area_length, contact_at
from contactverif_nts.turned_force import ZERO, add_turned_force, plus, times

# Local nodes: those of the other slave segment at a slave node; B, 1, 2, A.
OTHER_A, OTHER_B, B, NODE_1, NODE_2, A = range(6)
N_LOCAL = 6


class Gains(NamedTuple):
    """Vectors by which the numbers of a point grow for a displacement of one node."""

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
    """Add the derivative of `residual` at one state to a matrix with the pattern of `list_couplings`.

    `csr` has its indptr, indices and data.
    """
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
        _add_forces(csr, nodes, begin, first_row, v, force, not has_multipliers)


@compile_inline
def _add_forces(
    csr: Csr, nodes: NumberArray, begin: int, first_row: int, v: Contact, force: Force, is_spring: bool
) -> None:
    """Add Δ of the forces on A, B, 1 and 2, share × F n."""
    f = force.f
    for k in range(begin, N_LOCAL):
        d = _gains(k, v, force)
        by_e = times(force.area, d.g) if is_spring else ZERO
        d_f = times(force.stiffness, plus(by_e, times(force.e, d.area)))
        for row in range(first_row, N_LOCAL):
            share = _share(row, v)
            d_size = times(share, d_f)
            if row == NODE_1:
                d_size = plus(d_size, times(f, d.xi))
            elif row == NODE_2:
                d_size = plus(d_size, times(-f, d.xi))
            add_turned_force(csr, nodes[row], nodes[k], v, share * f, d_size, d.omega)


@compile_inline
def _add_constraint(
    csr: Csr, nodes: NumberArray, begin: int, first_row: int, unknown: int, v: Contact, force: Force
) -> None:
    """Add Δ of the constraint −area × g, and what a unit of the multiplier pushes with: −area n."""
    for k in range(begin, N_LOCAL):
        d = _gains(k, v, force)
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
def _gains(k: int, v: Contact, force: Force) -> Gains:
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
    return Gains(omega, g, xi, area)


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
