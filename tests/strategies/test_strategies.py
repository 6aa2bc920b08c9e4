"""Random cases are valid, simple when shrunk, exact on their lattice, and reach every case of projection."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from exact_projection import projection_cases
from hypothesis import find, settings
from hypothesis.strategies import SearchStrategy
from planned_cases import draw_cases

from contactverif import Case, Interface, MisuseError
from contactverif.contract.arrays import UNIT_ROUNDOFF
from contactverif.mechanics.scene import scene_of
from contactverif.oracle.flat_answers import chain_ends, is_of_class
from contactverif.oracle.kink_distance import default_points, kink_margin
from contactverif.problems.block_scenes import normal_scenes, single_scenes
from contactverif.problems.blocks import is_uniform
from contactverif.problems.catalogue import load_scene_case
from contactverif.problems.flat_states import overhangs
from contactverif.problems.named_states import FLAT_NAMES, NAMED, named_case
from contactverif.strategies import (
    flat_cases,
    general_cases,
    normal_cases,
    overhung_cases,
    single_cases,
    smooth_cases,
    tie_cases,
)
from contactverif.strategies.general import Ring, closed_cases
from contactverif.strategies.solids import block_cases, dead_zone_cases, variant_cases

FIXED = settings(derandomize=True, database=None, deadline=None)


def collect_cases(strategy: SearchStrategy[Case] | None, count: int) -> list[Case]:
    """Return many cases, always the same, whatever modules are loaded: drawn as a run draws them."""
    assert strategy is not None
    return list(draw_cases(strategy, seed="strategies", examples=count).cases)


@pytest.fixture(scope="module")
def flat() -> list[Case]:
    return collect_cases(flat_cases(), 400)


@pytest.mark.parametrize("strategy", [flat_cases, general_cases, smooth_cases, tie_cases])
def test_the_simplest_case_is_one_unit_segment_a_side(strategy: Callable[[], SearchStrategy[Case]]) -> None:
    case = find(strategy(), lambda _: True, settings=FIXED)
    assert case.interface.nodes.tolist() == [[0, 0], [1, 0], [1, 0], [0, 0]]
    assert np.abs(case.positions[:, 0] - [0, 1, 1, 0]).max() <= 1 / 16
    assert (case.penalty, case.seed, case.name) == (1.0, 0, "")


def test_a_needed_offset_shrinks_to_the_least_one() -> None:
    case = find(smooth_cases(), lambda _: True, settings=FIXED)
    assert case.positions[0].tolist() == [1 / 7 / 16, -0.25 - 1 / 11 / 16]


def test_slave_points_of_flat_cases_project_inside_the_master(flat: list[Case]) -> None:
    for case in flat:
        along, interface = case.parameters["along"], case.interface
        stretches = [sorted(along[list(ends)]) for ends in chain_ends(interface.master)]
        for low, high in along[interface.slave.segments]:
            assert any(first <= low <= high <= last for first, last in stretches)


def test_flat_cases_are_what_their_parameters_say(flat: list[Case]) -> None:
    for case in flat:
        direction = case.parameters["direction"]
        normal = np.array([-direction[1], direction[0]])
        places, count = case.positions - case.positions[0], case.interface.n_slave_nodes
        roundoff = 16 * UNIT_ROUNDOFF * case.largest_coordinate
        along = case.parameters["along"] - case.parameters["along"][0]
        assert np.abs(places @ direction - along).max() <= roundoff
        heights = np.concatenate([np.zeros(count), np.full(len(places) - count, case.parameter("penetration"))])
        assert np.abs(places @ normal - heights).max() <= roundoff


def test_penetrations_are_usual(flat: list[Case]) -> None:
    shares = np.array([case.parameter("penetration") / case.shortest_segment for case in flat])
    slack = 1e-6
    assert 2.0**-10 * (1 - slack) <= shares.min() <= 2.0**-8
    assert 1 <= shares.max() <= 2 * (1 + slack)


def test_lattice_coordinates_are_exact(flat: list[Case]) -> None:
    """At least a quarter has few binary digits between the largest and the smallest one; others moved by sevenths."""
    few = 0
    for case in flat:
        places = [Fraction(place) for place in case.parameters["along"].tolist()]
        finest = max(place.denominator for place in places)
        few += max(int(abs(place) * finest).bit_length() for place in places) <= 40
    assert few > len(flat) / 4


def test_ratios_of_neighbours_reach_2_to_the_20(flat: list[Case]) -> None:
    steepest, crowded = 0.0, 0
    for case in flat:
        for side in (case.interface.slave, case.interface.master):
            size = np.log2(side.lengths(case.interface.nodes))
            following = side.neighbours[:, 1]
            steepest = max(steepest, np.abs(size[following] - size)[following >= 0].max(initial=0.0))
        along = case.parameters["along"]
        middles = along[case.interface.master.segments].mean(axis=1)
        for low, high in along[case.interface.slave.segments]:
            crowded = max(crowded, int(((middles > low) & (middles < high)).sum()))
    assert steepest >= 20
    assert crowded >= 50


def test_typical_meshes_are_small(flat: list[Case]) -> None:
    cases = flat + collect_cases(general_cases(), 200)
    assert np.median([case.n_segments for case in cases]) <= 12


def test_every_case_of_projection_is_reached() -> None:
    total: Counter[str] = Counter()
    for case in collect_cases(general_cases(), 300) + collect_cases(tie_cases(), 150):
        total.update(projection_cases(case.interface, case.z))
    wanted = "one segment,first,intermediate,last,node exactly hit,beyond an end,convex vertex,concave vertex,edge-on"
    assert all(total[name] >= 5 for name in wanted.split(","))


def relative_margin(case: Case) -> float:
    return kink_margin(case.interface, case.z, *default_points(case.interface)) / case.shortest_segment


def test_smooth_cases_are_away_from_kinks_and_ties_are_at_them() -> None:
    margins = np.array([relative_margin(case) for case in collect_cases(smooth_cases(), 2000)])
    assert (margins > 1e-7).mean() >= 0.98
    assert (margins > 1e-5).mean() >= 0.95
    assert np.mean([relative_margin(case) < 1e-12 for case in collect_cases(tie_cases(), 300)]) >= 0.9


def test_shapes_and_states_of_all_kinds_occur() -> None:
    counts: Counter[str] = Counter()
    for case in collect_cases(general_cases(), 400):
        master, slave = case.interface.master, case.interface.slave
        counts["closed chain"] += bool((master.neighbours >= 0).all())
        counts["several chains"] += int((slave.neighbours[:, 0] < 0).sum()) > 1
        counts["moved"] += bool(np.abs(case.positions - case.interface.nodes).max() > 2 * case.shortest_segment)
        normals = np.diff(case.positions[master.segments], axis=1)[:, 0]
        counts["bent"] += bool(np.linalg.matrix_rank(normals, rtol=1e-6) > 1)
    assert all(counts[kind] >= 10 for kind in ("closed chain", "several chains", "moved", "bent"))


@pytest.fixture(scope="module")
def dead_zones() -> list[Case]:
    return collect_cases(dead_zone_cases(), 300)


def test_the_simplest_dead_zone_is_one_segment_a_side() -> None:
    case = collect_cases(dead_zone_cases(), 1)[0]
    assert case.parameters["along"].tolist() == [0, 1, 0.25, 1]
    assert [(body.young, body.poisson, len(body.cells)) for body in scene_of(case).bodies] == [(1, 0, 1), (1, 0, 1)]
    assert scene_of(case).bodies[0].axis.tolist() == [1, 0]
    assert case.penalty == 10


def test_in_a_dead_zone_the_master_ends_inside_a_slave_segment(dead_zones: list[Case]) -> None:
    counts: Counter[str] = Counter()
    for case in dead_zones:
        slave, master = np.split(case.parameters["along"], [case.interface.n_slave_nodes])
        left, right = master.min(), master.max()
        inner = [end for end, over in ((left, slave.min() < left), (right, right < slave.max())) if over]
        assert overhangs(case)
        assert is_uniform(case)
        assert slave.min() < right
        assert left < slave.max()
        assert not set(inner) & set(slave)
        counts["both"] += len(inner) == 2
        counts["in one segment"] += len(inner) == 2 and not ((slave > left) & (slave < right)).any()
        counts["the master overhangs on the other side"] += bool(left < slave.min() or slave.max() < right)
        counts["a whole slave segment touches nothing"] += bool((np.sort(slave)[1:-1] < left).any())
        counts["turned"] += scene_of(case).bodies[0].axis.tolist() != [1, 0]
    assert len(counts) == 5
    assert min(counts.values()) >= 20


def test_a_scene_is_asked_where_its_overhang_belongs() -> None:
    """The dead zone is nothing for who promises the patch test on an interface that is covered, nor the other way."""
    covered, overhanging, bent = map(load_scene_case, ("c", "dead-zone", "dead-zone:sides=free"))
    for strategy in (block_cases, variant_cases):
        assert strategy(overhanging) is None
        assert collect_cases(strategy(covered), 2)[0] is covered
    assert dead_zone_cases(covered) is None
    assert dead_zone_cases(bent) is None
    assert dead_zone_cases(named_case("c")) is None
    assert collect_cases(dead_zone_cases(overhanging), 2)[0] is overhanging


# Interfaces that somebody gives


def test_flat_cases_of_a_given_interface_have_the_penetration_they_say() -> None:
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    interface = named_case("c").interface.at(named_case("c").interface.nodes @ turn + [3.0, -7.0])
    for case in collect_cases(flat_cases(interface), 30):
        assert case.interface is interface
        direction, count = case.parameters["direction"], interface.n_slave_nodes
        heights = case.positions @ [-direction[1], direction[0]]
        roundoff = 64 * UNIT_ROUNDOFF * case.largest_coordinate
        assert np.abs(heights[:count] - heights[-1] + case.parameter("penetration")).max() <= roundoff
        assert 2.0**-10 <= case.parameter("penetration") / case.shortest_segment <= 0.5 * (1 + 1e-9)


@pytest.mark.parametrize(
    "interface",
    [
        named_case("tilted").interface,
        named_case("a1").interface.swap_roles().at([[0, 0], [4, 1], [4, 0], [2, 0], [0, 0]]),
        Interface.from_chains([(0, 0), (4, 0)], [(3, 0), (0, 0)]),
        Interface.from_chains([(0, 0), (4, 0)], [(0, 0), (4, 0)]),
        Interface.from_chains([(0, 0), (2, 0), (4, 0)], [(4, 0), (2, -1), (0, 0)]),
    ],
    ids=["tilted", "tilted master", "overhanging", "back to back", "bent"],
)
def test_what_is_not_flat_has_no_flat_cases(interface: Interface) -> None:
    assert flat_cases(interface) is None


@pytest.mark.parametrize("strategy", [general_cases, smooth_cases])
def test_states_of_a_given_interface_differ(strategy: Callable[[Interface], SearchStrategy[Case]]) -> None:
    ring = collect_cases(closed_cases(), 1)[0].interface
    for interface in (named_case("c").interface, named_case("tilted").interface, ring):
        cases = collect_cases(strategy(interface), 30)
        assert all(case.interface is interface for case in cases)
        assert len({case.z.tobytes() for case in cases}) > 10
        assert all((case.positions != interface.nodes).any() for case in cases)


# Named cases


@pytest.mark.parametrize("name", NAMED)
def test_named_cases_bear_their_name_and_flat_ones_have_unit_pressure(name: str) -> None:
    case = named_case(name)
    assert Case.from_arrays(case.to_arrays()).name == case.name == name
    assert name not in FLAT_NAMES or case.penalty * case.parameter("penetration") == 1


@pytest.mark.parametrize("name", ["tilted", "offset-c"])
def test_witnesses_are_off_kinks(name: str) -> None:
    assert relative_margin(named_case(name)) > 1e-3


def test_an_unknown_name_gets_near_ones() -> None:
    with pytest.raises(MisuseError, match="'c-prime'"):
        named_case("c prim")


@pytest.mark.parametrize("strategy", [flat_cases, general_cases, smooth_cases, tie_cases])
def test_no_segment_has_shrunk_to_a_point(strategy: Callable[[], SearchStrategy[Case]]) -> None:
    for case in collect_cases(strategy(), 1000):
        assert case.shortest_segment > 0


@pytest.mark.parametrize(("inner_slave", "quarters"), [(False, 4), (True, -4)])
def test_neither_a_hole_nor_a_disc_shrinks_to_a_point(inner_slave: bool, quarters: int) -> None:
    """Found by 20,000 examples: four radii of penetration, or of gap, took all nodes to the centre."""
    ring = Ring([1, 1, 1], [1, 1, 1], 180, inner_slave=inner_slave, quarters=[quarters], unit=1.0)
    assert np.ptp(ring([0]).slave, axis=0).min() > 1


KINDS = {normal_cases: False, single_cases: True, overhung_cases: True}


@pytest.mark.parametrize("strategy", KINDS)
def test_all_meshes_are_of_their_class_and_covered(strategy: Callable[[], Any]) -> None:
    for case in collect_cases(strategy(), 300):
        along, interface = case.parameters["along"], case.interface
        assert is_of_class(interface, along, midpoints=KINDS[strategy])
        for node in along[: interface.n_slave_nodes]:
            ends = np.sort(along[interface.master.segments], axis=1)
            assert ((ends[:, 0] <= node) & (node <= ends[:, 1])).any()


@pytest.mark.parametrize("strategy", KINDS)
def test_they_shrink_to_one_segment_on_one(strategy: Callable[[], Any]) -> None:
    case = find(strategy(), lambda _: True, settings=settings(FIXED, max_examples=2000))
    assert case.n_segments == 2
    assert set(np.ptp(case.positions, axis=0)) <= {0.25, 1.0, 2.0}


def test_both_kinds_of_places_are_drawn() -> None:
    cases = collect_cases(single_cases(), 100)
    middles = [not is_of_class(case.interface, case.parameters["along"], midpoints=False) for case in cases]
    assert 0.3 < np.mean(middles) < 0.95
    assert any(len(case.interface.master) > 5 for case in cases)


def test_no_node_of_overhung_meshes_faces_a_free_end() -> None:
    for case in collect_cases(overhung_cases(), 100):
        along, interface = case.parameters["along"], case.interface
        for here, there in ((interface.slave, interface.master), (interface.master, interface.slave)):
            ends = along[here.segments[here.neighbours < 0]]
            nodes = along[np.unique(there.segments)]
            assert np.abs(ends[:, None] - nodes).min() > 0


@pytest.mark.parametrize(
    ("strategy", "name", "fits"),
    [(normal_cases, "a2", True), (normal_cases, "b", False), (single_cases, "b", True), (single_cases, "c", False),
     (single_cases, "tilted", False)],
)  # fmt: skip
def test_states_of_a_given_interface_need_its_class(strategy: Callable[..., Any], name: str, fits: bool) -> None:
    assert (strategy(named_case(name).interface) is not None) is fits


@pytest.mark.parametrize(("make", "midpoints"), [(normal_scenes, False), (single_scenes, True)])
def test_scenes_are_of_their_class(make: Callable[[], tuple[Case, ...]], midpoints: bool) -> None:
    scenes = make()
    assert len({scene.name for scene in scenes}) == len(scenes)
    for scene in scenes:
        for wider in (False, True):
            fits = is_of_class(scene.interface, scene.parameters["along"], midpoints=wider)
            assert fits is (wider or not midpoints), scene.name
