"""The flat patch tests by class of meshes, tilted slaves, the total stiffness, and the worst force in words."""

import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hard_strangers import PointSprings, Softened
from planned_cases import draw_cases
from subjects import Changed, judge_as, load_property, load_subject, reporting, with_promises, with_verbs
from textbook_cells import ClippedCells
from zoo.at_points import PointsFirst, TurnedFrame
from zoo.on_strips import SegmentPenalty

from contactverif import Case, Interface, PatchPromises, Promises, Rules, Subject, Traits, Verdict, judge_case
from contactverif.contract.traits import parse_forces
from contactverif.problems.catalogue import load_scene_case
from contactverif.problems.named_states import FLAT_NAMES, named_case
from contactverif.run.run import run
from contactverif_nts.point_contact import FORCE_TABLES
from contactverif_properties.exact_forces import (
    directions,
    exact_slave_forces,
    forces_of_penetration,
    node_gaps,
    show_force,
    weighted_forces,
    worst_force,
)
from contactverif_properties.invariants import BITS
from contactverif_properties.patch_flat import LOST_END, SLIGHT, STEEP, TILTED

NORMAL, SINGLE, NODAL, PUBLISHED = (f"patch.flat.{name}" for name in ("normal", "single", "nodal", "published"))


def draw(property_id: str, seed: int = 0, examples: int = 30) -> list[Case]:
    cases = load_property(property_id).cases(None)
    return list(cases if isinstance(cases, tuple) else draw_cases(cases, seed=f"{seed}", examples=examples).cases)


@pytest.mark.parametrize("name", ["nts-ar:tau=0", "nts-lm:tau=0"])
def test_only_an_end_that_roundoff_loses_is_undecided(name: str) -> None:
    question, subject = load_property(NORMAL), load_subject(name)
    outcomes = [judge_case(question, case, subject) for case in draw(NORMAL, examples=100)]
    reasons = {outcome.reason for outcome in outcomes if not outcome.decided}
    assert reasons == {LOST_END}
    assert Verdict.FAIL not in {outcome.verdict for outcome in outcomes}


def test_a_textbook_normal_of_a_needle_in_space_is_not_accused() -> None:
    """A master triangle is 64 times as long as high; a gap from its cross product is off by 5.1e-8."""

    def from_cross_product(right: Any, interface: Interface, pairing: Any, z: Any) -> Any:
        points, x = right(interface, pairing, z), z.reshape(-1, 3)
        a, b, c = np.moveaxis(x[interface.master.faces[points.master_segment]], 1, 0)
        normal = np.cross(b - a, c - a)
        nodes = interface.slave.faces[points.slave_segment, points.slave_shape.argmax(axis=1)]
        return replace(points, gap=((x[nodes] - a) * normal).sum(axis=1) / np.linalg.norm(normal, axis=1))

    textbook = with_verbs("nts-ar-3d", contact_points=from_cross_product)
    question = load_property(NORMAL).for_traits(load_subject("nts-ar-3d").traits)
    needle = draw_cases(question.cases(None), seed="2", examples=100).cases[98]
    measurement = judge_as(Verdict.PASS, question, needle, textbook).measurement
    assert measurement is not None
    assert measurement.values["error of a reported gap"] > 4e-8


class ProductsOfPositions:
    """Exact segments, whose gaps are wrong by what overhangs times the distance from the origin, as in D x − M x."""

    traits = Traits(Promises(patch=PatchPromises(flat=True)), Rules(penalty="distributed", area="current"))

    def __init__(self, *, penalty: float) -> None:
        self.springs = SegmentPenalty(penalty=penalty)
        self.pair = self.springs.pair

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x, forces = z.reshape(-1, 2), self.springs.residual(interface, pairing, z).reshape(-1, 2)
        along = np.diff(x[interface.slave.segments[0]], axis=0)[0]
        slave, master = np.split(x @ (along / np.linalg.norm(along)), [interface.n_slave_nodes])
        overhang = max(0.0, slave.max() - master.max(), master.min() - slave.min())
        forces[0] += self.springs.penalty * overhang * np.abs(x).max() * forces[0] / np.linalg.norm(forces[0])
        return forces.reshape(z.shape)


