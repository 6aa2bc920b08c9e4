"""The tangent of a mortar method in factors: K = rest + leftᵀ diag(weights) right, and their product if it is wanted.

The pressure of a slave node j is p_j = weight_j G_j, or a multiplier. Row j of `left` holds the forces B_j of a unit
pressure, row j of `right` the derivative D_j of its weighted gap, and `rest` is Σ p_j ΔB_j.

A row belongs to one slave segment, or to the two segments at a slave node. Its group holds the local nodes of all cells
on these. Groups are integers: they follow from the pairing alone. The factors grow with the number of cells. The
product is dense on the group of each row: N master segments over one slave segment give (2 N)² entries.
"""

from typing import NamedTuple

import numpy as np
from scipy import sparse

from contactverif.compiler import compile_inline, compile_maker, constant
from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.geometry.block_rows import Couplings, Csr, Fields, NumberArray
from contactverif_mortar.integration_cells import read_only

LARGE_GROUP = 64  # Groups of more nodes count in the estimate of a product's size; smaller ones overlap too much.
MOST_BYTES = 2**35  # 32 GiB: more than a workstation spares for one matrix.
_FIRST_STEP = constant(1)
BYTES_OF_ENTRY = 12  # A float64 and an int32.


class RowGroups(NamedTuple):
    """The groups of all rows, and what they are made of."""

    nodes: NumberArray  # (n_members,) The nodes of all groups, one group after the other, ascending in each.
    # (n_rows + 1,) Where each group begins. First come the slave nodes, whose groups are empty unless they are active.
    # For dual shapes the slave segments come behind them, and once more.
    starts: IntArray
    local: NumberArray  # (n_cells, n_local) The nodes of each cell, or of each point.

    def pattern(self, first_row: int, end_row: int) -> Couplings:
        """Return the groups of some rows as the pattern of a matrix."""
        starts = self.starts[first_row : end_row + 1]
        return Couplings(self.nodes[: starts[-1]], starts, starts[:-1])

    def pattern_of_cells(self) -> Couplings:
        """Return the nodes of each cell as the pattern of a matrix."""
        starts = np.arange(0, self.local.size + 1, self.local.shape[1])
        return Couplings(self.local.ravel(), starts, starts[:-1])


def group_nodes(
    n_nodes: int, slave: IntArray, carrier: IntArray, local: NumberArray, active: BoolArray, dual: bool
) -> RowGroups:
    """Return the groups of `active` slave nodes, and for dual shapes those of slave segments with an active node.

    `carrier` (n_cells,), ascending, is the slave segment of each cell, `local` (n_cells, n_local) its nodes.
    """
    first = _first_cells(read_only(carrier), len(slave))
    nodes, starts = _group_nodes(n_nodes, active, slave, local, first, dual)
    return RowGroups(nodes, starts, local)


def check_product(starts: IntArray) -> None:
    """Raise MisuseError if the assembled tangent takes more than 32 GiB; `starts` are those of the slave nodes."""
    sizes = np.diff(starts)
    large = sizes[sizes > LARGE_GROUP].astype(np.float64)
    size = BYTES_OF_ENTRY * (4 * large**2).sum() / 2
    if size > MOST_BYTES:
        raise MisuseError(
            "tangent",
            f"about {size / 2**30:.0f} GiB for the assembled matrix, dense where up to {sizes.max()} nodes face "
            "the segments at one slave node",
            f"at most {MOST_BYTES / 2**30:.0f} GiB; use `factors`, or make the finer surface the slave",
        )


@compile_maker
def _first_cells(carrier: IntArray, n_segments: int) -> IntArray:
    """Return where the cells of each slave segment begin (n_segments + 1,); they are in the order of the segments."""
    first = np.zeros(n_segments + 1, dtype=np.int64)
    for s in carrier:
        first[s + 1] += 1
    for s in range(n_segments):
        first[s + 1] += first[s]
    return first


@compile_maker
def _group_nodes(
    n_nodes: int, active: BoolArray, slave: IntArray, local: NumberArray, first: IntArray, dual: bool
) -> tuple[NumberArray, IntArray]:
    on_row = _segments_of_rows(active, slave, dual)
    room = 0
    for row in range(len(on_row)):
        for side in range(2):
            s = on_row[row, side]
            room += local.shape[1] * (first[s + 1] - first[s]) if s >= 0 else 0
    nodes, starts = np.empty(room, dtype=np.int32), np.zeros(len(on_row) + 1, dtype=np.int64)
    last_group = np.full(n_nodes, -1, dtype=np.int32)  # the last group that each node has joined
    count = 0
    for row in range(len(on_row)):
        for side in range(2):
            s = on_row[row, side]
            if s < 0:
                continue
            for cell in range(first[s + 1] - 1, first[s] - 1, -1):
                for k in range(local.shape[1]):
                    number = local[cell, k]
                    if last_group[number] != row:
                        last_group[number] = row
                        nodes[count] = number
                        count += 1
        starts[row + 1] = count
        _sort(nodes, starts[row], count)
    return nodes[:count].copy(), starts


@compile_maker
def _segments_of_rows(active: BoolArray, slave: IntArray, dual: bool) -> IntArray:
    """Return the slave segments to which each row belongs (n_rows, 2), −1 for none."""
    n_slave = len(active)
    on_row = np.full((n_slave + (2 * len(slave) if dual else 0), 2), -1, dtype=np.int64)
    for s in range(len(slave)):
        a, b = slave[s, 0], slave[s, 1]
        if active[a]:
            on_row[a, 1] = s
        if active[b]:
            on_row[b, 0] = s
        if dual and (active[a] or active[b]):
            on_row[n_slave + s, 0] = on_row[n_slave + len(slave) + s, 0] = s
    return on_row


@compile_inline
def _sort(numbers: NumberArray, start: int, stop: int) -> None:
    step = _FIRST_STEP
    while 3 * step < stop - start:
        step = 3 * step + 1
    while step > 0:
        for i in range(start + step, stop):
            number, place = numbers[i], i
            while place >= start + step and numbers[place - step] > number:
                numbers[place] = numbers[place - step]
                place -= step
            numbers[place] = number
        step //= 3


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
    weights: FloatArray  # (n_slave_nodes,) Those of the slave nodes; the rows of segments have the weight one.

    def factors(self) -> Factors:
        """Return the factors as sparse matrices."""
        indptr = (2 * self.groups.starts).astype(np.int32)
        indices = (2 * self.groups.nodes[:, None] + np.arange(2, dtype=np.int32)).ravel()
        shape = (len(indptr) - 1, self.rest.shape[1])
        left, right = (sparse.csr_array((values, indices, indptr), shape=shape) for values in (self.left, self.right))
        return Factors(self.rest, left, self._all_weights(), right)

    def multiply(self, first_row: int, end_row: int) -> None:
        """Add the products of some rows to `rest`, whose pattern must hold their groups."""
        csr, groups = (self.rest.indptr, self.rest.indices, self.rest.data), self.groups
        factors = self.left, self._all_weights(), self.right
        _add_products(csr, first_row, end_row, groups.nodes, groups.starts, factors)

    def _all_weights(self) -> FloatArray:
        return np.append(self.weights, np.ones(len(self.groups.starts) - 1 - len(self.weights)))


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
