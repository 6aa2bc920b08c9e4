"""From numbers to a verdict: nothing that is no number passes, and a doubt never becomes an accusation."""

import pickle
from dataclasses import replace
from math import comb, inf, nan
from typing import Literal

import numpy as np
import pytest

from contactverif import (
    Case,
    Cases,
    Finding,
    Interface,
    Measurement,
    MisuseError,
    Quantity,
    Rules,
    Subject,
    Traits,
    named_case,
)
from contactverif.contract.property import Outcome, Property, Verdict, judge
from contactverif.contract.result import BY_CHANCE, exceeds

MOST = Quantity("defect", "u 8X/|g|", "roundoff of a gap")
LEAST = Quantity("slope", "1.9", "second order", sense="at least")
QUESTION = Property(
    id="a.question",
    family="a",
    summary="asks",
    quantities=(MOST, LEAST),
    cases=lambda interface: None,
    measure=lambda case, subject: Measurement(),
    promise=lambda traits: None,
)


def measurement(
    defect: float = 0.5, slope: float = 2.0, *, tolerances: tuple[float, float] = (1.0, 1.9), **more: str
) -> Measurement:
    numbers = [MOST.check(defect, tolerances[0]), LEAST.check(slope, tolerances[1])]
    return Measurement(numbers, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("measured", "verdict", "reason"),
    [
        (measurement(), Verdict.PASS, ""),
        (measurement(1.0, 1.9), Verdict.PASS, ""),
        (measurement(1.5), Verdict.FAIL, "defect 1.5, at most 1"),
        (measurement(slope=1.5), Verdict.FAIL, "slope 1.5, at least 1.9"),
        (measurement(1.5, 1.5), Verdict.FAIL, "defect 1.5, at most 1; slope 1.5, at least 1.9"),
        # A breach that no number tells.
        (measurement(broken="changed its input"), Verdict.FAIL, "changed its input"),
        (measurement(2.0, broken="changed its input"), Verdict.FAIL, "changed its input; defect 2, at most 1"),
        # A doubt excuses a failure, and spoils no pass.
        (measurement(1.5, undecided="a kink"), Verdict.UNDECIDED, "a kink"),
        (measurement(undecided="a kink"), Verdict.PASS, ""),
        (measurement(broken="it printed", undecided="a kink"), Verdict.UNDECIDED, "a kink"),
        # A failure stands whatever the other tolerance.
        (measurement(2.0, tolerances=(1.0, nan)), Verdict.FAIL, "defect 2, at most 1"),
        (measurement(broken="it printed", tolerances=(nan, nan)), Verdict.FAIL, "it printed"),
        # A quantity may be left unmeasured.
        (Measurement([MOST.check(0.5, 1.0)]), Verdict.PASS, ""),
        (Measurement([MOST.check(2.0, 1.0)]), Verdict.FAIL, "defect 2, at most 1"),
    ],
)
def test_numbers_make_a_verdict_and_its_reason(measured: Measurement, verdict: Verdict, reason: str) -> None:
    assert judge(QUESTION, measured) == (verdict, reason)


@pytest.mark.parametrize("value", [nan, inf, -inf, np.float64(nan)])
def test_what_is_not_finite_fails_before_anything_is_compared(value: float) -> None:
    assert judge(QUESTION, measurement(value)) == (Verdict.FAIL, f"defect is {value}")
    assert judge(QUESTION, measurement(slope=value)) == (Verdict.FAIL, f"slope is {value}")
    assert judge(QUESTION, measurement(5.0, value)) == (Verdict.FAIL, f"slope is {value}")
    assert judge(QUESTION, measurement(value, undecided="a kink"))[0] is Verdict.FAIL
    assert judge(QUESTION, measurement(0.0, value, tolerances=(nan, nan))) == (Verdict.FAIL, f"slope is {value}")


@pytest.mark.parametrize("tolerance", [nan, inf, -inf, np.float64(nan)])
@pytest.mark.parametrize("value", [-1.0, 0.0, 1.0, 1e300])
def test_a_tolerance_that_is_not_finite_passes_nothing_and_accuses_nobody(value: float, tolerance: float) -> None:
    of_defect = measurement(value, tolerances=(tolerance, 1.9))
    of_slope = measurement(slope=value, tolerances=(1.0, tolerance))
    assert judge(QUESTION, of_defect) == (Verdict.UNDECIDED, f"the tolerance of defect is {tolerance}")
    assert judge(QUESTION, of_slope) == (Verdict.UNDECIDED, f"the tolerance of slope is {tolerance}")
    assert MOST.check(value, tolerance).ratio == inf
    assert LEAST.check(value, tolerance).ratio == inf


@pytest.mark.parametrize(
    ("sense", "value", "tolerance", "ratio"),
    [
        ("at most", 1.0, 4.0, 0.25),
        ("at most", 0.0, 0.0, 0.0),
        ("at most", 5e-324, 0.0, inf),
        ("at most", -1.0, 4.0, -0.25),
        ("at most", nan, 1.0, inf),
        ("at least", 4.0, 1.0, 0.25),
        ("at least", 1.0, 4.0, 4.0),
        ("at least", 0.0, 1.0, inf),
        ("at least", -1.0, 1.0, inf),
        ("at least", 0.0, 0.0, 0.0),
        ("at least", inf, 1.0, inf),
    ],
)
def test_ratio(sense: Literal["at most", "at least"], value: float, tolerance: float, ratio: float) -> None:
    assert Quantity("x", "", "", sense=sense).check(value, tolerance).ratio == ratio


