"""The exact view of the master from points, and the nearest segments, against rationals by hand and a plain loop."""

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from exact_projection import project_point
from planned_cases import draw_cases

from contactverif.contract.interface import Interface, Surface
from contactverif.oracle.exact_points import (
    Coverage,
    ExactPoints,
    Lattice,
    View,
    closest_excess,
    closest_view,
    lies_in_shadow,
    positions,
    run_against,
    seen_excess,
    slave_normal_view,
)
from contactverif.oracle.nearest import nearest_segments
from contactverif.strategies import general_cases

U = 2.0**-53
FAR = 2.0**40


def on_slope(shift: float = 0.0) -> Lattice:
    """One level slave segment of length 4 under a master of slope 3/4 and length 5."""
    interface = Interface.from_chains(np.array([[0.0, 0], [4, 0]]), np.array([[4.0, 3], [0, 0]]))
    return Lattice.from_state(interface, (interface.nodes + shift).reshape(-1))


def point_at(lattice: Lattice, c: float) -> ExactPoints:
    return ExactPoints.at(lattice, np.array([0]), np.array([c]))


@pytest.mark.parametrize("shift", [0.0, FAR])
@pytest.mark.parametrize(
    ("look", "gap", "xi", "normal", "cosine"),
    [
        (closest_view, -1.5, 0.6, [-0.6, 0.8], 1.0),
        (slave_normal_view, -1.875, 0.375, [0.0, 1.0], 0.8),  # Straight up to the slope, at the height of 15/8
    ],
)
def test_a_view_is_that_of_rationals(
    look: Callable[..., View], gap: float, xi: float, normal: list[float], cosine: float, shift: float
) -> None:
    lattice = on_slope(shift)
    point, segments = point_at(lattice, 0.25), np.array([0])  # The point (5/2, 0)
    view = look(lattice, point, segments)
    assert view.gap.floats().tolist() == [gap]
    assert view.xi.floats().tolist() == [xi]
    assert view.normal.floats().tolist() == [normal]
    assert view.gap.errors(np.array([gap + 2**-52])).tolist() == [2**-52]
    assert np.isnan(view.gap.errors(np.array([np.nan]))).all()
    assert view.cosine == pytest.approx([cosine], rel=1e-15)
    assert view.lengths == pytest.approx(4 + 5 + np.hypot(1.5, 3), rel=1e-15)
    assert run_against(lattice, point, segments).tolist() == [True]


def test_positions_are_formed_from_nodes_and_c() -> None:
    lattice = on_slope(1 / 3)
    rounded = np.array([[4 / 3 + 1 / 3, 1 / 3]])
    c = 2 * (4 / 3) / 4 - 1
    errors = positions(lattice, point_at(lattice, c)).errors(rounded)
    assert 0 < np.abs(errors).max() <= 4 * U


def test_the_nearest_segment_is_that_of_the_other_oracle_and_any_other_is_farther() -> None:
    for case in draw_cases(general_cases(), seed="exact", examples=40).cases:
        interface, lattice = case.interface, Lattice.from_state(case.interface, case.z)
        count = len(interface.slave)
        points = ExactPoints.at(lattice, np.arange(count), np.full(count, 0.3))
        nearest = [project_point(interface, case.z, number, 0.3) for number in range(count)]
        choice = np.array([projection.segment for projection in nearest])
        excess, ties = closest_excess(lattice, points, choice)
        assert excess.tolist() == [0.0] * count
        assert ties.tolist() == [len(projection.tied) for projection in nearest]
        other = (choice + 1) % len(interface.master)
        excess, _ = closest_excess(lattice, points, other)
        tied = np.array([number in projection.tied for number, projection in zip(other, nearest, strict=True)])
        assert np.array_equal(excess == 0, tied)
        gaps = closest_view(lattice, points, choice).gap.floats()
        squares = [float(projection.signed_squared_gap) for projection in nearest]
        assert gaps * np.abs(gaps) == pytest.approx(squares, rel=1e-14)


