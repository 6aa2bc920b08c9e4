"""The formulations on faces: what they transmit, what balances, and that their tangents are derivatives."""

from collections.abc import Callable
from functools import cache
from math import factorial
from typing import Any

import numpy as np
import pytest
from planned_cases import draw_cases

import contactverif_surfaces
from contactverif import Case, Interface, Pairing, Subject, named_case
from contactverif.contract.arrays import UNIT_ROUNDOFF, FloatArray
from contactverif.oracle.flat_answers import uniform_surface_weights
from contactverif.strategies.surfaces import flat_surface_cases, smooth_surface_cases
from contactverif_surfaces.cell_points import GAUSS, evaluate_shapes

NAMES = contactverif_surfaces.__all__
PASSING = [name for name in NAMES if not name.startswith("nts")]
ON_QUADRILATERALS = ["sts_3d", "mortar_3d", "vts_ppt_3d", "vts_ppt_balanced_3d"]


def factory(name: str) -> Any:
    return getattr(contactverif_surfaces, name)


@cache
def states(strategy: Callable[[], Any], count: int) -> tuple[Case, ...]:
    return draw_cases(strategy(), seed="surface formulations", examples=count).cases


def exact_forces(case: Case) -> FloatArray:
    """Return the forces that push the nodes apart."""
    weights = uniform_surface_weights(case.interface, case.parameters["plane"], case.parameters["domain"])
    sides = np.where(np.arange(len(weights)) < case.interface.n_slave_nodes, 1.0, -1.0)
    pressure = case.penalty * case.parameter("penetration")
    return pressure * (sides * weights)[:, None] * case.parameters["normal"]


def flat_error(name: str, case: Case) -> float:
    """Return the largest error of a nodal force over the largest nodal force."""
    formulation = Subject(name, factory(name)).for_case(case)
    forces = -formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z).reshape(-1, 3)
    exact = exact_forces(case)
    return float(np.linalg.norm(forces - exact, axis=1).max() / np.linalg.norm(exact, axis=1).max())


def tolerance(case: Case) -> float:
    return UNIT_ROUNDOFF * (8 * case.largest_coordinate / case.parameter("penetration") + 4 * case.n_segments)


@pytest.mark.parametrize("name", PASSING)
def test_a_uniform_pressure_is_transmitted(name: str) -> None:
    shares = [flat_error(name, case) / tolerance(case) for case in states(flat_surface_cases, 100)]
    print(f"\n{name}: the largest error is {max(shares):.2g} tolerances")
    assert max(shares) < 1


@pytest.mark.parametrize("name", ["nts_3d", "nts_ar_3d"])
def test_springs_at_nodes_do_not_transmit_it(name: str) -> None:
    assert flat_error(name, named_case("crossed-diagonals")) > 0.1
    assert np.median([flat_error(name, case) for case in states(flat_surface_cases, 30)]) > 0.02


@pytest.mark.parametrize("name", [name for name in NAMES if name != "vts_ppt_3d"])
def test_forces_and_moments_balance(name: str) -> None:
    for case in (*states(smooth_surface_cases, 30), named_case("tilted-faces")):
        formulation = factory(name)(penalty=1.0)
        pairing = formulation.pair(case.interface, case.z)
        forces = formulation.residual(case.interface, pairing, case.z).reshape(-1, 3)
        arms = case.positions - case.positions.mean(axis=0)
        whole = np.abs(forces).sum()
        # A normal is rounded at the distance from the origin, over the least height of a face.
        rounding = 64 * UNIT_ROUNDOFF * case.largest_coordinate / case.shortest_segment
        assert np.abs(forces.sum(axis=0)).max() <= 1e-14 * whole
        assert np.abs(np.cross(arms, forces).sum(axis=0)).max() <= rounding * whole * case.diameter


@pytest.mark.parametrize("name", NAMES)
def test_tangents_are_derivatives_on_a_frozen_pairing(name: str) -> None:
    random = np.random.default_rng(1)
    for case in states(smooth_surface_cases, 15):
        formulation, interface = factory(name)(penalty=1.0), case.interface
        pairing = formulation.pair(interface, case.z)
        direction, tangent = random.normal(size=case.z.size), formulation.tangent(interface, pairing, case.z)
        step = formulation.residual(interface, pairing, case.z + 2.0**-200 * 1j * direction).imag * 2.0**200
        move = 1e-5 * case.shortest_segment
        ahead, behind = (
            formulation.residual(interface, pairing, case.z + sign * move * direction) for sign in (1.0, -1.0)
        )
        size = np.linalg.norm(step)
        noise = 1e-15 * case.largest_coordinate / move * np.abs(tangent.toarray()).max() * len(direction)
        assert np.linalg.norm(tangent @ direction - step) <= 1e-12 * size
        assert np.linalg.norm((ahead - behind) / (2 * move) - step) <= 1e-4 * size + noise


