"""A solved scene has the arrays of the solution; a mistake of a plugin is a line of text and no traceback."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from planned_cases import draw_cases
from subjects import load_subject

from contactverif import Case, MisuseError, Rectangle, Scene, Subject, load_scene, named_case, solve, two_blocks
from contactverif.contract.result import NotLoaded
from contactverif.run.judge import forces_on
from contactverif.strategies.solids import block_cases
from contactverif.studies.solved_scenes import solve_scene

FIG_30 = "c:penalty=1e4,sides=free,lowered=0,ratio=0.5"


class Springs:
    """Nodal springs against the plane y = 0 on both sides, of the given sign."""

    def __init__(self, *, penalty: float) -> None:
        self.stiffness = penalty

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = np.zeros_like(z)
        forces[..., 1::2] = self.stiffness * z[..., 1::2]
        return forces


class Raising(Springs):
    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        raise RuntimeError("no licence\nleft")


class WithoutPoints(Springs):
    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        return "none"


class ToInfinity(Springs):
    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return -1e4 * np.eye(z.size)


@pytest.mark.parametrize("text", ["c", "b:degrees=30", "a2-graded", "example-1", "example-1bis:degrees=90,refine=2"])
def test_a_formulation_that_is_right_shows_the_exact_pressure_everywhere(text: str) -> None:
    scene = load_scene(text)
    solved = solve_scene(scene.case(), [load_subject("vts-ppt")])
    (solution,) = solved.solutions
    assert not solved.failures
    assert solution.pressure == scene.case().parameter("pressure")
    pressures = solved.node_pressures(solution)
    assert np.isfinite(pressures).sum() >= len(scene.interface.slave) + 3
    np.testing.assert_allclose(pressures[np.isfinite(pressures)], solution.pressure, rtol=1e-9)
    assert solution.points is not None
    np.testing.assert_allclose(solution.points.pressure, solution.pressure, rtol=1e-9)
    assert solution.stress_error < 1e-9
    for body, stresses in zip(scene.bodies, solution.stresses, strict=True):
        normal = body.frame[:, 1]
        tensors = stresses[:, [0, 2, 2, 1]].reshape(-1, 2, 2)
        np.testing.assert_allclose(tensors @ normal, np.tile(-solution.pressure * normal, (len(tensors), 1)), atol=1e-6)


def test_under_an_imposed_approach_multipliers_carry_more_than_a_penalty() -> None:
    """Each is held against its own exact pressure: a penalty gives way."""
    names = ["sts", "mortar", "mortar-lm", "two-pass/nts-lm"]
    (case, *_) = draw_cases(block_cases(), seed="pictures", examples=3).cases[1:]
    solved = solve_scene(case, [load_subject(name) for name in names])
    assert [solution.formulation for solution in solved.solutions] == names
    assert max(solution.stress_error for solution in solved.solutions) < 1e-9
    soft, rigid = solved.pressures
    assert soft < rigid
    assert [solution.pressure for solution in solved.solutions] == [soft, soft, rigid, rigid]


@pytest.mark.parametrize("name", ["nts-lm", "vts-ppt-lm", "mortar-lm", "two-pass/nts-lm"])
def test_forces_of_multipliers_that_no_case_holds_are_not_drawn(name: str) -> None:
    assert forces_on(named_case("c"), load_subject(name)) is None
    assert forces_on(named_case("c"), load_subject("nts")) is not None


def test_a_formulation_that_is_wrong_shows_it_in_numbers() -> None:
    solved = solve_scene(load_scene("c").case(), [load_subject("nts"), load_subject("vts-ppt")])
    wrong, right = solved.solutions
    assert wrong.points is None  # a nodal method has forces, not pressures
    assert np.ptp(solved.node_pressures(wrong)) > 1
    assert wrong.stress_error > 0.01 > right.stress_error


def test_it_is_the_trace_that_is_drawn() -> None:
    scene = load_scene(FIG_30)
    names = ["vts-me", "vts-ppt-basic", "vts-ppt"]
    solved = solve_scene(scene.case(), [load_subject(name) for name in names])
    assert [solution.formulation for solution in solved.solutions] == names
    assert np.isnan(solved.solutions[0].pressure)
    for solution in solved.solutions:
        trace = solve(scene, load_subject(solution.formulation).for_case(scene.case()))
        assert (solution.end, solution.n_iterations, solution.converged) == ("converged", trace.n_iterations, True)
        np.testing.assert_array_equal(solution.residuals, trace.residuals)
        np.testing.assert_array_equal(solution.energies, trace.energies)
        np.testing.assert_array_equal(solution.z, trace.z)
        np.testing.assert_array_equal(solution.displacements[1], scene.displacements(trace.solution)[1])
        assert np.isnan(solution.stress_error)
        np.testing.assert_allclose(solution.forces[: scene.interface.n_slave_nodes, 1].sum(), 1200, rtol=1e-9)
    iterations = [solution.n_iterations for solution in solved.solutions]
    assert iterations[1] > 2 * max(iterations[0], iterations[2])  # an approximate tangent, as Fig. 30 has it


def test_the_interface_knows_whose_its_nodes_are() -> None:
    scene = load_scene("c:refine=2,degrees=20")
    solved = solve_scene(scene.case(), [load_subject("vts-ppt")])
    for body, on, moved in zip(solved.bodies, solved.on_interface, solved.solutions[0].displacements, strict=True):
        np.testing.assert_array_equal(solved.case.interface.nodes[on], body.nodes[body.contact_nodes])
        at = solved.solutions[0].z.reshape(-1, 2)[on]
        np.testing.assert_allclose(at, (body.nodes + moved)[body.contact_nodes], atol=1e-12)


def test_a_body_out_of_reach_is_there_and_on_no_side() -> None:
    near = load_scene("c")
    far = two_blocks(
        Rectangle([100, 101], [0, 1], young=1e4), Rectangle([100, 101], [-1, 0], young=1e4), approach=0.0, penalty=1e4
    ).bodies[1]
    scene = Scene((*near.bodies, far), (0,), (1, 2), near.penalty, near.facts, "c and another")
    solved = solve_scene(scene.case(), [load_subject("vts-ppt")])
    assert solved.sides == ["slave", "master", ""]
    assert solved.solutions[0].stress_error < 1e-9


@pytest.mark.parametrize(
    ("make", "end", "remark"),
    [
        (WithoutPoints, "", "contact_points: returned a str; needed ContactPoints"),
        (ToInfinity, "diverged", "drawn is iterate "),
    ],
)
def test_what_does_not_come_out_well_is_drawn_with_a_remark(make: Callable[..., Any], end: str, remark: str) -> None:
    (solution,) = solve_scene(load_scene("c").case(), [Subject("mine", make)]).solutions
    assert end in solution.end
    assert solution.converged == (not end)
    assert solution.remark.startswith(remark)
    assert bool(solution.advice) == bool(end)
    assert np.isfinite(solution.z).all()
    assert all(np.isfinite(u).all() for u in solution.displacements)


def test_failures_are_a_line_each_and_the_others_are_solved() -> None:
    subjects = [Subject("raising", Raising), NotLoaded("absent", "ModuleNotFoundError"), load_subject("vts-ppt")]
    solved = solve_scene(load_scene("c").case(), subjects)
    assert [solution.formulation for solution in solved.solutions] == ["vts-ppt"]
    assert solved.failures.keys() == {"raising", "absent"}
    assert solved.failures["raising"].startswith("residual: RuntimeError: no licence left (test_pictures.py, line ")
    assert solved.failures["absent"] == "not loaded: ModuleNotFoundError"


def test_an_interface_alone_cannot_be_solved() -> None:
    case = load_scene("c").case()
    with pytest.raises(MisuseError, match="an interface without bodies"):
        solve_scene(Case(case.interface, case.z), [load_subject("vts-ppt")])
