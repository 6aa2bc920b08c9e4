"""The shapes of the slave nodes at points, weighted gaps, and the tangent for directions that turn and for half passes.

Pressures of slave nodes are interpolated along the slave, and gaps weighted, with the same shapes; or with dual shapes
and standard ones, respectively. Standard shapes:
N_A = (1−c)/2, N_B = (1+c)/2. Dual shapes: ψ_A, ψ_B with ∫ψ_j N_k = δ_jk ∫N_j over the covered part of each slave
segment. With c̄ the mean of c over that part and v its variance these are

    ψ_A, ψ_B = N_A(c̄) − κ (c − c̄), N_B(c̄) + κ (c − c̄)        κ = (1 − c̄²) / 2v

(∫ψ_B = ∫N_B gives the constant, ∫ψ_B c = ∫N_B the slope.) No matrix is inverted, so a sliver is as good as a whole
segment; in the middle of a segment κ grows there like 1/length, as biorthogonality wants. The weighted gap of a node is
G_j = ∫φ_j g / ∫φ_j over all that is covered, φ = N or ψ, and ∫φ_j = ∫N_j in both cases.

The rows of the factors are those of `cell_frame`; the Δ of points come from `cell_geometry`, in the global frame and
for up to six local nodes. With F = w p and ω the turn of the normal, the rows N_k of the local nodes that are pushed
have

    R_k = Σ N_k F n        ΔR_k = Σ (N_k ΔF + F ΔN_k) n − N_k F ω τ        ΔF = p Δw + w p_c Δc

Rule for the next editor: variations of points are large, so they are made for `PIECE` points at a time, and dropped.

Source: Puso & Laursen (2004); dual shapes: Wohlmuth (2000), on the covered part: Popp, Gitterle, Gee & Wall (2010).
"""

from typing import NamedTuple, Self

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_inline, compile_maker
from contactverif.contract.arrays import UNIT_ROUNDOFF, Array, FloatArray, IntArray
from contactverif.contract.interface import Interface
from contactverif.geometry.block_rows import Fields, NumberArray, add_block, find_entry
from contactverif_mortar.cell_frame import NodeState, add_chains
from contactverif_mortar.cell_geometry import D_C, D_GAP, D_WEIGHT, D_XI, OMEGA
from contactverif_mortar.integration_cells import (
    GAP,
    NORMAL_X,
    NORMAL_Y,
    WEIGHT,
    XI,
    C,
    Parts,
    Quadrature,
    Sides,
    forces,
)
from contactverif_mortar.node_factors import NodeRows, RowGroups

PIECE = 4096  # Points.
# The smallest covered share of a node's own length that counts. Below it the node would carry less than the roundoff of
# its neighbour's force, and the row of its multiplier would vanish.
UNCOVERED = 64 * UNIT_ROUNDOFF


