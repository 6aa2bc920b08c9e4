"""The states of the hard cases are what they say: flat and touching in rationals, bounded by what is exact."""

from fractions import Fraction
from math import hypot

import numpy as np
import pytest
from exact_projection import project_point
from subjects import load_property, load_subject

from contactverif.contract.case import Case
from contactverif.problems.flat_states import (
    STEEP,
    TURNED,
    UPRIGHT,
    deep_states,
    node_hit_states,
    offset_states,
    read_frame,
    search_states,
    tiny_segment_states,
    touching_states,
)
from contactverif.problems.hard_corner_states import concave_corner_states, convex_kink_states
from contactverif_properties.applicability import knows_total

TURNS = (UPRIGHT, TURNED, STEEP)
FLAT_STATES = [*offset_states(), *deep_states(), *node_hit_states(), *search_states(), *tiny_segment_states()]


def turn_of(case: Case) -> tuple[int, int, int]:
    """Return the triple by which a flat state is turned."""
    return next(turn for turn in TURNS if np.allclose(case.parameters["direction"], np.array(turn[:2]) / turn[2]))


@pytest.mark.parametrize("case", FLAT_STATES, ids=lambda case: case.name)
def test_a_flat_state_is_flat_to_the_last_bit(case: Case) -> None:
    n_slave = case.interface.n_slave_nodes
    loaded = np.flatnonzero(case.parameters["weights"][n_slave:]) + n_slave
    _, heights = read_frame(case.positions, turn_of(case), case.positions[loaded[0]])
    assert len(set(heights[:n_slave])) == 1
    assert {heights[node] for node in loaded} == {0}
    assert -heights[0] == Fraction(case.parameter("penetration"))


@pytest.mark.parametrize("case", FLAT_STATES, ids=lambda case: case.name)
def test_each_point_of_the_slave_is_nearest_to_the_flat_part(case: Case) -> None:
    loaded = set(np.flatnonzero(case.parameters["weights"]).tolist())
    for segment in range(len(case.interface.slave)):
        for c in (-1.0, -0.5, 0.0, 0.5, 1.0):
            projection = project_point(case.interface, case.z, segment, c)
            assert set(case.interface.master.segments[projection.segment].tolist()) <= loaded
            assert -projection.signed_squared_gap == Fraction(case.parameter("penetration")) ** 2


@pytest.mark.parametrize("case", FLAT_STATES, ids=lambda case: case.name)
def test_the_exact_forces_of_a_flat_state_balance(case: Case) -> None:
    forces = load_property("hard.offset").exact(case)
    size = np.abs(forces).sum()
    assert np.abs(forces.sum(axis=0)).max() <= 1e-15 * size
    arms = case.positions - case.positions[0]
    moment = float((arms[:, 0] * forces[:, 1] - arms[:, 1] * forces[:, 0]).sum())
    assert abs(moment) <= 1e-14 * size * case.diameter


def test_near_1e8_the_stored_gap_is_one_step_of_the_doubles() -> None:
    (case,) = (case for case in offset_states() if case.name == "1e8, gap of one step")
    assert case.parameter("penetration") == float(np.spacing(1e8))


def test_surfaces_touch_exactly_at_1000_angles() -> None:
    angles = set()
    for case in touching_states():
        if case.parameter("shift") != 0:
            continue
        for segment in range(len(case.interface.slave)):
            assert project_point(case.interface, case.z, segment, -1.0).signed_squared_gap == 0
            assert project_point(case.interface, case.z, segment, 0.5).signed_squared_gap == 0
        angles |= {tuple(direction) for direction in case.parameters["directions"].tolist()}
    assert len(angles) == 1000


def test_no_surface_in_touch_is_above_or_below_another_pair() -> None:
    """Along a slave segment the masters of other pairs lie before its first node or past its second one."""
    for case in touching_states():
        x = case.positions
        for first, second in case.interface.slave.segments:
            along = x[second] - x[first]
            direction = case.parameters["directions"][first]
            for segment in case.interface.master.segments:
                places = (x[segment] - x[first]) @ along / (along @ along)
                own = (case.parameters["directions"][segment[0]] == direction).all()
                assert own or places.max() < 0 or places.min() > 1


@pytest.mark.parametrize("shift", [1e-16, -1e-16])
def test_stored_gaps_of_1e_16_have_either_sign_or_none(shift: float) -> None:
    signs = {
        project_point(case.interface, case.z, 0, -1.0).gap_sign
        for case in touching_states()
        if case.parameter("shift") == shift
    }
    assert signs >= {int(np.sign(shift))}


@pytest.mark.parametrize("case", [*convex_kink_states(), *concave_corner_states()], ids=lambda case: case.name)
def test_the_nearest_segments_give_a_total_within_the_bounds(case: Case) -> None:
    """The midpoints of 64 parts of each segment, in rationals, along the normals of the nearest segments."""
    total = np.zeros(2)
    parts = 64
    for segment, length in enumerate(case.interface.slave.lengths(case.positions)):
        for part in range(parts):
            projection = project_point(case.interface, case.z, segment, -1 + (2 * part + 1) / parts)
            assert projection.gap_sign < 0
            first, second = case.positions[case.interface.master.segments[projection.segment]]
            along = (second - first) / hypot(*(second - first))
            gap = float(-projection.signed_squared_gap) ** 0.5
            total += length / parts * gap * np.array([along[1], -along[0]])
    low, high = case.parameters["segment_bounds"]
    assert low * (1 - 1e-12) <= total @ case.parameters["axis"] <= high * (1 + 1e-12)
    wide_low, wide_high = case.parameters["bounds"]
    assert wide_low <= low * (1 + 1e-12)
    assert high <= wide_high * (1 + 1e-12)


def test_a_total_is_known_of_distributed_springs_alone() -> None:
    known = {name: knows_total(load_subject(name).traits) for name in ("nts", "nts-ar", "two-pass/nts-ar", "sts")}
    assert known == {"nts": False, "nts-ar": True, "two-pass/nts-ar": False, "sts": True}
