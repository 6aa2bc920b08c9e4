"""The forces of a mortar method and the rows of its tangent's factors, for slaves that look along their own normal.

With the shapes φ_A, φ_B of the slave nodes and p = Σ p_j φ_j at fixed p_j, row j of the factors is

    B_j = Σ w φ_j (N_A, N_B, ξ−1, −ξ) n        D_j = Σ [w φ_j Δg + (g − G_j) Δ(w φ_j)] / divisor_j

Standard shapes are φ_B = (1 + c)/2. A dual shape φ_B = (1 + c̄)/2 + κ (c − c̄) depends on the mean c̄ and the variance
v of c on what is covered of its segment, too: κ = (1 − c̄²)/2v. So each slave segment has two rows more. They hold in
`right` the Δ of c̄ and of v, and in `left` the forces of a unit of each. D_j gains from both by the chain rule:

    ∫1 Δc̄ = Σ (c − c̄) Δw + w Δc        ∫1 Δv = Σ ((c − c̄)² − v) Δw + 2 w (c − c̄) Δc
    ∂φ_B/∂c̄ = 1/2 − κ − c̄ (c − c̄)/v        ∂φ_B/∂v = −κ (c − c̄)/v

`shape_rows` has the same for directions that turn.
"""

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_maker
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.contract.interface import Interface
from contactverif.geometry.block_rows import Couplings, Fields, NumberArray, find_entry, zero_matrix
from contactverif.geometry.projection import Vector
from contactverif_mortar.cell_frame import (
    N_NUMBERS,
    CellFrame,
    CellPoint,
    add_cell,
    add_to_row,
    cell_arguments,
    cell_at,
    finish_rows,
    place_point,
    push_point,
    turn_row,
)
from contactverif_mortar.cell_geometry import A, B
from contactverif_mortar.integration_cells import Cells, Quadrature
from contactverif_mortar.node_factors import NodeRows, RowGroups

# What is known of the shapes on a slave segment: a place c_0 on it, c̄ − c_0, κ, v and ∫1.
ORIGIN, MEAN, KAPPA, VARIANCE, EXTENT, N_SHAPE = range(6)


Weights = tuple[FloatArray, FloatArray, FloatArray]  # ∫φ_j and ∫φ_j g (n_slave_nodes,), and the numbers of the shapes.


class NodeState(NamedTuple):
    """The slave nodes of a method at one state."""

    pressure: FloatArray  # (n_slave_nodes,) The pressures p_j, zero where a node is not active.
    weights: FloatArray  # (n_slave_nodes,) Δp_j for each unit of row j of `Factors.right`.
    gaps: FloatArray  # (n_slave_nodes,) G_j and ∫φ_j, if that row is ΔG_j. Zero and one, if it is Δ∫φ_j g.
    divisor: FloatArray


def weigh(interface: Interface, cells: Cells, rule: Quadrature, x: FloatArray, dual: bool) -> Weights:
    """Compute the integrals of the shapes on some cells, at the positions x (n_nodes, 2).

    The numbers of the shapes (n_slave_segments, 5) are undefined where a segment has no cell.
    """
    areas, with_gap = np.zeros((2, interface.n_slave_nodes))
    shapes = np.empty((len(interface.slave), N_SHAPE))
    _weigh((areas, with_gap, shapes), x, *cell_arguments(interface, cells, rule), dual)
    return areas, with_gap, shapes


@compile_maker
def _weigh(written: Weights, x: FloatArray, segments_and_cells: Fields, rule: Fields, dual: bool) -> None:
    """Add ∫φ_j and ∫φ_j g of all slave segments, and write what is known of their shapes."""
    areas, with_gap, shapes = written
    slave, cell_slave = segments_and_cells[1], segments_and_cells[3]
    places, weights = rule
    points = np.empty((16, 3))  # c, gap and weight of the points of a segment
    begin = 0
    while begin < len(cell_slave):
        s, end = cell_slave[begin], begin
        while end < len(cell_slave) and cell_slave[end] == s:
            end += 1
        if (end - begin) * len(places) > len(points):
            points = np.empty((2 * (end - begin) * len(places), 3))
        count = 0
        for i in range(begin, end):
            cell = cell_at(x, segments_and_cells, i)
            for q in range(len(places)):
                point = place_point(cell, places[q], weights[q])
                points[count, 0], points[count, 1], points[count, 2] = point.c, point.gap, point.weight
                count += 1
        _write_shape(shapes, s, points, count, dual)
        for i in range(count):
            first, second = _shapes_at(shapes, s, points[i, 0])
            a, b, gap, w = slave[s, A], slave[s, B], points[i, 1], points[i, 2]
            areas[a] += w * first
            areas[b] += w * second
            with_gap[a] += w * first * gap
            with_gap[b] += w * second * gap
        begin = end


