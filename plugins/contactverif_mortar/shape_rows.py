"""The forces of a mortar method and the rows of its tangent's factors, for directions that turn and for half passes.

The formulas are those of `node_rows`; the Δ of the points come from `cell_geometry`, in the global frame and for up to
six local nodes. With F = w p and ω the turn of the normal, the rows N_k of the local nodes that are pushed have

    R_k = Σ N_k F n        ΔR_k = Σ (N_k ΔF + F ΔN_k) n − N_k F ω τ        ΔF = p Δw + w p_c Δc

Rule for the next editor: Δ of points are large, so they are made for `PIECE` points at a time, and dropped.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_inline, compile_maker
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.geometry.block_rows import NumberArray, add_block
from contactverif_mortar.cell_forces import Shapes
from contactverif_mortar.cell_geometry import D_C, D_GAP, D_WEIGHT, D_XI, OMEGA
from contactverif_mortar.integration_cells import GAP, NORMAL_X, NORMAL_Y, WEIGHT, XI, C, Csr, Fields
from contactverif_mortar.node_factors import NodeRows
from contactverif_mortar.node_groups import RowGroups, find_member
from contactverif_mortar.node_rows import NodeState, add_chains

PIECE = 4096  # Points.
MakeGains = Callable[[int, int], FloatArray]  # From the first and the last of some cells: their Δ.


class ShapedPoints(NamedTuple):
    """The points of some cells at one state, and the slave nodes' shapes there."""

    points: FloatArray  # (n_points, 6) The numbers of each point, as `Quadrature.points` gives them.
    shapes: Shapes  # The shapes, of one state.
    segment: IntArray  # (n_points,) The slave segment of each point.
    slave: IntArray  # (n_slave_segments, 2) The slave nodes of each segment.
    make_gains: MakeGains  # The Δ of the points of some cells, (n, 5, n_local, 2).


