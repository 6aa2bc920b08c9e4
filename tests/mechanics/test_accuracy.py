"""The error measures of `contactverif.mechanics.accuracy` are exact where the answer is known by hand."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from subjects import load_subject

from contactverif import ContactPoints, Interface, load_scene
from contactverif.mechanics.accuracy import (
    displacement_error,
    fit_rate,
    force_error,
    pressure_error,
    shape_integrals,
    solve_for_accuracy,
    traction_forces,
)

INTERFACE = Interface.from_chains([[0, 0], [1, 0], [3, 0]], [[3, 0], [0, 0]])


def test_shape_integrals_are_half_of_each_segment_beside_a_node() -> None:
    assert shape_integrals(INTERFACE.slave, INTERFACE.nodes).tolist() == [0.5, 1.5, 1, 0, 0]
    assert shape_integrals(INTERFACE.master, INTERFACE.nodes).tolist() == [0, 0, 0, 1.5, 1.5]


def test_forces_of_a_linear_traction_are_those_computed_by_hand() -> None:
    forces = traction_forces(INTERFACE.slave, INTERFACE.nodes, lambda x: np.stack([x[:, 0], np.ones(len(x))], axis=1))
    expected = [[1 / 6, 0.5], [1 / 3 + 5 / 3, 1.5], [7 / 3, 1], [0, 0], [0, 0]]
    np.testing.assert_allclose(forces, expected, rtol=1e-14)


def test_parts_integrate_a_traction_that_jumps_inside_a_segment() -> None:
    step = lambda x: np.stack([0 * x[:, 0], np.where(x[:, 0] < 0.5, 1.0, 0.0)], axis=1)  # noqa: E731
    forces = traction_forces(INTERFACE.slave, INTERFACE.nodes, step, parts=2)
    np.testing.assert_allclose(forces[:, 1], [3 / 8, 1 / 8, 0, 0, 0], rtol=1e-14)


def test_one_wrong_force_counts_over_the_share_of_its_node() -> None:
    exact = np.array([[0, 0.5], [0, 1.5], [0, 1.0], [9, 9], [9, 9]])  # A unit pressure on the slave alone
    wrong = exact + [[0, 0], [0, 0.15], [0, 0], [5, 5], [5, 5]]
    error = force_error(wrong, exact, shape_integrals(INTERFACE.slave, INTERFACE.nodes))
    assert error == pytest.approx(np.sqrt(0.15**2 / 1.5 / 3))


def test_the_error_of_displacements_is_that_of_linear_interpolation() -> None:
    displacements = np.zeros((5, 2))
    displacements[:3, 1] = INTERFACE.nodes[:3, 0] ** 2
    error = displacement_error(
        INTERFACE.slave, INTERFACE.nodes, displacements, lambda x: np.stack([0 * x[:, 0], x[:, 0] ** 2], axis=1)
    )
    assert error == pytest.approx(np.sqrt((1 + 2**5) / 30 / (3**5 / 5)))


@pytest.mark.parametrize(
    "name", ["vts-ppt", "sts", "mortar", "mortar-dual-lm", "chen-hisada", "mortar:normals=averaged"]
)
def test_a_solved_patch_test_has_no_error_by_any_measure(name: str) -> None:
    solution = solve_for_accuracy(load_scene("c-prime:penalty=1e5"), load_subject(name))
    interface, positions = solution.interface, solution.state.positions
    assert solution.balanced
    exact = traction_forces(interface.slave, positions, lambda x: np.tile([0.0, 100.0], (len(x), 1)))
    assert force_error(solution.forces, exact, shape_integrals(interface.slave, positions)) < 1e-10
    assert pressure_error(solution, lambda x: np.full(len(x), 100.0), 100.0) < 1e-9


def test_a_nodal_force_counts_as_a_pressure_over_the_share_of_its_node() -> None:
    solution = solve_for_accuracy(load_scene("a1"), load_subject("nts-lm"))
    assert pressure_error(solution, lambda x: np.full(len(x), 100.0), 100.0) < 1e-10


def test_pressures_of_two_passes_and_of_a_plugin_without_points_are_not_measured() -> None:
    both = solve_for_accuracy(load_scene("a1"), load_subject("two-pass/nts-ar"))
    assert pressure_error(both, lambda x: np.ones(len(x)), 1.0) is None
    assert pressure_error(replace(both, points=None), lambda x: np.ones(len(x)), 1.0) is None


def test_points_count_with_their_own_weights_and_idle_ones_carry_nothing() -> None:
    solution = solve_for_accuracy(load_scene("a1"), load_subject("sts"))
    points = _points([1.0, 1.0, 7.0], weight=[1.0, 3.0, 0.0], active=[True, False, True])
    error = pressure_error(replace(solution, points=points), lambda x: np.ones(len(x)), 0.5)
    assert error == pytest.approx(np.sqrt(3 / 4) / 0.5)
    nothing = _points([1.0], weight=[0.0], active=[True])
    assert pressure_error(replace(solution, points=nothing), lambda x: np.ones(len(x)), 1.0) == np.inf


def _points(pressure: Any, weight: Any, active: Any) -> ContactPoints:
    n = len(pressure)
    segment, zero, place = np.zeros(n, np.int64), np.zeros(n), np.zeros((n, 2))
    numbers = (np.array(pressure), np.array(weight), np.array(active))
    return ContactPoints(segment, zero, segment, zero, place, place, zero, *numbers, zero, zero)


def test_a_rate_is_fitted_to_errors_above_zero() -> None:
    sizes = np.array([1, 1 / 2, 1 / 4, 1 / 8])
    assert fit_rate(sizes, sizes**1.5) == pytest.approx(1.5)
    assert fit_rate(sizes, np.where(sizes > sizes.min(), sizes**2, 0.0)) == pytest.approx(2)
    assert fit_rate(sizes, np.zeros(4)) == np.inf
    assert np.isnan(fit_rate(sizes, [1.0, np.nan, 1.0, 1.0]))
