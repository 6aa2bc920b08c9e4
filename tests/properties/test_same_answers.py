"""The properties `mirror`, `renumbering`, `swap`, `remote` and `symmetric`: what they accuse, and what they do not."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from handmade import Springs, case, over_a_node, subject
from strangers import NearbyOnly, TurnedFrame
from subjects import judge_as, load_property, load_subject, with_promises
from test_straight_slaves import RIGHT_ONES
from textbook_springs import CentredSprings, NodalMultipliers, QuadraticSprings

import contactverif_nts
from contactverif import Case, Interface, Subject, Surface, Verdict, judge_case
from contactverif.sampling.draw import draw_cases
from contactverif_properties.balance import RADII, symmetric
from contactverif_properties.invariants import (
    BEHIND,
    BITS,
    CLOSED,
    FAR,
    exchange_roles,
    mirror_case,
    remote,
    renumber,
    renumbering,
    renumbering_cases,
)
from contactverif_properties.states import random_directions

PROMISED_BY_ALL = ("mirror", "renumbering", "remote")
EXAMPLES = 10
STRANGERS = {
    **RIGHT_ONES,
    "textbook springs of second order": Subject("quadratic", QuadraticSprings),
    "textbook nodal multipliers": Subject("multipliers", NodalMultipliers),
}


def cases_of(property_id: str, examples: int = EXAMPLES) -> tuple[Case, ...]:
    return draw_cases(load_property(property_id).cases(None), seed=f"same/{property_id}", examples=examples).cases


@pytest.mark.parametrize("property_id", PROMISED_BY_ALL)
@pytest.mark.parametrize("name", STRANGERS)
def test_a_right_formulation_of_a_stranger_is_not_accused(name: str, property_id: str) -> None:
    for state in cases_of(property_id):
        outcome = judge_case(load_property(property_id), state, STRANGERS[name])
        assert outcome.verdict in (Verdict.PASS, Verdict.UNDECIDED), outcome.reason


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

    outcome = judge_as(Verdict.PASS, symmetric, state, subject(Begins, symmetric=True))
    assert outcome.measurement is not None


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


def test_a_relabelled_case_is_the_same_part() -> None:
    state = over_a_node(0.25)
    slave, master = state.interface.slave.segments, state.interface.master.segments
    other, carry = renumber(state, np.array([1, 0, 4, 2, 3]), slave, master[::-1])
    assert other.positions[carry.nodes].tolist() == state.positions.tolist()
    assert other.interface.master.segments.tolist() == [[2, 3], [4, 2]]
    image, carry = mirror_case(state)
    assert image.positions.tolist() == (state.positions * [-1, 1]).tolist()
    assert image.interface.slave.segments.tolist() == [[1, 0]]
    exchanged, carry = exchange_roles(state)
    assert exchanged.positions[carry.nodes].tolist() == state.positions.tolist()
    assert exchanged.interface.n_slave_nodes == 3


def test_a_promise_to_be_unbiased_is_found_out() -> None:
    boaster = with_promises(contactverif_nts.nts_ar, unbiased=True)
    verdicts = [judge_case(load_property("swap"), state, boaster).verdict for state in cases_of("swap")]
    assert verdicts.count(Verdict.FAIL) >= 5
