"""A result that is encoded comes back to the last bit, through JSON too, and nothing that is damaged is believed."""

import json
from typing import Any

import numpy as np
import pytest

from contactverif import Measurement, Outcome, Quantity, Verdict
from contactverif.contract.case import CaseSummary
from contactverif.contract.property import Finding, PropertyInfo
from contactverif.contract.schema import decoder, encode

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
INFO = PropertyInfo("a.b", "a", "about", (ERROR,), needs=frozenset({"pair"}), series={"residual": "N"}, kinds=("x",))


@pytest.mark.parametrize("record", [*OUTCOMES, INFO])
def test_a_record_comes_back(record: Any) -> None:
    form, numbers = encode(record)
    hash(form)
    for its_form in (form, json.loads(json.dumps(form))):
        again = decoder(type(record), its_form)(numbers)
        assert repr(again) == repr(record)
        assert repr(encode(again)) == repr((form, numbers))


def test_many_records_of_one_form_are_read_by_one_decoder() -> None:
    form, numbers = encode(OUTCOMES[0])
    read = decoder(Outcome, form)
    assert [read([*numbers[:-1], seconds]).seconds for seconds in (1.0, 2.0)] == [1.0, 2.0]


def _changes(form: Any) -> list[Any]:
    """Return forms in which one word, truth, number or None is of another type, or one part is missing."""
    if not isinstance(form, tuple):
        return [3.5, {"a": 1}]
    whole = [(*form[:place], other, *form[place + 1 :]) for place, part in enumerate(form) for other in _changes(part)]
    return [*whole, *([form[:-1]] if form else [])]


@pytest.mark.parametrize("outcome", OUTCOMES)
def test_a_damaged_record_is_refused(outcome: Outcome) -> None:
    form, numbers = encode(outcome)
    damaged = [(changed, numbers) for changed in _changes(form)]
    damaged += [(form, numbers[:-1]), (form, [*numbers, 1.0]), (form, [float("nan"), *numbers[1:]]), (form, [])]
    for changed, its_numbers in damaged:
        with pytest.raises(ValueError, match=r"."):
            decoder(Outcome, changed)(its_numbers)
