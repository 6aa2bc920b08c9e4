"""The exact answers against the paper's tables, ties by hand, and the promise of the distance to a kink."""

import itertools
from collections import Counter
from fractions import Fraction

import numpy as np
import pytest
from exact_projection import project_point, projection_cases
from hypothesis import given, settings
from hypothesis import strategies as st

from contactverif import Case, Interface, Surface, named_case
from contactverif.contract.arrays import FloatArray
from contactverif.oracle.flat_answers import uniform_pressure_weights, uniform_pressure_weights_exact
from contactverif.oracle.kink_distance import default_points, kink_margin
from contactverif.strategies import flat_cases, general_cases, smooth_cases
from contactverif.strategies.solids import dead_zone_cases

CHECKED = settings(max_examples=100, derandomize=True, database=None, deadline=None)


def chains(slave: list[tuple[float, float]], master: list[tuple[float, float]]) -> tuple[Interface, FloatArray]:
    """Return an interface whose state is its reference, and that state."""
    interface = Interface.from_chains(slave, master)
    return interface, interface.nodes.reshape(-1)


@pytest.mark.parametrize(
    ("name", "table"),
    [
        ("a1", "1 2 1 / 2 2"),
        ("a2", "1/2 1 3/2 3 2 / 4 4"),
        ("b", "1 2 3 4 2 / 3/2 3 7/2 3 1"),
        ("c", "1 2 3 4 2 / 3/2 3 3 3 3/2"),
    ],
)
def test_forces_of_the_paper(name: str, table: str) -> None:
    case = named_case(name)
    slave, master = (list(map(Fraction, side.split())) for side in table.split("/ "))
    weights = uniform_pressure_weights_exact(case.interface, case.parameters["along"])
    assert weights == slave + master[::-1]  # master nodes run from right to left


@pytest.mark.parametrize(
    ("slave", "master", "weights"),
    [
        ((1, 2), (4, 0), "1/2 1/2 3/8 5/8"),
        ((0, 4), (2, 1), "5/8 3/8 1/2 1/2"),
        ((0, 4), (8, 3), "1/8 7/8 1/10 9/10"),
        ((0, 4), (8, 5), "0 0 0 0"),
    ],
)
def test_what_overhangs_is_loaded_where_it_is_covered(
    slave: tuple[float, float], master: tuple[float, float], weights: str
) -> None:
    interface, _ = chains([(x, 0) for x in slave], [(x, 0) for x in master])
    assert uniform_pressure_weights_exact(interface, interface.nodes[:, 0]) == [*map(Fraction, weights.split())]


@CHECKED
@given(st.one_of(flat_cases(), dead_zone_cases()))  # type: ignore[arg-type]
def test_the_weights_are_the_integrals_of_the_shapes_over_what_both_surfaces_cover(case: Case) -> None:
    """Between two neighbouring nodes of both surfaces all is linear, so the middle is the mean; roles do not matter."""
    interface, places = case.interface, [Fraction(place) for place in case.parameters["along"].tolist()]
    expected = [Fraction(0)] * len(places)
    breaks = sorted(set(places))
    for low, high in itertools.pairwise(breaks):
        middle = (low + high) / 2
        values: list[dict[int, Fraction]] = [{}, {}]
        for values_here, surface in zip(values, (interface.slave, interface.master), strict=True):
            for a, b in surface.segments.tolist():
                if min(places[a], places[b]) < middle < max(places[a], places[b]):
                    share = (middle - places[a]) / (places[b] - places[a])
                    values_here |= {a: 1 - share, b: share}
        if all(values):
            for node, value in {**values[0], **values[1]}.items():
                expected[node] += (high - low) * value
    assert uniform_pressure_weights_exact(interface, case.parameters["along"]) == expected
    n_slave = interface.n_slave_nodes
    swapped = uniform_pressure_weights_exact(interface.swap_roles(), np.roll(case.parameters["along"], -n_slave))
    assert swapped == expected[n_slave:] + expected[:n_slave]


def test_several_chains_load_what_each_covers() -> None:
    nodes = np.array([0, 1, 3, 4, 4, 2, 0])
    interface = Interface(
        np.column_stack([nodes, np.zeros(7)]), Surface(np.array([[2, 3], [0, 1]])), Surface(np.array([[4, 5], [5, 6]]))
    )
    weights = uniform_pressure_weights(interface, nodes.astype(float))
    assert weights.tolist() == [0.5, 0.5, 0.5, 0.5, 0.75, 0.5, 0.75]


