"""The property `objectivity`, also where a state is exactly between two answers."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from handmade import Handmade, Springs, case, over_a_node, subject
from subjects import judge_as, load_subject

from contactverif import Case, Interface, Verdict, judge_case
from contactverif_properties.invariants import objectivity

SEEDS = range(1, 30)


def test_a_force_that_turns_with_the_state_is_objective() -> None:
    for seed in SEEDS:
        judge_as(Verdict.PASS, objectivity, case(seed=seed), subject(Springs, penalty="distributed"))


def test_a_force_along_an_axis_is_not() -> None:
    class Axis(Springs):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return super().residual(interface, pairing, z) * np.resize([1.0, 1.001], z.size)

    class Pointed(Axis):
        def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
            return self.points(c=0.0)

    for seed in SEEDS:
        assert judge_case(objectivity, case(seed=seed), subject(Pointed)).verdict is Verdict.FAIL


def test_a_force_along_an_axis_is_not_where_no_contact_points_are_named_either() -> None:
    class Axis(Springs):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return super().residual(interface, pairing, z) * np.resize([1.0, 1.001], z.size)

    verdicts = [judge_case(objectivity, case(seed=seed), subject(Axis)).verdict for seed in SEEDS]
    assert verdicts.count(Verdict.FAIL) == len(verdicts)


def test_a_tangent_that_does_not_turn_is_found_where_the_forces_do() -> None:
    class Axis(Springs):
        def tangent(self, interface: Any, pairing: Any, z: Any) -> Any:
            return np.diag(np.resize([1.0, 2.0], z.size))

        def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
            return self.points(c=0.0)

    outcome = judge_as(Verdict.FAIL, objectivity, case(seed=1), subject(Axis))
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
    verdicts = {judge_case(objectivity, over_a_node_with(offset, seed), subject(Nearest)).verdict for seed in SEEDS}
    assert Verdict.UNDECIDED in verdicts
    assert verdicts <= {Verdict.UNDECIDED, Verdict.PASS}


def test_on_an_exact_bisector_it_says_why() -> None:
    outcomes = [judge_case(objectivity, over_a_node_with(0.0, seed), subject(Nearest)) for seed in SEEDS]
    reasons = {outcome.reason for outcome in outcomes if outcome.verdict is Verdict.UNDECIDED}
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
