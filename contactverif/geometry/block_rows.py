"""A sparse tangent made of small dense blocks, written straight into compressed rows (CSR) by compiled loops.

A kernel makes a tangent in three steps:

1. It lists the `Couplings` of the interface: which nodes feel which nodes. No real number is needed for that.
2. `zero_matrix` makes the pattern, the union of all couplings, with zeros as entries.
3. For each coupling and pair of nodes the kernel calls `add_block`; for a multiplier `add_row`, `add_column` and
   `add_entry`. They find the place by bisection and add to it. Nothing is allocated, nothing is sorted afterwards.

A node has two unknowns, 2 v and 2 v + 1. A multiplier stands behind the nodes: the number n_nodes + i in a coupling is
the multiplier i, whose unknown is 2 n_nodes + i.

Rules for the next editor:

1. The pattern depends on integers and booleans alone. An entry may be zero at one state, and still be there.
2. Columns are ascending in each row, no place occurs twice, and the sums have a fixed order.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.geometry.compiled import compile_kernel

NumberArray = NDArray[np.int32]
AnyIntArray = NDArray[Any]  # int32 or int64
_MOST = np.iinfo(np.int32).max  # The largest number of entries that scipy numbers by int32.


class Couplings(NamedTuple):
    """Groups of nodes, each with the nodes whose forces depend on all positions of the group.

    Coupling k has the nodes `nodes[starts[k]:starts[k + 1]]`. The forces on those from `first_row[k]` on depend on the
    positions of all of them. A node may occur more than once in a coupling and in any number of couplings.
    """

    nodes: NumberArray  # (n_entries,), the nodes of all couplings, one coupling after the other
    starts: IntArray  # (n_couplings + 1,), where each coupling begins in `nodes`, and the end of the last one
    first_row: IntArray  # (n_couplings,), where in `nodes` the rows of each coupling begin


def zero_matrix(n_nodes: int, n_multipliers: int, couplings: Couplings) -> sparse.csr_array:
    """Return the matrix whose pattern is the union of all couplings, with zeros as entries.

    Parameters
    ----------
    n_nodes, n_multipliers : int
        The number of nodes, with two unknowns each, and of multipliers behind them.
    couplings : Couplings
        Which nodes and multipliers feel which.

    Returns
    -------
    sparse.csr_array, shape (n_unknowns, n_unknowns)
        Its columns are ascending in each row. They are int32 where scipy numbers entries so, else int64.
    """
    size = 2 * n_nodes + n_multipliers
    nodes, starts, first_row = couplings
    members, member_starts = _couplings_of_columns(n_nodes + n_multipliers, nodes, starts, first_row)
    indptr = _row_starts(n_nodes, size, nodes, starts, first_row, members, member_starts)
    n_entries = int(indptr[-1])
    number: type[np.int32 | np.int64] = np.int32 if n_entries <= _MOST else np.int64
    indices = np.empty(n_entries, dtype=number)
    _write_columns(indices, n_nodes, indptr, nodes, starts, first_row, members, member_starts)
    matrix = sparse.csr_array((np.zeros(n_entries), indices, indptr.astype(number)), shape=(size, size))
    matrix.has_canonical_format = True  # Columns are ascending, and none occurs twice in a row.
    return matrix


@compile_kernel
def _couplings_of_columns(
    n_numbers: int, nodes: NumberArray, starts: IntArray, first_row: IntArray
) -> tuple[NumberArray, IntArray]:
    """Return the couplings in which each node or multiplier occurs, one node after the other, and where each begins."""
    member_starts = np.zeros(n_numbers + 1, dtype=np.int64)
    for place in range(len(nodes)):
        member_starts[nodes[place] + 1] += 1
    for number in range(n_numbers):
        member_starts[number + 1] += member_starts[number]
    members, ends = np.empty(len(nodes), dtype=np.int32), member_starts[:-1].copy()
    for coupling in range(len(first_row)):
        for place in range(starts[coupling], starts[coupling + 1]):
            number = nodes[place]
            members[ends[number]] = coupling
            ends[number] += 1
    return members, member_starts


@compile_kernel
def _row_starts(
    n_nodes: int,
    size: int,
    nodes: NumberArray,
    starts: IntArray,
    first_row: IntArray,
    members: NumberArray,
    member_starts: IntArray,
) -> IntArray:
    """Return where the entries of each row begin (size + 1,)."""
    n_numbers = len(member_starts) - 1
    last_column = np.full(n_numbers, -1, dtype=np.int32)  # The last column that each row has met.
    indptr = np.zeros(size + 1, dtype=np.int64)
    for column in range(n_numbers):
        width = 2 if column < n_nodes else 1
        for member in range(member_starts[column], member_starts[column + 1]):
            coupling = members[member]
            for place in range(first_row[coupling], starts[coupling + 1]):
                row = nodes[place]
                if last_column[row] != column:
                    last_column[row] = column
                    indptr[_first_unknown(row, n_nodes) + 1] += width
    for row in range(n_nodes):  # both rows of a node have the same columns
        indptr[2 * row + 2] = indptr[2 * row + 1]
    for unknown in range(size):
        indptr[unknown + 1] += indptr[unknown]
    return indptr


@compile_kernel
def _write_columns(
    indices: AnyIntArray,
    n_nodes: int,
    indptr: IntArray,
    nodes: NumberArray,
    starts: IntArray,
    first_row: IntArray,
    members: NumberArray,
    member_starts: IntArray,
) -> None:
    """Write the columns of all rows. Columns are met in ascending order, so they are sorted as they stand."""
    n_numbers = len(member_starts) - 1
    last_column = np.full(n_numbers, -1, dtype=np.int32)
    ends = np.empty(n_numbers, dtype=np.int64)  # The place of the next column of each row.
    for row in range(n_numbers):
        ends[row] = indptr[_first_unknown(row, n_nodes)]
    for column in range(n_numbers):
        unknown = _first_unknown(column, n_nodes)
        for member in range(member_starts[column], member_starts[column + 1]):
            coupling = members[member]
            for place in range(first_row[coupling], starts[coupling + 1]):
                row = nodes[place]
                if last_column[row] == column:
                    continue
                last_column[row] = column
                first = _first_unknown(row, n_nodes)
                at, width = ends[row], indptr[first + 1] - indptr[first]
                ends[row] += 2 if column < n_nodes else 1
                for _ in range(2 if row < n_nodes else 1):
                    indices[at] = unknown
                    if column < n_nodes:
                        indices[at + 1] = unknown + 1
                    at += width


@compile_kernel
def _first_unknown(number: int, n_nodes: int) -> int:
    """Return the first unknown of a node, or the unknown of a multiplier."""
    return 2 * number if number < n_nodes else n_nodes + number


@compile_kernel
def find_place(indices: AnyIntArray, first: int, last: int, column: int) -> int:
    """Return where a column stands among the ascending columns indices[first:last] of a row; it must be there."""
    count = last - first
    while count > 1:
        half = count // 2
        first += half if indices[first + half] <= column else 0
        count -= half
    return first


@compile_kernel
def add_block(
    indptr: IntArray,
    indices: AnyIntArray,
    data: FloatArray,
    row: int,
    column: int,
    xx: float,
    xy: float,
    yx: float,
    yy: float,
) -> None:
    """Add the block ((xx, xy), (yx, yy)) to the rows of the node `row` and the columns of the node `column`."""
    first, second = indptr[2 * row], indptr[2 * row + 1]
    place = find_place(indices, first, second, 2 * column)
    data[place] += xx
    data[place + 1] += xy
    place += second - first
    data[place] += yx
    data[place + 1] += yy


@compile_kernel
def add_row(
    indptr: AnyIntArray, indices: AnyIntArray, data: FloatArray, unknown: int, column: int, x: float, y: float
) -> None:
    """Add (x, y) to the row of the multiplier with this unknown and the columns of the node `column`."""
    place = find_place(indices, indptr[unknown], indptr[unknown + 1], 2 * column)
    data[place] += x
    data[place + 1] += y


@compile_kernel
def add_column(
    indptr: AnyIntArray, indices: AnyIntArray, data: FloatArray, row: int, unknown: int, x: float, y: float
) -> None:
    """Add (x, y) to the rows of the node `row` and the column of the multiplier with this unknown."""
    first, second = indptr[2 * row], indptr[2 * row + 1]
    place = find_place(indices, first, second, unknown)
    data[place] += x
    data[place + second - first] += y


@compile_kernel
def add_entry(indptr: AnyIntArray, indices: AnyIntArray, data: FloatArray, row: int, column: int, value: float) -> None:
    """Add a number to one entry, whose row and column are unknowns."""
    data[find_place(indices, indptr[row], indptr[row + 1], column)] += value
