"""The contact of NGSolve is read in the signs and the order of this project, with the places that it found."""

import numpy as np
import pytest
from subjects import judge_as, load_property, load_subject

from contactverif import Case, Interface, MisuseError, Pairing, Surface, Verdict
from contactverif_foreign import ngsolve_energy

DEPTH, PENALTY = 0.05, 10.0
INTERFACE = Interface.from_chains([[0.0, 0.0], [1.5, 0.0], [4.0, 0.0]], [[5.0, 0.0], [2.0, 0.0], [-1.0, 0.0]])


def press(depth: float) -> np.ndarray:
    z = INTERFACE.nodes.copy()
    z[: INTERFACE.n_slave_nodes, 1] -= depth
    return z.ravel()


@pytest.fixture(params=["energy", "work"])
def formulation(request: pytest.FixtureRequest) -> ngsolve_energy.NGSolveContact:
    pytest.importorskip("ngsolve")
    return ngsolve_energy.ngsolve(penalty=PENALTY, kind=request.param)


def test_a_uniform_depth_pushes_the_slave_up_and_the_master_down(formulation: ngsolve_energy.NGSolveContact) -> None:
    z = press(DEPTH)
    forces = formulation.residual(INTERFACE, Pairing(formulation.pair(INTERFACE, z)), z).reshape(-1, 2)
    lengths = np.array([0.75, 2.0, 1.25])  # A slave node has half of its segments.
    np.testing.assert_allclose(forces[:3], np.outer(-PENALTY * DEPTH * lengths, [0.0, 1.0]), atol=1e-13)
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-13)
    assert (forces[3:, 1] > 0).all()


def test_the_tangent_is_the_derivative_where_places_are_fixed(formulation: ngsolve_energy.NGSolveContact) -> None:
    z = press(DEPTH)
    z[1] -= 0.01
    pairing, steps = Pairing(formulation.pair(INTERFACE, z)), 1e-6 * np.eye(len(z))
    tangent = formulation.tangent(INTERFACE, pairing, z).toarray()
    forward, back = ([formulation.residual(INTERFACE, pairing, z + sign * step) for step in steps] for sign in (1, -1))
    np.testing.assert_allclose(tangent, (np.array(forward) - back).T / 2e-6, atol=1e-7)
    np.testing.assert_allclose(tangent, tangent.T, atol=1e-13)


def test_surfaces_apart_have_no_forces(formulation: ngsolve_energy.NGSolveContact) -> None:
    z = press(-DEPTH)
    pairing = Pairing(formulation.pair(INTERFACE, z))
    assert not formulation.residual(INTERFACE, pairing, z).any()
    assert not formulation.tangent(INTERFACE, pairing, z).toarray().any()


def test_the_place_of_a_point_does_not_depend_on_the_order_of_segments() -> None:
    """An infinite distance of the search did that: `renumbering` failed in 24 of 600 states."""
    pytest.importorskip("ngsolve")
    slave, master = Surface([[0, 1], [1, 2], [2, 0]]), [[3, 4], [4, 5], [5, 3]]
    nodes = [[-1.25, -2.22], [-1.25, 2.28], [2.65, 0.03], [4.0, 0.0], [0.08, 4.0], [-4.0, 0.08]]
    z, formulation = np.array(nodes).ravel(), ngsolve_energy.ngsolve(penalty=PENALTY, kind="energy")
    forces = [
        formulation.residual(interface, Pairing(formulation.pair(interface, z)), z)
        for interface in (Interface(nodes, slave, Surface(order)) for order in (master, [master[2], *master[:2]]))
    ]
    assert np.linalg.norm(forces[0]) > 1.0
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-13 * PENALTY)  # Roundings: sums of the same springs


@pytest.mark.parametrize("order", [5, 7, 9])
def test_computed_weights_of_integration_are_no_mistake(order: int) -> None:
    """They add up to 1 − 26u, 1 − 54u and 1 − 71u, and one segment on one has exact forces at any order."""
    pytest.importorskip("ngsolve")
    subject, question = load_subject(f"ngsolve:kind=energy,order={order}"), load_property("patch.flat.normal")
    interface = Interface.from_chains([[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [-1.5, 0.0]])
    z = interface.nodes - np.repeat([[0.0, 1.25], [0.0, 0.0]], 2, axis=0)
    flat = {"penetration": np.array(1.25), "along": interface.nodes[:, 0], "direction": np.array([1.0, 0.0])}
    case = Case(interface, z.ravel(), 1.0, flat)
    judge_as(Verdict.PASS, question, case, subject)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ngsolve_energy, "find_spec", lambda name: None)
    with pytest.raises(MisuseError, match=r"pip install 'contactverif\[ngsolve\]'"):
        ngsolve_energy.ngsolve(penalty=1.0, kind="energy")