@compile_inline
def _write_shape(shapes: FloatArray, s: int, points: FloatArray, count: int, dual: bool) -> None:
    """Write the numbers of the shapes on segment s, from c and weights of its points.

    c̄ is measured from a point that is covered. So c − c̄ is as exact as c, however short the covered part is.
    """
    shapes[s, ORIGIN], shapes[s, MEAN], shapes[s, KAPPA] = 0.0, 0.0, 0.5
    shapes[s, VARIANCE], shapes[s, EXTENT] = 0.0, 0.0
    if not dual:
        return
    origin, extent, moment, second_moment = points[0, 0], 0.0, 0.0, 0.0
    for i in range(count):
        extent += points[i, 2]
        moment += points[i, 2] * (points[i, 0] - origin)
    mean = moment / extent
    for i in range(count):
        centred = (points[i, 0] - origin) - mean
        second_moment += points[i, 2] * centred * centred
    variance, c_mean = second_moment / extent, origin + mean
    shapes[s, ORIGIN], shapes[s, MEAN], shapes[s, KAPPA] = origin, mean, (1 - c_mean) * (1 + c_mean) / (2 * variance)
    shapes[s, VARIANCE], shapes[s, EXTENT] = variance, extent


@compile_inline
def _shapes_at(shapes: FloatArray, s: int, c: float) -> tuple[float, float]:
    mean = shapes[s, ORIGIN] + shapes[s, MEAN]
    bent = shapes[s, KAPPA] * ((c - shapes[s, ORIGIN]) - shapes[s, MEAN])
    return (1 - mean) / 2 - bent, (1 + mean) / 2 + bent


def node_rows(
    interface: Interface,
    cells: Cells,
    rule: Quadrature,
    x: FloatArray,
    shapes: FloatArray,
    state: NodeState,
    groups: RowGroups,
    pattern: Couplings,
) -> NodeRows:
    """Compute forces and factors on cells with no averaged normals, with `shapes` of `weigh` at the same state."""
    matrix = zero_matrix(interface.n_nodes, 0, pattern)
    forces, left, right = np.zeros(interface.n_unknowns), *np.zeros((2, 2 * len(groups.nodes)))
    written = forces, (matrix.indptr, matrix.indices, matrix.data), (groups.nodes, groups.starts, left, right)
    at_nodes = state.pressure, state.gaps, state.divisor
    _add_rows(written, x, *cell_arguments(interface, cells, rule), shapes, at_nodes)
    return NodeRows(forces, matrix, groups, left, right, state.weights)


