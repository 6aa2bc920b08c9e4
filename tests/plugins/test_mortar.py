"""Mortar: weighted gaps, multipliers, normals, the factors of its tangents, and a search that stops early."""

from typing import Any

import numpy as np
import pytest
from every_formulation import load
from surfaces import DEPTH, contact_forces, make_bent, make_flat

from contactverif import Interface, MisuseError
from contactverif.oracle.flat_answers import uniform_pressure_weights
from contactverif_mortar.cell_search import find_cells, longest_of_chain
from contactverif_mortar.integration_cells import Cells
from contactverif_mortar.node_factors import check_product
from contactverif_mortar.shape_rows import UNCOVERED

ROUNDINGS = 256 * 2.0**-53  # Some hundred sums and products, each rounded once.
MORTARS = (
    *("mortar", "mortar:area=reference", "mortar-dual", "mortar-dual:area=reference"),
    *("mortar:normals=averaged", "mortar-dual:normals=averaged"),
)


@pytest.mark.parametrize("name", ["mortar", "mortar-dual"])
def test_forces_are_as_small_as_a_sliver_down_to_roundoff(name: str) -> None:
    for exponent in range(1, 60):
        length = 2.0**-exponent
        interface, z = make_flat([4.0], [3.0], shift=length - 3.0)
        forces = contact_forces(load(name, 1 / DEPTH), interface, z)
        exact = [length - length**2 / 8, length**2 / 8]
        assert forces[:2, 1] == pytest.approx(exact, rel=1e-15 / length + 1e-12, abs=2 * UNCOVERED)
        tangent = load(name).tangent(interface, load(name).pair(interface, z), z)
        assert np.isfinite(tangent.toarray()).all()


@pytest.mark.parametrize("name", ["mortar", "mortar-dual"])
def test_the_weighted_gap_of_a_linear_gap_is_what_the_shapes_make_of_it(name: str) -> None:
    """On one whole segment with g = a at A and b at B: (2a + b)/3 with standard shapes, a itself with dual ones."""
    interface, _ = make_flat([3.0], [1.0, 1.0, 1.0])
    x = interface.nodes.copy()
    x[2:, 1] = 0.25 + 0.125 * x[2:, 0]  # g = −(0.25 + 0.125 x) against a level slave
    formulation = load(name, 1.0)
    gaps = formulation.contact_points(interface, formulation.pair(interface, x.ravel()), x.ravel()).gap
    exact = [-0.375, -0.5] if name == "mortar" else [-0.25, -0.625]
    assert gaps == pytest.approx(exact, abs=1e-15)


def test_a_dual_pressure_moves_no_other_slave_node_also_where_a_segment_is_covered_in_part() -> None:
    formulation = load("mortar-dual-lm", 1.0)
    slivers = [make_flat([4.0], [3.0], shift=2.0**-exponent - 3.0) for exponent in (1, 4, 8, 12)]
    for interface, z in (*map(make_bent, range(60)), *slivers):
        n = interface.n_slave_nodes
        full = np.append(z, np.ones(n))
        pairing = formulation.pair(interface, full)
        tangent = formulation.tangent(interface, pairing, full).toarray()
        coupling = np.abs(tangent[: interface.n_unknowns, interface.n_unknowns :]).reshape(-1, 2, n).max(axis=1)[:n]
        assert coupling - np.diag(np.diag(coupling)) == pytest.approx(0.0, abs=1e-13)


@pytest.mark.parametrize("name", ["mortar-lm", "mortar-dual-lm"])
def test_constraint_rows_are_weighted_gaps_where_active_and_multipliers_where_not(name: str) -> None:
    formulation = load(name, 2.0)
    interface, z = make_flat([2, 4, 2], [3, 2], shift=0.0)  # the last node overhangs with all around it
    multipliers = np.array([1.0, 2.0, 3.0, 5.0])
    full = np.append(z, multipliers)
    pairing = formulation.pair(interface, full)
    assert pairing["active"].tolist() == [True, True, True, False]
    rows = formulation.residual(interface, pairing, full)[interface.n_unknowns :]
    covered = [1.0, 1 + 3 - 3**2 / 8, 3**2 / 8]  # ∫N over [0, 5]
    assert rows == pytest.approx([*(DEPTH * np.array(covered)), 5.0 * 1.0], abs=1e-15)


