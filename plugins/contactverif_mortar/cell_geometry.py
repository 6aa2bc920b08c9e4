"""One slave segment A B against one master segment 1 → 2: what a point of the slave sees, and its Δ.

Each point of the slave, at c ∈ [−1, 1], looks along a direction ν(c), linear in c between the directions of both ends.
It sees the master where the line along ν meets the segment:

    x_s = (1−c)/2 x_A + (1+c)/2 x_B      n = ν/|ν| (out of the slave)      τ = n turned, along the slave
    ξ = (x_s − x_1)·τ / (x_2 − x_1)·τ    x_m = (1−ξ) x_1 + ξ x_2           g = (x_m − x_s)·n, negative in penetration

Neither x_s nor x_m is ever computed, only vectors between them and nodes (`projection.arm`).

With the segment's own normal at both ends ν is constant. With averaged normals ν = (n_A + n_B)/2 + c (n_B − n_A)/2, and
n_A is the unit vector along the sum of the normals of the two segments at A. A node e of the master is then seen from
the c that solves the quadratic (x_e − x_s(c))·τ(c) |ν| = 0. In both cases x_m − x_s is along n. So forces along n at
x_s and x_m balance in sum and in moment, point by point.

A Δ of a number is an array (n_local, 2): what the number gains for each displacement of A, B, 1, 2, and with averaged
normals of the slave nodes before A and behind B. With ω the turn of the directions, Δτ = n ω and Δn = −τ ω.

Rule for the next editor: every function here takes real and complex positions, except those that compute a Δ.

Source: Zavarise & Wriggers (1998), Puso & Laursen (2004), Popp, Gitterle, Gee & Wall (2010). The Δ are derived here.
"""

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_part
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.geometry.projection import PointOnSegment, Vector, arm, between, cross, dot, frame, minus, node

A, B, NODE_1, NODE_2, BEFORE, BEHIND = range(6)  # local nodes
D_C, D_XI, D_GAP, D_WEIGHT, OMEGA = range(5)  # The Δ of a point, in this order.


class SlaveView(NamedTuple):
    """A slave segment A B and the directions in which its two ends look."""

    x_a: Vector
    x_b: Vector
    n_a: Vector
    n_b: Vector
    straight: bool  # both ends look along the segment's own normal


@compile_part
def turn(n: Vector) -> Vector:
    """Return τ of a normal n: the tangent that belongs to it in `frame`."""
    return -n[1], n[0]


@compile_inline
def slave_view(x: FloatArray, slave: IntArray, segment: int, before: int, behind: int) -> SlaveView:
    """Return a slave segment with the directions of its ends.

    The normal at A is averaged with that of the segment `before`, the normal at B with that of `behind`, −1 for none.
    """
    x_a, x_b = node(x, slave[segment, 0]), node(x, slave[segment, 1])
    _, _, n = frame(x_a, x_b)
    n_a, n_b = n, n
    if before >= 0:
        n_a = _average_normal(x, slave, n, before)
    if behind >= 0:
        n_b = _average_normal(x, slave, n, behind)
    return SlaveView(x_a, x_b, n_a, n_b, before < 0 and behind < 0)


@compile_part
def _average_normal(x: FloatArray, slave: IntArray, n: Vector, other: int) -> Vector:
    """Return the unit vector along the sum of the normal n and that of another slave segment."""
    _, _, n_other = frame(node(x, slave[other, 0]), node(x, slave[other, 1]))
    total = (n[0] + n_other[0], n[1] + n_other[1])
    size = np.sqrt(dot(total, total))
    return total[0] / size, total[1] / size


@compile_part
def seen_from(x_e: Vector, view: SlaveView) -> float:
    """Return the c from which the point x_e is seen: the root at which it passes from ahead to behind as c grows."""
    x_a, x_b, n_a, n_b, straight = view
    half = ((x_b[0] - x_a[0]) / 2, (x_b[1] - x_a[1]) / 2)
    from_e = arm(x_e, PointOnSegment(x_a, x_b, 0.0))
    tau_0 = turn(n_a) if straight else turn(between(n_a, n_b, 0.0))
    d, slope = -dot(from_e, tau_0), dot(half, tau_0)
    if straight:
        return d / slope
    tau_1 = turn(((n_b[0] - n_a[0]) / 2, (n_b[1] - n_a[1]) / 2))
    slope += dot(from_e, tau_1)
    c: float = 2 * d / (slope + np.sqrt(slope * slope + 4 * dot(half, tau_1) * d))
    return c


@compile_part
def facing_point(view: SlaveView, x_1: Vector, x_2: Vector, c: float) -> tuple[float, float, Vector]:
    """Return ξ, the gap g and the normal n (out of the slave) at c."""
    d, along = arm(x_1, PointOnSegment(view.x_a, view.x_b, c)), minus(x_2, x_1)
    n = view.n_a
    if not view.straight:
        nu = between(view.n_a, view.n_b, c)
        size = np.sqrt(dot(nu, nu))
        n = (nu[0] / size, nu[1] / size)
    tau = turn(n)
    length = dot(along, tau)  # negative
    return dot(d, tau) / length, cross(along, d) / length, n


