"""From pressures at the points of cells to nodal forces, and the tangent of that.

With F = w p, w a point's length, p its pressure and n out of the slave:

    R_A = (1−c)/2 F n    R_B = (1+c)/2 F n    R_1 = −(1−ξ) F n    R_2 = −ξ F n

x_m − x_s is along n, so forces and moments balance point by point, whatever the pressures are.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.geometry.compiled import compiled
from contactverif_mortar.cells import NORMAL_X, NORMAL_Y, WEIGHT, XI, C
from contactverif_mortar.geometry import D_C, D_WEIGHT, D_XI, OMEGA


@compiled
def forces(points: Array, pressure: Array, nodes: IntArray, n_nodes: int) -> Array:
    """Nodal forces (n_states, n_nodes, 2) of points (n_states, n_points, 6) under pressures (n_states, n_points).

    nodes (n_cells, ≥ 4) are A, B, 1, 2 of the cell that a point is in.
    """
    found = np.zeros((points.shape[0], n_nodes, 2), dtype=points.dtype)
    n_q = points.shape[1] // max(len(nodes), 1)
    for state in range(points.shape[0]):
        for number in range(points.shape[1]):
            if pressure[state, number] == 0:
                continue
            point, local = points[state, number], nodes[number // n_q]
            f = point[WEIGHT] * pressure[state, number]
            c, xi = point[C], point[XI]
            for k, shape in enumerate(((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)):
                found[state, local[k], 0] += shape * f * point[NORMAL_X]
                found[state, local[k], 1] += shape * f * point[NORMAL_Y]
    return found


@compiled
def _blocks(
    points: FloatArray, gains: FloatArray, pressure: FloatArray, d_pressure: FloatArray, n_q: int
) -> FloatArray:
    """Δ of the forces of each cell, (n_cells, 4 nodes, 2, n_local, 2)."""
    n_local = gains.shape[2]
    found = np.zeros((len(points) // n_q, 4, 2, n_local, 2))
    for number in range(len(points)):
        block, point, gain = found[number // n_q], points[number], gains[number]
        c, xi, w, p = point[C], point[XI], point[WEIGHT], pressure[number]
        n = (point[NORMAL_X], point[NORMAL_Y])
        tau = (-n[1], n[0])
        f = w * p
        shape = ((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)
        for column in range(n_local):
            for j in range(2):
                d_f = gain[D_WEIGHT, column, j] * p + w * d_pressure[number, column, j]
                omega = f * gain[OMEGA, column, j]
                d_c, d_xi = f * gain[D_C, column, j] / 2, f * gain[D_XI, column, j]
                d_shape = (-d_c, d_c, d_xi, -d_xi)
                for k in range(4):
                    along_n = shape[k] * d_f + d_shape[k]
                    along_tau = -shape[k] * omega  # Δn = −τ ω
                    for i in range(2):
                        block[k, i, column, j] += along_n * n[i] + along_tau * tau[i]
    return found


def tangent(
    points: FloatArray, gains: FloatArray, pressure: FloatArray, d_pressure: FloatArray, nodes: IntArray, size: int
) -> sparse.coo_array:
    """Derivative (size, size) of the forces, each point's pressure having its own row `d_pressure` (n_points, …)."""
    n_q = len(points) // max(len(nodes), 1)
    if not n_q:
        return sparse.coo_array((size, size))
    blocks = _blocks(points, gains, pressure, d_pressure, n_q)
    unknown = 2 * nodes[:, :, None] + np.arange(2)  # (n_cells, n_local, 2)
    rows = np.broadcast_to(unknown[:, :4, :, None, None], blocks.shape)
    columns = np.broadcast_to(unknown[:, None, None], blocks.shape)
    return sparse.coo_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))


def influence(
    points: FloatArray, shares: FloatArray, places: IntArray, nodes: IntArray, shape: tuple[int, int]
) -> sparse.coo_array:
    """What a unit of each source does to the nodes: forces (n_unknowns, n_sources).

    Sources are places (n_cells, n_of_a_cell), and a point has the pressure shares (n_points, n_of_a_cell) of them.
    """
    c, xi = points[:, C], points[:, XI]
    transmit = np.stack([(1 - c) / 2, (1 + c) / 2, xi - 1, -xi], axis=1) * points[:, WEIGHT, None]  # (n_points, 4)
    normal = points[:, NORMAL_X : NORMAL_Y + 1]
    by_cell = (len(nodes), len(points) // max(len(nodes), 1))
    values = np.einsum(
        "cqk,cqi,cqm->ckim",
        transmit.reshape(*by_cell, 4),
        normal.reshape(*by_cell, 2),
        shares.reshape(*by_cell, shares.shape[1]),
    )
    unknown = 2 * nodes[:, :4, None, None] + np.arange(2)[:, None]
    rows = np.broadcast_to(unknown, values.shape)
    columns = np.broadcast_to(places[:, None, None, :], values.shape)
    return sparse.coo_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape)


def gathered(rows: FloatArray, places: IntArray, nodes: IntArray, shape: tuple[int, int]) -> sparse.coo_array:
    """Rows of Δ (n_points, n_of_a_cell, n_local, 2), added up at places (n_cells, n_of_a_cell).

    Returns (n_places, n_unknowns).
    """
    values = rows.reshape(len(nodes), len(rows) // max(len(nodes), 1), *rows.shape[1:]).sum(axis=1)
    unknown = 2 * nodes[:, None, :, None] + np.arange(2)
    columns = np.broadcast_to(unknown, values.shape)
    lines = np.broadcast_to(places[:, :, None, None], values.shape)
    return sparse.coo_array((values.ravel(), (lines.ravel(), columns.ravel())), shape=shape)


@compiled
def summed(values: Array, places: IntArray, n_places: int) -> Array:
    """Sums (n_states, n_places) of values (n_states, n) that belong to places (n,)."""
    found = np.zeros((values.shape[0], n_places), dtype=values.dtype)
    for state in range(values.shape[0]):
        for number in range(len(places)):
            found[state, places[number]] += values[state, number]
    return found
