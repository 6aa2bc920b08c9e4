"""The factors of mortar tangents, sizes that grow too fast, and a search that stops early."""

from typing import Any

import numpy as np
import pytest
from surfaces import make_bent

import contactverif_mortar
from contactverif import Interface, MisuseError
from contactverif_mortar.cell_search import find_cells, longest_of_chain
from contactverif_mortar.integration_cells import Cells
from contactverif_mortar.node_factors import check_product

PENALTY = 8.0
ROUNDINGS = 256 * 2.0**-53  # Some hundred sums and products, each rounded once.
MORTARS = [
    ("mortar", {}),
    ("mortar", {"area": "reference"}),
    ("mortar_dual", {}),
    ("mortar_dual", {"area": "reference"}),
    ("mortar", {"normals": "averaged"}),
    ("mortar_dual", {"normals": "averaged"}),
]


def largest_error(computed: Any, expected: Any) -> float:
    return float(np.abs(computed - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize(("name", "options"), MORTARS)
def test_factors_multiply_to_the_tangent(name: str, options: dict[str, str]) -> None:
    interface, z = make_bent(2)
    plugin = getattr(contactverif_mortar, name)(penalty=PENALTY, **options)
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
        interface, z = make_one_over_many(n)
        plugin = contactverif_mortar.mortar(penalty=PENALTY)
        pairing = plugin.pair(interface, z)
        factors = plugin.factors(interface, pairing, z)
        entries.append(factors.rest.nnz + factors.left.nnz + factors.right.nnz)
        squares.append(plugin.tangent(interface, pairing, z).nnz)
    assert entries[1] <= 2 * entries[0]
    assert squares[1] >= 3.5 * squares[0]


@pytest.mark.parametrize(("name", "options"), [MORTARS[0], MORTARS[2], MORTARS[4]])
def test_a_tangent_that_fits_into_no_memory_is_refused_with_its_size(name: str, options: dict[str, str]) -> None:
    interface, z = make_one_over_many(60_000)
    plugin = getattr(contactverif_mortar, name)(penalty=PENALTY, **options)
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