@compile_maker
def _add_rows(
    written: Fields, x: FloatArray, segments_and_cells: Fields, rule: Fields, shapes: FloatArray, at_nodes: Fields
) -> None:
    """Add what all cells give to the forces, to compressed rows, and to the rows of the factors."""
    forces, csr, factors = written
    slave, cell_slave = segments_and_cells[1], segments_and_cells[3]
    places, weights = rule
    pressure, gaps, divisor = at_nodes
    nodes, starts, left, right = factors
    n_nodes, n_segments = len(pressure), len(slave)
    dual = len(starts) - 1 > n_nodes
    n_rows = 4 if dual else 2
    rows, pushes, units = np.empty((4 + n_rows, N_NUMBERS)), np.empty(4), np.empty((n_rows, 4))
    chain = np.zeros((n_segments if dual else 0, 2, 2))  # ∂∫φ_j (g − G_j) of both ends of a segment by c̄ and by v
    for i in range(len(cell_slave)):
        s, cell = cell_slave[i], cell_at(x, segments_and_cells, i)
        a, b = cell.nodes[A], cell.nodes[B]
        rows[:], pushes[:], units[:] = 0.0, 0.0, 0.0
        for q in range(len(places)):
            point = place_point(cell, places[q], weights[q])
            first, second = _shapes_at(shapes, s, point.c)
            kappa, difference = shapes[s, KAPPA], pressure[b] - pressure[a]
            p = pressure[a] * first + pressure[b] * second
            push_point(rows, pushes, cell, point, p, difference * kappa, 0.0)
            for end, (shape, slope, j) in enumerate(((first, -kappa, a), (second, kappa, b))):
                above, w = point.gap - gaps[j], point.weight
                add_to_row(rows, 4 + end, cell, point, (above * shape, above * w * slope, 0.0, w * shape))
                _add_unit(units, end, point, shape)
            if dual:
                _add_moments((rows, units, chain), cell, point, shapes, s, difference, (gaps[a], gaps[b]))
        finish_rows(rows, 4 + n_rows, cell)
        add_cell(forces, csr, rows, pushes, cell)
        shares = (1 / divisor[a], 1 / divisor[b], 1.0, 1.0)  # Those of the rows of `right`
        numbers = (a, b, n_nodes + s, n_nodes + n_segments + s)
        for row in range(n_rows):
            j, share = numbers[row], shares[row]
            if starts[j + 1] == starts[j]:
                continue
            for k in range(4):
                place = 2 * find_entry(nodes, starts[j], starts[j + 1], cell.nodes[k])
                d_x, d_y = turn_row(rows, 4 + row, k, cell)
                left[place] += units[row, k] * cell.n[0]
                left[place + 1] += units[row, k] * cell.n[1]
                right[place] += share * d_x
                right[place + 1] += share * d_y
    if dual:
        add_chains(slave, chain, divisor, nodes, starts, right)


@compile_inline
def _add_unit(units: FloatArray, row: int, point: CellPoint, pressure: float) -> None:
    f = point.weight * pressure
    for k, shape in enumerate(((1 - point.c) / 2, (1 + point.c) / 2, point.xi - 1, -point.xi)):
        units[row, k] += shape * f


@compile_inline
def _add_moments(
    sums: Fields, cell: CellFrame, point: CellPoint, shapes: FloatArray, s: int, difference: float, gaps: Vector
) -> None:
    """Add what a point gives to the rows of c̄ and v of its segment; `difference` is p_B − p_A, `gaps` are G_A, G_B."""
    rows, units, chain = sums
    kappa, variance, extent = shapes[s, KAPPA], shapes[s, VARIANCE], shapes[s, EXTENT]
    centred = (point.c - shapes[s, ORIGIN]) - shapes[s, MEAN]
    by_mean = 0.5 - kappa - (shapes[s, ORIGIN] + shapes[s, MEAN]) / variance * centred
    by_variance, w = -kappa / variance * centred, point.weight
    add_to_row(rows, 6, cell, point, (centred / extent, w / extent, 0.0, 0.0))
    add_to_row(rows, 7, cell, point, ((centred * centred - variance) / extent, 2 * w * centred / extent, 0.0, 0.0))
    _add_unit(units, 2, point, difference * by_mean)
    _add_unit(units, 3, point, difference * by_variance)
    for end, sign in enumerate((-1.0, 1.0)):
        chain[s, end, 0] += sign * (point.gap - gaps[end]) * w * by_mean
        chain[s, end, 1] += sign * (point.gap - gaps[end]) * w * by_variance


@compile_maker
def add_chains(
    slave: IntArray, chain: FloatArray, divisor: FloatArray, nodes: NumberArray, starts: IntArray, right: FloatArray
) -> None:
    """Add to the row of each active node what it gains from c̄ and v of its segments.

    `chain` (n_segments, 2 ends, 2) are the factors. The group of a node holds those of its segments, and all ascend.
    """
    n_nodes = len(divisor)
    for s in range(len(slave)):
        for end in range(2):
            j = slave[s, end]
            if starts[j + 1] == starts[j]:
                continue
            for moment in range(2):
                row, factor, place = n_nodes + moment * len(slave) + s, chain[s, end, moment] / divisor[j], starts[j]
                for member in range(starts[row], starts[row + 1]):
                    while nodes[place] != nodes[member]:
                        place += 1
                    right[2 * place] += factor * right[2 * member]
                    right[2 * place + 1] += factor * right[2 * member + 1]
