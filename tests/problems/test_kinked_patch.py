"""The uniform state of two blocks on a broken line."""

from dataclasses import replace

import numpy as np
import pytest

from contactverif.contract.errors import MisuseError
from contactverif.problems.kinked_patch import KinkedPatch, exact_unknowns, kinked_patch, patch_of
from contactverif.problems.uniform_stress import uniform_forces

ROOF = KinkedPatch(line=((0.0, 0.0), (4.0, 3.0), (8.0, 0.0)), pressure=1e-3)


@pytest.mark.parametrize("upper_slave", [True, False])
def test_the_uniform_state_has_the_exact_stress_and_needs_the_exact_forces(upper_slave: bool) -> None:
    scene = kinked_patch(ROOF, upper_slave=upper_slave)
    q = exact_unknowns(ROOF, scene, 0.01)
    for stresses in scene.stresses(q):
        np.testing.assert_allclose(stresses / ROOF.pressure, np.broadcast_to([-1, -1, 0], stresses.shape), atol=1e-10)
    np.testing.assert_allclose(scene.nodal_forces(q), uniform_forces(scene.interface, ROOF.pressure), atol=1e-12)


@pytest.mark.parametrize("upper_slave", [True, False])
def test_every_facet_of_the_uniform_state_penetrates_by_as_much(upper_slave: bool) -> None:
    scene = kinked_patch(ROOF, upper_slave=upper_slave)
    x = scene.positions(exact_unknowns(ROOF, scene, 0.01)).reshape(-1, 2)
    n_slave = scene.interface.n_slave_nodes
    upper, lower = (x[:n_slave], x[n_slave:]) if upper_slave else (x[n_slave:], x[:n_slave])
    for facet, normal in enumerate(ROOF.normals):
        part = slice(None, 4) if facet == 0 else slice(4, None)  # The kink of the upper block is node 4.
        level = (lower[0 if facet == 0 else -1]) @ normal
        np.testing.assert_allclose(upper[part] @ normal - level, -0.01, atol=1e-15)


def test_nodes_of_both_meshes_lie_at_the_kink_and_nowhere_else_on_one_another() -> None:
    upper, lower = (body.nodes[body.contact_nodes] for body in kinked_patch(ROOF).bodies)
    common = {tuple(place) for place in upper.tolist()} & {tuple(place) for place in lower.tolist()}
    assert common == set(ROOF.line)


def test_a_cut_kink_has_a_third_normal() -> None:
    cut = ROOF.cut(0.25)
    assert cut.line == ((0.0, 0.0), (3.0, 2.25), (5.0, 2.25), (8.0, 0.0))
    assert len(cut.normals) == 3
    assert np.abs(cut.normals @ cut.translation(0.1) + 0.1).max() > 1e-3  # No translation penetrates all three alike.
    assert np.abs(ROOF.normals @ ROOF.translation(0.1) + 0.1).max() < 1e-15
    with pytest.raises(MisuseError, match="two facets"):
        cut.cut()


def test_the_sharpest_kink_is_the_tangent_of_half_its_angle() -> None:
    right = replace(ROOF, line=((0.0, 0.0), (1.0, 1.0), (2.0, 0.0)))
    assert right.sharpest == pytest.approx(1.0)
    assert ROOF.sharpest == pytest.approx(0.75)


@pytest.mark.parametrize("upper_slave", [True, False])
def test_a_case_tells_its_problem(upper_slave: bool) -> None:
    case = kinked_patch(ROOF, upper_slave=upper_slave, penalty=10.0).case()
    assert patch_of(case) == (ROOF, upper_slave)
