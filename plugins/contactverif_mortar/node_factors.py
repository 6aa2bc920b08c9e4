"""The tangent of a mortar method in factors: K = rest + leftᵀ diag(weights) right, and their product if it is wanted.

The pressure of a slave node j is p_j = weight_j G_j, or a multiplier. Row j of `left` holds the forces B_j of a unit
pressure, row j of `right` the derivative D_j of its weighted gap, and `rest` is Σ p_j ΔB_j. Each row has the nodes of
the cells on the two slave segments at j, its group. So the factors grow with the number of cells. The product is dense
on each group: N master segments over one slave segment give (2 N)² entries. `check_product` says where that is too
much.

    B_j = ∫ N_j (n at x_s, −n at x_m)        D_j = Σ [w N_j Δg + (g − G_j) Δ(w N_j)] / divisor_j

For standard shapes on slaves that look along their own normal; `pressure_shapes` has the same for all others.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.contract.interface import Interface
from contactverif.geometry.block_rows import AnyIntArray, Couplings, NumberArray, find_entry
from contactverif.geometry.compiled import compile_kernel
from contactverif.geometry.projection import node
from contactverif_mortar import cell_frame
from contactverif_mortar.cell_frame import TAU, N, begin_cell, write_gains
from contactverif_mortar.cell_geometry import A, B, slave_view
from contactverif_mortar.cell_tangent import cell_arguments, tangent_of_cells
from contactverif_mortar.integration_cells import GAP, WEIGHT, XI, C, Cells, Fields, Quadrature

D_C, D_GAP, D_WEIGHT = cell_frame.C, cell_frame.GAP, cell_frame.WEIGHT
LARGE_GROUP = 64  # Groups of more nodes count in the estimate of a product's size; smaller ones overlap too much.
MOST_BYTES = 2**35  # 32 GiB: more than a workstation spares for one matrix.
BYTES_OF_ENTRY = 12  # A float64 and an int32.


class Factors(NamedTuple):
    """A tangent K = rest + leftᵀ diag(weights) right.

    Attributes
    ----------
    rest : sparse.csr_array, shape (n_unknowns, n_unknowns)
        The derivative at fixed pressures.
    left : sparse.csr_array, shape (n_rows, n_unknowns)
        The forces of a unit pressure, one row for each slave node. Dual shapes have two rows more for each slave
        segment: the forces of a unit of the mean and of the variance of c on what is covered.
    weights : FloatArray, shape (n_rows,)
        The pressure for each unit of a row of `right`.
    right : sparse.csr_array, shape (n_rows, n_unknowns)
        The derivatives of the weighted gaps, and for dual shapes of mean and variance.

    Examples
    --------
    >>> import numpy as np
    >>> from contactverif import Interface
    >>> from contactverif_mortar import mortar
    >>> interface = Interface.from_chains([[0, 0], [2, 0], [4, 0]], [[4, 0.5], [1, 0.5], [0, 0.5]])
    >>> plugin, z = mortar(penalty=3.0), interface.nodes.ravel()
    >>> pairing = plugin.pair(interface, z)
    >>> factors, direction = plugin.factors(interface, pairing, z), np.arange(z.size) / z.size
    >>> np.allclose(factors @ direction, plugin.tangent(interface, pairing, z) @ direction)
    True
    """

    rest: sparse.csr_array
    left: sparse.csr_array
    weights: FloatArray
    right: sparse.csr_array

    def assemble(self) -> sparse.csr_array:
        """Return K by sparse products; `multiply` is faster where the rows have the groups of slave nodes."""
        return (self.rest + self.left.T @ sparse.diags_array(self.weights) @ self.right).tocsr()

    def __matmul__(self, direction: FloatArray) -> FloatArray:
        """Return K times a direction (n_unknowns,), at the cost of the factors."""
        product: FloatArray = self.rest @ direction + self.left.T @ (self.weights * (self.right @ direction))
        return product


def group_nodes(interface: Interface, cells: Cells, active: BoolArray) -> Couplings:
    """Return for each slave node the nodes of the cells on its two segments, ascending; none if it is not active."""
    nodes, starts = _group_nodes(
        interface.n_nodes, active, interface.slave.segments, interface.master.segments, cells.slave, cells.master
    )
    return Couplings(nodes, starts, starts[:-1])


def rows_of_nodes(
    interface: Interface,
    cells: Cells,
    rule: Quadrature,
    x: FloatArray,
    points: FloatArray,
    groups: Couplings,
    gaps: FloatArray,
    divisor: FloatArray,
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Compute `left` and `right` of all slave nodes.

    Parameters
    ----------
    interface, cells, rule, x : Interface, Cells, Quadrature, or FloatArray of shape (n_nodes, 2)
        The interface, its cells, the rule of their points, and positions.
    points : FloatArray, shape (n_points, 6)
        The points of `Quadrature.points`.
    groups : Couplings
        The pattern, from `group_nodes`.
    gaps, divisor : FloatArray, shape (n_slave_nodes,)
        G_j and ∫N_j for the derivative of G_j; zero and one for that of ∫N_j g.

    Returns
    -------
    tuple[sparse.csr_array, sparse.csr_array], each of shape (n_slave_nodes, n_unknowns)
        Both have the same pattern.
    """
    indptr, indices = (
        (2 * groups.starts).astype(np.int32),
        (2 * groups.nodes[:, None] + np.arange(2, dtype=np.int32)).ravel(),
    )
    left: FloatArray = np.zeros(len(indices))
    right: FloatArray = np.zeros(len(indices))
    arguments = cell_arguments(interface, cells, rule)
    _add_node_rows(x, *arguments, points, gaps, divisor, indptr, indices, left, right)
    shape = (interface.n_slave_nodes, interface.n_unknowns)
    rows = [sparse.csr_array((values, indices, indptr), shape=shape) for values in (left, right)]
    return rows[0], rows[1]


