"""The right formulation keeps its promises; each mistake put into it is caught, and its diagnosis names it."""

import re
from collections.abc import Callable
from typing import Any

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
    "scaling",
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
