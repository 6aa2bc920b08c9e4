"""The hard cases: their exact forces, and what right and wrong formulations get."""

from fractions import Fraction
from functools import partial
from math import hypot
from typing import Any

import numpy as np
import pytest
from exact_projection import project_point
from hard_strangers import PointSprings, Softened
from planned_cases import draw_cases
from subjects import load_property, load_subject, with_promises

from contactverif import Body, Measurement, Outcome, Property, Subject, Verdict, judge_case, load_properties
from contactverif.contract.case import Case
from contactverif.contract.traits import Rules, Traits
from contactverif.mechanics import bulk
from contactverif.mechanics.scene import forget_bodies
from contactverif.plugins.registry import property_ids
from contactverif.problems.flat_states import (
    STEEP,
    TURNED,
    UPRIGHT,
    deep_states,
    node_hit_states,
    offset_states,
    read_frame,
    search_states,
    tiny_segment_states,
    touching_states,
)
from contactverif.problems.hard_corner_states import concave_corner_states, convex_kink_states
from contactverif_nts import nts, vts_me, vts_ppt_balanced
from contactverif_properties.applicability import knows_total
from contactverif_properties.hard import covered_share

TURNS = (UPRIGHT, TURNED, STEEP)
FLAT_STATES = [*offset_states(), *deep_states(), *node_hit_states(), *search_states(), *tiny_segment_states()]


