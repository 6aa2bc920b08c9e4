"""The forces of nodal springs, and the classes of meshes, by hand."""

import pytest

from contactverif.contract.interface import Interface
from contactverif.oracle import is_of_class, nodal_spring_weights


def make_flat(slave: list[float], master: list[float]) -> Interface:
    return Interface.from_chains([[x, 0] for x in slave], [[x, 0] for x in reversed(master)])


def test_each_slave_node_has_a_unit_and_the_lever_rule_shares_it() -> None:
    interface = make_flat([0, 2, 4, 8], [0, 3, 8])
    weights = nodal_spring_weights(interface, interface.nodes[:, 0])
    assert weights.tolist() == pytest.approx([1, 1, 1, 1, 1 + 1 / 5, 2 / 3 + 4 / 5, 1 + 1 / 3], abs=1e-15)


def test_springs_of_both_surfaces_add_up_and_a_node_beside_the_other_surface_has_none() -> None:
    interface = make_flat([0, 2], [-1, 1, 4])
    weights = nodal_spring_weights(interface, interface.nodes[:, 0], both_surfaces=True)
    assert weights.tolist() == pytest.approx([1.5, 1.5, 1 / 3, 1 + 1 / 2 + 2 / 3, 1 / 2], abs=1e-15)


@pytest.mark.parametrize(
    ("slave", "master", "normal", "single"),
    [
        ([0, 2, 4], [0, 4], True, True),
        ([0, 2, 4], [0, 2, 4], True, True),
        ([0, 2, 4], [-1, 0, 5], True, True),
        ([0, 2, 4], [0, 1, 4], False, True),
        ([0, 2, 4], [0, 1, 2, 3, 4], False, True),
        ([0, 2, 4], [0, 1.5, 4], False, False),
        ([0, 2, 4], [-2, -1, 4], False, False),
    ],
)
def test_the_class_of_a_mesh(slave: list[float], master: list[float], normal: bool, single: bool) -> None:
    interface = make_flat(slave, master)
    along = interface.nodes[:, 0]
    assert is_of_class(interface, along, midpoints=False) is normal
    assert is_of_class(interface, along, midpoints=True) is single