@pytest.mark.parametrize(("stable", "verdict"), [(None, Verdict.UNDECIDED), (True, Verdict.FAIL)])
def test_what_overhangs_by_a_rounding_excuses_an_error_of_that_size(stable: bool | None, verdict: Verdict) -> None:
    subject = with_promises(ProductsOfPositions, translation_stable=stable)
    question = load_property("patch.flat.transmission")
    verdicts = {judge_case(question, case, subject).verdict for case in draw("patch.flat.transmission", examples=200)}
    assert verdicts == {Verdict.PASS, verdict}


def test_a_force_lost_elsewhere_is_a_failure_though_an_end_is_lost_too() -> None:
    class Forgetful(PointsFirst):
        """It leaves out every point on a master node."""

        def contact_points(self, *arguments: Any) -> Any:
            points = super().contact_points(*arguments)
            off = np.minimum(np.abs(points.xi), np.abs(1 - points.xi)) > 1e-6
            return replace(points, active=points.active & off, pressure=np.where(off, points.pressure, 0.0))

    question, subject = load_property(NORMAL), with_promises(Forgetful, normal=True)
    masters = ((case, case.interface.master.segments) for case in draw(NORMAL))
    cases = [case for case, segments in masters if np.intersect1d(*segments.T).size]
    assert len(cases) > 5
    assert {judge_case(question, case, subject).verdict for case in cases} == {Verdict.FAIL}


@pytest.mark.parametrize("exponent", [-6, -9, -12])
@pytest.mark.parametrize("quantity", ["gap", "pressure"])
def test_what_is_reported_may_not_be_off_by_little(quantity: str, exponent: int) -> None:
    def change(points: Any) -> Any:
        return replace(points, **{quantity: getattr(points, quantity) * (1 + 10.0**exponent)})

    question, subject = load_property(SINGLE), with_promises(reporting(change, TurnedFrame)._make, single=True)
    assert Verdict.FAIL in [judge_case(question, case, subject).verdict for case in draw(SINGLE)]


@pytest.mark.parametrize("name", ["nts", "nts-ar", "vts-g"])
def test_the_single_class_tells_vts_me_from_the_others(name: str) -> None:
    for property_id in (SINGLE, f"{SINGLE}.solve"):
        question = load_property(property_id)
        case = load_scene_case("b") if question.bodies else named_case("b")
        assert judge_case(question, case, load_subject(name)).verdict is Verdict.FAIL
        assert judge_case(question, case, load_subject("vts-me")).verdict is Verdict.PASS


@pytest.mark.parametrize(
    ("patch", "promises"),
    [
        (PatchPromises(flat=True), [True, True]),
        (PatchPromises(single=True), [True, True]),
        (PatchPromises(normal=True), [True, None]),
        (PatchPromises(flat=False), [None, None]),
    ],
)
def test_who_promises_a_larger_class_promises_the_smaller_ones(patch: PatchPromises, promises: list[Any]) -> None:
    traits = Traits(promises=Promises(patch=patch))
    assert [load_property(property_id).promise(traits) for property_id in (NORMAL, SINGLE)] == promises


def test_scenes_of_another_class_are_not_asked_about() -> None:
    normal, single = (load_property(f"{property_id}.solve").cases for property_id in (NORMAL, SINGLE))
    assert normal(load_scene_case("b")) is None
    assert single(load_scene_case("b")) is not None
    assert normal(load_scene_case("a2-graded")) is not None
    assert single(load_scene_case("c")) is None
    assert single(load_scene_case("dead-zone")) is None


# Stated forces


def _by_hand(name: str, rule: Callable[[list[Fraction]], list[tuple[Fraction, Fraction]]]) -> Any:
    """Return forces on slave and master: `rule` gives places and forces on the slave from the places of its nodes."""
    case = named_case(name)
    sides = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
    slave, master = (sorted(Fraction(float(x)).limit_denominator(100) for x in side) for side in sides)
    points = rule(slave)
    return tuple(tuple(_share(points, nodes)) for nodes in (slave, master))


