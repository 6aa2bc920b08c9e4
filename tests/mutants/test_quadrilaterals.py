"""Quadrilaterals in space: which are cases for whom, and how far from exact quadratures of their overlaps are."""

from functools import partial
from typing import Any

import numpy as np
import pytest
from readable_cells import centre_points
from subjects import load_subject
from zoo.faces import STS, by_rule

from contactverif import Case, Property, Subject, load_properties
from contactverif.sampling.draw import draw_cases
from contactverif.strategies.surfaces import flat_surface_cases, skewed_surface_cases, surface_cases
from contactverif_properties.exact_forces import measure_transmission
from contactverif_properties.roundoff import gap_quantity
from contactverif_surfaces.cell_points import gauss_points


def corners_of(case: Case) -> tuple[int, int]:
    return case.interface.slave.faces.shape[1], case.interface.master.faces.shape[1]


@pytest.mark.parametrize(
    ("faces", "kinds"), [((3,), {(3, 3)}), ((4,), {(4, 4)}), ((3, 4), {(3, 3), (3, 4), (4, 3), (4, 4)})]
)
def test_only_faces_that_a_formulation_takes_are_cases(faces: tuple[int, ...], kinds: set[tuple[int, int]]) -> None:
    traits = load_subject("sts-3d").traits.revise(faces=faces)
    loaded = [question for question in load_properties() if isinstance(question, Property) and question.cases_in_space]
    for question in (each.for_traits(traits) for each in loaded if not each.id.startswith("projection.")):
        cases = draw_cases(question.cases(None), seed="quads", examples=8).cases
        pairs = {corners_of(case) for case in cases}
        assert pairs <= kinds, question.id
        assert {corners for pair in pairs for corners in pair} == {*faces}, question.id


def test_flat_quadrilaterals_are_rectangles_and_cover_the_domain() -> None:
    sizes = set()
    for case in draw_cases(flat_surface_cases(faces=(4,)), seed="flat", examples=20).cases:
        for side in (case.interface.slave, case.interface.master):
            corners, domain = case.parameters["plane"][side.faces], case.parameters["domain"]
            assert (corners[:, 0] + corners[:, 2] == corners[:, 1] + corners[:, 3]).all()
            sizes.add(float((np.ptp(corners, axis=(0, 1)) / np.ptp(domain, axis=0)).max()))
    assert sizes == {1.0, 2.0}


def test_no_quadrilateral_is_refused_by_the_contract() -> None:
    for strategy in (surface_cases, skewed_surface_cases):
        for case in draw_cases(strategy(faces=(4,)), seed="shapes", examples=60).cases:
            assert corners_of(case) == (4, 4)
            assert np.isfinite(case.interface.slave.heights(case.positions)).all()


def error(case: Case, make: Any) -> float:
    return measure_transmission(gap_quantity("error"), case, Subject("a rule", make)).numbers[0].value


def test_more_points_are_nearer_to_exact_on_skewed_quadrilaterals() -> None:
    """A right rule of three points errs by up to 1e-3, of six by some 1e-4, and one point a cell by some 1e-2.

    No quadrature of overlaps is exact there, so no property asks for it.
    """
    cases = draw_cases(skewed_surface_cases(faces=(4,)), seed="errors", examples=40).cases
    rules = {6: STS, 3: by_rule(partial(gauss_points, n_points=3)), 1: by_rule(centre_points)}
    worst = {count: max(error(case, make) for case in cases) for count, make in rules.items()}
    print(worst)
    assert worst[6] < worst[3] / 4 < worst[1] / 16
    assert worst[6] < 1e-3