class Shapes(NamedTuple):
    """The values of shapes at points of some states, and how they change."""

    # (n_states, n_points, 2) Values of the shapes of A and B, the nodes of the slave segment that carries the point.
    values: Array
    slope: Array  # (n_states, n_points) Δ of the second shape for each unit of c; Δ of the first is the opposite.
    # (n_states, n_points) Δ of the second shape for each unit of c̄ and of v of the segment; zero for standard shapes.
    by_mean: Array
    by_variance: Array
    centred: Array  # (n_states, n_points) c − c̄, and ∫1 of the segment; zero for standard shapes.
    extent: Array
    variance: Array  # (n_states, n_points) The variance v of the segment; zero for standard shapes.

    @classmethod
    def standard(cls, points: Array) -> Self:
        """Return the standard shapes at points (n_states, n_points, 6)."""
        c, nothing = points[..., C], np.zeros_like(points[..., C])
        return cls(np.stack([(1 - c) / 2, (1 + c) / 2], axis=-1), nothing + 0.5, *[nothing] * 5)

    @classmethod
    def dual(cls, points: Array, segment: IntArray, n_segments: int) -> Self:
        """Return the dual shapes on what the points cover; `segment` (n_points,) is the slave segment of each."""
        c, w = points[..., C], points[..., WEIGHT]
        begins = np.r_[True, segment[1:] != segment[:-1]] if len(segment) else np.zeros(0, bool)
        first = np.maximum.accumulate(np.where(begins, np.arange(len(segment)), 0))  # The first point of each segment.
        rough = c[..., first]  # a place in the covered part: so c − c̄ is as exact as c, however short the part
        extent = _sum_by_node(w, segment, n_segments)[..., segment]
        mean = _sum_by_node(w * (c - rough), segment, n_segments)[..., segment] / extent
        centred = (c - rough) - mean
        mean = rough + mean
        variance = _sum_by_node(w * centred * centred, segment, n_segments)[..., segment] / extent
        kappa = (1 - mean) * (1 + mean) / (2 * variance)
        second = (1 + mean) / 2 + kappa * centred
        first_value = (1 - mean) / 2 - kappa * centred
        values, by_mean = np.stack([first_value, second], axis=-1), 0.5 - kappa - mean / variance * centred
        return cls(values, kappa, by_mean, -kappa / variance * centred, centred, extent, variance)

    def interpolate(self, node_values: Array, ends: IntArray) -> Array:
        """Interpolate values (n_states, n_nodes) of the nodes to the points, each between its nodes `ends`."""
        interpolated: Array = (self.values * node_values[..., ends]).sum(axis=-1)
        return interpolated


@compile_maker
def _sum_by_node(values: Array, numbers: IntArray, n_numbers: int) -> Array:
    """Return sums (n_states, n_numbers) of the values (n_states, n) that belong to the same of the numbers (n,)."""
    sums = np.zeros((values.shape[0], n_numbers), dtype=values.dtype)
    for state in range(values.shape[0]):
        for i in range(len(numbers)):
            sums[state, numbers[i]] += values[state, i]
    return sums


class Weighted(NamedTuple):
    """The points of some parts of slave segments at some states, the slave nodes' shapes there, and weighted gaps."""

    sides: Interface | Sides
    parts: Parts
    points: Array  # (n_states, n_points, 6) The points of `Quadrature.points`.
    shapes: Shapes
    ends: IntArray  # (n_points, 2) The slave nodes of each point.
    segment: IntArray  # (n_points,) The slave segment of each point.
    areas: Array  # (n_states, n_slave_nodes) ∫φ_j and ∫φ_j g.
    with_gap: Array
    weights: Shapes  # The shapes φ_j: those of the pressures, or standard ones.

    def forces(self, pressure: Array) -> Array:
        """Compute forces (n_states, n_nodes, 2) from pressures (n_states, n_slave_nodes) of the slave nodes."""
        at_points, nodes = self.shapes.interpolate(pressure, self.ends), self.parts.local_nodes(self.sides)
        return forces(self.points, at_points, nodes, len(self.sides.nodes))


def weigh_points(
    sides: Interface | Sides, parts: Parts, rule: Quadrature, x: Array, dual: bool, alike: bool = True
) -> Weighted:
    """Compute points, shapes and weighted gaps on some parts of slave segments, at x (n_states, n_nodes, 2)."""
    points, segment, n_nodes = rule.points(sides, parts, x), parts.carriers(len(rule)), sides.n_slave_nodes
    ends = sides.slave.segments[segment]
    shapes = Shapes.dual(points, segment, len(sides.slave)) if dual else Shapes.standard(points)
    weights = shapes if alike else Shapes.standard(points)
    weighted = weights.values * points[..., WEIGHT, None]
    with_gap = weighted * points[..., GAP, None]
    areas = _sum_by_node(weighted.reshape(len(points), -1), ends.ravel(), n_nodes)
    gaps = _sum_by_node(with_gap.reshape(len(points), -1), ends.ravel(), n_nodes)
    return Weighted(sides, parts, points, shapes, ends, segment, areas, gaps, weights)


