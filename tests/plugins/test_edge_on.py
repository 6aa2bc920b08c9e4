"""A slave seen nearly edge-on by its master, and points that have little to say.

In a valley of the master the foot of a virtual slave node lies past the end of its master segment, and so does its
whole area. The share of that segment, W/S, once grew like 1/S: at 1e-15 rad the forces of the balanced VTS-PPT were
1e14 times the contact force and out of balance.
"""

import numpy as np
import pytest
from subjects import load_subject
from surfaces import complex_step, contact_forces

from contactverif import ContactPoints, Interface, Surface
from contactverif.contract.arrays import FloatArray
from contactverif_nts import vts_ppt, vts_ppt_balanced

# Slave segment 2 is edge-on to the first master segment: t_AB·t is −3e-18, negative by rounding alone.
EDGE_ON = [
    [599.6093738079071, -70.05859661102295], [599.5302722454071, -69.98437786102295],
    [599.8310534954071, -70.05469036102295], [599.7421863079071, -70.00390911102295],
    [599.9394519329071, -70.05859661102295], [599.9296875, -70.08203125], [599.7421875, -70.00390625],
    [599.6875, -69.87109375],
]  # fmt: skip
VALLEY = np.array([[2.0, 0.5], [0.0, 0.0], [-2.0, 0.5]])
MIDDLE = np.array([0.02, -1.0])  # The middle of the slave, below the vertex.
ANGLES = (0.5, 1e-1, 1e-2, 1e-4, 1e-8, 1e-12, 1e-14, 1e-15)


def edge_on(angle: float) -> tuple[Interface, FloatArray]:
    """Return a slave that is turned by an angle from the normal of the first master segment, and its state."""
    along = (VALLEY[1] - VALLEY[0]) / np.linalg.norm(VALLEY[1] - VALLEY[0])
    normal = np.array([along[1], -along[0]])
    half = (normal * np.cos(angle) - along * np.sin(angle)) / 4
    interface = Interface.from_chains([[-0.25, 0.5], [0.25, 0.5]], VALLEY)
    return interface, np.vstack([MIDDLE - half, MIDDLE + half, VALLEY]).reshape(-1)


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("angle", ANGLES)
def test_no_force_exceeds_the_contact_force_and_all_balance(angle: float, n: int) -> None:
    interface, z = edge_on(angle)
    forces = contact_forces(vts_ppt_balanced(penalty=1.0, n=n), interface, z)
    total = np.abs(forces[:2]).sum()
    assert total > 0
    assert np.abs(forces).max() <= total
    assert np.abs(forces.sum(axis=0)).max() <= 1e-15 * total
    arms = z.reshape(-1, 2)
    moment = (arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum()
    assert abs(moment) <= 1e-14 * total


@pytest.mark.parametrize("angle", ANGLES[:5])
def test_the_tangent_stays_the_derivative(angle: float) -> None:
    interface, z = edge_on(angle)
    formulation = vts_ppt_balanced(penalty=1.0)
    pairing = formulation.pair(interface, z)
    derivative = complex_step(formulation, interface, pairing, z)
    tangent = formulation.tangent(interface, pairing, z).toarray()
    assert tangent == pytest.approx(derivative, abs=1e-13 * np.abs(derivative).max())


def test_the_printed_algorithm_walks_as_before() -> None:
    interface, z = edge_on(0.1)
    assert (vts_ppt(penalty=1.0).pair(interface, z)["last"] == 1).all()
    balanced = vts_ppt_balanced(penalty=1.0).pair(interface, z)
    assert np.array_equal(balanced["first"], balanced["last"])


@pytest.mark.parametrize("name", ["vts-ppt:n=3", "vts-ppt-balanced:n=3"])
def test_a_slave_that_is_edge_on_by_rounding_gets_finite_forces(name: str) -> None:
    interface = Interface(np.array(EDGE_ON), Surface([[1, 0], [2, 4], [0, 3], [3, 2]]), Surface([[6, 7], [5, 6]]))
    formulation, z = load_subject(name).with_penalty(1.0), interface.nodes.reshape(-1)
    pairing = formulation.pair(interface, z)
    assert pairing is not None
    assert pairing["active"][6]
    assert np.isfinite(formulation.residual(interface, pairing, z)).all()


def points_of(name: str, interface: Interface) -> ContactPoints:
    formulation, z = load_subject(name).with_penalty(4.0), interface.nodes.reshape(-1)
    return formulation.contact_points(interface, formulation.pair(interface, z), z)


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
