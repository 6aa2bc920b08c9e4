"""The tangent of a mortar method in factors: K = rest + leftᵀ diag(weights) right, and their product if it is wanted.

The pressure of a slave node j is p_j = weight_j G_j, or a multiplier. Row j of `left` holds the forces B_j of a unit
pressure, row j of `right` the derivative D_j of its weighted gap, and `rest` is Σ p_j ΔB_j. The factors grow with the
number of cells. The product is dense on the group of each row (`node_groups`): N master segments over one slave segment
give (2 N)² entries.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_maker
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.geometry.block_rows import NumberArray
from contactverif_mortar.integration_cells import Csr, Fields
from contactverif_mortar.node_groups import RowGroups


class Factors(NamedTuple):
    """A tangent K = rest + leftᵀ diag(weights) right.

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

    rest: sparse.csr_array  # (n_unknowns, n_unknowns) The derivative at fixed pressures.
    # (n_rows, n_unknowns) The forces of a unit pressure, one row for each slave node. Dual shapes have two rows more
    # for each slave segment: the forces of a unit of the mean and of the variance of c on what is covered.
    left: sparse.csr_array
    weights: FloatArray  # (n_rows,) The pressure for each unit of a row of `right`.
    # (n_rows, n_unknowns) The derivatives of the weighted gaps, and for dual shapes of mean and variance.
    right: sparse.csr_array

    def assemble(self) -> sparse.csr_array:
        """Return K by sparse products; the formulation's `tangent` is faster."""
        return (self.rest + self.left.T @ sparse.diags_array(self.weights) @ self.right).tocsr()

    def __matmul__(self, direction: FloatArray) -> FloatArray:
        """Return K times a direction (n_unknowns,), at the cost of the factors."""
        product: FloatArray = self.rest @ direction + self.left.T @ (self.weights * (self.right @ direction))
        return product


class NodeRows(NamedTuple):
    """The forces of a mortar method, and the factors of its tangent on the groups of their rows."""

    forces: FloatArray  # (n_unknowns,) Internal forces at the given pressures.
    # (n_unknowns, n_unknowns) The derivative at fixed pressures, in a pattern that the caller chose.
    rest: sparse.csr_array
    groups: RowGroups  # The nodes of each row.
    left: FloatArray  # (2 n_members,) The entries of both factors, two for each member of a group.
    right: FloatArray

    def factors(self, weights: FloatArray) -> Factors:
        """Return the factors with weights (n_slave_nodes,); the rows of segments have the weight one."""
        groups, n_unknowns = self.groups, self.rest.shape[1]
        indptr = (2 * groups.starts).astype(np.int32)
        indices = (2 * groups.nodes[:, None] + np.arange(2, dtype=np.int32)).ravel()
        shape = (len(indptr) - 1, n_unknowns)
        left, right = (sparse.csr_array((values, indices, indptr), shape=shape) for values in (self.left, self.right))
        return Factors(self.rest, left, np.append(weights, np.ones(shape[0] - len(weights))), right)

    def multiply(self, weights: FloatArray, first_row: int, end_row: int) -> sparse.csr_array:
        """Add the products of some rows to `rest`, whose pattern must hold their groups, and return it."""
        groups, rest = self.groups, self.rest
        all_weights = np.append(weights, np.ones(len(groups.starts) - 1 - len(weights)))
        factors = self.left, all_weights, self.right
        _add_products((rest.indptr, rest.indices, rest.data), first_row, end_row, groups.nodes, groups.starts, factors)
        return rest


@compile_maker
def _add_products(
    csr: Csr, first_row: int, end_row: int, nodes: NumberArray, starts: IntArray, factors: Fields
) -> None:
    """Add weight_j B_j ⊗ D_j to compressed rows. Groups and columns of rows ascend, so one walk finds all places."""
    indptr, indices, data = csr
    left, weights, right = factors
    for j in range(first_row, end_row):
        start, stop, weight = starts[j], starts[j + 1], weights[j]
        for row in range(start, stop):
            place, second = indptr[2 * nodes[row]], indptr[2 * nodes[row] + 1]
            width = second - place
            b_x, b_y = weight * left[2 * row], weight * left[2 * row + 1]
            if b_x == 0 and b_y == 0:
                continue  # In a half pass nodes that are not pushed have no such row.
            for column in range(start, stop):
                unknown = 2 * nodes[column]
                while indices[place] != unknown:
                    place += 2
                d_x, d_y = right[2 * column], right[2 * column + 1]
                data[place] += b_x * d_x
                data[place + 1] += b_x * d_y
                data[place + width] += b_y * d_x
                data[place + width + 1] += b_y * d_y
                place += 2
