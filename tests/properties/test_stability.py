"""Roundoff far away, at small gaps and stiff springs, and locking."""

import os
import subprocess
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from expected_verdicts import FAILS
from fresh_process import PYTHON
from gauss_springs import RIGHT, WRONG, by_differences, by_points_first, springs_of
from planned_cases import draw_cases
from subjects import ResidualAlone, alone, judge_as, load_property, load_subject, measure_case, with_verbs
from textbook_cells import WeightedGaps

from contactverif import (
    Abilities,
    Case,
    Interface,
    PatchPromises,
    Promises,
    Property,
    Quantity,
    Rules,
    Subject,
    Traits,
    Verdict,
    judge_case,
)
from contactverif.mechanics.scene import scene_of
from contactverif.oracle.flat_answers import uniform_pressure_weights
from contactverif.problems.refined_blocks import (
    COLUMNS,
    PENALTIES,
    WAVE,
    case_name,
    matching_answer,
    wave_blocks,
    wave_cases,
    wave_space_cases,
)
from contactverif.problems.space_scenes import stability_space_scenes
from contactverif.problems.stability_states import SWEEPS, stability_scenes, stability_states
from contactverif.run.run import run
from contactverif.strategies.translations import KINDS
from contactverif_properties.exact_forces import forces_of_penetration, node_gaps
from contactverif_properties.roundoff import CONDITION, ERROR, FORCE_ERROR
from contactverif_properties.stability import (
    DRIFT,
    FORCES,
    FORCES_THERE,
    LARGEST_DENOMINATOR,
    ROUGHNESS,
    SWEPT_ROUNDINGS,
    TOTAL_THERE,
    ExactMotion,
    answer_to_wave,
    exact_residual,
    move_swept,
    refuse_unknown_forces,
    stability_local,
    stability_stiffness,
    stability_sweep,
    stability_translation,
)
from contactverif_properties.states import move_state


@cache
def cases(count: int = 100) -> tuple[Case, ...]:
    return draw_cases(stability_translation.cases(None), seed="0/translation", examples=count).cases


def assert_exact_move(case: Case) -> None:
    shift = case.parameters["shift"]
    far = move_state(case, shift)
    assert np.array_equal(far.positions - shift, case.positions)
    assert np.array_equal(far.interface.nodes - shift, case.interface.nodes)


def test_every_case_moves_without_rounding_and_every_kind_is_drawn() -> None:
    for case in cases():
        assert_exact_move(case)
        assert np.array_equal(case.z * 2.0**32, np.round(case.z * 2.0**32))
    assert {case.kind for case in cases()} == set(KINDS)
    assert max(float(np.abs(case.parameters["shift"]).max()) for case in cases()) == 2.0**20


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_formulation_in_another_way_of_writing_passes(name: str) -> None:
    subject, idle = springs_of(*RIGHT[name], translation_stable=True), 0
    for case in cases():
        measurement = judge_as(Verdict.PASS, stability_translation, case, subject).measurement
        assert max(measurement.values.values()) <= 4
        idle += measurement.idle
    assert idle <= 10


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_formulation_is_accused_by_five_orders_of_magnitude(name: str) -> None:
    subject = springs_of(*WRONG[name], translation_stable=True)
    assert max(measure_case(stability_translation, case, subject).values[FORCES.name] for case in cases()) >= 1e5


def test_points_first_are_shown_and_break_nothing_but_a_promise_and_keep_a_statement_by_a_named_state() -> None:
    witnesses = {"stability.translation": "moved"}
    silent, boastful = springs_of(by_points_first), springs_of(by_points_first, translation_stable=True)
    stated = springs_of(by_points_first, translation_stable=False, witnesses=witnesses)
    modest = springs_of(*RIGHT["einsum"], translation_stable=False, witnesses=witnesses)
    of_silent, of_boastful, of_stated, of_modest = (
        run([each], [stability_translation], examples=20, seed=0) for each in (silent, boastful, stated, modest)
    )
    assert of_silent.rows[0].verdict is Verdict.FAIL
    assert of_silent.promises_kept
    assert of_boastful.rows[0].unexpected
    assert of_stated.promises_kept
    assert of_modest.rows[0].unexpected == "stated to fail, but passes"


