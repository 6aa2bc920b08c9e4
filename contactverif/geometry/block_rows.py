"""A sparse tangent made of small dense blocks, written straight into compressed rows (CSR) by compiled loops.

A kernel lists the `Couplings` of the interface: which nodes feel which, by integers and booleans alone. `zero_matrix`
makes the pattern, the union of all couplings. For each coupling and pair of nodes the kernel calls `add_block`; for a
multiplier `add_row`, `add_column` and `add_entry`. They find the place by bisection. Or it fills a small dense matrix
for each coupling, and `add_local_matrix` adds that as a whole. Nothing is allocated, nothing is sorted afterwards, and
the sums have a fixed order.

In the plane a node has two unknowns, 2 v and 2 v + 1. A multiplier stands behind the nodes: the number n_nodes + i in a
coupling is the multiplier i, whose unknown is 2 n_nodes + i. In space a pattern has three unknowns for each node.
"""

from abc import abstractmethod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contactverif.compiler import compile_inline, compile_kernel
from contactverif.contract.arrays import FloatArray, IntArray, compressed_matrix
from contactverif.contract.formulation import Pairing
from contactverif.contract.interface import Interface

NumberArray = NDArray[np.int32]
AnyIntArray = NDArray[Any]  # int32 or int64
Fields = tuple[Any, ...]  # The fields of a named tuple, as a plain tuple.
Csr = tuple[AnyIntArray, AnyIntArray, FloatArray]  # The indptr, indices and data of compressed rows.
MOST_NODES = 12  # A coupling with a local matrix has at most so many nodes, and behind them at most one multiplier.
WIDTH = 2 * MOST_NODES + 1  # The rows and columns of a local matrix.
NO_NODE = -1
_SCANNED = 64  # A row with at most so many entries is scanned for a column; in a longer one the column is bisected for.
_MOST = np.iinfo(np.int32).max  # The largest number of entries that scipy numbers by int32.


class Couplings(NamedTuple):
    """Groups of nodes, each with the nodes whose forces depend on all positions of the group.

    Coupling k has the nodes `nodes[starts[k]:starts[k + 1]]`. The forces on those from `first_row[k]` on depend on the
    positions of all of them. A node may occur more than once in a coupling and in any number of couplings.
    """

    nodes: NumberArray  # (n_entries,), the nodes of all couplings, one coupling after the other
    starts: IntArray  # (n_couplings + 1,), where each coupling begins in `nodes`, and the end of the last one
    first_row: IntArray  # (n_couplings,), where in `nodes` the rows of each coupling begin


class _Pattern(NamedTuple):
    """A pattern, and what it was made of."""

    n_nodes: int
    n_multipliers: int
    per_node: int
    couplings: Couplings
    indptr: AnyIntArray
    indices: AnyIntArray


_latest: list[_Pattern] = []  # The latest pattern. Newton's method asks for it again until a pairing changes.


def zero_matrix(n_nodes: int, n_multipliers: int, couplings: Couplings, per_node: int = 2) -> Any:
    """Return a matrix (n_unknowns, n_unknowns) of zeros in the union of all couplings, columns ascending in rows.

    A node has `per_node` unknowns.
    """
    sizes, latest = (n_nodes, n_multipliers, per_node), _latest[0] if _latest else None
    pairs: Any = () if latest is None else zip(latest.couplings, couplings, strict=True)
    if latest is None or latest[:3] != sizes or not all(np.array_equal(*pair) for pair in pairs):
        latest = _Pattern(*sizes, couplings, *_make_pattern(*sizes, tuple(couplings)))
        _latest[:] = [latest]
    indptr, indices = latest.indptr.copy(), latest.indices.copy()  # A caller may change its matrix.
    matrix = compressed_matrix("csr", len(indptr) - 1, np.zeros(len(indices)), indices, indptr)
    matrix.has_canonical_format = True  # Columns are ascending, and none occurs twice in a row.
    return matrix


