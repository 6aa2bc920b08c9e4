"""Surfaces in space are either right or refused with one clear line; their areas and heights are those of geometry."""

from collections.abc import Callable

import numpy as np
import pytest

from contactverif import Case, Interface, MisuseError, Rules, Subject, Surface, Traits

SQUARE = np.array([[0.0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]])
BELOW = SQUARE - [0, 0, 1]
TRIANGLES = [[0, 2, 1], [0, 3, 2]]  # Seen from below, since the slave body is on top.
PAIR = Interface.from_faces(SQUARE, TRIANGLES, BELOW, [[0, 1, 2, 3]])


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
    assert (PAIR.dim, PAIR.n_nodes, PAIR.n_slave_nodes, PAIR.n_unknowns) == (3, 8, 4, 24)
    assert PAIR.master.faces.tolist() == [[4, 5, 6, 7]]
    assert PAIR.slave.measures(PAIR.nodes).tolist() == [1, 1]
    assert PAIR.master.measures(PAIR.nodes) == pytest.approx([2])
    twice = PAIR.swap_roles().swap_roles()
    assert np.array_equal(twice.nodes, PAIR.nodes)
    assert np.array_equal(twice.slave.faces, PAIR.slave.faces)
    assert PAIR.at(2 * PAIR.nodes).slave is PAIR.slave


def test_segments_have_faces_and_lengths_as_measures() -> None:
    plane = Interface.from_chains([[0, 0], [1, 0], [3, 0]], [[4, 0], [0, 0]])
    assert plane.slave.faces is plane.slave.segments
    for measure in (plane.slave.measures, plane.slave.heights):
        assert measure(plane.nodes).tobytes() == plane.slave.lengths(plane.nodes).tobytes()
    with pytest.raises(MisuseError, match="segments: found faces of 3 corners; needed `faces` of a surface in space"):
        _ = PAIR.slave.segments


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
    assert PAIR.master.heights(PAIR.nodes) == pytest.approx([1.0])


SURFACES = {
    "negative": ([[0, 1, -1]], "faces: found node number -1; needed node numbers ≥ 0"),
    "twice": ([[0, 1, 2], [1, 3, 1]], r"faces: found face 1 with the corners \[1, 3, 1\]; needed different corners"),
    "three on an edge": (
        [[0, 1, 2], [1, 0, 3], [0, 1, 4]],
        r"faces: found faces 0, 1, 2 on the edge \[0, 1\]; needed a surface",
    ),
    "turned": (
        [[0, 1, 2], [0, 1, 3]],
        r"faces: found faces 0 and 1, which both run along the edge \[0, 1\]; needed corners counter-clockwise",
    ),
}


@pytest.mark.parametrize(("faces", "message"), SURFACES.values(), ids=SURFACES)
def test_wrong_surfaces_in_space(faces: list[list[int]], message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        Surface(faces)


def pair(slave: np.ndarray, faces: list[list[int]]) -> Interface:
    return Interface.from_faces(slave, faces, BELOW, [[0, 1, 2, 3]])


LINE = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
DART = np.array([[0.0, 0, 0], [2, 0, 0], [0.5, 0.5, 0], [0, 2, 0]])
INTERFACES: dict[str, tuple[Callable[[], Interface], str]] = {
    "no area": (lambda: pair(LINE, [[0, 1, 2]]), "slave: found face 0 of no area; needed corners"),
    "dart": (
        lambda: pair(DART, [[0, 1, 2, 3]]),
        "slave: found face 0, a quadrilateral that is not convex",
    ),
    "plane": (lambda: pair(SQUARE[:, :2], TRIANGLES), r"slave: found an array of shape \(4, 2\); needed shape \(n_po"),
    "coincident": (
        lambda: pair(np.vstack([SQUARE, SQUARE[:1]]), [[0, 2, 1], [4, 3, 2]]),
        r"slave: found coincident nodes 0, 4 at \(0.0, 0.0, 0.0\)",
    ),
    "faces in the plane": (
        lambda: Interface(SQUARE[:, :2], Surface([[0, 1, 2]]), Surface([[3, 4, 5]])),
        "slave: found faces of 3 corners and nodes with 2 coordinates; needed segments in the plane",
    ),
    "unused": (lambda: pair(np.vstack([SQUARE, [[9.0, 9, 9]]]), TRIANGLES), "master: found nodes 5, 6, 7, 8; needed"),
}


@pytest.mark.parametrize(("make", "message"), INTERFACES.values(), ids=INTERFACES)
def test_wrong_interfaces_in_space(make: Callable[[], Interface], message: str) -> None:
    with pytest.raises(MisuseError, match=message):
        make()


def test_a_case_in_space_has_heights_areas_and_faces_in_its_lengths() -> None:
    case = Case(PAIR, PAIR.nodes.reshape(-1), penalty=8.0)
    assert case.shortest_segment == pytest.approx(2 / np.sqrt(5))  # The height of a triangle over its diagonal.
    assert case.slave_length == pytest.approx(np.sqrt(2))
    assert case.n_segments == 3
    again = Case.from_arrays(case.to_arrays())
    assert again.interface.master.faces.tolist() == [[4, 5, 6, 7]]
    assert again.z.tobytes() == case.z.tobytes()


def test_a_nodal_penalty_is_the_stiffness_of_the_area_of_a_node() -> None:
    class Nodal:
        traits = Traits(rules=Rules(penalty="nodal"))

        def residual(self, interface: Interface, pairing: object, z: np.ndarray) -> np.ndarray:
            return 0 * z

    case = Case(PAIR, PAIR.nodes.reshape(-1), penalty=8.0)
    assert Subject("nodal", lambda *, penalty: Nodal()).penalty(case) == pytest.approx(8.0 * 2 / 4)
