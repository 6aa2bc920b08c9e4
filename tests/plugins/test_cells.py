"""Cells agree with rational overlaps and with brute force, and bodies that must not be touched make none."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from surfaces import DEPTH, contact_forces, make_bent, make_closed, make_flat, turn

from contactverif import Interface, Surface
from contactverif_mortar import sts
from contactverif_mortar.cell_geometry import SlaveView
from contactverif_mortar.cell_search import overlap
from contactverif_mortar.integration_cells import GAP, WEIGHT, C, Cells, Quadrature

MIDPOINT = Quadrature.gauss(1, current=True)


def cells_at(interface: Interface, z: Any, averaged: bool = False) -> tuple[Cells, Any]:
    """Return the cells, and the point in the middle of each, (n_cells, 6)."""
    x = np.array(z).reshape(-1, 2)
    cells = Cells.find(interface, x, averaged)
    return cells, MIDPOINT.points(interface, cells, x[None])[0]


def in_two_chains(slave: Any, *masters: Any) -> Interface:
    """Return a slave chain over several master chains, all open."""
    sizes = [len(chain) for chain in (slave, *masters)]
    firsts = np.cumsum([0, *sizes])
    segments = [
        np.column_stack([np.arange(size - 1), np.arange(1, size)]) + first
        for size, first in zip(sizes, firsts, strict=False)
    ]
    return Interface(np.vstack([slave, *masters]), Surface(segments[0]), Surface(np.vstack(segments[1:])))


@pytest.mark.parametrize("seed", range(30))
def test_cells_of_a_flat_interface_are_the_rational_overlaps(seed: int) -> None:
    random = np.random.default_rng(seed)
    slave, master = (random.integers(1, 9, random.integers(1, 8)).tolist() for _ in range(2))
    shift = int(random.integers(-8, 9)) / 2
    interface, z = make_flat(slave, master, shift)
    cells, points = cells_at(interface, z)
    places = [Fraction(value) for value in z[::2]]
    exact = {}
    for s, (a, b) in enumerate(interface.slave.segments):
        for m, (node_1, node_2) in enumerate(interface.master.segments):
            low, high = max(places[a], places[node_2]), min(places[b], places[node_1])
            if low < high:
                exact[s, m] = high - low
    computed = dict(zip(zip(cells.slave.tolist(), cells.master.tolist(), strict=True), points, strict=True))
    assert computed.keys() == exact.keys()
    for pair, length in exact.items():
        assert computed[pair][WEIGHT] == pytest.approx(float(length), abs=1e-14)
        assert computed[pair][GAP] == -DEPTH


def test_the_search_finds_what_brute_force_finds() -> None:
    for seed in range(200):
        interface, z = make_bent(seed)
        x = z.reshape(-1, 2)
        cells, points = cells_at(interface, z)
        assert np.all(np.abs(points[:, C]) < 1)
        t = np.diff(x[interface.slave.segments], axis=1)[:, 0]
        t /= np.linalg.norm(t, axis=1)[:, None]
        expected = []
        for s, (a, b) in enumerate(interface.slave.segments):
            n = (t[s, 1], -t[s, 0])
            view = SlaveView(tuple(x[a]), tuple(x[b]), n, n, straight=True)
            every = [overlap(view, *map(tuple, x[m])) for m in interface.master.segments]
            expected += [(s, m) for m, (low, high) in enumerate(every) if low < high]
        # On these surfaces no master lies behind another and none is far away.
        assert sorted(zip(cells.slave, cells.master, strict=True)) == expected


def test_the_far_side_of_a_ring_is_not_touched() -> None:
    angle = np.linspace(0, 2 * np.pi, 25)[:-1]
    inner = 1.05 * np.column_stack([np.cos(angle), np.sin(angle)])  # a disc, pressed into the hole
    hole = np.column_stack([np.cos(angle + 0.1), np.sin(angle + 0.1)])[::-1]
    interface = make_closed(inner, hole)
    for here in (interface, interface.swap_roles()):
        _, points = cells_at(here, here.nodes)
        assert len(points) >= 24
        assert np.abs(points[:, GAP]).max() < 0.2


def test_of_two_bodies_one_behind_the_other_the_first_is_touched() -> None:
    top, behind = np.array([[4.0, 0], [2, 0], [-1, 0]]), np.array([[5.0, -0.3], [1.5, -0.3], [-2, -0.3]])
    slave = np.array([[0.0, -0.1], [3, -0.1]])
    for order in ((top, behind), (behind, top)):
        interface = in_two_chains(slave, *order)
        cells, points = cells_at(interface, interface.nodes)
        assert points[:, GAP] == pytest.approx(-0.1)
        assert interface.nodes[interface.master.segments[cells.master], 1] == pytest.approx(0.0)
        assert points[:, WEIGHT].sum() == pytest.approx(3.0)


def test_a_penetration_of_two_segments_is_contact_and_a_floor_far_below_is_none() -> None:
    interface, _ = make_flat([1.0] * 6, [1.0] * 6)
    for depth, n_cells in ((2.0, 6), (3.9, 6), (-3.9, 6), (4.1, 0), (-4.1, 0)):
        x = interface.nodes.copy()
        x[:7, 1] = -depth
        cells, _ = cells_at(interface, x)
        assert len(cells.slave) == n_cells


def test_what_faces_away_or_stands_edge_on_is_no_cell() -> None:
    for master in ([[0.0, 0.1], [2, 0.1]], [[1.0, 0.5], [1.0, -0.5]], [[1.0, -0.5], [1.0, 0.5]]):
        interface = Interface.from_chains([[0.0, 0], [2, 0]], master)
        assert not len(cells_at(interface, interface.nodes)[0].slave)
        assert not contact_forces(sts(penalty=1.0), interface, interface.nodes.ravel()).any()


def test_a_corner_keeps_its_own_normals_and_a_facet_has_an_averaged_one() -> None:
    slave = np.array([[0.0, 1], [0, 0], [2, 0], [3, 0.5]])  # a right angle, then a bend
    master = np.array([[4.0, 0.1], [-1, 0.1]])
    interface = Interface.from_chains(slave, master)
    cells, _ = cells_at(interface, interface.nodes, averaged=True)
    assert cells.before.tolist() == [-1, -1, 1]
    assert cells.behind.tolist() == [-1, 2, -1]


def test_with_averaged_normals_a_cell_ends_where_a_slave_point_sees_the_master_node() -> None:
    cuts = 0
    ends = Quadrature(np.array([-1.0, 1.0]), np.array([0.5, 0.5]), current=True)
    for seed in range(50):
        interface, z = make_bent(seed)
        cells, _ = cells_at(interface, z, averaged=True)
        points = ends.points(interface, cells, z.reshape(1, -1, 2))[0].reshape(-1, 2, 6)
        for cell, (low, high) in enumerate(points):
            for cut, point, xi in ((cells.cut_low, low, 1.0), (cells.cut_high, high, 0.0)):
                assert abs(point[C]) <= 1 + 1e-14
                if cut[cell]:
                    assert point[1] == pytest.approx(xi, abs=1e-13)
                    cuts += 1
                else:
                    assert -1e-14 <= point[1] <= 1 + 1e-14
    assert cuts > 100


def test_where_averaged_directions_have_crossed_nothing_is_seen_however_all_is_turned() -> None:
    """A hollow slave far behind the master: the directions of its middle segment cross before they are there."""
    slave = np.array([[0.0, 0.0], [5.417, -4.545], [9.576, -6.189], [12.951, 1.133]])
    master = np.array([[8.841, 1.8], [1.868, 1.19]])
    interface = Interface.from_chains(slave, master)
    expected, _ = cells_at(interface, interface.nodes, averaged=True)
    assert 1 not in expected.slave
    for angle in np.linspace(0.1, 6.2, 20):
        cells, _ = cells_at(interface, turn(interface.nodes, angle) + [30, -70], averaged=True)
        assert cells.slave.tolist() == expected.slave.tolist()
        assert cells.master.tolist() == expected.master.tolist()
