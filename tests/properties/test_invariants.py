"""Two states with the same answer: other numbers, mirrored, roles exchanged, turned, in other units."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from handmade import Handmade, Springs, case, over_a_node, subject
from planned_cases import draw_cases
from subjects import judge_as, load_property, load_subject, with_promises
from textbook_springs import CentredSprings
from zoo.at_points import NearbyOnly, TurnedFrame

import contactverif_nts
from contactverif import Abilities, Case, Interface, Promises, Rules, Subject, Surface, Traits, Verdict, judge_case
from contactverif.run.run import run
from contactverif_properties.balance import RADII, symmetric
from contactverif_properties.invariants import (
    BEHIND,
    BITS,
    CLOSED,
    FAR,
    SCALED_FORCES,
    SCALED_TANGENT,
    objectivity,
    remote,
    renumbering,
    renumbering_cases,
    units,
)
from contactverif_properties.states import random_directions


def cases_of(property_id: str, examples: int = 10) -> tuple[Case, ...]:
    return draw_cases(load_property(property_id).cases(None), seed=f"same/{property_id}", examples=examples).cases


SEEDS = range(1, 30)


def ring_in_ring(slave: list[tuple[float, float]], master: list[tuple[float, float]]) -> Case:
    """Return two closed chains, whose numbers `renumbering` lets go round."""
    sides = [np.arange(len(slave)), len(slave) + np.arange(len(master))]
    segments = [np.column_stack([side, np.roll(side, -1)]) for side in sides]
    nodes = np.array([*slave, *master])
    interface = Interface(nodes, Surface(segments[0]), Surface(segments[1]))
    return Case(interface, nodes.reshape(-1), penalty=1.0, seed=0, kind=CLOSED)


# In the normal cone of a vertex both segments are equally near. Here a point penetrates one of them, and not the other.
@pytest.mark.parametrize(
    ("stranger", "slave", "master"),
    [
        (
            TurnedFrame,
            [(5.22, 0.03), (1.64, 4.95), (-4.15, 3.07), (-4.15, -3.02), (1.64, -4.9)],
            [(-2.06, -3.43), (-1.92, 3.51), (4, 0)],
        ),
        (NearbyOnly, [(5.5, 0), (-2.625, 4.75), (-2.625, -4.625)], [(0, -4), (0.125, 4), (4, 0)]),
    ],
)
def test_a_point_tied_to_a_segment_that_it_penetrates_and_one_that_it_does_not_accuses_nobody(
    stranger: Any, slave: list[tuple[float, float]], master: list[tuple[float, float]]
) -> None:
    judge_as(Verdict.PASS, renumbering, ring_in_ring(slave, master), Subject("stranger", stranger))


class NodalSprings(CentredSprings):
    """Springs of equal stiffness at all points, whatever their areas: the gradient of Σ ε g²/2."""

    traits = CentredSprings.traits.revise(symmetric=True, penalty="nodal", area=None)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 2)
        forces = np.zeros_like(x)
        for number, (_, a, b, c) in enumerate(self.points(interface)):
            if pairing["active"][number]:
                first, second = master = interface.master.segments[pairing["master"][number]]
                gap, xi, normal, _ = self.look(x, a, b, c, master)
                shares = ((a, (1 - c) / 2), (b, (1 + c) / 2), (first, xi - 1), (second, -xi))
                for node, share in shares:
                    forces[node] += share * self.law(gap) * normal
        return forces.reshape(-1)


def test_a_stranger_with_a_potential_is_not_accused() -> None:
    for state in cases_of("symmetric"):
        judge_as(Verdict.PASS, symmetric, state, Subject("nodal", NodalSprings))


def test_without_a_pairing_a_kink_inside_the_loop_is_undecided() -> None:
    class Decides(NodalSprings):
        """It pairs at each state anew, and names no pairing."""

        traits = NodalSprings.traits.revise(takes_complex=False)
        pair = tangent = contact_points = None

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return super().residual(interface, NodalSprings.pair(self, interface, z), z)

    slave, master = [[-1.0, -0.25], [1.0, -0.25]], [[4.0, -2.0], [0.0, 0.0], [-4.0, -2.0]]
    # The points are at ±1/√3. Now the first one is moved over the bisector of the roof.
    nodes = np.array([*np.add(slave, [1 / np.sqrt(3), 0.0]), *master])
    state = Case(Interface.from_chains(nodes[:2], nodes[2:]), nodes.reshape(-1), seed=1)
    judge_as(Verdict.UNDECIDED, symmetric, state, Subject("decides", Decides))
    beside = replace(state, z=state.z + np.array([0.25, 0, 0.25, 0, 0, 0, 0, 0, 0, 0]))
    assert judge_case(symmetric, beside, Subject("decides", Decides)).verdict is Verdict.PASS


def test_a_kink_that_only_the_circle_reaches_is_no_work_in_a_loop() -> None:
    """A force with a potential begins between r and √2 r from the state, past both directions of the plane."""
    state = case(seed=1)
    radius = RADII[0] * state.shortest_segment
    first, second = random_directions(state.seed, 6, state.z.size)[:2]
    towards = first + second
    begins = 1.2 * radius * max(towards @ first, towards @ second)
    assert begins < radius * np.hypot(towards @ first, towards @ second)

    class Begins(Springs):
        pair = tangent = None

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            further = self.penalty * towards * ((z - state.z) @ towards > begins)
            return super().residual(interface, pairing, z) + further

    judge_as(Verdict.PASS, symmetric, state, subject(Begins, symmetric=True))


def test_a_tangent_made_symmetric_does_not_hide_the_work_in_a_loop() -> None:
    class Half(Springs):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            forces = super().residual(interface, pairing, z)
            forces[0] += self.penalty * z[1]
            return forces

        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            tangent = super().tangent(interface, pairing, z)
            tangent[0, 1] = tangent[1, 0] = self.penalty / 2
            return tangent

    outcome = judge_as(Verdict.FAIL, symmetric, case(seed=1), subject(Half, symmetric=True, tangent="exact"))
    assert outcome.reason.startswith("work in a closed loop")


@pytest.mark.parametrize("name", [
    "nts", "nts-ar", "vts-g", "vts-me", "vts-ppt", "vts-ppt-basic", "vts-ppt-balanced", "two-pass/nts",
    "sts", "mortar", "mortar-dual", "mortar-lm",
])  # fmt: skip
def test_our_own_formulations_keep_every_bit_beside_another_body(name: str) -> None:
    kinds = set()
    for state in cases_of("remote", 20):
        assert remote.measure(state, load_subject(name)).details[BITS] == 0
        kinds.add(state.kind)
    assert kinds == {FAR, BEHIND}


class BothSurfaces:
    """Equal springs in space, in the middle of each edge of both surfaces, to the nearest triangle across it."""

    traits = Traits(promises=Promises(unbiased=True, conserves_force=True), abilities=Abilities(dimensions=(3,)))

    def __init__(self, *, penalty: float) -> None:
        self.penalty = penalty

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        x = z.reshape(-1, 3)
        forces = np.zeros_like(x)
        for side, other in ((interface.slave, interface.master), (interface.master, interface.slave)):
            a, b, c = np.moveaxis(x[other.faces], 1, 0)
            double = np.cross(b - a, c - a)
            sizes = np.linalg.norm(double, axis=1)
            normals = double / sizes[:, None]
            for edge in np.vstack([np.roll(side.faces, shift, axis=1)[:, :2] for shift in range(3)]):
                point = x[edge].mean(axis=0)
                parts = np.stack([np.cross(q - p, point - p) for p, q in ((b, c), (c, a), (a, b))])
                shares = (parts * normals).sum(axis=2) / sizes
                heights = ((point - a) * normals).sum(axis=1)
                face = np.where((shares > 0).all(axis=0), np.abs(heights), np.inf).argmin()
                if (shares[:, face] > 0).all() and heights[face] < 0:
                    push = self.penalty * heights[face] * normals[face]
                    forces[edge] += push / 2
                    forces[other.faces[face]] -= shares[:, [face]] * push
        return forces.reshape(-1)


def test_a_second_pass_may_find_a_body_inside_that_of_the_slave() -> None:
    two_passes = Subject("both surfaces", BothSurfaces)
    question = load_property("remote").for_traits(two_passes.traits)
    cases = draw_cases(question.cases(None), seed="remote", examples=40).cases
    behind = [case for case in cases if "behind" in case.parameters]
    assert len(behind) > 5
    assert {judge_case(question, case, two_passes).verdict for case in behind} <= {Verdict.PASS, Verdict.UNDECIDED}


def test_on_an_exact_bisector_numbers_decide_nothing() -> None:
    """A node below the vertex of a roof is as near to one side as to the other: the number of a segment decides."""
    slave, master = [[0.0, -0.25], [0.5, -0.5]], [[4.0, -2.0], [0.0, 0.0], [-4.0, -2.0]]
    nodes = np.array([*slave, *master])
    verdicts = set()
    for seed in range(8):
        state = Case(Interface.from_chains(slave, master), nodes.reshape(-1), seed=seed)
        for question in (renumbering, load_property("mirror")):
            verdicts.add(judge_case(question, state, load_subject("nts")).verdict)
    assert verdicts <= {Verdict.PASS, Verdict.UNDECIDED}
    assert Verdict.UNDECIDED in verdicts


def test_half_of_the_renumbered_meshes_are_closed_rings_with_another_seam() -> None:
    cases = draw_cases(renumbering_cases(), seed="seam", examples=20).cases
    closed = [state for state in cases if state.kind == CLOSED]
    assert len(closed) == 10
    for state in closed:
        assert (state.interface.slave.neighbours >= 0).all()
        assert (state.interface.master.neighbours >= 0).all()


def test_a_promise_to_be_unbiased_is_found_out() -> None:
    boaster = with_promises(contactverif_nts.nts_ar, unbiased=True)
    outcomes = [judge_case(load_property("swap"), state, boaster) for state in cases_of("swap")]
    assert [outcome.verdict for outcome in outcomes].count(Verdict.FAIL) >= 5
    failing = [outcome.reason for outcome in outcomes if outcome.verdict is Verdict.FAIL]
    assert all("; with slave and master exchanged" in reason for reason in failing)


class Backwards(Springs):
    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        first, second = interface.slave.segments[0]
        return super().residual(interface, pairing, z) * (np.nan if first > second else 1.0)


def test_of_two_numberings_the_one_that_makes_nan_is_named() -> None:
    outcomes = [judge_case(renumbering, case(seed=seed), subject(Backwards, penalty="distributed")) for seed in SEEDS]
    reasons = {outcome.reason.partition(" entries, ")[2] for outcome in outcomes if outcome.verdict is Verdict.FAIL}
    assert reasons
    assert all(re.fullmatch(r"with the numbers 1, 0, .* in another order; finite as drawn", each) for each in reasons)


def test_a_force_that_turns_with_the_state_is_objective() -> None:
    for seed in SEEDS:
        judge_as(Verdict.PASS, objectivity, case(seed=seed), subject(Springs, penalty="distributed"))


class Axis(Springs):
    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return super().residual(interface, pairing, z) * np.resize([1.0, 1.001], z.size)


class PointedAxis(Axis):
    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.points(c=0.0)


@pytest.mark.parametrize("plugin", [Axis, PointedAxis])
def test_a_force_along_an_axis_is_not_whether_points_are_named_or_not(plugin: Any) -> None:
    for seed in SEEDS:
        assert judge_case(objectivity, case(seed=seed), subject(plugin)).verdict is Verdict.FAIL


def test_a_tangent_that_does_not_turn_is_found_where_the_forces_do() -> None:
    class Axis(Springs):
        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            return np.diag(np.resize([1.0, 2.0], z.size))

        def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
            return self.points(c=0.0)

    outcome = judge_as(Verdict.FAIL, objectivity, case(seed=1), subject(Axis, tangent="exact"))
    assert outcome.reason.startswith("error of the tangent after a rotation")


def test_springs_that_act_twice_need_half_of_the_penetration() -> None:
    """Rounding the positions to uX changes the tangent of the second pass by 2e-13 of its largest entry."""
    slave = [
        [7.390291733840329, -32.31565181091557], [6.733405329071609, -33.06556981419655],
        [6.379941614663333, -33.45025869749288], [5.477573664406958, -34.638675966512764],
        [4.348309906428491, -35.66821908057746],
    ]  # fmt: skip
    master = [
        [3.572631344377263, -36.95121432282958], [4.432995998903832, -35.72248625639609],
        [5.006572435254878, -34.9033342121071], [5.418906036420292, -35.18618419930046],
        [6.279270690946862, -33.95745613286697], [7.426423563648954, -32.31915204428899], [8.0, -31.5],
    ]  # fmt: skip
    interface = Interface.from_chains(slave, master)
    state = Case(interface, interface.nodes.reshape(-1), penalty=512.0, seed=1882)
    outcome = judge_as(Verdict.PASS, objectivity, state, load_subject("two-pass/mortar"))
    name = "error of the tangent after a rotation"
    assert outcome.measurement.values[name] > 0.55 * outcome.measurement.tolerances[name]


def test_half_passes_that_push_the_master_alone_are_objective() -> None:
    """The slave's mean gaps are open, and the master's are closed: forces count over those of the side that has any."""
    slave = [[4.08319197, 0.0117645], [2.05083952, 3.53190229], [0.01848707, 4.0764694], [-3.50165071, 2.04411695]]
    master = [[-3.46410179, 2.0], [-0.66782475, 3.94385719], [2.59914017, 3.04047203], [4.0, 0.0]]
    interface = Interface.from_chains(slave, master)
    formulation = load_subject("mortar-two-half-pass")
    for seed in SEEDS:
        state = Case(interface, interface.nodes.reshape(-1), penalty=1.0, seed=seed)
        half_passes = formulation.for_case(state)
        forces = half_passes.residual(interface, half_passes.pair(interface, state.z), state.z).reshape(-1, 2)
        assert not forces[:4].any()
        assert forces[4:].any()
        judge_as(Verdict.PASS, objectivity, state, formulation)


class Nearest(Handmade):
    """Pushes the slave away from the master segment that is nearest to its middle: twice as much from one of them."""

    def side(self, z: Any) -> float:
        """Positive where the first segment is nearer, in any position: left of the bisector at the middle node."""
        first, node, last = z[4:6], z[6:8], z[8:10]
        bisector = (first - node) / np.hypot(*(first - node)) - (last - node) / np.hypot(*(last - node))
        return float(((z[0:2] + z[2:4]) / 2 - node) @ bisector)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = 0 * z
        size = self.penalty * (2.0 if self.side(z) > 0 else 1.0)
        forces[0:2] = size * (z[2:4] - z[0:2])
        return forces

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.points(c=0.0)


@pytest.mark.parametrize("offset", [0.0, 2.0**-52])
def test_on_an_exact_bisector_a_turn_decides_nothing(offset: float) -> None:
    """Rounding the turned nodes puts the point on one side or the other."""
    outcomes = [judge_case(objectivity, over_a_node_with(offset, seed), subject(Nearest)) for seed in SEEDS]
    reasons = {outcome.reason for outcome in outcomes if outcome.verdict is Verdict.UNDECIDED}
    assert {outcome.verdict for outcome in outcomes} <= {Verdict.UNDECIDED, Verdict.PASS}
    assert reasons
    assert all(reason.startswith("a kink") for reason in reasons)


def test_beside_a_bisector_a_wrong_turn_is_no_kink() -> None:
    class Wrong(Nearest):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return super().residual(interface, pairing, z) * np.resize([1.0, 1.001], z.size)

    for seed in SEEDS:
        assert judge_case(objectivity, over_a_node_with(1 / 7, seed), subject(Nearest)).verdict is Verdict.PASS
        assert judge_case(objectivity, over_a_node_with(1 / 7, seed), subject(Wrong)).verdict is Verdict.FAIL


def over_a_node_with(offset: float, seed: int) -> Any:
    return replace(over_a_node(offset), seed=seed)


def test_the_same_case_is_always_turned_the_same_way() -> None:
    springs = subject(Springs)
    assert objectivity.measure(case(seed=5), springs) == objectivity.measure(case(seed=5), springs)
    assert objectivity.measure(case(seed=5), springs).values != objectivity.measure(case(seed=6), springs).values


@pytest.mark.parametrize("penalty", ["nodal", "distributed"])
def test_a_penalty_that_scales_with_its_unit_changes_no_digit(penalty: str) -> None:
    for seed in SEEDS:
        measurement = units.measure(case(seed=seed), subject(Springs, penalty=penalty, tangent="exact"))
        assert measurement.values == {SCALED_FORCES.name: 0.0, SCALED_TANGENT.name: 0.0}


@pytest.mark.parametrize(("promised", "actual"), [("nodal", "distributed"), ("distributed", "nodal")])
def test_the_other_kind_of_penalty_does_not(promised: Any, actual: Any) -> None:
    class Boasts(Springs):
        def area(self, z: Any) -> float:
            return float(np.hypot(*self.stretch(z))) if actual == "distributed" else 1.0

    verdicts = [judge_case(units, case(seed=seed), subject(Boasts, penalty=promised)).verdict for seed in SEEDS]
    assert verdicts.count(Verdict.FAIL) >= 20


def test_a_penalty_whose_kind_is_not_stated_is_not_asked() -> None:
    assert units.refusal(Traits()) == "state rules.penalty to be asked"
    assert units.refusal(Traits(rules=Rules(penalty="nodal"))) == ""
    assert units.refusal(Traits(rules=Rules(penalty="nodal", enforcement="multiplier"))) == ""
    assert "barrier" in units.refusal(Traits(rules=Rules(penalty="nodal", enforcement="barrier")))
    assert run([subject(Springs)], [units], examples=3, seed=1).rows[0].verdict is Verdict.NOT_APPLICABLE
