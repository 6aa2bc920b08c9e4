"""Segment-to-segment and all that integrates over the same cells: exact forces, and contact points."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from surfaces import DEPTH, contact_forces, make_bent, make_flat

import contactverif_mortar
from contactverif import Interface, MisuseError, named_case
from contactverif.oracle import uniform_pressure_weights_exact

PRESSURE_FROM_POSITIONS = [
    ("sts", {}),
    ("sts", {"area": "reference"}),
    ("chen_hisada", {}),
    ("mortar", {}),
    ("mortar", {"area": "reference"}),
    ("mortar_dual", {}),
    ("mortar", {"normals": "averaged"}),
    ("mortar_dual", {"normals": "averaged", "area": "reference"}),
]
MULTIPLIERS = [
    ("mortar_lm", {}),
    ("mortar_dual_lm", {}),
    ("mortar_lm", {"normals": "averaged", "area": "reference"}),
    ("mortar_dual_lm", {"normals": "averaged"}),
]
METHODS = [*PRESSURE_FROM_POSITIONS, *MULTIPLIERS]


def ids(methods: list[tuple[str, dict[str, str]]]) -> list[str]:
    return [f"{name}{options or ''}" for name, options in methods]


def make(name: str, options: dict[str, str], penalty: float = 8.0) -> Any:
    return getattr(contactverif_mortar, name)(penalty=penalty, **options)


def make_state(formulation: Any, seed: int) -> tuple[Interface, Any]:
    """Bent surfaces, and multipliers behind the positions where the formulation has any."""
    interface, z = make_bent(seed)
    if hasattr(formulation, "n_multipliers"):
        multipliers = np.random.default_rng(seed).uniform(0, 3, formulation.n_multipliers(interface))
        z = np.append(z, multipliers)
    return interface, z


@pytest.mark.parametrize(("name", "options"), PRESSURE_FROM_POSITIONS, ids=ids(PRESSURE_FROM_POSITIONS))
@pytest.mark.parametrize("case", ["a1", "a2", "b", "c", "c-prime"])
def test_a_uniform_pressure_is_transmitted_as_in_rationals(case: str, name: str, options: dict[str, str]) -> None:
    flat_case = named_case(case)
    interface, z = flat_case.interface, flat_case.z
    forces = contact_forces(make(name, options, flat_case.penalty), interface, z)
    exact = uniform_pressure_weights_exact(interface, flat_case.parameters["along"])
    signs = np.where(np.arange(interface.n_nodes) < interface.n_slave_nodes, 1, -1)
    assert forces[:, 1] * signs == pytest.approx([float(value) for value in exact], abs=64 * 2.0**-53)
    if case != "c-prime":  # 3.2 is none of the binary numbers
        computed = [Fraction(value).limit_denominator(60) for value in (forces[:, 1] * signs).tolist()]
        assert computed == exact
    assert not forces[:, 0].any()


@pytest.mark.parametrize(("name", "options"), PRESSURE_FROM_POSITIONS, ids=ids(PRESSURE_FROM_POSITIONS))
def test_so_it_is_on_random_meshes_and_with_many_segments_under_one(name: str, options: dict[str, str]) -> None:
    random = np.random.default_rng(1)
    meshes = [(random.integers(1, 9, n).tolist(), random.integers(1, 9, m).tolist()) for n in (1, 4) for m in (1, 5, 9)]
    meshes += [([12.0], [0.125] * 96), ([0.125] * 96, [12.0]), ([5.0, 2.0**-18, 3.0], [2.0**-17, 20.0])]
    for slave, master in meshes:
        master = [*master, max(sum(slave) - sum(master), 1.0)]  # the slave overhangs nowhere
        interface, z = make_flat(slave, master)
        exact = uniform_pressure_weights_exact(interface, z[::2])
        forces = contact_forces(make(name, options, 1 / DEPTH), interface, z)
        assert np.abs(forces[:, 1]) == pytest.approx([float(value) for value in exact], abs=1e-13)


@pytest.mark.parametrize(("name", "options"), METHODS, ids=ids(METHODS))
def test_no_contact_is_no_force_and_no_error(name: str, options: dict[str, str]) -> None:
    formulation = make(name, options)
    for lift in (0.01, 100.0):
        interface, z = make_flat([2, 2], [3, 1])
        x = interface.nodes.copy()
        x[:3, 1] += lift
        n = formulation.n_multipliers(interface) if hasattr(formulation, "n_multipliers") else 0
        z = np.append(x, np.zeros(n))
        pairing = formulation.pair(interface, z)
        assert not pairing["active"].any()
        assert not formulation.residual(interface, pairing, z).any()
        tangent = formulation.tangent(interface, pairing, z)
        assert tangent.shape == (z.size, z.size)
        assert np.linalg.matrix_rank(tangent.toarray()) == n
        formulation.contact_points(interface, pairing, z)


@pytest.mark.parametrize(("name", "options"), METHODS, ids=ids(METHODS))
def test_surfaces_that_touch_exactly_are_in_contact(name: str, options: dict[str, str]) -> None:
    formulation = make(name, options)
    interface, _ = make_flat([2, 2], [3, 1])
    n = formulation.n_multipliers(interface) if hasattr(formulation, "n_multipliers") else 0
    assert formulation.pair(interface, np.append(interface.nodes, np.zeros(n)))["active"].all()


@pytest.mark.parametrize("name", ["sts", "mortar", "mortar_dual"])
def test_a_half_covered_slave_pushes_with_what_is_covered(name: str) -> None:
    interface, z = make_flat([1, 4, 3], [0.5, 2], shift=2.0)  # the master covers [2, 4.5] of [0, 8]
    forces = contact_forces(make(name, {}, 1 / DEPTH), interface, z)
    # ∫N over [2, 4.5] on the segment [1, 5], and on the master's own.
    exact = [0, 2.5 * (5 - 3.25) / 4, 2.5 * (3.25 - 1) / 4, 0, -1, -1.25, -0.25]
    assert forces[:, 1] == pytest.approx(exact, abs=1e-15)


@pytest.mark.parametrize(("name", "options"), METHODS, ids=ids(METHODS))
def test_contact_points_add_up_to_the_forces(name: str, options: dict[str, str]) -> None:
    formulation = make(name, options)
    for seed in range(20):
        interface, z = make_state(formulation, seed)
        pairing = formulation.pair(interface, z)
        points = formulation.contact_points(interface, pairing, z)
        assert np.all(points.weight >= 0)
        assert np.all(points.pressure[~points.active] == 0)
        if "mortar" in name:
            assert len(points.gap) == interface.n_slave_nodes
            assert points.weighted.all()
            assert np.isfinite(points.normal[points.pressure > 0]).all()  # A node that overhangs has one too.
            continue
        assert not points.weighted.any()
        pushes = (points.pressure * points.weight)[:, None] * points.normal
        slave = contact_forces(formulation, interface, z)[: interface.n_slave_nodes].sum(axis=0)
        assert pushes.sum(axis=0) == pytest.approx(slave, rel=1e-14, abs=1e-14)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("sts", {"penalty": 0.0}),
        ("sts", {"penalty": 1.0, "area": "slave"}),
        ("mortar", {"penalty": float("nan")}),
        ("mortar_dual_lm", {"penalty": 1.0, "normals": 3}),
        ("chen_hisada", {"penalty": 1.0, "tau": 1.0}),
        ("chen_hisada", {"penalty": True}),
    ],
)
def test_options_that_cannot_be_used_say_so(name: str, options: dict[str, Any]) -> None:
    with pytest.raises(MisuseError) as caught:
        getattr(contactverif_mortar, name)(**options)
    assert caught.value.argument == list(options)[-1]