@pytest.mark.parametrize("name", ["differences first", "cross product", "point rounded before the difference"])
def test_a_plugin_that_is_a_residual_and_nothing_else_is_judged(name: str) -> None:
    inner = springs_of(*(RIGHT | WRONG)[name], translation_stable=True)
    subject = Subject(name, lambda *, penalty: ResidualAlone(inner.with_penalty(penalty).plugin))
    verdicts = [judge_case(stability_translation, case, subject).verdict for case in cases(60)]
    assert (Verdict.FAIL in verdicts) is (name in WRONG)
    assert verdicts.count(Verdict.UNDECIDED) <= (10 if name in WRONG else 0)


def test_states_of_a_given_mesh_are_moved_to_the_origin_first() -> None:
    distant = Interface.from_chains([[1e6, 5e5], [1e6 + 1, 5e5], [1e6 + 2, 5e5]], [[1e6 + 2.5, 5e5], [1e6 - 1, 5e5]])
    states = draw_cases(stability_translation.cases(distant), seed="0", examples=20).cases
    for case in states:
        assert case.largest_coordinate < 4
        assert_exact_move(case)
        judge_as(Verdict.PASS, stability_translation, case, springs_of(*RIGHT["einsum"]))


@pytest.mark.parametrize("property_id", ["balance.force", "balance.moment", "units"])
@pytest.mark.parametrize("name", RIGHT)
def test_whoever_promises_to_be_stable_is_asked_for_balance_and_scaling_at_its_diameter(
    name: str, property_id: str
) -> None:
    subject = springs_of(*RIGHT[name], translation_stable=True, conserves_force=True, conserves_moment=True)
    (row,) = run([subject], [load_property(property_id)], examples=30, seed=0).rows
    assert row.verdict is Verdict.PASS, row.reason


@cache
def local_cases(count: int = 100, kind: str = "uniform penetration") -> tuple[Case, ...]:
    return draw_cases(stability_local.cases(None)[kind], seed="0/local", examples=count).cases


def worst_number(case: Case, subject: Subject) -> float:
    return max(measure_case(stability_local, case, subject).values.values())


def bits(value: float) -> int:
    """Return how many bits a number has from its first to its last digit 1."""
    numerator = abs(Fraction(value).numerator)
    return numerator.bit_length() - (numerator & -numerator).bit_length() + 1 if numerator else 0


def test_the_states_are_exactly_flat_and_have_many_bits_and_their_move_is_exact() -> None:
    for case in local_cases():
        assert_exact_move(case)
        x, y = (Fraction(entry).limit_denominator(LARGEST_DENOMINATOR) for entry in case.parameters["direction"])
        assert x**2 + y**2 == 1
        heights = [Fraction(b) * x - Fraction(a) * y for a, b in case.positions.tolist()]
        n_slave = case.interface.n_slave_nodes
        assert set(heights[:n_slave]) == {-Fraction(case.parameter("penetration"))}
        assert set(heights[n_slave:]) == {Fraction(0)}
    widest = [max(map(bits, case.z.tolist())) for case in local_cases()]
    assert min(widest) >= 32
    assert np.mean([width >= 40 for width in widest]) > 0.4


def test_exact_forces_balance_and_are_the_rounded_ones() -> None:
    for case in local_cases(20):
        exact = exact_residual(case)
        assert sum(exact[::2]) == sum(exact[1::2]) == 0
        rounded = np.array([float(force) for force in exact]).reshape(-1, 2)
        assert np.allclose(rounded, -forces_of_penetration(case), rtol=1e-14, atol=0)


@pytest.mark.parametrize("name", RIGHT)
@pytest.mark.parametrize("takes_longdouble", [False, True])
def test_a_right_formulation_in_another_way_of_writing_is_exact(name: str, takes_longdouble: bool) -> None:
    """Long double is the answer where the plugin takes it."""
    subject = springs_of(*RIGHT[name], translation_stable=True, takes_longdouble=takes_longdouble)
    assert max(worst_number(case, subject) for case in local_cases()) <= 8


@pytest.mark.parametrize("name", WRONG)
@pytest.mark.parametrize("takes_longdouble", [False, True])
def test_a_wrong_formulation_is_accused_by_three_orders_of_magnitude(name: str, takes_longdouble: bool) -> None:
    subject = springs_of(*WRONG[name], translation_stable=True, takes_longdouble=takes_longdouble)
    assert max(worst_number(case, subject) for case in local_cases()) >= 16e3


@pytest.mark.parametrize("kind", ["uniform penetration", "linear penetration"])
@pytest.mark.parametrize(
    "name",
    ["nts-ar", "vts-g", "vts-ppt", "vts-ppt-balanced", "sts", "mortar", "mortar-dual", "mortar-lm", "chen-hisada"],
)
def test_the_built_in_formulations_are_as_exact_as_their_positions(name: str, kind: str) -> None:
    assert max(worst_number(case, load_subject(name)) for case in local_cases(kind=kind)) <= 4