def add_shaped_rows(
    shaped: ShapedPoints, groups: RowGroups, state: NodeState, n_pushed: int, forces: FloatArray, rest: sparse.csr_array
) -> NodeRows:
    """Add forces and their derivative at fixed pressures to `forces` and `rest`, and return them with the factors.

    Forces act on the first `n_pushed` local nodes: 4, or 2 where they act on the slave alone. `rest` has the places
    of all pushed nodes and local nodes of each cell.
    """
    shapes, n_cells = shaped.shapes, len(groups.local)
    left, right = np.zeros((2, 2 * len(groups.nodes)))
    dual = len(groups.starts) - 1 > len(state.pressure)
    chain = np.zeros((len(shaped.slave) if dual else 0, 2, 2))
    n_q = len(shaped.points) // max(n_cells, 1)
    places, at_points = (shaped.points, shaped.segment, shaped.slave, groups.local), shapes.fields_of_first_state()
    at_nodes, factors = (state.pressure, state.gaps, state.divisor), (groups.nodes, groups.starts, left, right)
    csr = rest.indptr, rest.indices, rest.data
    size = max(PIECE // max(n_q, 1), 1)
    for begin in range(0, n_cells, size):
        end = min(begin + size, n_cells)
        gains = shaped.make_gains(begin, end)
        _add_points(forces, csr, factors, chain, begin * n_q, n_q, n_pushed, places, at_points, gains, at_nodes)
    if dual:
        add_chains(shaped.slave, chain, state.divisor, groups.nodes, groups.starts, right)
    return NodeRows(forces, rest, groups, left, right)


@compile_maker
def _add_points(
    forces: FloatArray,
    csr: Csr,
    factors: Fields,
    chain: FloatArray,
    first_point: int,
    n_q: int,
    n_pushed: int,
    places: Fields,
    shapes: Fields,
    gains: FloatArray,
    at_nodes: Fields,
) -> None:
    """Add what the points from `first_point` on give, one for each of their Δ."""
    points, segment, slave, local = places
    values, slope, by_mean, by_variance, centred, extent, variance = shapes
    pressure, gaps, divisor = at_nodes
    starts = factors[1]
    n_local = local.shape[1]
    block = np.zeros((4, 2, n_local, 2))
    row = np.empty((n_local, 2))
    for i in range(len(gains)):
        number = first_point + i
        point, d, cell, s = points[number], gains[i], local[number // n_q], segment[number]
        a, b, w = slave[s, 0], slave[s, 1], point[WEIGHT]
        difference = pressure[b] - pressure[a]
        p = pressure[a] * values[number, 0] + pressure[b] * values[number, 1]
        _add_block_of_point(block, n_pushed, point, d, p, difference * slope[number])
        transmit = ((1 - point[C]) / 2, (1 + point[C]) / 2, point[XI] - 1, -point[XI])
        for k in range(n_pushed):
            forces[2 * cell[k]] += transmit[k] * w * p * point[NORMAL_X]
            forces[2 * cell[k] + 1] += transmit[k] * w * p * point[NORMAL_Y]
        for end, sign in enumerate((-1.0, 1.0)):
            j = slave[s, end]
            shape, above = values[number, end], point[GAP] - gaps[j]
            if starts[j + 1] > starts[j]:
                for k in range(n_local):
                    for axis in range(2):
                        d_weighted = shape * d[D_WEIGHT, k, axis] + w * sign * slope[number] * d[D_C, k, axis]
                        row[k, axis] = (w * shape * d[D_GAP, k, axis] + above * d_weighted) / divisor[j]
                _add_row(factors, j, cell, row, n_pushed, point, shape)
            if len(chain):
                chain[s, end, 0] += sign * above * w * by_mean[number]
                chain[s, end, 1] += sign * above * w * by_variance[number]
        if len(chain):
            numbers = (len(pressure) + s, len(pressure) + len(slave) + s)
            by_moment = (difference * by_mean[number], difference * by_variance[number])
            spread = (centred[number], extent[number], variance[number])
            _add_moments(factors, numbers, by_moment, spread, d, row, cell, n_pushed, point)
        if (number + 1) % n_q == 0:
            _write_block(csr, block, n_pushed, cell)


@compile_inline
def _add_block_of_point(
    block: FloatArray, n_pushed: int, point: FloatArray, d: FloatArray, p: float, p_c: float
) -> None:
    """Add ΔR_k of a point to a block (4 nodes, 2, n_local, 2)."""
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
def _write_block(csr: Csr, block: FloatArray, n_pushed: int, cell: NumberArray) -> None:
    """Add a block to compressed rows, and clear it."""
    for k in range(n_pushed):
        for column in range(len(cell)):
            xx, xy = block[k, 0, column, 0], block[k, 0, column, 1]
            yx, yy = block[k, 1, column, 0], block[k, 1, column, 1]
            add_block(csr, cell[k], cell[column], xx, xy, yx, yy)
    block[:] = 0.0


@compile_inline
def _add_moments(
    factors: Fields,
    numbers: tuple[int, int],
    by_moment: tuple[float, float],
    spread: tuple[float, float, float],
    d: FloatArray,
    row: FloatArray,
    cell: NumberArray,
    n_pushed: int,
    point: FloatArray,
) -> None:
    """Add what a point gives to the rows of c̄ and v; `spread` is c − c̄, ∫1 and v, `by_moment` the pressure by each."""
    off, extent, variance = spread
    for moment, (by_weight, by_c) in enumerate(((off, 1.0), (off * off - variance, 2 * off))):
        for k in range(len(cell)):
            for axis in range(2):
                change = by_weight * d[D_WEIGHT, k, axis] + point[WEIGHT] * by_c * d[D_C, k, axis]
                row[k, axis] = change / extent
        _add_row(factors, numbers[moment], cell, row, n_pushed, point, by_moment[moment])


@compile_inline
def _add_row(
    factors: Fields, j: int, cell: NumberArray, row: FloatArray, n_pushed: int, point: FloatArray, pressure: float
) -> None:
    """Add Δ (n_local, 2) to row j of `right`, and the forces of a pressure at the point to that of `left`."""
    nodes, starts, left, right = factors
    f = point[WEIGHT] * pressure
    transmit = ((1 - point[C]) / 2, (1 + point[C]) / 2, point[XI] - 1, -point[XI])
    for k in range(len(cell)):
        place = 2 * find_member(nodes, starts[j], starts[j + 1], cell[k])
        right[place] += row[k, 0]
        right[place + 1] += row[k, 1]
        if k < n_pushed:
            left[place] += f * transmit[k] * point[NORMAL_X]
            left[place + 1] += f * transmit[k] * point[NORMAL_Y]
