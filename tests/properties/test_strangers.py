"""No property accuses a stranger's formulation of breaking what it promises; `tox -e trust` asks many more cases."""

from typing import Any

import pytest
from strangers import STRANGERS
from subjects import load_property

from contactverif import Subject, Verdict, judge_case
from contactverif.contract.property import Property
from contactverif.run.draw import draw_cases
from contactverif.run.registry import property_ids

EXAMPLES = 2  # Cases of each property, random or spread over its list
QUESTIONS = [question for question in map(load_property, property_ids()) if not question.bodies]


def cases_of(question: Property) -> tuple[Any, ...]:
    listed = question.cases(None)
    if isinstance(listed, tuple):
        return listed[:: max(1, len(listed) // EXAMPLES)][:EXAMPLES]
    return draw_cases(listed, seed=f"strangers/{question.id}", examples=EXAMPLES).cases


CASES = {question.id: cases_of(question) for question in QUESTIONS}


@pytest.mark.parametrize("name", STRANGERS)
def test_a_right_formulation_of_a_stranger_is_not_accused_of_anything(name: str) -> None:
    subject = Subject(name, STRANGERS[name])
    for question in QUESTIONS:
        if question.promise(subject.traits) is not True or question.refusal(subject.traits):
            continue
        if question.needs - subject.provides:
            continue
        for case in CASES[question.id]:
            outcome = judge_case(question, case, subject)
            assert not outcome.breach
            assert outcome.verdict in (Verdict.PASS, Verdict.UNDECIDED), f"{question.id}: {outcome.reason}"
