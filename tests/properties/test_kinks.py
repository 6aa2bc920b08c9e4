"""Kinks: computed from positions where the plugin reports contact points, and else from differences."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from handmade import Handmade, OneForce, case, over_a_node, subject
from scipy import sparse
from subjects import judge_as, load_property, with_verbs

from contactverif import Verdict, named_case
from contactverif.contract.arrays import dense
from contactverif.contract.case import Case
from contactverif.diagnosis.flat_state import flat_state
from contactverif_properties.kinks import (
    explain_by_kink,
    find_kink,
    is_like_its_surroundings,
    measure_jump,
    measure_jump_of_slope,
)
from contactverif_properties.states import FrozenState

REACH = 1e-6


class Pointed(Handmade):
    """One contact point, in the middle of the slave segment; two methods in one, and the pairing is a lie."""

    half_area = np.nan

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self.points(c=0.0, half_area=self.half_area)


class Wide(Pointed):
    """One contact point with an area of competence of half a segment."""

    half_area = 0.5


class Springs(OneForce):
    """A spring to the master's node on its side; no contact points."""

    tangent = None

    def force(self, z: Any, pairing: Any) -> Any:
        return z[1] * (1.0 if z[0] + z[2] > 0 else 3.0)

    def residual(self, *state: Any) -> Any:
        forces = super().residual(*state)
        forces[0] = state[-1][0] ** 2
        return forces


def at(plugin: Any, state: Case) -> FrozenState:
    return FrozenState(subject(plugin).for_case(state), state, None)


def kink(plugin: Any, state: Case, reach: float = REACH) -> str:
    return find_kink(at(plugin, state), reach, np.ones(state.z.size))


@pytest.mark.parametrize(
    ("plugin", "state", "reason"),
    [
        (Pointed, over_a_node(0.0), "a kink: a decision hangs on 0"),
        (Pointed, over_a_node(1e-7), "a kink"),
        (Pointed, over_a_node(-1e-7), "a kink"),
        (Pointed, over_a_node(1e-4), ""),
        (Pointed, over_a_node(-1e-4), ""),
        (Pointed, over_a_node(1 / 7), ""),
        # Touch.
        (Pointed, over_a_node(6 / 7, gap=0.0), "a kink"),
        (Pointed, over_a_node(6 / 7, gap=-1e-7), "a kink"),
        (Pointed, over_a_node(6 / 7, gap=-1e-4), ""),
        # The area of competence is a quarter to either side, and its end lies over a master node.
        (Pointed, over_a_node(0.25), ""),
        (Wide, over_a_node(0.25), "a kink"),
        (Wide, over_a_node(0.3), ""),
        # Without contact points one-sided differences tell.
        (Springs, over_a_node(0.0), "a kink: one-sided differences over 1e-06 disagree by "),
        (Springs, over_a_node(1e-7), "a kink"),
        (Springs, over_a_node(1 / 7), ""),
        (Springs, case(), ""),
        # Nothing is in contact.
        (Handmade, over_a_node(0.0), ""),
    ],
)
def test_a_kink_is_where_a_decision_hangs_on_less_than_the_nodes_may_move(
    plugin: Any, state: Case, reason: str
) -> None:
    words = kink(plugin, state)
    assert words.startswith(reason)
    assert bool(words) is bool(reason)


def test_a_lie_about_the_contact_point_moves_the_kink_with_it() -> None:
    """Only the plugin knows where its points are. One that puts them at kinks is undecided, and so never judged."""

    class OverANode(Handmade):
        def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
            return self.points(c=-2 * 6 / 7)  # over the node of the master

    assert kink(OverANode, case())


def test_a_jump_is_seen_from_both_sides() -> None:
    state, beside = at(Springs, over_a_node(0.0)), at(Springs, over_a_node(1 / 7))
    directions = np.ones((1, state.case.z.size))
    assert measure_jump(state, REACH, directions) == pytest.approx(0.25, rel=1e-4)
    assert measure_jump(beside, REACH, directions) < 1e-5
    assert measure_jump_of_slope(beside, REACH, directions) < 1e-5


