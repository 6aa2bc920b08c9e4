"""A small dense matrix of the nodes of one coupling, added to compressed rows as a whole.

A kernel fills for each coupling a dense matrix `local`: node q of the coupling has the rows and columns 2 q and 2 q +
1, a multiplier behind the nodes has the last one. Where numbers of nodes, which ascend, follow each other, so do their
columns in each row. So a place in a row is looked for once for each run of numbers. Only rows whose node has the owner
`part` are written: threads share a matrix, and no row.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.contract.arrays import BoolArray, FloatArray, IntArray
from contactverif.geometry.block_rows import AnyIntArray, NumberArray, find_node
from contactverif.geometry.compiled import compile_inline, compile_maker

MOST_NODES = 12  # A coupling has at most so many nodes, and behind them at most one multiplier.
WIDTH = 2 * MOST_NODES + 1
NO_NODE = -1
SCANNED = 64  # A row with at most so many entries is scanned for a column; in a longer one the column is bisected for.


class Share(NamedTuple):
    """The share of one thread in the work on all couplings, in this order.

    A part begins with its own couplings, from begin to end. Then come those of later parts that touch its rows. So each
    row gets its sums from one thread, in the order of the couplings.
    """

    owner: NumberArray  # (n_numbers,), the part that writes the rows of each node or multiplier
    part: int
    begin: int
    end: int
    others: IntArray  # (n_others,), ascending


def share_couplings(n_numbers: int, nodes: NumberArray, starts: IntArray, parts: list[tuple[int, int]]) -> list[Share]:
    """Divide couplings among threads by `parts`, (begin, end) each; a row belongs to the first part that touches it."""
    if len(parts) == 1:
        return [Share(np.zeros(n_numbers, dtype=np.int32), 0, *parts[0], np.empty(0, dtype=np.int64))]
    begins = np.array([begin for begin, _ in parts] + [parts[-1][1]])
    owner, touches = _divide_rows(n_numbers, nodes, starts, begins)
    return [Share(owner, part, *parts[part], np.flatnonzero(touches[part])) for part in range(len(parts))]


@compile_maker
def _divide_rows(
    n_numbers: int, nodes: NumberArray, starts: IntArray, begins: IntArray
) -> tuple[NumberArray, BoolArray]:
    """Return the owner of each row, and whether a coupling (n_parts, n_couplings) of a later part touches its rows."""
    owner = np.full(n_numbers, NO_NODE, dtype=np.int32)
    touches = np.zeros((len(begins) - 1, len(starts) - 1), dtype=np.bool_)
    for part in range(len(begins) - 1):
        for coupling in range(begins[part], begins[part + 1]):
            for place in range(starts[coupling], starts[coupling + 1]):
                number = nodes[place]
                if owner[number] == NO_NODE:
                    owner[number] = part
                elif owner[number] != part:
                    touches[owner[number], coupling] = True
    return owner, touches


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
    indptr: AnyIntArray,
    indices: AnyIntArray,
    data: FloatArray,
    nodes: NumberArray,
    start: int,
    n_nodes: int,
    runs: NumberArray,
    local: FloatArray,
    owner: NumberArray,
    part: int,
) -> None:
    """Add the matrix `local` of a coupling to the rows and columns of its nodes, nodes[start:start + n_nodes].

    `runs` is what `find_runs` wrote. Rows whose `owner` is another `part` are left out.
    """
    for q in range(n_nodes):
        row = nodes[np.uint64(start + q)]
        if owner[row] != part:
            continue
        place, end = indptr[np.uint64(2 * row)], indptr[np.uint64(2 * row + 1)]
        width, column = end - place, 0
        while column < n_nodes:
            unknown = 2 * nodes[np.uint64(start + column)]
            if width > SCANNED:
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
