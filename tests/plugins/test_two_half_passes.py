"""Mortar in two half passes: what passes the patch test without cells, what does not, and why."""

from typing import Any

import numpy as np
import pytest
from surfaces import DEPTH, make_bent, make_flat

from contactverif import Interface, Surface
from contactverif.oracle.flat_answers import uniform_pressure_weights
from contactverif_mortar import integration_cells as cells_module
from contactverif_mortar import mortar, mortar_two_half_pass
from contactverif_mortar.integration_cells import WEIGHT, Cells, Quadrature, Ranges
from contactverif_mortar.shape_rows import Shapes

CASE_C = [2.0, 2.0, 4.0, 4.0], [3.0, 3.0, 3.0, 3.0]
TWO, FIVE = (Quadrature.gauss(n, current=True) for n in (2, 5))


def exact_forces(interface: Interface, z: Any) -> Any:
    """Return the residual (n_nodes,) across the surface of a pressure DEPTH."""
    side = np.where(np.arange(interface.n_nodes) < interface.n_slave_nodes, -1.0, 1.0)
    return DEPTH * side * uniform_pressure_weights(interface, z[::2])


def classical_forces(interface: Interface, z: Any, rule: Quadrature) -> Any:
    """Return the forces (n_nodes, 2) of one classical pass at the points of covered ranges, for a pressure DEPTH."""
    x = z.reshape(1, -1, 2)
    ranges = Ranges.find(interface, x[0], Cells.find(interface, x[0], averaged=False), rule)
    points = rule.points(interface, ranges, x)
    pressure = Shapes.standard(points).values.sum(axis=-1) * DEPTH
    return cells_module.forces(points, pressure, ranges.local_nodes(interface), interface.n_nodes)[0]


def forces(formulation: Any, interface: Interface, z: Any) -> Any:
    return formulation.residual(interface, formulation.pair(interface, z), z).reshape(-1, 2)


@pytest.mark.parametrize("lengths", [CASE_C, ([5.0], [1.0, 3.0, 1.0]), ([1.0, 3.0, 1.0], [5.0])])
def test_a_uniform_pressure_is_exact_without_cells(lengths: tuple[list[float], list[float]]) -> None:
    interface, z = make_flat(*lengths)
    computed = forces(mortar_two_half_pass(penalty=1.0), interface, z)
    assert computed[:, 1] == pytest.approx(exact_forces(interface, z), abs=1e-15)


@pytest.mark.parametrize("rule", [TWO, FIVE])
def test_the_classical_mortar_is_not(rule: Quadrature) -> None:
    interface, z = make_flat(*CASE_C)
    error = classical_forces(interface, z, rule)[:, 1] - exact_forces(interface, z)
    assert np.abs(error[: interface.n_slave_nodes]).max() < 1e-14
    assert np.abs(error[interface.n_slave_nodes :]).max() > 2e-3 * DEPTH
    on_cells = forces(mortar(penalty=1.0), interface, z)[:, 1]
    assert on_cells == pytest.approx(exact_forces(interface, z), abs=1e-14)


def test_no_force_is_handed_to_the_other_body() -> None:
    """Each surface sees another gap where they are bent, so their forces do not balance."""
    formulation, imbalances = mortar_two_half_pass(penalty=1.0), []
    for seed in range(20):
        interface, z = make_bent(seed)
        residual = forces(formulation, interface, z)
        swapped = forces(formulation, interface.swap_roles(), np.roll(z, -2 * interface.n_slave_nodes))
        assert np.array_equal(
            np.roll(residual, -interface.n_slave_nodes, axis=0), swapped
        )  # No bit depends on the roles.
        imbalances.append(np.abs(residual.sum(axis=0)).max())
    assert sum(imbalance > 1e-3 for imbalance in imbalances) > 5


def test_points_of_a_range_cover_what_its_cells_cover() -> None:
    for seed in range(50):
        interface, z = make_bent(seed)
        x = z.reshape(-1, 2)
        cells = Cells.find(interface, x, averaged=False)
        ranges = Ranges.find(interface, x, cells, TWO)
        segments, n_segments = np.repeat(cells.slave, 2), len(interface.slave)
        of_cells = np.bincount(segments, TWO.points(interface, cells, x[None])[0, :, WEIGHT], n_segments)
        of_ranges = np.bincount(ranges.slave, TWO.points(interface, ranges, x[None])[0, :, WEIGHT], n_segments)
        assert of_ranges == pytest.approx(of_cells, abs=1e-13)


def test_a_hole_in_the_master_parts_a_segment_into_two_ranges() -> None:
    along = np.array([0.0, 6.0, 2.0, -1.0, 7.0, 4.0])
    x = np.column_stack([along, np.zeros(6)])
    interface = Interface(x, Surface([[0, 1]]), Surface([[2, 3], [4, 5]]))
    x[:2, 1] -= DEPTH
    ranges = Ranges.find(interface, x, Cells.find(interface, x, averaged=False), TWO)
    assert len(ranges.slave) == 4
    assert TWO.points(interface, ranges, x[None])[0, :, WEIGHT].sum() == pytest.approx(4.0)
