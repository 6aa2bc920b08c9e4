"""Turn pressures at the points of cells into nodal forces, and compute the tangent of that.

With F = w p, w the weight (a length) of a point, p its pressure and n out of the slave:

    R_A = (1−c)/2 F n    R_B = (1+c)/2 F n    R_1 = −(1−ξ) F n    R_2 = −ξ F n

What must stay true: forces and moments balance point by point, whatever the pressures are. They do because x_m − x_s
is along n. `gathered` and `summed` add up numbers of points that belong to the same node or segment.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import Array, FloatArray, IntArray
from contactverif.geometry.compiled import compile_kernel
from contactverif_mortar.cell_geometry import D_C, D_WEIGHT, D_XI, OMEGA
from contactverif_mortar.integration_cells import NORMAL_X, NORMAL_Y, WEIGHT, XI, C


@compile_kernel
def forces(points: Array, pressure: Array, nodes: IntArray, n_nodes: int) -> Array:
    """Compute nodal forces from pressures at points.

    Parameters
    ----------
    points : Array, shape (n_states, n_points, 6)
        The points of `Quadrature.points`; the points of a cell follow each other.
    pressure : Array, shape (n_states, n_points)
        Pressures, force per length, positive where the surfaces press.
    nodes : IntArray, shape (n_cells, n_local)
        Node numbers of each cell; A, B, 1, 2 come first.
    n_nodes : int
        Number of nodes of the interface.

    Returns
    -------
    Array, shape (n_states, n_nodes, 2)
        Internal forces.
    """
    totals = np.zeros((points.shape[0], n_nodes, 2), dtype=points.dtype)
    n_q = points.shape[1] // max(len(nodes), 1)
    for state in range(points.shape[0]):
        for number in range(points.shape[1]):
            if pressure[state, number] == 0:
                continue
            point, local = points[state, number], nodes[number // n_q]
            f = point[WEIGHT] * pressure[state, number]
            c, xi = point[C], point[XI]
            for k, shape in enumerate(((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)):
                totals[state, local[k], 0] += shape * f * point[NORMAL_X]
                totals[state, local[k], 1] += shape * f * point[NORMAL_Y]
    return totals


@compile_kernel
def _blocks(
    points: FloatArray, gains: FloatArray, pressure: FloatArray, d_pressure: FloatArray, n_q: int
) -> FloatArray:
    """Compute Δ of the forces of each cell, (n_cells, 4 nodes, 2, n_local, 2)."""
    n_local = gains.shape[2]
    blocks = np.zeros((len(points) // n_q, 4, 2, n_local, 2))
    for number in range(len(points)):
        block, point, gain = blocks[number // n_q], points[number], gains[number]
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
    return blocks


def tangent(
    points: FloatArray, gains: FloatArray, pressure: FloatArray, d_pressure: FloatArray, nodes: IntArray, size: int
) -> sparse.coo_array:
    """Compute the derivative of `forces` at one state.

    Parameters
    ----------
    points : FloatArray, shape (n_points, 6)
        The points of `Quadrature.points` at that state.
    gains : FloatArray, shape (n_points, 5, n_local, 2)
        Their Δ, from `Quadrature.gains`.
    pressure : FloatArray, shape (n_points,)
        Pressures.
    d_pressure : FloatArray, shape (n_points, n_local, 2)
        The part of Δ of a pressure that depends on the local nodes of its own cell.
    nodes : IntArray, shape (n_cells, n_local)
        Node numbers of each cell.
    size : int
        Number of rows and columns of the result.

    Returns
    -------
    sparse.coo_array, shape (size, size)
        The derivative.
    """
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
    """Compute the forces that a unit of each source puts on the nodes.

    A source is a number that pressures depend on linearly, such as the pressure at a slave node.

    Parameters
    ----------
    points : FloatArray, shape (n_points, 6)
        The points of `Quadrature.points` at one state.
    shares : FloatArray, shape (n_points, n_sources_of_cell)
        The pressure at a point for a unit of each source of its cell.
    places : IntArray, shape (n_cells, n_sources_of_cell)
        The columns of the sources of each cell.
    nodes : IntArray, shape (n_cells, n_local)
        Node numbers of each cell.
    shape : tuple[int, int]
        Shape (n_unknowns, n_sources) of the result.

    Returns
    -------
    sparse.coo_array, shape (n_unknowns, n_sources)
        Internal forces.
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


def gather_rows(rows: FloatArray, places: IntArray, nodes: IntArray, shape: tuple[int, int]) -> sparse.coo_array:
    """Add up Δ of numbers of points that belong to the same place, such as a node.

    Parameters
    ----------
    rows : FloatArray, shape (n_points, n_places_of_cell, n_local, 2)
        Δ of the numbers.
    places : IntArray, shape (n_cells, n_places_of_cell)
        The rows of the result to which the numbers of each cell belong.
    nodes : IntArray, shape (n_cells, n_local)
        Node numbers of each cell.
    shape : tuple[int, int]
        Shape (n_places, n_unknowns) of the result.

    Returns
    -------
    sparse.coo_array, shape (n_places, n_unknowns)
        The sums.
    """
    values = rows.reshape(len(nodes), len(rows) // max(len(nodes), 1), *rows.shape[1:]).sum(axis=1)
    unknown = 2 * nodes[:, None, :, None] + np.arange(2)
    columns = np.broadcast_to(unknown, values.shape)
    lines = np.broadcast_to(places[:, :, None, None], values.shape)
    return sparse.coo_array((values.ravel(), (lines.ravel(), columns.ravel())), shape=shape)


@compile_kernel
def sum_by_place(values: Array, places: IntArray, n_places: int) -> Array:
    """Return sums (n_states, n_places) of the values (n_states, n) that belong to the same of the places (n,)."""
    sums = np.zeros((values.shape[0], n_places), dtype=values.dtype)
    for state in range(values.shape[0]):
        for number in range(len(places)):
            sums[state, places[number]] += values[state, number]
    return sums
