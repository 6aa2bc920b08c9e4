"""VTS-PPT on faces: exact forces, the method in the plane on strips, the other normal on flats, and the search."""

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from planned_cases import draw_cases

from contactverif import Case, Interface, load_formulation, named_case
from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.strategies.surfaces import (
    flat_surface_cases,
    sliding_surface_cases,
    smooth_surface_cases,
    surface_cases,
)

PRINTED, BALANCED = "vts-ppt-3d", "vts-ppt-balanced-3d"
BOTH = ((3,), (4,), (3, 4))


@cache
def states(strategy: Any, faces: tuple[int, ...], count: int) -> tuple[Case, ...]:
    return draw_cases(strategy(None, faces), seed="face patches", examples=count).cases


def pushes(name: str, case: Case) -> Any:
    """Return the forces (n_nodes, 3) that push the nodes apart."""
    formulation = load_formulation(name).with_penalty(case.penalty).plugin
    return -formulation.residual(case.interface, formulation.pair(case.interface, case.z), case.z).reshape(-1, 3)


@pytest.mark.parametrize("case", ["tilted-faces", "tilted-halves"])
def test_the_forces_on_a_tilted_square_are_exact(case: str) -> None:
    """Eq. 6 holds for the four parts that lie in one triangle; the other four press with projected areas."""
    state, cosine = named_case(case), 1 / np.sqrt(1.078125)
    n_slave = state.interface.n_slave_nodes
    printed, balanced = pushes(PRINTED, state), pushes(BALANCED, state)
    slave = 5 / cosine
    master = (5 + slave) / 2 if case == "tilted-faces" else slave
    for forces, right in ((printed, master), (balanced, slave)):
        assert forces[:n_slave].sum(axis=0) == pytest.approx([0, 0, slave], abs=1e-14)
        assert forces[n_slave:].sum(axis=0) == pytest.approx([0, 0, -right], abs=1e-14)


def test_the_moment_of_an_overhang_is_exact() -> None:
    case = named_case("moved-diagonals")
    forces = pushes(BALANCED, case)
    assert forces.sum(axis=0) == pytest.approx(np.zeros(3), abs=1e-15)
    assert np.cross(case.positions, -forces).sum(axis=0) == pytest.approx([-1 / 288, 1 / 144, 0], abs=1e-16)


def test_on_a_flat_master_that_covers_all_the_slave_has_the_same_normal() -> None:
    for case in states(flat_surface_cases, (3,), 60):
        forces, other = pushes(PRINTED, case), pushes(f"{PRINTED}:normal=slave", case)
        rounding = UNIT_ROUNDOFF * case.largest_coordinate / case.parameter("penetration")
        assert np.abs(forces - other).max() <= 8 * rounding * np.abs(other).max()


def strips(count: int) -> Iterator[tuple[Interface, Any, Interface, Any]]:
    """Yield bent strips of quadrilaterals of one row, each with its section in the plane; the width is 1."""
    random = np.random.default_rng(3)
    for _ in range(count):
        x = [np.sort(random.uniform(a, b, n)) for a, b, n in ((0.2, 3.8, 5), (-1, 5, 7))]
        y = [random.normal(-0.15, 0.05, 5) + random.uniform(-0.1, 0.1) * x[0], random.normal(0, 0.05, 7)]
        chains = [np.column_stack([x[0], y[0]]), np.column_stack([x[1], y[1]])[::-1]]
        sides = []
        for chain in chains:
            n = len(chain)
            points = np.vstack([np.column_stack([chain[:, 0], np.full(n, z), chain[:, 1]]) for z in (0.0, 1.0)])
            i = np.arange(n - 1)
            sides += [points, np.column_stack([i + n, i + n + 1, i + 1, i])]
        plane, space = Interface.from_chains(*chains), Interface.from_faces(*sides)
        yield space, space.nodes.reshape(-1), plane, plane.nodes.reshape(-1)


