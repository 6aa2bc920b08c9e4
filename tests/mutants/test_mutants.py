"""Every property has a mutant that it catches; every mutant is caught by the property that is meant to catch it."""

from __future__ import annotations

import pytest
from mutate import Mutant, changed_line
from wrong import MUTANTS

from contactverif.property import Property, Verdict
from contactverif.registry import load_formulation, load_properties, property_ids
from contactverif.runner import run
from contactverif.subject import Subject


def the_property(property_id: str) -> Property:
    (found,) = load_properties([property_id])
    assert isinstance(found, Property)
    return found


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_the_mutant_is_caught_by_the_property_that_is_meant_to(mutant: Mutant) -> None:
    found = run([Subject(mutant.name, mutant.make)], [the_property(mutant.caught_by)], profile="ci", examples=100)
    (row,) = found.rows
    assert row.verdict in (Verdict.FAIL, Verdict.CRASHED), row.reason
    assert row.unexpected
    assert not found.passed


def test_every_property_has_its_mutant() -> None:
    assert {mutant.caught_by for mutant in MUTANTS} == set(property_ids())
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS) >= 15


@pytest.mark.parametrize("name", ["vts-ppt-balanced", "vts-me", "nts-ar", "vts-ppt:free_end=extend"])
def test_what_the_mutants_are_made_from_is_not_accused(name: str) -> None:
    subject = load_formulation(name)
    assert isinstance(subject, Subject)
    found = run([subject], [the_property(one) for one in property_ids()], profile="ci", examples=100)
    assert not [(row.question.id, row.unexpected, row.reason) for row in found.rows if row.unexpected]


def test_a_mutant_whose_line_is_gone_says_so() -> None:
    with pytest.raises(AssertionError, match="no line 'no such line'"):
        changed_line("box3", "no such line", "", factory="vts_ppt")
