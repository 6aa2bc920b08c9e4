"""The tangent of forces on cells, written straight into compressed rows, for slaves that look along their own normal.

With F = w p and the rows (1−c)/2, (1+c)/2, ξ−1, −ξ of the nodes A, B, 1, 2 (`cell_forces`) as N_k:

    ΔR_k = (N_k ΔF + F ΔN_k) n − N_k F ω τ        ΔF = p Δw + w Δp        Δp = p_c Δc + p_g Δg

A method is p, p_c and p_g at each point. `cell_forces.tangent` has the same for directions that turn.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import FloatArray
from contactverif.contract.interface import Interface
from contactverif.geometry.block_rows import AnyIntArray, Couplings, add_block, zero_matrix
from contactverif.geometry.compiled import compile_kernel
from contactverif.geometry.projection import node
from contactverif_mortar import cell_frame
from contactverif_mortar.cell_frame import TAU, CellFrame, N, begin_cell, write_gains
from contactverif_mortar.cell_geometry import A, B, slave_view
from contactverif_mortar.integration_cells import GAP, WEIGHT, XI, C, Cells, Fields, Quadrature

D_C, D_XI, D_GAP, D_WEIGHT = cell_frame.C, cell_frame.XI, cell_frame.GAP, cell_frame.WEIGHT


def couple_cells(interface: Interface, cells: Cells) -> Couplings:
    """Return the couplings of the four nodes of each cell."""
    nodes = np.hstack([interface.slave.segments[cells.slave], interface.master.segments[cells.master]])
    starts = np.arange(0, nodes.size + 1, 4)
    return Couplings(nodes.astype(np.int32).ravel(), starts, starts[:-1])


def cell_arguments(interface: Interface, cells: Cells, rule: Quadrature) -> tuple[Fields, Fields]:
    """Return the arrays of segments and cells and those of the rule, as the kernels here unpack them."""
    lengths = np.full(len(interface.slave), -1.0) if rule.current else interface.slave.lengths(interface.nodes)
    segments_and_cells = (
        lengths,
        interface.slave.segments,
        interface.master.segments,
        cells.slave,
        cells.master,
        cells.cut_low,
        cells.cut_high,
    )
    return segments_and_cells, (rule.places, rule.weights)


def tangent_of_cells(
    interface: Interface,
    cells: Cells,
    rule: Quadrature,
    x: FloatArray,
    points: FloatArray,
    pressures: tuple[FloatArray, FloatArray, FloatArray],
    couplings: Couplings | None = None,
) -> sparse.csr_array:
    """Compute the derivative of the forces on cells.

    Parameters
    ----------
    interface : Interface
        The interface.
    cells : Cells
        The cells, with no averaged normals.
    rule : Quadrature
        The rule of the points.
    x : FloatArray, shape (n_nodes, 2)
        Positions.
    points : FloatArray, shape (n_points, 6)
        The points of `Quadrature.points`.
    pressures : tuple[FloatArray, FloatArray, FloatArray], each of shape (n_points,)
        The pressure p, p_c and p_g.
    couplings : Couplings, optional
        The pattern of the result, if it is to have more entries than the nodes of each cell need.

    Returns
    -------
    sparse.csr_array, shape (n_unknowns, n_unknowns)
        The derivative.
    """
    matrix = zero_matrix(interface.n_nodes, 0, couplings or couple_cells(interface, cells))
    _add_cells(
        x,
        *cell_arguments(interface, cells, rule),
        points,
        *pressures,
        matrix.indptr,
        matrix.indices,
        matrix.data,
    )
    return matrix


@compile_kernel
def _add_cells(
    x: FloatArray,
    segments_and_cells: Fields,
    rule: Fields,
    points: FloatArray,
    pressure: FloatArray,
    by_c: FloatArray,
    by_gap: FloatArray,
    indptr: AnyIntArray,
    indices: AnyIntArray,
    data: FloatArray,
) -> None:
    """Add the derivative of the forces of all cells to compressed rows."""
    lengths, slave, master, cell_slave, cell_master, cut_low, cut_high = segments_and_cells
    places, weights = rule
    n_q = len(places)
    ends, d = np.empty((2, 4, 2)), np.empty((4, 4, 2))
    along_n, forces = np.empty((4, 4, 2)), np.empty(4)
    for cell in range(len(cell_slave)):
        s, m = cell_slave[cell], cell_master[cell]
        view = slave_view(x, slave, s, -1, -1)
        x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
        axes = begin_cell(ends, view, x_1, x_2, cut_low[cell], cut_high[cell], lengths[s])
        along_n[:], forces[:] = 0.0, 0.0
        for q in range(n_q):
            i = cell * n_q + q
            p, p_c, p_g = pressure[i], by_c[i], by_gap[i]
            if p == 0 and p_c == 0 and p_g == 0:
                continue
            write_gains(d, ends, axes, places[q], weights[q], points[i, C], points[i, XI], points[i, GAP])
            _add_point(along_n, forces, d, points[i, C], points[i, XI], points[i, WEIGHT], p, p_c, p_g)
        local = (slave[s, A], slave[s, B], master[m, 0], master[m, 1])
        _add_blocks(indptr, indices, data, local, along_n, forces, axes)


@compile_kernel
def _add_point(
    along_n: FloatArray,
    forces: FloatArray,
    d: FloatArray,
    c: float,
    xi: float,
    w: float,
    p: float,
    p_c: float,
    p_g: float,
) -> None:
    """Add N_k ΔF + F ΔN_k of a point to `along_n` (4, 4, 2), and N_k F to `forces` (4,)."""
    f = w * p
    n_a, n_b, n_1, n_2 = (1 - c) / 2, (1 + c) / 2, xi - 1, -xi
    for column in range(4):
        for i in range(2):
            d_c, d_xi = d[D_C, column, i], d[D_XI, column, i]
            d_f = p * d[D_WEIGHT, column, i] + w * (p_c * d_c + p_g * d[D_GAP, column, i])
            along_n[0, column, i] += n_a * d_f - f * d_c / 2
            along_n[1, column, i] += n_b * d_f + f * d_c / 2
            along_n[2, column, i] += n_1 * d_f + f * d_xi
            along_n[3, column, i] += n_2 * d_f - f * d_xi
    for k, shape in enumerate((n_a, n_b, n_1, n_2)):
        forces[k] += shape * f


@compile_kernel
def _add_blocks(
    indptr: AnyIntArray,
    indices: AnyIntArray,
    data: FloatArray,
    local: tuple[int, int, int, int],
    along_n: FloatArray,
    forces: FloatArray,
    axes: CellFrame,
) -> None:
    """Add n ⊗ `along_n` − `forces` τ ⊗ ω of a cell, turned into the global frame."""
    tau, n = axes.tau, axes.n
    turn = (-1 / axes.length, 1 / axes.length, 0.0, 0.0)
    for k in range(4):
        for column in range(4):
            along_tau = -forces[k] * turn[column]
            a, b = along_n[k, column, TAU], along_n[k, column, N]
            x, y = a * tau[0] + b * n[0], a * tau[1] + b * n[1]
            add_block(
                indptr,
                indices,
                data,
                local[k],
                local[column],
                n[0] * x + tau[0] * along_tau * n[0],
                n[0] * y + tau[0] * along_tau * n[1],
                n[1] * x + tau[1] * along_tau * n[0],
                n[1] * y + tau[1] * along_tau * n[1],
            )
