"""An audit sees what was forged in a report. `forged_reports.py` forges many more, and counts."""

import random

import pytest
from forged_reports import HARM, KINDS, NUMBERS, Forgery


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Forgery:
    return Forgery(tmp_path_factory.mktemp("forged"))


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in NUMBERS])
def test_an_audit_sees_what_disagrees_with_the_numbers(campaign: Forgery, kind: str) -> None:
    assert campaign.attack(kind, random.Random(kind)) not in HARM


def test_an_audit_sees_most_numbers_of_many(campaign: Forgery) -> None:
    kind = next(kind for kind, count in NUMBERS.items() if count > 1)
    assert campaign.attack(kind, random.Random(1)) != "traceback"
    assert 0.3 < campaign.chance[str(NUMBERS[kind])] < 1
