"""Meshes of the paper's classes: of their class by construction, and simple when they shrink."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import find, settings

from contactverif import Case, named_case
from contactverif.oracle import is_of_class
from contactverif.problems.block_scenes import normal_scenes, single_scenes
from contactverif.sampling.draw import draw_cases
from contactverif.strategies import normal_cases, overhung_cases, single_cases

FIXED = settings(derandomize=True, database=None, max_examples=2000)
KINDS = {normal_cases: False, single_cases: True, overhung_cases: True}


def collect_cases(strategy: Any, count: int) -> tuple[Case, ...]:
    return draw_cases(strategy, seed="classes", examples=count).cases


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
    case = find(strategy(), lambda _: True, settings=FIXED)
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


def test_states_of_a_given_interface_need_its_class() -> None:
    assert normal_cases(named_case("a2").interface) is not None
    assert normal_cases(named_case("b").interface) is None
    assert single_cases(named_case("b").interface) is not None
    assert single_cases(named_case("c").interface) is None
    assert single_cases(named_case("tilted").interface) is None


@pytest.mark.parametrize(("make", "midpoints"), [(normal_scenes, False), (single_scenes, True)])
def test_scenes_are_of_their_class(make: Callable[[], tuple[Case, ...]], midpoints: bool) -> None:
    scenes = make()
    assert len({scene.name for scene in scenes}) == len(scenes)
    for scene in scenes:
        assert is_of_class(scene.interface, scene.parameters["along"], midpoints=midpoints), scene.name
        if midpoints:
            assert not is_of_class(scene.interface, scene.parameters["along"], midpoints=False), scene.name
