"""One case of each property, drawn beforehand and judged, beside the yardstick: a fixed piece of numpy."""

from typing import Any

import numpy as np
import pytest
from racing import Race
from subjects import load_property, load_subject

from contactverif import Case, Property, Subject, Verdict, judge_case
from contactverif.plugins.registry import property_ids
from contactverif.sampling.draw import Sampling, draw_cases

FORMULATIONS = ("vts-ppt", "mortar-lm", "nts")  # The first to which the property applies is judged.
N_DRAWN = 4  # The first cases are the simplest; the last of these is judged.


def work_as_newton_does() -> None:
    """Take small steps of numpy, and solve a linear system."""
    values, matrix = np.linspace(1.0, 2.0, 64), np.eye(64) + 1 / np.add.outer(np.arange(1.0, 65.0), np.arange(64.0))
    for _ in range(100):
        values = np.sqrt(values * values[::-1])
    np.linalg.solve(matrix, values)


def subject_for(question: Property) -> Subject:
    """Return the formulation that is judged by a property."""
    for subject in map(load_subject, FORMULATIONS):
        if not question.refusal_of(subject) and question.needs <= subject.provides:
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
    race(
        lambda: judge_case(question, case, subject),
        work_as_newton_does,
        "the yardstick: small steps of numpy, and a linear system",
    )