ROOF = [(4.0, -2.0), (0.0, 0.0), (-4.0, -2.0)]  # convex: the cone of its vertex is above
VALLEY = [(4.0, 2.0), (0.0, 0.0), (-4.0, 2.0)]


@pytest.mark.parametrize(("line", "height"), [(ROOF, 1.0), (ROOF, -1.0), (VALLEY, 1.0), (VALLEY, -1.0)])
def test_a_point_on_the_bisector_is_a_tie(line: list[tuple[float, float]], height: float) -> None:
    interface, z = chains([(-1, height), (1, height)], line)
    projection = project_point(interface, z, 0, 0.0)
    assert (projection.segment, projection.tied, projection.undecided) == (0, (0, 1), (0, 1))
    assert kink_margin(interface, z, [0], [0.0]) == 0
    assert project_point(interface, z, 0, 2.0**-40).undecided == (0,)
    assert project_point(interface, z, 0, -(2.0**-40)).undecided == (1,)


def test_in_the_cone_of_a_re_entrant_vertex_the_overshoot_decides() -> None:
    interface, z = chains([(-1, -1), (1, -1)], VALLEY)
    projection = project_point(interface, z, 0, 0.25)
    assert projection.tied == (0, 1)
    assert (projection.segment, projection.undecided) == (0, (0,))
    assert projection.gap_sign == -1
    assert projection.squared_distance == Fraction(17, 16)


def test_a_foot_is_not_clipped_and_a_gap_is_exact() -> None:
    interface, z = chains([(5, 0.125), (6, 0.125)], [(4, 0), (0, 0)])
    projection = project_point(interface, z, 0, -1)
    assert projection.xi == Fraction(-1, 4)
    assert (projection.gap_sign, projection.signed_squared_gap) == (1, Fraction(1, 64))
    assert projection.squared_distance == 1 + Fraction(1, 64)


def test_the_tilted_case_covers_two_segments_twice() -> None:
    case = named_case("tilted")
    assert projection_cases(case.interface, case.z) == Counter({"first": 2, "last": 2})


def test_projection_cases_by_hand() -> None:
    interface, z = chains([(-1, -0.125), (3, -0.125)], [(2, 0), (2, 1), (1, 0), (0, 0)])
    # The quarter point at x = 0 hits a node, its area ends past the free end and at the node x = 1; the one at x = 2
    # has the wall's foot.
    occurrences = projection_cases(interface, z)
    assert occurrences["node exactly hit"] >= 2
    assert occurrences["beyond an end"] >= 1


def decisions(case: Case, z: FloatArray) -> list[object]:
    """Return exact decisions: nearest segments, signs of gaps, roles of the covered segments."""
    segments, places, _, _ = default_points(case.interface)
    choices: list[object] = []
    for segment, c in zip(segments.tolist(), places.tolist(), strict=True):
        answer = project_point(case.interface, z, segment, c)
        choices.append((answer.segment, answer.gap_sign))
    roles = projection_cases(case.interface, z)
    return [*choices, *(roles[role] for role in ("one segment", "first", "intermediate", "edge-on", "beyond an end"))]


@CHECKED
@given(st.one_of(smooth_cases(), general_cases()), st.floats(0.5, 0.99))
def test_nothing_is_decided_otherwise_within_the_margin(case: Case, share: float) -> None:
    margin = kink_margin(case.interface, case.z, *default_points(case.interface))
    if margin <= 2.0**-40 * case.largest_coordinate:
        return  # at a kink up to roundoff: no promise
    before = decisions(case, case.z)
    rng = np.random.default_rng(case.seed)
    for _ in range(3):
        moves = rng.standard_normal(case.interface.nodes.shape)
        moves *= share * margin / np.linalg.norm(moves, axis=1, keepdims=True)
        assert decisions(case, case.z + moves.reshape(-1)) == before


def test_a_margin_is_of_the_size_of_the_distance_and_no_point_has_none_of_its_own() -> None:
    interface, z = chains([(1, -0.5), (3, -0.5)], [(8, 0), (0, 0)])
    assert 0.5 / 4 < kink_margin(interface, z, [0], [0.0]) < 0.5
    assert kink_margin(interface, z, [-1, 0], [0.0, np.nan]) == 1.0  # ℓ/8 of the master


def test_many_points_are_taken_in_parts() -> None:
    x = np.arange(601.0)
    interface, z = chains([*np.column_stack([x, 0 * x - 0.25])], [*np.column_stack([x[::-1], 0 * x])])
    segments, places, _, _ = default_points(interface)
    moved = z + 0.1
    assert kink_margin(interface, moved, segments, places) == min(
        kink_margin(interface, moved, segments[part::5], places[part::5]) for part in range(5)
    )
