"""The solved patch tests, with and without an overhang."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from planned_cases import draw_cases
from subjects import judge_as, load_subject, reporting, with_verbs

import contactverif_mortar
import contactverif_nts
from contactverif import Case, ContactPoints, Rectangle, solve
from contactverif.contract.property import Property, Verdict, judge
from contactverif.mechanics.scene import Scene, scene_of
from contactverif.problems.blocks import exact_unknowns, is_uniform, pressure_of, two_blocks
from contactverif.problems.catalogue import BLOCKS, load_scene_case, make_scene
from contactverif.problems.flat_states import overhangs
from contactverif.problems.uniform_stress import stress_error
from contactverif.run.run import run
from contactverif.strategies.solids import VARIANTS as NAMES_OF_VARIANTS
from contactverif.strategies.solids import dead_zone_cases, variant_cases
from contactverif_properties.exact_forces import consistent_forces, gap_error
from contactverif_properties.patch_solved import (
    SLOPE,
    measure_at_penalty,
    measure_once,
    measure_two_penalties,
    patch_dead_zone,
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
    def tangent(right: Any, *state: Any) -> Any:
        return 0 * np.eye(state[-1].size) if wrong == "nothing" else right(*state).T

    for scene in ("c-prime:lowered=0,degrees=17.3", "example-1bis"):
        judge_as(Verdict.PASS, patch_flat_solve, load_scene_case(scene), with_verbs("vts-ppt", tangent=tangent))


def test_a_tangent_that_leads_nowhere_hides_no_wrong_residual() -> None:
    """With 1e12 on the diagonal every step is nearly none, so that whoever starts at the exact solution stays there."""
    case = load_scene_case("c-prime")
    aimless = with_verbs("vts-me", tangent=lambda _, *state: -1e12 * case.penalty * np.eye(state[-1].size))
    measurement = measure_at_penalty(case, aimless, case.penalty)
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
    cases = draw_cases(variant_cases(), seed="1", examples=60).cases
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


RIGHT = ("sts", "mortar", "mortar-dual", "mortar-lm", "mortar-dual-lm", "vts-ppt-balanced", "vts-ppt:free_end=cover")
WRONG = ("nts", "nts-ar", "vts-g", "vts-me", "vts-ppt", "vts-ppt-basic", "vts-ppt:free_end=extend", "chen-hisada")
DRAWING = BLOCKS["dead-zone"]


# --- what is exact ----------------------------------------------------------------------------------------------


def test_the_exact_forces_by_hand() -> None:
    """Each force is p times the integral of a shape function of −6, −4.4, −2.1, −0.3, 1.9, 4, 6 from −3.3 to 3.3."""
    case = load_scene_case("dead-zone:pressure=1")
    left, right = (2.3**2 - 1.1**2) / (2 * 2.3), (2.1**2 - 0.7**2) / (2 * 2.1)  # of the two segments that end nearby
    slave = [0, 1.2 - left, left + 0.9, 0.9 + 1.1, 1.1 + right, 1.4 - right, 0]
    master = [0.85, 0.85 + 1, 1 + 0.9, 0.9 + 0.55, 0.55]
    forces = consistent_forces(case, 1.0)
    assert forces[:, 1] == pytest.approx([*slave, *(-np.array(master))], abs=1e-14)
    assert not forces[:, 0].any()


@pytest.mark.parametrize("text", ["", ":degrees=17.3", ":refine=2,ratio=0.25,poisson=0", ":degrees=180,penalty=1e8"])
def test_in_the_exact_solution_the_stress_is_uniform_and_needs_those_forces(text: str) -> None:
    case = load_scene_case(f"dead-zone{text}")
    scene, p = scene_of(case), DRAWING.pressure
    assert is_uniform(case)
    assert overhangs(case)
    q = exact_unknowns(scene, p, case.penalty)
    assert stress_error(scene, scene.stresses(q), p) <= 1e-12
    assert np.abs(scene.nodal_forces(q) - consistent_forces(case, p)).max() <= 1e-12 * p * 12


def test_either_block_may_overhang() -> None:
    scene = two_blocks(Rectangle([0, 2, 4], [0, 1]), Rectangle([1, 3, 7], [-2, 0]), pressure=0.5, penalty=10)
    q = exact_unknowns(scene, 0.5, 10)
    assert stress_error(scene, scene.stresses(q), 0.5) <= 1e-14
    assert overhangs(scene.case())
    assert not overhangs(two_blocks(Rectangle([1, 2], [0, 1]), Rectangle([0, 3], [-2, 0]), pressure=0.5).case())


def test_no_pressure_is_known_of_a_block_lowered_beside_a_rigid_floor() -> None:
    floor = {"approach": 0.1, "rigid_master": True}
    assert is_uniform(two_blocks(Rectangle([0, 1, 2], [0, 1]), Rectangle([0, 2], [0]), **floor).case())
    assert not is_uniform(two_blocks(Rectangle([0, 1, 2], [0, 1]), Rectangle([0.5, 2], [0]), **floor).case())


# --- who passes -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", RIGHT)
def test_who_passes(name: str) -> None:
    assert measure_once(load_scene_case("dead-zone"), load_subject(name)).values["stress error"] <= 1e-14
    # At 33° the master's right end is at a slave node as roundoff will have it.
    for text in ("", ":degrees=17.3,refine=2", ":ratio=1e3,poisson=0.45", ":degrees=33,refine=3"):
        judge_as(Verdict.PASS, patch_dead_zone, load_scene_case(f"dead-zone{text}"), load_subject(name))


@pytest.mark.parametrize("name", WRONG)
def test_who_fails(name: str) -> None:
    measurement = measure_once(load_scene_case("dead-zone"), load_subject(name))
    assert measurement.values["stress error"] > 0.02
    assert {"stress error", "slave force error", "master force error"} <= {
        quantity for quantity, value in measurement.values.items() if value > measurement.tolerances[quantity]
    }


def test_the_numbers_of_the_design() -> None:
    """The design gives no heights. These blocks are half as high as wide and one cell high, with ε̂ = 30 E/h."""
    x, master_x = (
        start + np.concatenate([[0], np.cumsum(lengths)])
        for start, lengths in ((DRAWING.slave_from, DRAWING.slave), (DRAWING.master_from, DRAWING.master))
    )
    scene = two_blocks(
        Rectangle(x, [0, 6], young=1e4, poisson=0.3),
        Rectangle(master_x, [-6, 0], young=1e4, poisson=0.3),
        penalty=30 * 1e4 / 2,
        pressure=100,
    )
    errors = {
        name: measure_once(scene.case(), load_subject(name)).values["stress error"] for name in (*RIGHT[:2], *WRONG)
    }
    assert max(errors[name] for name in RIGHT[:2]) <= 1e-13
    assert errors["nts-ar"] == pytest.approx(0.22, rel=0.1)
    assert errors["vts-me"] == pytest.approx(8e-2, rel=0.05)
    assert errors["vts-ppt"] >= 2e-2


def test_the_scene_is_asked_nothing_that_is_promised_of_covered_interfaces() -> None:
    result = run(
        [load_subject("vts-ppt")],
        [patch_dead_zone, patch_flat_solve, patch_variants],
        place=load_scene_case("dead-zone"),
    )
    assert [row.verdict for row in result.rows] == [Verdict.FAIL, Verdict.NOT_APPLICABLE, Verdict.NOT_APPLICABLE]
    assert result.promises_kept
    (row,) = run([load_subject("sts")], [patch_dead_zone], place=load_scene_case("c")).rows
    assert row.verdict is Verdict.NOT_APPLICABLE
    assert dead_zone_cases(make_scene("c").case()) is None


# --- what is measured -------------------------------------------------------------------------------------------


def add_point(points: ContactPoints, **more: Any) -> ContactPoints:
    """Return the points, and the first of them once more with other values."""
    first = {field.name: getattr(points, field.name)[:1] for field in fields(points)} | {
        name: np.array([value]) for name, value in more.items()
    }
    return ContactPoints(**{name: np.concatenate([getattr(points, name), values]) for name, values in first.items()})


@pytest.mark.parametrize(
    ("more", "wrong"),
    [
        ({"slave_segment": 0, "c": -1.0, "active": False, "pressure": 0.0}, set()),  # idle, beside the master
        ({"slave_segment": 1, "c": -1 + 2 * 1.1 / 2.3, "active": False}, set()),  # at its end, as near as roundoff
        ({"slave_segment": 1, "c": 0.5, "active": False}, {"pressure error"}),  # idle, opposite
        ({"slave_segment": 1, "c": 0.5, "active": False, "weight": 0.0}, set()),
        ({"slave_segment": 1, "c": 0.5, "active": False, "master_segment": -1}, set()),
        ({"slave_segment": 0, "c": -1.0, "active": True, "pressure": 99.0}, {"pressure error"}),
        ({"slave_segment": 0, "c": -1.0, "active": True, "master_segment": -1, "pressure": 99.0}, {"pressure error"}),
        ({"slave_segment": -1, "c": np.nan, "active": False}, {"pressure error"}),  # no place on the slave: opposite
        ({"slave_segment": 1, "c": 0.5, "gap": 0.0}, {"gap error"}),
    ],
)
def test_which_points_count(more: dict[str, Any], wrong: set[str]) -> None:
    subject = reporting(lambda points: add_point(points, **more), contactverif_mortar.sts)
    measurement = measure_once(load_scene_case("dead-zone"), subject)
    assert {name for name, value in measurement.values.items() if value > measurement.tolerances[name]} == wrong


def test_what_overhangs_may_bend() -> None:
    """The gap is asked for where there are two surfaces."""
    case = load_scene_case("dead-zone")
    n_slave = case.interface.n_slave_nodes
    penetration = DRAWING.pressure / case.penalty
    flat = case.interface.nodes - penetration * np.where(np.arange(n_slave + 5) < n_slave, 1.0, 0.0)[:, None] * [0, 1]

    def error(node: int, by: float) -> float:
        moved: Case = replace(case, z=(flat + by * np.eye(len(flat))[node][:, None] * [0, 1]).reshape(-1))
        return gap_error(moved, penetration, 1.0)

    assert error(0, 0.0) <= 1e-15
    assert error(0, 0.5) == error(0, 0.0)  # the segment from node 0 to node 1 has no master opposite
    assert error(1, 0.5) == pytest.approx(0.5 * 1.2 / 2.3)  # what is seen of it opposite the master's end
    assert error(2, 0.5) == pytest.approx(0.5)
    assert error(n_slave, 0.5) == pytest.approx(0.5 * 4 / 5)  # over the mean of five master nodes


def test_a_part_of_the_slave_bears_the_rounding_of_all() -> None:
    case = load_scene_case("dead-zone")
    plain, measurement = (measure(case, load_subject("sts")) for measure in (measure_once, patch_dead_zone.measure))
    assert measurement.values == plain.values
    for name, tolerance in plain.tolerances.items():
        assert measurement.tolerances[name] == pytest.approx(tolerance * 12 / 6.6, rel=1e-14)
    assert judge(patch_dead_zone, measurement)[0] is Verdict.PASS