@compile_part
def turn_of_ends(
    x: FloatArray, slave: IntArray, segment: int, before: int, behind: int, d_omega_a: FloatArray, d_omega_b: FloatArray
) -> None:
    """Write the turns of n_A and n_B into two arrays (n_local, 2): ω = n·(Δx_B − Δx_A)/l of the segment alone.

    A normal that is averaged with the normal n′ of a neighbour turns by τ_A·(t ω + t′ ω′)/|n + n′|.
    """
    length, t, n = frame(node(x, slave[segment, 0]), node(x, slave[segment, 1]))
    for row in (d_omega_a, d_omega_b):
        row[:] = 0.0
        for i in range(2):
            row[A, i] = -n[i] / length
            row[B, i] = n[i] / length
    if before >= 0:
        _average_turn(d_omega_a, x, slave, before, t, n, BEFORE, A)
    if behind >= 0:
        _average_turn(d_omega_b, x, slave, behind, t, n, B, BEHIND)


@compile_part
def _average_turn(
    row: FloatArray, x: FloatArray, slave: IntArray, other: int, t: Vector, n: Vector, first: int, second: int
) -> None:
    """Average `row`, the turn of n, with that of segment `other`, whose local nodes are `first` and `second`."""
    length, t_other, n_other = frame(node(x, slave[other, 0]), node(x, slave[other, 1]))
    total = (n[0] + n_other[0], n[1] + n_other[1])
    squared = dot(total, total)
    tau = turn(total)  # longer than one by |n + n′|, hence the square
    row *= dot(tau, t) / squared
    share = dot(tau, t_other) / squared / length
    for i in range(2):
        row[first, i] -= share * n_other[i]
        row[second, i] += share * n_other[i]


@compile_part
def variation_of_cut(
    d_c: FloatArray, c: float, cutting: int, x_e: Vector, view: SlaveView, d_omega_a: FloatArray, d_omega_b: FloatArray
) -> None:
    """Write Δ of the c from which local node `cutting`, at x_e, is seen, into d_c (n_local, 2).

    [τ·(x_B − x_A)/2 − h ω_c] Δc = τ·(Δx_e − (1−c)/2 Δx_A − (1+c)/2 Δx_B) + h ω, with h = (x_e − x_s)·n, ω the turn of n
    at fixed c and ω_c its turn for each unit of c.
    """
    x_a, x_b, n_a, n_b, _ = view
    nu = between(n_a, n_b, c)
    size = np.sqrt(dot(nu, nu))
    n = (nu[0] / size, nu[1] / size)
    tau = turn(n)
    height = -dot(arm(x_e, PointOnSegment(x_a, x_b, c)), n)
    slope = dot(minus(x_b, x_a), tau) / 2 + height * dot(minus(n_b, n_a), tau) / 2 / size
    part_a = height * (1 - c) / 2 * dot(tau, turn(n_a)) / size / slope
    part_b = height * (1 + c) / 2 * dot(tau, turn(n_b)) / size / slope
    for k in range(len(d_c)):
        for i in range(2):
            d_c[k, i] = part_a * d_omega_a[k, i] + part_b * d_omega_b[k, i]
    for i in range(2):
        d_c[cutting, i] += tau[i] / slope
        d_c[A, i] -= (1 - c) / 2 * tau[i] / slope
        d_c[B, i] -= (1 + c) / 2 * tau[i] / slope


@compile_part
def variation_of_point(
    variation: FloatArray,
    c: float,
    view: SlaveView,
    x_1: Vector,
    x_2: Vector,
    d_omega_a: FloatArray,
    d_omega_b: FloatArray,
) -> None:
    """Write Δξ, Δg and ω at c into `variation` (5, n_local, 2), which holds Δc already.

        (x_2 − x_1)·τ Δξ = τ·(Δx_s − (1−ξ)Δx_1 − ξΔx_2) − g ω
        Δg = n·((1−ξ)Δx_1 + ξΔx_2 − Δx_s) + n·(x_2 − x_1) Δξ

    Δx_s at fixed c gains (x_B − x_A)/2 Δc, and ω gains ω_c Δc.
    """
    xi, gap, n = facing_point(view, x_1, x_2, c)
    x_a, x_b, n_a, n_b, _ = view
    nu = between(n_a, n_b, c)
    size = np.sqrt(dot(nu, nu))
    tau = turn(n)
    ab, along = minus(x_b, x_a), minus(x_2, x_1)
    length, lean = dot(along, tau), dot(along, n)
    part_a = (1 - c) / 2 * dot(tau, turn(n_a)) / size
    part_b = (1 + c) / 2 * dot(tau, turn(n_b)) / size
    bend = -dot(minus(n_b, n_a), tau) / 2 / size
    along_tau, along_n = dot(ab, tau) / 2, dot(ab, n) / 2
    shape = ((1 - c) / 2, (1 + c) / 2, -(1 - xi), -xi)
    for k in range(variation.shape[1]):
        for i in range(2):
            d_c = variation[D_C, k, i]
            omega = part_a * d_omega_a[k, i] + part_b * d_omega_b[k, i] + bend * d_c
            d_xi = along_tau * d_c - gap * omega
            d_gap = -along_n * d_c
            if k < 4:
                d_xi += shape[k] * tau[i]
                d_gap -= shape[k] * n[i]
            d_xi /= length
            variation[OMEGA, k, i] = omega
            variation[D_XI, k, i] = d_xi
            variation[D_GAP, k, i] = d_gap + lean * d_xi
