"""`stability.inf-sup`: who is stable, who is not, and strangers."""

from functools import partial

import numpy as np
import pytest
from subjects import load_property, load_subject, measure_case
from textbook_springs import NodalMultipliers
from zoo.face_multipliers import FaceMultipliers

from contactverif import Case, Subject, Verdict, judge_case
from contactverif.problems.refined_blocks import (
    FAMILIES,
    N_MESHES,
    refinement_cases,
    refinement_space_cases,
    refinements,
)
from contactverif_properties.multipliers import CONSTANT, SEGMENT, SLOPE, ZEROS

QUESTION = load_property("stability.inf-sup")
COARSER, FINER, MATCHING = refinement_cases()


def test_the_families_have_the_ratios_of_their_names_and_halve_their_segments() -> None:
    assert [case.name for case in refinement_cases()] == list(FAMILIES)
    assert [tuple(case.parameters["columns"]) for case in refinement_cases()] == [(4, 6), (6, 4), (4, 4)]
    counts = [len(scene.interface.slave) for scene in refinements(COARSER)]
    assert counts == [4 * 2**level for level in range(N_MESHES)]


@pytest.mark.parametrize("name", ["nts-lm", "mortar-lm", "mortar-dual-lm", "mortar-lm:normals=averaged"])
@pytest.mark.parametrize("case", refinement_cases(), ids=lambda case: case.name)
def test_the_constants_of_stable_methods_do_not_fall(name: str, case: Case) -> None:
    measurement = measure_case(QUESTION, case, load_subject(name))
    assert measurement.values[ZEROS.name] == 0
    assert abs(measurement.values[SLOPE.name]) < 0.005  # A twentieth of the tolerance.


def test_with_two_points_a_segment_the_constant_falls_like_h_or_pressures_move_nothing() -> None:
    subject = load_subject("vts-ppt-lm")
    measurement = measure_case(QUESTION, COARSER, subject)
    assert measurement.values[ZEROS.name] == 0
    assert measurement.values[SLOPE.name] == pytest.approx(1.0, abs=0.02)
    for case, share in ((FINER, 1 / 3), (MATCHING, 1 / 2)):
        series = measure_case(QUESTION, case, subject).series
        assert series["zero eigenvalues"][-1] / series["multipliers"][-1] == pytest.approx(share, abs=0.01)


def test_with_one_point_a_segment_the_constant_falls_where_meshes_match() -> None:
    subject = load_subject("vts-ppt-lm:n=1")
    verdicts = {case.name: judge_case(QUESTION, case, subject).verdict for case in (COARSER, MATCHING)}
    assert verdicts == {COARSER.name: Verdict.PASS, MATCHING.name: Verdict.FAIL}
    assert measure_case(QUESTION, MATCHING, subject).values[SLOPE.name] == pytest.approx(1.0, abs=0.02)


def test_a_stranger_with_nodal_multipliers_has_the_constants_of_nts() -> None:
    stranger, ours = (
        measure_case(QUESTION, COARSER, subject)
        for subject in (Subject("it", NodalMultipliers), load_subject("nts-lm"))
    )
    np.testing.assert_allclose(stranger.series[CONSTANT], ours.series[CONSTANT], rtol=1e-8)
    np.testing.assert_allclose(ours.series[SEGMENT], 1 / 2.0 ** np.arange(N_MESHES))


@pytest.mark.parametrize("dual", [False, True])
def test_the_constants_of_mortar_methods_do_not_fall_in_space(dual: bool) -> None:
    for case in refinement_space_cases((3,) if dual else (3, 4)):
        measurement = measure_case(QUESTION, case, Subject("it", partial(FaceMultipliers, dual=dual)))
        assert measurement.values[ZEROS.name] == 0
        assert abs(measurement.values[SLOPE.name]) < 0.04


def test_a_pressure_at_each_corner_of_each_face_is_too_many() -> None:
    """On a finer slave most of them move nothing, and on a coarser one β falls nearly like h."""
    subject = Subject("it", partial(FaceMultipliers, shared=False))
    for case in refinement_space_cases((3, 4)):
        values = measure_case(QUESTION, case, subject).values
        assert values[ZEROS.name] >= 7
        assert (values[SLOPE.name] > 0.8) is case.name.startswith("slave coarser")


def test_springs_are_not_asked() -> None:
    assert QUESTION.refusal(load_subject("mortar").traits) == "the enforcement is by a penalty"
    assert QUESTION.cases(COARSER) is None
