"""Each property in space has a mutant that it catches, and no right formulation is accused of what it promises."""

from functools import cache

import pytest
from mutate import Mutant
from subjects import load_subject
from wrong_hard_surfaces import MUTANTS as HARD
from wrong_surface_contact import MUTANTS as CONTACT
from wrong_surfaces import MUTANTS as CELLS
from wrong_surfaces import RIGHT

from contactverif import Case, Property, Subject, Verdict, judge_case, load_properties
from contactverif.sampling.draw import Sampling, draw_cases

MUTANTS = CELLS + CONTACT + HARD
EXAMPLES = 60
FEW = {"tangent.long": 1}  # States of a right formulation, where it is not 4.


@cache
def properties_in_space() -> dict[str, Property]:
    loaded = [question for question in load_properties() if isinstance(question, Property)]
    return {question.id: question for question in loaded if question.cases_in_space is not None}


@cache
def cases(question: Property) -> tuple[Case, ...]:
    named = question.cases(None)
    if isinstance(named, tuple):
        return named
    key = Sampling(examples=EXAMPLES, seed=0).key(question)
    return draw_cases(named, seed=key, examples=EXAMPLES).cases


def first_accusation(question: Property, subject: Subject, examples: int) -> str:
    """Return why a formulation is accused of what it promises, with the number of the case, or an empty string."""
    if question.refusal_of(subject) or question.promise(subject.traits) is not True:
        return ""
    question = question.for_traits(subject.traits)
    for number, case in enumerate(cases(question)[:examples]):
        outcome = judge_case(question, Case.from_arrays(case.to_arrays()), subject)
        if outcome.verdict in (Verdict.FAIL, Verdict.CRASHED) or outcome.breach:
            return f"case {number}: {outcome.reason}"
    return ""


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_the_mutant_is_caught_by_the_property_that_is_meant_to(mutant: Mutant) -> None:
    question = properties_in_space()[mutant.caught_by]
    accusation = first_accusation(question, Subject(mutant.name, mutant.make), EXAMPLES)
    assert accusation, f"survives {mutant.caught_by}"
    print(f"\n{accusation}")


def test_every_property_in_space_has_its_mutant() -> None:
    assert {mutant.caught_by for mutant in MUTANTS} == set(properties_in_space())
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS)


@pytest.mark.parametrize("name", RIGHT)
def test_no_right_formulation_is_accused(name: str) -> None:
    subject = load_subject(name)
    for question in properties_in_space().values():
        assert not first_accusation(question, subject, FEW.get(question.id, 4)), question.id
