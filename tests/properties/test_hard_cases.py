"""The hard cases: nobody right is accused, what is promised is asked, and details say what nobody promises."""

from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from hard_strangers import PointSprings, Softened, simpson, trapezoid
from subjects import load_property, load_subject, with_promises

import contactverif_nts
from contactverif import Case, Measurement, Outcome, Subject, Verdict, judge_case
from contactverif.contract.traits import Evidence, PatchPromises, Promises, Rules, Traits
from contactverif.plugins.registry import property_ids
from contactverif_properties.hard import covered_share

HARD = [name for name in property_ids() if name.startswith("hard.")]
STATES = [name for name in HARD if not load_property(name).bodies]
STRANGERS: dict[str, Callable[..., Any]] = {
    "quarter points": PointSprings,
    "the last of equals": partial(PointSprings, last=True),
    "nodes": trapezoid,
    "nodes with a wide tolerance": partial(trapezoid, last=True, tau=0.05),
    "Simpson's rule": partial(simpson, tau=0.01),
    "no traits": partial(simpson, stated=False),
    "a law that is not linear": Softened,
}


def cases_of(property_id: str) -> dict[str, Case]:
    return {case.name: case for case in load_property(property_id).cases(None)}


def judge_named(property_id: str, name: str, subject: Subject) -> Outcome:
    return judge_case(load_property(property_id), cases_of(property_id)[name], subject)


def measure_named(property_id: str, name: str, subject: Subject) -> Measurement:
    return load_property(property_id).measure(cases_of(property_id)[name], subject)


@pytest.mark.parametrize("property_id", STATES)
@pytest.mark.parametrize("name", STRANGERS)
def test_a_right_formulation_by_a_stranger_is_not_accused(name: str, property_id: str) -> None:
    make = STRANGERS[name]
    stranger, question = Subject(name, lambda *, penalty: make(penalty)), load_property(property_id)
    if question.promise(stranger.traits) is not True:
        return
    outcomes = [judge_case(question, case, stranger) for case in question.cases(None)]
    assert {outcome.reason for outcome in outcomes if outcome.verdict in (Verdict.FAIL, Verdict.CRASHED)} == set()
    assert sum(outcome.decided for outcome in outcomes) >= 0.9 * len(outcomes)


@pytest.mark.parametrize("property_id", HARD)
def test_a_hard_case_asks_nothing_of_a_given_interface(property_id: str) -> None:
    question = load_property(property_id)
    assert question.cases(next(iter(question.cases(None))).interface) is None


def test_a_barrier_is_not_asked_about_penetrations_and_touch() -> None:
    barrier = Traits(rules=Rules(enforcement="barrier"))
    assert all(load_property(property_id).refusal(barrier) for property_id in HARD)


# --- far from the origin ------------------------------------------------------------------------------------------


def test_far_away_only_who_promises_stability_gets_the_small_tolerance() -> None:
    stable = with_promises(contactverif_nts.vts_ppt_balanced, translation_stable=True)
    silent = with_promises(contactverif_nts.vts_ppt_balanced, translation_stable=None)
    tolerances = [
        measure_named("hard.offset", "1e6, gap 1e-6", subject).tolerances["error of a nodal force"]
        for subject in (stable, silent)
    ]
    assert tolerances[0] < 1e-8 < 1e-4 < tolerances[1]


def test_points_first_far_away_break_the_promise_of_stability() -> None:
    class Boaster(PointSprings):
        def __init__(self, penalty: float) -> None:
            super().__init__(penalty, places=(0.21132486540518713, 0.7886751345948129))
            self.traits = Traits(
                promises=Promises(patch=PatchPromises(flat=False), translation_stable=True),
                rules=Rules(area="current", penalty="distributed"),
                evidence=Evidence(witnesses={"patch": "c"}),
            )

    boaster = Subject("boaster", lambda *, penalty: Boaster(penalty))
    outcome = judge_named("hard.offset", "1e6, gap 1e-6, turned 3-4-5", boaster)
    assert outcome.verdict is Verdict.FAIL
    assert "error of the total force" in outcome.reason


