"""Each body that a property needs is assembled and factorised once, and only facets that may touch are visited."""

import pytest
from scene_work import measure_work
from subjects import load_subject

from contactverif import Property, load_properties

WITH_BODIES = {item.id: item for item in load_properties(["*"]) if isinstance(item, Property) and item.bodies}
MOST_VISITED = 1.5  # Facets that are visited for each one that touches: where contact ends must be found.


@pytest.mark.parametrize("property_id", WITH_BODIES)
def test_no_body_is_built_twice(property_id: str) -> None:
    subject = load_subject("vts-ppt")
    if WITH_BODIES[property_id].refusal_of(subject):
        pytest.skip("it does not apply to this formulation")
    work = measure_work(WITH_BODIES[property_id], subject)
    assert work.assembled == work.factorised == work.least_bodies > 0
    assert work.facets <= MOST_VISITED * work.touching_facets or work.touching_facets == 0
