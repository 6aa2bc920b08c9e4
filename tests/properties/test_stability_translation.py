"""The judge of far states accuses who rounds points there, however it is written, and nobody else."""

from functools import cache

import numpy as np
import pytest
from gauss_springs import RIGHT, WRONG, by_points_first, springs_of
from subjects import ResidualAlone, load_property, measure_case

from contactverif import Case, Interface, Subject, Verdict, judge_case
from contactverif.run.run import run
from contactverif.sampling.draw import draw_cases
from contactverif.strategies.translations import KINDS
from contactverif_properties.stability import FORCES, stability_translation
from contactverif_properties.states import move_state


@cache
def cases(count: int = 100) -> tuple[Case, ...]:
    return draw_cases(stability_translation.cases(None), seed="0/translation", examples=count).cases


def test_every_case_moves_without_rounding_and_every_kind_is_drawn() -> None:
    for case in cases():
        far = move_state(case, case.parameters["shift"])
        assert np.array_equal(far.positions - case.parameters["shift"], case.positions)
        assert np.array_equal(far.interface.nodes - case.parameters["shift"], case.interface.nodes)
        assert np.array_equal(case.z * 2.0**32, np.round(case.z * 2.0**32))
    assert {case.kind for case in cases()} == set(KINDS)
    assert max(float(np.abs(case.parameters["shift"]).max()) for case in cases()) == 2.0**20


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_formulation_in_another_way_of_writing_passes(name: str) -> None:
    way, before = RIGHT[name]
    subject = springs_of(way, before, translation_stable=True)
    outcomes = [judge_case(stability_translation, case, subject) for case in cases()]
    assert {outcome.verdict for outcome in outcomes} == {Verdict.PASS}, [outcome.reason for outcome in outcomes]
    assert sum(measure_case(stability_translation, case, subject).idle for case in cases()) <= 10
    assert max(max(measure_case(stability_translation, case, subject).values.values()) for case in cases()) <= 4


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_formulation_is_accused_by_five_orders_of_magnitude(name: str) -> None:
    way, before = WRONG[name]
    subject = springs_of(way, before, translation_stable=True)
    assert max(measure_case(stability_translation, case, subject).values[FORCES.name] for case in cases()) >= 1e5


def test_points_first_without_a_promise_are_shown_and_break_nothing() -> None:
    silent, boastful = springs_of(by_points_first), springs_of(by_points_first, translation_stable=True)
    result = run([silent], [stability_translation], examples=20, seed=0)
    assert result.rows[0].verdict is Verdict.FAIL
    assert result.promises_kept
    assert run([boastful], [stability_translation], examples=20, seed=0).rows[0].unexpected


def test_a_statement_of_not_being_stable_is_kept_by_a_named_state() -> None:
    witnesses = {"stability.translation": "moved"}
    stated = springs_of(by_points_first, translation_stable=False, witnesses=witnesses)
    assert run([stated], [stability_translation], examples=10, seed=0).promises_kept
    way, before = RIGHT["einsum"]
    modest = springs_of(way, before, translation_stable=False, witnesses=witnesses)
    assert (
        run([modest], [stability_translation], examples=10, seed=0).rows[0].unexpected == "stated to fail, but passes"
    )


@pytest.mark.parametrize("name", ["differences first", "cross product", "point rounded before the difference"])
def test_a_plugin_that_is_a_residual_and_nothing_else_is_judged(name: str) -> None:
    way, before = (RIGHT | WRONG)[name]
    inner = springs_of(way, before, translation_stable=True)
    subject = Subject(name, lambda *, penalty: ResidualAlone(inner.with_penalty(penalty).plugin))
    verdicts = [judge_case(stability_translation, case, subject).verdict for case in cases(60)]
    assert (Verdict.FAIL in verdicts) is (name in WRONG)
    assert verdicts.count(Verdict.UNDECIDED) <= (10 if name in WRONG else 0)


def test_states_of_a_given_mesh_are_moved_to_the_origin_first() -> None:
    distant = Interface.from_chains([[1e6, 5e5], [1e6 + 1, 5e5], [1e6 + 2, 5e5]], [[1e6 + 2.5, 5e5], [1e6 - 1, 5e5]])
    states = draw_cases(stability_translation.cases(distant), seed="0", examples=20).cases
    for case in states:
        assert case.largest_coordinate < 4
        far = move_state(case, case.parameters["shift"])
        assert np.array_equal(far.positions - case.parameters["shift"], case.positions)
    way, before = RIGHT["einsum"]
    assert all(
        judge_case(stability_translation, case, springs_of(way, before)).verdict is Verdict.PASS for case in states
    )


@pytest.mark.parametrize("property_id", ["balance.force", "balance.moment", "units"])
@pytest.mark.parametrize("name", RIGHT)
def test_whoever_promises_to_be_stable_is_asked_for_balance_and_scaling_at_its_diameter(
    name: str, property_id: str
) -> None:
    way, before = RIGHT[name]
    subject = springs_of(way, before, translation_stable=True, conserves_force=True, conserves_moment=True)
    (row,) = run([subject], [load_property(property_id)], examples=30, seed=0).rows
    assert row.verdict is Verdict.PASS, row.reason
