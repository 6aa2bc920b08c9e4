"""An outcome that is encoded comes back to the last bit, and nothing that is damaged is believed."""

from typing import Any

import msgspec
import numpy as np
import pytest

from contactverif import Measurement, Outcome, Quantity, Verdict
from contactverif.contract.case import CaseSummary
from contactverif.contract.property import Finding
from contactverif.run.store import decode_outcome, encode_outcome

ERROR = Quantity("force error", "u", "rounding", unit="N")
SUMMARY = CaseSummary(2, 3, 10.0, 4.0, 0.5, {"gap": -0.0}, kind="inside")
MEASURED = Measurement(
    [ERROR.check(np.float64("nan"), 1e-12)],
    details={"Σ|R|": 2.5},
    series={"residual": np.array([1.0, np.inf])},
    finding=Finding("row 3", (1.0, 2.0), (3.0, 5e-324)),
)
OUTCOMES = [
    Outcome(SUMMARY, Verdict.PASS, measurement=Measurement([ERROR.check(0.0, 1.0)], idle=True), seconds=0.25),
    Outcome(SUMMARY, Verdict.FAIL, "force error is nan", MEASURED),
    Outcome(CaseSummary(1, 1, 1.0, 1.0, 1.0, name="C′"), Verdict.CRASHED, "ZeroDivisionError: é", breach=True),
]


@pytest.mark.parametrize("outcome", OUTCOMES)
def test_an_outcome_comes_back(outcome: Outcome) -> None:
    form, numbers = encode_outcome(outcome)
    again = decode_outcome(form, numbers)
    assert repr(again) == repr(outcome)
    assert repr(encode_outcome(again)) == repr((form, numbers))


def test_outcomes_with_other_numbers_have_one_form() -> None:
    form, numbers = encode_outcome(OUTCOMES[0])
    assert [decode_outcome(form, [*numbers[:-1], seconds]).seconds for seconds in (1.0, 2.0)] == [1.0, 2.0]


def _changes(form: Any) -> list[Any]:
    """Return forms in which one word, truth, number or None is of another type, or one part is missing."""
    if isinstance(form, dict):
        return [{**form, key: other} for key, part in form.items() for other in _changes(part)]
    if not isinstance(form, list):
        return [b"", {"a": 1}]
    whole = [[*form[:place], other, *form[place + 1 :]] for place, part in enumerate(form) for other in _changes(part)]
    return [*whole, *([form[:-1]] if form else [])]


@pytest.mark.parametrize("outcome", OUTCOMES)
def test_a_damaged_outcome_is_refused(outcome: Outcome) -> None:
    form, numbers = encode_outcome(outcome)
    damaged = [(msgspec.msgpack.encode(changed), numbers) for changed in _changes(msgspec.msgpack.decode(form))]
    damaged += [(form, numbers[:-1]), (form, [*numbers, 1.0]), (form, [float("nan"), *numbers[1:]]), (form, [])]
    damaged += [(b"\xff", numbers), (b"\x91" * 10**5, numbers)]
    for changed, its_numbers in damaged:
        with pytest.raises(ValueError, match=r"."):
            decode_outcome(changed, its_numbers)