@pytest.mark.parametrize(
    "ends", [(PRINTED, "vts-ppt:free_end=truncate"), (BALANCED, "vts-ppt-balanced:free_end=truncate")]
)
def test_on_strips_the_forces_are_those_of_the_plane(ends: tuple[str, str]) -> None:
    """One strip differs: the plane goes on behind a segment that turns away."""
    same = []
    in_space, in_plane = (load_formulation(name).with_penalty(3.0).plugin for name in ends)
    for space, z, plane, x in strips(100):
        forces = in_space.residual(space, in_space.pair(space, z), z).reshape(-1, 3)
        right = in_plane.residual(plane, in_plane.pair(plane, x), x).reshape(-1, 2)
        n = plane.n_slave_nodes
        slave, master = (part.reshape(2, -1, 3).sum(axis=0) for part in (forces[: 2 * n], forces[2 * n :]))
        assert np.abs(forces[:, 1]).max() <= 1e-15
        difference = np.abs(np.vstack([slave, master])[:, [0, 2]] - right).max()
        same.append(difference / np.abs(right).max() if right.any() else difference)
    print(f"\nthe largest difference but one is {np.sort(same)[-2]:.2g}")
    assert np.count_nonzero(np.array(same) > 3e-15) <= 1


def distance_to(point: Any, face: Any) -> float:
    """Return the distance of a point from the triangles of a face, by their shares that are ≥ 0 and add up to 1."""
    corners = (
        [face]
        if len(face) == 3
        else [[*pair, face.mean(axis=0)] for pair in zip(face, np.roll(face, -1, 0), strict=True)]
    )
    distances = []
    for triangle in np.array(corners):
        for used in ([0, 1, 2], [0, 1], [1, 2], [2, 0], [0], [1], [2]):
            first, *others = triangle[used]
            edges = np.array(others).reshape(-1, 3) - first
            shares = np.linalg.lstsq(edges.T, point - first, rcond=None)[0] if others else np.zeros(0)
            if (shares >= 0).all() and shares.sum() <= 1:
                distances.append(np.linalg.norm(first + shares @ edges - point))
    return float(min(distances))


@pytest.mark.parametrize("faces", BOTH)
def test_the_partner_is_the_nearest_face_of_all(faces: tuple[int, ...]) -> None:
    for case in states(surface_cases, faces, 12):
        formulation, interface = load_formulation(PRINTED).with_penalty(1.0).plugin, case.interface
        points = formulation.contact_points(interface, formulation.pair(interface, case.z), case.z)
        for place, face in zip(points.position[::5], points.master_segment[::5], strict=True):
            distances = [distance_to(place, case.positions[nodes]) for nodes in interface.master.faces]
            assert distances[face] <= min(distances) + 1e-14 * case.largest_coordinate


@pytest.mark.parametrize(
    ("name", "faces"),
    [*((name, faces) for name in (PRINTED, BALANCED) for faces in BOTH), (f"{PRINTED}:normal=slave", (3,))],
)
def test_tangents_are_derivatives_on_all_kinds_of_faces(name: str, faces: tuple[int, ...]) -> None:
    random = np.random.default_rng(1)
    for case in states(smooth_surface_cases, faces, 15):
        formulation, interface = load_formulation(name).with_penalty(1.0).plugin, case.interface
        pairing, direction = formulation.pair(interface, case.z), random.normal(size=case.z.size)
        step = formulation.residual(interface, pairing, case.z + 2.0**-200 * 1j * direction).imag * 2.0**200
        forces, tangent = formulation.residual_and_tangent(interface, pairing, case.z)
        assert np.linalg.norm(tangent @ direction - step) <= 1e-12 * np.linalg.norm(step)
        assert np.array_equal(forces, formulation.residual(interface, pairing, case.z))


def test_a_repetition_has_the_same_bits_whatever_came_before() -> None:
    formulation = load_formulation(BALANCED).with_penalty(1.0).plugin
    first, *others = states(surface_cases, (3, 4), 8)
    pairing = formulation.pair(first.interface, first.z)
    for case in others:
        formulation.pair(case.interface, case.z)
    assert formulation.pair(first.interface, first.z) == pairing


@pytest.mark.parametrize("faces", BOTH)
def test_the_balanced_force_is_that_of_the_slave_and_does_not_pull(faces: tuple[int, ...]) -> None:
    """On a flat master that covers the slave the moment is conserved, too."""
    for case in states(sliding_surface_cases, faces, 20):
        forces = pushes(BALANCED, case)
        rounding = 64 * UNIT_ROUNDOFF * case.largest_coordinate / case.shortest_segment
        assert np.abs(forces.sum(axis=0)).max() <= 1e-14 * np.abs(forces).sum()
        if faces == (3,):
            moment = np.cross(case.positions - case.positions.mean(axis=0), forces).sum(axis=0)
            assert np.abs(moment).max() <= rounding * np.abs(forces).sum() * case.diameter