def _share(points: list[tuple[Fraction, Fraction]], nodes: list[Fraction]) -> list[Fraction]:
    """Share forces at places between the nodes on their left and on their right by the lever rule."""
    shares = [Fraction(0)] * len(nodes)
    for place, force in points:
        right = next(number for number, node in enumerate(nodes) if node >= place)
        left = max(right - 1, 0)
        part = (place - nodes[left]) / (nodes[right] - nodes[left]) if right else Fraction(0)
        shares[left] += (1 - part) * force
        shares[right] += part * force
    return shares


def _units(nodes: list[Fraction]) -> list[tuple[Fraction, Fraction]]:
    return [(node, Fraction(1)) for node in nodes]


def _areas(nodes: list[Fraction]) -> list[tuple[Fraction, Fraction]]:
    halves = [(b - a) / 2 for a, b in pairwise(nodes)]
    return [(node, a + b) for node, a, b in zip(nodes, [Fraction(0), *halves], [*halves, Fraction(0)], strict=True)]


def _quarters(nodes: list[Fraction]) -> list[tuple[Fraction, Fraction]]:
    return [(a + (b - a) * k / 4, (b - a) / 2) for a, b in pairwise(nodes) for k in (1, 3)]


@pytest.mark.parametrize(
    ("table", "rule"),
    [(FORCE_TABLES["nts"], _units), (FORCE_TABLES["nts-ar"], _areas), (FORCE_TABLES["vts-me"], _quarters)],
    ids=["NTS", "NTS-AR", "VTS-ME"],
)
def test_the_tables_are_what_the_lever_rule_gives_by_hand(table: Any, rule: Any) -> None:
    assert set(table) == set(FLAT_NAMES)
    for name, text in table.items():
        assert parse_forces(text) == _by_hand(name, rule)


def test_nested_passes_act_four_times() -> None:
    once, twice = (
        load_subject(f"{prefix}nts").traits.evidence.published_forces["b"] for prefix in ("", "two-pass/two-pass/")
    )
    here, _ = parse_forces(once)
    _, there = parse_forces(load_subject("nts").traits.evidence.published_forces["b-swapped"])
    expected = tuple(2 * (a + b) for a, b in zip(here, there, strict=True))
    assert parse_forces(twice)[0] == expected


@pytest.mark.parametrize(
    ("forces", "message"),
    [
        ({"d": "1 2 1; 2 2"}, "found d; needed names of flat cases: a1, "),
        ({"a1": "1 2; 2 2"}, "found 2 and 2 forces on a1; needed 3 on the slave nodes and 2 on the master nodes"),
    ],
)
def test_a_table_of_another_mesh_breaks_the_contract(forces: dict[str, str], message: str) -> None:
    subject = with_promises(PointsFirst, published_forces=forces)
    outcome = judge_case(load_property(PUBLISHED), named_case("a1"), subject)
    assert outcome.breach
    assert message in outcome.reason


def test_nothing_is_asked_where_nothing_is_known() -> None:
    subject = with_promises(PointsFirst, published_forces={"a1": "1 2 1; 2 2"})
    question = load_property(PUBLISHED)
    outcomes = {name: judge_case(question, named_case(name), subject) for name in ("a1", "b")}
    assert all(outcome.verdict is Verdict.PASS for outcome in outcomes.values())
    idle = {name: outcome.measurement is not None and outcome.measurement.idle for name, outcome in outcomes.items()}
    assert idle == {"a1": False, "b": True}
    (row,) = run([subject], [question]).rows
    assert (row.verdict, row.unexpected) == (Verdict.PASS, "")


@pytest.mark.parametrize(("area", "promised"), [("reference", "current"), ("current", "reference")])
def test_a_total_of_the_other_configuration_says_what_it_follows(area: str, promised: str) -> None:
    inner, id_ = load_subject(f"nts-ar:area={area}"), "patch.flat.resultant"
    subject = with_promises(lambda *, penalty: inner.with_penalty(penalty).plugin, area=promised)
    outcomes = [judge_case(load_property(id_), case, subject) for case in draw(id_, examples=10)]
    reasons = [outcome.reason for outcome in outcomes if outcome.verdict is Verdict.FAIL]
    follows = f"the force follows the {area} area, and area='{promised}' is promised"
    assert reasons
    assert all(re.search(rf"; on a reference \S+ times as long, .*; {follows}", reason) for reason in reasons)