@pytest.mark.parametrize("name", ["mortar-lm", "mortar-dual-lm", "vts-ppt-lm"])
def test_multipliers_that_are_pressures_are_judged_by_the_distribution(name: str) -> None:
    subject = load_subject(name)
    assert max(worst_number(case, subject) for case in local_cases()) <= 4

    def double(right: Any, *state: Any) -> Any:
        return 2 * right(*state)

    assert max(worst_number(case, with_verbs(name, residual=double)) for case in local_cases(30)) <= 4


UNCOMPILED = """
from expected_verdicts import FAILS
from subjects import load_property, load_subject

from contactverif.contract.property import Verdict
from contactverif.run.run import run

result = run([load_subject(name) for name in FAILS], [load_property("stability.local")], examples=10, seed=0)
for row in result.rows:
    assert row.verdict is Verdict.PASS and row.promise, (row.formulation, row.verdict, row.reason)
    assert row.closest.number.value <= 4, (row.formulation, row.closest)
print(len(result.rows), "formulations")
"""


@pytest.mark.skipif(
    np.finfo(np.longdouble).nmant <= np.finfo(np.float64).nmant, reason="long double is not longer than double here"
)
def test_every_built_in_formulation_is_judged_where_nothing_is_compiled() -> None:
    here = str(Path(__file__).parents[1])
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": here}
    command = [*PYTHON, "-W", "error", "-c", UNCOMPILED]
    process = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert not process.returncode, process.stderr
    assert process.stdout.split()[0] == str(len(FAILS))


def test_what_is_exact_follows_the_traits() -> None:
    springs = springs_of(by_differences, takes_longdouble=False)
    assert list(stability_local.measure(local_cases()[0], springs).values) == [TOTAL_THERE.name]
    assert "no exact force" in refuse_unknown_forces(Traits(rules=Rules(penalty="nodal", area="current")))
    assert "no exact force" in refuse_unknown_forces(Traits())
    assert not refuse_unknown_forces(Traits(abilities=Abilities(takes_longdouble=True)))
    assert "no exact force" in refuse_unknown_forces(
        Traits(
            promises=Promises(patch=PatchPromises(flat=True)), rules=Rules(enforcement="multiplier", penalty="nodal")
        )
    )
    assert "barrier" in stability_local.refusal(Traits(rules=Rules(enforcement="barrier")))


def test_a_linear_penetration_is_exactly_linear_and_closed_everywhere() -> None:
    for case in local_cases(kind="linear penetration"):
        n_slave = case.interface.n_slave_nodes
        points = [(Fraction(x), Fraction(y)) for x, y in case.positions[:n_slave].tolist()]
        (x_0, y_0), (x_1, y_1) = points[0], points[-1]
        assert all((x - x_0) * (y_1 - y_0) == (y - y_0) * (x_1 - x_0) for x, y in points)
        assert (node_gaps(case) < 0).all()
        assert_exact_move(case)


@pytest.mark.parametrize(
    ("name", "quantities"),
    [("sts", {FORCES_THERE, TOTAL_THERE}), ("vts-ppt", {TOTAL_THERE}), ("mortar-lm", {FORCES_THERE})],
)
def test_what_is_exact_under_a_linear_penetration_follows_the_traits(name: str, quantities: set[Quantity]) -> None:
    (case,) = local_cases(1, "linear penetration")
    measured = stability_local.measure(case, load_subject(name)).values
    assert set(measured) == {quantity.name for quantity in quantities}


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
def test_a_right_formulation_in_another_way_of_writing_is_swept(name: str, question: Property) -> None:
    subject = springs_of(*RIGHT[name], translation_stable=True)
    (row,) = run([subject], [question], examples=1).rows
    assert row.verdict is Verdict.PASS, row.reason
    assert row.judged == row.planned == len(row.outcomes)
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


SPACE_SCENES = stability_space_scenes((3, 4))


def test_the_motion_of_a_scene_in_space_rounds_no_node() -> None:
    interface, motion = SPACE_SCENES[0].interface, ExactMotion.from_case(SPACE_SCENES[0])
    exact = [[Fraction(x) for x in node] for node in interface.nodes.tolist()]
    rows = [[Fraction(int(entry), int(motion.size)) for entry in row] for row in motion.matrix]
    turned = [[sum(a * x for a, x in zip(row, node, strict=True)) for row in rows] for node in exact]
    assert [[Fraction(x) for x in node] for node in motion.move(interface.nodes).tolist()] == turned
    assert np.array_equal(motion.turn_back(motion.move(interface.nodes)), interface.nodes)


