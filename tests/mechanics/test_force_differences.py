"""Differences of contact forces: few calls give the same derivative as many, and a wrong matrix is never taken."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import pytest
from pressed_blocks import on
from scipy import sparse
from subjects import change_verbs, load_subject

from contactverif import CheckedFormulation, Interface, Pairing, Rectangle, Scene, Subject, solve, two_blocks
from contactverif.contract.arrays import FloatArray, dense
from contactverif.mechanics.system import Differences
from contactverif.problems import catalogue

PENETRATION, STEP = 1e-3, 1e-6


@dataclass
class Meter:
    """Contact forces that count how often they are asked for."""

    forces: Callable[[FloatArray], FloatArray]
    calls: int = field(default=0, init=False)

    def __call__(self, states: FloatArray) -> FloatArray:
        self.calls += states.size // states.shape[-1]
        return self.forces(states)


def long_interface(n_segments: int) -> tuple[Scene, FloatArray]:
    """Return two wavy surfaces of about 16 segments each whose nodes do not match, and a state of contact."""
    slave = Rectangle(np.linspace(0, 16, n_segments + 1), [0, 1, 2])
    master = Rectangle(np.linspace(0, 16, n_segments), [-2, -1, 0])
    scene = two_blocks(slave, master, penalty=10.0, approach=0.01)
    z = scene.interface.nodes.copy()
    z[:, 1] += 0.02 * np.sin(z[:, 0])
    z[: scene.interface.n_slave_nodes, 1] -= PENETRATION
    return scene, z.reshape(-1)


def differences_at(forces: Callable[[FloatArray], FloatArray], z: FloatArray, step: float = STEP) -> Differences:
    return Differences(forces, z, np.full(z.size, step), np.full(z.size, np.abs(z).max()), z.size)


def on_frozen_pairing(
    name: str, n_segments: int = 16
) -> tuple[CheckedFormulation, Interface, Pairing | None, Differences]:
    scene, z = long_interface(n_segments)
    formulation = on(name, scene)
    pairing = formulation.pair(scene.interface, z)
    forces = partial(formulation.residual, scene.interface, pairing)
    return formulation, scene.interface, pairing, differences_at(forces, z)


@pytest.mark.parametrize("name", ["nts", "sts", "vts-ppt", "mortar", "chen-hisada"])
def test_nodes_that_move_at_once_give_the_same_derivative_with_fewer_calls(name: str) -> None:
    *_, one_by_one = on_frozen_pairing(name, 48)
    meters = [Meter(one_by_one.forces) for _ in range(2)]
    expected = differences_at(meters[0], one_by_one.z).by_unknown()
    by_groups = differences_at(meters[1], one_by_one.z).by_groups(1.1)
    assert by_groups is not None
    # Both are rounded by u X/h = 2e-9 of an entry, for coordinates of X = 16 and a step of h = 1e-6.
    assert np.abs(by_groups - expected).max() <= 1e-8 * np.abs(expected).max()
    assert 3 * meters[1].calls <= meters[0].calls
    assert one_by_one.confirm(by_groups)


def test_groups_that_are_too_close_are_refused() -> None:
    *_, differences = on_frozen_pairing("vts-ppt", 48)
    by_groups = differences.by_groups(0.2)
    assert by_groups is not None
    assert not differences.confirm(by_groups)


def test_nothing_is_grouped_where_that_saves_nothing() -> None:
    *_, differences = on_frozen_pairing("vts-ppt", 4)
    assert differences.by_groups(8.0) is None


@pytest.mark.parametrize("to_sparse", [False, True])
def test_a_wrong_entry_is_seen_wherever_it_stands(to_sparse: bool) -> None:
    """The least error that must be seen is the one that Newton's method would feel: a thousandth of a row."""
    formulation, interface, pairing, differences = on_frozen_pairing("vts-ppt", 6)
    tangent = dense(formulation.tangent(interface, pairing, differences.z))
    make = sparse.csr_array if to_sparse else np.asarray
    assert differences.confirm(make(tangent))
    terms = np.abs(tangent).sum(axis=1)
    rows, columns = np.nonzero(tangent)
    assert len(rows) > 200
    for row, column in zip(rows, columns, strict=True):
        wrong = tangent.copy()
        wrong[row, column] += 1e-3 * max(terms[row], terms[row ^ 1])
        assert not differences.confirm(make(wrong)), (row, column)


def test_steps_get_smaller_where_contact_begins_within_them() -> None:
    """A spring with a gap of 1e-8 begins within a step of 1e-6, and half of the difference is lost."""
    z = np.array([0.0, 0.0, 1.0, 1.0])
    coarse = differences_at(lambda states: np.minimum(states - 1e-8, 0.0), z)
    exact = np.diag([1.0, 1.0, 0.0, 0.0])
    assert np.abs(coarse.by_unknown() - exact).max() > 0.4
    fine = coarse.away_from_kinks()
    assert np.abs(fine.by_unknown() - exact).max() <= 1e-6
    assert fine.confirm(exact)
    assert not coarse.confirm(exact)


def test_steps_stay_where_forces_are_smooth_or_have_kinks_everywhere() -> None:
    z = np.linspace(0.5, 1.0, 6)
    smooth, kink = differences_at(np.sin, z), differences_at(lambda states: np.abs(states - z), z)
    assert (smooth.away_from_kinks().steps == smooth.steps).all()
    assert kink.away_from_kinks() is kink


def double(right: Any, *state: Any) -> FloatArray:
    return 2 * dense(right(*state)).T


def fail(right: Any, *state: Any) -> FloatArray:
    raise ZeroDivisionError


@pytest.mark.parametrize("change", [double, fail])
def test_a_wrong_tangent_changes_no_solution_by_differences(change: Callable[..., FloatArray]) -> None:
    scene = catalogue.load_scene("c-prime")
    right = load_subject("vts-ppt")
    wrong = Subject("wrong", lambda *, penalty: change_verbs(right._make(penalty=penalty), tangent=change))
    traces = [
        solve(scene, subject.for_case(scene.case()), use_tangent=False, solution_only=only)
        for subject, only in ((right, False), (wrong, True))
    ]
    assert all(trace.converged for trace in traces)
    solutions = [trace.solution for trace in traces]
    assert np.abs(solutions[1] - solutions[0]).max() <= 1e-12 * np.abs(solutions[0]).max()


def test_a_right_tangent_saves_the_calls_of_differences() -> None:
    scene, calls = catalogue.load_scene("c-prime"), []

    def count(right: Any, interface: Interface, pairing: Pairing | None, z: FloatArray) -> FloatArray:
        calls.append(z.size // interface.n_unknowns)
        return np.asarray(right(interface, pairing, z))

    right = load_subject("vts-ppt")
    counted = Subject("counted", lambda *, penalty: change_verbs(right._make(penalty=penalty), residual=count))
    totals = []
    for only in (False, True):
        calls.clear()
        solve(scene, counted.for_case(scene.case()), use_tangent=False, solution_only=only)
        totals.append(sum(calls))
    assert 4 * totals[1] <= totals[0]