def _make_pattern(
    n_nodes: int, n_multipliers: int, per_node: int, couplings: Fields
) -> tuple[AnyIntArray, AnyIntArray]:
    n_numbers, sizes = n_nodes + n_multipliers, (n_nodes, per_node)
    begins, member_starts = np.zeros((2, n_numbers + 1), dtype=np.int64)
    members, ends = np.empty(len(couplings[0]), dtype=np.int32), np.empty(n_numbers, dtype=np.int64)
    _write_members(begins, ends, (member_starts, members), couplings)
    columns, latest = np.empty(begins[-1], dtype=np.int32), np.full(n_numbers, NO_NODE, dtype=np.int32)
    n_entries = _write_columns((begins, ends, columns, latest), (member_starts, members), couplings, sizes)
    number: type[np.int32 | np.int64] = np.int32 if n_entries <= _MOST else np.int64
    indptr, indices = np.empty(per_node * n_nodes + n_multipliers + 1, dtype=number), np.empty(n_entries, dtype=number)
    _write_pattern(indptr, indices, (begins, ends, columns), sizes)
    return indptr, indices


@compile_kernel
def _write_members(begins: IntArray, ends: IntArray, of_columns: Fields, couplings: Fields) -> None:
    """Write the couplings of each column, members[member_starts[i]:member_starts[i + 1]], and room for rows' columns.

    The columns of row i get the room from begins[i] to begins[i + 1]; `ends` is room for this function.
    """
    (member_starts, members), (nodes, starts, first_row) = of_columns, couplings
    for coupling in range(len(first_row)):
        start, stop = starts[coupling], starts[coupling + 1]
        for place in range(start, stop):
            member_starts[nodes[place] + 1] += 1
        for place in range(first_row[coupling], stop):
            begins[nodes[place] + 1] += stop - start
    for number in range(len(ends)):
        ends[number] = member_starts[number]
        member_starts[number + 1] += member_starts[number]
        begins[number + 1] += begins[number]
    for coupling in range(len(first_row)):
        for place in range(starts[coupling], starts[coupling + 1]):
            members[ends[nodes[place]]] = coupling
            ends[nodes[place]] += 1


@compile_kernel
def _write_columns(rows: Fields, of_columns: Fields, couplings: Fields, sizes: tuple[int, int]) -> int:
    """Write the columns of each row, nodes and multipliers by number: columns[begins[row]:ends[row]], ascending.

    Return the number of entries. Columns are visited in ascending order, so they are sorted as they come, and one that
    comes twice was the latest.
    """
    (begins, ends, columns, latest), (n_nodes, per_node) = rows, sizes
    (member_starts, members), (nodes, starts, first_row) = of_columns, couplings
    n_entries = 0
    for row in range(len(ends)):
        ends[row] = begins[row]
    for column in range(len(ends)):
        width = per_node if column < n_nodes else 1
        for member in range(member_starts[column], member_starts[column + 1]):
            coupling = members[member]
            for place in range(first_row[coupling], starts[coupling + 1]):
                row = nodes[place]
                if latest[row] != column:
                    latest[row], columns[ends[row]] = column, column
                    ends[row] += 1
                    n_entries += per_node * width if row < n_nodes else width
    return n_entries


@compile_kernel
def _write_pattern(indptr: AnyIntArray, indices: AnyIntArray, rows: Fields, sizes: tuple[int, int]) -> None:
    (begins, ends, columns), (n_nodes, per_node) = rows, sizes
    at, unknown = 0, 0
    indptr[0] = 0
    for row in range(len(ends)):
        for _ in range(per_node if row < n_nodes else 1):
            for place in range(begins[row], ends[row]):
                column = columns[place]
                if column < n_nodes:
                    for part in range(per_node):
                        indices[at] = per_node * column + part
                        at += 1
                else:
                    indices[at] = (per_node - 1) * n_nodes + column
                    at += 1
            unknown += 1
            indptr[unknown] = at


@compile_inline
def find_node(indices: AnyIntArray, first: int, last: int, column: int) -> int:
    """Return the place of the first column of a node among indices[first:last], the columns of a row; it must be there.

    Columns of nodes come in pairs, before those of multipliers. So every second column is enough.
    """
    count = (last - first + 1) >> 1
    while count > 1:
        half = count >> 1
        first += 2 * half if indices[first + 2 * half] <= column else 0
        count -= half
    return first


@compile_inline
def find_entry(indices: AnyIntArray, first: int, last: int, column: int) -> int:
    """Return the place of a number among indices[first:last], such as the columns of a row; they ascend."""
    count = last - first
    while count > 1:
        half = count >> 1
        first += half if indices[first + half] <= column else 0
        count -= half
    return first


@compile_inline
def add_block(csr: Csr, row: int, column: int, xx: float, xy: float, yx: float, yy: float) -> None:
    """Add the block ((xx, xy), (yx, yy)) to the rows of the node `row` and the columns of the node `column`."""
    indptr, indices, data = csr
    first, second = indptr[2 * row], indptr[2 * row + 1]
    place = find_node(indices, first, second, 2 * column)
    data[place] += xx
    data[place + 1] += xy
    place += second - first
    data[place] += yx
    data[place + 1] += yy