@pytest.mark.parametrize(
    "name", ["sts-3d", "mortar-3d", "vts-ppt-3d", "vts-ppt-3d:normal=slave", "nts-3d", "nts-ar-3d"]
)
def test_forces_of_a_solution_in_space_keep_their_digits(name: str) -> None:
    (row,) = run([load_subject(name)], [stability_stiffness]).rows
    assert (row.verdict, row.judged) == (Verdict.PASS, row.planned), row.reason
    assert row.closest.number.value <= 2


def test_points_that_are_rounded_far_away_lose_digits_of_a_solution_in_space() -> None:
    def residual(right: Any, interface: Interface, pairing: Any, z: Any) -> Any:
        far = 2.0**10 * np.abs(z).max()
        return right(interface, pairing, (z + far) - far)

    for case in SPACE_SCENES:
        outcome = judge_case(stability_stiffness, case, with_verbs("sts-3d", residual=residual))
        verdicts = {Verdict.FAIL} if case.parameter("stiffness") < 1e7 else {Verdict.FAIL, Verdict.UNDECIDED}
        assert outcome.verdict in verdicts, case.name


QUESTION = load_property("stability.locking")
CASES = {case.name: case for case in wave_cases()}
STIFFEST = [CASES[case_name(columns, PENALTIES[-1])] for columns in COLUMNS]


@pytest.mark.parametrize("name", ["nts", "nts-ar", "mortar", "mortar-dual", "mortar:normals=averaged", "chen-hisada"])
def test_what_does_not_lock_stays_far_below_both_bounds(name: str) -> None:
    for case in STIFFEST:
        values = measure_case(QUESTION, case, load_subject(name)).values
        assert values[DRIFT.name] < 0.001
        assert values[ROUGHNESS.name] < 1.2


STIFFEST_IN_SPACE = [case for case in wave_space_cases((3, 4)) if "1e8" in case.name]


@pytest.mark.parametrize("name", ["nts-3d", "nts-ar-3d", "mortar-3d"])
def test_what_does_not_lock_in_space_stays_far_below_both_bounds(name: str) -> None:
    subject = load_subject(name)
    faces = [
        case for case in STIFFEST_IN_SPACE if case.interface.slave.faces.shape[1] in subject.traits.abilities.faces
    ]
    for case in faces:
        values = measure_case(QUESTION, case, subject).values
        assert values[DRIFT.name] < 0.002
        assert values[ROUGHNESS.name] < 1.4


@pytest.mark.parametrize("name", ["sts-3d", "vts-cell-3d", "vts-ppt-3d", "vts-ppt-balanced-3d", "two-pass/nts-ar-3d"])
def test_what_locks_in_space_is_far_above_both_bounds(name: str) -> None:
    values = measure_case(QUESTION, STIFFEST_IN_SPACE[1], load_subject(name)).values
    assert values[DRIFT.name] > 0.3
    assert values[ROUGHNESS.name] > 50


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
    silent, stable = (with_verbs(name, contact_points=None) for name in ("sts", "mortar"))
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
    for name, corners in (("sts", 2), ("sts-3d", 3), ("sts-3d", 4)):
        calm, wavy = (wave_blocks(8, 8, 1e4, wave=wave, corners=corners) for wave in (0.0, WAVE))
        answer = answer_to_wave(calm, wavy, load_subject(name))
        exact = matching_answer(8, calm.penalty, corners)
        # The mean pressure turns with the surface.
        assert answer.compliance == pytest.approx(exact.compliance, rel=1e-2)


def test_the_wave_carries_no_load_in_all_and_has_its_amplitude() -> None:
    calm, wavy = (wave_blocks(8, 12, 10.0, wave=wave) for wave in (0.0, WAVE))
    load = (wavy.bodies[0].load - calm.bodies[0].load)[:, 1]
    assert abs(load.sum()) < 1e-15
    x = wavy.bodies[0].nodes[:, 0]
    work = -(load * np.cos(np.pi * x / 2)).sum()  # ∫ p1 cos² over 4, of a linear interpolation.
    assert work == pytest.approx(2 * WAVE, rel=0.06)
    assert wave_blocks(8, 12, 1e4, wave=WAVE).condensed_bodies[0] is wavy.condensed_bodies[0]
