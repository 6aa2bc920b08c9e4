"""The sweeps accuse nobody who is right, in whatever way of writing, and each wrong way where it loses digits."""

import numpy as np
import pytest
from gauss_springs import RIGHT, WRONG, springs_of
from subjects import alone, load_subject, measure_case

from contactverif import Case, Property, Verdict
from contactverif.mechanics.scene import scene_of
from contactverif.oracle import uniform_pressure_weights
from contactverif.problems.stability_states import SWEEPS, stability_scenes, stability_states
from contactverif.run.run import run
from contactverif_properties.roundoff import CONDITION, ERROR, FORCE_ERROR
from contactverif_properties.stability import (
    SWEPT_ROUNDINGS,
    ExactMotion,
    move_swept,
    stability_stiffness,
    stability_sweep,
)


def state_named(name: str) -> Case:
    return next(case for case in (*stability_states(), *stability_scenes()) if case.name == name)


def test_names_are_distinct_and_every_sweep_has_states() -> None:
    cases = [*stability_states(), *stability_scenes()]
    assert len({case.name for case in cases}) == len(cases)
    assert {case.kind for case in cases} == set(SWEEPS)
    gaps, ratios, offsets = (
        {case.parameter(name) for case in stability_states()} for name in ("gap", "ratio", "offset")
    )
    assert min(gaps) < 1.2e-12
    assert min(ratios) < 1.1e-9
    assert max(offsets) == 2.0**30
    assert {case.parameter("stiffness") for case in stability_scenes()} == {10.0**n for n in range(-2, 13)}


@pytest.mark.parametrize("case", stability_states(), ids=lambda case: case.name)
def test_the_motion_of_a_state_rounds_nothing(case: Case) -> None:
    there, motion = move_swept(case), ExactMotion.from_case(case)
    for before, after in ((case.positions, there.positions), (case.interface.nodes, there.interface.nodes)):
        unshifted = after - motion.shift
        assert np.array_equal(unshifted + motion.shift, after)
        assert np.array_equal(motion.turn_back(unshifted), before)
    assert there.shortest_segment == pytest.approx(case.shortest_segment, rel=1e-6)


def test_the_flat_state_at_the_origin_is_a_reference() -> None:
    """There the forces are the exact ones, however small the gap is."""
    for case in stability_states():
        formulation = load_subject("sts").for_case(case)
        forces = -formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z)
        weights = uniform_pressure_weights(case.interface, case.interface.nodes[:, 0])
        exact = np.where(np.arange(len(weights)) < case.interface.n_slave_nodes, weights, -weights)
        exact *= case.penalty * case.parameter("gap")
        assert np.abs(forces.reshape(-1, 2)[:, 1] - exact).max() <= 8 * 2.0**-53 * np.abs(exact).max(), case.name


@pytest.mark.parametrize("question", [stability_sweep, stability_stiffness], ids=lambda question: question.id)
@pytest.mark.parametrize("name", RIGHT)
def test_a_right_formulation_in_another_way_of_writing_passes(name: str, question: Property) -> None:
    subject = springs_of(*RIGHT[name], translation_stable=True)
    (row,) = run([subject], [question], examples=1).rows
    assert row.verdict is Verdict.PASS, row.reason
    assert row.judged == row.planned == len(row.outcomes)
    assert row.closest is not None
    assert row.closest.number.value <= 6


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_formulation_fails_and_the_case_is_named(name: str) -> None:
    (row,) = run([springs_of(*WRONG[name], translation_stable=True)], [stability_sweep], examples=1).rows
    assert row.verdict is Verdict.FAIL
    assert row.unexpected
    assert set(row.failing_names) >= {"offset-1e6-a", "offset-1e6-gap-1e-6-b", "all-a"}


def test_only_the_offset_accuses_points_that_are_rounded_first() -> None:
    subject = springs_of(*WRONG["point rounded before the difference"], translation_stable=True)
    (row,) = run([subject], [stability_sweep], examples=1).rows
    assert not [name for name in row.failing_names if name.startswith(("gap", "ratio"))]


@pytest.mark.parametrize("name", ["nts-ar", "vts-ppt", "mortar"])
def test_a_formulation_that_is_a_residual_alone_is_judged(name: str) -> None:
    sweep, stiffness = run([alone(name)], [stability_sweep, stability_stiffness], examples=1).rows
    assert sweep.verdict is Verdict.PASS, sweep.reason
    assert stiffness.verdict is Verdict.NOT_APPLICABLE
    assert not stiffness.unexpected


def test_the_numbers_of_a_state_belong_together() -> None:
    measurement = measure_case(stability_sweep, state_named("gap-1e-9-a"), load_subject("nts-ar"))
    details = measurement.details
    assert details[ERROR] == pytest.approx(measurement.values[SWEPT_ROUNDINGS.name] * 2.0**-53 * details[CONDITION])
    assert 1e8 < details[CONDITION] < 1e10
    assert 0 < details[FORCE_ERROR] < 1e-6


def test_a_penalty_costs_its_digits_and_no_more() -> None:
    soft, stiff = (
        measure_case(stability_stiffness, state_named(f"stiffness-1e{n}"), load_subject("vts-ppt")).details
        for n in (2, 10)
    )
    assert 1e7 < stiff[CONDITION] / soft[CONDITION] < 1e9
    assert stiff[ERROR] > 1e6 * soft[ERROR] > 0


def test_a_scene_rests_at_the_pressure_that_it_is_loaded_by() -> None:
    for case in stability_scenes():
        scene = scene_of(case)
        assert case.parameter("pressure") == 2.0**-10
        mean = float(scene.interface.slave.lengths(scene.interface.nodes).mean())
        assert case.penalty * mean == pytest.approx(case.parameter("stiffness"))


def test_multipliers_have_no_stiffness_to_sweep() -> None:
    (row,) = run([load_subject("mortar-lm")], [stability_stiffness], examples=1).rows
    assert row.verdict is Verdict.NOT_APPLICABLE
    assert row.reason == "the enforcement is by a multiplier, not by springs of a stated stiffness"