def own_lengths(sides: Interface | Sides, x: FloatArray) -> FloatArray:
    """Return half of the length of the segments at each slave node (n_slave_nodes,), at x (n_nodes, 2)."""
    halves = np.repeat(sides.slave.lengths(x) / 2, 2)
    lengths: FloatArray = _sum_by_node(halves[None], sides.slave.segments.ravel(), sides.n_slave_nodes)[0]
    return lengths


def divide_covered(areas: FloatArray, with_gap: FloatArray, lengths: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return ∫N_j and G_j (n_slave_nodes,) of nodes with own `lengths`; zero and NaN where nothing is covered."""
    covered = areas > UNCOVERED * lengths
    gaps = np.full(len(covered), np.nan)
    gaps[covered] = with_gap[covered] / areas[covered]
    return np.where(covered, areas, 0.0), gaps


def add_shaped_rows(
    weighted: Weighted,
    rule: Quadrature,
    x: FloatArray,
    groups: RowGroups,
    state: NodeState,
    n_pushed: int,
    total: FloatArray,
    rest: sparse.csr_array,
) -> NodeRows:
    """Add forces and their derivative at fixed pressures to `total` and `rest`, and return them with the factors.

    The first state of `weighted` is x (n_nodes, 2). Forces act on the first `n_pushed` local nodes: 4, or 2 where they
    act on the slave alone. `rest` has the places of all pushed nodes and local nodes of each cell.
    """
    points, slave, n_cells = weighted.points[0], weighted.sides.slave.segments, len(groups.local)
    left, right = np.zeros((2, 2 * len(groups.nodes)))
    dual = len(groups.starts) - 1 > len(state.pressure)
    chain = np.zeros((len(slave) if dual else 0, 2, 2))
    n_q = len(points) // max(n_cells, 1)
    weighting = weighted.weights.values[0], weighted.weights.slope[0]
    places, at_points = (points, weighted.segment, slave, groups.local), tuple(each[0] for each in weighted.shapes)
    at_nodes, factors = (state.pressure, state.gaps, state.divisor), (groups.nodes, groups.starts, left, right)
    written = total, (rest.indptr, rest.indices, rest.data), factors, chain
    size = max(PIECE // max(n_q, 1), 1)
    for begin in range(0, n_cells, size):
        variations = rule.variations(weighted.sides, weighted.parts.select(slice(begin, begin + size)), x)
        _add_points(written, (begin * n_q, n_q, n_pushed, *weighting), places, at_points, variations, at_nodes)
    if dual and weighted.weights is weighted.shapes:
        add_chains(slave, chain, state.divisor, groups.nodes, groups.starts, right)
    return NodeRows(total, rest, groups, left, right, state.weights)


@compile_maker
def _add_points(
    written: Fields, counts: Fields, places: Fields, shapes: Fields, variations: FloatArray, at_nodes: Fields
) -> None:
    """Add what the points from the first one on give, one for each of their Δ."""
    first_point, n_q, n_pushed, by, by_place = counts
    total, csr, factors, chain = written
    points, segment, slave, local = places
    values, slope, by_mean, by_variance, centred, extent, variance = shapes
    pressure, gaps, divisor = at_nodes
    starts = factors[1]
    n_local = local.shape[1]
    block = np.zeros((4, 2, n_local, 2))
    row = np.empty((n_local, 2))
    for i in range(len(variations)):
        number = first_point + i
        point, d, cell, s = points[number], variations[i], local[number // n_q], segment[number]
        a, b, w = slave[s, 0], slave[s, 1], point[WEIGHT]
        difference = pressure[b] - pressure[a]
        p = pressure[a] * values[number, 0] + pressure[b] * values[number, 1]
        _add_block_of_point(block, n_pushed, point, d, p, difference * slope[number])
        transmit = ((1 - point[C]) / 2, (1 + point[C]) / 2, point[XI] - 1, -point[XI])
        for k in range(n_pushed):
            total[2 * cell[k]] += transmit[k] * w * p * point[NORMAL_X]
            total[2 * cell[k] + 1] += transmit[k] * w * p * point[NORMAL_Y]
        for end, sign in enumerate((-1.0, 1.0)):
            j = slave[s, end]
            shape, weight, above = values[number, end], by[number, end], point[GAP] - gaps[j]
            if starts[j + 1] > starts[j]:
                for k in range(n_local):
                    for axis in range(2):
                        d_weighted = weight * d[D_WEIGHT, k, axis] + w * sign * by_place[number] * d[D_C, k, axis]
                        row[k, axis] = (w * weight * d[D_GAP, k, axis] + above * d_weighted) / divisor[j]
                _add_row(factors, j, cell, row, n_pushed, point, shape)
            if len(chain):
                chain[s, end, 0] += sign * above * w * by_mean[number]
                chain[s, end, 1] += sign * above * w * by_variance[number]
        if len(chain):
            off = centred[number]  # c − c̄
            mean_row = (len(pressure) + s, off, 1.0, difference * by_mean[number])
            by_weight, by_slope = off * off - variance[number], difference * by_variance[number]
            variance_row = (len(pressure) + len(slave) + s, by_weight, 2 * off, by_slope)
            for j, by_w, by_c, by_moment in (mean_row, variance_row):
                for k in range(n_local):
                    for axis in range(2):
                        change = by_w * d[D_WEIGHT, k, axis] + w * by_c * d[D_C, k, axis]
                        row[k, axis] = change / extent[number]
                _add_row(factors, j, cell, row, n_pushed, point, by_moment)
        if (number + 1) % n_q == 0:
            for k in range(n_pushed):
                for column in range(n_local):
                    xx, xy = block[k, 0, column, 0], block[k, 0, column, 1]
                    yx, yy = block[k, 1, column, 0], block[k, 1, column, 1]
                    add_block(csr, cell[k], cell[column], xx, xy, yx, yy)
            block[:] = 0.0


@compile_inline
def _add_block_of_point(
    block: FloatArray, n_pushed: int, point: FloatArray, d: FloatArray, p: float, p_c: float
) -> None:
    c, xi, w = point[C], point[XI], point[WEIGHT]
    n = (point[NORMAL_X], point[NORMAL_Y])
    tau, f = (-n[1], n[0]), w * p
    shape = ((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)
    for column in range(d.shape[1]):
        for j in range(2):
            d_c, d_xi = d[D_C, column, j], d[D_XI, column, j]
            d_f = p * d[D_WEIGHT, column, j] + w * p_c * d_c
            d_shape = (-d_c / 2, d_c / 2, d_xi, -d_xi)
            for k in range(n_pushed):
                along_n, along_tau = shape[k] * d_f + f * d_shape[k], -shape[k] * f * d[OMEGA, column, j]
                for i in range(2):
                    block[k, i, column, j] += along_n * n[i] + along_tau * tau[i]


@compile_inline
def _add_row(
    factors: Fields, j: int, cell: NumberArray, row: FloatArray, n_pushed: int, point: FloatArray, pressure: float
) -> None:
    """Add Δ (n_local, 2) to row j of `right`, and the forces of a pressure at the point to that of `left`."""
    nodes, starts, left, right = factors
    f = point[WEIGHT] * pressure
    transmit = ((1 - point[C]) / 2, (1 + point[C]) / 2, point[XI] - 1, -point[XI])
    for k in range(len(cell)):
        place = 2 * find_entry(nodes, starts[j], starts[j + 1], cell[k])
        right[place] += row[k, 0]
        right[place + 1] += row[k, 1]
        if k < n_pushed:
            left[place] += f * transmit[k] * point[NORMAL_X]
            left[place + 1] += f * transmit[k] * point[NORMAL_Y]