@compile_inline
def add_row(csr: Csr, unknown: int, column: int, x: float, y: float) -> None:
    """Add (x, y) to the row of the multiplier with this unknown and the columns of the node `column`."""
    indptr, indices, data = csr
    place = find_node(indices, indptr[unknown], indptr[unknown + 1], 2 * column)
    data[place] += x
    data[place + 1] += y


@compile_inline
def add_column(csr: Csr, row: int, unknown: int, x: float, y: float) -> None:
    """Add (x, y) to the rows of the node `row` and the column of the multiplier with this unknown."""
    indptr, indices, data = csr
    first, second = indptr[2 * row], indptr[2 * row + 1]
    place = find_entry(indices, first, second, unknown)
    data[place] += x
    data[place + second - first] += y


@compile_inline
def add_entry(csr: Csr, row: int, column: int, value: float) -> None:
    """Add a number to one entry, whose row and column are unknowns."""
    indptr, indices, data = csr
    data[find_entry(indices, indptr[row], indptr[row + 1], column)] += value


@compile_inline
def insert_node(listed: NumberArray, start: int, place: int, number: int) -> int:
    """Insert a node into the ascending list listed[start:place] unless it is there; return the end of the list."""
    at = place
    while at > start and listed[at - 1] > number:
        at -= 1
    if at > start and listed[at - 1] == number:
        return place
    for later in range(place, at, -1):
        listed[later] = listed[later - 1]
    listed[at] = number
    return place + 1


@compile_inline
def find_runs(runs: NumberArray, nodes: NumberArray, start: int, n_nodes: int) -> None:
    """Write into runs[q] where the run of consecutive numbers ends that holds the node q of a coupling."""
    end = n_nodes
    for q in range(n_nodes - 1, -1, -1):
        if q + 1 < n_nodes and nodes[start + q] + 1 != nodes[start + q + 1]:
            end = q + 1
        runs[q] = end


@compile_inline
def add_local_matrix(
    csr: Csr, members: Fields, runs: NumberArray, local: FloatArray, owner: NumberArray, part: int
) -> None:
    """Add the matrix `local` of a coupling to the rows and columns of its nodes, nodes[start:start + n_nodes].

    `members` are `nodes`, `start` and `n_nodes`.
    Node q of the coupling has the rows and columns 2 q and 2 q + 1 of `local`, a multiplier behind the nodes the last
    one. Where numbers of nodes, which ascend, follow each other, so do their columns in each row. So a place in a row
    is looked for once for each run of numbers; `runs` is what `find_runs` wrote. Only rows whose node has the owner
    `part` are written: threads share a matrix, and no row.
    """
    (indptr, indices, data), (nodes, start, n_nodes) = csr, members
    for q in range(n_nodes):
        row = nodes[np.uint64(start + q)]
        if owner[row] != part:
            continue
        place, end = indptr[np.uint64(2 * row)], indptr[np.uint64(2 * row + 1)]
        width, column = end - place, 0
        while column < n_nodes:
            unknown = 2 * nodes[np.uint64(start + column)]
            if width > _SCANNED:
                place = find_node(indices, place, end, unknown)
            while indices[np.uint64(place)] != unknown:
                place += 2
            run_end = runs[column]
            while column < run_end:
                data[np.uint64(place)] += local[np.uint64(2 * q), np.uint64(2 * column)]
                data[np.uint64(place + 1)] += local[np.uint64(2 * q), np.uint64(2 * column + 1)]
                data[np.uint64(place + width)] += local[np.uint64(2 * q + 1), np.uint64(2 * column)]
                data[np.uint64(place + width + 1)] += local[np.uint64(2 * q + 1), np.uint64(2 * column + 1)]
                column, place = column + 1, place + 2


class TangentOfBoth:
    """A formulation that computes its tangent together with its residual."""

    __slots__ = ()

    @abstractmethod
    def residual_and_tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> tuple[FloatArray, Any]:
        """Return the residual (n_unknowns,) and its derivative; each formulation says how."""

    def tangent(self, interface: Interface, pairing: Pairing, z: FloatArray, /) -> Any:
        """Return the derivative of the residual, sparse."""
        return self.residual_and_tangent(interface, pairing, z)[1]