def test_forces_that_jump_in_space_may_come_of_faces_that_overlap() -> None:
    def overlap(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        return right(interface, pairing, z) * np.where(z[..., :1] > 0, 1.2, 1.0)

    state, overlapping = named_case("crossed-diagonals"), with_verbs("nts-3d", residual=overlap)
    frozen = FrozenState.at(overlapping.for_case(state), state)
    assert "do faces overlap" in explain_by_kink(frozen, REACH, {"forces": 0.01})


class Sided(OneForce):
    """Springs whose stiffness changes over the master's node, where the pairing does."""

    def pair(self, interface: Any, z: Any) -> Any:
        return {"right": np.array([z[0] + z[2] > 0])}

    def force(self, z: Any, pairing: Any) -> Any:
        return z[..., 1] * (1.0 if pairing["right"][0] else 3.0)


def test_a_jump_of_the_derivative_counts_too() -> None:
    state = at(Sided, over_a_node(0.0))
    assert measure_jump_of_slope(state, REACH, np.ones((1, state.case.z.size))) == pytest.approx(2.0)


def test_a_smooth_derivative_changes_by_its_own_slope() -> None:
    class Stiffening(OneForce):
        def force(self, z: Any, pairing: Any) -> Any:
            return 400 * z[1] ** 2

    state = at(Stiffening, over_a_node(1 / 7))
    reach = 2.0**-40  # So short that the error of a difference hides it.
    assert measure_jump_of_slope(state, reach, np.ones((1, state.case.z.size))) == pytest.approx(800 * reach, rel=1e-3)


def test_a_tangent_that_jumps_everywhere_excuses_nothing() -> None:
    class Restless(Sided):
        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            return np.eye(z.size) * np.sin(1e9 * z.sum())

    case = over_a_node(1 / 7)
    state = FrozenState.at(subject(Restless).for_case(case), case)
    assert measure_jump_of_slope(state, REACH, np.ones((1, case.z.size))) == 0
    assert explain_by_kink(state, REACH, {"tangent": 1e-3}) == ""


def test_sparse_and_dense_tangents_are_the_same() -> None:
    array = np.arange(9.0).reshape(3, 3)
    assert np.array_equal(dense(sparse.coo_array(array)), array)
    assert np.array_equal(dense(array), array)


class Dropping(OneForce):
    """The springs again, which push with the same stiffness on both sides, and not exactly over the node."""

    def force(self, z: Any, pairing: Any) -> Any:
        return z[1] * (0.0 if z[0] + z[2] == 0 else 1.0)


def test_a_choice_between_the_sides_of_a_kink_is_excused() -> None:
    state = at(Springs, over_a_node(0.0))
    assert is_like_its_surroundings(state, REACH)
    assert explain_by_kink(state, REACH, {"forces": 0.1}).startswith("a kink")


def test_a_force_that_is_missing_at_a_kink_and_on_neither_side_is_not() -> None:
    state = at(Dropping, over_a_node(0.0))
    assert measure_jump(state, REACH, np.ones((1, state.case.z.size))) == pytest.approx(0.125, rel=1e-4)
    assert not is_like_its_surroundings(state, REACH)
    assert explain_by_kink(state, REACH, {"forces": 0.1}) == ""
    assert is_like_its_surroundings(at(Dropping, over_a_node(1 / 7)), REACH)


def test_a_wrong_tangent_is_asked_for_kinks_in_few_columns() -> None:
    """Only the columns of its largest error are differentiated."""
    states: list[int] = []

    def count(right: Any, interface: Any, pairing: Any, z: Any) -> Any:
        states.append(np.atleast_2d(z).shape[0])
        return right(interface, pairing, z)

    def drop_last_column(right: Any, *state: Any) -> Any:
        tangent = dense(right(*state)).copy()
        tangent[:, -1] = 0.0
        return tangent

    wrong = with_verbs("nts-ar", residual=count, tangent=drop_last_column)
    judge_as(Verdict.FAIL, load_property("objectivity"), flat_state().case, wrong)
    assert sum(states) < 300  # All columns took 1,226.


class OneOfEight(OneForce):
    """The force is 1 in one of eight sectors around a node, as where eight faces meet there, and 0 in the others."""

    def force(self, z: Any, pairing: Any) -> Any:
        return 1.0 * (0 <= np.arctan2(z[3] - z[1], z[0] + z[2]) < np.pi / 4)


def test_one_of_eight_choices_is_excused() -> None:
    for seed in range(20):
        state = at(OneOfEight, replace(over_a_node(0.0), seed=seed))
        assert is_like_its_surroundings(state, REACH), seed
