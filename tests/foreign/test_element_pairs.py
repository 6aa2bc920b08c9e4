"""The nodes of elements: which segments, which chains, and which part of a chain a C library is shown."""

from itertools import pairwise

import numpy as np
import pytest

from contactverif import Interface, Surface
from contactverif_foreign.c_library import find_windows, segment_views
from contactverif_foreign.element_pairs import pair_chains, pair_nodes, pair_segments


def straight(n_slave: int, n_master: int, *, overhang: float = 0.0) -> Interface:
    """Return a slave chain from 0 to 1 on a master chain that begins at `overhang`."""
    slave, master = np.linspace(0, 1, n_slave + 1), np.linspace(1, overhang, n_master + 1)
    return Interface.from_chains(np.column_stack([slave, 0 * slave]), np.column_stack([master, 0 * master]))


def test_a_node_past_a_free_end_has_no_element() -> None:
    interface = straight(4, 3, overhang=0.2)
    (elements,) = pair_nodes(interface, interface.nodes, 0.01)
    assert elements.labels.tolist() == [1, 2, 3, 4]
    assert elements.nodes.shape == (4, 3)
    near = straight(4, 3, overhang=0.002)  # Less than τ × the length of the last segment past its end.
    (elements,) = pair_nodes(near, near.nodes, 0.01)
    assert len(elements.nodes) == 5
    assert elements.lengths.sum() == pytest.approx(1, rel=1e-15)


def test_segments_that_overlap_are_elements() -> None:
    interface = straight(2, 3)
    (elements,) = pair_segments(interface, interface.nodes, 0.01)
    pairs = {(int(row[0]), int(row[2]), int(row[3])) for row in elements.nodes}
    assert pairs == {(0, 4, 5), (0, 5, 6), (1, 3, 4), (1, 4, 5)}
    matching = straight(3, 3)
    (elements,) = pair_segments(matching, matching.nodes, 0.01)
    assert len(elements.nodes) == 3


def test_a_segment_behind_another_is_no_element() -> None:
    slave = [[0.0, 0.0], [1.0, 0.0]]
    near, far, back = ([[1.0, -h], [0.0, -h]] for h in (0.1, 0.5, 0.2))
    nodes = np.array([*slave, *near, *far, *back[::-1]])  # The last runs the other way: a back side.
    interface = Interface(nodes, Surface([[0, 1]]), Surface([[2, 3], [4, 5], [6, 7]]))
    (elements,) = pair_segments(interface, interface.nodes, 0.01)
    assert elements.nodes.tolist() == [[0, 1, 2, 3]]


def test_chains_are_elements_in_the_order_of_a_walk() -> None:
    nodes = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 0.0], [1.0, 0.0], [0.0, 0.0], [9.0, 5.0], [8.0, 5.0]])
    interface = Interface(nodes, Surface([[1, 2], [0, 1]]), Surface([[4, 5], [3, 4], [6, 7]]))
    (elements,) = pair_chains(interface, interface.nodes, 0.01)  # Nothing is near the last chain.
    assert elements.nodes.tolist() == [[0, 1, 2, 3, 4, 5]]
    assert elements.sides == (3, 3, 0, 0)
    assert elements.lengths.tolist() == [2.0]


def test_a_c_library_is_shown_what_is_near_and_one_segment_more() -> None:
    interface = straight(4, 8)
    windows = find_windows(interface, interface.nodes)
    starts = windows["master_start"]
    assert windows["slave_segment"].tolist() == [0, 1, 2, 3]
    parts = [windows["master_segment"][a:b].tolist() for a, b in pairwise(starts)]
    assert all(set(part) >= {6 - 2 * number, 7 - 2 * number} for number, part in enumerate(parts))
    assert all(part == list(range(part[0], part[-1] + 1)) for part in parts)
    for views in segment_views(interface, windows):
        ends = views.nodes[:, views.arrays["master"]]  # (n, width, 2), numbers of the interface
        assert (ends[:, 1:, 0] == ends[:, :-1, 1]).all()


def test_a_closed_chain_is_shown_across_its_first_node() -> None:
    angle = np.arange(12) * np.pi / 6
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    segments = 2 + np.column_stack([np.arange(12), (np.arange(12) + 1) % 12])
    slave = 1.01 * np.array([[np.cos(0.3), np.sin(0.3)], [np.cos(-0.3), np.sin(-0.3)]])
    interface = Interface(np.vstack([slave, ring]), Surface([[0, 1]]), Surface(segments))
    windows = find_windows(interface, interface.nodes)
    assert windows["master_segment"].tolist() == [10, 11, 0, 1]
    (views,) = segment_views(interface, windows)
    assert views.nodes.tolist() == [[0, 1, 12, 13, 2, 3, 4]]
    assert views.arrays["master_neighbours"][0].tolist() == [[-2, 1], [0, 2], [1, 3], [2, -2]]
