"""The property `newton.units`: hidden units are told, and what merely rounds otherwise is not accused."""

from typing import Any

import numpy as np
import pytest
from subjects import Changed, load_subject

import contactverif_nts
from contactverif import Case, Subject, Traits, Verdict, judge_case
from contactverif.sampling.draw import draw_cases
from contactverif.strategies.solids import solid_cases
from contactverif_properties.newton_method import STEPS, newton_units


def draw(examples: int) -> tuple[Case, ...]:
    strategy = solid_cases()
    assert strategy is not None
    return draw_cases(strategy, seed="units", examples=examples).cases


@pytest.mark.parametrize("name", ["nts", "vts-ppt", "mortar", "nts-lm"])
def test_who_uses_the_four_operations_and_square_roots_takes_the_same_steps_to_the_last_bit(name: str) -> None:
    for case in draw(8):
        measurement = newton_units.measure(case, load_subject(name))
        assert measurement.values == {STEPS.name: 0.0}
        assert not measurement.broken
        assert measurement.details["steps that agree to the last bit"] == measurement.details["iterations"]


def make_with_angles(*, penalty: float) -> Any:
    """Return a right formulation, times a power and an angle that equal 1 but for rounding."""
    inner = contactverif_nts.vts_me(penalty=penalty)

    def evaluate_one(positions: Any) -> Any:
        along = positions[2:4] - positions[0:2]
        length = np.exp(np.log(along @ along) / 2)
        angle = np.arctan2(along[1], along[0])
        return length * np.hypot(np.cos(angle), np.sin(angle)) / np.sqrt(along @ along)

    def residual(interface: Any, pairing: Any, z: Any) -> Any:
        return evaluate_one(z) * inner.residual(interface, pairing, z)

    return Changed(inner, residual=residual, traits=inner.traits.revise(batched=False, takes_complex=False))


def test_a_power_and_an_angle_are_not_accused() -> None:
    subject = Subject("angles", make_with_angles)
    outcomes = [judge_case(newton_units, case, subject) for case in draw(25)]
    assert all(outcome.verdict is not Verdict.FAIL for outcome in outcomes)
    values = [outcome.measurement.values[STEPS.name] for outcome in outcomes if outcome.measurement]
    assert max(values) > 0


def test_another_pairing_in_other_units_is_told_in_words() -> None:
    def make(*, penalty: float) -> Any:
        inner = contactverif_nts.nts(penalty=penalty)

        def pair(interface: Any, z: Any) -> Any:
            pairing = inner.pair(interface, z)
            long = np.abs(z).max() > 1e3  # The limit has a unit.
            return {**pairing, "active": pairing["active"] & long}

        return Changed(inner, pair=pair)

    outcomes = [judge_case(newton_units, case, Subject("limit", make)) for case in draw(10)]
    assert any("the pairing is another one in other units" in outcome.reason for outcome in outcomes)


def test_who_does_not_state_the_unit_of_its_penalty_is_not_asked() -> None:
    assert "unit is unknown" in newton_units.refusal(Traits())
    assert "not independent" in newton_units.refusal(load_subject("vts-ppt-lm").traits)