def fixed_pressures(
    interface: Interface,
    cells: Cells,
    rule: Quadrature,
    x: FloatArray,
    points: FloatArray,
    pressure: FloatArray,
    couplings: Couplings | None = None,
) -> sparse.csr_array:
    """Compute Σ p_j ΔB_j from nodal pressures (n_slave_nodes,), as `tangent_of_cells` does."""
    ends = pressure[np.repeat(interface.slave.segments[cells.slave], len(rule), axis=0)]
    slope = (ends[:, 1] - ends[:, 0]) / 2
    at_points = (ends[:, 0] + ends[:, 1]) / 2 + slope * points[:, C]
    pressures = (at_points, slope, np.zeros(len(points)))
    return tangent_of_cells(interface, cells, rule, x, points, pressures, couplings)


def multiply(factors: Factors, groups: Couplings) -> sparse.csr_array:
    """Add the product of the factors to their `rest`, whose pattern must have all groups, and return it."""
    rest, left, weights, right = factors
    _add_products(groups.nodes, groups.starts, left.data, weights, right.data, rest.indptr, rest.indices, rest.data)
    return rest


def check_product(groups: Couplings) -> None:
    """Check that the assembled tangent has a size that fits into memory.

    Two neighbours share one slave segment, so at least half of the entries of all dense groups are different ones.

    Raises
    ------
    MisuseError
        If its entries take more than 32 GiB.
    """
    sizes = np.diff(groups.starts)
    large = sizes[sizes > LARGE_GROUP].astype(np.float64)
    size = BYTES_OF_ENTRY * (4 * large**2).sum() / 2
    if size > MOST_BYTES:
        raise MisuseError(
            "tangent",
            f"about {size / 2**30:.0f} GiB for the assembled matrix, dense where up to {sizes.max()} nodes face "
            "the segments at one slave node",
            f"at most {MOST_BYTES / 2**30:.0f} GiB; use `factors`, or make the finer surface the slave",
        )


@compile_kernel
def _group_nodes(
    n_nodes: int, active: BoolArray, slave: IntArray, master: IntArray, cell_slave: IntArray, cell_master: IntArray
) -> tuple[NumberArray, IntArray]:
    """Return the groups of all slave nodes, one after the other, and where each begins."""
    at_node = np.full((len(active), 2), -1, dtype=np.int64)  # the segments that end and begin at a node
    for s in range(len(slave)):
        at_node[slave[s, 0], 1], at_node[slave[s, 1], 0] = s, s
    first_cell = _first_cells(cell_slave, len(slave))
    nodes = np.empty(4 * len(slave) + 4 * len(cell_slave), dtype=np.int32)  # each segment is in at most two groups
    starts = np.zeros(len(active) + 1, dtype=np.int64)
    last_group = np.full(n_nodes, -1, dtype=np.int32)  # the last group that each node has joined
    count = 0
    for j in range(len(active)):
        for side in range(2):
            s = at_node[j, side]
            if not active[j] or s < 0:
                continue
            for cell in range(first_cell[s + 1] - 1, first_cell[s] - 1, -1):
                m = cell_master[cell]
                for number in (slave[s, 0], slave[s, 1], master[m, 0], master[m, 1]):
                    if last_group[number] != j:
                        last_group[number] = j
                        nodes[count] = number
                        count += 1
        starts[j + 1] = count
        _sort(nodes, starts[j], count)
    return nodes[:count].copy(), starts


