"""A forged journal is not believed. `forged_journals.py` forges many more."""

import random

import pytest
from forged_journals import HARM, KINDS, Forgery

N_FORGED = 2
NAMED = ("other numbers", "records of another seed")  # The kinds that differ in numbers, so that a line names them.


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Forgery:
    return Forgery(tmp_path_factory.mktemp("forged"))


@pytest.mark.parametrize("kind", KINDS)
def test_a_forged_journal_is_not_believed(campaign: Forgery, kind: str) -> None:
    endings = [campaign.attack(kind, random.Random(f"{kind}/{number}")) for number in range(N_FORGED)]
    assert not HARM & {*endings}
    if kind in NAMED:
        assert {*endings} == {"named"}
