"""An exact answer of a wrong shape is named, where numpy would broadcast it or speak of its own axes."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from contactverif import MisuseError, load_formulation, solve
from contactverif.mechanics.accuracy import solution_of
from contactverif.problems.problem import ProblemInstance, Variation
from contactverif.problems.wavy import WAVY

FORMULATION = load_formulation("vts-ppt")


@pytest.fixture(scope="module", name="solved")
def solve_once() -> tuple[ProblemInstance, Any]:
    instance = WAVY.pose(WAVY.meshes[0], 10.0, FORMULATION.traits, Variation())
    formulation = FORMULATION.with_penalty(instance.scene.penalty)
    return instance, solution_of(solve(instance.scene, formulation), formulation, nodal=False)


@pytest.mark.parametrize(
    ("field", "wrong", "message"),
    [
        ("pressure", lambda places: 1.0, r"pressure: found shape \(\); needed \(\d+,\), a number for each place"),
        ("pressure", lambda places: np.ones((len(places), 1)), r"pressure: found shape \(\d+, 1\); needed \(\d+,\)"),
        ("motions", lambda places: places.T, r"motions: found shape \(2, \d+\); needed \(\d+, 2\), a vector for each"),
    ],
)
def test_a_field_of_a_wrong_shape_is_named(solved: Any, field: str, wrong: Any, message: str) -> None:
    instance, solution = solved
    with pytest.raises(MisuseError, match=rf"ProblemInstance\.{message}"):
        replace(instance, **{field: (wrong, wrong) if field == "motions" else wrong}).errors(solution)


def test_fields_of_the_right_shape_give_errors(solved: Any) -> None:
    instance, solution = solved
    assert 0 < max(instance.errors(solution).values()) < 1
