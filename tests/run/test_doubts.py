"""A run says what makes it doubtful: too little contact, too many undecided cases, forces of the opposite sign."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from expected_verdicts import FAILS
from hypothesis import strategies as st
from subjects import Changed

from contactverif import Case, MisuseError, Subject, load_formulation, load_properties, named_case
from contactverif.contract.property import Measurement, Property, PropertyInfo, Quantity, Verdict
from contactverif.contract.result import OPPOSITE_SIGN, Row
from contactverif.contract.traits import Traits
from contactverif.run.run import run
from contactverif.testing.checks import explain
from contactverif_mortar import mortar_lm
from contactverif_nts import nts, nts_ar

ERROR = Quantity("error", "1e-6", "a number for a test")


def numbered_cases(count: int) -> tuple[Case, ...]:
    return tuple(replace(named_case("a1"), seed=n, name=f"case {n}") for n in range(count))


def one_row(count: int, *, idle: int = 0, undecided: int = 0, **info: Any) -> Row:
    """Return the row of a property whose first cases are idle, and whose last ones are undecided."""

    def measure(case: Case, subject: Subject) -> Measurement:
        reason = "a kink" if case.seed >= count - undecided else ""
        return Measurement([ERROR.check(float(bool(reason)), 1e-6)], reason, idle=case.seed < idle)

    question = Property(
        "x.y", "x", "A number.", (ERROR,), lambda _: numbered_cases(count), measure, lambda _: True, **info
    )
    [row] = run([Subject("mine", nts)], [question], seed=1, examples=count).rows
    return row


@pytest.mark.parametrize(
    ("idle", "least", "verdict"),
    [
        (0, 0.8, Verdict.PASS),
        (20, 0.8, Verdict.PASS),
        (36, 0.8, Verdict.PASS),
        (37, 0.8, Verdict.NOT_JUDGED),
        (100, 0.0, Verdict.PASS),
    ],
)
def test_a_row_with_too_few_cases_in_contact_is_not_judged(idle: int, least: float, verdict: Verdict) -> None:
    row = one_row(100, idle=idle, least_contact=least)
    assert row.verdict is verdict
    assert row.contact_share == 1 - idle / 100
    assert bool(row.unexpected) == (verdict is Verdict.NOT_JUDGED)


def test_the_reason_says_how_many_were_in_contact() -> None:
    assert one_row(100, idle=41).reason == "59 of 100 judged cases in contact, needed 80%"
    assert one_row(3, idle=3).reason == "nothing was in contact in any case: nothing was judged"
    assert one_row(3, idle=1).verdict is Verdict.PASS  # A few cases may be chance.
    assert one_row(12, idle=5).verdict is Verdict.PASS
    assert one_row(12, idle=9).verdict is Verdict.NOT_JUDGED


def test_undecided_cases_are_reported_beyond_twice_the_usual_share_and_chance() -> None:
    assert not one_row(100, undecided=8, usual_undecided=0.02).suspicion  # Twice, but chance allows it.
    row = one_row(200, undecided=19, usual_undecided=0.015)
    assert row.verdict is Verdict.PASS
    assert row.suspicion == (
        "9.5 % of the cases are undecided, of right formulations 1.5 %: what is undecided may hide what is wrong"
    )
    assert row.suspicion in explain(row, command="pytest")
    assert not one_row(200, undecided=19, usual_undecided=0.05).suspicion


@pytest.mark.parametrize(("undecided", "verdict"), [(19, Verdict.PASS), (20, Verdict.NOT_JUDGED)])
def test_nine_tenths_of_what_right_formulations_decide_are_needed(undecided: int, verdict: Verdict) -> None:
    assert one_row(100, undecided=undecided, usual_undecided=0.1).verdict is verdict


def test_a_share_beyond_one_is_refused() -> None:
    with pytest.raises(MisuseError, match=r"least_contact: found 80; needed a share"):
        PropertyInfo("x.y", "x", "A number.", (ERROR,), least_contact=80)


def negate(inner: Any) -> Changed:
    """Return a formulation that turns all signs of a residual round, and promises nothing."""
    traits = Traits().revise(enforcement=inner.traits.rules.enforcement)
    return Changed(inner, traits=traits, tangent=None, residual=lambda *state: -inner.residual(*state))


@pytest.mark.parametrize("make", [nts, nts_ar, mortar_lm])
def test_an_opposite_sign_fails_any_run_and_is_said(make: Any) -> None:
    subject = Subject("mine", lambda *, penalty: negate(make(penalty=penalty)))
    result = run([subject], load_properties(["purity"]), seed=1, examples=3)
    assert result.opposite_signs == ("mine",)
    assert not result.promises_kept
    [row] = result.rows
    assert not row.unexpected
    first, *_ = explain(row, command="pytest", opposite_sign=True).splitlines()
    assert first == f"mine: {OPPOSITE_SIGN}"


def test_the_residual_alone_is_enough_to_see_the_sign() -> None:
    class Springs:
        def __init__(self, *, penalty: float) -> None:
            self.penalty = penalty

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            forces = np.zeros_like(z)
            forces[1] = -self.penalty * min(z[1], 0.0)
            return forces

    assert run([Subject("mine", Springs)], load_properties(["purity"]), seed=1, examples=1).opposite_signs == ("mine",)


def test_no_right_formulation_has_the_opposite_sign() -> None:
    subjects = [load_formulation(name) for name in FAILS]
    nothing = Property("x.y", "x", "None.", (), lambda _: st.just(named_case("a1")), lambda *_: Measurement(),
                       lambda _: None)  # fmt: skip
    assert run(subjects, [nothing], seed=1, examples=1).opposite_signs == ()


def test_who_gives_no_answer_has_no_sign() -> None:
    class Silent:
        def __init__(self, *, penalty: float) -> None:
            pass

        def residual(self, interface: Any, pairing: Any, z: Any) -> Any:
            raise IndexError("no answer")

    assert run([Subject("mine", Silent)], load_properties(["purity"]), seed=1, examples=1).opposite_signs == ()


@pytest.mark.parametrize(("promise", "verdict"), [(None, Verdict.UNDECIDED), (True, Verdict.NOT_JUDGED)])
def test_a_list_of_scenes_without_solutions_fails_only_who_promised(promise: bool | None, verdict: Verdict) -> None:
    """A stranger's first formulation may have no solution on some mesh: that is neither wrong nor a failed run."""

    def measure(case: Case, subject: Subject) -> Measurement:
        return Measurement(undecided="Newton's method found no balance" if case.seed else "")

    cases = numbered_cases(3)
    question = Property("x.y", "x", "A number.", (ERROR,), lambda _: cases, measure, lambda _: promise, bodies=True)
    result = run([Subject("mine", nts)], [question], seed=1)
    (row,) = result.rows
    assert row.verdict is verdict
    assert "1 of 3 cases judged; most often because Newton's method found no balance" in row.reason
    assert result.promises_kept == (promise is None)
