"""An interface is either right or refused with one clear line; what it precomputes is what one would draw."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from contactverif import Interface, MisuseError, Surface

PAIR = Interface.from_chains([[0, 0], [1, 0], [3, 0]], [[4, 0], [2, 0], [1.5, 0.5], [-1, 0]])


def surface(*segments: tuple[int, int]) -> Surface:
    return Surface(np.array(segments))


def interface(nodes: object, slave: Surface | None = None, master: Surface | None = None) -> Interface:
    return Interface(np.asarray(nodes), slave or surface((0, 1), (1, 2)), master or surface((3, 4)))


NODES = np.array([[0.0, 0], [1, 0], [2, 0], [2, 1], [0, 1]])


def moved_nodes(node: int, *place: float) -> np.ndarray:
    nodes = NODES.copy()
    nodes[node] = place
    return nodes


def test_an_open_chain() -> None:
    chain = surface((5, 7), (2, 5), (7, 3))
    assert chain.neighbours.tolist() == [[1, 2], [-1, 0], [0, -1]]
    assert chain.chain_order.tolist() == [1, 0, 2]
    assert chain.nodes.tolist() == [2, 3, 5, 7]
    assert len(chain) == 3


def test_a_closed_chain() -> None:
    ring = surface((0, 1), (2, 0), (1, 2))
    assert ring.neighbours.tolist() == [[1, 2], [2, 0], [0, 1]]
    assert ring.chain_order.tolist() == [0, 2, 1]


def test_several_chains_open_ones_first() -> None:
    chains = surface((0, 1), (1, 0), (4, 5), (2, 3), (3, 8))
    assert chains.chain_order.tolist() == [2, 3, 4, 0, 1]
    assert chains.chain_starts.tolist() == [0, 1, 3]
    assert chains.neighbours.tolist() == [[1, 1], [0, 0], [-1, -1], [-1, 4], [3, -1]]


def test_neighbours_and_order_agree_on_random_chains() -> None:
    random = np.random.default_rng(1)
    for _ in range(20):
        numbers = random.permutation(12)
        pieces = [numbers[:5], numbers[5:9], numbers[9:]]
        segments = np.vstack([np.column_stack([piece[:-1], piece[1:]]) for piece in pieces])
        chains = Surface(segments[random.permutation(len(segments))])
        assert sorted(chains.chain_order.tolist()) == list(range(len(chains)))
        for segment, other in zip(chains.chain_order[:-1], chains.chain_order[1:], strict=True):
            follows = chains.segments[segment, 1] == chains.segments[other, 0]
            assert follows == (chains.neighbours[segment, 1] == other) == (chains.neighbours[other, 0] == segment)
        assert (chains.neighbours < 0).sum() == 2 * len(pieces)


def test_an_interface() -> None:
    assert (PAIR.dim, PAIR.n_nodes, PAIR.n_slave_nodes, PAIR.n_unknowns) == (2, 7, 3, 14)
    assert PAIR.slave.lengths(PAIR.nodes).tolist() == [1, 2]
    assert PAIR.master.segments.tolist() == [[3, 4], [4, 5], [5, 6]]


def test_swapped_twice_is_the_identity() -> None:
    once = PAIR.swap_roles()
    assert once.nodes[: once.n_slave_nodes].tolist() == PAIR.nodes[3:].tolist()
    assert once.slave.lengths(once.nodes).tolist() == PAIR.master.lengths(PAIR.nodes).tolist()
    twice = once.swap_roles()
    assert np.array_equal(twice.nodes, PAIR.nodes)
    assert np.array_equal(twice.slave.segments, PAIR.slave.segments)
    assert np.array_equal(twice.master.segments, PAIR.master.segments)


def test_at_keeps_the_segments() -> None:
    stretched = PAIR.at(2 * PAIR.nodes)
    assert stretched.slave is PAIR.slave
    assert np.array_equal(stretched.nodes, 2 * PAIR.nodes)


def test_everything_is_a_read_only_copy() -> None:
    nodes, segments = NODES.copy(), np.array([[0, 1], [1, 2]])
    original = interface(nodes, Surface(segments))
    nodes[:], segments[:] = 9, 9
    assert np.array_equal(original.nodes, NODES)
    for array in (original.nodes, original.slave.segments, original.slave.neighbours, original.slave.chain_order):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(AttributeError):
        original.nodes = NODES  # type: ignore[misc]


def test_nodes_of_both_sides_may_coincide() -> None:
    assert interface(moved_nodes(3, 2, 0)).nodes[2].tolist() == [2, 0]


SURFACES = {
    "flat list": ([0, 1], r"segments: found an array of shape \(2,\); needed shape \(n_segments, 2\)"),
    "five nodes": ([[0, 1, 2, 3, 4]], r"segments: found an array of shape \(1, 5\)"),
    "empty": (np.empty((0, 2), dtype=int), r"segments: found an array of shape \(0, 2\); needed .* n_segments ≥ 1"),
    "ragged": ([[0, 1], [2]], "segments: found rows of different lengths; needed an array"),
    "floats": ([[0.0, 1.0]], "segments: found dtype float64; needed integer node numbers"),
    "booleans": ([[False, True]], "segments: found dtype bool; needed integer node numbers"),
    "negative": ([[0, -1]], "segments: found node number -1; needed node numbers ≥ 0"),
    "loop": ([[0, 1], [2, 2]], "segments: found segment 1 that begins and ends at node 2; needed two nodes"),
    "fork": ([[0, 1], [1, 2], [1, 3]], "segments: found segments 1, 2 that all begin at node 1; needed chains"),
    "join": ([[0, 2], [1, 2], [2, 3]], "segments: found segments 0, 1 that all end at node 2; needed chains"),
    "one against the other": ([[0, 1], [2, 1]], r"segments: .* end at node 1; needed chains: .*body on the left"),
}


@pytest.mark.parametrize(("segments", "message"), SURFACES.values(), ids=SURFACES)
def test_wrong_surfaces(segments: object, message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        Surface(segments)  # type: ignore[arg-type]


INTERFACES: dict[str, tuple[Callable[[], Interface], str]] = {
    "nan": (
        lambda: interface(moved_nodes(1, np.nan, 0)),
        r"nodes: found node 1 at \(nan, 0.0\); needed finite coordinates",
    ),
    "infinity": (lambda: interface(moved_nodes(4, 0, -np.inf)), r"nodes: found node 4 at \(0.0, -inf\)"),
    "three coordinates": (
        lambda: interface(np.zeros((5, 3))),
        "slave: found faces of 2 corners and nodes with 3 coordinates; needed segments in the plane",
    ),
    "four coordinates": (
        lambda: interface(np.zeros((5, 4))),
        r"nodes: found an array of shape \(5, 4\); needed shape",
    ),
    "flat": (lambda: interface(np.zeros(10)), r"nodes: found an array of shape \(10,\)"),
    "ragged": (lambda: Interface([[0, 0], [1]], surface((0, 1)), surface((2, 3))), "nodes: found rows of different"),  # type: ignore[arg-type]
    "complex": (lambda: interface(NODES * 1j), "nodes: found dtype complex128; needed real numbers"),
    "text": (lambda: interface(NODES.astype(str)), "nodes: found dtype <U32; needed real numbers"),
    "no surface": (lambda: Interface(NODES, [[0, 1]], surface((3, 4))), "slave: found a list; needed a Surface"),  # type: ignore[arg-type]
    "zero length": (
        lambda: interface(moved_nodes(1, 0, 0)),
        "slave: found segment 0 of zero length; needed two different end",
    ),
    "zero length of the master": (lambda: interface(moved_nodes(4, 2, 1)), "master: found segment 0 of zero length"),
    "coincident": (
        lambda: interface(moved_nodes(2, 0, 0)),
        r"slave: found coincident nodes 0, 2 at \(0.0, 0.0\); needed one node a place on each surface",
    ),
    "minus zero": (lambda: interface(moved_nodes(2, -0.0, 0)), "slave: found coincident nodes 0, 2"),
    "master first": (
        lambda: interface(NODES, surface((3, 4)), surface((0, 1), (1, 2))),
        "slave: found nodes 3, 4; needed the first node numbers, 0 … 1, each used",
    ),
    "unused slave node": (lambda: interface(NODES, surface((0, 2))), "slave: found nodes 0, 2; needed the first node"),
    "unused last node": (
        lambda: interface(np.vstack([NODES, [[7, 7]]])),
        "master: found nodes 3, 4; needed all node numbers behind the slave's, 3 … 5, each used",
    ),
    "node of both": (lambda: interface(NODES, None, surface((2, 3), (3, 4))), "master: found nodes 2, 3, 4; needed"),
    "too few nodes": (lambda: interface(NODES[:4]), "master: found nodes 3, 4; needed all node numbers .* 3 … 3"),
    "chain of one point": (lambda: Interface.from_chains([[0, 0]], NODES), r"slave: found an array of shape \(1, 2\)"),
    "chain of text": (lambda: Interface.from_chains(NODES, [["a", "b"]] * 3), "nodes: found dtype <U32; needed real"),
    "ragged chain": (lambda: Interface.from_chains(NODES, [[0, 0], [1]]), "master: found rows of different lengths"),
    "moved to nowhere": (lambda: PAIR.at(PAIR.nodes[:3]), "master: found nodes 3, 4, 5, 6; needed"),
}


@pytest.mark.parametrize(("make", "message"), INTERFACES.values(), ids=INTERFACES)
def test_wrong_interfaces(make: Callable[[], Interface], message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        make()


def test_an_error_says_argument_found_and_needed() -> None:
    with pytest.raises(MisuseError) as caught:
        interface(moved_nodes(1, 0, 0))
    error = caught.value
    assert (error.argument, error.found) == ("slave", "segment 0 of zero length")
    assert str(error) == f"slave: found {error.found}; needed {error.needed}"
    assert isinstance(error, ValueError)


def walk_by_hand(segments: list[list[int]]) -> tuple[list[list[int]], list[int]]:
    """Return neighbours and order of chains as the definitions say, segment by segment."""
    starting = {first: number for number, (first, _) in enumerate(segments)}
    ending = {second: number for number, (_, second) in enumerate(segments)}
    neighbours = [[ending.get(first, -1), starting.get(second, -1)] for first, second in segments]
    order: list[int] = []
    for number in [number for number, (before, _) in enumerate(neighbours) if before < 0] + list(range(len(segments))):
        while number >= 0 and number not in order:
            order.append(number)
            number = neighbours[number][1]
    return neighbours, order


def test_neighbours_and_chains_of_any_numbering_are_those_of_a_walk() -> None:
    random = np.random.default_rng(1)
    for trial in range(200):
        segments, n_nodes = [], 0
        for _ in range(random.integers(1, 4)):
            length, closed = int(random.integers(2, 6)), bool(random.integers(2))
            nodes = [*range(n_nodes, n_nodes + length), *([n_nodes] if closed else [])]
            segments += [list(pair) for pair in pairwise(nodes)]
            n_nodes += length
        if trial % 2:  # Numbers in any order, with gaps.
            numbers = random.permutation(3 * n_nodes)[:n_nodes]
            segments = [
                [int(numbers[node]) for node in segments[number]] for number in random.permutation(len(segments))
            ]
        surface, (neighbours, order) = Surface(segments), walk_by_hand(segments)
        assert surface.neighbours.tolist() == neighbours
        assert surface.chain_order.tolist() == order
        assert surface.neighbours.dtype == surface.chain_order.dtype == np.int64
