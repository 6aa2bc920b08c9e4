"""One case of each property, drawn beforehand and judged, beside the yardstick: a fixed piece of numpy."""

from typing import Any

import pytest
from racing import Race
from subjects import load_property, load_subject

from contactverif import Case, Property, Subject, Verdict, judge_case
from contactverif.plugins.registry import property_ids
from contactverif.sampling.draw import Sampling, draw_cases
from contactverif.studies.bench.cell_runs import time_yardstick

FORMULATIONS = ("vts-ppt", "mortar-lm", "nts")  # The first to which the property applies is judged.
N_DRAWN = 4  # The first cases are the simplest; the last of these is judged.


def subject_for(question: Property) -> Subject:
    """Return the formulation that is judged by a property."""
    for subject in map(load_subject, FORMULATIONS):
        if not question.refusal(subject.traits) and question.needs <= subject.provides:
            return subject
    raise AssertionError(f"{question.id} applies to none of {FORMULATIONS}")


def case_of(question: Property) -> Case:
    """Return a random case, or the first of a list."""
    sampling = Sampling(N_DRAWN, 1)
    source = sampling.source(question)
    assert source is not None
    cases = draw_cases(source, seed=sampling.key(question), examples=N_DRAWN).cases
    return cases[0] if isinstance(source, tuple) else cases[-1]


@pytest.mark.parametrize("property_id", property_ids())
def test_one_case(race: Race, benchmark: Any, property_id: str) -> None:
    benchmark.group = "one case of a property"
    question = load_property(property_id)
    case, subject = case_of(question), subject_for(question)
    assert judge_case(question, case, subject).verdict in (Verdict.PASS, Verdict.FAIL)
    race(lambda: judge_case(question, case, subject), time_yardstick, "the yardstick of `contactverif bench`")
