"""Blocks written straight into compressed rows, against the same blocks added up in a dense matrix."""

from typing import Any

import numpy as np
import pytest

from contactverif.geometry import block_rows
from contactverif.geometry.block_rows import Couplings, add_block, add_column, add_entry, add_row, zero_matrix

N_NODES, N_MULTIPLIERS = 9, 4


def draw_couplings(seed: int) -> Couplings:
    """Draw couplings of nodes and multipliers in which numbers occur twice, and nodes that belong to none."""
    random = np.random.default_rng(seed)
    lists = [random.integers(0, N_NODES - 1, random.integers(2, 7)) for _ in range(random.integers(0, 8))]
    lists = [np.append(nodes, random.integers(N_NODES, N_NODES + N_MULTIPLIERS, seed % 3)) for nodes in lists]
    starts = np.cumsum([0, *(len(nodes) for nodes in lists)])
    first_row = starts[:-1] + [random.integers(0, len(nodes)) for nodes in lists]
    return Couplings(np.concatenate([[], *lists]).astype(np.int32), starts, first_row.astype(np.int64))


def unknowns(number: int) -> slice:
    """Return the unknowns of a node or a multiplier."""
    return slice(2 * number, 2 * number + 2) if number < N_NODES else slice(N_NODES + number, N_NODES + number + 1)


def add_all(matrix: Any, dense: Any, couplings: Couplings, seed: int) -> None:
    """Add a random block for each row and column of each coupling, to both matrices."""
    random = np.random.default_rng(seed)
    arrays = matrix.indptr, matrix.indices, matrix.data
    for coupling, first in enumerate(couplings.first_row):
        for row in couplings.nodes[first : couplings.starts[coupling + 1]]:
            for column in couplings.nodes[couplings.starts[coupling] : couplings.starts[coupling + 1]]:
                block = random.normal(size=dense[unknowns(row), unknowns(column)].shape)
                dense[unknowns(row), unknowns(column)] += block
                if row < N_NODES and column < N_NODES:
                    add_block(arrays, row, column, *block.ravel())
                elif column < N_NODES:
                    add_row(arrays, N_NODES + row, column, *block.ravel())
                elif row < N_NODES:
                    add_column(arrays, row, N_NODES + column, *block.ravel())
                else:
                    add_entry(arrays, N_NODES + row, N_NODES + column, block.item())


@pytest.mark.parametrize("seed", range(12))
def test_blocks_in_rows_are_those_in_a_dense_matrix(seed: int) -> None:
    couplings = draw_couplings(seed)
    matrix = zero_matrix(N_NODES, N_MULTIPLIERS, couplings)
    dense = np.zeros(matrix.shape)
    add_all(matrix, dense, couplings, seed)
    assert np.array_equal(matrix.toarray(), dense)


@pytest.mark.parametrize("seed", range(12))
def test_the_pattern_is_the_union_of_the_couplings_with_ascending_columns(seed: int) -> None:
    couplings = draw_couplings(seed)
    matrix = zero_matrix(N_NODES, N_MULTIPLIERS, couplings)
    is_coupled = np.zeros(matrix.shape, dtype=bool)
    for coupling, first in enumerate(couplings.first_row):
        for row in couplings.nodes[first : couplings.starts[coupling + 1]]:
            for column in couplings.nodes[couplings.starts[coupling] : couplings.starts[coupling + 1]]:
                is_coupled[unknowns(row), unknowns(column)] = True
    rows, columns = np.nonzero(is_coupled)  # row by row, columns ascending
    assert np.array_equal(matrix.indices, columns)
    assert np.array_equal(np.repeat(np.arange(len(is_coupled)), np.diff(matrix.indptr)), rows)
    assert not matrix.data.any()


def test_numbers_of_entries_are_long_only_where_they_have_to_be(monkeypatch: pytest.MonkeyPatch) -> None:
    couplings = draw_couplings(2)
    short = zero_matrix(N_NODES, N_MULTIPLIERS, couplings)
    assert short.indices.dtype == short.indptr.dtype == np.int32
    monkeypatch.setattr(block_rows, "_MOST", short.nnz - 1)
    monkeypatch.setattr(block_rows, "_latest", [])
    long = zero_matrix(N_NODES, N_MULTIPLIERS, couplings)
    assert long.indices.dtype == long.indptr.dtype == np.int64
    assert np.array_equal(short.indices, long.indices)
    assert np.array_equal(short.indptr, long.indptr)
    for matrix in (short, long):
        add_all(matrix, np.zeros(matrix.shape), couplings, seed=1)
    assert np.array_equal(short.data, long.data)


def test_a_pattern_that_is_asked_for_again_is_the_same_and_nobody_spoils_it() -> None:
    first, other = draw_couplings(3), draw_couplings(4)
    before = zero_matrix(N_NODES, N_MULTIPLIERS, first)
    expected = before.indices.copy()
    before.indices[:] = -1
    before.data += 1.0
    again = zero_matrix(N_NODES, N_MULTIPLIERS, Couplings(*(array.copy() for array in first)))
    np.testing.assert_array_equal(again.indices, expected)
    assert not again.data.any()
    between = zero_matrix(N_NODES, N_MULTIPLIERS, other)
    assert not np.array_equal(between.indptr, again.indptr)
    assert zero_matrix(N_NODES + 1, N_MULTIPLIERS, other).shape[0] == between.shape[0] + 2
    np.testing.assert_array_equal(zero_matrix(N_NODES, N_MULTIPLIERS, first).indices, expected)
