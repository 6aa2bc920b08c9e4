"""Quadrilaterals in space: which are cases for whom, and how far from exact quadratures of their overlaps are."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from planned_cases import draw_cases
from readable_cells import centre_points
from subjects import load_subject
from zoo.faces import STS, by_rule, changes_points

from contactverif import Case, Property, Subject, Verdict, load_properties
from contactverif.run.judge import judge_case
from contactverif.strategies.surfaces import flat_surface_cases, surface_cases
from contactverif_properties import exact_forces
from contactverif_properties.patch_flat import patch_flat_transmission
from contactverif_surfaces.cell_points import cross_plane, gauss_points


def corners_of(case: Case) -> tuple[int, int]:
    return case.interface.slave.faces.shape[1], case.interface.master.faces.shape[1]


@pytest.mark.parametrize(
    ("faces", "kinds"), [((3,), {(3, 3)}), ((4,), {(4, 4)}), ((3, 4), {(3, 3), (3, 4), (4, 3), (4, 4)})]
)
def test_only_faces_that_a_formulation_takes_are_cases(faces: tuple[int, ...], kinds: set[tuple[int, int]]) -> None:
    traits = load_subject("sts-3d").traits.revise(faces=faces)
    loaded = [question for question in load_properties() if isinstance(question, Property) and question.cases_in_space]
    others = [each for each in loaded if not each.id.startswith("projection.") and each.cases_in_space.takes_faces]
    for question in (each.for_traits(traits) for each in others):
        cases = draw_cases(question.cases(None), seed="quads", examples=8).cases
        pairs = {corners_of(case) for case in cases}
        assert pairs <= kinds, question.id
        assert {corners for pair in pairs for corners in pair} == {*faces}, question.id


FLAT = draw_cases(flat_surface_cases(None, (4,)), seed="flat", examples=90).cases
SKEWED_CASES = [case for case in FLAT if exact_forces.is_skewed(case)]
RECTANGLES = [case for case in FLAT if not exact_forces.is_skewed(case)]


def test_flat_quadrilaterals_are_rectangles_or_skewed_and_cover_the_domain() -> None:
    for cases in (RECTANGLES, SKEWED_CASES):
        plane = [(case.parameters["plane"], np.ptp(case.parameters["domain"], axis=0)) for case in cases]
        assert len(cases) > 20
        assert {float((np.ptp(places, axis=0) / size).max()) > 1 for places, size in plane} == {True, False}


def test_no_quadrilateral_is_refused_by_the_contract() -> None:
    for case in draw_cases(surface_cases(faces=(4,)), seed="shapes", examples=60).cases:
        assert corners_of(case) == (4, 4)
        assert np.isfinite(case.interface.slave.heights(case.positions)).all()


def error(case: Case, make: Any) -> float:
    return patch_flat_transmission.measure(case, Subject("a rule", make)).values[exact_forces.SKEWED.name]


def test_more_points_are_nearer_to_exact_on_skewed_quadrilaterals() -> None:
    """A right rule of three points errs by less than 1e-3, of six by much less, and one point a cell by some 1e-2."""
    rules = {6: STS, 3: by_rule(partial(gauss_points, n_points=3)), 1: by_rule(centre_points)}
    worst = {count: max(error(case, make) for case in SKEWED_CASES) for count, make in rules.items()}
    print(worst)
    assert worst[6] < worst[3] / 4 < worst[1] / 16
    assert worst[3] < exact_forces.MOST_SKEWED / 4


def _quarters(points: Any, _: Any) -> Any:
    """Give each corner of a slave face a quarter of its area."""
    return replace(points, slave_shape=0 * points.slave_shape + 0.25)


def _jacobian_of_the_middle(points: Any, view: Any) -> Any:
    """Find places on a slave face by the Jacobian in its middle: one step of Newton's method."""
    first, second, third, last = (view.slave[..., i : i + 1, :] for i in range(4))
    along, across = (second + third - first - last) / 4, (third + last - first - second) / 4
    arm = points.slave_shape @ view.slave - (first + second + third + last) / 4
    s, t = cross_plane(arm, across) / cross_plane(along, across), cross_plane(along, arm) / cross_plane(along, across)
    shape = np.stack([(1 - s) * (1 - t), (1 + s) * (1 - t), (1 + s) * (1 + t), (1 - s) * (1 + t)], axis=-1) / 4
    return replace(points, slave_shape=shape)


@pytest.mark.parametrize("change", [_quarters, _jacobian_of_the_middle])
def test_what_is_right_on_rectangles_alone_fails_on_skewed_quadrilaterals(change: Any) -> None:
    wrong, right = Subject("wrong", changes_points(change)), Subject("right", STS)
    assert all(judge_case(patch_flat_transmission, case, wrong).verdict is Verdict.PASS for case in RECTANGLES)
    outcomes = [judge_case(patch_flat_transmission, case, wrong) for case in SKEWED_CASES]
    assert sum(outcome.verdict is Verdict.FAIL for outcome in outcomes) > len(outcomes) / 5
    assert all(judge_case(patch_flat_transmission, case, right).verdict is Verdict.PASS for case in FLAT)
