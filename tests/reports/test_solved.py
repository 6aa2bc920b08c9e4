"""The numbers that a drawing computes from a solution: places along the interface, pressures of nodal forces."""

import numpy as np
import pytest
from handmade_scene import PRESSURE, bodies, make_solved_scene

from contactverif_reports.draw.solved_scene import PointPressures, pressures_across


@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi])
@pytest.mark.parametrize("rigid_master", [False, True])
def test_exact_consistent_forces_of_a_uniform_pressure_give_it_back(angle: float, rigid_master: bool) -> None:
    """Against forces that are written down here: a node has half of each segment beside it, master nodes of [0, 6]."""
    scene = make_solved_scene(angle=angle, rigid_master=rigid_master)
    lengths = {0: 0.5, 1: 1.5, 2: 2.5, 3: 1.5}
    masters = [1.0, 3.0, 2.0] if not rigid_master else [2.0, 3.0, 1.0]
    into_slave = bodies(angle=angle)[0].frame @ [0.0, 1.0]
    sizes = np.array([*lengths.values(), *(-value for value in masters)]) * PRESSURE
    np.testing.assert_allclose(scene.solutions[0].forces, sizes[:, None] * into_slave, atol=1e-11)
    np.testing.assert_allclose(scene.node_pressures(scene.solutions[0]), PRESSURE, rtol=1e-12)


def test_a_force_that_is_too_large_is_seen_as_it_is() -> None:
    scene = make_solved_scene()
    forces = scene.solutions[0].forces
    forces[5] *= 1.25
    pressures = scene.node_pressures(scene.solutions[0])
    assert pressures[5] == pytest.approx(1.25 * PRESSURE)
    assert np.delete(pressures, 5) == pytest.approx(PRESSURE)


def test_the_share_of_a_master_node_ends_where_the_slave_does() -> None:
    """∫ of the shape function of the node at −2 over [0, 6]: half of 2 × 1/2; and at 2: the rest of its hat."""
    shares = np.linalg.norm(make_solved_scene(wide=2.0).shares(make_solved_scene(wide=2.0).case.positions), axis=1)
    np.testing.assert_allclose(shares[4:], [0.5, 1.5 + 8 / 3, 4 / 3], rtol=1e-12)
    assert shares[4:].sum() == pytest.approx(6.0)


def test_what_lies_beyond_the_other_side_has_no_pressure() -> None:
    scene = make_solved_scene(wide=2.0)
    far = scene.case.positions.copy()
    far[:4, 0] += 3.5  # the slave now covers 3.5 to 9.5, and the first master segment ends at 2
    shares = scene.shares(far)
    assert (shares[4] == 0).all()
    assert np.linalg.norm(shares[5:], axis=1).sum() == pytest.approx(8 - 3.5)


def test_points_lie_where_they_say() -> None:
    scene = make_solved_scene()
    points = PointPressures(np.array([2, 0]), np.array([-0.5, 1.0]), np.array([[-1.0, 0.0], [np.nan, 1.0]]), np.ones(2))
    at, areas = scene.points_along(points)
    np.testing.assert_allclose(at, [3.75, 1.0])
    np.testing.assert_allclose(areas, [[3.0, 4.5], [np.nan, 1.0]])


@pytest.mark.parametrize("angle", [0.0, 0.7, np.pi / 2])
def test_the_pressure_across_is_the_same_however_a_body_is_turned(angle: float) -> None:
    scene = make_solved_scene(angle=angle)
    for body, stresses in zip(scene.bodies, scene.solutions[0].stresses, strict=True):
        np.testing.assert_allclose(pressures_across(body, stresses), PRESSURE, rtol=1e-12)
    shear = np.array([[0.0, 0.0, 3.0]])
    assert pressures_across(scene.bodies[0], shear) == pytest.approx(3.0 * np.sin(2 * angle), abs=1e-12)


def test_sides_are_told_from_the_interface() -> None:
    scene = make_solved_scene()
    assert scene.sides == ["slave", "master"]
    assert scene.size == 6.0
    assert scene.solutions[0].n_iterations == 2