SCALE = load_property("total-stiffness")
CASES = {case.name: case for case in SCALE.cases(None)}
SILENT = Traits()


def scale_springs(factor: float, traits: Traits) -> Subject:
    """Return quarter-point springs of another stiffness, which state these traits."""
    return Subject("scaled", lambda *, penalty: Changed(PointSprings(factor * penalty), traits=traits))


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_without_a_trait_one_pass_and_two_passes_pass(factor: float, name: str) -> None:
    outcome = judge_as(Verdict.PASS, SCALE, CASES[name], scale_springs(factor, SILENT))
    assert outcome.measurement.details["springs over ε̂ L"] == pytest.approx(factor)
    sentences = {1.0: "None", 2.0: "your springs are 2.00 ε̂ L: two passes, or twice too stiff"}
    assert str(outcome.measurement.finding) == sentences[factor]


@pytest.mark.parametrize("factor", [3.0, 1 / 3, 1.5, 0.5, 4.0, -1.0, 0.0])
def test_another_factor_fails_in_silence_too(factor: float) -> None:
    for case in CASES.values():
        outcome = judge_as(Verdict.FAIL, SCALE, case, scale_springs(factor, SILENT))
        assert f"your springs are {factor:#.3g} ε̂ L: one pass has 1 ε̂ L, two passes have 2 ε̂ L" in outcome.reason


def test_a_long_interface_shows_what_a_short_one_hides() -> None:
    """Half a percent too stiff, in space a little more, and the number of a segment in one byte."""

    def pair(right: Any, *state: Any) -> Any:
        pairing = dict(right(*state))
        (name,) = (key for key, numbers in pairing.items() if numbers.dtype == np.int64 and numbers.max() > 200)
        return {**pairing, name: pairing[name].astype(np.uint8).astype(np.int64)}

    long = CASES["304 segments"]
    judge_as(Verdict.FAIL, SCALE, long, scale_springs(1.005, SILENT))
    judge_as(Verdict.PASS, SCALE, CASES["16 segments, stiff"], scale_springs(1.005, SILENT))
    judge_as(Verdict.FAIL, SCALE, long, with_verbs(PointSprings, pair=pair))
    right = load_subject("sts-3d")
    in_space = SCALE.for_traits(right.traits)
    for factor, verdict in ((1.0065, Verdict.PASS), (1.0075, Verdict.FAIL)):  # 1/144 lies between.
        stiff = Subject("stiff", lambda *, penalty, factor=factor: right._make(penalty=factor * penalty))
        judge_as(verdict, in_space, in_space.cases(None)[-1], stiff)


def test_a_master_that_gets_more_than_the_slave_fails_whatever_is_promised() -> None:
    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        forces = np.array(right(interface, pairing, z))
        forces[2 * interface.n_slave_nodes :] *= 1.5
        return forces

    for case in CASES.values():
        outcome = judge_as(Verdict.FAIL, SCALE, case, with_verbs("nts", residual=residual))
        assert "the master gets 1.6" in outcome.reason or "the master gets 1.5" in outcome.reason


def test_springs_that_state_their_area_act_once() -> None:
    traits = Traits(rules=Rules(penalty="distributed", area="current"))
    outcome = judge_as(Verdict.FAIL, SCALE, CASES["8 segments"], scale_springs(2.0, traits))
    assert outcome.reason.endswith("your springs are 2.00 ε̂ L: one pass has 1 ε̂ L")


@pytest.mark.parametrize("name", ["nts", "two-pass/nts"])
def test_nodal_springs_pass_whether_they_state_their_unit_or_not(name: str) -> None:
    right = load_subject(name)
    for case in CASES.values():
        for subject in (right, with_promises(right._make, penalty=None, unbiased=None)):
            judge_as(Verdict.PASS, SCALE, case, subject)


