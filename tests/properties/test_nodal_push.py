"""The property `nodal-push` where an area of competence reaches round a corner of the master."""

from typing import Any

import numpy as np
import pytest
from subjects import Changed, change_verbs, load_subject

from contactverif import Case, Interface, Subject, Verdict, judge_case
from contactverif_nts import vts_ppt
from contactverif_properties.compressive import nodal_push

SLAVE = [[0.446875, -0.875], [1.446875, -0.375]]
CORNER = Interface.from_chains(SLAVE, [[1.005, 0.0], [1.0025, -0.5], [0.0025, -0.5], [0.0, 0.0]])
STRAIGHT = Interface.from_chains([[0.0, -0.25], [1.0, -0.25]], [[1.5, 0.0], [0.5, 0.0], [-0.5, 0.0]])


VALLEY = Interface.from_chains([[-0.05, -0.2], [0.05, -0.2]], [[1.0, 0.5], [0.0, 0.0], [-1.0, 0.5]])


def pull(node: int, sign: float) -> Subject:
    """Return VTS-PPT with forces times a sign, but for one node, which is pulled."""

    def residual(right: Any, *state: Any) -> Any:
        forces = np.array(right(*state))
        forces[..., 2 * node + 1] -= 2 * np.abs(forces).max()
        return sign * forces

    return Subject("pulled", lambda *, penalty: change_verbs(vts_ppt(penalty=penalty), residual=residual))


def _judge(subject: Subject, interface: Interface) -> Verdict:
    return judge_case(nodal_push, Case(interface, interface.nodes.reshape(-1)), subject).verdict


@pytest.mark.parametrize("name", ["sts", "mortar", "nts-ar", "vts-me"])
def test_a_formulation_whose_feet_are_where_its_points_are_passes_round_a_corner(name: str) -> None:
    assert _judge(load_subject(name), CORNER) is Verdict.PASS


def test_a_part_of_a_force_round_a_corner_is_no_reason_to_accuse() -> None:
    """Eq. 6 leaves ξ unclipped: the foot of a part is past the neighbour of its point's segment by its whole length."""
    assert _judge(load_subject("vts-ppt"), CORNER) is Verdict.UNDECIDED


def test_a_node_that_is_pulled_where_there_is_no_corner_is_found() -> None:
    assert _judge(load_subject("vts-ppt"), STRAIGHT) is Verdict.PASS
    assert _judge(pull(3, 1.0), STRAIGHT) is Verdict.FAIL


def test_a_slave_node_that_is_pulled_beside_a_corner_is_found() -> None:
    assert _judge(pull(0, -1.0), CORNER) is Verdict.FAIL


@pytest.mark.parametrize("name", ["nts-ar", "nts", "two-pass/nts-ar"])
def test_without_points_a_foot_past_the_end_of_a_segment_is_no_reason_to_accuse(name: str) -> None:
    """Both slave nodes are nearest to the vertex of the valley, and so lever the outer nodes of the master up."""
    inner = load_subject(name)
    assert _judge(inner, VALLEY) is Verdict.PASS

    def make(*, penalty: float) -> Changed:
        return Changed(inner.with_penalty(penalty).plugin, contact_points=None)

    assert _judge(Subject(name, make), VALLEY) is Verdict.UNDECIDED


def test_without_points_a_slave_node_that_is_pulled_is_found() -> None:
    def make(*, penalty: float) -> Changed:
        return Changed(pull(0, -1.0).with_penalty(penalty).plugin, contact_points=None)

    assert _judge(Subject("pulled", make), STRAIGHT) is Verdict.FAIL
