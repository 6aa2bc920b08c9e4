"""The search for cells of faces: those of an exhaustive search, within reach, and corners where edges coincide."""

import numpy as np
import pytest
from planned_cases import draw_cases

from contactverif import Interface
from contactverif.contract.arrays import FloatArray, IntArray
from contactverif.strategies.surfaces import flat_surface_cases, surface_cases, translated_surface_cases
from contactverif_surfaces.cell_points import FacePairs, SlaveView
from contactverif_surfaces.face_search import (
    TIE,
    Tree,
    find_cells,
    find_face_cells,
    grow_tree,
    longest_edges,
    tree_of_faces,
)

Cells = tuple[IntArray, IntArray]
STRATEGIES = (surface_cases, flat_surface_cases, translated_surface_cases)


def edges_of(interface: Interface, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    return longest_edges(interface.slave, x), longest_edges(interface.master, x)


def cells_by(tree: Tree, interface: Interface, x: FloatArray) -> Cells:
    return find_face_cells(x, interface.slave.faces, interface.master.faces, edges_of(interface, x), tree)


def cells_of(interface: Interface, x: FloatArray) -> Cells:
    return find_cells(x, interface.slave.faces, interface.master.faces, *edges_of(interface, x))


def everywhere(count: int) -> Tree:
    """Return a tree whose boxes hold everything, so that each pair of faces is looked at."""
    return grow_tree(np.tile([[[-1e200] * 3, [1e200] * 3]], (count, 1, 1)))


def assert_same_cells(interface: Interface, x: FloatArray) -> None:
    fast = cells_by(tree_of_faces(x, interface.master.faces), interface, x)
    slow = cells_by(everywhere(len(interface.master)), interface, x)
    assert len(fast[0])
    for mine, others in zip(fast, slow, strict=True):
        assert np.array_equal(mine, others)


def triangulate(n: int) -> IntArray:
    """Return the triangles (2 n², 3) of n × n squares, nodes numbered row by row."""
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (part.reshape(-1) for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def make_sphere(n: int, radius: float, inward: bool) -> tuple[FloatArray, IntArray]:
    """Return nodes and triangles of a closed sphere: a cube's surface of n × n squares a side, blown up."""
    place = np.linspace(-1, 1, n + 1)
    u, v = np.meshgrid(place, place, indexing="ij")
    square, points, faces = triangulate(n), [], []
    for axis in range(3):
        for side in (1.0, -1.0):
            across = np.stack([np.full(u.size, side), u.reshape(-1), v.reshape(-1)], axis=1)
            points.append(np.roll(across, axis, axis=1))
            faces.append((square if side > 0 else square[:, ::-1]) + len(faces) * u.size)
    places, numbers = np.unique(np.vstack(points), axis=0, return_inverse=True)
    triangles = numbers.reshape(-1)[np.vstack(faces)]
    places = radius * places / np.linalg.norm(places, axis=1)[:, None]
    return places, triangles[:, ::-1] if inward else triangles


def concentric_spheres(n: int) -> Interface:
    """Return a closed slave in a closed master, which is an eighth of an edge too small."""
    inner, outer = make_sphere(n, 1.0, inward=False), make_sphere(n + 1, 1 - 1 / (8 * n), inward=True)
    return Interface.from_faces(*inner, *outer)


def wavy_squares(n: int) -> Interface:
    """Return two wavy squares of 2 n² and about as many triangles that penetrate each other a little."""
    sides = []
    for count, size, height in ((n, 1.0, -0.05 / n), (n + 1, 1.05, 0.0)):
        place = np.linspace(-size / 2, size / 2, count + 1)
        u, v = (axis.reshape(-1) for axis in np.meshgrid(place, place, indexing="ij"))
        sides += [np.column_stack([u, v, height + 0.01 * np.sin(9 * u) * np.cos(7 * v)]), triangulate(count)]
    return Interface.from_faces(sides[0], sides[1][:, ::-1], sides[2], sides[3])


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_the_tree_finds_what_an_exhaustive_search_finds(strategy: object) -> None:
    for case in draw_cases(strategy(), seed="surface search", examples=60).cases:  # type: ignore[operator]
        assert_same_cells(case.interface, case.positions)
        if "shift" in case.parameters:  # Far away, by up to 2^20 in each coordinate.
            assert_same_cells(case.interface, case.positions + case.parameters["shift"])


@pytest.mark.parametrize("stretch", [1.0, 2.0**-12])
def test_closed_surfaces_and_needles_have_the_cells_of_an_exhaustive_search(stretch: float) -> None:
    spheres = concentric_spheres(4)
    assert_same_cells(spheres, spheres.nodes * [1.0, stretch, 1.0])


def test_a_translation_changes_no_cell() -> None:
    spheres = concentric_spheres(4)
    near = np.round(spheres.nodes * 2.0**24) / 2.0**24
    cells, moved = (cells_of(spheres, x) for x in (near, near + 2.0**20))
    assert np.array_equal(cells[0], moved[0])
    assert np.array_equal(cells[1], moved[1])


def test_no_corner_of_a_cell_lies_outside_its_faces() -> None:
    """A crossing of edges that coincide within roundoff could lie anywhere on their line."""
    for case in draw_cases(flat_surface_cases(), seed="surface search", examples=100).cases:  # type: ignore[arg-type]
        interface, x = case.interface, case.positions
        slave, master = interface.slave.faces, interface.master.faces
        faces, codes = cells_of(interface, x)
        view = SlaveView.of_corners(x[slave[faces[:, 0]]], x[master[faces[:, 1]]])
        corners = view.cell_corners(codes)
        rounding = 1e-12 * (1 + case.largest_coordinate / case.diameter) * case.diameter
        for side in (view.slave, view.master):
            assert (corners.min(axis=1) >= side.min(axis=1) - rounding).all()
            assert (corners.max(axis=1) <= side.max(axis=1) + rounding).all()


def test_a_master_out_of_reach_or_behind_another_makes_no_cell() -> None:
    near = wavy_squares(3)
    x, n_slave = near.nodes, near.n_slave_nodes
    before = cells_of(near, x)
    edge = sum(float(edges.max()) for edges in edges_of(near, x))
    for distance in (0.5, 1.9, 2.1, 64.0):
        for side in (1.0, -1.0):  # The slave's body is above.
            layer = x[n_slave:] + [0.0, 0.0, side * distance * edge]
            both = Interface.from_faces(
                x[:n_slave], near.slave.faces, np.vstack([x[n_slave:], layer]),
                np.vstack([near.master.faces, near.master.faces + len(layer)]) - n_slave,
            )  # fmt: skip
            cells = cells_of(both, both.nodes)
            assert np.array_equal(cells[0], before[0])
            assert np.array_equal(cells[1], before[1])
            alone = Interface.from_faces(x[:n_slave], near.slave.faces, layer, near.master.faces - n_slave)
            assert bool(len(cells_of(alone, alone.nodes)[0])) == (distance < 2)


@pytest.mark.parametrize("near", [-1.5, -0.9, -0.5, 0.0, 0.5, 0.9, 1.5])
@pytest.mark.parametrize("far", [-3.0, -1.1, -0.7, 0.3, 0.7, 1.1, 3.0])
def test_edges_that_nearly_coincide_have_no_crossing_far_from_both(near: float, far: float) -> None:
    """The master's lower edge lies so many ties above that of the slave: with one end near, the other far.

    A crossing where both ends lie on one side, or within a tie, would be a quotient of two roundoffs.
    """
    slave = [[0.0, 0, 0], [1, 0, 0], [0.3, 0.8, 0]]
    master = [[0.25, near * TIE, 0], [0.75, far * TIE, 0], [0.4, 0.9, 0]]
    meshes = Interface.from_faces(slave, [[0, 2, 1]], master, [[0, 1, 2]])
    pairs = FacePairs.find(meshes, meshes.nodes.reshape(-1))
    corners = pairs.corners_at(meshes.nodes.reshape(-1))
    plane = SlaveView.of_corners(corners[:, :3], corners[:, 3:])
    cell = plane.cell_corners(pairs.codes)[0]
    both = np.concatenate([plane.slave[0], plane.master[0]])
    assert (cell >= both.min(axis=0)).all()
    assert (cell <= both.max(axis=0)).all()
    before, after = cell - np.roll(cell, 1, axis=0), np.roll(cell, -1, axis=0) - cell
    assert (before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0] >= -8 * TIE).all()