def test_a_node_is_active_where_its_multiplier_outweighs_its_gap() -> None:
    formulation = load("mortar-lm", 2.0)
    interface, _ = make_flat([2.0], [3.0], shift=-0.5)
    x = interface.nodes.copy()
    x[:2, 1] += DEPTH  # open
    for multiplier, active in ((2 * DEPTH, True), (1.9 * DEPTH, False), (-1.0, False)):
        pairing = formulation.pair(interface, np.append(x, [multiplier, 3.0]))
        assert pairing["active"].tolist() == [active, True]
    x[:2, 1] -= 2 * DEPTH
    assert formulation.pair(interface, np.append(x, [-2 * DEPTH, -2.1 * DEPTH]))["active"].tolist() == [True, False]


@pytest.mark.parametrize("name", ["mortar-lm", "mortar-dual-lm"])
def test_uniform_multipliers_give_the_consistent_forces(name: str) -> None:
    for slave, master in (
        ([2, 2], [4]),
        ([2, 2, 4, 4], [3, 3, 4, 2]),
        ([2, 2, 4, 4], [3, 3, 3, 3]),
        ([12], [0.5] * 24),
    ):
        interface, z = make_flat(slave, master)
        forces = contact_forces(load(name, 1.0), interface, np.append(z, np.ones(interface.n_slave_nodes)))
        assert np.abs(forces[:, 1]) == pytest.approx(uniform_pressure_weights(interface, z[::2]), abs=1e-14)


def make_kinked(n_slave: int, n_master: int) -> Interface:
    """Two surfaces that lie on each other, with nodes of both at the kinks and none together in between."""
    corners = np.array([[0.0, 0.0], [2, 0], [4, 1], [6, 0.25], [8, 0.25]])

    def refine(n: int) -> Any:
        share = np.arange(n) / n
        inner = corners[:-1, None] + share[:, None] * np.diff(corners, axis=0)[:, None]
        return np.vstack([inner.reshape(-1, 2), corners[-1:]])

    return Interface.from_chains(refine(n_slave), refine(n_master)[::-1])


@pytest.mark.parametrize("name", ["mortar-lm", "mortar-dual-lm"])
@pytest.mark.parametrize("normals", ["segment", "averaged"])
def test_a_hydrostatic_pressure_on_a_kinked_surface(name: str, normals: str) -> None:
    """∫ N p n on both sides; averaged normals are not those of the surface."""
    interface = make_kinked(3, 4)
    exact = np.zeros((interface.n_nodes, 2))
    for side in (interface.slave, interface.master):
        along = np.diff(interface.nodes[side.segments], axis=1)[:, 0]
        for end in range(2):
            np.add.at(exact, side.segments[:, end], np.column_stack([-along[:, 1], along[:, 0]]) / 2)
    z = np.append(interface.nodes, np.ones(interface.n_slave_nodes))
    forces = contact_forces(load(f"{name}:normals={normals}", 1.0), interface, z)
    error = np.abs(forces - exact).max() / np.abs(exact).max()
    assert error < 1e-14 if normals == "segment" else error > 0.05


def test_averaged_normals_differ_on_bent_surfaces_and_not_on_flat_ones() -> None:
    interface, z = make_flat([2, 2, 4], [3, 5])
    same = [contact_forces(load(f"mortar:normals={normals}", 1.0), interface, z) for normals in ("segment", "averaged")]
    assert same[0] == pytest.approx(same[1], abs=1e-14)
    differs = 0
    for seed in range(30):
        interface, z = make_bent(seed)
        first, other = (
            contact_forces(load(f"mortar:normals={normals}", 1.0), interface, z) for normals in ("segment", "averaged")
        )
        differs += not np.allclose(first, other, rtol=1e-3)
    assert differs > 15


