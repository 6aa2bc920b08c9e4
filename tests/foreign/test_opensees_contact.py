"""The elements of OpenSees give the springs that their documentation states, from both sides."""

from itertools import pairwise

import numpy as np
import pytest

from contactverif import Interface, MisuseError, Surface
from contactverif_foreign import opensees_contact

SLAVE = [[0.0, -0.1], [1.5, -0.2], [4.0, -0.1]]
MASTER = [[5.0, 0.0], [2.0, 0.1], [-1.0, 0.0]]


@pytest.fixture(params=["nts", "interface"])
def formulation(request: pytest.FixtureRequest) -> opensees_contact.OpenSeesContact:
    pytest.importorskip("openseespy")
    return opensees_contact.opensees(penalty=10.0, kind=request.param)


def springs(x: np.ndarray, n_slave: int) -> np.ndarray:
    """Return the forces of springs of stiffness 10, one for each node and each segment that it lies behind."""
    residual = np.zeros_like(x)
    chains = np.arange(n_slave), np.arange(n_slave, len(x))
    for nodes, others in (chains, chains[::-1]):
        for node in nodes:
            for first, second in pairwise(others):
                along = x[second] - x[first]
                normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)  # Into the body on the left.
                depth, share = (x[node] - x[first]) @ normal, (x[node] - x[first]) @ along / (along @ along)
                if depth >= 0 and 0 < share < 1:
                    for number, part in ((node, 1.0), (first, share - 1), (second, -share)):
                        residual[number] += 10.0 * depth * part * normal
    return residual


def test_springs_stand_at_the_nodes_of_both_surfaces(formulation: opensees_contact.OpenSeesContact) -> None:
    interface = Interface.from_chains(SLAVE, MASTER)
    residual = formulation.residual(interface, None, interface.nodes.ravel())
    exact = springs(np.array([*SLAVE, *MASTER]), 3)
    np.testing.assert_allclose(residual.reshape(-1, 2), exact, rtol=0, atol=1e-14)
    assert exact[1, 1] < 0  # Minus the residual pushes the slave up, out of the master.
    tangent = formulation.tangent(interface, None, interface.nodes.ravel())
    assert tangent.shape == (12, 12)
    assert tangent[3, 3] > 0


def test_each_pair_of_chains_has_an_element(formulation: opensees_contact.OpenSeesContact) -> None:
    far = np.array([100.0, 0.0])
    both = np.vstack([SLAVE, SLAVE + far, MASTER, MASTER + far])
    numbers = np.arange(12).reshape(4, 3)
    segments = np.stack([numbers[:, :-1], numbers[:, 1:]], axis=-1)
    interface = Interface(both, Surface(segments[:2].reshape(-1, 2)), Surface(segments[2:].reshape(-1, 2)))
    residual = formulation.residual(interface, None, both.ravel()).reshape(4, 3, 2)
    alone = springs(np.array([*SLAVE, *MASTER]), 3).reshape(2, 3, 2)
    np.testing.assert_allclose(residual, alone[[0, 0, 1, 1]], rtol=0, atol=1e-12)


def test_a_closed_chain_is_refused(formulation: opensees_contact.OpenSeesContact) -> None:
    square = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]
    interface = Interface(
        np.array([*square, [1.0, 0.1], [0.0, 0.1]]), Surface([[0, 1], [1, 2], [2, 3], [3, 0]]), Surface([[4, 5]])
    )
    with pytest.raises(MisuseError, match="a closed chain"):
        formulation.residual(interface, None, interface.nodes.ravel())


def test_an_unknown_kind_and_a_missing_package_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(MisuseError, match="needed 'nts' or 'interface'"):
        opensees_contact.opensees(penalty=1.0, kind="mortar")
    monkeypatch.setattr(opensees_contact, "find_spec", lambda name: None)
    with pytest.raises(MisuseError, match=r"pip install 'contactverif\[opensees\]'"):
        opensees_contact.opensees(penalty=1.0, kind="nts")
