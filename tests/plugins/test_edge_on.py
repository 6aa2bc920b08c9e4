"""The balanced VTS-PPT on a slave segment that is seen nearly edge-on, in a valley of the master.

The foot of a virtual slave node lies past the end of its master segment there, and so does its whole area. The share of
that segment, W/S, once grew like 1/S: at 1e-15 rad the forces were 1e14 times the contact force and out of balance.
"""

import numpy as np
import pytest
from surfaces import contact_forces

from contactverif import Interface
from contactverif.contract.arrays import FloatArray
from contactverif_nts import vts_ppt, vts_ppt_balanced

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
    derivative = formulation.residual(interface, pairing, z + 1e-30j * np.eye(z.size)).imag.T / 1e-30
    tangent = formulation.tangent(interface, pairing, z).toarray()
    assert tangent == pytest.approx(derivative, abs=1e-13 * np.abs(derivative).max())


def test_the_printed_algorithm_walks_as_before() -> None:
    interface, z = edge_on(0.1)
    assert (vts_ppt(penalty=1.0).pair(interface, z)["last"] == 1).all()
    balanced = vts_ppt_balanced(penalty=1.0).pair(interface, z)
    assert np.array_equal(balanced["first"], balanced["last"])
