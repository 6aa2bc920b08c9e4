"""The contact of fedoo is read in the signs and the order of this project, with the pairs that its search found."""

from importlib.util import find_spec

import numpy as np
import pytest

from contactverif import Interface, MisuseError, Pairing
from contactverif_foreign import fedoo_contact

INTERFACE = Interface.from_chains([[0.0, -0.1], [1.5, -0.2], [4.0, -0.1]], [[5.0, 0.0], [2.0, 0.1], [-1.0, 0.0]])


@pytest.fixture(params=["search_nearest", "ipctk"])
def formulation(request: pytest.FixtureRequest) -> fedoo_contact.FedooContact:
    for package in ("ipctk", "fedoo"):
        if find_spec(package) is None:  # An import of fedoo here would warn of its solver.
            pytest.skip(f"{package} is not installed")
    return fedoo_contact.fedoo(penalty=10.0, kind=request.param)


def test_springs_stand_at_the_slave_nodes(formulation: fedoo_contact.FedooContact) -> None:
    z = INTERFACE.nodes.ravel()
    pairing = Pairing(formulation.pair(INTERFACE, z))
    assert pairing["master_segment"].tolist() == [1, 1, 0]
    residual, tangent = formulation.residual_and_tangent(INTERFACE, pairing, z)
    slave, along = INTERFACE.nodes[0], INTERFACE.nodes[4] - INTERFACE.nodes[5]
    normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)  # Out of the master, which runs to the left.
    np.testing.assert_allclose(-residual[:2], -10.0 * ((slave - INTERFACE.nodes[5]) @ normal) * normal, atol=1e-14)
    assert residual[1] < 0  # Minus the residual pushes the slave up.
    steps = 1e-6 * np.eye(len(z))
    forward, back = ([formulation.residual(INTERFACE, pairing, z + sign * step) for step in steps] for sign in (1, -1))
    np.testing.assert_allclose(tangent.toarray(), (np.array(forward) - back).T / 2e-6, atol=1e-7)


def test_surfaces_apart_have_no_forces(formulation: fedoo_contact.FedooContact) -> None:
    z = INTERFACE.nodes.ravel().copy()
    z[1:6:2] += 1.0
    pairing = Pairing(formulation.pair(INTERFACE, z))
    assert (pairing["master_segment"] == -1).all()
    assert not formulation.residual(INTERFACE, pairing, z).any()
    assert not formulation.tangent(INTERFACE, pairing, z).toarray().any()


def test_an_unknown_kind_and_a_missing_package_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(MisuseError, match="needed 'bucket' or 'search_nearest' or 'ipctk'"):
        fedoo_contact.fedoo(penalty=1.0, kind="mortar")
    monkeypatch.setattr(fedoo_contact, "find_spec", lambda name: None)
    with pytest.raises(MisuseError, match=r"pip install 'contactverif\[fedoo\]'"):
        fedoo_contact.fedoo(penalty=1.0, kind="bucket")
