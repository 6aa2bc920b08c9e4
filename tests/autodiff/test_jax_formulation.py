"""Formulations made by JAX: forces, tangents and padding against numpy, compilations counted, mistakes refused."""

import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from fresh_process import PYTHON

from contactverif import (
    Abilities,
    CheckedFormulation,
    ContractError,
    Interface,
    MisuseError,
    Subject,
    Traits,
    from_energy,
    from_residual,
)

COMPILATION = "/jax/core/compile/backend_compile_duration"  # The event of JAX for each function that is compiled.
PENALTY = 3.0


def energy(x: Any, reference: Any, decisions: Any, penalty: Any) -> Any:
    """Return the energy of a spring between two nodes that resists a change of its squared length."""
    along, before = x[1] - x[0], reference[1] - reference[0]
    return penalty * decisions["active"] * ((along**2).sum() - (before**2).sum()) ** 2 / 4


def forces(x: Any, reference: Any, decisions: Any, penalty: Any) -> Any:
    """Return the gradient of the energy, by hand."""
    along, before = x[1] - x[0], reference[1] - reference[0]
    pull = penalty * decisions["active"] * ((along**2).sum() - (before**2).sum()) * along
    return pull * np.array([[-1.0], [1.0]])


def pair(interface: Interface, z: Any) -> dict[str, Any]:
    """Return a spring for each slave segment; every third one is not active, and none is far from the origin."""
    segments = interface.slave.segments[: len(interface.slave) * (abs(z[0]) < 100)]
    return {"nodes": segments, "active": np.arange(len(segments)) % 3 > 0}


def states(n_segments: int) -> tuple[Interface, Any]:
    """Return an interface with that many slave segments, and a state near its reference."""
    slave = np.column_stack([np.arange(n_segments + 1.0), np.zeros(n_segments + 1)])
    interface = Interface.from_chains(slave, [[n_segments, 0], [0, 0]])
    return interface, interface.nodes.reshape(-1) + np.random.default_rng(n_segments).normal(
        0, 0.3, interface.n_unknowns
    )


def expected_forces(interface: Interface, z: Any) -> Any:
    """Return the forces of all springs, spring by spring in numpy."""
    x, total, pairing = z.reshape(-1, 2), np.zeros((interface.n_nodes, 2)), pair(interface, z)
    for nodes, active in zip(pairing["nodes"], pairing["active"], strict=True):
        total[nodes] += forces(x[nodes], interface.nodes[nodes], {"active": active}, PENALTY)
    return total.reshape(-1)


@pytest.fixture(params=["energy", "residual"])
def formulation(request: pytest.FixtureRequest) -> CheckedFormulation:
    make = from_energy(energy, pair=pair) if request.param == "energy" else from_residual(forces, pair=pair)
    return Subject("springs", make).with_penalty(PENALTY)


@pytest.mark.parametrize("n_segments", [1, 5, 16, 17])
def test_forces_and_tangent_are_those_of_the_springs(formulation: CheckedFormulation, n_segments: int) -> None:
    interface, z = states(n_segments)
    pairing = formulation.own_pairing(interface, z)
    answer = formulation.residual(interface, pairing, z)
    # Numbers about 1, rounded in another order; the tangent is compared with differences, which err by 1e-16/h and h².
    np.testing.assert_allclose(answer, expected_forces(interface, z), rtol=1e-14, atol=1e-14)
    tangent = formulation.tangent(interface, pairing, z).toarray()
    h = 2.0**-17
    columns = [
        (expected_forces(interface, z + h * unit) - expected_forces(interface, z - h * unit)) / (2 * h)
        for unit in np.eye(z.size)
    ]
    np.testing.assert_allclose(tangent, np.column_stack(columns), atol=1e-7)
    np.testing.assert_allclose(tangent, tangent.T, atol=1e-14)


def test_a_state_without_elements_has_no_forces(formulation: CheckedFormulation) -> None:
    interface, z = states(3)
    pairing = formulation.own_pairing(interface, z + 1000)
    assert not formulation.residual(interface, pairing, z).any()
    assert formulation.tangent(interface, pairing, z).nnz == 0


@pytest.fixture
def compilations() -> Iterator[list[str]]:
    """Return a list that grows by one with each function that JAX compiles."""
    import jax

    events: list[str] = []

    def note(event: str, seconds: float, **details: Any) -> None:
        if event == COMPILATION:
            events.append(event)

    jax.monitoring.register_event_duration_secs_listener(note)
    yield events
    jax.monitoring.clear_event_listeners()


def test_another_mesh_compiles_nothing_within_a_power_of_two(compilations: list[str]) -> None:
    make = from_energy(energy, pair=pair)

    def compile_for(n_segments: int, penalty: float) -> int:
        interface, z = states(n_segments)
        before, springs = len(compilations), make(penalty=penalty)
        pairing = Subject("springs", make).with_penalty(penalty).own_pairing(interface, z)
        springs.residual(interface, pairing, z)
        springs.tangent(interface, pairing, z)
        return len(compilations) - before

    assert compile_for(3, 1.0) > 0
    assert compile_for(16, 2.0) == 0
    assert compile_for(17, 2.0) > 0
    assert compile_for(32, 1.0) == 0


@pytest.mark.parametrize(
    ("pairing", "message"),
    [
        ({"active": np.array([True])}, r"pair: 'nodes' of shape \(0,\), float64; needed int64 \(n_elements, n\)"),
        ({"nodes": np.array([0, 1])}, r"pair: 'nodes' of shape \(2,\), int64; needed int64 \(n_elements, n\)"),
        (
            {"nodes": np.array([[0, 1]]), "active": np.array([True, False])},
            r"pair: 'active' of shape \(2,\); needed a row for each of 1 elements",
        ),
    ],
)
def test_a_pairing_without_rows_of_elements_is_refused(pairing: dict[str, Any], message: str) -> None:
    springs = from_energy(energy, pair=lambda interface, z: pairing)
    interface, z = states(1)
    with pytest.raises(ContractError, match=message):
        Subject("springs", springs).with_penalty(1.0).own_pairing(interface, z)


def test_a_trait_that_jax_cannot_keep_is_refused() -> None:
    with pytest.raises(MisuseError, match=r"traits: found Abilities.*takes_complex=True.*; needed an ability that JAX"):
        from_energy(energy, pair=pair, traits=Traits(abilities=Abilities(takes_complex=True)))


def test_without_jax_one_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "jax", None)
    with pytest.raises(MisuseError, match=r"^jax: found no JAX .*; needed pip install 'contactverif\[jax\]'$"):
        from_residual(forces, pair=pair)


def test_jax_has_one_thread_to_compute() -> None:
    code = "import contactverif, os; contactverif.from_energy(sum, pair=dict); import jax; jax.numpy.ones(9).sum()"
    count = "names = [open(f'/proc/self/task/{task}/comm').read() for task in os.listdir('/proc/self/task')]"
    finished = subprocess.run(
        [*PYTHON, "-c", f"{code}; {count}; print(sum('Eigen' in name for name in names))"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert int(finished.stdout) <= 1, "JAX of 2024 has no such thread, later ones have one for each core"
