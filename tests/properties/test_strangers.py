"""No property accuses a stranger's formulation of breaking what it promises; `tox -e trust` asks many more cases."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from subjects import judge_as, load_property
from zoo.on_strips import OnePoint, SegmentPenalty, SimpsonPoints
from zoo.right import STRANGERS

from contactverif import Case, Interface, Subject, Verdict, judge_case
from contactverif.contract.property import Property
from contactverif.plugins.registry import property_ids
from contactverif.sampling.draw import draw_cases

EXAMPLES = 50  # Cases of each property, random or spread over its list
MOST_UNDECIDED = 50
QUESTIONS = [question for question in map(load_property, property_ids()) if not question.bodies]


@cache
def cases_of(question: Property) -> tuple[Any, ...]:
    listed = question.cases(None)
    if isinstance(listed, tuple):
        return listed[:: max(1, len(listed) // EXAMPLES)][:EXAMPLES]
    return draw_cases(listed, seed=f"strangers/{question.id}", examples=EXAMPLES).cases


@pytest.mark.parametrize("name", STRANGERS)
def test_a_right_formulation_of_a_stranger_is_not_accused_of_anything(name: str) -> None:
    subject, undecided = Subject(name, STRANGERS[name]), []
    for question in QUESTIONS:
        if question.promise(subject.traits) is not True or question.refusal_of(subject):
            continue
        if question.needs - subject.provides:
            continue
        for case in cases_of(question):
            outcome = judge_case(question, case, subject)
            assert not outcome.breach
            assert outcome.verdict in (Verdict.PASS, Verdict.UNDECIDED), f"{question.id}: {outcome.reason}"
            if not outcome.decided:
                undecided.append(f"{question.id}: {outcome.reason}")
    assert len(undecided) <= MOST_UNDECIDED, undecided


@pytest.mark.parametrize("property_id", ["tangent.directional", "tangent.sparsity"])
def test_dust_at_a_node_that_a_strip_reaches_by_a_rounding_is_no_wrong_row(property_id: str) -> None:
    """The tangent said 0 and the derivative 1e-18, or the reverse, where the shape of a node is 0 but for roundoff."""
    question, subject = load_property(property_id), Subject("Simpson", SimpsonPoints)
    for number in range(1, 40):
        slave = np.array([[0.0, -0.63], [1.0, -0.44], [4.0, 0.12]]) + [number / 112, 0.0]
        interface = Interface.from_chains(slave, master=[[x, 0.0] for x in (6.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0)])
        case = Case(interface, interface.nodes.reshape(-1), 1.0)
        judge_as(Verdict.PASS, question, case, subject)


@pytest.mark.parametrize("make", [SegmentPenalty, OnePoint])
def test_a_body_behind_that_of_the_slave_is_no_partner(make: Any) -> None:
    """The slave reaches past the master, and there its normal meets another body, 64 diameters behind its own."""
    interface = Interface.from_chains([[1 / 112, -0.375], [113 / 112, -0.125]], [[1.0, 0.0], [0.0, 0.0]])
    case = Case(interface, interface.nodes.reshape(-1), 1.0, seed=359)
    judge_as(Verdict.PASS, load_property("remote"), case, Subject("strips", make))
