"""The exact fields of the wavy half-planes satisfy the equations of elasticity, and the scene is made of them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from subjects import load_subject

from contactverif.contract.arrays import FloatArray
from contactverif.contract.errors import MisuseError
from contactverif.mechanics.accuracy import Solution, solve_for_accuracy
from contactverif.mechanics.bulk import elasticity
from contactverif.problems.problem import Variation
from contactverif.problems.wavy import LOWER, UPPER, WAVY, WavyProblem, wavy_scene

STEP = 1e-30
BODIES = pytest.mark.parametrize("body", [UPPER, LOWER])
PROBLEM = WavyProblem(height=1.5, mean=3e-6, wave=2e-6, penalty=7.0)


def _places(body: int) -> FloatArray:
    random = np.random.default_rng(1)
    into = 1 if body == UPPER else -1
    return np.column_stack([random.uniform(0, 4, 50), into * random.uniform(0.05, 1.4, 50)])


def _gradient(field: Callable[[FloatArray], FloatArray], places: FloatArray) -> FloatArray:
    """Return ∂field_i/∂x_j (n, components, 2) by complex steps."""
    columns = [field(places + 1j * STEP * np.eye(2)[direction]).imag / STEP for direction in (0, 1)]
    return np.stack(columns, axis=-1)


@BODIES
def test_stresses_are_in_equilibrium_and_follow_from_displacements_by_hookes_law(body: int) -> None:
    places = _places(body)
    gradient = _gradient(lambda x: PROBLEM.stresses(body, x), places)
    size = PROBLEM.wave * PROBLEM.wave_number
    np.testing.assert_allclose((gradient[:, [0, 2], 0] + gradient[:, [2, 1], 1]) / size, 0, atol=1e-14)
    gradient = _gradient(lambda x: PROBLEM.displacements(body, x), places)
    strain = np.stack([gradient[:, 0, 0], gradient[:, 1, 1], gradient[:, 0, 1] + gradient[:, 1, 0]], axis=1)
    hooke = strain @ elasticity(wavy_scene(PROBLEM).bodies[body])
    np.testing.assert_allclose(hooke / PROBLEM.wave, PROBLEM.stresses(body, places) / PROBLEM.wave, atol=1e-13)


def test_both_bodies_press_on_one_another_with_the_pressure_and_without_friction() -> None:
    x = np.linspace(0, 4, 41)
    for body in (UPPER, LOWER):
        stresses = PROBLEM.stresses(body, np.column_stack([x, 0 * x]))
        np.testing.assert_allclose(-stresses[:, 1], PROBLEM.pressure(x), rtol=1e-14)
        assert not stresses[:, 2].any()


@pytest.mark.parametrize("penalty", [0.5, 7.0, np.inf])
@pytest.mark.parametrize("amplitude", [0.0, 1e-4])
def test_the_gap_that_is_left_is_the_pressure_over_the_penalty(penalty: float, amplitude: float) -> None:
    problem = replace(PROBLEM, penalty=penalty, amplitude=amplitude)
    x = np.linspace(0, 4, 41)
    flat = np.column_stack([x, 0 * x])
    cosine, size = np.cos(problem.wave_number * x), amplitude + 1e-5
    upper, lower = (problem.profile(b) * cosine + problem.displacements(b, flat)[:, 1] for b in (UPPER, LOWER))
    np.testing.assert_allclose(upper - lower, -problem.pressure(x) / penalty, rtol=1e-9, atol=1e-15 * size)
    wave = (upper + lower) / 2
    np.testing.assert_allclose(wave - wave.mean(), amplitude * (cosine - 1 / 41), atol=1e-14 * size)


@BODIES
def test_sides_are_planes_of_symmetry_and_the_far_edge_moves_with_the_exact_field(body: int) -> None:
    y = (1 if body == UPPER else -1) * np.linspace(0, 1.5, 7)
    for x in (0.0, 4.0):
        places = np.column_stack([np.full(7, x), y])
        assert np.abs(PROBLEM.displacements(body, places)[:, 0]).max() < 1e-15 * PROBLEM.wave
        assert np.abs(PROBLEM.stresses(body, places)[:, 2]).max() < 1e-14 * PROBLEM.wave
    of_body = wavy_scene(PROBLEM, 2).bodies[body]
    far = np.flatnonzero(np.abs(np.abs(of_body.nodes[:, 1]) - PROBLEM.height) < 1e-12)
    assert len(far) in (13, 17)
    assert of_body.fixed[far].all()
    exact = PROBLEM.displacements(body, of_body.nodes[far])
    np.testing.assert_allclose(of_body.imposed[far], exact, atol=1e-14 * PROBLEM.approach)


@pytest.mark.parametrize("refine", [1, 2, 4, 8, 16])
def test_nodes_of_the_two_surfaces_meet_at_the_sides_only(refine: int) -> None:
    x = wavy_scene(WavyProblem(), refine).interface.nodes[:, 0]
    upper, lower = x[1 : 6 * refine], np.sort(x[6 * refine + 1 :])[1:-1]
    assert np.abs(upper[:, None] - lower).min() * refine > 1e-3
    assert (len(upper), len(lower)) == (6 * refine - 1, 8 * refine - 1)


def test_either_body_may_be_the_slave() -> None:
    scene = wavy_scene(PROBLEM, 1, LOWER)
    assert scene.slave == (LOWER,)
    assert len(scene.interface.slave) == 8
    assert wavy_scene(PROBLEM, 1, LOWER) is scene


def test_displacements_of_another_code_have_the_errors_of_the_solution_that_they_are_of() -> None:
    subject = load_subject("mortar")
    instance = WAVY.pose(12, 30.0, subject.traits, Variation())
    ours = solve_for_accuracy(instance.scene, subject, instance.start, instance.step)
    theirs = Solution.from_displacements(instance.scene, ours.displacements)
    assert theirs.balanced
    errors = instance.errors(ours)
    del errors["pressure"]  # Displacements say nothing of reported pressures.
    assert instance.errors(theirs) == {kind: pytest.approx(error, rel=1e-2) for kind, error in errors.items()}


@pytest.mark.parametrize(
    ("field", "wrong", "message"),
    [
        ("pressure", lambda places: 1.0, r"pressure: found shape \(\); needed \(\d+,\), a number for each place"),
        ("pressure", lambda places: np.ones((len(places), 1)), r"pressure: found shape \(\d+, 1\); needed \(\d+,\)"),
        ("motions", lambda places: places.T, r"motions: found shape \(2, \d+\); needed \(\d+, 2\), a vector for each"),
    ],
)
def test_an_exact_field_of_a_wrong_shape_is_named(field: str, wrong: Any, message: str) -> None:
    """Numpy would broadcast it, or speak of its own axes."""
    subject = load_subject("vts-ppt")
    instance = WAVY.pose(WAVY.meshes[0], 10.0, subject.traits, Variation())
    solution = solve_for_accuracy(instance.scene, subject, instance.start, instance.step)
    assert 0 < max(instance.errors(solution).values()) < 1
    with pytest.raises(MisuseError, match=rf"ProblemInstance\.{message}"):
        replace(instance, **{field: (wrong, wrong) if field == "motions" else wrong}).errors(solution)
