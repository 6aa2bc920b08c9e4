"""The groups of nodes on which rows of the factors of a mortar method depend, and the size of their product.

A row belongs to one slave segment, or to the two segments at a slave node. Its group holds the local nodes of all cells
on these. Groups are integers: they follow from the pairing alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from contactverif.compiler import compile_inline, compile_maker, constant
from contactverif.contract.arrays import BoolArray, IntArray
from contactverif.contract.errors import MisuseError
from contactverif.geometry.block_rows import Couplings, NumberArray

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
    first: IntArray  # (n_slave_segments + 1,) Where the cells of each slave segment begin.

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
    first = _first_of_each(carrier, len(slave))
    nodes, starts = _group_nodes(n_nodes, active, slave, local, first, dual)
    return RowGroups(nodes, starts, local, first)


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
def _first_of_each(carrier: IntArray, n_segments: int) -> IntArray:
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
    """Return the groups of all rows, one after the other, and where each begins."""
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
    """Sort a part of an array in place, by Shell's method."""
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


@compile_inline
def find_member(nodes: NumberArray, first: int, last: int, number: int) -> int:
    """Return the place of a node in a group nodes[first:last]; it must be there."""
    count = last - first
    while count > 1:
        half = count >> 1
        first += half if nodes[first + half] <= number else 0
        count -= half
    return first
