"""Find the first case in space on which a property accuses a formulation of what it promises."""

from functools import cache

from wrong_hard_surfaces import MUTANTS as HARD
from wrong_surface_contact import MUTANTS as CONTACT
from wrong_surfaces import MUTANTS as CELLS

from contactverif import Case, Property, Subject, Verdict, judge_case, load_properties
from contactverif.sampling.draw import Sampling, draw_cases

MUTANTS = CELLS + CONTACT + HARD


@cache
def properties_in_space() -> dict[str, Property]:
    loaded = [question for question in load_properties() if isinstance(question, Property)]
    return {question.id: question for question in loaded if question.cases_in_space is not None}


@cache
def cases(question: Property, examples: int) -> tuple[Case, ...]:
    named = question.cases(None)
    if isinstance(named, tuple):
        return named
    key = Sampling(examples=examples, seed=0).key(question)
    return draw_cases(named, seed=key, examples=examples).cases


def first_accused(question: Property, subject: Subject, examples: int) -> tuple[int, str]:
    """Return the number of the first case that accuses a formulation of what it promises, from 1, and why; else 0."""
    if question.refusal_of(subject) or question.promise(subject.traits) is not True:
        return 0, ""
    question = question.for_traits(subject.traits)
    for number, case in enumerate(cases(question, examples)[:examples], 1):
        outcome = judge_case(question, Case.from_arrays(case.to_arrays()), subject)
        if outcome.verdict in (Verdict.FAIL, Verdict.CRASHED) or outcome.breach:
            return number, outcome.reason
    return 0, ""