def behind() -> Lattice:
    """Make a level slave under a master segment at height 1, one behind it at height 3, and one that is turned away."""
    slave = [[0.0, 0], [2, 0]]
    nodes = [*slave, [3.0, 1], [-1, 1], [3, 3], [-1, 3], [-1, 2], [3, 2]]
    interface = Interface(np.array(nodes), Surface([[0, 1]]), Surface([[2, 3], [4, 5], [6, 7]]))
    return Lattice.from_state(interface, interface.nodes.reshape(-1))


@pytest.mark.parametrize(("choice", "excess"), [(0, 0.0), (1, 2.0), (2, np.inf)])
def test_of_segments_one_behind_the_other_the_slave_sees_the_first(choice: int, excess: float) -> None:
    lattice = behind()
    for cells in (True, False):
        distances = seen_excess(lattice, point_at(lattice, 0.5), np.array([0]), np.array([choice]), cells)
        assert distances.tolist() == [excess]
    assert not Coverage.along_slave_normals(lattice).clear.any()


@pytest.mark.parametrize(("shift", "share"), [(0.0, 1.0), (1.0, 0.75), (3.0, 0.25), (4.0, 0.0), (9.0, 0.0)])
def test_coverage_is_the_share_that_sees_the_master(shift: float, share: float) -> None:
    slave = np.array([[0.0, 0], [4, 0]]) + [shift, 0]
    interface = Interface.from_chains(slave, np.array([[4.0, 1], [1, 1], [0, 1]]))
    lattice = Lattice.from_state(interface, interface.nodes.reshape(-1))
    coverage = Coverage.along_slave_normals(lattice)
    assert coverage.share.floats().tolist() == [share]
    assert coverage.clear.all()
    assert not lies_in_shadow(lattice, interface)  # At best end stands over end.


def test_a_slave_between_the_ends_of_a_master_lies_in_its_shadow() -> None:
    interface = Interface.from_chains([[1.0, 0], [3, 0]], [[4.0, 1], [2, 1.25], [0, 1]])
    assert lies_in_shadow(Lattice.from_state(interface, interface.nodes.reshape(-1)), interface)


# --- nearest segments

SEGMENTS = np.array([[0, 1], [1, 2]])


def test_at_a_sharp_tip_the_smaller_overshoot_says_on_which_side_the_point_is() -> None:
    tip = np.array([[-4.0, -1.0], [0.0, 0.0], [-4.0, 1.0]])  # The body is between the two segments.
    nearest = nearest_segments(tip, SEGMENTS, (4.0, 2.0))
    assert [near.segment for near in nearest.segments] == [1, 0]
    upper, lower = nearest.segments
    assert upper.signed_squared_gap > 0 > lower.signed_squared_gap
    assert nearest.signed_squared_gap_at(lower) == nearest.signed_squared_gap_at(upper) == upper.signed_squared_gap
    assert nearest.n_undecided == 1


def test_a_foot_exactly_at_a_node_passes_by_nothing() -> None:
    corner = np.array([[3.0, 0.0], [0.0, 0.0], [0.0, -3.0]])
    nearest = nearest_segments(corner, SEGMENTS, (0.0, 2.0))
    assert [(near.segment, near.xi, near.squared_overshoot) for near in nearest.segments] == [
        (0, 1, 0),
        (1, Fraction(-2, 3), 4),
    ]
    assert {near.foot for near in nearest.segments} == {("node", 1)}
    assert nearest.signed_squared_gap_at(nearest.segments[1]) == 4


def test_two_places_at_one_distance_have_gaps_of_their_own() -> None:
    sheets = np.array([[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]])  # Both bodies are below their segment.
    nearest = nearest_segments(sheets, np.array([[0, 1], [2, 3]]), (0.5, 0.0))
    assert [(near.segment, nearest.signed_squared_gap_at(near)) for near in nearest.segments] == [(0, -1), (1, 1)]
    assert nearest.n_undecided == 2
