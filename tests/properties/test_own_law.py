"""A law of its own: what is asked of it in its own measure, what is not asked, and what a failure says without it."""

from typing import Any

import pytest
from subjects import judge_as, load_property, with_promises
from zoo.laws import Quadratic
from zoo.on_strips import SegmentPenalty

from contactverif import Rules, Subject, Traits, Verdict
from contactverif.contract.errors import ContractError
from contactverif.plugins.registry import property_ids
from contactverif.problems.named_states import named_case
from contactverif.problems.own_law import fit_to_law, is_nonlinear, stiffness_at
from contactverif.run.judge import NOT_LINEAR

QUADRATIC = Subject("quadratic", Quadratic)
LINEAR_ALONE = {
    "accuracy.arc", "accuracy.hertz", "accuracy.wavy", "accuracy.wavy-curved",
    "hard.convex-kink", "hard.steep-slave", "hard.touch", "hard.zero-load", "newton.history", "newton.units",
    "patch.curved", "patch.flat.published", "patch.kinked", "patch.tilted.nodal", "stability.local",
    "stability.locking", "stability.stiffness", "total-stiffness",
}  # fmt: skip


def test_these_questions_are_of_linear_springs() -> None:
    assert {name for name in property_ids() if load_property(name).linear} == LINEAR_ALONE
    assert "a factor" in load_property("total-stiffness").refusal(QUADRATIC.traits)


def test_a_case_gets_the_penalty_at_which_its_pressure_is_that_of_linear_springs() -> None:
    case = named_case("c")
    depth, penalty = case.parameter("penetration"), QUADRATIC.penalty(fit_to_law(case, QUADRATIC))
    assert penalty * depth**2 == pytest.approx(case.penalty * depth, rel=1e-14)
    assert stiffness_at(case, QUADRATIC, penalty, depth) == pytest.approx(2 * case.penalty)
    assert is_nonlinear(case, QUADRATIC)
    assert not is_nonlinear(case, Subject("linear", SegmentPenalty))


@pytest.mark.parametrize(
    ("traits", "property_id", "remark"),
    [({"law": None}, "patch.flat.resultant", NOT_LINEAR), ({"law": "linear"}, "total-stiffness", "")],
)
def test_a_law_that_is_said_to_be_linear_and_is_not_fails(
    traits: dict[str, Any], property_id: str, remark: str
) -> None:
    question = load_property(property_id)
    listed = question.cases(None)
    case = listed[0] if isinstance(listed, tuple) else named_case("c")
    outcome = judge_as(Verdict.FAIL, question, case, with_promises(Quadratic, **traits))
    assert outcome.reason.endswith(remark)
    assert question.promise(Quadratic.traits.revise(**traits)) is True


def test_who_states_no_penalty_promises_no_law() -> None:
    promises = [load_property(name).promise for name in ("newton.history", "hard.touch", "hard.zero-load")]
    for penalty, promise in ((None, None), ("distributed", True)):
        traits = Quadratic.traits.revise(law=None, penalty=penalty)
        assert [each(traits) for each in promises] == [promise] * 3


def test_a_law_is_one_of_distributed_springs() -> None:
    def make(*, penalty: float) -> Any:
        return type("Plugin", (), {"traits": Traits(rules=Rules(law="own")), "residual": lambda *state: state[-1]})()

    with pytest.raises(ContractError, match=r"found law 'own' with penalty None .*; needed penalty 'distributed'"):
        Subject("mine", make)
    with pytest.raises(ContractError, match=r"law_distance: found -1.0; needed 0, None or a number above 0"):
        Rules(law_distance=-1.0)
