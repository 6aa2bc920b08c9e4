"""Turn pressures at the points of cells into nodal forces, for many states, real or complex.

With F = w p, w the weight (a length) of a point, p its pressure and n out of the slave:

    R_A = (1−c)/2 F n    R_B = (1+c)/2 F n    R_1 = −(1−ξ) F n    R_2 = −ξ F n

Forces and moments balance point by point, whatever the pressures are, because x_m − x_s is along n.
"""

from __future__ import annotations

import numpy as np

from contactverif.contract.arrays import Array, IntArray
from contactverif.geometry.block_rows import NumberArray
from contactverif.geometry.compiled import compile_kernel
from contactverif_mortar.integration_cells import NORMAL_X, NORMAL_Y, WEIGHT, XI, C


@compile_kernel
def forces(points: Array, pressure: Array, nodes: NumberArray, n_nodes: int) -> Array:
    """Compute forces (n_states, n_nodes, 2) from pressures (n_states, n_points), positive where the surfaces press.

    The `points` (n_states, n_points, 6) of a cell follow each other; of its `nodes` (n_cells, n_local) A, B, 1, 2 come
    first.
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
def sum_by_place(values: Array, places: IntArray, n_places: int) -> Array:
    """Return sums (n_states, n_places) of the values (n_states, n) that belong to the same of the places (n,)."""
    sums = np.zeros((values.shape[0], n_places), dtype=values.dtype)
    for state in range(values.shape[0]):
        for number in range(len(places)):
            sums[state, places[number]] += values[state, number]
    return sums