def test_a_finding_stands_behind_the_numbers_of_a_failure() -> None:
    finding = Finding("slave node 0", (0.25, 1.0), (0.125, 1.0), "N", "force", "exact", "free end")
    text = "slave node 0: force 0.25, 1, exact 0.125, 1; free end"
    assert judge(QUESTION, Measurement([MOST.check(2.0, 1.0)], finding=finding))[1] == f"defect 2, at most 1; {text}"
    assert str(Finding("row 3", remark="no entry")) == "row 3; no entry"
    with pytest.raises(ValueError, match="1 numbers are found, and 0 are right"):
        Finding("row 3", (1.0,))


@pytest.mark.parametrize(
    ("value", "quantities", "place"),
    [(1.0, (), None), (2.0, (), "moved, slave node 0"), (2.0, (MOST,), "moved, slave node 0"), (2.0, (LEAST,), None)],
)
def test_a_finding_says_what_was_done(value: float, quantities: tuple[Quantity, ...], place: str | None) -> None:
    finding = Measurement([MOST.check(value, 1.0)]).after("moved", *quantities, finding=Finding("slave node 0")).finding
    assert (finding and finding.place) == place


def test_no_quantity_is_measured_twice() -> None:
    with pytest.raises(ValueError, match="twice"):
        Measurement([MOST.check(1.0, 1.0), MOST.check(2.0, 1.0)])


def test_verdicts_read_as_words_and_their_numbers_are_those_of_reports() -> None:
    assert [str(verdict) for verdict in Verdict] == [
        "pass", "fail", "undecided", "not applicable", "crashed", "not provided", "not loaded", "not judged",
    ]  # fmt: skip
    assert [int(verdict) for verdict in Verdict] == list(range(8))


def test_only_a_decision_counts_as_judged() -> None:
    case = Case(pair := Interface.from_chains([[0, 0], [1, 0]], [[1, 0], [0, 0]]), pair.nodes.reshape(-1))
    decided = {verdict for verdict in Verdict if Outcome(case, verdict).decided}
    assert decided == {Verdict.PASS, Verdict.FAIL, Verdict.CRASHED}


@Property.define(
    id="a.definition", family="a", quantities=(MOST,), promise=lambda traits: None,
    cases=Cases.from_list(lambda: (named_case("a1"),)), asks=frozenset({"penalty"}),
)  # fmt: skip
def definition(case: Case, subject: Subject) -> Measurement:
    """Nothing is wrong.

    **Question.** Is anything?
    """
    return Measurement()


def test_a_defined_property_has_its_question_and_is_pickled_by_its_name() -> None:
    assert (definition.summary, definition.question) == ("Nothing is wrong.", "**Question.** Is anything?")
    assert pickle.loads(pickle.dumps(definition)) is definition
    other = pickle.loads(pickle.dumps(replace(definition, id="another")))
    assert (other.id, other.measure) == ("another", definition.measure)


def test_a_property_without_a_docstring_is_refused_by_the_name_of_its_function() -> None:
    def silent(case: Case, subject: Subject) -> Measurement:
        return Measurement()

    words = r"docstring of .*\.silent: found none; needed what must hold, in one line, and the question below it: "
    with pytest.raises(MisuseError, match=words + "the property's page is made of them"):
        Property.define(
            id="a.silent", family="a", quantities=(MOST,), promise=lambda traits: None, cases=definition.cases
        )(silent)


def test_who_is_not_asked_is_told_why() -> None:
    refusals = [
        definition.refusal(Traits(rules=Rules(enforcement=each))) for each in ("penalty", "multiplier", "barrier")
    ]
    assert refusals == [
        "",
        "the enforcement is by a multiplier",
        "the states penetrate, where a barrier is not defined",
    ]


def test_a_list_has_no_cases_on_an_interface_but_those_of_its_function() -> None:
    place = named_case("a1").interface
    assert [case.name for case in definition.cases(None)] == ["a1"]
    assert definition.cases(place) is None
    assert Cases.from_list(tuple, on_place=lambda place: place)(place) is place
    assert Cases.random(lambda place: place)(place) is place


@pytest.mark.parametrize(("number", "share"), [(100, 0.04), (900, 0.002), (20, 0.3)])
def test_a_count_exceeds_a_share_where_the_binomial_sum_says_so(number: int, share: float) -> None:
    terms = [comb(number, n) * share**n * (1 - share) ** (number - n) for n in range(number + 1)]
    answers = [exceeds(count, number, share) for count in range(number + 1)]
    assert answers == [sum(terms[count:]) < BY_CHANCE for count in range(number + 1)]
    assert not answers[0]
    assert answers[-1]


@pytest.mark.parametrize(
    ("count", "number", "share", "answer"),
    [(0, 0, 0.1, False), (0, 100, 0.0, False), (1, 100, 0.0, True), (100, 100, 1.0, False)],
)
def test_no_cases_and_certain_shares_need_no_luck(count: int, number: int, share: float, answer: bool) -> None:
    assert exceeds(count, number, share) is answer