def test_a_node_that_is_covered_by_roundoff_alone_is_not() -> None:
    for length, covered in ((np.sqrt(16 * UNCOVERED) * 2, True), (np.sqrt(16 * UNCOVERED) / 2, False)):
        interface, z = make_flat([4.0], [3.0], shift=length - 3.0)
        assert load("mortar", 1.0).pair(interface, z)["active"].tolist() == [True, covered]
        full = np.append(z, [1.0, 1.0])
        pairing = load("mortar-lm", 1.0).pair(interface, full)
        tangent = load("mortar-lm", 1.0).tangent(interface, pairing, full).toarray()
        assert np.abs(tangent[-1]).max() > UNCOVERED  # its row is a row


def largest_error(computed: Any, expected: Any) -> float:
    return float(np.abs(computed - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize("name", MORTARS)
def test_factors_multiply_to_the_tangent(name: str) -> None:
    plugin, (interface, z) = load(name), make_bent(2)
    pairing = plugin.pair(interface, z)
    tangent, factors = plugin.tangent(interface, pairing, z).toarray(), plugin.factors(interface, pairing, z)
    assert largest_error(factors.assemble().toarray(), tangent) <= ROUNDINGS
    product = np.column_stack([factors @ direction for direction in np.eye(z.size)])
    assert largest_error(product, tangent) <= ROUNDINGS


def make_one_over_many(n_master: int) -> tuple[Interface, Any]:
    """Return one slave segment over many master segments, pressed into them."""
    master = np.column_stack([np.linspace(1, 0, n_master + 1), np.zeros(n_master + 1)])
    interface = Interface.from_chains([[0, -1e-3], [1, -1e-3]], master)
    return interface, interface.nodes.ravel()


def test_factors_grow_with_the_cells_and_the_assembled_tangent_with_their_square() -> None:
    entries, squares = [], []
    for n in (50, 100):
        plugin, (interface, z) = load("mortar"), make_one_over_many(n)
        pairing = plugin.pair(interface, z)
        factors = plugin.factors(interface, pairing, z)
        entries.append(factors.rest.nnz + factors.left.nnz + factors.right.nnz)
        squares.append(plugin.tangent(interface, pairing, z).nnz)
    assert entries[1] <= 2 * entries[0]
    assert squares[1] >= 3.5 * squares[0]


@pytest.mark.parametrize("name", MORTARS[::2])
def test_a_tangent_that_fits_into_no_memory_is_refused_with_its_size(name: str) -> None:
    plugin, (interface, z) = load(name), make_one_over_many(60_000)
    pairing = plugin.pair(interface, z)
    with pytest.raises(MisuseError, match=r"tangent: found about 161 GiB .* 60003 nodes .* at most 32 GiB; use"):
        plugin.tangent(interface, pairing, z)
    assert np.isfinite(plugin.factors(interface, pairing, z) @ z).all()
    check_product(np.zeros(3, dtype=np.int64))  # No node is active.


@pytest.mark.parametrize("n_finer", [72, 400])
@pytest.mark.parametrize("finer_is_slave", [False, True])
@pytest.mark.parametrize("averaged", [False, True])
def test_a_search_that_stops_early_finds_the_cells_of_one_that_looks_at_all(
    averaged: bool, finer_is_slave: bool, n_finer: int
) -> None:
    """Two turns of a spiral, its two sides being the surfaces: the outer turn is behind the inner one."""
    angle = np.linspace(0, 4 * np.pi, 61)
    radius = 1 + 0.04 * angle
    outline = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    finer = np.column_stack([np.interp(np.linspace(0, 60, n_finer), np.arange(61), 1.01 * axis) for axis in outline.T])
    interface = Interface.from_chains(*((finer, outline[::-1]) if finer_is_slave else (outline, finer[::-1])))
    x = interface.nodes
    cells = Cells.find(interface, x, averaged)
    order, n = interface.master.chain_order, len(interface.master)
    one_box = (np.append(order, [-1] * (4 - n % 4)) if n % 4 else order, np.tile([-10.0, -10.0, 10.0, 10.0], (256, 1)))
    slaves = interface.slave.segments, cells.before, cells.behind, longest_of_chain(interface.slave, x)
    masters = interface.master.segments, longest_of_chain(interface.master, x)
    everything = find_cells(x, slaves, masters, one_box)
    assert len(cells.slave) > 60
    for computed, expected in zip((cells.slave, cells.master, cells.cut_low, cells.cut_high), everything, strict=True):
        assert np.array_equal(computed, expected)
