"""Forces on cells and their tangent, written straight into compressed rows, for slaves that look along their normal.

With F = w p and the rows (1−c)/2, (1+c)/2, ξ−1, −ξ of the nodes A, B, 1, 2 (`cell_forces`) as N_k:

    R_k = Σ N_k F n        ΔR_k = Σ (N_k ΔF + F ΔN_k) n − N_k F ω τ        ΔF = p Δw + w (p_c Δc + p_g Δg)

So ΔR_k·n is a row of `cell_frame`. A method is p, p_c and p_g at each point. `cell_forces` has the same for directions
that turn.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_inline, compile_maker
from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.interface import Interface
from contactverif.geometry.block_rows import Couplings, NumberArray, add_block, zero_matrix
from contactverif_mortar.cell_frame import (
    N_NUMBERS,
    CellFrame,
    CellPoint,
    add_to_row,
    cell_arguments,
    cell_at,
    finish_rows,
    place_point,
    turn_row,
)
from contactverif_mortar.integration_cells import Cells, Csr, Fields, Quadrature

ForcesAndTangent = tuple[FloatArray, sparse.csr_array]  # (n_unknowns,) and (n_unknowns, n_unknowns)


def touching_points(interface: Interface, cells: Cells, rule: Quadrature, x: FloatArray) -> BoolArray:
    """Return the points (n_points,) of cells whose gap is zero or negative, at the positions x (n_nodes, 2)."""
    touching = np.empty(len(cells.slave) * len(rule), dtype=np.bool_)
    _write_touching(x, *cell_arguments(interface, cells, rule), touching)
    return touching


@compile_maker
def _write_touching(x: FloatArray, segments_and_cells: Fields, rule: Fields, touching: BoolArray) -> None:
    """Write whether each point touches."""
    places, weights = rule
    n_q = len(places)
    for i in range(len(touching) // n_q):
        cell = cell_at(x, segments_and_cells, i)
        for q in range(n_q):
            touching[i * n_q + q] = place_point(cell, places[q], weights[q]).gap <= 0


def springs_at_points(
    interface: Interface, cells: Cells, rule: Quadrature, x: FloatArray, penalty: float, active: BoolArray
) -> ForcesAndTangent:
    """Compute forces (n_unknowns,) and tangent of springs p = −ε̂ g at the `active` points (n_points,).

    The cells have no averaged normals. The pattern of the tangent holds the nodes of all cells that have a spring.
    """
    segments_and_cells, places_and_weights = cell_arguments(interface, cells, rule)
    nodes = _nodes_of_cells(interface.slave.segments, interface.master.segments, cells.slave, cells.master, active)
    starts = np.arange(0, len(nodes) + 1, 4)
    matrix = zero_matrix(interface.n_nodes, 0, Couplings(nodes, starts, starts[:-1]))
    forces: FloatArray = np.zeros(interface.n_unknowns)
    csr = matrix.indptr, matrix.indices, matrix.data
    _add_springs(forces, csr, x, segments_and_cells, places_and_weights, penalty, active)
    return forces, matrix


@compile_maker
def _nodes_of_cells(
    slave: IntArray, master: IntArray, cell_slave: IntArray, cell_master: IntArray, active: BoolArray
) -> NumberArray:
    """Return the nodes A, B, 1, 2 of each cell that has an active point, one cell after the other."""
    nodes, count = np.empty(4 * len(cell_slave), dtype=np.int32), 0
    n_q = len(active) // max(len(cell_slave), 1)
    for cell in range(len(cell_slave)):
        if not _any_active(active, cell * n_q, n_q):
            continue
        s, m = cell_slave[cell], cell_master[cell]
        nodes[count], nodes[count + 1] = slave[s, 0], slave[s, 1]
        nodes[count + 2], nodes[count + 3] = master[m, 0], master[m, 1]
        count += 4
    return nodes[:count]


@compile_inline
def _any_active(active: BoolArray, begin: int, count: int) -> bool:
    """Return whether one of some points that follow each other is active."""
    for i in range(begin, begin + count):  # noqa: SIM110 - a compiled kernel knows no generators
        if active[i]:
            return True
    return False


@compile_maker
def _add_springs(
    forces: FloatArray,
    csr: Csr,
    x: FloatArray,
    segments_and_cells: Fields,
    rule: Fields,
    penalty: float,
    active: BoolArray,
) -> None:
    """Add the forces of the springs on all cells, and their derivative to compressed rows."""
    places, weights = rule
    n_q = len(places)
    rows, pushes = np.empty((4, N_NUMBERS)), np.empty(4)
    for i in range(len(active) // n_q):
        if not _any_active(active, i * n_q, n_q):
            continue
        cell = cell_at(x, segments_and_cells, i)
        rows[:], pushes[:] = 0.0, 0.0
        for q in range(n_q):
            if active[i * n_q + q]:
                point = place_point(cell, places[q], weights[q])
                push_point(rows, pushes, cell, point, -penalty * point.gap, 0.0, -penalty)
        finish_rows(rows, 4, cell)
        add_cell(forces, csr, rows, pushes, cell)


@compile_inline
def push_point(
    rows: FloatArray, pushes: FloatArray, cell: CellFrame, point: CellPoint, p: float, p_c: float, p_g: float
) -> None:
    """Add N_k ΔF + F ΔN_k of a point to the first four `rows`, and N_k F to `pushes` (4,)."""
    c, xi, w = point.c, point.xi, point.weight
    f = w * p
    for k, (shape, by_c, by_xi) in enumerate(
        (((1 - c) / 2, -0.5, 0.0), ((1 + c) / 2, 0.5, 0.0), (xi - 1, 0.0, 1.0), (-xi, 0.0, -1.0))
    ):
        pushes[k] += shape * f
        add_to_row(rows, k, cell, point, shape * p, shape * w * p_c + f * by_c, f * by_xi, shape * w * p_g)


@compile_inline
def add_cell(forces: FloatArray, csr: Csr, rows: FloatArray, pushes: FloatArray, cell: CellFrame) -> None:
    """Add `pushes` n to forces, and n ⊗ `rows` − `pushes` τ ⊗ ω to compressed rows, in the global frame."""
    local, tau, n = cell.nodes, cell.tau, cell.n
    for k in range(4):
        forces[2 * local[k]] += pushes[k] * n[0]
        forces[2 * local[k] + 1] += pushes[k] * n[1]
        turn = pushes[k] / cell.length
        for column, omega in enumerate((-turn, turn, 0.0, 0.0)):
            x, y = turn_row(rows, k, column, cell)
            xx, xy = n[0] * x - omega * tau[0] * n[0], n[0] * y - omega * tau[0] * n[1]
            yx, yy = n[1] * x - omega * tau[1] * n[0], n[1] * y - omega * tau[1] * n[1]
            add_block(csr, local[k], local[column], xx, xy, yx, yy)
