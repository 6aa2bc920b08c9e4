"""Linear systems of Newton's method: regular, singular, and those whose multipliers are not unique."""

from typing import Any

import numpy as np
import pytest
from scipy import sparse

from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.mechanics import linear

KINDS = pytest.mark.parametrize("kind", [np.array, sparse.csr_array])


def saddle(constraints: FloatArray, stiffness: float = 1.0) -> FloatArray:
    """Return the matrix of four springs, each to its neighbours and the ground, and of constraints (m, 4) on them."""
    springs = stiffness * (3 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    m = len(constraints)
    return np.block([[springs, constraints.T], [constraints, np.zeros((m, m))]])


@KINDS
@pytest.mark.parametrize("stiffness", [1e-9, 1.0, 1e12])
def test_a_regular_saddle_point_whatever_the_unit_of_pressure(kind: Any, stiffness: float) -> None:
    matrix = saddle(np.array([[1.0, -1, 0, 0], [0, 0, 1, 1]]), stiffness)
    exact = np.concatenate([np.arange(1.0, 5.0), stiffness * np.array([2.0, -1.0])])
    step = linear.solve_step(kind(matrix), matrix @ exact, 4)
    assert step.change is not None
    assert step.deficiency == 0
    assert step.condition > 1e-3
    assert np.abs(step.change / exact - 1).max() < 100 * UNIT_ROUNDOFF


@KINDS
@pytest.mark.parametrize("times", [1, 2, 5])
def test_a_constraint_that_is_asked_several_times_is_counted(kind: Any, times: int) -> None:
    once = np.array([[1.0, -1, 0, 0], [0, 0, 1, 1]])
    twice = np.vstack([once, *([once[0]] * times)])
    right = np.array([1.0, 2, 3, 4, 0.5, 0.25])
    alone = linear.solve_step(saddle(once), right, 4).change
    step = linear.solve_step(kind(saddle(twice)), np.concatenate([right, np.full(times, 0.5)]), 4)
    assert alone is not None
    assert step.change is not None
    assert step.deficiency == times
    assert np.abs(step.change[:4] - alone[:4]).max() < 1e-14
    shared = step.change[[4, *range(6, 6 + times)]]  # the shortest: all carry the same
    assert shared.sum() == pytest.approx(alone[4], rel=1e-13)
    assert np.ptp(shared) < 1e-14


def test_eliminated_positions_change_neither_the_step_nor_what_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Constraints and transfer differ here, as those of the tangent of a formulation do."""
    random = np.random.default_rng(7)
    mixed = random.uniform(-1, 1, (9, 4))
    matrix = saddle(random.uniform(-1, 1, (4, 4)))
    transfer, constraints = matrix[:4, 4:] @ mixed.T, mixed @ (matrix[4:, :4] + 0.1)
    large = np.block([[matrix[:4, :4], transfer], [constraints, np.zeros((9, 9))]])
    right = large @ random.uniform(-1, 1, 13)
    eliminated = linear._shortest(large, right, 4, np.zeros(13))
    monkeypatch.setattr(linear, "_FAR_FROM_SINGULAR", np.inf)
    whole = linear._shortest(large, right, 4, np.zeros(13))
    assert eliminated[1] == whole[1] == 5
    assert eliminated[0] is not None
    assert whole[0] is not None
    assert np.abs(eliminated[0] - whole[0]).max() <= 1e-12 * np.abs(whole[0]).max()
    right[0] += 1e-3  # A force contradicts no constraint.
    assert linear._shortest(large, right, 4, np.zeros(13))[0] is not None
    right[12] += 1e-3
    assert linear._shortest(large, right, 4, np.zeros(13))[0] is None
    monkeypatch.undo()
    assert linear._shortest(large, right, 4, np.zeros(13))[0] is None


@KINDS
def test_constraints_that_contradict_each_other_are_not_averaged(kind: Any) -> None:
    matrix = saddle(np.array([[1.0, -1, 0, 0], [1.0, -1, 0, 0]]))
    right = np.array([0, 0, 0, 0, 0.5, 0.25])
    step = linear.solve_step(kind(matrix), right, 4)
    assert step.change is None
    assert step.deficiency == 1
    within = np.array([0, 0, 0, 0, 0.5, 0.5 + 1e-9])
    assert linear.solve_step(kind(matrix), within, 4).change is None
    assert linear.solve_step(kind(matrix), within, 4, np.full(6, 1e-9)).change is not None


@KINDS
def test_positions_that_nothing_holds_are_singular(kind: Any) -> None:
    between = np.array([[1.0, -1, 1], [-1, 1, -1], [1, -1, 0]])  # a spring and a constraint between two free nodes
    assert linear.solve_step(kind(between), np.array([1.0, -1, 0]), 2).change is None
    grounded = np.array([[1.0, -1, 1], [-1, 1, 0], [1, 0, 0]])
    assert linear.solve_step(kind(grounded), np.array([1.0, -1, 0]), 2).change is not None


@KINDS
def test_an_unused_multiplier_with_a_row_of_its_own_is_regular(kind: Any) -> None:
    matrix = np.zeros((5, 5))
    matrix[:4, :4] = saddle(np.zeros((0, 4)))
    matrix[4, 4] = 1e-12
    step = linear.solve_step(kind(matrix), np.array([1.0, 0, 0, 0, 3e-12]), 4)
    assert step.change is not None
    assert step.change[4] == pytest.approx(3.0)


@KINDS
def test_without_multipliers_a_singular_matrix_has_no_step(kind: Any) -> None:
    step = linear.solve_step(kind(np.array([[1.0, 1], [1, 1]])), np.ones(2), 2)
    assert step.change is None
    assert step.deficiency == 0


@pytest.mark.parametrize("nothing", [[1.0, -1.0, 0.0, 0.0], [1.0, -1.0, 1.0, -1.0], [3.0, -1.0, -1.0, -1.0]])
def test_a_nearly_singular_matrix_is_told_also_where_its_null_vector_is_orthogonal_to_equal_entries(
    nothing: list[float],
) -> None:
    """The usual estimate begins with equal entries, and sees nothing of it."""
    vector = np.array(nothing) / np.linalg.norm(nothing)
    matrix = np.eye(4) - (1 - 1e-14) * np.outer(vector, vector)
    step = linear.solve_step(sparse.csr_array(matrix), vector, 4)
    assert step.condition < 1e-13


@pytest.mark.parametrize("n", [50, 287, 400])
def test_a_condition_is_the_same_wherever_its_workspace_lies(n: int) -> None:
    random = np.random.default_rng(0)
    matrix = random.standard_normal((n, n)) + np.sqrt(n) * np.eye(n)
    right, blockers, conditions = np.ones(n), [], set()
    for _ in range(20):
        blockers.append(np.zeros(random.integers(1, 5000)))  # It moves what is allocated next.
        conditions.add(linear.solve_step(matrix.copy(), right, n).condition)
    assert len(conditions) == 1
    assert all(condition == np.float32(condition) for condition in conditions)
