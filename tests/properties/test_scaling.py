"""The property `units`, for each kind of penalty and for a hidden absolute tolerance."""

from typing import Any

import numpy as np
import pytest
from handmade import Springs, case, subject

from contactverif import Rules, Traits, Verdict, judge_case
from contactverif.run.run import run
from contactverif_properties.invariants import SCALED_FORCES, SCALED_TANGENT, units

SEEDS = range(1, 30)


@pytest.mark.parametrize("penalty", ["nodal", "distributed"])
def test_a_penalty_that_scales_with_its_unit_changes_no_digit(penalty: str) -> None:
    for seed in SEEDS:
        measurement = units.measure(case(seed=seed), subject(Springs, penalty=penalty))
        assert measurement.values == {SCALED_FORCES.name: 0.0, SCALED_TANGENT.name: 0.0}


@pytest.mark.parametrize(("promised", "actual"), [("nodal", "distributed"), ("distributed", "nodal")])
def test_the_other_kind_of_penalty_does_not(promised: Any, actual: Any) -> None:
    class Boasts(Springs):
        def area(self, z: Any) -> float:
            return float(np.hypot(*self.stretch(z))) if actual == "distributed" else 1.0

    verdicts = [judge_case(units, case(seed=seed), subject(Boasts, penalty=promised)).verdict for seed in SEEDS]
    assert verdicts.count(Verdict.FAIL) >= 20


def test_a_penalty_whose_kind_is_not_stated_is_not_asked() -> None:
    assert "not stated" in units.refusal(Traits())
    assert units.refusal(Traits(rules=Rules(penalty="nodal"))) == ""
    assert units.refusal(Traits(rules=Rules(penalty="nodal", enforcement="multiplier"))) == ""
    assert "barrier" in units.refusal(Traits(rules=Rules(penalty="nodal", enforcement="barrier")))
    result = run([subject(Springs)], [units], examples=3, seed=1)
    assert result.rows[0].verdict is Verdict.NOT_APPLICABLE
    assert result.promises_kept
