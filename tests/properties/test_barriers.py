"""Barriers are asked on states whose surfaces are apart: a right one is not accused, and each mistake is found."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from planned_cases import draw_cases
from subjects import judge_as, load_property
from zoo.at_points import LogBarrier
from zoo.barriers import Bounded, BoundedWork, HalfAtVertices, InsidesAlone, SlaveAlone

from contactverif import Case, Interface, Rules, Subject, Traits, Verdict, judge_case, named_case
from contactverif.contract.case import ACTIVATION, LEAST_GAP
from contactverif.contract.property import CLOSED_CHAIN, Property
from contactverif.contract.result import OPPOSITE_SIGN
from contactverif.plugins.registry import property_ids
from contactverif.problems.open_states import LARGEST, LEAST, fit_to_traits, least_distance
from contactverif.run.judge import FirstCall, call_first
from contactverif.run.run import run
from contactverif.strategies import flat_cases, smooth_cases
from contactverif.strategies.closings import closing_cases
from contactverif.strategies.general import closed_cases

BARRIER = Traits(rules=Rules(enforcement="barrier", activation=0.5))
FOR_BARRIERS = {
    *("balance.force", "balance.moment", "mirror", "renumbering", "swap", "objectivity", "units", "purity"),
    *("purity.long", "symmetric", "tangent.directional", "tangent.sparsity", "tangent.long", "unilateral"),
    *("patch.flat.transmission", "patch.flat.normal", "patch.flat.single"),
}


def ask(question: Property, make: Any, examples: int = 12) -> list[Verdict]:
    cases = draw_cases(question.cases(None), seed=f"barriers/{question.id}", examples=examples).cases
    return [judge_case(question, case, Subject("barrier", make)).verdict for case in cases]


def test_who_states_no_activation_distance_is_asked_nothing() -> None:
    questions = [load_property(name) for name in property_ids()]
    assert {question.id for question in questions if not question.refusal(BARRIER)} == FOR_BARRIERS - {"units"}
    silent = Traits(rules=Rules(enforcement="barrier"))
    assert all("barrier" in question.refusal(silent) for question in questions)
    assert "penalty_power" in load_property("units").refusal(BARRIER)
    assert "a length" in load_property("units").refusal(BARRIER.revise(activation_unit="length"))


@pytest.mark.parametrize("source", [smooth_cases, flat_cases, closed_cases, closing_cases])
def test_a_state_is_lifted_within_the_activation_distance_and_stays_so(source: Any) -> None:
    cases, lifted = draw_cases(source(), seed="lifted", examples=60).cases, 0
    for case in cases:
        state, refused = fit_to_traits(case, BARRIER)
        if refused:
            continue
        lifted += 1
        gap, activation = state.parameter(LEAST_GAP), state.parameter(ACTIVATION)
        assert LEAST * activation <= gap <= LARGEST * activation
        assert least_distance(state.interface, state.positions) == pytest.approx(gap, rel=1e-6)
        assert state.resolution <= gap
        assert fit_to_traits(state, BARRIER) == (state, "")
        assert fit_to_traits(Case.from_arrays(state.to_arrays()), BARRIER)[0].z.tobytes() == state.z.tobytes()
    assert lifted >= 0.9 * len(cases)


def test_an_activation_distance_may_be_a_length() -> None:
    state, _ = fit_to_traits(named_case("c"), BARRIER.revise(activation=0.01, activation_unit="length"))
    assert state.parameter(ACTIVATION) == 0.01
    with pytest.raises(Exception, match="a number above 0"):
        BARRIER.revise(activation=0.0)


def test_closed_chains_are_not_for_those_who_take_open_ones() -> None:
    traits = Traits().revise(chains="open")
    (ring,) = draw_cases(closed_cases(), seed="1", examples=1).cases
    assert fit_to_traits(ring, traits) == (ring, CLOSED_CHAIN)
    assert fit_to_traits(named_case("c"), traits)[1] == ""
    assert load_property("objectivity").refusal(traits.revise(motions="small"))


class WrongBlock(LogBarrier):
    """The block of one node with another one is too large by a millionth."""

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        tangent = super().tangent(interface, pairing, z)
        pairs = pairing["pairs"]
        if len(pairs):
            _, node, other, _ = pairs[0]
            tangent[2 * node : 2 * node + 2, 2 * other : 2 * other + 2] *= 1 + 1e-6
        return tangent


class StraightTangent(LogBarrier):
    """The tangent leaves out that the direction of a force turns."""

    def _terms(self, interface: Any, pairing: Any, z: Any) -> Any:
        *others, hessian = super()._terms(interface, pairing, z)
        return *others, 0 * hessian

    def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
        return super().tangent(interface, pairing, z)


def times(factor: Callable[[Interface], Any]) -> type[LogBarrier]:
    """Return a barrier with its forces times a factor."""

    class Changed(LogBarrier):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return super().residual(interface, pairing, z) * factor(interface)

    return Changed


PULLS = times(lambda _: -1.0)
FOLLOWS_THE_AXIS = times(lambda interface: np.tile([1.0, 1.001], interface.n_nodes))
MASTER_TAKES_LESS = times(
    lambda interface: np.where(np.arange(interface.n_unknowns) < 2 * interface.n_slave_nodes, 1.0, 0.99)
)


class BoundedEarly(Bounded):
    share = 0.01


class TooFar(LogBarrier):
    """It begins at 1.05 times the distance that it states."""

    def _range(self, interface: Any) -> float:
        return 1.05 * super()._range(interface)


class FixedLength(LogBarrier):
    """The activation distance has a hidden length in it."""

    def _range(self, interface: Any) -> float:
        return min(super()._range(interface), 1e-3)


class Remembers(LogBarrier):
    calls = 0

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        self.calls += 1
        return super().residual(interface, pairing, z) * (1 + 1e-9 * self.calls)


@pytest.mark.parametrize(
    ("make", "property_id"),
    [
        (WrongBlock, "tangent.sparsity"),
        (StraightTangent, "tangent.directional"),
        (MASTER_TAKES_LESS, "balance.force"),
        (SlaveAlone, "swap"),
        (Bounded, "unilateral"),
        (BoundedEarly, "unilateral"),
        (TooFar, "unilateral"),
        (PULLS, "unilateral"),
        *((each, "intersection-free") for each in (SlaveAlone, InsidesAlone, HalfAtVertices, Bounded, BoundedWork)),
        (FixedLength, "units"),
        (FOLLOWS_THE_AXIS, "objectivity"),
        (FOLLOWS_THE_AXIS, "symmetric"),
        (Remembers, "purity"),
    ],
)
def test_a_wrong_barrier_is_found_and_the_right_one_is_not_accused(make: Any, property_id: str) -> None:
    question = load_property(property_id)
    assert Verdict.FAIL in ask(question, make)
    assert set(ask(question, LogBarrier)) <= {Verdict.PASS, Verdict.UNDECIDED}


def test_a_barrier_may_state_that_it_lets_surfaces_through() -> None:
    """Looking from the slave alone is right without a promise, and `peak` shows what it leaves open."""
    question, traits = load_property("intersection-free"), LogBarrier.traits.revise(unbiased=None)
    stated = traits.revise(never_intersects=False, witnesses={"intersection-free": "peak"})
    silent = traits.revise(never_intersects=None)
    judge_as(Verdict.PASS, question, named_case("peak"), Subject("barrier", LogBarrier))
    for each, verdict in ((stated, Verdict.FAIL), (silent, Verdict.NOT_APPLICABLE)):
        subject = Subject("slave alone", type("Stating", (SlaveAlone,), {"traits": each}))
        (row,) = run([subject], [question], examples=20, seed=1).rows
        assert (row.verdict, row.unexpected) == (verdict, "")


class SameWeights(LogBarrier):
    def _weights(self, interface: Any) -> Any:
        return np.ones(interface.n_nodes)


def test_a_barrier_presses_evenly_where_meshes_match_and_weights_are_lengths() -> None:
    x = np.array([0.0, 1.0, 3.0, 7.0])
    interface = Interface.from_chains(np.column_stack([x, 0 * x]), np.column_stack([x, 0 * x])[::-1])
    parameters = {"penetration": np.array(0.125), "along": np.append(x, x[::-1]), "direction": np.array([1.0, 0.0])}
    positions = interface.nodes - [0.0, 0.125] * (np.arange(8) < 4)[:, None]
    case = Case(interface, positions.reshape(-1), 1.0, parameters)
    for make, verdict in ((LogBarrier, Verdict.PASS), (SameWeights, Verdict.FAIL)):
        judge_as(verdict, load_property("patch.flat.transmission"), case, Subject("barrier", make))


def test_states_that_are_left_out_for_their_chains_do_not_keep_a_row_from_being_judged() -> None:
    """Half of the states of `renumbering` are closed rings."""

    class OpenChains(LogBarrier):
        traits = LogBarrier.traits.revise(chains="open")

    result = run([Subject("open", OpenChains)], [load_property("renumbering")], examples=20, seed=1)
    (row,) = result.rows
    assert row.verdict is Verdict.PASS, row.reason
    assert row.tally.reasons[CLOSED_CHAIN] >= 10
    assert not row.suspicion


def test_a_barrier_that_states_no_activation_distance_is_not_called_for_the_first_time() -> None:
    """A right barrier pushes on if the surfaces have passed each other, and that looks like a wrong sign."""

    class Silent(LogBarrier):
        traits = LogBarrier.traits.revise(activation=None)

    assert call_first(Subject("silent", Silent), {"tangent"}) == FirstCall()
    called = call_first(Subject("barrier", LogBarrier), {"tangent"})
    assert called.answers is not None
    assert not called.mistake
    assert call_first(Subject("pulls", PULLS), {"tangent"}).mistake == OPPOSITE_SIGN
