"""The judges of projections accuse who reports something else than is there."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from planned_cases import draw_cases
from subjects import load_property, load_subject, measure_case, reporting
from zoo.at_points import PointsFirst, TurnedFrame

import contactverif_mortar
from contactverif import Case, ContactPoints, Interface, Outcome, Subject, Surface, Verdict, judge_case
from contactverif.problems.flat_states import flat_face_state, grid

IDS = ("projection.segment", "projection.place", "projection.activity", "projection.area", "projection.forces")


@cache
def cases(property_id: str, count: int = 30) -> tuple[Case, ...]:
    return draw_cases(load_property(property_id).cases(None), seed=f"0/{property_id}", examples=count).cases


def outcome_of(property_id: str, case: Case, subject: Subject) -> Outcome:
    return judge_case(load_property(property_id), case, subject)


@pytest.mark.parametrize(
    "name", ["nts:tau=0", "two-pass/sts", "two-pass/mortar", "two-pass/vts-ppt-balanced", "sts:area=reference"]
)
@pytest.mark.parametrize("property_id", IDS)
def test_built_in_formulations_with_options_pass(name: str, property_id: str) -> None:
    subject, question = load_subject(name), load_property(property_id)
    if not question.refusal_of(subject):
        assert {outcome_of(property_id, case, subject).verdict for case in cases(property_id)} == {Verdict.PASS}


def over_a_vertex(gap: float, place: float = 0.0) -> Case:
    """One slave segment of length 2 over a flat master; its first node stands at `place` from the master's vertex."""
    slave, master = np.array([[0.0, 0], [2, 0]]) + [place, gap], np.array([[4.0, 0], [0, 0], [-4, 0]])
    interface = Interface.from_chains(slave, master)
    return Case(interface, interface.nodes.reshape(-1), 4.0)


def with_arrays(change: Callable[[ContactPoints], dict[str, Any]], make: Any = PointsFirst) -> Subject:
    """Return a formulation that computes the right thing, and reports other arrays."""
    return reporting(lambda points: replace(points, **change(points)), make)


def beside_a_wall(weight: float) -> tuple[Case, Subject]:
    """Return a slave segment that sees a master segment edge-on, and the formulation whose points there weigh this."""
    positions = np.array([[-0.625, -0.3125], [0.125, 0.6875], [0, 0], [4, -3], [7, 1], [3, 4]])
    interface = Interface(positions, Surface([[0, 1]]), Surface([[2, 3], [3, 4], [4, 5], [5, 2]]))

    def weigh(points: ContactPoints) -> dict[str, Any]:
        return {"weight": np.where(points.master_segment == 0, weight, points.weight)}

    return Case(interface, positions.ravel(), 1.0), with_arrays(weigh, contactverif_mortar.sts)


def test_an_overlap_that_rounding_leaves_of_an_edge_on_segment_is_no_wrong_segment() -> None:
    """The slave runs along (3, 4), at right angles to the edge along (4, -3), but their product is rounded."""
    case = beside_a_wall(0)[0]
    points = load_subject("sts").for_case(case)
    named = points.contact_points(case.interface, points.pair(case.interface, case.z), case.z).master_segment
    assert 0 in named, "the rounding that this test is about does not happen any more"
    assert outcome_of("projection.segment", case, load_subject("sts")).verdict is Verdict.PASS
    assert outcome_of("projection.segment", *beside_a_wall(1e-12)).verdict is Verdict.FAIL


def test_at_a_tie_either_segment_is_right() -> None:
    case = over_a_vertex(-0.25)
    for segment in (0, 1):

        def choose(points: ContactPoints, segment: int = segment) -> dict[str, Any]:
            return {"master_segment": np.where(points.c < 0, segment, points.master_segment)}

        outcome = outcome_of("projection.segment", case, with_arrays(choose))
        assert outcome.verdict is Verdict.PASS
        assert outcome.measurement.details["tied points"] == 1


