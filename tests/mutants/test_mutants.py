"""Every property has a mutant that it catches; every mutant is caught by the property that is meant to catch it."""

import csv
import json
from collections.abc import Callable
from dataclasses import fields

import pytest
from subjects import load_property, load_subject
from zoo.killing import (
    CAUGHT_BY,
    KEY,
    KILL_TABLE,
    MUTANTS,
    MUTANTS_IN_SPACE,
    RIGHT_WITHOUT,
    SURVIVORS,
    as_lines,
    cases,
    faces,
    first_accused,
    first_kill,
    first_kill_without_points,
    properties,
    reports_alone,
)
from zoo.making import Mutant, line

from contactverif import Subject, Verdict, judge_case
from contactverif.contract.formulation import ContactPoints
from contactverif.plugins.registry import load_formulation, load_properties
from contactverif.run.run import run

BY_NAME = {mutant.name: mutant for mutant in MUTANTS}
FEW = {"tangent.long": 1}  # States in space of a right formulation, where it is not 4.
# The words for the arrays of contact points in the names of mutants.
WORDS = {
    **{name: name for name in ("position", "normal", "gap", "pressure", "weight")},
    "slave_segment": "slave segment",
    "c": "place on the slave",
    "master_segment": "master segment",
    "xi": "ξ",
    "active": "activity",
    "area_from": "area reported from",
    "area_to": "of the area reported",
    "weighted": "weighted nodes",
    "on_master": "second pass",
}


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_the_mutant_is_caught_by_the_property_that_is_meant_to(
    mutant: Mutant, record_property: Callable[[str, object], None]
) -> None:
    number, looks_at_points = first_kill(mutant)
    record_property(KEY, json.dumps([mutant.name, mutant.caught_by, number]))
    assert number, f"survives {mutant.caught_by}"
    if looks_at_points and not reports_alone(mutant):
        assert bool(first_kill_without_points(mutant)) is (mutant.name not in RIGHT_WITHOUT), "without contact points"


@pytest.mark.parametrize("mutant", MUTANTS_IN_SPACE, ids=lambda mutant: mutant.name)
def test_the_mutant_in_space_is_caught_by_the_property_that_is_meant_to(mutant: Mutant) -> None:
    number, reason = first_accused(properties(True)[mutant.caught_by], Subject(mutant.name, mutant.make), 60)
    assert number, f"survives {mutant.caught_by}"
    print(f"\ncase {number}: {reason}")


@pytest.mark.parametrize("in_space", [False, True])
def test_every_property_has_its_mutant(in_space: bool) -> None:
    mutants = MUTANTS_IN_SPACE if in_space else MUTANTS
    assert {mutant.caught_by for mutant in mutants} == set(properties(in_space))
    assert len({mutant.name for mutant in mutants}) == len(mutants) >= 15


def test_each_array_of_contact_points_has_a_mutant() -> None:
    """The kill matrix says that each of them dies; in the plane there are no shape functions of faces."""
    assert set(WORDS) == {entry.name for entry in fields(ContactPoints)} - {"slave_shape", "master_shape"}
    names = [mutant.name for mutant in MUTANTS if mutant.caught_by.startswith("projection.")]
    assert all(any(word in name for name in names) for word in WORDS.values())


def test_each_remark_on_mutants_without_points_is_about_one_of_them() -> None:
    remarks = [*CAUGHT_BY, *RIGHT_WITHOUT]
    assert set(remarks) <= set(BY_NAME)
    assert len(set(remarks)) == len(remarks)
    assert not [name for name in remarks if reports_alone(BY_NAME[name])]


def test_a_mutant_whose_property_is_missing_survives() -> None:
    """Once `tox -e trust` catches one of them, it is no survivor any more."""
    with KILL_TABLE.open(encoding="utf-8", newline="") as stream:
        rows = {row["mutant"]: row for row in csv.DictReader(stream)}
    for mutant in SURVIVORS:
        assert not any(cell.isdigit() for cell in rows[f"survives: {mutant.name}"].values())


def test_a_run_accuses_a_mutant_and_shrinks_its_case() -> None:
    mutant = BY_NAME["ξ of the last segment from its other end"]
    result = run([Subject(mutant.name, mutant.make)], [load_property(mutant.caught_by)], profile="ci")
    (row,) = result.rows
    assert row.unexpected == "promised to pass, but fails"
    assert not result.promises_kept
    assert row.shrunk is not None
    assert row.shrunk.verdict is Verdict.FAIL
    interface = row.shrunk.case.interface
    assert len(interface.slave) + len(interface.master) <= 6


def test_a_mutant_that_changes_the_mesh_lets_no_other_formulation_fail() -> None:
    mutant = BY_NAME["interface modified"]
    innocent = load_formulation("vts-ppt-balanced:area=reference")
    questions = load_properties(["patch.*", "purity"])
    result = run([Subject(mutant.name, mutant.make), innocent], questions, examples=40, seed=1)
    assert {row.formulation for row in result.rows if row.unexpected} == {mutant.name}


# `test_verdicts.py` judges those without options.
@pytest.mark.parametrize("name", ["vts-me:n=3", "vts-ppt:free_end=extend", "vts-ppt-balanced:n=3,area=reference"])
def test_what_the_mutants_are_made_from_is_not_accused(name: str) -> None:
    subject = load_subject(name)
    decided = planned = 0
    for question in properties().values():
        if question.promise(subject.traits) is not True or question.refusal_of(subject):
            continue
        examples = 10 if question.bodies else 40  # Scenes are slow, and `test_verdicts.py` asks more of each.
        planned += len(cases(question, examples))
        for case in cases(question, examples):
            outcome = judge_case(question, case, subject)
            assert outcome.verdict in (Verdict.PASS, Verdict.UNDECIDED), (question.id, outcome.reason, case)
            decided += outcome.decided
    assert decided >= 0.95 * planned
    assert planned >= 400


@pytest.mark.parametrize("name", faces.RIGHT)
def test_no_right_formulation_on_faces_is_accused(name: str) -> None:
    for question in properties(True).values():
        number, reason = first_accused(question, load_subject(name), FEW.get(question.id, 4))
        assert not number, f"{question.id}, case {number}: {reason}"


def test_a_mutant_whose_line_is_gone_says_so() -> None:
    with pytest.raises(AssertionError, match="no line 'no such line'"):
        line("gone", "units", "vts_ppt_force", "no such line", "")


def test_the_matrix_marks_what_was_meant_and_what_survives() -> None:
    lines = as_lines(
        {"caught": ("a.b", {"a.b": 3, "c.d": 1, "c.e": 0}), "not": ("c.e", {"a.b": 0, "c.d": None, "c.e": 0})}
    )
    assert [line.split() for line in lines] == [
        ["a", "d", "e"],
        ["caught", "[3]", "1", "·"],
        ["not", "·", "?", "[]"],
        ["caught", "1", "1", "0"],
    ]
