"""`stability.locking`: who locks, who does not, and strangers."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from subjects import Changed, alone, judge_as, load_property, load_subject, measure_case
from textbook_cells import WeightedGaps

from contactverif import Subject, Verdict, judge_case
from contactverif.problems.wave_blocks import (
    COLUMNS,
    PENALTIES,
    WAVE,
    case_name,
    matching_answer,
    wave_blocks,
    wave_cases,
)
from contactverif.run.run import run
from contactverif_properties.stability import DRIFT, ROUGHNESS, answer_to_wave

QUESTION = load_property("stability.locking")
CASES = {case.name: case for case in wave_cases()}
STIFFEST = [CASES[case_name(columns, PENALTIES[-1])] for columns in COLUMNS]


@pytest.mark.parametrize("name", ["nts", "nts-ar", "mortar", "mortar-dual", "mortar:normals=averaged", "chen-hisada"])
def test_what_does_not_lock_stays_far_below_both_bounds(name: str) -> None:
    for case in STIFFEST:
        values = measure_case(QUESTION, case, load_subject(name)).values
        assert values[DRIFT.name] < 0.001
        assert values[ROUGHNESS.name] < 1.2


@pytest.mark.parametrize("name", ["sts", "vts-g", "vts-me", "vts-ppt", "vts-ppt-balanced", "two-pass/nts-ar"])
def test_what_locks_is_far_above_both_bounds(name: str) -> None:
    values = measure_case(QUESTION, CASES["12 on 8, ε̂ = 1e8 E/h"], load_subject(name)).values
    assert values[DRIFT.name] > 0.3
    assert values[ROUGHNESS.name] > 50


def test_nothing_locks_at_the_softest_penalty() -> None:
    for name in ("sts", "vts-me", "two-pass/nts"):
        for columns in COLUMNS:
            judge_as(Verdict.PASS, QUESTION, CASES[case_name(columns, PENALTIES[0])], load_subject(name))


@pytest.mark.parametrize("name", ["mortar-lm", "mortar-dual-lm", "nts-lm"])
def test_multipliers_have_a_roughness_and_no_drift(name: str) -> None:
    values = measure_case(QUESTION, STIFFEST[0], load_subject(name)).values
    assert set(values) == {ROUGHNESS.name}
    assert values[ROUGHNESS.name] < 1.2


def scale_springs(name: str, factor: float) -> Subject:
    return Subject("scaled", lambda *, penalty: load_subject(name).with_penalty(factor * penalty).plugin)


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_springs_that_are_softer_or_stiffer_than_they_say_do_not_lock(factor: float) -> None:
    for case in STIFFEST:
        measurement = measure_case(QUESTION, case, scale_springs("mortar", factor))
        assert abs(measurement.values[DRIFT.name]) < 0.005
        assert measurement.details["stiffness of the springs over the penalty"] == pytest.approx(factor, rel=1e-6)


def test_without_contact_points_the_drift_alone_finds_what_locks() -> None:
    def make(name: str, *, penalty: float) -> Any:
        return Changed(load_subject(name).with_penalty(penalty).plugin, contact_points=None)

    silent, stable = Subject("silent", partial(make, "sts")), Subject("stable", partial(make, "mortar"))
    assert "contact_points" not in silent.provides
    assert judge_case(QUESTION, STIFFEST[0], silent).verdict is Verdict.FAIL
    assert judge_case(QUESTION, STIFFEST[0], stable).verdict is Verdict.PASS


def test_mortar_from_a_textbook_does_not_lock() -> None:
    case = CASES[case_name((8, 12), 1e4)]
    stranger, ours = (
        measure_case(QUESTION, case, subject) for subject in (Subject("stranger", WeightedGaps), load_subject("mortar"))
    )
    assert stranger.values[DRIFT.name] == pytest.approx(ours.values[DRIFT.name], abs=1e-6)
    assert stranger.values[ROUGHNESS.name] == pytest.approx(ours.values[ROUGHNESS.name], rel=1e-6)


def test_a_formulation_without_a_pairing_is_not_judged() -> None:
    result = run([alone("mortar")], [QUESTION])
    assert result.rows[0].verdict is Verdict.NOT_PROVIDED


def test_matching_meshes_answer_as_a_right_formulation_does_on_them() -> None:
    answer = answer_to_wave((8, 8), 1e4, load_subject("sts"))
    exact = matching_answer(8, wave_blocks(8, 8, 1e4, wave=0.0).penalty)
    assert answer is not None
    assert answer.compliance == pytest.approx(exact.compliance, rel=1e-2)  # The mean pressure turns with the surface.


def test_the_wave_carries_no_load_in_all_and_has_its_amplitude() -> None:
    calm, wavy = (wave_blocks(8, 12, 10.0, wave=wave) for wave in (0.0, WAVE))
    load = (wavy.bodies[0].load - calm.bodies[0].load)[:, 1]
    assert abs(load.sum()) < 1e-15
    x = wavy.bodies[0].nodes[:, 0]
    work = -(load * np.cos(np.pi * x / 2)).sum()  # ∫ p1 cos² over 4, of a linear interpolation.
    assert work == pytest.approx(2 * WAVE, rel=0.06)
    assert wave_blocks(8, 12, 1e4, wave=WAVE).condensed_bodies[0] is wavy.condensed_bodies[0]