def test_beside_a_tie_the_farther_segment_is_wrong_by_how_much_farther_it_is() -> None:
    case = over_a_vertex(-0.25, place=0.125)
    subject = with_arrays(lambda points: {"master_segment": np.ones_like(points.master_segment)})
    (value,) = measure_case(load_property("projection.segment"), case, subject).values.values()
    # The second node is 2.125 beyond the vertex; the lengths are 2 and 4, and X is 4.
    farther, lengths = np.hypot(2.125, 0.25) - 0.25, 2 + 4 + np.hypot(2.125, 0.25) + 4
    assert value == pytest.approx(farther / lengths, rel=1e-12)
    assert outcome_of("projection.segment", case, subject).verdict is Verdict.FAIL


def test_a_gap_of_roundoff_may_have_either_sign_and_either_decision() -> None:
    case = over_a_vertex(0.0, place=0.5)
    for active in (True, False):
        subject = with_arrays(lambda points, active=active: {"active": np.full_like(points.active, active)})
        assert measure_case(load_property("projection.activity"), case, subject).details["decided points"] == 0
    for gap in (1e-17, -1e-17):
        subject = with_arrays(lambda points, gap=gap: {"gap": np.full_like(points.gap, gap)})
        assert outcome_of("projection.place", case, subject).verdict is Verdict.PASS


@pytest.mark.parametrize(("place", "wrong"), [(4 + 1e-3, 0), (4 + 0.5, 0), (4 + 5.0, 2)])
def test_past_a_free_end_a_formulation_decides_up_to_one_segment_for_itself(place: float, wrong: int) -> None:
    case = over_a_vertex(-0.25, place=place)
    subject = with_arrays(lambda points: {"active": np.ones_like(points.active)})
    (value,) = measure_case(load_property("projection.activity"), case, subject).values.values()
    assert value == 2 * wrong  # The state is asked about in two units.


def test_a_foot_on_a_node_of_the_surface_is_decided() -> None:
    subject = with_arrays(lambda points: {"active": points.active & (points.xi > 0) & (points.xi < 1)})
    assert outcome_of("projection.activity", over_a_vertex(-0.25), subject).verdict is Verdict.FAIL


def test_far_away_only_who_promises_it_must_keep_the_digits_of_a_gap() -> None:
    """The stranger forms points first. Far away its gap is wrong by the rounding of a point."""
    case = over_a_vertex(-0.25, place=1 / 3)
    far = replace(case, z=(case.positions @ [[0.6, 0.8], [-0.8, 0.6]] + 2.0**20).reshape(-1))

    class Boaster(PointsFirst):
        traits = PointsFirst.traits.revise(translation_stable=True)
        places = np.array([-0.3, 0.7])

    class Modest(PointsFirst):
        places = np.array([-0.3, 0.7])

    assert outcome_of("projection.place", far, Subject("modest", Modest)).verdict is Verdict.PASS
    assert outcome_of("projection.place", far, Subject("boaster", Boaster)).verdict is Verdict.FAIL
    assert outcome_of("projection.place", case, Subject("boaster", Boaster)).verdict is Verdict.PASS


@pytest.mark.parametrize(
    ("property_id", "slave", "master"),
    [
        (  # The gap is 14 times the length of the master's first segment: its rounded ends turn it, and move the foot.
            "projection.place",
            [[3.4006461747170564, -16.374975630612603], [3.4146088016442424, -8.374987815306302], [24 / 7, -0.375]],
            [[5, -0.125], [4, 0], [0, 0]],
        ),
        (  # The foot is 6000 lengths past the end of the segment opposite.
            "projection.forces",
            [[64, 0], [0, 0]],
            [[6.975446428571428e-05, -0.0019975142045454545], [0.007882254464285714, -0.0019975142045454545]],
        ),
    ],
)
def test_a_kernel_that_turns_coordinates_may_turn_a_segment_by_the_rounding_of_its_ends(
    property_id: str, slave: list[list[float]], master: list[list[float]]
) -> None:
    interface = Interface.from_chains(np.array(slave, float), np.array(master, float))
    case = Case(interface, interface.nodes.reshape(-1), 1.0)
    outcome = outcome_of(property_id, case, Subject("turned", TurnedFrame))
    assert outcome.verdict is Verdict.PASS, outcome.reason