@compile_kernel
def _first_cells(cell_slave: IntArray, n_segments: int) -> IntArray:
    """Return where the cells of each slave segment begin (n_segments + 1,); they are in the order of the segments."""
    first_cell = np.zeros(n_segments + 1, dtype=np.int64)
    for s in cell_slave:
        first_cell[s + 1] += 1
    for s in range(n_segments):
        first_cell[s + 1] += first_cell[s]
    return first_cell


@compile_kernel
def _sort(numbers: NumberArray, start: int, stop: int) -> None:
    """Sort a part of an array in place; short parts, which are most, without an allocation."""
    if stop - start > 32:
        numbers[start:stop] = np.sort(numbers[start:stop])
        return
    for i in range(start + 1, stop):
        number, place = numbers[i], i
        while place > start and numbers[place - 1] > number:
            numbers[place] = numbers[place - 1]
            place -= 1
        numbers[place] = number


@compile_kernel
def _add_node_rows(
    x: FloatArray,
    segments_and_cells: Fields,
    rule: Fields,
    points: FloatArray,
    gaps: FloatArray,
    divisor: FloatArray,
    indptr: AnyIntArray,
    indices: AnyIntArray,
    left: FloatArray,
    right: FloatArray,
) -> None:
    """Add B_j and D_j of all cells to the rows of the slave nodes that have a group."""
    lengths, slave, master, cell_slave, cell_master, cut_low, cut_high = segments_and_cells
    places, weights = rule
    n_q = len(places)
    ends, d = np.empty((2, 4, 2)), np.empty((4, 4, 2))
    d_gap, force = np.empty((2, 4, 2)), np.empty((2, 4))  # Their rows are the ends A and B of the slave segment.
    for cell in range(len(cell_slave)):
        s, m = cell_slave[cell], cell_master[cell]
        view = slave_view(x, slave, s, -1, -1)
        x_1, x_2 = node(x, master[m, 0]), node(x, master[m, 1])
        axes = begin_cell(ends, view, x_1, x_2, cut_low[cell], cut_high[cell], lengths[s])
        local = (slave[s, A], slave[s, B], master[m, 0], master[m, 1])
        d_gap[:], force[:] = 0.0, 0.0
        for q in range(n_q):
            point = points[cell * n_q + q]
            c, xi, g, w = point[C], point[XI], point[GAP], point[WEIGHT]
            write_gains(d, ends, axes, places[q], weights[q], c, xi, g)
            for end in range(2):
                shape, slope = (1 + (2 * end - 1) * c) / 2, end - 0.5
                above = g - gaps[local[end]]
                for k, share in enumerate(((1 - c) / 2, (1 + c) / 2, xi - 1, -xi)):
                    force[end, k] += w * shape * share
                    for i in range(2):
                        d_weighted = shape * d[D_WEIGHT, k, i] + w * slope * d[D_C, k, i]
                        d_gap[end, k, i] += w * shape * d[D_GAP, k, i] + above * d_weighted
        tau, n = axes.tau, axes.n
        for end in range(2):
            j = local[end]
            if indptr[j] == indptr[j + 1]:
                continue
            for k in range(4):
                a, b = d_gap[end, k, TAU] / divisor[j], d_gap[end, k, N] / divisor[j]
                x_part, y_part = a * tau[0] + b * n[0], a * tau[1] + b * n[1]
                place = find_entry(indices, indptr[j], indptr[j + 1], 2 * local[k])
                left[place] += force[end, k] * n[0]
                left[place + 1] += force[end, k] * n[1]
                right[place] += x_part
                right[place + 1] += y_part


@compile_kernel
def _add_products(
    nodes: NumberArray,
    starts: IntArray,
    left: FloatArray,
    weights: FloatArray,
    right: FloatArray,
    indptr: AnyIntArray,
    indices: AnyIntArray,
    data: FloatArray,
) -> None:
    """Add weight_j B_j ⊗ D_j of all slave nodes to compressed rows. Entries of a group follow each other in `left`."""
    for j in range(len(weights)):
        start, stop = starts[j], starts[j + 1]
        for row in range(start, stop):
            first, second = indptr[2 * nodes[row]], indptr[2 * nodes[row] + 1]
            width, place = second - first, first
            b_x, b_y = weights[j] * left[2 * row], weights[j] * left[2 * row + 1]
            for column in range(start, stop):
                unknown = 2 * nodes[column]
                if indices[place] != unknown:  # neighbours in a group are mostly neighbours in a row
                    place = find_entry(indices, place, second, unknown)
                d_x, d_y = right[2 * column], right[2 * column + 1]
                data[place] += b_x * d_x
                data[place + 1] += b_x * d_y
                data[place + width] += b_y * d_x
                data[place + width + 1] += b_y * d_y
                place = min(place + 2, second - 1)
