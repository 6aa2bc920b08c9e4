"""Only what a question needs is built: no body where none is asked for, and each mesh assembled and factorised once."""

from typing import Any

import pytest
from subjects import load_property, load_subject

from contactverif import Body, Property, Verdict, judge_case, load_properties
from contactverif.mechanics import bulk
from contactverif.mechanics.scene import forget_bodies
from contactverif.sampling.draw import draw_cases

WITHOUT_BODIES = [item.id for item in load_properties(["*"]) if isinstance(item, Property) and not item.bodies]
MOST_FACTORISED = {"patch.flat.solve": 2, "patch.variants": 2, "newton.units": 4, "newton.attainable": 4}


@pytest.mark.parametrize("property_id", WITHOUT_BODIES)
def test_a_property_without_bodies_builds_none(property_id: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Any) -> None:
        raise AssertionError("a body")

    question, subject = load_property(property_id), load_subject("vts-ppt")
    monkeypatch.setattr(Body, "__post_init__", refuse)
    cases = draw_cases(question.cases(None), seed="0", examples=3).cases
    for case in cases[:3]:
        judge_case(question, case, subject)


@pytest.mark.parametrize("property_id", MOST_FACTORISED)
def test_each_mesh_is_factorised_once(property_id: str) -> None:
    """Two penalties share their bodies, also far from the origin; rounded nodes and other units are new meshes."""
    question, subject = load_property(property_id), load_subject("vts-ppt")
    (case,) = draw_cases(question.cases(None), seed="1", examples=1).cases
    forget_bodies()
    assert judge_case(question, case, subject).verdict is Verdict.PASS
    assert 0 < bulk._factorise.cache_info().misses <= MOST_FACTORISED[property_id]


def test_bodies_with_other_loads_share_a_factorisation_on_hertz_meshes() -> None:
    question, subject = load_property("accuracy.hertz"), load_subject("vts-ppt")
    forget_bodies()
    for case in question.cases(None)[:3]:
        judge_case(question, case, subject)
    assert bulk._factorise.cache_info().misses <= 8  # Four meshes of each body, whatever the penalty.
