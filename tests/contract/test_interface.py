"""An interface is either right or refused with one clear line; what it precomputes is what one would draw.

Interfaces of segments in the plane come first, then those of faces in space.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from contactverif import Case, Interface, MisuseError, Surface

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


def test_several_chains_open_ones_first() -> None:
    chains = surface((0, 1), (1, 0), (4, 5), (2, 3), (3, 8))
    assert chains.chain_order.tolist() == [2, 3, 4, 0, 1]
    assert chains.chain_starts.tolist() == [0, 1, 3]
    assert chains.neighbours.tolist() == [[1, 1], [0, 0], [-1, -1], [-1, 4], [3, -1]]


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


SURFACES = [
    ([0, 1], r"segments: found an array of shape \(2,\); needed shape \(n_segments, 2\)"),
    ([[0, 1, 2, 3, 4]], r"segments: found an array of shape \(1, 5\)"),
    (np.empty((0, 2), dtype=int), r"segments: found an array of shape \(0, 2\); needed .* n_segments ≥ 1"),
    ([[0, 1], [2]], "segments: found rows of different lengths; needed an array"),
    ([[0.0, 1.0]], "segments: found dtype float64; needed integer node numbers"),
    ([[False, True]], "segments: found dtype bool; needed integer node numbers"),
    ([[0, -1]], "segments: found node number -1; needed node numbers ≥ 0"),
    ([[0, 1], [2, 2]], "segments: found segment 1 that begins and ends at node 2; needed two nodes"),
    ([[0, 1], [1, 2], [1, 3]], "segments: found segments 1, 2 that all begin at node 1; needed chains"),
    ([[0, 2], [1, 2], [2, 3]], "segments: found segments 0, 1 that all end at node 2; needed chains"),
    ([[0, 1], [2, 1]], r"segments: .* end at node 1; needed chains: .*body on the left"),
    ([[0, 1, -1]], "faces: found node number -1; needed node numbers ≥ 0"),
    ([[0, 1, 2], [1, 3, 1]], r"faces: found face 1 with the corners \[1, 3, 1\]; needed different corners"),
    ([[0, 1, 2], [1, 0, 3], [0, 1, 4]], r"faces: found faces 0, 1, 2 on the edge \[0, 1\]; needed a"),
    (
        [[0, 1, 2], [0, 1, 3]],
        r"faces: found faces 0 and 1, which both run along the edge \[0, 1\]; needed corners counter-clockwise",
    ),
]


@pytest.mark.parametrize(("segments", "message"), SURFACES)
def test_wrong_surfaces(segments: object, message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        Surface(segments)  # type: ignore[arg-type]


SQUARE = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
BELOW = SQUARE - [0, 0, 1]
TRIANGLES = [[0, 2, 1], [0, 3, 2]]  # Seen from below, since the slave body is on top.
SOLID = Interface.from_faces(SQUARE, TRIANGLES, BELOW, [[0, 1, 2, 3]])
LINE = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
DART = np.array([[0.0, 0, 0], [2, 0, 0], [0.5, 0.5, 0], [0, 2, 0]])


def pair(slave: np.ndarray, faces: list[list[int]]) -> Interface:
    return Interface.from_faces(slave, faces, BELOW, [[0, 1, 2, 3]])


INTERFACES: list[tuple[Callable[[], Interface], str]] = [
    (lambda: interface(moved_nodes(1, np.nan, 0)), r"nodes: found node 1 at \(nan, 0.0\); needed finite coord"),
    (lambda: interface(moved_nodes(4, 0, -np.inf)), r"nodes: found node 4 at \(0.0, -inf\)"),
    (
        lambda: interface(np.zeros((5, 3))),
        "slave: found faces of 2 corners and nodes with 3 coordinates; needed segments in the plane",
    ),
    (lambda: interface(np.zeros((5, 4))), r"nodes: found an array of shape \(5, 4\); needed shape"),
    (lambda: interface(np.zeros(10)), r"nodes: found an array of shape \(10,\)"),
    (lambda: Interface([[0, 0], [1]], surface((0, 1)), surface((2, 3))), "nodes: found rows of different"),  # type: ignore[arg-type]
    (lambda: interface(NODES * 1j), "nodes: found dtype complex128; needed real numbers"),
    (lambda: interface(NODES.astype(str)), "nodes: found dtype <U32; needed real numbers"),
    (lambda: Interface(NODES, [[0, 1]], surface((3, 4))), "slave: found a list; needed a Surface"),  # type: ignore[arg-type]
    (lambda: interface(moved_nodes(1, 0, 0)), "slave: found segment 0 of zero length; needed two diff"),
    (lambda: interface(moved_nodes(4, 2, 1)), "master: found segment 0 of zero length"),
    (
        lambda: interface(moved_nodes(2, 0, 0)),
        r"slave: found coincident nodes 0, 2 at \(0.0, 0.0\); needed one node a place on each surface",
    ),
    (lambda: interface(moved_nodes(2, -0.0, 0)), "slave: found coincident nodes 0, 2"),
    (
        lambda: interface(NODES, surface((3, 4)), surface((0, 1), (1, 2))),
        "slave: found nodes 3, 4; needed the first node numbers, 0 … 1, each used",
    ),
    (lambda: interface(NODES, surface((0, 2))), "slave: found nodes 0, 2; needed the first node"),
    (
        lambda: interface(np.vstack([NODES, [[7, 7]]])),
        "master: found nodes 3, 4; needed all node numbers behind the slave's, 3 … 5, each used",
    ),
    (lambda: interface(NODES, None, surface((2, 3), (3, 4))), "master: found nodes 2, 3, 4; needed"),
    (lambda: interface(NODES[:4]), "master: found nodes 3, 4; needed all node numbers .* 3 … 3"),
    (lambda: Interface.from_chains([[0, 0]], NODES), r"slave: found an array of shape \(1, 2\)"),
    (lambda: Interface.from_chains(NODES, [["a", "b"]] * 3), "nodes: found dtype <U32; needed real"),
    (lambda: Interface.from_chains(NODES, [[0, 0], [1]]), "master: found rows of different lengths"),
    (lambda: PAIR.at(PAIR.nodes[:3]), "master: found nodes 3, 4, 5, 6; needed"),
    (lambda: pair(LINE, [[0, 1, 2]]), "slave: found face 0 of no area; needed corners"),
    (lambda: pair(DART, [[0, 1, 2, 3]]), "slave: found face 0, a quadrilateral that is not convex"),
    (lambda: pair(SQUARE[:, :2], TRIANGLES), r"slave: found an array of shape \(4, 2\); needed shape \(n_po"),
    (
        lambda: pair(np.vstack([SQUARE, SQUARE[:1]]), [[0, 2, 1], [4, 3, 2]]),
        r"slave: found coincident nodes 0, 4 at \(0.0, 0.0, 0.0\)",
    ),
    (
        lambda: Interface(SQUARE[:, :2], Surface([[0, 1, 2]]), Surface([[3, 4, 5]])),
        "slave: found faces of 3 corners and nodes with 2 coordinates; needed segments in the plane",
    ),
    (lambda: pair(np.vstack([SQUARE, [[9.0, 9, 9]]]), TRIANGLES), "master: found nodes 5, 6, 7, 8; needed"),
]


@pytest.mark.parametrize(("make", "message"), INTERFACES)
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


def test_faces_know_what_lies_across_each_edge() -> None:
    fan = Surface([[0, 1, 2], [0, 2, 3], [0, 3, 1]])
    assert fan.neighbours.tolist() == [[2, -1, 1], [0, -1, 2], [1, -1, 0]]
    assert fan.nodes.tolist() == [0, 1, 2, 3]
    assert len(fan.chain_order) == len(fan.chain_starts) == 0
    strip = Surface([[0, 1, 4, 3], [1, 2, 5, 4]])
    assert strip.neighbours.tolist() == [[-1, 1, -1, -1], [-1, -1, -1, 0]]


def test_neighbours_of_any_triangles_are_those_of_a_search() -> None:
    random = np.random.default_rng(3)
    for _ in range(20):
        n = int(random.integers(2, 5))
        corner = np.arange(n * n).reshape(n, n)
        lower = np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:]], -1).reshape(-1, 3)
        upper = np.stack([corner[:-1, :-1], corner[1:, 1:], corner[:-1, 1:]], -1).reshape(-1, 3)
        faces = random.permutation(np.vstack([lower, upper]))
        edges = [[{row[i], row[(i + 1) % 3]} for i in range(3)] for row in faces.tolist()]
        for face, row in enumerate(Surface(faces).neighbours.tolist()):
            for edge, neighbour in enumerate(row):
                across = [other for other, theirs in enumerate(edges) if other != face and edges[face][edge] in theirs]
                assert across == ([] if neighbour < 0 else [neighbour])


def test_an_interface_in_space() -> None:
    assert (SOLID.dim, SOLID.n_nodes, SOLID.n_slave_nodes, SOLID.n_unknowns) == (3, 8, 4, 24)
    assert SOLID.master.faces.tolist() == [[4, 5, 6, 7]]
    assert SOLID.slave.measures(SOLID.nodes).tolist() == [1, 1]
    assert SOLID.master.measures(SOLID.nodes) == pytest.approx([2])
    twice = SOLID.swap_roles().swap_roles()
    assert np.array_equal(twice.nodes, SOLID.nodes)
    assert np.array_equal(twice.slave.faces, SOLID.slave.faces)
    assert SOLID.at(2 * SOLID.nodes).slave is SOLID.slave


def test_segments_have_faces_and_lengths_as_measures() -> None:
    plane = Interface.from_chains([[0, 0], [1, 0], [3, 0]], [[4, 0], [0, 0]])
    assert plane.slave.faces is plane.slave.segments
    for measure in (plane.slave.measures, plane.slave.heights):
        assert measure(plane.nodes).tobytes() == plane.slave.lengths(plane.nodes).tobytes()
    with pytest.raises(MisuseError, match="segments: found faces of 3 corners; needed `faces` of a surface in space"):
        _ = SOLID.slave.segments


def test_areas_of_bilinear_faces() -> None:
    """The area of the hyperbolic paraboloid z = x y over the unit square is known by quadrature to many digits."""
    saddle = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0]])
    kite = np.array([[0.0, 0, 0], [3, 1, 0], [4, 4, 0], [1, 3, 0]])
    nodes = np.vstack([saddle, kite])
    areas = Surface([[0, 1, 2, 3], [4, 5, 6, 7]]).measures(nodes)
    assert areas == pytest.approx([1.280789, 8.0], rel=1e-5)


def test_heights_are_the_least_distances_of_corners_from_edges() -> None:
    needle = np.array([[0.0, 0, 0], [8, 0, 0], [4, 0.25, 0]])
    assert Surface([[0, 1, 2]]).heights(needle) == pytest.approx([0.25])
    assert SOLID.master.heights(SOLID.nodes) == pytest.approx([1.0])


def test_a_case_in_space_has_heights_areas_and_faces_in_its_lengths() -> None:
    case = Case(SOLID, SOLID.nodes.reshape(-1), penalty=8.0)
    assert case.shortest_segment == pytest.approx(2 / np.sqrt(5))  # The height of a triangle over its diagonal.
    assert case.slave_length == pytest.approx(np.sqrt(2))
    assert case.n_segments == 3
    again = Case.from_arrays(case.to_arrays())
    assert again.interface.master.faces.tolist() == [[4, 5, 6, 7]]
    assert again.z.tobytes() == case.z.tobytes()
