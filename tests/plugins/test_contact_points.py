"""The reports of the built-in formulations at points that have little to say."""

import numpy as np
import pytest
from subjects import load_subject

from contactverif import ContactPoints, Interface, Surface

# Slave segment 2 is edge-on to the first master segment: t_AB·t is −3e-18, negative by rounding alone.
EDGE_ON = [
    [599.6093738079071, -70.05859661102295], [599.5302722454071, -69.98437786102295],
    [599.8310534954071, -70.05469036102295], [599.7421863079071, -70.00390911102295],
    [599.9394519329071, -70.05859661102295], [599.9296875, -70.08203125], [599.7421875, -70.00390625],
    [599.6875, -69.87109375],
]  # fmt: skip


def points_of(name: str, interface: Interface) -> ContactPoints:
    formulation, z = load_subject(name).with_penalty(4.0), interface.nodes.reshape(-1)
    return formulation.contact_points(interface, formulation.pair(interface, z), z)


@pytest.mark.parametrize("name", ["vts-ppt:n=3", "vts-ppt-balanced:n=3"])
def test_a_slave_that_is_edge_on_by_rounding_gets_finite_forces(name: str) -> None:
    interface = Interface(np.array(EDGE_ON), Surface([[1, 0], [2, 4], [0, 3], [3, 2]]), Surface([[6, 7], [5, 6]]))
    formulation, z = load_subject(name).with_penalty(1.0), interface.nodes.reshape(-1)
    pairing = formulation.pair(interface, z)
    assert pairing is not None
    assert pairing["active"][6]
    assert np.isfinite(formulation.residual(interface, pairing, z)).all()


def test_a_virtual_slave_node_of_which_nothing_faces_the_master_has_its_place_and_no_weight() -> None:
    interface = Interface.from_chains([[0.0, 0], [4, 0]], [[1.0, 0.5], [-1, 0.5]])
    points = points_of("vts-ppt-balanced", interface)
    assert points.weight.tolist() == [1.0, 0.0]  # The first area is cut from 2 to 1.
    assert points.c.tolist() == [-0.75, 0.5]
    assert (points.area_from.tolist(), points.area_to.tolist()) == ([-1.0, 0.0], [-0.5, 1.0])


@pytest.mark.parametrize("name", ["mortar", "mortar-dual", "mortar:normals=averaged"])
def test_a_node_that_overhangs_and_presses_has_a_normal_and_no_segment(name: str) -> None:
    interface = Interface.from_chains([[0.0, 0], [4, 0], [8, 0]], [[3.0, 0.5], [1, 0.5]])
    points = points_of(name, interface)
    assert points.weighted.all()
    assert points.master_segment.tolist() == [-1, -1, -1]
    assert points.active.tolist() == [True, True, False]
    assert points.normal[:2] == pytest.approx(np.array([[0.0, 1.0], [0.0, 1.0]]))
    assert np.isnan(points.normal[2]).all()  # No cell begins beside it.
    assert points.pressure.tolist() == [2.0, 2.0, 0.0]


def test_the_second_of_two_passes_is_reported_as_the_first_pass_of_exchanged_roles() -> None:
    interface = Interface.from_chains([[0.0, 0], [4, 0], [8, 0]], [[8.0, 0.5], [5, 0.5], [0, 0.5]])
    points = points_of("two-pass/nts-ar", interface)
    second, alone = points.select(points.on_master), points_of("nts-ar", interface.swap_roles())
    for name in ("slave_segment", "c", "master_segment", "xi", "normal", "gap", "pressure", "weight", "active"):
        assert np.array_equal(getattr(second, name), getattr(alone, name)), name
    assert not points.weighted.any()
