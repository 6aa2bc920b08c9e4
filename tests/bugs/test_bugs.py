"""The right formulation keeps its promises; each mistake put into it is caught, and its diagnosis names it."""

import csv
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import bugs_campaign
import pytest
from fresh_bugs import FRESH, NOT_NAMED
from further_bugs import FURTHER
from later_bugs import LATER
from springs_with_bugs import BUGS, Springs
from unseen_bugs import UNSEEN

from contactverif import Run, Subject, load_properties
from contactverif.run.run import run

# What `verify` asks first, and the patch test of nodes and the tangent, which catch what those leave.
QUESTIONS = (
    "purity",
    "unilateral",
    "units",
    "balance.force",
    "balance.moment",
    "patch.flat.resultant",
    "patch.flat.transmission",
    "patch.flat.nodal",
    "tangent.directional",
    "hard.touch",
    "remote",
)
EVERY = BUGS | UNSEEN | LATER | FURTHER | FRESH
del EVERY["averaged-gaps-as-nodal"]  # It converges like others, and breaks no promise.


TABLE = Path(__file__).parents[2] / "reports" / "trust" / "bugs.csv"


def stored_table() -> dict[str, dict[str, str]]:
    with TABLE.open(encoding="utf-8", newline="") as file:
        return {line["formulation"]: line for line in csv.DictReader(file)}


def test_the_stored_screens_are_short_and_name_the_mistakes_that_they_say() -> None:
    table, (right, *mistakes) = stored_table(), [bugs_campaign.RIGHT, *bugs_campaign.EVERY]
    assert list(table) == [right, *mistakes]
    assert (table[right]["status"], table[right]["diagnosis"], int(table[right]["lines"]) <= 25) == ("0", "", True)
    assert max(int(table[name]["lines"]) for name in mistakes) <= 60
    page = TABLE.with_suffix(".md").read_text(encoding="utf-8")
    for words, names, least in (("the twelve", BUGS, 11), ("the eight", FRESH, 5)):
        named = [name for name in names if table[name]["named"] == "yes"]
        assert len(named) >= least
        assert f"Of {words}, {len(named)} are named" in page


@pytest.mark.parametrize("name", [name for name, line in stored_table().items() if line["diagnosis"]])
def test_a_stored_diagnosis_that_names_the_mistake_has_its_words(name: str) -> None:
    _, words = bugs_campaign.EVERY[name]
    line = stored_table()[name]
    assert line["named"] != "yes" or words == NOT_NAMED or re.search(words, line["diagnosis"])


def judge(name: str, make: Callable[..., Any]) -> Run:
    return run([Subject(name, make)], load_properties(QUESTIONS), examples=10, seed=1, shrink="none")


def test_the_right_formulation_keeps_its_promises_and_hears_nothing() -> None:
    result = judge("right", Springs)
    assert result.promises_kept
    assert not result.diagnoses


@pytest.mark.parametrize("name", EVERY)
def test_each_mistake_is_caught_and_named(name: str) -> None:
    make, words = EVERY[name]
    result = judge(name, make)
    assert not result.promises_kept
    assert words == NOT_NAMED or re.search(words, result.diagnoses.get(name, "")), result.diagnoses