def test_springs_that_lose_both_ends_to_roundoff_pass() -> None:
    def residual(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        ends = np.zeros(interface.n_nodes, bool)
        ends[interface.slave.segments[interface.slave.neighbours < 0]] = True
        return np.where(np.repeat(ends, 2), 0.0, right(interface, pairing, z))

    for case in CASES.values():
        judge_as(Verdict.PASS, SCALE, case, with_verbs("nts", residual=residual))


def test_a_law_that_is_not_linear_has_no_stiffness_and_is_not_judged() -> None:
    outcome = judge_case(SCALE, CASES["8 segments"], Subject("soft", Softened))
    assert outcome.verdict is Verdict.PASS
    assert not outcome.measurement.numbers
    assert 0 < outcome.measurement.details["springs over ε̂ L"] < 0.5


def test_multipliers_and_barriers_are_not_asked() -> None:
    assert SCALE.refusal(load_subject("nts-lm").traits)
    assert SCALE.refusal(Traits(rules=Rules(enforcement="barrier")))
    assert not SCALE.refusal(SILENT)
    assert SCALE.promise(SILENT)


def test_surfaces_are_equally_long_with_segments_of_the_mean_length_1() -> None:
    for case in CASES.values():
        along, interface = [Fraction(place) for place in case.parameters["along"].tolist()], case.interface
        slave, master = along[: interface.n_slave_nodes], along[interface.n_slave_nodes :]
        assert (min(slave), max(slave)) == (min(master), max(master))
        assert len(interface.slave) == len(interface.master) == max(slave) - min(slave) >= 8
        assert len(set(slave) & set(master)) == 2  # The ends.


def cases_of(property_id: str, examples: int = 8) -> tuple[Case, ...]:
    return draw_cases(load_property(property_id).cases(None), seed=f"straight/{property_id}", examples=examples).cases


def test_all_slaves_are_straight_tilted_and_wholly_in_contact() -> None:
    for case in cases_of("patch.tilted.resultant", 60):
        master, slave = directions(case)
        angle = np.degrees(np.arccos(float(master @ slave)))
        low, high = {TILTED: (3, 35), STEEP: (34, 89.1), SLIGHT: (0, 2)}[case.kind]
        assert low <= angle < high
        assert (node_gaps(case) < 0).all()
        n, points = case.interface.n_slave_nodes, case.positions
        heights = (points[:n] - points[0]) @ slave, (points[n:] - points[n]) @ master
        for side in heights:
            assert np.ptp(side) <= 2.0**-50 * case.largest_coordinate


def test_half_of_the_steep_slaves_are_tilted_by_80_to_88_degrees_and_no_gap_is_longer_than_two_segments() -> None:
    cases = [case for case in cases_of("patch.tilted.resultant", 200) if case.kind == STEEP]
    assert len(cases) == 67
    cosines = np.array([float(np.multiply(*directions(case)).sum()) for case in cases])
    assert (np.abs(np.degrees(np.arccos(cosines)) - 84) < 4).sum() >= 26
    for case, cosine in zip(cases, cosines, strict=True):
        deepest = -float(node_gaps(case).min()) / cosine
        assert deepest < 2 * case.interface.master.lengths(case.positions).min()


def test_only_who_states_no_rule_for_gaps_may_overlook_a_steep_slave() -> None:
    blind = with_verbs(ClippedCells, residual=lambda _, *state: np.zeros_like(state[-1]))._make
    question = load_property("patch.tilted.resultant")
    cases = {case.kind: case for case in cases_of(question.id)}
    assert set(cases) == {TILTED, STEEP, SLIGHT}
    for kind, gap, verdict in (
        (STEEP, None, Verdict.PASS),
        (TILTED, None, Verdict.FAIL),
        (STEEP, "slave normal", Verdict.FAIL),
    ):
        judge_as(verdict, question, cases[kind], with_promises(blind, force_along="slave normal", gap=gap))


def tilted_segment() -> Case:
    """One slave segment from (0, −1) to (4, −4) below a master on the x-axis: gaps −1 and −4, length 5."""
    nodes = np.array([[0.0, -1.0], [4.0, -4.0], [16.0, 0.0], [-16.0, 0.0]])
    interface = Interface.from_chains(nodes[:2] * [1, 0], nodes[2:])
    return Case(interface, nodes.reshape(-1), penalty=2.0)


def test_the_exact_forces_are_those_of_a_hand_calculation() -> None:
    case, traits = tilted_segment(), load_subject("vts-g").traits
    assert exact_slave_forces(case, traits) == pytest.approx(np.array([[0, 10.0], [0, 15.0]]))
    # Along the slave's normal, with cosine 4/5, gaps are 5/4 as long.
    assert exact_slave_forces(case, load_subject("sts").traits) == pytest.approx(
        1.25 * np.array([[6.0, 8.0], [9.0, 12.0]])
    )
    reference = load_subject("nts-ar:area=reference").traits
    assert exact_slave_forces(case, reference).sum(axis=0) == pytest.approx([0, 20.0])


@pytest.mark.parametrize(
    ("gaps", "pressures", "exact"),
    [
        ("standard", "standard", ["175/12", "50/3"]),
        ("dual", "dual", ["25/4", "25"]),
        ("standard", "dual", ["25/2", "75/4"]),
        ("dual", "standard", ["25/2", "75/4"]),
    ],
)
def test_weighted_gaps_have_an_answer_for_each_pair_of_shapes(gaps: Any, pressures: Any, exact: list[str]) -> None:
    traits = load_subject("mortar").traits.revise(gap_shapes=gaps, pressure_shapes=pressures)
    *_, forces = weighted_forces(tilted_segment(), traits)
    assert np.linalg.norm(forces, axis=1) == pytest.approx([float(Fraction(each)) for each in exact], rel=1e-15)


def test_a_force_along_the_other_normal_is_told_by_its_direction() -> None:
    question = load_property("patch.tilted.resultant")
    outcome = judge_case(question, tilted_segment(), with_promises(ClippedCells, force_along="master normal"))
    assert outcome.verdict is Verdict.FAIL
    assert outcome.reason.startswith("part of the force off the normal 0.6")


@pytest.mark.parametrize("name", ["nts-ar", "vts-ppt-balanced", "sts", "mortar", "two-pass/nts", "nts-lm"])
def test_our_own_formulations_keep_every_bit_beside_a_bend(name: str) -> None:
    for case in cases_of("locality.bend"):
        measurement = load_property("locality.bend").measure(case, load_subject(name))
        assert measurement.details[BITS] == 0
        assert not measurement.idle


EXACT = forces_of_penetration(named_case("c"))


@pytest.mark.parametrize(
    ("factor", "remark"),
    [
        (2.0, "ratio 2"),
        (-1.0, "ratio -1"),
        (1 + 2.0**-40, "ratio 1 + 9.1e-13"),
        (1 - 2.0**-40, "ratio 1 − 9.1e-13"),
    ],
)
def test_a_factor_at_a_free_end_is_named(factor: float, remark: str) -> None:
    wrong = EXACT.copy()
    wrong[0] *= factor
    finding = worst_force(named_case("c").interface, wrong, EXACT)
    assert finding.place == "slave node 0 (free end)"
    assert finding.found == pytest.approx(factor * np.array(finding.right))
    assert finding.remark == remark
    assert str(finding).startswith("slave node 0 (free end): force ")


def test_a_force_aside_has_both_components() -> None:
    wrong = EXACT + np.where(np.arange(len(EXACT)) == 5, 1.0, 0.0)[:, None] * EXACT.max()
    finding = worst_force(named_case("c").interface, wrong, EXACT)
    assert len(finding.found) == 2
    assert "x and y" in finding.place


def test_nothing_beside_a_force_has_no_ratio() -> None:
    finding = show_force("", np.array([0.0, 2.0]), np.zeros(2))
    assert (finding.found, finding.right, finding.remark) == ((2.0,), (0.0,), "")
