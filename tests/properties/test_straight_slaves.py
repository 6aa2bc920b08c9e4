"""The properties of straight slaves: `patch.tilted.*` and `locality.bend`."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from gauss_springs import RIGHT, GaussSprings
from strangers import NearbyOnly, PointsFirst, SlaveNormalAtGaussPoints, TurnedFrame
from subjects import judge_as, load_property, load_subject, with_promises
from textbook_cells import ClippedCells, WeightedGaps
from textbook_springs import CentredSprings

from contactverif import Case, Interface, Verdict, judge_case
from contactverif.sampling.draw import draw_cases
from contactverif_properties.exact_forces import directions, exact_slave_forces, node_gaps
from contactverif_properties.invariants import BITS
from contactverif_properties.patch_flat import STEEP, TILTED

IDS = ("patch.tilted.resultant", "patch.tilted.nodal", "locality.bend")
EXAMPLES = 8


MASTER = {"force_along": "master normal", "local": True}
SLAVE = {"force_along": "slave normal", "local": True}
RIGHT_ONES = {  # Beside all `STRANGERS`, which `test_strangers.py` asks.
    **{
        make.__name__: with_promises(make, **(SLAVE if make.traits.rules.gap == "slave normal" else MASTER))
        for make in (PointsFirst, TurnedFrame, SlaveNormalAtGaussPoints, NearbyOnly)
    },
    **{
        f"Gauss springs, {name}": with_promises(
            partial(GaussSprings, way=way, before=before),
            gap="closest point",
            integrates_linear_gap=True,
            translation_stable=True,
            **MASTER,
        )
        for name, (way, before) in RIGHT.items()
    },
    "textbook springs about the mean of all nodes": with_promises(CentredSprings, integrates_linear_gap=True, **MASTER),
    "textbook cells": with_promises(ClippedCells, integrates_linear_gap=True, **SLAVE),
    "textbook mortar": with_promises(WeightedGaps, **SLAVE),
}


def cases_of(property_id: str, examples: int = EXAMPLES) -> tuple[Case, ...]:
    return draw_cases(load_property(property_id).cases(None), seed=f"straight/{property_id}", examples=examples).cases


@pytest.mark.parametrize("property_id", IDS)
@pytest.mark.parametrize("name", RIGHT_ONES)
def test_a_right_formulation_of_a_stranger_is_not_accused(name: str, property_id: str) -> None:
    question, subject = load_property(property_id), RIGHT_ONES[name]
    if question.promise(subject.traits) is None:
        return
    for case in cases_of(property_id):
        judge_as(Verdict.PASS, question, case, subject)


def test_all_slaves_are_straight_tilted_and_wholly_in_contact() -> None:
    for case in cases_of("patch.tilted.resultant", 60):
        master, slave = directions(case)
        angle = np.degrees(np.arccos(float(master @ slave)))
        assert 34 < angle < 89.1 if case.kind == STEEP else 3 < angle < 35
        assert (node_gaps(case) < 0).all()
        n, points = case.interface.n_slave_nodes, case.positions
        heights = (points[:n] - points[0]) @ slave, (points[n:] - points[n]) @ master
        for side in heights:
            assert np.ptp(side) <= 2.0**-50 * case.largest_coordinate


def test_half_of_the_steep_slaves_are_tilted_by_80_to_88_degrees_and_no_gap_is_longer_than_two_segments() -> None:
    cases = [case for case in cases_of("patch.tilted.resultant", 200) if case.kind == STEEP]
    assert len(cases) == 100
    cosines = np.array([float(np.multiply(*directions(case)).sum()) for case in cases])
    assert (np.abs(np.degrees(np.arccos(cosines)) - 84) < 4).sum() >= 40
    for case, cosine in zip(cases, cosines, strict=True):
        deepest = -float(node_gaps(case).min()) / cosine
        assert deepest < 2 * case.interface.master.lengths(case.positions).min()


def test_only_who_states_no_rule_for_gaps_may_overlook_a_steep_slave() -> None:
    class Blind(ClippedCells):
        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            return np.zeros_like(z)

    question = load_property("patch.tilted.resultant")
    cases = {case.kind: case for case in cases_of(question.id)}
    assert set(cases) == {TILTED, STEEP}
    for kind, gap, verdict in (
        (STEEP, None, Verdict.PASS),
        (TILTED, None, Verdict.FAIL),
        (STEEP, "slave normal", Verdict.FAIL),
    ):
        judge_as(verdict, question, cases[kind], with_promises(Blind, force_along="slave normal", gap=gap))


def tilted_segment() -> Case:
    """One slave segment from (0, −1) to (4, −4) below a master on the x-axis: gaps −1 and −4, length 5."""
    nodes = np.array([[0.0, -1.0], [4.0, -4.0], [16.0, 0.0], [-16.0, 0.0]])
    interface = Interface.from_chains(nodes[:2] * [1, 0], nodes[2:])
    return Case(interface, nodes.reshape(-1), penalty=2.0)


def test_the_exact_forces_are_those_of_a_hand_calculation() -> None:
    case, traits = tilted_segment(), load_subject("vts-g").traits
    assert exact_slave_forces(case, traits) == pytest.approx(np.array([[0, 10.0], [0, 15.0]]))
    # Along the slave's normal, with cosine 4/5, gaps are 5/4 as long.
    assert exact_slave_forces(case, load_subject("sts").traits) == pytest.approx(
        1.25 * np.array([[6.0, 8.0], [9.0, 12.0]])
    )
    reference = load_subject("nts-ar:area=reference").traits
    assert exact_slave_forces(case, reference).sum(axis=0) == pytest.approx([0, 20.0])


def test_a_force_along_the_other_normal_is_told_by_its_direction() -> None:
    question = load_property("patch.tilted.resultant")
    outcome = judge_case(question, tilted_segment(), with_promises(ClippedCells, force_along="master normal"))
    assert outcome.verdict is Verdict.FAIL
    assert outcome.reason.startswith("part of the force off the normal 0.6")


@pytest.mark.parametrize("name", ["nts-ar", "vts-ppt-balanced", "sts", "mortar", "two-pass/nts", "nts-lm"])
def test_our_own_formulations_keep_every_bit_beside_a_bend(name: str) -> None:
    for case in cases_of("locality.bend"):
        measurement = load_property("locality.bend").measure(case, load_subject(name))
        assert measurement.details[BITS] == 0
        assert not measurement.idle