def test_who_reports_only_active_points_is_told_so_in_words() -> None:
    class OnlyActive(PointsFirst):
        def contact_points(self, *state: Any) -> ContactPoints:
            points = super().contact_points(*state)
            return points.select(points.active)

    case, reason = over_a_vertex(0.0, place=1.0), "every reported point is active, and a part of the slave is missing"
    for heights in ([-0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]):
        positions = case.positions.copy()
        positions[:2, 1] = heights
        outcome = outcome_of(
            "projection.area", replace(case, z=positions.reshape(-1)), Subject("only-active", OnlyActive)
        )
        assert (reason in outcome.reason) == (max(heights) > 0), outcome.reason


def test_points_of_a_second_pass_are_judged_with_roles_exchanged() -> None:
    subject = load_subject("two-pass/nts-ar")
    formulation = subject.for_case(over_a_vertex(-0.25))
    case = over_a_vertex(-0.25)
    points = formulation.contact_points(case.interface, formulation.pair(case.interface, case.z), case.z)
    second = points.select(points.on_master)
    assert len(second.c) == 3  # The nodes of the master
    assert second.slave_segment.max() == 1
    assert second.master_segment.max() == 0
    assert second.normal[0] == pytest.approx([0, -1])  # Out of the slave, which is on top
    assert outcome_of("projection.place", case, subject).verdict is Verdict.PASS


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda points: {"pressure": np.abs(points.gap) + 1}, "an idle point carries a pressure"),
        (lambda points: {"pressure": -points.pressure - 1}, "a pressure at an active point is negative or NaN"),
        (lambda points: {"pressure": np.full_like(points.gap, np.nan)}, "pressure against −ε̂ × gap is nan"),
    ],
)
def test_a_pressure_that_breaks_the_contract_is_named(change: Any, reason: str) -> None:
    case = over_a_vertex(-0.25, place=3.0)  # The second node lies past the free end.
    assert reason in outcome_of("projection.forces", case, with_arrays(change)).reason
    rounded = with_arrays(
        lambda points: {"pressure": -points.pressure}
    )  # A gap that is formed anew may change its sign.
    assert outcome_of("projection.forces", over_a_vertex(-(2.0**-55), place=1.0), rounded).verdict is Verdict.PASS


@pytest.mark.parametrize(
    ("property_id", "change", "reason"),
    [
        ("projection.area", lambda points: {"weight": -points.weight}, "a weight is negative or NaN"),
        ("projection.activity", lambda points: {"slave_segment": 0 * points.slave_segment - 1}, "names no place"),
        ("projection.place", lambda points: {"xi": np.full_like(points.xi, np.nan)}, "error of ξ is nan"),
        (
            "projection.place",
            lambda points: {"normal": np.full_like(points.normal, np.nan)},
            "error of the normal is nan",
        ),
    ],
)
def test_what_an_active_point_leaves_out_is_named(property_id: str, change: Any, reason: str) -> None:
    assert reason in outcome_of(property_id, over_a_vertex(-0.25, place=0.5), with_arrays(change)).reason


@pytest.mark.parametrize("name", ["sts-3d", "mortar-3d", "vts-cell-3d"])
def test_the_area_of_a_needle_in_space_is_rounded_by_its_length_and_nobody_is_accused(name: str) -> None:
    """Found in 700 cases: areas on faces 4096 and 256 times as long as wide were 1.7 and 1.3 tolerances off."""
    right = load_subject(name)
    question = load_property("projection.area").for_traits(right.traits)
    cases = draw_cases(question.cases(None), seed="faces/projection.area", examples=160).cases
    for case in (cases[78], cases[159]):
        assert judge_case(question, case, right).verdict is Verdict.PASS


def test_in_space_too_a_penetration_of_more_than_two_lengths_is_left_out() -> None:
    sheets = grid([0.0, 1.0, 8.0], [0.0, 1.0, 8.0]), grid([-1.0, 0.5, 9.0], [-1.0, 0.5, 9.0])
    question = load_property("projection.activity")
    shallow, deep = (
        question.measure(flat_face_state("deep", *sheets, depth), load_subject("sts-3d")) for depth in (5.0, 12.0)
    )
    assert shallow.details["points left out"] < deep.details["points left out"]
