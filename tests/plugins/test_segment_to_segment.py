"""Segment-to-segment and all that integrates over the same cells: exact forces, and contact points."""

import numpy as np
import pytest
from every_formulation import bent_state, draw_multipliers, load
from surfaces import DEPTH, contact_forces, make_flat

from contactverif.oracle.flat_answers import uniform_pressure_weights_exact

PRESSURE_FROM_POSITIONS = (
    *("sts", "sts:area=reference", "chen-hisada", "mortar", "mortar:area=reference", "mortar-dual"),
    *("mortar:normals=averaged", "mortar-dual:normals=averaged,area=reference"),
)
METHODS = (
    *PRESSURE_FROM_POSITIONS,
    *("mortar-lm", "mortar-dual-lm", "mortar-lm:normals=averaged,area=reference", "mortar-dual-lm:normals=averaged"),
)


@pytest.mark.parametrize("name", PRESSURE_FROM_POSITIONS)
def test_a_uniform_pressure_is_transmitted_as_in_rationals_with_many_segments_under_one_too(name: str) -> None:
    random = np.random.default_rng(1)
    meshes = [(random.integers(1, 9, n).tolist(), random.integers(1, 9, m).tolist()) for n in (1, 4) for m in (1, 5, 9)]
    meshes += [([12.0], [0.125] * 96), ([0.125] * 96, [12.0]), ([5.0, 2.0**-18, 3.0], [2.0**-17, 20.0])]
    for slave, master in meshes:
        master = [*master, max(sum(slave) - sum(master), 1.0)]  # the slave overhangs nowhere
        interface, z = make_flat(slave, master)
        exact = uniform_pressure_weights_exact(interface, z[::2])
        forces = contact_forces(load(name, 1 / DEPTH), interface, z)
        assert np.abs(forces[:, 1]) == pytest.approx([float(value) for value in exact], abs=1e-13)


@pytest.mark.parametrize("name", METHODS)
def test_no_contact_is_no_force_and_no_error(name: str) -> None:
    formulation = load(name)
    for lift in (0.01, 100.0):
        interface, z = make_flat([2, 2], [3, 1])
        x = interface.nodes.copy()
        x[:3, 1] += lift
        n = len(draw_multipliers(formulation, interface, 0))
        z = np.append(x, np.zeros(n))
        pairing = formulation.pair(interface, z)
        assert not pairing["active"].any()
        assert not formulation.residual(interface, pairing, z).any()
        tangent = formulation.tangent(interface, pairing, z)
        assert tangent.shape == (z.size, z.size)
        assert np.linalg.matrix_rank(tangent.toarray()) == n
        formulation.contact_points(interface, pairing, z)


@pytest.mark.parametrize("name", METHODS)
def test_surfaces_that_touch_exactly_are_in_contact(name: str) -> None:
    formulation = load(name)
    interface, _ = make_flat([2, 2], [3, 1])
    multipliers = 0 * draw_multipliers(formulation, interface, 0)
    assert formulation.pair(interface, np.append(interface.nodes, multipliers))["active"].all()


@pytest.mark.parametrize("name", ["sts", "mortar", "mortar-dual"])
def test_a_half_covered_slave_pushes_with_what_is_covered(name: str) -> None:
    interface, z = make_flat([1, 4, 3], [0.5, 2], shift=2.0)  # the master covers [2, 4.5] of [0, 8]
    forces = contact_forces(load(name, 1 / DEPTH), interface, z)
    # ∫N over [2, 4.5] on the segment [1, 5], and on the master's own.
    exact = [0, 2.5 * (5 - 3.25) / 4, 2.5 * (3.25 - 1) / 4, 0, -1, -1.25, -0.25]
    assert forces[:, 1] == pytest.approx(exact, abs=1e-15)


@pytest.mark.parametrize("name", METHODS)
def test_contact_points_add_up_to_the_forces(name: str) -> None:
    formulation = load(name)
    for seed in range(20):
        interface, z = bent_state(formulation, seed, 0, 3)
        pairing = formulation.pair(interface, z)
        points = formulation.contact_points(interface, pairing, z)
        assert np.all(points.weight >= 0)
        assert np.all(points.pressure[~points.active] == 0)
        if "mortar" in name:
            assert len(points.gap) == interface.n_slave_nodes
            assert points.weighted.all()
            assert np.isfinite(points.normal[points.pressure > 0]).all()  # A node that overhangs has one too.
            continue
        assert not points.weighted.any()
        pushes = (points.pressure * points.weight)[:, None] * points.normal
        slave = contact_forces(formulation, interface, z)[: interface.n_slave_nodes].sum(axis=0)
        assert pushes.sum(axis=0) == pytest.approx(slave, rel=1e-14, abs=1e-14)