def test_a_gap_of_one_step_is_undecided_without_that_promise() -> None:
    silent = with_promises(contactverif_nts.vts_me, translation_stable=None)
    assert judge_named("hard.offset", "1e8, gap of one step", silent).verdict is Verdict.UNDECIDED


# --- the search ---------------------------------------------------------------------------------------------------


# --- ends and overlaps --------------------------------------------------------------------------------------------


def test_the_detail_shows_the_jump_where_a_node_passes_the_tolerance_of_a_free_end() -> None:
    """NTS-AR has τ = 0.01: then the node is lost, and with it half of the first segment."""
    shares = [
        measure_named("hard.free-end", f"first node {share} of a segment past the end", load_subject("nts-ar")).details
        for share in (0.0099, 0.0101)
    ]
    loss = (0.75 + 0.0101) / 2 / (3.0 + 0.0101)
    assert [each["share of the upper bound"] for each in shares] == pytest.approx([1.0, 1 - loss], abs=1e-12)


def test_a_force_on_a_slave_beside_the_master_is_said_in_words() -> None:
    class Everywhere(PointSprings):
        def _decide(self, interface: Any, x: Any, point: Any) -> tuple[int, bool]:
            return super()._decide(interface, x, point)[0], True

    outcome = judge_named(
        "hard.free-end", "wholly outside by a segment", Subject("x", lambda *, penalty: Everywhere(penalty))
    )
    assert outcome.verdict is Verdict.FAIL
    assert outcome.reason.startswith("a force of 2 on a slave that faces no master")


@pytest.mark.parametrize(("exponent", "lack"), [(1, 0), (12, 1)])
def test_multipliers_lose_rank_as_the_overlap_vanishes(exponent: int, lack: int) -> None:
    outcome = judge_named("hard.dead-zone", f"overlap 1e-{exponent}", load_subject("two-pass/nts-lm"))
    assert outcome.verdict is Verdict.PASS, outcome.reason
    assert outcome.measurement is not None
    assert outcome.measurement.details["lack of rank"] == lack


def test_springs_keep_their_condition_as_the_overlap_vanishes() -> None:
    conditions = [
        measure_named("hard.dead-zone", f"overlap 1e-{exponent}", load_subject("mortar")).details[
            "reciprocal condition"
        ]
        for exponent in (1, 6, 12)
    ]
    assert max(conditions) <= 1.5 * min(conditions)


def test_the_covered_share_is_that_of_the_last_segment() -> None:
    for exponent in (1, 7, 12):
        case = cases_of("hard.dead-zone")[f"overlap 1e-{exponent}"]
        assert covered_share(case) == pytest.approx(10.0**-exponent, rel=2e-3)


# --- touch --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "allowed", "measured"),
    [
        ("vts-me", 1.0, 1.0),
        ("mortar-dual", 1.0, 1.0),
        ("nts", 1.5, 1.5),  # Three nodes for two segments.
        ("two-pass/nts", 3.5, 2.5),  # Four more nodes on the master, two of which face the slave.
        ("two-pass/nts-ar", 1 + 1.75 / 1.125, 2.0),
    ],
)
def test_in_touch_no_more_springs_act_than_the_traits_allow(name: str, allowed: float, measured: float) -> None:
    measurement = measure_named("hard.touch", "gap -1e-16, 16°", load_subject(name))
    across = "stiffness across the surface"
    assert measurement.tolerances[across] == pytest.approx(allowed, rel=1e-8)
    assert measurement.values[across] == pytest.approx(measured, rel=1e-14)


def test_in_touch_a_penalty_without_a_unit_may_be_that_of_a_node() -> None:
    silent = with_promises(contactverif_nts.nts, penalty=None, gap=None)
    outcome = judge_named("hard.touch", "gap -1e-16, 16°", silent)
    assert outcome.verdict is Verdict.PASS
    assert outcome.measurement is not None
    assert outcome.measurement.values["stiffness across the surface"] == pytest.approx(3 / 1.125)


def test_without_a_load_a_law_that_is_not_linear_is_not_accused() -> None:
    soft = Subject("soft", lambda *, penalty: Softened(penalty))
    for name in ("free, pushed in", "held, touching"):
        assert judge_named("hard.zero-load", name, soft).verdict in (Verdict.PASS, Verdict.UNDECIDED)