@pytest.mark.parametrize("name", NAMES)
def test_a_batch_is_answered_as_state_by_state_and_pairings_hold_integers(name: str) -> None:
    case = states(smooth_surface_cases, 5)[4]
    formulation, interface = factory(name)(penalty=1.0), case.interface
    pairing = formulation.pair(interface, case.z)
    assert isinstance(pairing, Pairing)
    pairing.check_bounds(interface)
    batch = np.stack([case.z, case.z + 2.0**-20])
    together = formulation.residual(interface, pairing, batch)
    alone = formulation.residual(interface, pairing, batch[1])
    assert together[1] == pytest.approx(alone, abs=1e-14 * np.abs(alone).max())  # A batch may add in another order.


@pytest.mark.parametrize("name", NAMES)
def test_contact_points_lie_where_their_shape_functions_say(name: str) -> None:
    for case in states(smooth_surface_cases, 10):
        formulation, interface = factory(name)(penalty=2.0), case.interface
        pairing = formulation.pair(interface, case.z)
        points = formulation.contact_points(interface, pairing, case.z)
        corners = case.positions[interface.slave.faces[points.slave_segment]]
        place = (points.slave_shape[:, :, None] * corners).sum(axis=1)
        assert place == pytest.approx(points.position, abs=1e-9 * case.diameter)
        assert np.linalg.norm(points.normal, axis=1) == pytest.approx(np.ones(len(points.gap)))
        if points.weighted.any():
            continue
        foot = case.positions[interface.master.faces[points.master_segment]]
        foot = (points.master_shape[:, :, None] * foot).sum(axis=1)
        gaps = ((place - foot) * points.normal).sum(axis=1)
        rounding = 1e-12 * case.largest_coordinate
        assert gaps == pytest.approx(points.gap, abs=rounding)
        assert np.array_equal(points.active, points.gap < 0)
        total = np.abs(formulation.residual(interface, pairing, case.z).reshape(-1, 3)[: interface.n_slave_nodes]).sum()
        assert (points.pressure * points.weight).sum() <= 2 * total + 1e-12


def test_no_contact_is_no_force() -> None:
    case = named_case("crossed-diagonals")
    apart = case.z + np.where(np.arange(case.z.size) < 12, 0.25, 0.0)
    for name in NAMES:
        formulation = factory(name)(penalty=1.0)
        pairing = formulation.pair(case.interface, apart)
        assert not formulation.residual(case.interface, pairing, apart).any()
        assert not formulation.tangent(case.interface, pairing, apart).count_nonzero()
        beside = case.z + np.where(np.arange(case.z.size) < 12, 9.0, 0.0)
        pairing = formulation.pair(case.interface, beside)
        assert not formulation.residual(case.interface, pairing, beside).any()
        assert len(formulation.contact_points(case.interface, pairing, beside).gap) == 0


@pytest.mark.parametrize("name", ON_QUADRILATERALS)
def test_parallelograms_transmit_a_uniform_pressure(name: str) -> None:
    """Bilinear shape functions are polynomials of the place on a parallelogram."""
    slave = np.array([[0.0, 0, -0.25], [1, 0.25, -0.25], [1.5, 1.25, -0.25], [0.5, 1, -0.25]])
    middle = np.array([[0.5, 0.125], [1.25, 0.75], [1, 1.125], [0.25, 0.5], [0.75, 0.625]])
    master = np.column_stack([np.vstack([slave[:, :2], middle]), np.zeros(9)])
    faces = [[0, 4, 8, 7], [4, 1, 5, 8], [8, 5, 2, 6], [7, 8, 6, 3]]
    interface = Interface.from_faces(slave, [[3, 2, 1, 0]], master, faces)
    weights = uniform_surface_weights(interface, interface.nodes[:, :2], slave[:, :2])
    formulation = factory(name)(penalty=4.0)
    z = interface.nodes.reshape(-1)
    forces = -formulation.residual(interface, formulation.pair(interface, z), z).reshape(-1, 3)
    sides = np.where(np.arange(13) < 4, 1.0, -1.0)
    assert forces == pytest.approx(np.column_stack([np.zeros((13, 2)), sides * weights]), abs=1e-14)


@pytest.mark.parametrize(("n_points", "degree"), [(3, 2), (6, 4)])
def test_the_gauss_rules_have_their_degree(n_points: int, degree: int) -> None:
    places, weights = GAUSS[n_points]
    for i in range(degree + 1):
        for j in range(degree + 1 - i):
            exact = 2 * factorial(i) * factorial(j) / factorial(i + j + 2)
            assert (weights * places[:, 1] ** i * places[:, 2] ** j).sum() == pytest.approx(exact, rel=1e-12)


def test_shape_functions_of_quadrilaterals_are_those_of_the_bilinear_map() -> None:
    corners = np.array([[0.0, 0], [3, 1], [4, 4], [1, 3.5]])
    s, t = 0.25, 0.875
    shape = np.array([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t])
    assert evaluate_shapes(corners, shape[None] @ corners) == pytest.approx(shape[None], abs=1e-14)
