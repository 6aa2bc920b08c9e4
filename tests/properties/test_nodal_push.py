"""The property `nodal-push` where an area of competence reaches round a corner of the master."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from subjects import load_subject

from contactverif import Interface, Subject
from contactverif.contract.case import Case
from contactverif.contract.property import Verdict
from contactverif.run.judge import judge_case
from contactverif_nts import vts_ppt
from contactverif_properties.pushes import nodal_push

SLAVE = [[0.446875, -0.875], [1.446875, -0.375]]
CORNER = Interface.from_chains(SLAVE, [[1.005, 0.0], [1.0025, -0.5], [0.0025, -0.5], [0.0, 0.0]])
STRAIGHT = Interface.from_chains([[0.0, -0.25], [1.0, -0.25]], [[1.5, 0.0], [0.5, 0.0], [-0.5, 0.0]])


class Pulled:
    """VTS-PPT, but one node is pulled."""

    node = 3

    def __init__(self, *, penalty: float) -> None:
        self._inner = vts_ppt(penalty=penalty)
        self.traits = self._inner.traits

    def pair(self, interface: Any, z: Any) -> Any:
        return self._inner.pair(interface, z)

    def contact_points(self, interface: Any, pairing: Any, z: Any) -> Any:
        return self._inner.contact_points(interface, pairing, z)

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        forces = np.array(self._inner.residual(interface, pairing, z))
        forces[..., 2 * self.node + 1] -= 2 * np.abs(forces).max()
        return forces


class PulledSlave(Pulled):
    node = 0

    def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
        return -super().residual(interface, pairing, z)


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
    assert _judge(Subject("pulled", Pulled), STRAIGHT) is Verdict.FAIL


def test_a_slave_node_that_is_pulled_beside_a_corner_is_found() -> None:
    assert _judge(Subject("pulled slave", PulledSlave), CORNER) is Verdict.FAIL
