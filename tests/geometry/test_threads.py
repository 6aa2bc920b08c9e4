"""Threads: parts of a range, exceptions, and how couplings are shared."""

from threading import get_ident

import numpy as np
import pytest

from contactverif.geometry.threads import LEAST_PART, run_in_threads, share_couplings, split_range


def test_a_range_is_split_into_parts_that_are_worth_a_thread() -> None:
    assert split_range(10, 4) == [(0, 10)]
    assert split_range(0, 4) == [(0, 0)]
    assert split_range(2 * LEAST_PART, 1) == [(0, 2 * LEAST_PART)]
    assert split_range(2 * LEAST_PART, 4) == [(0, LEAST_PART), (LEAST_PART, 2 * LEAST_PART)]


def test_calls_run_side_by_side_and_the_first_error_is_raised() -> None:
    threads: list[int] = []

    def fail() -> None:
        threads.append(get_ident())
        raise ValueError(f"call {len(threads)}")

    with pytest.raises(ValueError, match="call"):
        run_in_threads([fail, lambda: threads.append(get_ident())])
    assert len(set(threads)) == 2
    assert get_ident() in threads


def test_each_row_belongs_to_the_first_part_that_touches_it_and_sees_all_its_couplings_in_order() -> None:
    random = np.random.default_rng(2)
    groups = [np.unique(random.integers(0, 30, 4)) for _ in range(40)]
    nodes = np.concatenate(groups).astype(np.int32)
    starts = np.cumsum([0, *(len(group) for group in groups)])
    shares = share_couplings(30, nodes, starts, [(0, 11), (11, 25), (25, 40)])
    for row in range(30):
        touching = [number for number, group in enumerate(groups) if row in group]
        if touching:
            share = shares[shares[0].owner[row]]
            order = [*range(share.begin, share.end), *share.others.tolist()]
            assert [number for number in order if row in groups[number]] == touching
