"""The patch test solved: exact numbers, and formulations that lock or have a wrong tangent do not mislead it."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from subjects import Changed, judge_as, load_subject, reporting

import contactverif_nts
from contactverif import Case, Rectangle, Subject, solve
from contactverif.contract.property import Property, Verdict, judge
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.problems.blocks import pressure_of, two_blocks
from contactverif.problems.catalogue import load_scene_case
from contactverif.run.run import run
from contactverif.sampling.draw import draw_cases
from contactverif.strategies.solids import VARIANTS as NAMES_OF_VARIANTS
from contactverif.strategies.solids import variant_cases
from contactverif_properties.patch_solved import (
    SLOPE,
    measure_at_penalty,
    measure_two_penalties,
    patch_flat_solve,
    patch_variants,
)


def textbook() -> Case:
    """Return two blocks whose exact pressure, 0.017369727047, was computed by hand."""
    return in_units(1.0, 1.0).case()


def in_units(length: float, modulus: float) -> Scene:
    """Return the textbook's blocks with all lengths and all moduli multiplied."""
    return two_blocks(
        Rectangle(np.array([0, 1, 3, 4]) * length, np.array([0, 2, 6]) * length, young=modulus, poisson=0.3),
        Rectangle(np.array([0, 1.5, 2, 4]) * length, np.array([-4, -1, 0]) * length, young=3 * modulus, poisson=0.2),
        penalty=10 * modulus / length,
        approach=0.1 * length,
    )


def test_the_pressure_is_that_of_springs_in_series() -> None:
    assert pressure_of(textbook(), 10.0) == pytest.approx(0.017369727047, abs=5e-13)


@pytest.mark.parametrize("name", ["vts-ppt", "vts-ppt-balanced"])
def test_the_recovered_stress_is_that_pressure(name: str) -> None:
    case = textbook()
    scene = scene_of(case)
    stresses = scene.stresses(solve(scene, load_subject(name).for_case(case)).solution)
    for body in stresses:
        assert np.abs(-body[..., 1] - 0.017369727047).max() <= 1e-12


def test_nts_on_a1_passes_as_the_penalty_grows_because_it_locks() -> None:
    measurement = measure_two_penalties(load_scene_case("a1"), load_subject("nts"))
    assert measurement.details[SLOPE] == pytest.approx(-1, abs=0.05)
    assert judge(patch_flat_solve, measurement)[0] is Verdict.FAIL


def test_nts_ar_on_c_fails_at_any_penalty() -> None:
    measurement = measure_two_penalties(load_scene_case("c-prime"), load_subject("nts-ar"))
    assert measurement.details[SLOPE] > -0.5
    assert measurement.values["stress error, high penalty"] > 1e-2


@pytest.mark.parametrize("wrong", ["nothing", "transposed"])
def test_a_wrong_tangent_is_no_reason_to_accuse_a_right_residual(wrong: str) -> None:
    def make(*, penalty: float) -> Any:
        inner = contactverif_nts.vts_ppt(penalty=penalty)

        def tangent(interface: Any, pairing: Any, z: Any) -> Any:
            return 0 * np.eye(z.size) if wrong == "nothing" else inner.tangent(interface, pairing, z).T

        return Changed(inner, tangent=tangent)

    for scene in ("c-prime:lowered=0,degrees=17.3", "example-1bis"):
        judge_as(Verdict.PASS, patch_flat_solve, load_scene_case(scene), Subject(wrong, make))


def test_a_tangent_that_leads_nowhere_hides_no_wrong_residual() -> None:
    """With 1e12 on the diagonal every step is nearly none, so that whoever starts at the exact solution stays there."""

    def make(*, penalty: float) -> Any:
        inner = contactverif_nts.vts_me(penalty=penalty)
        return Changed(inner, tangent=lambda interface, pairing, z: -1e12 * penalty * np.eye(z.size))

    aimless = Subject("aimless", make)
    measurement = measure_at_penalty(load_scene_case("c-prime"), aimless, load_scene_case("c-prime").penalty)
    assert judge(patch_variants, measurement)[0] is Verdict.FAIL
    assert measurement.values["master force error"] > 1e6 * measurement.tolerances["master force error"]


@pytest.mark.parametrize("scene", ["a2-graded", "b:degrees=45", "example-1bis", "c-prime:ratio=1e-3", "c:ratio=1e6"])
def test_a_pressure_that_is_not_what_is_pushed_is_found_out(scene: str) -> None:
    boaster = reporting(lambda points: replace(points, pressure=points.pressure * (1 + 1e-3)), contactverif_nts.vts_ppt)
    measurement = measure_two_penalties(load_scene_case(scene), boaster)
    wrong = {name for name, value in measurement.values.items() if value > measurement.tolerances[name]}
    assert wrong == {"pressure error", "pressure error, high penalty"}


def test_a_scene_that_is_not_uniform_is_not_asked() -> None:
    assert variant_cases(load_scene_case("c:sides=free")) is None
    result = run([load_subject("vts-ppt")], [patch_flat_solve], place=load_scene_case("c:sides=free"))
    assert result.rows[0].verdict is Verdict.NOT_APPLICABLE


def test_every_variant_is_drawn() -> None:
    strategy = variant_cases()
    assert strategy is not None
    cases = draw_cases(strategy, seed="1", examples=60).cases
    variants = {int(case.parameter("variant")) for case in cases}
    assert variants == set(range(len(NAMES_OF_VARIANTS)))
    assert any(scene_of(case).bodies[1].rigid for case in cases)


@pytest.mark.parametrize("question", [patch_flat_solve, patch_variants])
def test_on_a_given_scene_a_promise_to_fail_is_not_held_against_it(question: Property) -> None:
    (row,) = run([load_subject("vts-me")], [question], place=load_scene_case("b")).rows
    assert (row.verdict, row.promise, row.witness, row.planned) == (Verdict.PASS, None, None, 1)
    (row,) = run([load_subject("vts-me")], [question], place=load_scene_case("c")).rows
    assert (row.verdict, row.unexpected) == (Verdict.FAIL, "")


def test_a_scaled_scene_is_judged_the_same() -> None:
    """Lengths × 2^40, stiffness × 2^-30: every number without dimension keeps its bits but for roundoff."""
    values = []
    for length, modulus in ((1.0, 1.0), (2.0**40, 2.0**-30)):
        scene = in_units(length, modulus)
        measurement = measure_at_penalty(scene.case(), load_subject("nts-ar"), scene.penalty)
        values.append([*measurement.values.values(), *measurement.tolerances.values()])
    assert values[0] == pytest.approx(values[1], rel=1e-9)
