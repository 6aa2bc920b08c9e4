"""Random interfaces in space are what they say: a covered slave, exact places, contact, and two squares at the end."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, find, settings
from planned_cases import draw_cases

from contactverif import Case
from contactverif.contract.interface import turns_of
from contactverif.oracle.flat_answers import nodal_surface_weights, uniform_surface_weights_exact
from contactverif.strategies.straight import steep_plane_cases, tilted_plane_cases
from contactverif.strategies.surfaces import (
    flat_surface_cases,
    matched_surface_cases,
    overhung_surface_cases,
    smooth_surface_cases,
    surface_cases,
)


def collect(strategy: Callable[[], Any], count: int) -> tuple[Case, ...]:
    return draw_cases(strategy(), seed="surfaces", examples=count).cases


@pytest.mark.parametrize("strategy", [flat_surface_cases, surface_cases, smooth_surface_cases])
def test_the_first_case_is_a_square_on_a_square(strategy: Callable[[], Any]) -> None:
    first = collect(strategy, 1)[0]
    assert (len(first.interface.slave), len(first.interface.master)) == (2, 2)
    assert first.interface.dim == 3


def test_it_shrinks_to_few_faces() -> None:
    fast = settings(max_examples=200, derandomize=True, database=None, phases=[Phase.generate, Phase.shrink])
    case = find(flat_surface_cases(), lambda case: len(case.interface.master) >= 4, settings=fast)  # type: ignore[arg-type]
    assert len(case.interface.slave) + len(case.interface.master) <= 6
    assert case.parameter("penetration") <= 0.25
    assert (case.penalty, case.seed) == (1, 0)


def test_a_flat_master_covers_its_slave_and_faces_it() -> None:
    larger = []
    for case in collect(flat_surface_cases, 100):
        interface, n_slave = case.interface, case.interface.n_slave_nodes
        assert (turns_of(interface.nodes[interface.slave.faces])[..., 2] < 0).all()
        assert (turns_of(interface.nodes[interface.master.faces])[..., 2] > 0).all()
        weights = uniform_surface_weights_exact(interface, case.parameters["plane"], case.parameters["domain"])
        assert sum(weights[:n_slave]) == sum(weights[n_slave:])
        heights = case.positions @ case.parameters["normal"]
        gap = heights[:n_slave].mean() - heights[n_slave:].mean()
        assert gap == pytest.approx(-case.parameter("penetration"), rel=1e-6)
        larger.append(np.ptp(interface.nodes[n_slave:, 0]) > 1.5 * np.ptp(interface.nodes[:n_slave, 0]))
    assert 0.2 < np.mean(larger) < 0.8


@pytest.mark.parametrize("strategy", [surface_cases, smooth_surface_cases])
def test_nearly_all_states_are_in_contact(strategy: Callable[[], Any]) -> None:
    """The slave turns about the middle of its square, which lies below the master."""
    from contactverif_surfaces import sts_3d

    forces = []
    for case in collect(strategy, 60):
        springs = sts_3d(penalty=1.0)
        forces.append(np.abs(springs.residual(case.interface, springs.pair(case.interface, case.z), case.z)).sum())
    assert np.mean(np.array(forces) > 0) >= 0.95


@pytest.mark.parametrize("strategy", [tilted_plane_cases, steep_plane_cases])
def test_a_tilted_plane_stays_a_plane_below_the_master_bit_by_bit(strategy: Callable[[], Any]) -> None:
    for case in collect(strategy, 60):
        interface, places = case.interface, [tuple(map(Fraction, place)) for place in case.positions.tolist()]
        for surface in (interface.slave, interface.master):
            a, b, c = (places[node] for node in surface.faces[0].tolist())
            first, second = (tuple(x - y for x, y in zip(end, a, strict=True)) for end in (b, c))
            normal = [first[i - 2] * second[i - 1] - first[i - 1] * second[i - 2] for i in range(3)]
            heights = [sum(n * (x - y) for n, x, y in zip(normal, place, a, strict=True)) for place in places]
            assert not any(heights[node] for node in surface.nodes)
            others = set(range(interface.n_nodes)) - set(surface.nodes.tolist())
            if surface is interface.master:  # The normal is out of the master: the slave lies below.
                assert all(heights[node] < 0 for node in others)


def test_there_are_no_flat_cases_on_an_interface_of_the_user() -> None:
    case = collect(flat_surface_cases, 1)[0]
    assert flat_surface_cases(case.interface) is None
    assert surface_cases(case.interface) is not None


def test_matched_faces_are_equal_or_lie_beside_the_slave() -> None:
    rings = set()
    for case in collect(matched_surface_cases, 30):
        plane, interface, n_slave = case.parameters["plane"], case.interface, case.interface.n_slave_nodes
        place = {tuple(point): number for number, point in enumerate(plane[:n_slave].tolist())}
        over = [[place.get(tuple(plane[node].tolist()), -1) for node in face] for face in interface.master.faces]
        inner = {frozenset(face) for face in over if min(face) >= 0}
        assert inner == {frozenset(face) for face in interface.slave.faces.tolist()}
        rings.add(len(inner) < len(over))
    assert rings == {False, True}


def test_an_overhung_slave_would_be_covered_if_it_were_larger() -> None:
    for case in collect(overhung_surface_cases, 30):
        n_slave, plane = case.interface.n_slave_nodes, case.parameters["plane"].copy()
        middle = case.parameters["domain"].mean(axis=0)
        plane[:n_slave] = middle + 1.25 * (plane[:n_slave] - middle)
        assert (nodal_surface_weights(case.interface, plane)[:n_slave] == 1).all()