@pytest.mark.parametrize("case", FLAT_STATES, ids=lambda case: case.name)
def test_a_flat_state_is_flat_to_the_last_bit_and_nearest_to_its_flat_part_and_its_forces_balance(case: Case) -> None:
    n_slave, direction = case.interface.n_slave_nodes, case.parameters["direction"]
    loaded = np.flatnonzero(case.parameters["weights"])
    on_master, depth = loaded[loaded >= n_slave], Fraction(case.parameter("penetration"))
    p, q, r = next(turn for turn in TURNS if np.allclose(direction, np.array(turn[:2]) / turn[2]))
    heights = [height for (height,) in read_frame(case.positions, [(-q, p)], r, case.positions[on_master[0]])]
    assert set(heights[:n_slave]) == {-depth}
    assert {heights[node] for node in on_master} == {0}
    for segment in range(len(case.interface.slave)):
        for c in (-1.0, -0.5, 0.0, 0.5, 1.0):
            projection = project_point(case.interface, case.z, segment, c)
            assert np.isin(case.interface.master.segments[projection.segment], loaded).all()
            assert -projection.signed_squared_gap == depth**2
    forces, arms = load_property("hard.offset").exact(case), case.positions - case.positions[0]
    size = np.abs(forces).sum()
    assert np.abs(forces.sum(axis=0)).max() <= 1e-15 * size
    moment = float((arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum())
    assert abs(moment) <= 1e-14 * size * case.diameter


def test_near_1e8_the_stored_gap_is_one_step_of_the_doubles() -> None:
    (case,) = (case for case in offset_states() if case.name == "1e8, gap of one step")
    assert case.parameter("penetration") == float(np.spacing(1e8))


def test_surfaces_touch_exactly_at_1000_angles() -> None:
    angles = set()
    for case in touching_states():
        if case.parameter("shift") != 0:
            continue
        for segment in range(len(case.interface.slave)):
            assert project_point(case.interface, case.z, segment, -1.0).signed_squared_gap == 0
            assert project_point(case.interface, case.z, segment, 0.5).signed_squared_gap == 0
        angles |= {tuple(direction) for direction in case.parameters["directions"].tolist()}
    assert len(angles) == 1000


def test_no_surface_in_touch_is_above_or_below_another_pair() -> None:
    """Along a slave segment the masters of other pairs lie before its first node or past its second one."""
    for case in touching_states():
        x = case.positions
        for first, second in case.interface.slave.segments:
            along = x[second] - x[first]
            direction = case.parameters["directions"][first]
            for segment in case.interface.master.segments:
                places = (x[segment] - x[first]) @ along / (along @ along)
                own = (case.parameters["directions"][segment[0]] == direction).all()
                assert own or places.max() < 0 or places.min() > 1


@pytest.mark.parametrize("shift", [1e-16, -1e-16])
def test_stored_gaps_of_1e_16_have_either_sign_or_none(shift: float) -> None:
    signs = {
        project_point(case.interface, case.z, 0, -1.0).gap_sign
        for case in touching_states()
        if case.parameter("shift") == shift
    }
    assert signs >= {int(np.sign(shift))}


@pytest.mark.parametrize("case", [*convex_kink_states(), *concave_corner_states()], ids=lambda case: case.name)
def test_the_nearest_segments_give_a_total_within_the_bounds(case: Case) -> None:
    """The midpoints of 64 parts of each segment, in rationals, along the normals of the nearest segments."""
    total = np.zeros(2)
    parts = 64
    for segment, length in enumerate(case.interface.slave.lengths(case.positions)):
        for part in range(parts):
            projection = project_point(case.interface, case.z, segment, -1 + (2 * part + 1) / parts)
            assert projection.gap_sign < 0
            first, second = case.positions[case.interface.master.segments[projection.segment]]
            along = (second - first) / hypot(*(second - first))
            gap = float(-projection.signed_squared_gap) ** 0.5
            total += length / parts * gap * np.array([along[1], -along[0]])
    low, high = case.parameters["segment_bounds"]
    assert low * (1 - 1e-12) <= total @ case.parameters["axis"] <= high * (1 + 1e-12)
    wide_low, wide_high = case.parameters["bounds"]
    assert wide_low <= low * (1 + 1e-12)
    assert high <= wide_high * (1 + 1e-12)


def test_a_total_is_known_of_distributed_springs_alone() -> None:
    known = {name: knows_total(load_subject(name).traits) for name in ("nts", "nts-ar", "two-pass/nts-ar", "sts")}
    assert known == {"nts": False, "nts-ar": True, "two-pass/nts-ar": False, "sts": True}


HARD = [name for name in property_ids() if name.startswith("hard.")]


def cases_of(property_id: str) -> dict[str, Case]:
    return {case.name: case for case in load_property(property_id).cases(None)}


def judge_named(property_id: str, name: str, subject: Subject) -> Outcome:
    return judge_case(load_property(property_id), cases_of(property_id)[name], subject)


def measure_named(property_id: str, name: str, subject: Subject) -> Measurement:
    return load_property(property_id).measure(cases_of(property_id)[name], subject)


@pytest.mark.parametrize("property_id", HARD)
def test_a_hard_case_asks_nothing_of_a_given_interface(property_id: str) -> None:
    question = load_property(property_id)
    assert question.cases(next(iter(question.cases(None))).interface) is None


def test_a_barrier_is_not_asked_about_penetrations_and_touch() -> None:
    barrier = Traits(rules=Rules(enforcement="barrier"))
    assert all(load_property(property_id).refusal(barrier) for property_id in HARD)


def test_far_away_only_who_promises_stability_gets_the_small_tolerance() -> None:
    stable, silent = (
        measure_named("hard.offset", "1e6, gap 1e-6", with_promises(vts_ppt_balanced, translation_stable=promise))
        for promise in (True, None)
    )
    name = "error of a nodal force"
    assert stable.tolerances[name] < 1e-8 < 1e-4 < silent.tolerances[name]
    unsure = with_promises(vts_me, translation_stable=None)
    assert judge_named("hard.offset", "1e8, gap of one step", unsure).verdict is Verdict.UNDECIDED


def test_points_first_far_away_break_the_promise_of_stability() -> None:
    make = partial(PointSprings, places=(0.21132486540518713, 0.7886751345948129))
    boaster = with_promises(make, translation_stable=True)
    outcome = judge_named("hard.offset", "1e6, gap 1e-6, turned 3-4-5", boaster)
    assert outcome.verdict is Verdict.FAIL
    assert "error of the total force" in outcome.reason


def test_the_detail_shows_the_jump_where_a_node_passes_the_tolerance_of_a_free_end() -> None:
    """NTS-AR has τ = 0.01: then the node is lost, and with it half of the first segment."""
    before, past = (
        measure_named("hard.free-end", f"first node {share} of a segment past the end", load_subject("nts-ar")).details
        for share in (0.0099, 0.0101)
    )
    name, loss = "share of the upper bound", (0.75 + 0.0101) / 2 / (3.0 + 0.0101)
    assert [before[name], past[name]] == pytest.approx([1.0, 1 - loss], abs=1e-12)


def test_a_force_on_a_slave_beside_the_master_is_said_in_words() -> None:
    class Everywhere(PointSprings):
        def _decide(self, interface: Any, x: Any, point: Any) -> tuple[int, bool]:
            return super()._decide(interface, x, point)[0], True

    outcome = judge_named("hard.free-end", "wholly outside by a segment", Subject("x", Everywhere))
    assert outcome.verdict is Verdict.FAIL
    assert outcome.reason.startswith("a force of 2 on a slave that faces no master")


@pytest.mark.parametrize(("exponent", "lack"), [(1, 0), (12, 1)])
def test_multipliers_lose_rank_as_the_overlap_vanishes(exponent: int, lack: int) -> None:
    outcome = judge_named("hard.dead-zone", f"overlap 1e-{exponent}", load_subject("two-pass/nts-lm"))
    assert outcome.verdict is Verdict.PASS, outcome.reason
    assert outcome.measurement.details["lack of rank"] == lack


def test_springs_keep_their_condition_as_the_overlap_vanishes() -> None:
    conditions = []
    for exponent in (1, 6, 12):
        name = f"overlap 1e-{exponent}"
        assert covered_share(cases_of("hard.dead-zone")[name]) == pytest.approx(10.0**-exponent, rel=2e-3)
        details = measure_named("hard.dead-zone", name, load_subject("mortar")).details
        conditions.append(details["reciprocal condition"])
    assert max(conditions) <= 1.5 * min(conditions)


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
    outcome = judge_named("hard.touch", "gap -1e-16, 16°", with_promises(nts, penalty=None, gap=None))
    assert outcome.verdict is Verdict.PASS
    assert outcome.measurement.values["stiffness across the surface"] == pytest.approx(3 / 1.125)


def test_without_a_load_a_law_that_is_not_linear_is_not_accused() -> None:
    for name in ("free, pushed in", "held, touching"):
        outcome = judge_named("hard.zero-load", name, Subject("soft", Softened))
        assert outcome.verdict in (Verdict.PASS, Verdict.UNDECIDED)


WITHOUT_BODIES = [item.id for item in load_properties(["*"]) if isinstance(item, Property) and not item.bodies]
MOST_FACTORISED = {"patch.flat.solve": 2, "patch.variants": 2, "newton.units": 4, "newton.attainable": 4}


@pytest.mark.parametrize("property_id", WITHOUT_BODIES)
def test_a_property_without_bodies_builds_none(property_id: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Any) -> None:
        raise AssertionError("a body")

    question, subject = load_property(property_id), load_subject("vts-ppt")
    monkeypatch.setattr(Body, "__post_init__", refuse)
    cases = draw_cases(question.cases(None), seed="0", examples=3).cases
    for case in cases[:3]:
        judge_case(question, case, subject)


@pytest.mark.parametrize("property_id", MOST_FACTORISED)
def test_each_mesh_is_factorised_once(property_id: str) -> None:
    """Two penalties share their bodies, also far from the origin; rounded nodes and other units are new meshes."""
    question, subject = load_property(property_id), load_subject("vts-ppt")
    (case,) = draw_cases(question.cases(None), seed="1", examples=1).cases
    forget_bodies()
    assert judge_case(question, case, subject).verdict is Verdict.PASS
    assert 0 < bulk._factorise.cache_info().misses <= MOST_FACTORISED[property_id]


def test_bodies_with_other_loads_share_a_factorisation_on_hertz_meshes() -> None:
    question, subject = load_property("accuracy.hertz"), load_subject("vts-ppt")
    forget_bodies()
    for case in question.cases(None)[:3]:
        judge_case(question, case, subject)
    assert bulk._factorise.cache_info().misses <= 8  # Four meshes of each body, whatever the penalty.
