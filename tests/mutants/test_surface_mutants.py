"""Each property in space has a mutant that it catches, and no right formulation is accused of what it promises."""

import pytest
from face_killing import MUTANTS, first_accused, properties_in_space
from mutate import Mutant
from subjects import load_subject
from wrong_surfaces import RIGHT

from contactverif import Subject

EXAMPLES = 60
FEW = {"tangent.long": 1}  # States of a right formulation, where it is not 4.


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_the_mutant_is_caught_by_the_property_that_is_meant_to(mutant: Mutant) -> None:
    question = properties_in_space()[mutant.caught_by]
    number, reason = first_accused(question, Subject(mutant.name, mutant.make), EXAMPLES)
    assert number, f"survives {mutant.caught_by}"
    print(f"\ncase {number}: {reason}")


def test_every_property_in_space_has_its_mutant() -> None:
    assert {mutant.caught_by for mutant in MUTANTS} == set(properties_in_space())
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS)


@pytest.mark.parametrize("name", RIGHT)
def test_no_right_formulation_is_accused(name: str) -> None:
    subject = load_subject(name)
    for question in properties_in_space().values():
        number, reason = first_accused(question, subject, FEW.get(question.id, 4))
        assert not number, f"{question.id}, case {number}: {reason}"
