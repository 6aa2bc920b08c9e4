"""Forces of node-to-segment formulations, and the known defects of the printed algorithm.

The tables of the paper are asked by `patch.flat.published`, with tables by hand in `tests/properties`.
"""

import numpy as np
import pytest
from every_formulation import load
from surfaces import DEPTH, contact_forces, make_bent, make_closed, make_flat, turn

PENALTY = 8.0  # p = ε̂ |g| = 1
EVERY = ("nts", "nts-ar", "vts-g", "vts-me", "vts-ppt", "vts-ppt-basic", "vts-ppt-balanced")


@pytest.mark.parametrize("theta", [0.1, 0.3])
def test_printed_ppt_loses_one_minus_cosine_of_the_slave_force(theta: float) -> None:
    interface, z = make_flat([1.0], [1.3, 1.4], shift=-0.8)
    x = z.reshape(-1, 2).copy()
    x[1] = x[0] + [np.cos(theta), -np.sin(theta)]  # penetrates deeper to the right; each area covers both segments
    forces = contact_forces(load("vts-ppt:n=1"), interface, x.ravel())
    pairing = load("vts-ppt:n=1").pair(interface, x.ravel())
    assert pairing["first"][0] != pairing["last"][0]
    defect = np.linalg.norm(forces.sum(axis=0)) / np.linalg.norm(forces[:2].sum(axis=0))
    assert defect == pytest.approx(1 - np.cos(theta), rel=1e-12)
    balanced = contact_forces(load("vts-ppt-balanced:n=1"), interface, x.ravel())
    assert np.linalg.norm(balanced.sum(axis=0)) < 16 * 2.0**-53


def test_basic_has_the_residual_of_the_printed_one_and_the_tangent_of_vts_me() -> None:
    differs = 0
    for seed in range(50):
        interface, z = make_bent(seed)
        printed, basic, me = map(load, ("vts-ppt", "vts-ppt-basic", "vts-me"))
        pairing, pairing_me = printed.pair(interface, z), me.pair(interface, z)
        assert np.array_equal(printed.residual(interface, pairing, z), basic.residual(interface, pairing, z))
        tangent = basic.tangent(interface, pairing, z).toarray()
        if np.array_equal(pairing["active"], pairing_me["active"]):
            assert tangent == pytest.approx(me.tangent(interface, pairing_me, z).toarray(), abs=1e-12)
        differs += not np.allclose(tangent, printed.tangent(interface, pairing, z).toarray())
    assert differs > 10


def test_free_ends_truncate_extend_and_cover() -> None:
    """Half of the slave's last quarter overhangs; beside it a short last segment of the master."""
    interface, z = make_flat([4.0], [3.375, 0.125], shift=0.0)
    n_slave = interface.n_slave_nodes
    truncated = contact_forces(load("vts-ppt"), interface, z)
    extended = contact_forces(load("vts-ppt:free_end=extend"), interface, z)
    covered = contact_forces(load("vts-ppt-balanced"), interface, z)
    assert truncated[:n_slave, 1].sum() == 4
    assert -truncated[n_slave:, 1].sum() == 3.5
    b = 5.0  # the area of competence ends five lengths of the last segment behind its beginning
    assert -extended[n_slave, 1] == 0.125 * b**2 / 2
    assert -extended[n_slave:, 1].sum() == 4
    assert covered[:n_slave, 1].sum() == 3.5
    exact = [3.5 - 3.5**2 / 8, 3.5**2 / 8, 1 / 16, 3.5 / 2, 3.375 / 2]  # uniform pressure on [0, 3.5]
    assert covered[:, 1] * np.sign(covered[:, 1]) == pytest.approx(exact, rel=1e-14)


@pytest.mark.parametrize(("shift", "lift"), [(5.0, 0.0), (0.0, DEPTH), (0.0, 2 * DEPTH)])
@pytest.mark.parametrize("name", EVERY)
def test_wholly_past_the_master_open_or_exactly_closed_there_is_no_force(name: str, shift: float, lift: float) -> None:
    interface, z = make_flat([2, 2], [3, 1], shift)
    x = z.reshape(-1, 2) + [0.0, lift] * (np.arange(interface.n_nodes) < interface.n_slave_nodes)[:, None]
    assert not contact_forces(load(name), interface, x.ravel()).any()


@pytest.mark.parametrize("angle", np.linspace(0.1, 6.2, 23))
@pytest.mark.parametrize("name", EVERY)
def test_a_node_that_faces_a_free_end_is_not_lost_to_roundoff(name: str, angle: float) -> None:
    interface, z = make_flat([2, 2, 4, 4], [3, 3, 3, 3])
    turned = contact_forces(load(name), interface, turn(z.reshape(-1, 2), angle).ravel())
    assert turn(turned, -angle) == pytest.approx(contact_forces(load(name), interface, z), abs=1e-13)


def test_several_and_closed_chains() -> None:
    """A closed square master inside a closed square slave that presses on all four of its sides."""
    inner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)  # body on the left: counter-clockwise
    outer = 0.95 * inner[::-1] * [1, 1]  # a hole: clockwise, a little too small
    interface = make_closed(outer, inner)
    assert (interface.master.neighbours >= 0).all()
    for name in ("nts-ar", "vts-me", "vts-ppt", "vts-ppt-balanced"):
        forces = contact_forces(load(name), interface, interface.nodes.ravel())
        assert np.abs(forces.sum(axis=0)).max() < 1e-14
        radial = (forces[:4] * outer).sum(axis=1)
        assert radial == pytest.approx(radial[0])
        assert radial[0] > 0
